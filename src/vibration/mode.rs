//! A mode of vibration with its kind and plane, and the modes about a state, with a summary as text.
//!
//! [`Mode`] has the angular frequency, rad/s; for a mode that grows without vibrating it is minus the growth rate, 1/s.
//! It has the [`ModePlane`] (in or out of the plane of the scene), the dominant deformation ([`ModeKind`]), and the
//! number among the modes of its plane. Its shape is the displacements of all nodes, the longest of length 1. Under
//! loads without a potential it also has a growth rate. [`Modes`] has the modes in ascending order of frequency, and
//! the state about which they vibrate ([`LinearizationPoint`]: equilibrium or rest shape). It also has the numbers of
//! unstable and marginal motions, and warnings. [`Modes::summary`] writes them as a table with Hz and rad/s. The modes
//! are computed in `modes`.

use crate::code::Code;
use crate::scene::Resolution;
use crate::summary::quantity::{self, number, signed_percent};
use crate::summary::{Summary, SummaryTable, TextColumn, Tone};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Significant digits of frequencies in the terminal table.
const DIGITS: usize = 7;

/// The state about which vibrations are linearized.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum LinearizationPoint {
    /// The equilibrium under the loads.
    #[default]
    Equilibrium,
    /// The rest shape, regardless of the loads.
    Rest,
}

/// Plane of a mode relative to the plane of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum ModePlane {
    /// The mode moves in the plane of the scene.
    In,
    /// The mode moves out of the plane, or twists.
    Out,
}

/// Kind of a mode by its elastic energy and motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ModeKind {
    /// Bending mode.
    Bending,
    /// Twist mode.
    Torsion,
    /// Stretch mode along the rod.
    Axial,
    /// Rigid motion: free at frequency zero, or held by loads as a pendulum.
    Rigid,
}

impl ModeKind {
    /// The name of the kind in fit files: `bending`, `torsion`, `axial` or `rigid`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bending => "bending",
            Self::Torsion => "torsion",
            Self::Axial => "axial",
            Self::Rigid => "rigid",
        }
    }
}

/// A mode of vibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Mode {
    /// Angular frequency, rad/s; for an unstable mode minus its growth rate, 1/s. Zero without resistance, as for rigid
    /// motions of a free rod.
    pub frequency_rad_s: f64,
    /// Growth rate of the undamped mode, 1/s, negative if it decays; absent if all loads have a potential.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub growth_rate_1_s: Option<f64>,
    /// In or out of the plane of the scene; absent in spatial scenes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plane: Option<ModePlane>,
    /// Dominant deformation.
    pub kind: ModeKind,
    /// Estimated relative error of the frequency by a mesh that the scene gives, negative if the frequency is too low.
    /// Absent for a mesh that the program chose, for free motions, and without an estimate
    /// ([`Problem::add_mesh_errors`](crate::Problem::add_mesh_errors)).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh_error: Option<f64>,
    /// Number among the modes of its plane, from 1 on, as measured frequencies name it; absent for free motions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
    /// Displacement of every node in world axes; the largest is 1. Zero in torsion.
    pub shape: Vec<[f64; 3]>,
}

impl Mode {
    /// Whether the mode is unstable: its frequency is negative (minus a growth rate), or its growth rate is above zero.
    pub(super) fn is_growing(&self) -> bool {
        self.frequency_rad_s < 0.0 || self.growth_rate_1_s.is_some_and(|rate| rate > 0.0)
    }
}

/// Lowest vibration modes about the equilibrium or the rest shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Modes {
    /// The state that the rod vibrates about.
    pub about: LinearizationPoint,
    /// Number of unstable directions. The modes include the first 200 of either plane, or as many as requested.
    pub unstable: usize,
    /// Number of directions that deform the rod without a measurable stiffness, as at a critical load.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub marginal: usize,
    /// Angular frequencies in and out of the plane, ascending, rad/s; unstable modes are first, with negative growth
    /// rates, 1/s.
    pub frequencies_rad_s: Vec<f64>,
    /// Growth rates of the undamped modes under follower loads, or moments in space, in the order of the frequencies,
    /// 1/s. One above zero is that of flutter or, with a negative frequency, of divergence. Absent without such loads.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub growth_rates_1_s: Vec<f64>,
    /// Modes, in the order of the frequencies.
    pub modes: Vec<Mode>,
    /// The mesh that the command chose, and the relative error of a frequency; absent for a stated mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Resolution>,
    /// Reasons to doubt the result: a coarse mesh, values that suggest other units than SI, large strains.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// The codes of the warnings, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warning_codes: Vec<Code>,
}

/// Whether a count is zero, so that the JSON omits it.
fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl std::fmt::Display for Modes {
    /// Writes the [summary](Self::summary) without colors.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.summary().fmt(f)
    }
}

impl Modes {
    /// The result as text for a terminal. Headline: number of frequencies and state; for an unstable rod first the
    /// number of unstable modes, and that of the listed ones if it differs. Below it a table of modes, warnings
    /// (marginal modes, coarse mesh, implausible values), and numerics if the command chose or checked them.
    pub fn summary(&self) -> Summary {
        let about = match self.about {
            LinearizationPoint::Equilibrium => "the equilibrium under the loads",
            LinearizationPoint::Rest => "the rest shape",
        };
        // Headline: number of frequencies, or of unstable modes.
        let listed = self.modes.iter().filter(|mode| mode.is_growing()).count();
        let counted = match self.modes.len() - listed {
            1 => "1 natural frequency".to_string(),
            n => format!("{n} natural frequencies"),
        };
        let summary = match self.unstable {
            0 => Summary::new(format!("{counted} about {about}"), Tone::Good),
            n => {
                let modes = quantity::counted(n, "mode");
                let few = if n == listed { String::new() } else { format!(", {listed} listed") };
                Summary::new(format!("unstable: {modes}{few}; {counted} about {about}"), Tone::Bad)
            }
        };
        let mut warnings = Vec::new();
        if self.marginal > 0 {
            let words = format!(
                "marginal: {} without a measurable stiffness. The rod is at a stability limit, and the lowest \
                 frequencies are rounding errors. Change the load or the support slightly.",
                quantity::counted(self.marginal, "mode")
            );
            warnings.push(Code::Marginal.behind(words));
        }
        let resolution = self.resolution.as_ref();
        let coarse = resolution.and_then(|resolution| resolution.warning_over("a frequency"));
        warnings.extend(coarse.map(|(code, words)| code.behind(words)));
        warnings.extend(self.warnings.iter().cloned());
        let summary = summary.table("", self.table()).warnings(warnings).naming_warnings();
        match resolution {
            Some(resolution) => summary.fact("Numerics", resolution.words_over("a frequency")),
            None => summary,
        }
    }

    /// The number of each mode among those of its kind and plane, by which a measured frequency with a `kind` names it;
    /// none of free motions.
    fn numbers_of_kind(&self) -> Vec<Option<usize>> {
        let number = |k: usize| {
            let own = &self.modes[k];
            let is_alike = |other: &&Mode| {
                other.number.is_some() && other.kind == own.kind && other.plane == own.plane
            };
            own.number.map(|_| self.modes[..=k].iter().filter(is_alike).count())
        };
        (0..self.modes.len()).map(number).collect()
    }

    /// A table with a row per mode, in ascending order: frequency in Hz and rad/s, or for unstable modes the growth
    /// rate, 1/s; for flutter both. Then follow the estimated error of a given mesh, the direction relative to the
    /// plane (empty in space), the kind, and the number (empty for free motions). Where that differs for any mode, the
    /// number among the modes of its kind follows.
    fn table(&self) -> SummaryTable {
        let of_kind = self.numbers_of_kind();
        let differs = self.modes.iter().zip(&of_kind).any(|(mode, own)| mode.number != *own);
        let mut columns = vec![
            TextColumn::right("Hz"),
            TextColumn::right("rad/s"),
            TextColumn::right("growth rate, 1/s"),
            TextColumn::right("mesh error"),
            TextColumn::left("direction"),
            TextColumn::left("kind"),
            TextColumn::right("number"),
        ];
        if differs {
            columns.push(TextColumn::right("of its kind"));
        }
        let mut table = SummaryTable::new(columns);
        for (mode, of_kind) in self.modes.iter().zip(of_kind) {
            let plane = match mode.plane {
                Some(ModePlane::In) => "in plane",
                Some(ModePlane::Out) => "out of plane",
                None => "",
            };
            let w = mode.frequency_rad_s;
            let [hz, rad, growth] = match w < 0.0 {
                true => [String::new(), "unstable".into(), number(-w, DIGITS)],
                false => {
                    let growth = mode.growth_rate_1_s.filter(|rate| *rate != 0.0);
                    let growth = growth.map(|rate| number(rate, DIGITS)).unwrap_or_default();
                    [number(w / TAU, DIGITS), number(w, DIGITS), growth]
                }
            };
            let error = mode.mesh_error.map(signed_percent).unwrap_or_default();
            let text = |n: Option<usize>| n.map(|n| n.to_string()).unwrap_or_default();
            let (plane, kind) = (plane.into(), mode.kind.name().into());
            let mut row = vec![hz, rad, growth, error, plane, kind, text(mode.number)];
            row.extend(differs.then(|| text(of_kind)));
            table.row(row);
        }
        table
    }
}

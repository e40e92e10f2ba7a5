//! Small vibrations: the lowest frequencies and shapes about a state.
//!
//! `K v = omega^2 M v` with the exact tangent `K` at the state (`pencil`), solved
//! for the lowest (`lowest`) and for all unstable ones. A planar scene that says how stiff the rod is
//! in torsion vibrates out of its plane too; those modes are found apart from the plane's, so that
//! equal frequencies do not mix.
//!
//! Every mode is told by its plane and by its [`Kind`], and has a number among those of its plane:
//! what a measured frequency is named by ([`ModeName`]). Free motions, of a rod that nothing holds
//! or that turns in a hinge, have no number.

use crate::code::Code;
use crate::error::Error;
use crate::numerics::tangent::Tangent;
use crate::numerics::total_order;
use crate::numerics::vector::{dot, sub, unit};
use crate::problem::Model;
use crate::problem::{
    AnyProblem, Discretized, FramesOf, PlanarProblem, Problem, Purpose, SpatialProblem,
};
use crate::rod::Rod;
use crate::rod::TangentOf;
use crate::scene::{End, Resolution, Support};
use crate::statics::{
    MAX_UNCERTAIN, OutOfPlaneTangent, Pencil, Stability, UNCERTAIN_LEVELS, linear_combination,
    spatial_motion,
};
use crate::summary::quantity::number;
use crate::summary::{Summary, SummaryTable, TextColumn, Tone};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::Range;

/// Unstable directions beyond those asked for are listed up to so many.
const UNSTABLE: usize = 200;
/// Significant digits of frequencies on the terminal.
const DIGITS: usize = 7;

/// The state vibrations are about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum LinearizationPoint {
    /// Where the rod hangs under its loads.
    #[default]
    Equilibrium,
    /// The rest shape, whatever the loads.
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
    /// As fit files name it.
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
    /// Angular frequency, rad/s; of an unstable direction minus its growth rate, 1/s. Zero where
    /// nothing resists, such as a free rod's motion as a rigid body.
    pub frequency_rad_s: f64,
    /// Which way it goes; absent in spatial scenes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plane: Option<ModePlane>,
    /// What resists it.
    pub kind: ModeKind,
    /// Its number among the modes of its plane, from 1 on, as measured frequencies name it; absent
    /// where it moves freely.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
    /// Displacement of every node in world axes; the largest is 1. Zero in torsion.
    pub shape: Vec<[f64; 3]>,
}

/// The lowest modes about a state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Modes {
    /// The state that the rod vibrates about.
    pub about: LinearizationPoint,
    /// How many directions are unstable; the first 200 of either plane, or as many as were asked
    /// for, are among the modes.
    pub unstable: usize,
    /// How many directions deform the rod without a measurable stiffness, as at a critical load.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub marginal: usize,
    /// Angular frequencies, ascending, in and out of plane, rad/s; unstable directions first, as
    /// minus their growth rates.
    pub frequencies_rad_s: Vec<f64>,
    /// The modes, in the same order.
    pub modes: Vec<Mode>,
    /// The mesh, where the command chose it for these modes, and what it is worth: an error of a frequency over it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Resolution>,
    /// What makes the result doubtful: numbers that look like other units than SI.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// The codes of the warnings, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warning_codes: Vec<Code>,
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl Problem {
    /// The `count` lowest modes about a state, and all unstable ones.
    ///
    /// # Errors
    /// Those of [`equilibrium`](Problem::equilibrium), about it.
    pub fn modes(&self, count: usize, about: LinearizationPoint) -> Result<Modes, Error> {
        let (mut modes, mut all) = (Vec::new(), Stability::default());
        match self.discretized() {
            AnyProblem::Planar(discretized) => {
                let (q, ()) = state(&discretized, about)?;
                all += Vibrating::of(&discretized, &q, &())?.add(count, &mut modes)?;
                if self.can_twist() {
                    let model = self.spatial_model()?;
                    let spatial = self.discretized_as(&model);
                    let (q, frames) = across(&discretized, &spatial, &q);
                    all += Vibrating::across(&spatial, &q, &frames)?.add(count, &mut modes)?;
                }
            }
            AnyProblem::Spatial(discretized) => {
                let (q, frames) = state(&discretized, about)?;
                all += Vibrating::of(&discretized, &q, &frames)?.add(count, &mut modes)?;
            }
        }
        modes.sort_by_cached_key(|x| total_order(x.frequency_rad_s));
        let growing = modes.iter().filter(|mode| mode.frequency_rad_s < 0.0).count();
        modes.truncate(count.max(growing));
        let frequencies_rad_s = modes.iter().map(|mode| mode.frequency_rad_s).collect();
        let notes = self.plausibility_notes(Purpose::Modes);
        let warnings = notes.iter().map(|(code, words)| code.behind(words)).collect();
        let warning_codes = notes.iter().map(|(code, _)| *code).collect();
        let resolution = None;
        let Stability { unstable, marginal } = all;
        Ok(Modes {
            about,
            unstable,
            marginal,
            frequencies_rad_s,
            modes,
            resolution,
            warnings,
            warning_codes,
        })
    }
}

pub(super) type State<M> = (Vec<f64>, FramesOf<M>);

pub(super) fn state<M: Model>(
    discretized: &Discretized<'_, M>,
    about: LinearizationPoint,
) -> Result<State<M>, Error> {
    Ok(match about {
        LinearizationPoint::Rest => (discretized.rest(), discretized.rest_frames()),
        LinearizationPoint::Equilibrium => {
            let rest = discretized.equilibrium()?;
            (rest.q, rest.frames)
        }
    })
}

/// The state in space of a planar problem that is at `q`.
pub(crate) fn across(
    planar: &PlanarProblem<'_>,
    spatial: &SpatialProblem<'_>,
    q: &[f64],
) -> (Vec<f64>, crate::energy::frame::Frames<f64>) {
    let place = |i: usize| planar.model.position(q, i);
    spatial.placed_still(&(0..planar.nodes()).map(place).collect::<Vec<_>>())
}

/// A vibration in the terms of its [`Pencil`].
#[derive(Clone, Debug)]
pub(crate) struct Eigenpair {
    /// Square of the angular frequency, 1/s^2.
    pub squared: f64,
    /// Rates of the pencil's unknowns.
    pub vector: Vec<f64>,
    /// What resists it.
    pub kind: ModeKind,
    /// Displacements of all nodes in world axes; the largest is 1.
    pub shape: Vec<[f64; 3]>,
}

impl Eigenpair {
    /// As in [`Mode::frequency_rad_s`].
    pub fn frequency(&self) -> f64 {
        self.squared.signum() * self.squared.abs().sqrt()
    }

    /// Whether it is a free motion, without a number.
    pub fn is_free(&self) -> bool {
        self.squared == 0.0 && self.kind == ModeKind::Rigid
    }
}

/// A rod at a state whose vibrations are looked at: all of its model's, or those across the plane.
pub(crate) struct Vibrating<'a, M: Model, T: Tangent<f64>> {
    pub(super) discretized: &'a Discretized<'a, M>,
    pub(super) q: &'a [f64],
    pub(super) frames: &'a FramesOf<M>,
    pub(super) pencil: Pencil<f64, T>,
    /// How many of the modes are unstable, or marginal.
    stability: Stability,
    /// Which way the vibrations of a planar scene go.
    pub plane: Option<ModePlane>,
}

impl<'a, M: Model> Vibrating<'a, M, TangentOf<M::Rod<f64>, f64>> {
    /// All vibrations of a model.
    pub fn of(
        discretized: &'a Discretized<'a, M>,
        q: &'a [f64],
        frames: &'a FramesOf<M>,
    ) -> Result<Self, Error> {
        let pencil = Pencil::at(discretized, &discretized.rod(), q, frames);
        let resting = Pencil::resting(discretized, q, frames);
        let stability = discretized.stability((q, frames), &resting, <[f64]>::to_vec)?;
        let plane = (M::STRIDE < 3).then_some(ModePlane::In);
        Ok(Self { discretized, q, frames, pencil, stability, plane })
    }
}

impl<'a> Vibrating<'a, crate::problem::SpatialModel, OutOfPlaneTangent<f64>> {
    /// The vibrations out of the plane of a planar problem, of its spatial model.
    pub fn across(
        discretized: &'a SpatialProblem<'a>,
        q: &'a [f64],
        frames: &'a crate::energy::frame::Frames<f64>,
    ) -> Result<Self, Error> {
        let normal = discretized.model.components(discretized.normal());
        let pencil = Pencil::at(discretized, &discretized.rod(), q, frames).across(normal);
        let resting = Pencil::resting(discretized, q, frames).across(normal);
        let stability =
            discretized.stability((q, frames), &resting, |x| spatial_motion(x, normal))?;
        Ok(Self { discretized, q, frames, pencil, stability, plane: Some(ModePlane::Out) })
    }
}

impl<M: Model, T: Tangent<f64>> Vibrating<'_, M, T> {
    /// How many modes there are.
    pub fn available(&self) -> usize {
        self.pencil.order()
    }

    /// In how many ways at most it moves freely.
    pub fn most_free(&self) -> usize {
        let supports = &self.discretized.scene().supports;
        let clamped = [End::Start, End::End].into_iter().any(|end| match supports.at(end) {
            Support::Recorded => !supports.turns_freely(end),
            support => support == Support::Clamped,
        });
        match (clamped, self.plane) {
            (true, _) => 0,
            (false, Some(_)) => 3,
            (false, None) => 6,
        }
    }

    /// The mass of every node, kg.
    pub fn node_masses(&self) -> Vec<f64> {
        let rod = self.discretized.rod();
        (0..self.discretized.nodes()).map(|i| rod.mass()[M::STRIDE * i]).collect()
    }

    /// The `count` lowest modes, in ascending order.
    pub fn lowest(&self, count: usize) -> Result<Vec<Eigenpair>, Error> {
        let zero = self.discretized.zero_squared_frequency();
        let scale = self.discretized.bending_frequency_squared();
        let mut found = self.pencil.lowest(count, scale)?;
        let refined = self.refine(&mut found, zero + scale * self.discretized.tangent_rounding());
        let pair = |(k, (squared, vector)): (usize, (f64, Vec<f64>))| {
            let is_zero = !refined.contains(&k)
                && k >= self.stability.unstable
                && squared <= zero.max(self.pencil.rounding(&vector));
            let squared = if is_zero { 0.0 } else { squared };
            let rates = self.in_model(&vector);
            let shape = self.shape(&rates);
            Eigenpair { squared, kind: self.kind(squared, &rates, &shape), shape, vector }
        };
        Ok(found.into_iter().enumerate().map(pair).collect())
    }

    /// Makes squared frequencies, 1/s^2, whose signs rounding errors hide exact, those at zero zero; returns their places.
    fn refine(&self, found: &mut [(f64, Vec<f64>)], rounding: f64) -> Range<usize> {
        let level = UNCERTAIN_LEVELS * rounding;
        let first = found.iter().position(|(squared, _)| squared.abs() <= level).unwrap_or(0);
        let last =
            found.iter().rposition(|(squared, _)| squared.abs() <= level).map_or(0, |k| k + 1);
        let places = first..last.max(first);
        if places.is_empty()
            || places.len() > MAX_UNCERTAIN
            || self.discretized.edge_coordinates().is_some()
        {
            return 0..0;
        }
        let vectors: Vec<Vec<f64>> = found[places.clone()].iter().map(|(_, x)| x.clone()).collect();
        let motions: Vec<Vec<f64>> = vectors.iter().map(|x| self.in_model(x)).collect();
        let stiffnesses = self.discretized.stiffnesses((self.q, self.frames), &motions);
        for (place, stiffness) in places.clone().zip(stiffnesses) {
            let squared = if stiffness.is_zero() { 0.0 } else { stiffness.value };
            found[place] = (squared, linear_combination(&vectors, &stiffness.combination));
        }
        found[places.clone()].sort_by_cached_key(|x| total_order(x.0));
        places
    }

    /// A vector over the pencil's unknowns as one over those of the model.
    pub(super) fn in_model(&self, vector: &[f64]) -> Vec<f64> {
        match self.plane {
            Some(ModePlane::Out) => {
                spatial_motion(vector, self.discretized.model.components(self.discretized.normal()))
            }
            _ => vector.to_vec(),
        }
    }

    fn kind(&self, squared: f64, rates: &[f64], shape: &[[f64; 3]]) -> ModeKind {
        let motion = self.discretized.motion((self.q, self.frames), rates);
        if motion.is_rigid() || squared == 0.0 && motion.is_spin() {
            return ModeKind::Rigid;
        }
        let [stretch, bend, twist] = motion.energies;
        match () {
            () if twist > bend.max(stretch) => ModeKind::Torsion,
            () if stretch > bend && self.goes_along(shape) => ModeKind::Axial,
            () => ModeKind::Bending,
        }
    }

    /// Whether the rod moves along itself, by more than half of the kinetic energy. What pulls a
    /// sagging rope's sides stretches it, too.
    fn goes_along(&self, shape: &[[f64; 3]]) -> bool {
        let (masses, last) = (self.node_masses(), shape.len() - 1);
        let place = |i: usize| self.discretized.model.position(self.q, i);
        let mut sums = [0.0; 2];
        for (i, (x, mass)) in shape.iter().zip(masses).enumerate() {
            let tangent = unit(sub(place(last.min(i + 1)), place(i.saturating_sub(1))));
            sums[0] += mass * dot(*x, tangent).powi(2);
            sums[1] += mass * dot(*x, *x);
        }
        sums[0] > 0.5 * sums[1]
    }

    fn shape(&self, rates: &[f64]) -> Vec<[f64; 3]> {
        let mut shape: Vec<[f64; 3]> =
            (0..self.discretized.nodes()).map(|i| self.discretized.model.rate(rates, i)).collect();
        let largest =
            shape.iter().map(|x| Vector3::from(*x).norm()).fold(f64::MIN_POSITIVE, f64::max);
        shape.iter_mut().flatten().for_each(|x| *x /= largest);
        shape
    }

    /// Adds the `count` lowest modes, and all unstable ones; returns how many those are, or are marginal.
    fn add(&self, count: usize, modes: &mut Vec<Mode>) -> Result<Stability, Error> {
        let pairs = self.lowest(count.max(self.stability.unstable.min(UNSTABLE)))?;
        let mut number = 0;
        for pair in pairs {
            number += usize::from(!pair.is_free());
            modes.push(Mode {
                frequency_rad_s: pair.frequency(),
                plane: self.plane,
                kind: pair.kind,
                number: (!pair.is_free()).then_some(number),
                shape: pair.shape,
            });
        }
        Ok(self.stability)
    }
}

impl std::fmt::Display for Modes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.summary().fmt(f)
    }
}

impl Modes {
    /// The result as text for a terminal.
    pub fn summary(&self) -> Summary {
        let about = match self.about {
            LinearizationPoint::Equilibrium => "the equilibrium under the loads",
            LinearizationPoint::Rest => "the rest shape",
        };
        let listed = self.modes.iter().filter(|mode| mode.frequency_rad_s < 0.0).count();
        let counted =
            counted(self.modes.len() - listed, "natural frequency", "natural frequencies");
        let summary = match self.unstable {
            0 => Summary::new(format!("{counted} about {about}"), Tone::Good),
            n => {
                let modes = counted_modes(n);
                let few = if n == listed { String::new() } else { format!(", {listed} listed") };
                Summary::new(format!("unstable: {modes}{few}; {counted} about {about}"), Tone::Bad)
            }
        };
        let mut warnings = Vec::new();
        if self.marginal > 0 {
            let words = format!(
                "marginal: {} without a measurable stiffness. The rod is at a stability limit, and the lowest \
                 frequencies are rounding errors. Change the load or the support slightly.",
                counted_modes(self.marginal)
            );
            warnings.push(Code::Marginal.behind(words));
        }
        let resolution = self.resolution.as_ref();
        let coarse = resolution.and_then(|resolution| resolution.warning_over("a frequency"));
        warnings.extend(coarse.map(|(code, words)| code.behind(words)));
        warnings.extend(self.warnings.iter().cloned());
        let summary = summary.table("", self.table()).warnings(warnings);
        match resolution {
            Some(resolution) => summary.fact("Numerics", resolution.words_over("a frequency")),
            None => summary,
        }
    }

    /// Frequencies and kinds of the modes, and growth rates of those that are unstable.
    fn table(&self) -> SummaryTable {
        let mut table = SummaryTable::new([
            TextColumn::right("Hz"),
            TextColumn::right("rad/s"),
            TextColumn::right("growth rate, 1/s"),
            TextColumn::left("direction"),
            TextColumn::left("kind"),
            TextColumn::right("number"),
        ]);
        for mode in &self.modes {
            let plane = match mode.plane {
                Some(ModePlane::In) => "in plane",
                Some(ModePlane::Out) => "out of plane",
                None => "",
            };
            let w = mode.frequency_rad_s;
            let [hz, rad, growth] = match w < 0.0 {
                true => [String::new(), "unstable".into(), number(-w, DIGITS)],
                false => [number(w / TAU, DIGITS), number(w, DIGITS), String::new()],
            };
            let counted = mode.number.map(|n| n.to_string()).unwrap_or_default();
            table.row([hz, rad, growth, plane.into(), mode.kind.name().into(), counted]);
        }
        table
    }
}

fn counted(n: usize, one: &str, several: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {several}") }
}

fn counted_modes(n: usize) -> String {
    counted(n, "mode", "modes")
}

//! Parameters of a problem: their list for users, and the check of those that a fit may vary.
//!
//! [`ParameterList`] has path, short names, value, unit and limits of every physical number of the scene, with the
//! reason if it cannot be fitted. It is displayed as two tables (`summary`), without the reasons.
//! [`Problem::check_parameter`] is an error for parameters that the scene does not have or that have no effect in it.
//! Without effect are curvature factors of a straight rod, compliances of unclamped ends, rotations of pinned ends, and
//! motions of recorded ends except the twist. It also rejects Kelvin-Voigt times with a given scheme without viscosity,
//! axial compliances beside a nonlinear stretch law, and rotational ones beside a nonlinear bending law. The clamp
//! angle needs a planar model and a start without `initial.shape`. Moments need a planar model or a load without a
//! potential (a follower load, or a moment other than zero). Parameters that leave the plane of a planar model, or
//! rotate a roller, are rejected by derivatives in dual numbers. `with_trace_viscosity` returns the problem with
//! `TRACE_VISCOSITY` for the first fitted Kelvin-Voigt time of an elastic rod, which then has derivatives, else none.

use crate::error::Error;
use crate::numerics::vector::{sub, unit};
use crate::problem::layout::BESIDE_STRAIGHT;
use crate::problem::model::Model;
use crate::problem::planar::PlanarModel;
use crate::problem::planarity::leaves_plane_to_first_order;
use crate::problem::setup::Setup;
use crate::problem::{AnyProblem, Discretized, PlanarProblem, Problem};
use crate::scene::{End, Parameter, Scheme, StretchLaw, Support};
use crate::summary::{Summary, SummaryTable, TextColumn, Tone};
use num_dual::Dual64;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Parameter of a scene, as listed for users.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ListedParameter {
    /// Path in the file.
    pub name: String,
    /// Short names.
    pub aliases: Vec<String>,
    /// Value in the scene, in `unit`.
    pub value: f64,
    /// Unit; empty for pure numbers.
    pub unit: String,
    /// Smallest and largest allowed value.
    pub limits: [f64; 2],
    /// Reason why it cannot be identified in this scene; none if it can.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// All physical numbers of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ParameterList(pub Vec<ListedParameter>);

impl ParameterList {
    /// All parameters of the scene of a problem, in the order of its tables. `note` has the message of
    /// [`Problem::check_parameter`] for those that cannot be fitted.
    pub fn of(problem: &Problem) -> Self {
        let listed = |parameter: Parameter| {
            Some(ListedParameter {
                name: parameter.path().into(),
                aliases: parameter.aliases().into_iter().map(Into::into).collect(),
                value: parameter.of(problem.scene())?,
                unit: parameter.unit().into(),
                limits: parameter.limits(),
                note: problem.check_parameter(parameter).err().map(|error| error.to_string()),
            })
        };
        Self(Parameter::all(problem.scene()).into_iter().filter_map(listed).collect())
    }
}

impl fmt::Display for ParameterList {
    /// Writes the [summary](Self::summary) of the list.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

impl ParameterList {
    /// The list as text for a terminal: the number of parameters and of those that can be fitted. Below are a table of
    /// these and one of the others, with name, value, unit and short names. The reasons are not shown.
    pub fn summary(&self) -> Summary {
        let [mut free, mut fixed] = [Self::table(), Self::table()];
        for parameter in &self.0 {
            let ListedParameter { name, aliases, value, unit, note, .. } = parameter;
            let aliases: Vec<&str> =
                aliases.iter().map(String::as_str).filter(|alias| alias != name).collect();
            let table = if note.is_none() { &mut free } else { &mut fixed };
            table.row([name, &format!("{value:e}"), unit, &aliases.join(", ")]);
        }
        let count = self.0.iter().filter(|parameter| parameter.note.is_none()).count();
        let status = format!("{} parameters, {count} can be fitted in this scene", self.0.len());
        Summary::new(status, Tone::Neutral)
            .table("Parameters that can be fitted", free)
            .table("Parameters that cannot be fitted in this scene", fixed)
    }

    /// A table without rows, with the columns parameter, value, unit and short name.
    fn table() -> SummaryTable {
        SummaryTable::new([
            TextColumn::left("parameter"),
            TextColumn::right("value"),
            TextColumn::left("unit"),
            TextColumn::left("short name"),
        ])
    }
}

/// Kelvin-Voigt time, s, that makes a rod viscous without an effect: it is below the rounding error of every sum.
const TRACE_VISCOSITY: f64 = 1e-200;

/// Largest rate of the direction of a roller by a parameter, relative to the parameter's size, that is a rounding
/// error.
const ROLLER_ROUNDING: f64 = 1e-9;

impl Problem {
    /// The problem with the Kelvin-Voigt time [`TRACE_VISCOSITY`] in place of zero for the first such time among the
    /// `parameters`, if the rod is not viscous. None for a viscous rod, and without such a parameter. Model and
    /// corrections stay the same. An elastic rod does not store its strain rates, so that the derivatives would be
    /// lost. An error for a Kelvin-Voigt time that the scheme of the scene does not support.
    pub(crate) fn with_trace_viscosity(
        &self,
        parameters: &[Parameter],
    ) -> Result<Option<Self>, Error> {
        // A rod with any viscosity has the derivative anyway.
        let is_elastic = !self.scene().loads.damping.is_viscous();
        let damping = parameters.iter().find(|p| is_elastic && p.is_of_kelvin_voigt());
        parameters.iter().try_for_each(|parameter| self.check_viscosity(*parameter))?;
        damping.map(|p| self.with_fixed_layout([(*p, TRACE_VISCOSITY)])).transpose()
    }

    /// Rejects a Kelvin-Voigt time if the scheme in `[time]` of the scene does not support it. `Ok` for all other
    /// parameters and without `[time]`.
    fn check_viscosity(&self, parameter: Parameter) -> Result<(), Error> {
        match self.scene().time.as_ref().map(|time| time.scheme) {
            Some(scheme) if !scheme.traits().takes_viscosity && parameter.is_of_kelvin_voigt() => {
                let found = format!("{parameter} with the scheme {}", scheme.traits().name);
                let takers = Scheme::names(|traits| traits.takes_viscosity);
                Err(Error::invalid("parameter", found, format!("with the schemes {takers}")))
            }
            _ => Ok(()),
        }
    }

    /// Rejects a parameter that the scene does not have, or that has no effect in it. These are Kelvin-Voigt times with
    /// a given scheme without viscosity, curvature factors of a straight rod, and compliances of unclamped ends.
    /// Rotations of pinned ends and motions of recorded ends other than the twist have no effect either. Rejected are
    /// also axial compliances beside a stretch law, and rotational ones beside a bending law, that is not linear. So
    /// are parameters that leave the plane of a planar model or rotate a roller, and the clamp angle beside
    /// `initial.shape` and in spatial models. Moments in spatial models are rejected if all are zero and there is no
    /// follower load.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the reason.
    pub fn check_parameter(&self, parameter: Parameter) -> Result<(), Error> {
        if parameter.of(self.scene()).is_none() {
            return Err(parameter.absent(self.scene()));
        }
        // Fits use another scheme than the one that the program chose for the motion.
        if !self.scene().chosen().scheme {
            self.check_viscosity(parameter)?;
        }
        // A factor on the curvature of a straight rod has no effect.
        let curvature = parameter.path().starts_with(Parameter::NaturalCurvature.path());
        if curvature && self.mesh.is_straight() {
            let found = format!("{parameter} {BESIDE_STRAIGHT}");
            return Err(Error::invalid("parameter", found, "with a curved rest shape"));
        }
        let ends = [("supports.start_", End::Start), ("supports.end_", End::End)];
        // Compliance belongs to clamps.
        let of_end = |(place, end): &(&str, End)| {
            parameter.path().starts_with(place)
                && self.scene().supports.at(*end) != Support::Clamped
        };
        if ends.iter().any(of_end) {
            let found = format!("{parameter} of an end without a clamp");
            return Err(Error::invalid("parameter", found, "the compliance of a clamped end"));
        }
        // A clamp in series with an edge makes another law of the stretch.
        let is_axial = ["supports.start_compliance.axial", "supports.end_compliance.axial"]
            .contains(&parameter.path());
        if is_axial && self.scene().material.stretch_law != StretchLaw::Linear {
            let found = format!("{parameter} with a stretch_law that is not linear");
            return Err(Error::invalid("parameter", found, "with the linear law of the stretch"));
        }
        let is_rotation =
            ["supports.start_compliance.rotation", "supports.end_compliance.rotation"]
                .contains(&parameter.path());
        let is_nonlinear =
            self.scene().material.bending_law.as_ref().is_some_and(|law| !law.is_linear());
        if is_rotation && is_nonlinear {
            let found = format!("{parameter} with a bending_law");
            return Err(Error::invalid("parameter", found, "with the linear law of bending"));
        }
        // Without ramp and frequency an obstacle has no displacement that could vary.
        for (i, contact) in self.scene().contacts.iter().enumerate() {
            for (k, motion) in contact.motions().iter().enumerate() {
                let place = format!("contacts.{i}.motion.{k}.displacement.");
                let is_constant = motion.ramp.is_none() && motion.frequency.is_none();
                if is_constant && parameter.path().starts_with(&*place) {
                    let found = format!("{parameter} of a motion without ramp and frequency");
                    let allowed = "with the ramp or frequency of that motion";
                    return Err(Error::invalid("parameter", found, allowed));
                }
            }
        }
        for (k, motion) in self.scene().supports.motion.iter().enumerate() {
            let place = format!("supports.motion.{k}.");
            let Some(own) = parameter.path().strip_prefix(&*place) else { continue };
            // A pinned end has no rotation to prescribe; a recording prescribes all but the
            // twist.
            let rotates = own == "twist" || own.starts_with("rotation.");
            match self.scene().supports.at(motion.end) {
                Support::Pinned if rotates => {
                    let found = format!("{parameter}, a rotation of a pinned end");
                    return Err(Error::invalid("parameter", found, "rotations of clamped ends"));
                }
                Support::Recorded if own != "twist" => {
                    let found = format!("{parameter} of an end with recorded motion");
                    return Err(Error::invalid("parameter", found, "the twist of that end"));
                }
                _ => {}
            }
        }
        let beside = |what: &str, allowed: &str| {
            Err(Error::invalid("parameter", format!("{parameter} in a scene with {what}"), allowed))
        };
        let turns = parameter == Parameter::ClampAngle;
        if turns && self.scene().initial.shape.is_some() {
            return beside("initial.shape", "in planar scenes that start in their rest shape");
        }
        // Whether the parameter leaves the plane, to first order: its derivative in dual numbers.
        let seed = |p, value| Dual64::new(value, f64::from(p == parameter));
        match self.discretized() {
            AnyProblem::Planar(discretized) => {
                let setup = discretized.setup_over(seed);
                discretized.check_plane(parameter, &setup)?;
                discretized.check_roller(parameter, &setup)
            }
            AnyProblem::Spatial(_) if turns => beside("a spatial model", "in planar scenes"),
            // Only with such loads derivatives are those of dual numbers, which have the moment.
            AnyProblem::Spatial(discretized)
                if parameter.is_moment() && !discretized.has_follower_loads() =>
            {
                beside("a spatial model", "in planar scenes, or beside a moment other than zero")
            }
            AnyProblem::Spatial(discretized) => {
                discretized.check_roller(parameter, &discretized.setup_over(seed))
            }
        }
    }
}

impl PlanarProblem<'_> {
    /// Rejects a parameter whose change makes a vector, twist or user-defined energy of the scene leave the plane, to
    /// first order. `setup` has the derivatives by the parameter. The error has the key of the first such quantity and
    /// the normal.
    fn check_plane(
        &self,
        parameter: Parameter,
        setup: &Setup<Dual64, PlanarModel>,
    ) -> Result<(), Error> {
        let Setup { scene, mesh, start, .. } = setup;
        let Some(key) = leaves_plane_to_first_order(
            self.model,
            &self.model.plane,
            scene,
            mesh,
            start.as_deref(),
        ) else {
            return Ok(());
        };
        let n = self.normal().map(|c| (c * 1e6).round() / 1e6 + 0.0);
        let allowed = format!(
            "a parameter that keeps {key} in the plane of the scene, with the normal {n:?}. Set rod.dimension = \"spatial\" to \
             allow all parameters"
        );
        let error = Error::invalid("parameter", parameter, allowed);
        Err(error.in_file(self.scene().path.as_deref()))
    }
}

impl<M: Model> Discretized<'_, M> {
    /// Rejects a parameter that rotates the direction of a roller without `supports.roller`, whose direction is that of
    /// the outermost edge. A component of this direction may change by [`ROLLER_ROUNDING`] over the size of the
    /// parameter, at least 1. `setup` has the derivatives by the parameter. `Ok` without a roller.
    fn check_roller(&self, parameter: Parameter, setup: &Setup<Dual64, M>) -> Result<(), Error> {
        let supports = &self.scene().supports;
        let Some(end) = supports.rolling().filter(|_| supports.roller.is_none()) else {
            return Ok(());
        };
        let q = self.model.unknowns(&setup.rest);
        let last = self.nodes() - 1;
        let [a, b] = if end == End::Start { [0, 1] } else { [last - 1, last] };
        let edge = unit(sub(self.model.position(&q, b), self.model.position(&q, a)));
        // The roller follows the last edge: its direction must not depend on the parameter.
        let size = parameter.of(self.scene()).map_or(1.0, |value| value.abs().max(1.0));
        if edge.iter().all(|c| c.eps.abs() * size <= ROLLER_ROUNDING) {
            return Ok(());
        }
        let found = format!("{parameter}, which rotates the direction of the roller");
        Err(Error::invalid("parameter", found, "with supports.roller, a fixed direction"))
    }
}

//! Definition of a fit of lists of values along the rod ([`FieldFit`]), and its validation before it is solved.
//!
//! A fit consists of a problem, recorded motions with a stated noise (m), lists with a smooth prior, and single
//! parameters with a normal prior. `observe` adds a motion, `along` a list and `identify` a parameter.
//! `FieldFit::check` accepts the cases that the adjoint of the simulation supports: mesh, step and scheme given by the
//! scene, positions on the center line, squared losses, and samples up to the end of the simulation. At least one list
//! and one motion are required. Validation data, planned measurements without values, and the same data twice are
//! errors. Errors have the key and the reason. `FieldFit::solve` checks and solves the fit; once the flag of
//! `stop_when` is set, it returns [`Error::Interrupted`].

use crate::error::{Error, ensure};
use crate::fit::duplicates::check_duplicates;
use crate::fit::field::space::{Field, FieldSpace};
use crate::fit::measurement::dataset::Header;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::motion::Observation;
use crate::fit::misfit::camera::View;
use crate::fit::unknown::Unknown;
use crate::fit::validate::check_predicted;
use crate::problem::Problem;
use crate::scene::marker::is_beside;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A fit of lists of values along the rod.
///
/// ```no_run
/// use rodfit::fit::{Field, FieldFit};
/// use rodfit::{Observation, Scene};
/// // A scene with a list at rod.natural_curvature.
/// let problem = Scene::load("bent.toml")?.problem()?;
/// let tip = Observation::read("tip.csv")?.sigma(1e-4); // m
/// let report = FieldFit::new(&problem)
///     .observe(tip)
///     .along(Field { name: "natural_curvature".into(), sigma: 0.2, length: 0.05 })
///     .solve()?;
/// println!("{report}");
/// # Ok::<(), rodfit::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct FieldFit {
    pub(super) problem: Problem,
    pub(super) observations: Vec<Observation>,
    pub(super) fields: Vec<Field>,
    pub(super) unknowns: Vec<Unknown>,
}

impl FieldFit {
    /// A fit of lists in the scene of a problem, without data and lists.
    pub fn new(problem: &Problem) -> Self {
        let (observations, fields, unknowns) = (Vec::new(), Vec::new(), Vec::new());
        Self { problem: problem.clone(), observations, fields, unknowns }
    }

    /// Adds a recorded motion, which must have a noise, [`Observation::sigma`].
    pub fn observe(mut self, observation: Observation) -> Self {
        self.observations.push(observation);
        self
    }

    /// Adds a list of the scene to identify, with its prior.
    pub fn along(mut self, field: Field) -> Self {
        self.fields.push(field);
        self
    }

    /// Adds a single parameter to identify, which must have a [prior](Unknown::prior).
    pub fn identify(mut self, unknown: impl Into<Unknown>) -> Self {
        self.unknowns.push(unknown.into());
        self
    }

    /// Stops the fit once `flag` is set: [`solve`](Self::solve) then returns [`Error::Interrupted`].
    pub fn stop_when(self, flag: Arc<AtomicBool>) -> Self {
        Self { problem: self.problem.stop_when(flag), ..self }
    }

    /// Checks that the scene has an adjoint, and that mesh, step and scheme are given by the scene. Lists and single
    /// parameters are checked by [`FieldSpace::new`]. At least one motion is required. Each motion needs recorded
    /// values to fit, sigma, a point on the center line, squared losses, samples up to the end of the simulation, and
    /// finite positions at increasing times. The same data twice are rejected. The first violation is an error with the
    /// key and the reason.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.problem.check_reversible()?;
        FieldSpace::new(&self.problem, &self.fields, &self.unknowns)?;
        // Mesh, step and scheme must be those of the scene: a choice by the program is not supported.
        let is_open = self.problem.scene().chosen().any();
        let allowed = "rod.segments and time.step in the scene of a fit with [[field]]";
        ensure(!is_open, "scene", "mesh, step or scheme left out", allowed)?;
        let has_motion = !self.observations.is_empty();
        ensure(has_motion, "observation", "none", "at least one recorded motion")?;
        // The adjoint supports positions of the centerline with squared losses and known noise.
        let end = self.problem.time()?.end;
        let view = View::new(&self.problem, |_, value| value);
        for (i, observation) in self.observations.iter().enumerate() {
            let ensure = |holds: bool, key: &str, found: &str, allowed: &str| {
                let allowed = format!("{allowed} in a fit of distributed parameters ([[field]])");
                ensure(holds, format!("observation[{i}].{key}"), found, allowed)
            };
            let Header { sigma, loss, held_out, planned, .. } = &observation.header;
            ensure(!held_out, "held_out", "true", "fitted observations only")?;
            let found = "no file, as the measurement is only planned";
            ensure(!planned, "file", found, "recorded observations only")?;
            ensure(sigma.is_some(), "sigma", "none", "the standard deviation of the noise, m,")?;
            let is_centered = !is_beside(observation.offset);
            ensure(is_centered, "offset", "a marker off the center line", "none")?;
            ensure(*loss == Loss::Squares, "loss", "a robust loss", "\"squares\"")?;
            // Samples are on the camera's clock, whose offset moves the end of the simulation.
            let last = observation.samples.last().map_or(0.0, |s| s.time);
            let latest = view.latest_time(last, &observation.recorded_range());
            let found = format!("a sample at {last} s");
            let allowed = format!("samples up to time.end, {end} s, of the motion,");
            ensure(latest <= end * (1.0 + 1e-9), "file", &found, &allowed)?;
        }
        let experiment = Experiment::new("", &self.problem);
        let observed = self.observations.iter().cloned();
        let experiments = [observed.fold(experiment, Experiment::observe)];
        check_predicted(&experiments)?;
        // Data that are given twice make the posterior too narrow.
        check_duplicates(&experiments)
    }
}

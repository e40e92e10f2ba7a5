//! What a fit along the rod is asked.

use crate::error::Error;
use crate::fit::duplicates::check_duplicates;
use crate::fit::field::space::{Field, Space};
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::motion::Observation;
use crate::fit::unknown::Unknown;
use crate::problem::Problem;
use crate::scene::marker::is_beside;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A fit of numbers along the rod.
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
    /// A fit of numbers of a problem's scene.
    pub fn new(problem: &Problem) -> Self {
        let (observations, fields, unknowns) = (Vec::new(), Vec::new(), Vec::new());
        Self { problem: problem.clone(), observations, fields, unknowns }
    }

    /// Adds a recorded motion. It must say its noise, [`Observation::sigma`].
    pub fn observe(mut self, observation: Observation) -> Self {
        self.observations.push(observation);
        self
    }

    /// Adds a list of numbers to identify.
    pub fn along(mut self, field: Field) -> Self {
        self.fields.push(field);
        self
    }

    /// Adds a single parameter to identify, with a [prior](Unknown::prior).
    pub fn identify(mut self, unknown: impl Into<Unknown>) -> Self {
        self.unknowns.push(unknown.into());
        self
    }

    /// Stops once `flag` is set, with [`Error::Interrupted`].
    pub fn stop_when(self, flag: Arc<AtomicBool>) -> Self {
        Self { problem: self.problem.stop_when(flag), ..self }
    }

    /// Refuses what this kind of fit cannot do.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.problem.check_reversible()?;
        Space::new(&self.problem, &self.fields, &self.unknowns)?;
        if self.problem.scene().chosen().any() {
            let allowed = "rod.segments, time.step and time.scheme beside [[field]]";
            return Err(Error::invalid("scene", "numerics that it leaves open", allowed));
        }
        if self.observations.is_empty() {
            return Err(Error::invalid("observation", "none", "a recorded motion or more"));
        }
        let end = self.problem.time()?.end + self.problem.scene().camera.time_offset;
        for (i, observation) in self.observations.iter().enumerate() {
            let refused = |key: &str, found: &str, allowed: &str| {
                let allowed = format!("{allowed} in a fit of numbers along the rod");
                Err(Error::invalid(format!("observation[{i}].{key}"), found, allowed))
            };
            if observation.header.sigma.is_none() {
                return refused("sigma", "none", "the standard deviation of its noise, m,");
            }
            if is_beside(observation.offset) {
                return refused("offset", "a marker beside the rod", "none");
            }
            if observation.header.loss != Loss::Squares {
                return refused("loss", "a robust loss", "\"squares\"");
            }
            if let Some(last) = observation.samples.last().filter(|s| s.time > end * (1.0 + 1e-9)) {
                let found = format!("a sample at {} s", last.time);
                return refused("file", &found, &format!("samples up to time.end, {end} s,"));
            }
        }
        let experiment = Experiment::new("", &self.problem);
        let observed = self.observations.iter().cloned();
        check_duplicates(&[observed.fold(experiment, Experiment::observe)])
    }
}

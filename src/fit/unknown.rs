//! A parameter to be identified, and the scale it is identified on.

use crate::error::Error;
use crate::fit::measurement::experiment::{Experiment, named};
use crate::numerics::scalar::Scalar;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Normal prior of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "{ mean = .., sigma = .. } in the parameter's unit")]
pub struct Prior {
    /// Mean of the prior, in the parameter's unit.
    pub mean: f64,
    /// Standard deviation of the prior, in the parameter's unit.
    pub sigma: f64,
}

/// A parameter to be identified.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// The parameter.
    pub parameter: Parameter,
    /// Where to look first; the program finds a start without one.
    pub start: Option<f64>,
    /// Smallest and largest value allowed.
    pub bounds: Option<[f64; 2]>,
    /// What is known of it besides the data.
    pub prior: Option<Prior>,
    /// The experiments that share it; all that have it when empty.
    pub experiments: Vec<String>,
    /// On its own scale even where it is positive, for derivatives where it may be zero.
    pub(crate) plain: bool,
}

/// The experiments with the layouts of their problems decided for generic values of what is looked for,
/// once for the whole fit: the misfit then follows the unknowns smoothly.
pub(crate) fn laid_out(
    experiments: &[Experiment],
    unknowns: &[Unknown],
) -> Result<Vec<Experiment>, Error> {
    let of = |experiment: &Experiment| {
        let own = unknowns.iter().filter(|u| u.is_of(experiment)).map(|u| u.parameter);
        let problem = experiment.problem.with_generic_layout_for(own.collect())?;
        Ok(Experiment { problem, ..experiment.clone() })
    };
    experiments.iter().map(of).collect()
}

impl From<Parameter> for Unknown {
    fn from(parameter: Parameter) -> Self {
        let (start, bounds, prior) = (None, None, None);
        Self { parameter, start, bounds, prior, experiments: Vec::new(), plain: false }
    }
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&named(&self.parameter, &self.experiments))
    }
}

impl Unknown {
    /// An unknown without start and bounds.
    pub fn new(parameter: Parameter) -> Self {
        parameter.into()
    }

    /// With a first guess, in the parameter's unit.
    pub fn start(self, start: f64) -> Self {
        Self { start: Some(start), ..self }
    }

    /// With bounds, in the parameter's unit.
    pub fn bounds(self, low: f64, high: f64) -> Self {
        Self { bounds: Some([low, high]), ..self }
    }

    /// Known to be `mean` but for a standard deviation `sigma`, in the parameter's unit.
    pub fn prior(self, mean: f64, sigma: f64) -> Self {
        Self { prior: Some(Prior { mean, sigma }), ..self }
    }

    /// Of one more experiment only; without any it is shared by all that have the parameter.
    pub fn of_experiment(mut self, name: impl Into<String>) -> Self {
        self.experiments.push(name.into());
        self
    }

    /// Whether an experiment's scene takes its value from it.
    pub(crate) fn is_of(&self, experiment: &Experiment) -> bool {
        match self.experiments.is_empty() {
            true => self.parameter.of(experiment.problem.scene()).is_some(),
            false => self.experiments.contains(&experiment.name),
        }
    }

    /// How far `x`, on the scale of the fit, is from what is known, in standard deviations; none
    /// when nothing is. `x` may carry derivatives.
    pub(crate) fn prior_residual<D: Scalar>(&self, x: D) -> Option<D> {
        let Prior { mean, sigma } = self.prior?;
        let value = if self.parameter.is_positive() { x.exp() } else { x };
        Some((value - mean) * sigma.recip())
    }

    /// From the parameter to the scale of the fit: logarithmic for positive parameters.
    pub fn to_scale(&self, value: f64) -> f64 {
        if self.is_logarithm() { value.ln() } else { value }
    }

    /// Back from the scale of the fit.
    pub fn from_scale(&self, x: f64) -> f64 {
        if self.is_logarithm() { x.exp() } else { x }
    }

    fn is_logarithm(&self) -> bool {
        self.parameter.is_positive() && !self.plain
    }

    /// d(parameter)/d(scale) at a value.
    pub fn slope(&self, value: f64) -> f64 {
        if self.is_logarithm() { value } else { 1.0 }
    }

    /// Bounds on the scale of the fit.
    pub fn scaled_bounds(&self) -> [f64; 2] {
        let [low, high] = self.parameter.limits();
        let [low, high] = self.bounds.map_or([low, high], |[l, h]| [l.max(low), h.min(high)]);
        [self.to_scale(low), self.to_scale(high)]
    }
}

//! Unknowns of a fit: a parameter with its start, bounds and prior, and the scale on which it is identified.
//!
//! Start, bounds and prior are given in the parameter's unit, and the prior is normal in that unit. Positive parameters
//! (stiffness, density, damping) are identified as their natural logarithm, others, and those marked `plain`, as their
//! value ("the scale of the fit"). Steps and covariances of the search are on this scale. Bounds are limited to the
//! physical limits of the parameter and converted to it. [`Unknown::to_scale`] and [`Unknown::from_scale`] convert, and
//! [`ParameterPoint`] is a point of all unknowns on their scales. Without names of experiments an unknown belongs to
//! all whose scene has the parameter. [`with_fixed_layouts`] prepares experiments whose mesh layout does not change
//! with the values of their unknowns.

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

/// A parameter to be identified, with its start, bounds, prior and experiments.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// The parameter.
    pub parameter: Parameter,
    /// Start value, in the parameter's unit; `None`: the search finds one.
    pub start: Option<f64>,
    /// Smallest and largest value, in the parameter's unit; `None`: the physical limits of the parameter.
    pub bounds: Option<[f64; 2]>,
    /// Normal prior.
    pub prior: Option<Prior>,
    /// Names of the experiments with this unknown; empty: all whose scene has the parameter.
    pub experiments: Vec<String>,
    /// Whether the scale of the fit is the value itself even for a positive parameter, for derivatives where it may be
    /// zero.
    pub(crate) plain: bool,
}

/// A point of the search: the unknowns with one number each on its scale, at which simulations and residuals are
/// evaluated.
#[derive(Clone, Copy)]
pub(crate) struct ParameterPoint<'a> {
    /// The unknowns of the fit.
    pub unknowns: &'a [Unknown],
    /// One number per unknown, on its scale.
    pub x: &'a [f64],
}

impl ParameterPoint<'_> {
    /// The value of every unknown in its unit, in their order.
    pub fn values(self) -> Vec<f64> {
        self.unknowns.iter().zip(self.x).map(|(unknown, x)| unknown.from_scale(*x)).collect()
    }

    /// The parameters that belong to an experiment with their values, each in its unit, in the order of the unknowns.
    pub fn values_of(self, experiment: &Experiment) -> Vec<(Parameter, f64)> {
        let own = self.unknowns.iter().zip(self.x).filter(|(u, _)| u.is_of(experiment));
        own.map(|(u, x)| (u.parameter, u.from_scale(*x))).collect()
    }
}

/// The experiments with the layout of their mesh (the arrangement of nodes and elements) chosen for generic values of
/// the unknowns that belong to them, once for the whole fit. The misfit is then a smooth function of the unknowns. An
/// error if a scene cannot be prepared.
pub(crate) fn with_fixed_layouts(
    experiments: &[Experiment],
    unknowns: &[Unknown],
) -> Result<Vec<Experiment>, Error> {
    let fixed = |experiment: &Experiment| {
        let own = unknowns.iter().filter(|u| u.is_of(experiment)).map(|u| u.parameter);
        let problem = experiment.problem.with_generic_layout_for(own.collect())?;
        Ok(experiment.with_problem(problem))
    };
    experiments.iter().map(fixed).collect()
}

impl From<Parameter> for Unknown {
    /// An unknown of the parameter without start, bounds and prior, of all experiments whose scene has it.
    fn from(parameter: Parameter) -> Self {
        let (start, bounds, prior) = (None, None, None);
        Self { parameter, start, bounds, prior, experiments: Vec::new(), plain: false }
    }
}

impl fmt::Display for Unknown {
    /// Writes the name of the parameter, followed by its experiments in parentheses unless it belongs to all.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&named(&self.parameter, &self.experiments))
    }
}

impl Unknown {
    /// An unknown without start, bounds and prior, of all experiments whose scene has the parameter.
    ///
    /// ```
    /// use rodfit::{Parameter, Unknown};
    /// let unknown = Unknown::new(Parameter::YoungsModulus).start(1e8).bounds(1e6, 1e10); // Pa
    /// assert_eq!(unknown.start, Some(1e8));
    /// assert_eq!(unknown.from_scale(unknown.to_scale(2.0)), 2.0_f64.ln().exp());
    /// ```
    pub fn new(parameter: Parameter) -> Self {
        parameter.into()
    }

    /// The unknown with a start value, in the parameter's unit.
    pub fn start(self, start: f64) -> Self {
        Self { start: Some(start), ..self }
    }

    /// The unknown with a lower and an upper bound, in the parameter's unit.
    pub fn bounds(self, low: f64, high: f64) -> Self {
        Self { bounds: Some([low, high]), ..self }
    }

    /// The unknown with a normal prior of this mean and standard deviation, in the parameter's unit.
    pub fn prior(self, mean: f64, sigma: f64) -> Self {
        Self { prior: Some(Prior { mean, sigma }), ..self }
    }

    /// Adds the name of an experiment with this unknown. Without any, all experiments with the parameter share it.
    pub fn of_experiment(mut self, name: impl Into<String>) -> Self {
        self.experiments.push(name.into());
        self
    }

    /// Whether an unknown belongs to an experiment: the experiment is in its list of names, or without names its scene
    /// has the parameter.
    pub(crate) fn is_of(&self, experiment: &Experiment) -> bool {
        match self.experiments.is_empty() {
            true => self.parameter.of(experiment.problem.scene()).is_some(),
            false => self.experiments.contains(&experiment.name),
        }
    }

    /// The residual of the normal prior, `(value - mean)/sigma`, at `x` on the scale of the fit; mean, sigma and value
    /// are in the parameter's unit. `None` without a prior. `x` may carry derivatives.
    pub(crate) fn prior_residual<D: Scalar>(&self, x: D) -> Option<D> {
        // The prior is normal in the unit of the parameter, also where the scale is a logarithm.
        let Prior { mean, sigma } = self.prior?;
        Some((self.value(x) - mean) * sigma.recip())
    }

    /// The number on the scale of the fit of a value in the parameter's unit: its natural logarithm for positive
    /// parameters, else the value. Negative infinity for a positive parameter of 0.
    pub fn to_scale(&self, value: f64) -> f64 {
        if self.is_logarithm() { value.ln() } else { value }
    }

    /// The value in the parameter's unit of a number `x` on the scale of the fit: its exponential for positive
    /// parameters, else `x`.
    pub fn from_scale(&self, x: f64) -> f64 {
        self.value(x)
    }

    /// The value in the parameter's unit at `x` on the scale of the fit (exponential for positive parameters), which
    /// may carry derivatives.
    pub(crate) fn value<D: Scalar>(&self, x: D) -> D {
        if self.is_logarithm() { x.exp() } else { x }
    }

    /// Whether the scale of the fit is the logarithm of the parameter: it is positive, and the unknown is not marked
    /// `plain` (for derivatives at zero).
    pub(crate) fn is_logarithm(&self) -> bool {
        self.parameter.is_positive() && !self.plain
    }

    /// The derivative of the parameter by its number on the scale of the fit, at a `value` in its unit: the value
    /// itself on a logarithmic scale, else 1.
    pub fn slope(&self, value: f64) -> f64 {
        if self.is_logarithm() { value } else { 1.0 }
    }

    /// A change on the scale of the fit that changes the motion of an experiment by about the size of the motion. It is
    /// 1 for positive parameters, pure numbers and angles. Of others it is the rod's length in the unit m, the duration
    /// of the records in s, and 0 in other units. On a logarithmic scale 1 is a factor of `e`.
    pub(crate) fn typical_size(&self, experiment: &Experiment) -> f64 {
        // Other units have no size that the motion suggests: 0 leaves them out of comparisons.
        match self.parameter.unit() {
            _ if self.parameter.is_positive() => 1.0,
            "m" => experiment.problem.length(),
            "s" => experiment.duration(),
            "" | "rad" => 1.0,
            _ => 0.0,
        }
    }

    /// The lower and upper bound on the scale of the fit: the given bounds, within the physical limits of the
    /// parameter, or without bounds these limits. Infinite where a side is unlimited (also minus infinity for the
    /// logarithm of zero).
    pub fn scaled_bounds(&self) -> [f64; 2] {
        // Given bounds never extend beyond the limits of the parameter.
        let [low, high] = self.parameter.limits();
        let [low, high] = self.bounds.map_or([low, high], |[l, h]| [l.max(low), h.min(high)]);
        [self.to_scale(low), self.to_scale(high)]
    }
}

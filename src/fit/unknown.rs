//! A parameter to be identified, and the scale it is identified on.

use super::Experiment;
use crate::error::Error;
use crate::parameter::Parameter;
use crate::problem::Problem;
use crate::scalar::Scalar;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What is known of a parameter before the data: a normal distribution of its value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prior {
    /// In the parameter's unit.
    pub mean: f64,
    /// Standard deviation, in the same unit.
    pub sigma: f64,
}

/// A parameter to be identified.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Which.
    pub parameter: Parameter,
    /// Where to look first; the program finds a start without one.
    pub start: Option<f64>,
    /// Smallest and largest value allowed.
    pub bounds: Option<[f64; 2]>,
    /// What is known of it besides the data.
    pub prior: Option<Prior>,
    /// The experiments that share it; all that have it when empty.
    pub experiments: Vec<String>,
}

impl From<Parameter> for Unknown {
    fn from(parameter: Parameter) -> Self {
        Self { parameter, start: None, bounds: None, prior: None, experiments: Vec::new() }
    }
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.experiments.is_empty() {
            true => self.parameter.fmt(f),
            false => write!(f, "{} ({})", self.parameter, self.experiments.join(", ")),
        }
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
    pub(super) fn is_of(&self, experiment: &Experiment) -> bool {
        match self.experiments.is_empty() {
            true => self.parameter.of(experiment.problem.scene()).is_some(),
            false => self.experiments.contains(&experiment.name),
        }
    }

    /// How far `x`, on the scale of the fit, is from what is known, in standard deviations; none
    /// when nothing is. `x` may carry derivatives.
    pub(super) fn surprise<D: Scalar>(&self, x: D) -> Option<D> {
        let Prior { mean, sigma } = self.prior?;
        let value = if self.parameter.is_positive() { x.exp() } else { x };
        Some((value - mean) * sigma.recip())
    }

    /// From the parameter to the scale of the fit: logarithmic for positive parameters.
    pub fn to_scale(&self, value: f64) -> f64 {
        if self.parameter.is_positive() { value.ln() } else { value }
    }

    /// Back from the scale of the fit.
    pub fn from_scale(&self, x: f64) -> f64 {
        if self.parameter.is_positive() { x.exp() } else { x }
    }

    /// d(parameter)/d(scale) at a value.
    pub fn slope(&self, value: f64) -> f64 {
        if self.parameter.is_positive() { value } else { 1.0 }
    }

    /// Bounds on the scale of the fit.
    pub fn scaled_bounds(&self) -> [f64; 2] {
        let [low, high] = self.parameter.limits();
        let [low, high] = self.bounds.map_or([low, high], |[l, h]| [l.max(low), h.min(high)]);
        [self.to_scale(low), self.to_scale(high)]
    }

    /// Values worth trying before anything is known. A start is a hint: it may be far off.
    /// `duration` and `rise` are the record's length and the time of its first swing, s.
    pub(crate) fn candidates(
        &self,
        problem: &Problem,
        duration: f64,
        rise: f64,
        beside_youngs_modulus: bool,
    ) -> Vec<f64> {
        let log_range = |low: f64, high: f64, per_decade: f64| -> Vec<f64> {
            let n = ((high / low).log10() * per_decade).round().max(0.0) as i32;
            (0..=n).map(|i| low * (high / low).powf(f64::from(i) / f64::from(n.max(1)))).collect()
        };
        let length = problem.length();
        let here = self.start.or(self.parameter.of(problem.scene()));
        let hint = self.start.or(self.prior.map(|prior| prior.mean));
        let values = match (self.parameter, hint) {
            // Clamps and cameras are set up by eye.
            (
                Parameter::NaturalCurvatureOf(_)
                | Parameter::NaturalTwistOf(_)
                | Parameter::ClampAngle
                | Parameter::InitialVelocityX
                | Parameter::InitialVelocityY
                | Parameter::InitialVelocityZ
                | Parameter::InitialAngularVelocityX
                | Parameter::InitialAngularVelocityY
                | Parameter::InitialAngularVelocityZ
                | Parameter::TimeOffset
                | Parameter::PixelScale
                | Parameter::InPlaneRotation
                | Parameter::ClampPositionX
                | Parameter::ClampPositionY
                | Parameter::ClampPositionZ,
                _,
            ) => here.into_iter().collect(),
            (Parameter::YoungsModulus, None) => log_range(1e3, 1e13, 3.0),
            (Parameter::YoungsModulus, Some(e)) => log_range(e * 1e-3, e * 1e3, 3.0),
            (Parameter::Beta, None) => vec![0.55, 0.75, 0.95],
            (Parameter::PoissonRatio, None) => vec![0.3],
            (Parameter::NaturalCurvature, None) => vec![0.5, 1.0, 1.5],
            (Parameter::NaturalTwist, None) => [-2.0, 0.0, 2.0].map(|turn| turn / length).to_vec(),
            (
                Parameter::Beta
                | Parameter::PoissonRatio
                | Parameter::NaturalCurvature
                | Parameter::NaturalTwist,
                Some(value),
            ) => vec![value],
            (_, Some(value)) => log_range(value / 30.0, value * 30.0, 1.4),
            (Parameter::ShearModulus, None) => {
                let e = problem.scene().material.youngs_modulus;
                // Beside an unknown Young's modulus the scan ties it to that; one value will do.
                if beside_youngs_modulus { vec![e] } else { log_range(0.01 * e, e, 3.0) }
            }
            (Parameter::Density, None) => log_range(100.0, 2e4, 2.0),
            (Parameter::Radius | Parameter::Width | Parameter::Height, None) => {
                log_range(1e-4 * length, 0.1 * length, 2.0)
            }
            (Parameter::DampingMass, None) => log_range(0.03 / duration, 10.0 / rise, 1.5),
            (Parameter::DampingStiffness, None) => log_range(1e-5 * rise, 0.1 * rise, 1.0),
        };
        let [low, high] = self.scaled_bounds().map(|x| self.from_scale(x));
        let mut inside: Vec<f64> =
            values.iter().copied().filter(|v| *v > low && *v < high).collect();
        if inside.is_empty() {
            inside = values.iter().map(|v| v.clamp(low, high)).collect();
            inside.dedup();
        }
        inside
    }

    /// Checks names, start, bounds and prior; `key` names them in messages.
    pub(crate) fn check(&self, experiments: &[Experiment], key: &str) -> Result<(), Error> {
        let parameter = self.parameter;
        let names: Vec<&str> = experiments.iter().map(|e| e.name.as_str()).collect();
        if let Some(other) = self.experiments.iter().find(|name| !names.contains(&name.as_str())) {
            let allowed = format!("one of {}", names.join(", "));
            return Err(Error::invalid(format!("{key}.experiment"), other, allowed));
        }
        let mut takers = experiments.iter().filter(|e| self.is_of(e)).peekable();
        if takers.peek().is_none() {
            return Err(parameter.absent());
        }
        takers.try_for_each(|e| e.problem.check_parameter(parameter))?;
        let [least, most] = parameter.limits();
        let allowed = || match parameter.is_positive() {
            true => "finite and above 0".to_string(),
            false => format!("{least} .. {most}"),
        };
        let fits = |value: f64| value.is_finite() && value >= least && value <= most;
        let [mut low, mut high] = [least, most];
        if let Some(bounds) = self.bounds {
            [low, high] = bounds;
            if !(fits(low) && fits(high) && low < high) {
                let allowed = format!("two ascending numbers, each {}", allowed());
                return Err(Error::invalid(
                    format!("{key}.bounds"),
                    format!("{bounds:?}"),
                    allowed,
                ));
            }
        }
        if let Some(Prior { mean, sigma }) = self.prior {
            if !fits(mean) {
                return Err(Error::invalid(format!("{key}.prior.mean"), mean, allowed()));
            }
            crate::scene::positive(&format!("{key}.prior.sigma"), sigma)?;
        }
        match self.start {
            Some(start) if !fits(start) => {
                Err(Error::invalid(format!("{key}.start"), start, allowed()))
            }
            Some(start) if start < low || start > high => Err(Error::invalid(
                format!("{key}.start"),
                start,
                format!("within the bounds {low} .. {high}"),
            )),
            _ => Ok(()),
        }
    }
}

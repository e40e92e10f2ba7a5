//! Estimate of a parameter in a report: its value, and its uncertainty by every method.
//!
//! [`local_estimates`] creates one [`Estimate`] per unknown, in its unit, from the optimum and its local analysis. The
//! value is corrected for the discretization bias of a mesh and step that the program chose, unless it has a lower
//! bound. An unidentifiable unknown has no value. The 95 % interval is `x +- h`, `h = sqrt((k sd)^2 + e^2)`, on the
//! scale of the unknown (logarithm of a positive parameter). Here `k` is the coverage factor, `sd` the standard
//! deviation and `e` the remaining discretization error. For a damping with a large relative error, but no one-sided
//! bound, it is `value (1 +- h)`. Both are clamped to the limits of the parameter. With an upper bound the interval is
//! from 0 to the bound; with a lower bound, or without convergence, there is none. Later analyses (cluster jackknife,
//! budget, bootstrap) add their fields. [`ParameterBias`] converts a shift of an unknown on its scale to a bias in its
//! unit, and to a fraction of the true value for positive parameters.
//!
//! [`ExperimentEstimate`] is the estimate by one experiment alone, [`ClusterJackknife`] the uncertainty from the
//! differences between experiments.

use crate::fit::measurement::experiment::named;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::budget::entries::{BudgetLine, InputSensitivity, MonteCarlo};
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::covariance::zero_bound::NearZeroEstimate;
use crate::fit::uncertainty::discretization::bias::DiscretizationBias;
use crate::fit::uncertainty::posterior::summary::Posterior;
use crate::fit::uncertainty::resampling::bootstrap::Bootstrap;
use crate::fit::unknown::{Prior, Unknown};
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};

/// Estimate of a parameter by one of several experiments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ExperimentEstimate {
    /// Name of the experiment.
    pub experiment: String,
    /// Estimate by the data of the experiment alone, in the parameter's unit: one Gauss-Newton step from the common
    /// estimate.
    pub value: f64,
}

/// Cluster jackknife: uncertainty of a parameter from the differences between experiments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ClusterJackknife {
    /// Number of compared experiments.
    pub experiments: usize,
    /// Standard error from the differences between experiments, in the parameter's unit.
    pub std_error: f64,
    /// 95 % interval from the differences between experiments, in the parameter's unit.
    pub interval95: [f64; 2],
    /// Standard error from the residuals, in the parameter's unit.
    pub residual_std_error: f64,
    /// 95 % interval from the residuals, in the parameter's unit.
    pub residual_interval95: [f64; 2],
    /// Whether this interval is the reported one, because it is wider.
    pub reported: bool,
    /// Estimates by each experiment that determines all parameters alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub estimates: Vec<ExperimentEstimate>,
}

/// An identified parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Estimate {
    /// Name of the parameter as requested.
    pub name: Parameter,
    /// Experiments with this parameter; empty: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub experiments: Vec<String>,
    /// SI unit of the parameter; empty for pure numbers.
    #[serde(default)]
    pub unit: String,
    /// Estimate in the parameter's SI unit; null if not identifiable.
    pub value: Option<f64>,
    /// Standard error, in the parameter's unit; null without convergence.
    pub std_error: Option<f64>,
    /// 95 % interval, in the parameter's unit; null without convergence.
    pub interval95: Option<[f64; 2]>,
    /// One-sided 95 % upper bound of a damping that is not distinguishable from zero, or of a
    /// parameter that the data do not bound from below, in its unit; the interval is then `[0,
    /// upper95]`, without a standard error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub upper95: Option<f64>,
    /// One-sided 95 % lower bound of a parameter that the data do not bound from above, in its
    /// unit; there is then no interval and no standard error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower95: Option<f64>,
    /// Cluster jackknife, with five experiments or more.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cluster_jackknife: Option<ClusterJackknife>,
    /// Whether the data determine the parameter.
    pub identifiable: bool,
    /// Prior of the parameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<Prior>,
    /// Standard error from the exact Hessian of the misfit, in the parameter's unit, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub observed_std_error: Option<f64>,
    /// 95 % interval from the profile likelihood, in the parameter's unit, if requested; an end is
    /// null where the data set no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile95: Option<[Option<f64>; 2]>,
    /// Spread over a parametric bootstrap, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bootstrap: Option<Bootstrap>,
    /// Posterior distribution, if requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub posterior: Option<Posterior>,
    /// Uncertainty budget: contribution of each source; empty without a standard error.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub budget: Vec<BudgetLine>,
    /// Combined standard uncertainty of all sources, in the parameter's unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub combined_std: Option<f64>,
    /// Coverage factor of the expanded uncertainty: Student's t at the effective degrees of
    /// freedom.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage_factor: Option<f64>,
    /// Expanded 95 % interval (GUM): value plus and minus `coverage_factor` times `combined_std`,
    /// in the parameter's unit, within its limits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expanded95: Option<[f64; 2]>,
    /// Sensitivities to +1 % of each input without a stated uncertainty, the largest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub input_sensitivities: Vec<InputSensitivity>,
    /// Spread of fits with random inputs and noise, if requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub monte_carlo: Option<MonteCarlo>,
}

impl Estimate {
    /// Name of the parameter, followed by its experiments in parentheses if it does not belong to all.
    pub fn label(&self) -> String {
        named(&self.name, &self.experiments)
    }

    /// Estimate of an unknown with this value in its unit, and with its name, experiments, unit and prior. It is marked
    /// as not identifiable; all other fields are none or empty.
    pub(crate) fn without_error(unknown: &Unknown, value: Option<f64>) -> Self {
        Self {
            name: unknown.parameter,
            experiments: unknown.experiments.clone(),
            unit: unknown.parameter.unit().into(),
            value,
            std_error: None,
            interval95: None,
            upper95: None,
            lower95: None,
            cluster_jackknife: None,
            identifiable: false,
            prior: unknown.prior,
            observed_std_error: None,
            profile95: None,
            bootstrap: None,
            posterior: None,
            budget: Vec::new(),
            combined_std: None,
            coverage_factor: None,
            expanded95: None,
            input_sensitivities: Vec::new(),
            monte_carlo: None,
        }
    }
}

/// Bias of an estimate: its difference to the true value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParameterBias {
    /// Estimate less true value, in the parameter's unit.
    pub change: f64,
    /// The same as a fraction of the true value; none for parameters that are not positive (not on a logarithmic
    /// scale).
    pub relative: Option<f64>,
}

impl ParameterBias {
    /// Bias of an estimate `value`, in its unit, that is `shift` too large on the unknown's scale. For a positive
    /// parameter (logarithm) the change is `value (1 - exp(-shift))` and the relative bias `exp(shift) - 1`. Otherwise
    /// the change is `shift` times the derivative of the value by the scale, without a relative bias.
    pub fn new(unknown: &Unknown, value: f64, shift: f64) -> Self {
        match unknown.parameter.is_positive() {
            true => Self { change: -value * (-shift).exp_m1(), relative: Some(shift.exp_m1()) },
            false => Self { change: shift * unknown.slope(value), relative: None },
        }
    }
}

/// Estimates of all unknowns, in their order, from an optimum and its local analysis. Values are corrected by the
/// `bias` of a mesh and step that the program chose. The 95 % intervals include the remaining discretization error and
/// are clamped to the limits of the parameter. Without convergence there is no standard error and no two-sided
/// interval. With an upper bound the interval is from 0 to the bound, with a lower bound there is none. An upper bound
/// `u` of the value `v`, with the correction `c` and the remaining error `e`, becomes
/// `v (1 + c) + sqrt((u - v)^2 + (v e)^2)`, or stays if that is not positive. A value with a lower bound is not
/// corrected. A damping with an entry of bounds but no one-sided bound has an interval that is symmetric in its unit.
/// An unidentifiable unknown has no value.
pub(crate) fn local_estimates(
    Fitted { search, optimum }: Fitted,
    LocalAnalysis { covariance, correlations, bounds, .. }: &LocalAnalysis,
    bias: &DiscretizationBias,
) -> Vec<Estimate> {
    let estimate = |(i, unknown): (usize, &Unknown)| {
        // Value corrected for the estimated discretization error; the rest of it widens the
        // interval.
        let x = bias.corrected(unknown, i, optimum.x[i]);
        let remaining = bias.remaining(i);
        let deviation = covariance.deviation[i];
        let known = deviation.is_some();
        let deviation = deviation.filter(|_| optimum.converged);
        let corrected = unknown.from_scale(x);
        let [low, high] = unknown.parameter.limits();
        // Half-width on the scale of the unknown: noise and remaining discretization error, as a root of the sum of
        // squares.
        let half = |sd: f64| (correlations.coverage_factor(i) * sd).hypot(remaining);
        // The misfit is a parabola over a poorly determined damping itself, not over its logarithm.
        let ends = |sd: f64| match bounds[i] {
            Some(_) => [1.0 - half(sd), 1.0 + half(sd)].map(|factor| factor * corrected),
            None => [x - half(sd), x + half(sd)].map(|x| unknown.from_scale(x)),
        };
        // A standard deviation on the scale of the unknown, cut at the limits of the parameter.
        let interval95 = deviation.map(|sd| ends(sd).map(|end| end.clamp(low, high)));
        let own = |value: Option<f64>| Estimate {
            std_error: deviation.map(|sd| sd * unknown.slope(corrected)),
            identifiable: value.is_some(),
            ..Estimate::without_error(unknown, value)
        };
        match bounds[i] {
            // Mesh and step shift an upper bound by as much as the value.
            Some(NearZeroEstimate { value, upper95: Some(upper), .. }) => {
                let shifted = value + value * bias.correction(i);
                let bound = (upper - value).hypot(value * remaining) + shifted;
                // Far beyond the linear range a correction may exceed the bound: it is then not applied.
                let upper = if bound > 0.0 { bound } else { upper };
                let interval95 = Some([0.0, upper]);
                Estimate { interval95, upper95: Some(upper), ..own(Some(shifted.max(0.0))) }
            }
            // No upper limit is determined: the lower bound is the only result.
            Some(NearZeroEstimate { value, lower95: Some(lower), .. }) => {
                Estimate { interval95, lower95: Some(lower), ..own(Some(value)) }
            }
            _ => Estimate { interval95, ..own(known.then_some(corrected)) },
        }
    };
    search.unknowns.iter().enumerate().map(estimate).collect()
}

//! What a fit says of a parameter.

use crate::fit::measurement::experiment::named;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::budget::entries::{BudgetLine, InputSensitivity, MonteCarlo};
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::resampling::bootstrap::Bootstrap;
use crate::fit::uncertainty::shifts::Shifts;
use crate::fit::unknown::{Prior, Unknown};
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};

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
    /// The name, with the experiments if it is of some only.
    pub fn label(&self) -> String {
        named(&self.name, &self.experiments)
    }

    /// Of an unknown of which nothing is known but this `value`.
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
            budget: Vec::new(),
            combined_std: None,
            coverage_factor: None,
            expanded95: None,
            input_sensitivities: Vec::new(),
            monte_carlo: None,
        }
    }
}

/// The estimate of every unknown by the local analysis of an optimum. Values are corrected for a mesh and a step that the
/// program chose, and intervals hold the error of the correction.
pub(crate) fn estimates(
    Fitted { search, optimum }: Fitted,
    LocalAnalysis { covariance, correlations, bounds: vanishing, .. }: &LocalAnalysis,
    shifts: &Shifts,
) -> Vec<Estimate> {
    let estimate = |(i, unknown): (usize, &Unknown)| {
        let [low, high] = unknown.scaled_bounds();
        let correction = shifts.correction(i);
        let x = if correction == 0.0 {
            optimum.x[i]
        } else {
            (optimum.x[i] + correction).clamp(low, high)
        };
        let open = shifts.open(i);
        let value = unknown.from_scale(x);
        let deviation = covariance.deviation[i].filter(|_| optimum.converged);
        // Mesh and step shift a bound by as much as the value.
        let zero = vanishing[i].and_then(|v| Some((v, v.upper95?))).map(|(v, upper)| {
            let shift = v.value * correction;
            let corrected = (upper - v.value).hypot(v.value * open) + v.value + shift;
            ((v.value + shift).max(0.0), if corrected > 0.0 { corrected } else { upper })
        });
        let lower95 = vanishing[i].and_then(|bound| bound.lower95);
        let known = covariance.deviation[i].is_some() || zero.is_some() || lower95.is_some();
        let ends = |sd: f64| {
            let [low, high] = unknown.parameter.limits();
            let reach = (correlations.reach[i] * sd).hypot(open);
            // The misfit is a parabola over a poorly known damping itself, not over its logarithm.
            let ends = match vanishing[i] {
                Some(_) => [1.0 - reach, 1.0 + reach].map(|part| part * value),
                None => [x - reach, x + reach].map(|x| unknown.from_scale(x)),
            };
            ends.map(|end| end.clamp(low, high))
        };
        let bounded = vanishing[i].filter(|bound| bound.lower95.is_some()).map(|bound| bound.value);
        let value = known.then_some(zero.map_or(value, |(value, _)| value));
        let value = bounded.or(value);
        Estimate {
            std_error: deviation.map(|sd| sd * unknown.slope(unknown.from_scale(x))),
            interval95: zero.map(|(_, upper)| [0.0, upper]).or(deviation.map(ends)),
            upper95: zero.map(|(_, upper)| upper),
            lower95,
            identifiable: known,
            ..Estimate::without_error(unknown, value)
        }
    };
    search.unknowns.iter().enumerate().map(estimate).collect()
}

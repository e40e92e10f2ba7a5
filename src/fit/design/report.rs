//! Report of a planned experiment in the form of its JSON.
//!
//! A [`Design`] has the expected uncertainties of the parameters at the values of the plan: estimates, correlations,
//! unidentifiable combinations, budgets and undetected biases. It has the [`Contribution`] of each measurement (or
//! coordinate of the only one), warnings with codes, and the cost in full simulations and in s. Its [`Advice`] on
//! marker positions (m), durations (s) and frame rates (1/s) has one [`Choice`] for each value, ascending, with marks
//! of the planned and the best one. Standard errors are one per parameter in its unit, null where it is not
//! identifiable. `Fit::design` computes the report; `Display` writes it as tables.

use crate::code::Code;
use crate::fit::uncertainty::budget::entries::BudgetLine;
use crate::fit::uncertainty::covariance::identifiability::UnidentifiableDirection;
use crate::fit::uncertainty::discrepancy::findings::UndetectedBias;
use crate::fit::uncertainty::estimate::Estimate;
use serde::{Deserialize, Serialize};

/// Expected uncertainties of a planned experiment. Its `Display` is the summary on the terminal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Design {
    /// Parameters at the values of the plan, with the expected standard errors, intervals and budgets of a fit.
    pub parameters: Vec<Estimate>,
    /// Correlations between the parameters; none where one is not identifiable.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Singular values of the Jacobian with normalized columns, descending.
    pub singular_values: Vec<f64>,
    /// Combinations of parameters that the plan does not determine.
    pub not_identifiable: Vec<UnidentifiableDirection>,
    /// Parameters that no choice of the advice determines either.
    pub never_identifiable: Vec<String>,
    /// The budgets of all parameters in one list.
    pub budget: Vec<BudgetLine>,
    /// Undetected bias: effect of omitted effects on each parameter that the planned data would not exclude.
    pub undetected_bias: Vec<UndetectedBias>,
    /// Contribution of each measurement, or of each coordinate of the only one; empty without several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contributions: Vec<Contribution>,
    /// Expected standard errors with other markers, durations and frame rates.
    pub advice: Vec<Advice>,
    /// Warnings, each with its code in brackets.
    pub warnings: Vec<String>,
    /// Codes of `warnings`, in the same order.
    pub warning_codes: Vec<Code>,
    /// Cost, in full simulations.
    pub simulations: f64,
    /// Wall-clock time, s.
    pub wall_seconds: f64,
}

/// Contribution of a measurement to the expected uncertainty. A plan of one measurement has one for each coordinate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Contribution {
    /// Name of the measurement.
    pub measurement: String,
    /// Coordinate; empty for all values of the measurement.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub axis: String,
    /// Number of values.
    pub values: usize,
    /// Standard error of each parameter by these values and the priors alone, in its unit; null where these do not
    /// determine it.
    pub std_error_alone: Vec<Option<f64>>,
    /// Standard error of each parameter by all other values and the priors, in its unit; null where these do not
    /// determine it.
    pub std_error_without: Vec<Option<f64>>,
}

/// Property of a planned recording that the advice varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum DesignVariable {
    /// Arc length of the marker, m.
    MarkerPosition,
    /// Duration of the recording, s.
    Duration,
    /// Frames per second, 1/s.
    FrameRate,
}

/// Expected standard errors of a recording for several choices of one design variable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Advice {
    /// Property that the choices vary.
    pub variable: DesignVariable,
    /// Name of the recording or of the experiment.
    pub observation: String,
    /// Choices in the order of their values.
    pub choices: Vec<Choice>,
}

/// One choice of a design variable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Choice {
    /// Value of the design variable: arc length, m, duration, s, or frame rate, 1/s.
    pub value: f64,
    /// Expected standard error of each parameter, in its unit; null where it is not identifiable.
    pub std_error: Vec<Option<f64>>,
    /// Whether the choice is that of the plan.
    pub planned: bool,
    /// Whether the choice is recommended: the smallest errors of all parameters together. Of durations and rates it is
    /// the smallest one that is nearly as good.
    pub best: bool,
}

//! Entries of the uncertainty budget of a report, as they are stored.
//!
//! An estimate with a standard error has one [`BudgetLine`] per source of uncertainty (an input, `noise`,
//! `experiments`, `mesh`, `step`). Its contribution is a standard uncertainty in the unit of the parameter; the share
//! is a fraction of the combined variance, negative where a correlation compensates others. The standard uncertainty of
//! an input is in the unit of the input. There is one [`InputSensitivity`], the response to +1 %, for each listed input
//! without a stated uncertainty: in the unit of the parameter, and as a fraction of estimates of positive parameters.
//! [`MonteCarlo`] is the spread of its Monte Carlo fits, if requested, beside the standard deviation that the budget
//! predicts. `combined` creates the lines and the spread, `input_sensitivities` the responses.

use crate::scene::Parameter;
use serde::{Deserialize, Serialize};

/// One source of the uncertainty budget of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct BudgetLine {
    /// Source of the uncertainty: name of an input, `noise`, `mesh`, `step` or `experiments`.
    pub source: String,
    /// Name of the parameter.
    pub parameter: Parameter,
    /// Standard uncertainty of an input, in its unit; null for other sources.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    /// Unit of the source.
    #[serde(skip_serializing_if = "String::is_empty", default)]
    pub unit: String,
    /// Change of the parameter per change of the source, both in their units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<f64>,
    /// Relative change of the parameter per relative change of the source.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_sensitivity: Option<f64>,
    /// Standard uncertainty of the parameter by this source alone, in the parameter's unit.
    pub contribution: f64,
    /// Fraction of the combined variance; negative where a correlation compensates others.
    pub share: f64,
    /// Degrees of freedom of the source; null if there are many.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
}

impl BudgetLine {
    /// A line of a `source`, without unit, standard uncertainty and sensitivity. `contribution` is the standard
    /// uncertainty of the parameter by the source, in the parameter's unit, with its `degrees_of_freedom` (`None`:
    /// many). The share is the squared contribution until it is divided by the combined variance.
    pub(crate) fn new(
        parameter: Parameter,
        source: impl Into<String>,
        contribution: f64,
        degrees_of_freedom: Option<f64>,
    ) -> Self {
        Self {
            source: source.into(),
            parameter,
            std: None,
            unit: String::new(),
            sensitivity: None,
            relative_sensitivity: None,
            contribution,
            share: contribution * contribution,
            degrees_of_freedom,
        }
    }
}

/// Spread of the estimates over fits with random inputs and noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct MonteCarlo {
    /// Number of fits, those that failed and are left out included.
    pub fits: usize,
    /// Standard deviation of the estimates, in the parameter's unit.
    pub std: f64,
    /// 2.5 and 97.5 percentiles of the estimates, in the parameter's unit.
    pub interval95: [f64; 2],
    /// Standard deviation that the uncertainty budget predicts, in the parameter's unit.
    pub linear_std: f64,
}

/// Sensitivity of a parameter to +1 % of an input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct InputSensitivity {
    /// Name of the input; a vector by the name of its components.
    pub source: String,
    /// Value of the input in the scene, in its unit; null for a vector, and where experiments differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Unit of the input; empty for a pure number.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Change of the estimate, in its unit.
    pub change: f64,
    /// Relative change of the estimate, as a fraction, of a positive parameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
}

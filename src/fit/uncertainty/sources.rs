//! Where the uncertainty of a parameter comes from, as reports say it.

use crate::scene::Parameter;
use serde::{Deserialize, Serialize};

/// A source of uncertainty, and what it does to a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BudgetLine {
    /// A known number of the scenes, `noise`, `mesh`, `step` or `experiments`.
    pub source: String,
    /// The parameter.
    pub parameter: Parameter,
    /// Standard uncertainty of the source in its own unit, where it is a number of the scenes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    /// The unit of the source.
    #[serde(skip_serializing_if = "String::is_empty", default)]
    pub unit: String,
    /// Change of the parameter over that of the source, both in their units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<f64>,
    /// Per cent of the parameter per per cent of the source, where both have a size.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_sensitivity: Option<f64>,
    /// Standard uncertainty of the parameter by this source alone, in the parameter's unit.
    pub contribution: f64,
    /// Part of the combined variance; below zero where a correlation makes up for others.
    pub share: f64,
    /// Degrees of freedom, where there are few.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
}

/// What many fits say of a parameter, each with other known numbers and other noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct MonteCarlo {
    /// How many fits.
    pub fits: usize,
    /// Standard deviation of their estimates, in the parameter's unit.
    pub std: f64,
    /// Their percentiles 2.5 and 97.5.
    pub interval95: [f64; 2],
    /// What the budget says to that: noise and known numbers together.
    pub linear_std: f64,
}

/// What one per cent more of a number does to a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PerCent {
    /// The number, by its place in the scene; a vector by that of its components.
    pub source: String,
    /// How the estimate changes, in its unit.
    pub change: f64,
    /// The same in per cent of it, where it is positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
}

//! Where the uncertainty of a parameter comes from, as reports say it.

use crate::scene::Parameter;
use serde::{Deserialize, Serialize};
use std::fmt;

/// So many that could be it as well are named.
const NAMED: usize = 3;

/// A source of uncertainty, and what it does to a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct PerCent {
    /// The number, by its place in the scene; a vector by that of its components.
    pub source: String,
    /// How the estimate changes, in its unit.
    pub change: f64,
    /// The same over the estimate, where that is positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
}

/// What a term that the scene lacks would explain of what is left, or a number that is off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ScoreTest {
    /// The number, by its place in the scene that has the term.
    pub source: String,
    /// What it is.
    pub words: String,
    /// Its place in the order of what explains what is left best, from 1. What the data cannot tell apart has the same.
    #[serde(default)]
    pub place: usize,
    /// How large it would be, beside what the scene has, by the linear model.
    pub estimate: f64,
    /// Unit of the estimate.
    pub unit: String,
    /// The estimate over its standard error.
    pub sigmas: f64,
    /// Probability that noise alone makes any of the tested effects as significant.
    pub p_value: f64,
    /// The same if the autocorrelation of the residuals were that of the noise; none where they have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value_if_correlated: Option<f64>,
}

impl ScoreTest {
    /// Whether noise alone hardly explains it: 5 % of right models have any such.
    pub fn is_significant(&self) -> bool {
        self.p_value < 0.05
    }
}

impl fmt::Display for ScoreTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { source, words, estimate, unit, sigmas, p_value, .. } = self;
        let size = format!("{source}: {estimate:+.1e} {unit}");
        write!(f, "{words} ({}, {:.1} sigma, p = {p_value:.0e})", size.trim_end(), sigmas.abs())
    }
}

/// In words, place by place, what explains what noise hardly does; the best of a place, and what could be it as well.
pub(crate) fn looks_like(tests: &[ScoreTest]) -> Vec<String> {
    let places = tests.chunk_by(|a, b| a.place == b.place);
    let found = places.filter(|place| place[0].is_significant());
    let words = |place: &[ScoreTest]| {
        let others = place[1..].iter().take(NAMED).map(|test| format!(", or {}", test.words));
        let more = place.len().saturating_sub(1 + NAMED);
        let more = if more > 0 { format!(", or one of {more} more") } else { String::new() };
        format!("{}{}{more}", place[0], others.collect::<String>())
    };
    found.map(words).collect()
}

/// Bias of a parameter by an effect that the model omits and the data do not exclude.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct CouldHide {
    /// The number, by its place in the scene that has the term.
    pub source: String,
    /// What it is.
    pub words: String,
    /// Size of the effect, beside what the scene has, that plausibility and data together exceed with a probability of 5 %.
    pub size: f64,
    /// Plausible size before the data: scale of a Student t prior with four degrees of freedom, in the same unit.
    #[serde(default)]
    pub plausible: f64,
    /// Size by the score test alone; none where the parameters follow all of the effect.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimate: Option<f64>,
    /// Standard error of that estimate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimate_std_error: Option<f64>,
    /// Unit of these sizes.
    pub unit: String,
    /// The parameter, with its experiments if it is of some only.
    pub parameter: String,
    /// By how much the estimate would be off, in its unit.
    pub change: f64,
    /// The same over the true value, where that is positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
    /// The same in standard errors of the estimate.
    pub std_errors: f64,
    /// How many standard deviations of the noise it would leave in the residuals.
    pub visible: f64,
    /// What would tell.
    pub tell: String,
}

impl CouldHide {
    /// The bias of the parameter; either way, where the data do not determine the sign of the effect.
    fn effect(&self) -> String {
        let sign = |number: String| match self.estimate {
            Some(_) => number,
            None => format!("+-{}", number.trim_start_matches(['+', '-'])),
        };
        match self.relative {
            Some(relative) => {
                format!("{} {}", self.parameter, sign(format!("{:+.1} %", 100.0 * relative)))
            }
            None => format!("{} {}", self.parameter, sign(format!("{:+.1e}", self.change))),
        }
    }

    /// In a sentence, with what else the same number does to `others`.
    pub(crate) fn with(&self, others: &[&Self]) -> String {
        let Self { words, size, unit, tell, .. } = self;
        let size = match self.estimate {
            Some(_) => format!("{size:.1e} {unit}"),
            None => format!("+-{:.1e} {unit}", size.abs()),
        };
        let effects: Vec<String> = others.iter().map(|hidden| hidden.effect()).collect();
        format!("{words}, {}: {}; test: {tell}", size.trim_end(), effects.join(", "))
    }
}

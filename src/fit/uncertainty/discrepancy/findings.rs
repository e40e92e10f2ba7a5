//! Data types of score tests and undetected biases of a report, and the selection of those that texts describe.
//!
//! A [`ScoreTest`] has rank, estimated size, z-score and corrected p-value of one omitted effect. An [`UndetectedBias`]
//! is the bias of one parameter by one effect of a size that the data do not exclude. `score_tests` and
//! `undetected_bias` compute them; this module selects those that summary and warnings of a fit describe, and composes
//! the texts.
//!
//! `likely_omitted_effects` returns one text per rank whose best effect is significant (p-value below [`SIGNIFICANT`]);
//! it names up to [`NAMED`] others of the rank (one more if that is all) and counts the rest. The two selections of
//! biases leave out biases of at most [`DESCRIBED_BIAS`] standard errors. `biases_beyond_interval` returns the largest
//! relative bias of each parameter, for the first [`DESCRIBED`] parameters that have one. `largest_biases` returns up
//! to [`DESCRIBED`] effects with their biases; effects with the largest bias of some parameter come first.

use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::warning_list::percent;
use crate::summary::quantity::p_value as p_text;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Largest number of effects of one rank that a text names beside the best one; the others are counted.
const NAMED: usize = 3;
/// Largest number of effects, or of parameters, whose biases are described.
const DESCRIBED: usize = 3;

/// Corrected p-value below which a score test is significant: 5 % of right models have any significant test.
const SIGNIFICANT: f64 = 0.05;
/// Bias, in standard errors of the estimate, above which an undetected bias is described.
const DESCRIBED_BIAS: f64 = 1.0;

/// Score test of an omitted effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ScoreTest {
    /// Name of the number in the scene with the effect.
    pub source: String,
    /// Name of the effect, as text.
    pub effect: String,
    /// Rank of the effect among all tested ones, from 1; effects that the data cannot separate
    /// share a rank.
    #[serde(default)]
    pub rank: usize,
    /// Estimated size of the effect beyond the scene, by the linear model, in `unit`.
    pub estimate: f64,
    /// Unit of the estimate.
    pub unit: String,
    /// Estimate divided by its standard error.
    pub z_score: f64,
    /// Probability that noise alone makes any of the tested effects as significant.
    pub p_value: f64,
    /// The p-value if the autocorrelation of the residuals is that of the noise; null without
    /// autocorrelation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value_if_correlated: Option<f64>,
    /// Largest change of an estimate by the effect of this size, in standard errors of the estimate.
    #[serde(default)]
    pub bias_std_errors: f64,
    /// Name of the parameter with that change.
    #[serde(default)]
    pub biased_parameter: String,
    /// Bias of that parameter as a fraction of its true value, if the effect has this size; null where the parameter
    /// may be zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_bias: Option<f64>,
}

/// Text of the `size` of an effect: two digits and the `unit`, or per cent where the unit is empty (a fraction). A
/// negative size has its sign, a positive one none.
pub(crate) fn size_text(size: f64, unit: &str) -> String {
    match unit {
        "" if size < 0.0 => format!("-{}", percent(-size)),
        "" => percent(size),
        _ => format!("{size:.1e} {unit}"),
    }
}

impl ScoreTest {
    /// Whether the test is significant: the p-value, corrected for the number of tests, is below 5 %.
    pub fn is_significant(&self) -> bool {
        self.p_value < SIGNIFICANT
    }
}

impl fmt::Display for ScoreTest {
    /// Writes effect, path of its number, signed estimated size, absolute z-score and p-value, as `effect (path: +size,
    /// 3.1 sigma, p)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { source, effect, estimate, unit, z_score, p_value, .. } = self;
        let size = size_text(*estimate, unit);
        let sign = if *estimate < 0.0 { "" } else { "+" };
        let (z, p) = (z_score.abs(), p_text(*p_value));
        write!(f, "{effect} ({source}: {sign}{size}, {z:.1} sigma, {p})")
    }
}

/// Descriptions of the significant effects of `tests`, which are sorted by rank with the best effect of each rank
/// first. Each rank whose best effect is significant has one text: that effect with size and p-value, and the names of
/// the others of the rank, which the data do not separate from it. At most [`NAMED`] of these are named (one more if
/// that is all), and the rest is counted.
pub(crate) fn likely_omitted_effects(tests: &[ScoreTest]) -> Vec<String> {
    // Effects of one rank cannot be separated: a text names all of them.
    let ranks = tests.chunk_by(|a, b| a.rank == b.rank);
    let found = ranks.filter(|rank| rank[0].is_significant());
    let describe = |rank: &[ScoreTest]| {
        let mut text = rank[0].to_string();
        // One more than the limit is named too: that is no longer than its count.
        let named = if rank.len() == NAMED + 2 { NAMED + 1 } else { NAMED };
        rank[1..].iter().take(named).for_each(|test| text += &format!(", or {}", test.effect));
        match rank.len().saturating_sub(1 + named) {
            0 => text,
            more => format!("{text}, or {more} other effects"),
        }
    };
    found.map(describe).collect()
}

/// Undetected bias: bias of a parameter by an omitted effect that the data do not exclude.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct UndetectedBias {
    /// Name of the number in the scene with the effect.
    pub source: String,
    /// Name of the effect, as text.
    pub effect: String,
    /// Size of the effect, in `unit`, that plausibility and data together exceed with a probability
    /// of 5 %.
    pub size: f64,
    /// Plausible size before the data, in `unit`: scale of a Student t prior with four degrees of
    /// freedom.
    #[serde(default)]
    pub plausible_size: f64,
    /// Size of the effect by the score test alone, in `unit`; null where the effect is collinear
    /// with the parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimate: Option<f64>,
    /// Standard error of `estimate`, in `unit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimate_std_error: Option<f64>,
    /// Unit of the sizes.
    pub unit: String,
    /// Name of the parameter, with its experiments if it does not belong to all.
    pub parameter: String,
    /// Bias of the estimate, in its unit.
    pub change: f64,
    /// Bias as a fraction of the true value, where that is positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
    /// Bias in standard errors of the estimate.
    pub std_errors: f64,
    /// Effect on the residuals, in standard deviations of the noise.
    pub residual_effect: f64,
    /// Experiment that would reveal the effect.
    pub test: String,
}

/// Relative bias of undetermined sign above which both signs are listed: they then differ in size.
const ASYMMETRIC_BIAS: f64 = 0.2;

impl UndetectedBias {
    /// Relative biases `b` and `1/(1 + b) - 1` by the effect of either sign, the smaller one first: the estimate is too
    /// large or too small by the same factor. None where the data determine the sign (there is an `estimate`), without
    /// a relative bias, and where both are at most [`ASYMMETRIC_BIAS`] in absolute value.
    pub(crate) fn both_signs(&self) -> Option<[f64; 2]> {
        let relative = self.relative.filter(|_| self.estimate.is_none())?;
        // The response is linear in the logarithm: the effect of the other sign biases by the inverse factor.
        let opposite = (1.0 + relative).recip() - 1.0;
        (relative.abs().max(opposite.abs()) > ASYMMETRIC_BIAS)
            .then_some([relative.min(opposite), relative.max(opposite)])
    }

    /// Text of the parameter and its bias, in per cent or, without a relative bias, in its unit. Where the data do not
    /// determine the sign of the effect (no `estimate`) it is the range of `both_signs`, or without that has the sign
    /// `+-`.
    fn signed_bias(&self) -> String {
        if let Some([low, high]) = self.both_signs() {
            return format!("{} {:+.0} to {:+.0} %", self.parameter, 100.0 * low, 100.0 * high);
        }
        let bias = match self.relative {
            Some(relative) => format!("{:+.1} %", 100.0 * relative),
            None => format!("{:+.1e}", self.change),
        };
        match self.estimate {
            Some(_) => format!("{} {bias}", self.parameter),
            None => format!("{} +-{}", self.parameter, bias.trim_start_matches(['+', '-'])),
        }
    }

    /// Text of the effect with its size, the biases of parameters by it, and the experiment that would reveal it.
    /// `others` are the biases by the effect to list, this one included. The size has the sign `+-` where the data do
    /// not determine the sign (no `estimate`).
    pub(crate) fn with(&self, others: &[&Self]) -> String {
        let Self { effect, size, unit, test, .. } = self;
        let size = match self.estimate {
            Some(_) => size_text(*size, unit),
            None => format!("+-{}", size_text(size.abs(), unit)),
        };
        let effects: Vec<String> = others.iter().map(|bias| bias.signed_bias()).collect();
        format!("{effect}, {size}: {}; test: {test}", effects.join(", "))
    }
}

/// For each of the `parameters` the entry of `all` with its largest absolute relative bias, and that bias as a
/// fraction. Only entries above [`DESCRIBED_BIAS`] standard errors and with a relative bias count; parameters without
/// such an entry are left out. The order is that of the parameters; at most [`DESCRIBED`] are returned.
pub(crate) fn biases_beyond_interval<'a>(
    all: &'a [UndetectedBias],
    parameters: &[Estimate],
) -> Vec<(f64, &'a UndetectedBias)> {
    let largest = |e: &Estimate| {
        let label = e.label();
        let own =
            all.iter().filter(|bias| bias.parameter == label && bias.std_errors > DESCRIBED_BIAS);
        let sized = own.filter_map(|bias| Some((bias.relative?.abs(), bias)));
        sized.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    parameters.iter().filter_map(largest).take(DESCRIBED).collect()
}

/// Up to [`DESCRIBED`] effects with a bias above [`DESCRIBED_BIAS`] standard errors, each with all its biases above
/// that. An effect that biases some parameter more than all other effects, in standard errors, comes before those that
/// do not: estimates quote it. Within both groups the effect with the larger bias comes first. `all` must be sorted by
/// bias in standard errors, the largest first.
pub(crate) fn largest_biases(all: &[UndetectedBias]) -> Vec<Vec<&UndetectedBias>> {
    let mut effects: Vec<Vec<&UndetectedBias>> = Vec::new();
    // Entries are sorted by their bias: effects appear in the order of their largest one.
    for bias in all.iter().filter(|bias| bias.std_errors > DESCRIBED_BIAS) {
        match effects.iter_mut().find(|own| own[0].source == bias.source) {
            Some(own) => own.push(bias),
            None => effects.push(vec![bias]),
        }
    }
    // The estimates of a report quote the largest bias of each parameter, so that its effect is described first.
    let is_quoted = |own: &Vec<&UndetectedBias>| {
        own.iter().any(|bias| {
            let mut same = all.iter().filter(|other| other.parameter == bias.parameter);
            same.all(|other| other.std_errors <= bias.std_errors)
        })
    };
    let (quoted, others): (Vec<_>, Vec<_>) = effects.into_iter().partition(is_quoted);
    quoted.into_iter().chain(others).take(DESCRIBED).collect()
}

#[cfg(test)]
mod tests {
    use super::{UndetectedBias, largest_biases, size_text};

    /// Bias of a parameter by an effect, in standard errors and as the same fraction of the true value.
    fn bias(source: &str, parameter: &str, std_errors: f64) -> UndetectedBias {
        UndetectedBias {
            source: source.into(),
            effect: source.into(),
            size: 1.0,
            plausible_size: 1.0,
            estimate: None,
            estimate_std_error: None,
            unit: String::new(),
            parameter: parameter.into(),
            change: std_errors,
            relative: Some(std_errors),
            std_errors,
            residual_effect: 0.0,
            test: String::new(),
        }
    }

    /// An estimate that is four times too large may also be four times too small: +300 % and -75 %.
    #[test]
    fn large_biases_of_undetermined_sign_have_both_signs() {
        let large = bias("drag", "damping", 3.0);
        assert_eq!(large.both_signs(), Some([-0.75, 3.0]));
        assert_eq!(large.signed_bias(), "damping -75 to +300 %");
        assert_eq!(
            UndetectedBias { relative: Some(-0.75), ..large.clone() }.both_signs(),
            Some([-0.75, 3.0])
        );
        // A determined sign, and a size at which both signs are alike.
        assert_eq!(UndetectedBias { estimate: Some(1.0), ..large }.both_signs(), None);
        assert_eq!(bias("density", "modulus", 0.1).both_signs(), None);
    }

    #[test]
    fn largest_biases_of_all_parameters_come_first() {
        let mut all = vec![bias("density", "modulus", 9.0), bias("clamp", "modulus", 8.0)];
        all.extend([bias("taper", "modulus", 7.0), bias("drag", "damping", 6.0)]);
        let names: Vec<&str> = largest_biases(&all).iter().map(|own| &own[0].source[..]).collect();
        assert_eq!(names, ["density", "drag", "clamp"]);
    }

    #[test]
    fn sizes_of_factors_are_in_per_cent() {
        // Pure numbers in per cent, others with their unit.
        assert_eq!([size_text(0.32, ""), size_text(-1.8e-4, "")], ["32 %", "-0.02 %"]);
        assert_eq!(size_text(5.4e-2, "rad/(N m)"), "5.4e-2 rad/(N m)");
    }
}

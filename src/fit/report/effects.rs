//! Text of the effects that the model omits: those that the residuals suggest, and the biases of those that the data do
//! not exclude.
//!
//! Input: score tests and undetected biases of a fit report (or biases of a design). Output: the summary with a line
//! for each likely omitted effect, and a table of at most three effects with the largest biases above a standard error.
//! Its rows are one per effect and biased parameter: effect with its plausible or estimated size, parameter (if there
//! are several), bias, and a test that would reveal the effect. Biases are in per cent (a range if the two signs of the
//! effect have different ones), or in the unit of a parameter without a relative bias, whose symbol is not displayed.
//! The sign is `+-` if the data do not determine the size of the effect.

use crate::code::Code;
use crate::fit::report::FitReport;
use crate::fit::uncertainty::discrepancy::findings::{
    UndetectedBias, largest_biases, likely_omitted_effects,
};
use crate::summary::quantity::{number, quantity};
use crate::summary::{Summary, SummaryTable, TextColumn};

/// Significant digits of displayed sizes and biases.
const DIGITS: usize = 2;

/// The `summary` with a line for each likely omitted effect by the score tests of the `report`, and the table of its
/// undetected biases.
pub(super) fn add_omitted_effects(summary: Summary, report: &FitReport) -> Summary {
    let likely = likely_omitted_effects(&report.score_tests).into_iter();
    let summary = summary
        .facts("Likely omitted effects", likely.map(|words| Code::OmittedEffect.behind(words)));
    add_undetected_bias(summary, &report.undetected_bias)
}

/// The `summary` with a table of the effects in `all` with the largest biases above a standard error. One row per
/// effect and parameter: effect with its size, parameter (if there are several), bias, test. The title has the
/// warning's code. Without effects there are no rows.
pub(crate) fn add_undetected_bias(summary: Summary, all: &[UndetectedBias]) -> Summary {
    let is_alone = all.windows(2).all(|pair| pair[0].parameter == pair[1].parameter);
    let mut table = SummaryTable::new([
        TextColumn::wrapped("effect"),
        TextColumn::left(if is_alone { "" } else { "parameter" }),
        TextColumn::right("bias"),
        TextColumn::wrapped("test"),
    ]);
    // One row per biased parameter; the biases of one effect are consecutive.
    for own in largest_biases(all) {
        for (k, bias) in own.iter().enumerate() {
            let effect = format!("{}, {}", bias.effect, signed(bias.size, &bias.unit, bias));
            // An effect with biases of several parameters is named once.
            let (effect, test) = match k {
                0 => (effect, bias.test.clone()),
                _ => Default::default(),
            };
            let parameter = if is_alone { "" } else { &bias.parameter };
            table.row([effect, parameter.into(), size_of_bias(bias), test]);
        }
    }
    let of = match all.first().filter(|_| is_alone) {
        Some(bias) => format!(" of {}", bias.parameter),
        None => String::new(),
    };
    let title = format!("Undetected bias{of} by effects that these data do not exclude");
    summary.table(Code::UndetectedBias.behind(title), table)
}

/// The size `value` of an effect in its `unit` as text, or `+-` its magnitude if the data do not determine it (no
/// estimate). A size without unit is a relative change of an input, in per cent.
fn signed(value: f64, unit: &str, bias: &UndetectedBias) -> String {
    let size = |value: f64| match unit {
        "" => number(100.0 * value, DIGITS) + " %",
        _ => quantity(value, unit, DIGITS),
    };
    match bias.estimate {
        Some(_) => size(value),
        None => format!("+-{}", size(value.abs())),
    }
}

/// The bias as text: a range in per cent where both signs of the effect have different biases (`both_signs`), else one
/// number. It is in per cent, or without a relative bias in the unit of the parameter, without its symbol. The sign is
/// `+-` if the data do not determine the size of the effect.
fn size_of_bias(bias: &UndetectedBias) -> String {
    if let Some([low, high]) = bias.both_signs() {
        return format!("{:+.0} to {:+.0} %", 100.0 * low, 100.0 * high);
    }
    let sign = match (bias.estimate, bias.change < 0.0) {
        (None, _) => "+-",
        (_, true) => "-",
        (_, false) => "+",
    };
    match bias.relative {
        Some(relative) => format!("{sign}{:.1} %", 100.0 * relative.abs()),
        None => format!("{sign}{}", number(bias.change.abs(), DIGITS)),
    }
}

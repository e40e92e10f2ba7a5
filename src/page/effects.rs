//! Sections on effects that the model omits, such as a compliant clamp or a taper.
//!
//! Input: the score tests of a fit, and the undetected biases of a fit or a design. "Likely omitted effects"
//! ([`likely_omitted`]) has the score tests: rank, estimated size, its ratio to the standard error, largest bias and
//! p-values; tests that are not significant are folded. "Undetected bias" ([`undetected_bias`]) has effects that the
//! data do not exclude, with the bias that each would cause at its largest plausible size, and a test that would reveal
//! it; biases of zero are left out. Both are HTML tables, empty without entries. [`largest_biases`] is a sentence on
//! biases beyond the intervals, for the first card of a page.

use crate::code::Code;
use crate::fit::{Estimate, ScoreTest, UndetectedBias, biases_beyond_interval};
use crate::page::html::{escaped, folded, note, with_explanation};
use crate::page::number::{percent, signed_percent, signed_quantity, three_digits};
use crate::page::table::HtmlTable;
use crate::summary::quantity::counted;

/// Effects in a table that are shown at once; further ones are folded.
const SHOWN_EFFECTS: usize = 5;

/// The `text` of a number of `bias`, with a plus-minus sign in place of its own sign if the data do not determine the
/// sign of the effect (no `estimate`).
fn without_sign(bias: &UndetectedBias, text: &str) -> String {
    match bias.estimate.is_some() {
        true => text.into(),
        false => format!("\u{b1}{}", text.trim_start_matches(['+', '\u{2212}'])),
    }
}

/// The HTML table of biases that the data do not exclude, in the given order, with a note and an explanation; rows
/// beyond [`SHOWN_EFFECTS`] are folded. Biases of zero are left out; empty without others.
pub(super) fn undetected_bias(biases: &[UndetectedBias]) -> String {
    // An effect without influence on a parameter is no finding.
    let shown: Vec<&UndetectedBias> = biases.iter().filter(|bias| bias.change != 0.0).collect();
    if shown.is_empty() {
        return String::new();
    }
    let table = HtmlTable::new("undetected bias", shown)
        .text("effect", |bias| bias.effect.clone())
        .text("size", |bias| without_sign(bias, &effect_size(bias.size, &bias.unit)))
        .text("usual size", |bias| {
            let usual = effect_size(bias.plausible_size.abs(), &bias.unit);
            format!("\u{b1}{}", usual.trim_start_matches('+'))
        })
        .text("parameter", |bias| bias.parameter.clone())
        .text("bias", |bias| {
            if let Some(ends) = bias.both_signs() {
                return ends.map(signed_percent).join(" to ");
            }
            // A parameter that may be zero has no relative bias.
            let change = || three_digits(bias.change);
            without_sign(bias, &bias.relative.map_or_else(change, signed_percent))
        })
        .text("bias / standard error", |bias| three_digits(bias.std_errors))
        .html("test", |bias| format!("<td class=\"long\">{}</td>", escaped(&bias.test)));
    note(
        "Effects that these data do not exclude, at the largest plausible size, and the bias that each would cause. A bias is \
         relative to the true value. The next column is the same bias in the unit of the estimate, divided by the \
         statistical standard error. The largest number of standard errors comes first. Likely omitted effects are listed too, with the size \
         that the residuals allow. \u{b1}: the data do not determine the sign. A size in per cent is relative to the \
         value in the scene. The usual size is that of similar rods and setups. The test would reveal the effect.",
    ) + &table.render_folded(SHOWN_EFFECTS, "effects")
        + &explanation(Code::UndetectedBias)
}

/// A sentence (HTML) with the largest undetected bias of each parameter, in per cent, and its effect, where it exceeds
/// a standard error ([`biases_beyond_interval`]); for at most a few parameters. Empty without such biases.
pub(super) fn largest_biases(biases: &[UndetectedBias], parameters: &[Estimate]) -> String {
    let text = |(relative, bias): &(f64, &UndetectedBias)| {
        let [parameter, effect] = [&bias.parameter, &bias.effect].map(|text| escaped(text));
        format!("{} of {parameter} ({effect})", percent(*relative))
    };
    let texts: Vec<String> = biases_beyond_interval(biases, parameters).iter().map(text).collect();
    match texts.is_empty() {
        true => String::new(),
        false => format!("Not included: the largest undetected bias, {}.", texts.join(", ")),
    }
}

/// The signed size of an effect as text in its unit. A size without a unit is a fraction, shown in per cent.
fn effect_size(value: f64, unit: &str) -> String {
    if unit.is_empty() { signed_percent(value) } else { signed_quantity(value, unit) }
}

/// The score tests of omitted effects, with their biases, as HTML tables below a note; those that are not significant
/// are folded. Empty without tests.
pub(super) fn likely_omitted(tests: &[ScoreTest]) -> String {
    // Only effects that noise does not explain are shown at once.
    let (likely, others): (Vec<_>, Vec<_>) = tests.iter().partition(|test| test.is_significant());
    let mut html = String::new();
    if likely.is_empty() && !others.is_empty() {
        html += &note("No tested effect is significant.");
    }
    if !likely.is_empty() {
        html += &note(
            "Score tests: effects that explain the residuals better than noise does. Rank 1 explains the largest part of \
             their sum of squares; p also depends on the autocorrelation along the shape of the effect. Effects that share \
             a rank are not distinguishable by these data: one of them is enough. The bias by the effect of this size is \
             relative to the true value.",
        );
        html += &score_table(likely).render_folded(SHOWN_EFFECTS, "effects");
        html += &explanation(Code::OmittedEffect);
    }
    if !others.is_empty() {
        let count = counted(others.len(), "effect");
        let summary = format!("{count} without evidence");
        html += &folded(&summary, &score_table(others).render());
    }
    html
}

/// The table of score tests: effect, rank, estimate, its ratio to the standard error, largest bias, its ratio to the
/// standard error, and p-values. Rank 1 explains the largest part of the residuals; effects that the data cannot
/// distinguish share a rank. Both numbers of the bias are left out for effects that are not significant.
fn score_table(tests: Vec<&ScoreTest>) -> HtmlTable<&ScoreTest> {
    HtmlTable::new("score tests of omitted effects", tests)
        .html("effect", |test| {
            format!("{} <code>{}</code>", escaped(&test.effect), escaped(&test.source))
        })
        .text("rank", |test| test.rank.to_string())
        .text("estimate", |test| effect_size(test.estimate, &test.unit))
        .text("estimate / standard error", |test| {
            three_digits(test.z_score.abs().copysign(test.estimate))
        })
        .text("bias", |test| largest_bias(test).filter(|_| test.is_significant()))
        .text("bias / standard error", |test| {
            test.is_significant().then(|| three_digits(test.bias_std_errors))
        })
        .text("p", |test| three_digits(test.p_value))
        .text("p for autocorrelated noise", |test| test.p_value_if_correlated.map(three_digits))
}

/// The largest bias by an effect of the estimated size, in per cent of the true value, with the parameter; none where
/// the parameter may be zero.
fn largest_bias(test: &ScoreTest) -> Option<String> {
    let relative = signed_percent(test.relative_bias?);
    Some(format!("{relative} of {}", test.biased_parameter))
}

/// The explanation of a code of effects as HTML, folded below a heading.
fn explanation(code: Code) -> String {
    let html = with_explanation(&code.behind("About these effects"));
    format!("<div class=\"note\">{html}</div>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_effects_give_no_content() {
        assert!(undetected_bias(&[]).is_empty() && likely_omitted(&[]).is_empty());
        assert!(largest_biases(&[], &[]).is_empty());
    }
}

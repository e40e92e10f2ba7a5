//! Effects that the model omits: those that the data show, and those that could bias a parameter undetected.

use crate::code::Code;

use crate::fit::{Estimate, ScoreTest, UndetectedBias, biases_beyond_interval};
use crate::page::html::{escaped, folded, note, with_explanation};
use crate::page::number::{change, percent, short};
use crate::page::table::Table;
use crate::summary::quantity::counted;

/// Effects that are not folded.
const SHOWN: usize = 5;

/// The biases that the data do not exclude, the largest in standard errors first.
pub(super) fn undetected_bias(biases: &[UndetectedBias]) -> String {
    if biases.is_empty() {
        return String::new();
    }
    let heads = ["effect", "size", "parameter", "bias", "bias / standard error", "test"];
    let mut table = Table::new("undetected bias", heads);
    for bias in biases {
        // The data determine the sign of the effect only where they estimate it.
        let has_sign = bias.estimate.is_some();
        let signed = |text: String| match has_sign {
            true => text,
            false => format!("\u{b1}{}", text.trim_start_matches(['+', '\u{2212}'])),
        };
        let size = signed(size(bias.size, &bias.unit));
        let shift = match bias.relative {
            Some(relative) if relative > 0.0 => signed(format!("+{}", percent(relative))),
            Some(relative) => signed(percent(relative)),
            None => signed(short(bias.change)),
        };
        let cells =
            [size, bias.parameter.clone(), shift, short(bias.std_errors), bias.test.clone()];
        table.row(escaped(&bias.effect), cells.map(|cell| Some(escaped(&cell))).to_vec());
    }
    note(
        "Effects that these data could not reveal, at a plausible size, and the bias that each would cause. The test would \
         reveal the effect.",
    ) + &table.folded_after(SHOWN, "effects")
        + &explained(Code::UndetectedBias, "About these effects")
}

/// The largest bias of every parameter, as a sentence; nothing without any.
pub(super) fn largest_biases(biases: &[UndetectedBias], parameters: &[Estimate]) -> String {
    let text = |(relative, bias): &(f64, &UndetectedBias)| {
        let [parameter, effect] = [&bias.parameter, &bias.effect].map(|text| escaped(text));
        format!("{} of {parameter} ({effect})", percent(*relative))
    };
    let biases = biases_beyond_interval(biases, parameters);
    match &biases.iter().map(text).collect::<Vec<_>>()[..] {
        [] => String::new(),
        texts => format!("Not included: undetected bias, up to {}.", texts.join(", ")),
    }
}

/// The size of an effect; a pure number, which scales a number of the scene, in per cent.
fn size(value: f64, unit: &str) -> String {
    match unit {
        "" if value > 0.0 => format!("+{}", percent(value)),
        "" => percent(value),
        _ => change(value, unit),
    }
}

/// The score tests that noise alone hardly explains; the others are folded.
pub(super) fn likely_omitted(tests: &[ScoreTest]) -> String {
    let (likely, others): (Vec<_>, Vec<_>) = tests.iter().partition(|test| test.is_significant());
    let mut html = String::new();
    if likely.is_empty() && !others.is_empty() {
        html += &note("No tested effect is significant.");
    }
    if !likely.is_empty() {
        html += &note(
            "Score tests: effects that explain the residuals better than noise does. Rank 1 explains them best; effects that \
             share a rank are not distinguishable by these data.",
        );
        html += &score_table(&likely).folded_after(SHOWN, "effects");
        html += &explained(Code::OmittedEffect, "About these effects");
    }
    if !others.is_empty() {
        html += &folded(
            &format!("{} tested that noise explains as well", counted(others.len(), "effect")),
            &score_table(&others).html(),
        );
    }
    html
}

fn score_table(tests: &[&ScoreTest]) -> Table {
    let heads = [
        "effect",
        "rank",
        "estimate",
        "estimate / standard error",
        "bias / standard error",
        "p",
        "p if noise is correlated",
    ];
    let mut table = Table::new("score tests of omitted effects", heads);
    for test in tests {
        let cells = vec![
            Some(test.rank.to_string()),
            Some(escaped(&size(test.estimate, &test.unit))),
            Some(short(test.z_score.abs())),
            test.is_significant().then(|| short(test.bias_std_errors)),
            Some(short(test.p_value)),
            test.p_value_if_correlated.map(short),
        ];
        table.row(
            format!("{} <code>{}</code>", escaped(&test.effect), escaped(&test.source)),
            cells,
        );
    }
    table
}

fn explained(code: Code, line: &str) -> String {
    format!("<div class=\"note\">{}</div>\n", with_explanation(&code.behind(line)))
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

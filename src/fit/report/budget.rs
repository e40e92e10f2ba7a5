//! Text tables of the uncertainty budget of an estimate and of its sensitivities to inputs, for the summary of a fit or
//! a design.
//!
//! Input: an [`Estimate`] with budget lines (source, standard uncertainty, relative sensitivity, contribution, share of
//! the variance). The budget is listed only if the quoted interval is expanded, by inputs with a stated uncertainty;
//! its title has the combined standard uncertainty and the coverage factor (GUM). A Monte Carlo check, if computed, is
//! a line of its own. Sensitivities are the change of each estimate for +1 % of an input, the first [`NAMED`] per
//! parameter, which are the largest. Output: the summary with these tables.

use crate::fit::report::digits;
use crate::fit::report::quoted::QuotedEstimate;
use crate::fit::uncertainty::budget::entries::InputSensitivity;
use crate::fit::uncertainty::estimate::Estimate;
use crate::summary::quantity::quantity;
use crate::summary::{ItemTable, Summary};

/// Number of listed inputs of each parameter: those with the largest sensitivities.
const NAMED: usize = 3;
/// Significant digits of displayed uncertainties.
const DIGITS: usize = 2;
/// Significant digits of the values of inputs.
const VALUE_DIGITS: usize = 4;

/// The `summary` with the budget of the estimate `e` as a table, if its quoted interval is expanded by stated input
/// uncertainties. It has one row per source in the order of the budget. Its Monte Carlo check, if there is one, is
/// added as a fact.
pub(crate) fn add_budget(mut summary: Summary, e: &Estimate) -> Summary {
    let unit = e.name.unit();
    // Without a stated input uncertainty the budget has only the noise, which the table of estimates has already.
    if let (Some(combined), Some(factor), true) =
        (e.combined_std, e.coverage_factor, QuotedEstimate::new(e).is_expanded)
    {
        let title = format!(
            "Uncertainty budget of {}: combined standard uncertainty {}, coverage factor {factor:.2}",
            e.label(),
            quantity(combined, unit, DIGITS)
        );
        // Sources other than inputs have no standard uncertainty of their own: their cell is empty.
        let table = ItemTable::new(&e.budget)
            .left("source", |line| line.source.clone())
            .left("std. uncertainty", |line| line.std.map(|std| quantity(std, &line.unit, DIGITS)))
            .right("rel. sensitivity", |line| line.relative_sensitivity.map(two_decimals))
            .left("contribution", |line| quantity(line.contribution, unit, DIGITS))
            .right("share", |line| format!("{:.1} %", 100.0 * line.share));
        summary = summary.table(title, table);
    }
    // The Monte Carlo interval checks the linear propagation of the budget.
    if let Some(found) = &e.monte_carlo {
        let [std, linear] = [found.std, found.linear_std].map(|x| quantity(x, unit, DIGITS));
        let [low, high] = found.interval95.map(|x| digits(x, found.std));
        let text = format!(
            "{} +- {std}, 95 % [{low}, {high}] ({} fits; +- {linear} by the budget)",
            e.label(),
            found.fits
        );
        summary = summary.fact("Monte Carlo", text);
    }
    summary
}

/// The `summary` with a table of the changes of the estimates for +1 % of an input: the first [`NAMED`] inputs of each
/// estimate, which are the largest. Unchanged without any.
pub(crate) fn add_input_sensitivities(summary: Summary, estimates: &[Estimate]) -> Summary {
    let rows = estimates.iter().flat_map(|e| {
        let named = e.input_sensitivities.iter().take(NAMED);
        named.map(move |input| (e, input))
    });
    // A single estimate is named in the title instead of in a column.
    let is_alone = estimates.len() == 1;
    // The value of the input lets the reader judge its uncertainty.
    let value = |input: &InputSensitivity| Some(quantity(input.value?, &input.unit, VALUE_DIGITS));
    let table = ItemTable::new(rows)
        .left("input", |(_, input)| input.source.clone())
        .left("value", |(_, input)| value(input))
        .left("parameter", |(e, _)| (!is_alone).then(|| e.label()))
        .right("change", |(e, input)| change(input, e));
    let changed = if is_alone { estimates[0].label() } else { "the parameter".into() };
    let title = format!("Input sensitivities: change of {changed} for +1 % of an input");
    summary.table(title, table)
}

/// A relative sensitivity as text with sign and two decimals; `0.00` if it is rounded to zero.
fn two_decimals(sensitivity: f64) -> String {
    match format!("{sensitivity:+.2}") {
        text if ["+0.00", "-0.00"].contains(&&text[..]) => "0.00".into(),
        text => text,
    }
}

/// The change of the estimate `e` for +1 % of an `input` (of its value) as signed text. It is in per cent, or in the
/// unit of the parameter if there is no relative change, as of parameters that may be zero.
fn change(input: &InputSensitivity, e: &Estimate) -> String {
    match input.relative {
        Some(relative) => format!("{:+.2} %", 100.0 * relative),
        None => {
            let sign = if input.change < 0.0 { "" } else { "+" };
            format!("{sign}{}", quantity(input.change, e.name.unit(), DIGITS))
        }
    }
}

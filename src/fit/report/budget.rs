//! Tables of the uncertainty budget of an estimate and of its sensitivities to inputs.

use crate::fit::report::digits;
use crate::fit::report::quoted::QuotedEstimate;
use crate::fit::uncertainty::budget::entries::InputSensitivity;
use crate::fit::uncertainty::estimate::Estimate;
use crate::summary::quantity::quantity;
use crate::summary::{Summary, SummaryTable, TextColumn};

/// Number of listed inputs of each parameter: those with the largest sensitivities.
const NAMED: usize = 3;
/// Significant digits of uncertainties.
const DIGITS: usize = 2;

/// Adds the budget of an estimate if an input has a stated uncertainty, and its Monte Carlo check.
pub(crate) fn add_budget(mut summary: Summary, e: &Estimate) -> Summary {
    let unit = e.name.unit();
    if let (Some(combined), Some(factor), true) =
        (e.combined_std, e.coverage_factor, QuotedEstimate::new(e).is_expanded)
    {
        let title = format!(
            "Uncertainty budget of {}: combined standard uncertainty {}, coverage factor {factor:.2}",
            e.label(),
            quantity(combined, unit, DIGITS)
        );
        let mut table = SummaryTable::new([
            TextColumn::left("source"),
            TextColumn::left("std. uncertainty"),
            TextColumn::right("rel. sensitivity"),
            TextColumn::left("contribution"),
            TextColumn::right("share"),
        ]);
        for line in &e.budget {
            table.row([
                line.source.clone(),
                line.std.map(|std| quantity(std, &line.unit, DIGITS)).unwrap_or_default(),
                line.relative_sensitivity.map(two_decimals).unwrap_or_default(),
                quantity(line.contribution, unit, DIGITS),
                format!("{:.1} %", 100.0 * line.share),
            ]);
        }
        summary = summary.table(title, table);
    }
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

/// Adds the changes of the estimates for +1 % of the inputs with the largest sensitivities, in columns.
pub(crate) fn add_input_sensitivities(summary: Summary, estimates: &[Estimate]) -> Summary {
    let is_alone = estimates.len() == 1;
    let mut rows: Vec<[String; 3]> = Vec::new();
    for e in estimates {
        let label = if is_alone { String::new() } else { e.label() };
        let named = e.input_sensitivities.iter().take(NAMED);
        rows.extend(
            named.map(|input| {
                [label.clone(), format!("+1 % of {}", input.source), change(input, e)]
            }),
        );
    }
    if rows.is_empty() {
        return summary;
    }
    // Columns are aligned by their widest cells.
    let width = |column: usize| rows.iter().map(|row| row[column].len()).max().unwrap_or(0);
    let [label_width, input_width, change_width] = [0, 1, 2].map(width);
    let gap = if is_alone { 0 } else { 2 };
    let line = |[label, input, change]: &[String; 3]| {
        format!("{label:<label_width$}{:gap$}{input:<input_width$}  {change:>change_width$}", "")
    };
    let advice = "for an expanded interval: --known NAME=SIGMA";
    let lines = rows.iter().map(line).chain([advice.to_string()]);
    summary.facts("Input sensitivities", lines)
}

/// A relative sensitivity in two decimals; zero has no sign.
fn two_decimals(sensitivity: f64) -> String {
    match format!("{sensitivity:+.2}") {
        text if ["+0.00", "-0.00"].contains(&&text[..]) => "0.00".into(),
        text => text,
    }
}

/// The change of an estimate in per cent, or in the unit of the parameter if that may be zero.
fn change(input: &InputSensitivity, e: &Estimate) -> String {
    match input.relative {
        Some(relative) => format!("{:+.2} %", 100.0 * relative),
        None => {
            let sign = if input.change < 0.0 { "" } else { "+" };
            format!("{sign}{}", quantity(input.change, e.name.unit(), DIGITS))
        }
    }
}

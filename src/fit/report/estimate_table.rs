//! The table of the estimates, with the interval that is to be quoted.

use crate::fit::report::{FitReport, digits};
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::percent;
use crate::summary::quantity::number;
use crate::summary::{SummaryTable, TextColumn};

/// Parameters whose largest bias is listed below the table.
const BIASED: usize = 3;

/// Whether an input with a stated uncertainty contributes.
pub(super) fn has_known_inputs(e: &Estimate) -> bool {
    e.expanded95.is_some() && e.budget.iter().any(|line| line.std.is_some())
}

/// Estimates with standard errors, intervals and units. Where inputs have stated uncertainties the interval is the
/// expanded one, and the statistical one follows on a line of its own.
pub(crate) fn estimate_table(estimates: &[Estimate], value_heading: &str) -> SummaryTable {
    let is_expanded = estimates.iter().any(has_known_inputs);
    let interval = if is_expanded { "95 % interval (expanded)" } else { "95 % interval" };
    let mut table = SummaryTable::new([
        TextColumn::left("parameter"),
        TextColumn::left(value_heading),
        TextColumn::left("standard error"),
        TextColumn::left(interval),
        TextColumn::left("unit"),
    ]);
    for e in estimates {
        let [value, error, interval] = cells(e);
        let unit = if e.identifiable { e.name.unit() } else { "" };
        table.row([e.label(), value, error, interval, unit.into()]);
        if let (true, Some(std_error), Some(ends)) =
            (has_known_inputs(e), e.std_error, e.interval95)
        {
            let (error, ends) = (relative_error(e, std_error), interval_of(ends, std_error));
            table.row(["  statistical only".into(), String::new(), error, ends]);
        }
    }
    table
}

/// Whether the interval is that of the differences between experiments.
fn is_from_clusters(e: &Estimate) -> bool {
    e.cluster_jackknife.as_ref().is_some_and(|clusters| clusters.reported)
}

/// The errors that the intervals contain, and the largest that they do not.
pub(super) fn interval_content(report: &FitReport) -> Option<String> {
    let is_expanded = report.parameters.iter().any(has_known_inputs);
    let bias = largest_biases(report);
    let text = match is_expanded {
        _ if report.parameters.iter().all(|e| e.std_error.is_none()) => return None,
        true => "The interval contains noise, stated input uncertainties and discretization error.",
        false if report.parameters.iter().any(is_from_clusters) => {
            "The interval contains noise and differences between the experiments: inputs that they have in common are \
             taken as exact."
        }
        false if report.discretization_error.iter().any(|e| e.correction.is_some()) => {
            "The interval contains noise and discretization error: all inputs are taken as exact."
        }
        false => "The interval contains noise only: all inputs are taken as exact.",
    };
    Some(match bias {
        Some(bias) => format!("{text} Not contained: {bias}."),
        None => text.into(),
    })
}

/// The largest bias of every parameter by an effect that the model omits, for up to [`BIASED`] parameters.
fn largest_biases(report: &FitReport) -> Option<String> {
    let largest = |e: &Estimate| {
        let label = e.label();
        let own = report.undetected_bias.iter().filter(|bias| bias.parameter == label);
        let biases = own.filter_map(|bias| Some((bias.relative?.abs(), bias)));
        let (relative, bias) = biases.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(format!("{} of {label} ({})", percent(relative), bias.effect))
    };
    let texts: Vec<String> = report.parameters.iter().filter_map(largest).take(BIASED).collect();
    (!texts.is_empty()).then(|| format!("undetected bias, up to {}", texts.join(", ")))
}

/// Estimate, standard error and the interval that is to be quoted.
fn cells(e: &Estimate) -> [String; 3] {
    if let Some(lower) = e.lower95 {
        return ["-".into(), "-".into(), format!("at least {lower:.2e} (one-sided)")];
    }
    match (e.value, e.std_error, e.interval95) {
        (Some(value), None, Some([_, upper])) if e.upper95.is_some() => {
            [format!("{value:.2e}"), "-".into(), format!("at most {upper:.2e} (one-sided)")]
        }
        (Some(value), Some(error), Some(ends)) => {
            let quoted = e.expanded95.filter(|_| has_known_inputs(e));
            let error_there = e.combined_std.filter(|_| quoted.is_some()).unwrap_or(error);
            [
                digits(value, error),
                relative_error(e, error_there),
                interval_of(quoted.unwrap_or(ends), error_there),
            ]
        }
        (Some(value), ..) => [format!("{value:e}"), "-".into(), "no error".into()],
        _ => ["not identifiable".into(), String::new(), String::new()],
    }
}

/// An error in per cent of what is positive, else in the unit of the parameter.
pub(crate) fn relative_error(e: &Estimate, error: f64) -> String {
    match e.value.filter(|value| e.name.is_positive() && *value > 0.0) {
        Some(value) => number(100.0 * error / value, 2) + " %",
        None => format!("{} {}", digits(error, error), e.name.unit()).trim_end().into(),
    }
}

fn interval_of([low, high]: [f64; 2], error: f64) -> String {
    format!("[{}, {}]", digits(low, error), digits(high, error))
}

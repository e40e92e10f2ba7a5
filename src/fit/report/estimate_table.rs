//! The table of the estimates with their quoted intervals, and a sentence on the errors that these intervals contain.
//!
//! Input: rows from `quoted_estimates`, or a [`FitReport`]. [`estimate_table`] makes the table, [`interval_content`]
//! the sentence. Each row has the estimate with digits according to its error, the error in per cent (of a parameter
//! that may be zero in its unit), and the 95 % interval. A one-sided bound or `no error` replaces the interval,
//! `not identifiable` the estimate. The sentence is on the first case that applies: stated input uncertainties,
//! differences between experiments, a corrected discretization error, or noise only. A second sentence names the
//! largest undetected biases (above one standard error), which the intervals do not contain. Without any error or
//! interval there is no sentence. [`relative_error`] is the text of an error, and [`is_from_clusters`] returns whether
//! an interval is that of the differences between experiments.

use crate::fit::report::quoted::{QuotedEstimate, QuotedInterval, error_heading, interval_heading};
use crate::fit::report::{FitReport, digits};
use crate::fit::uncertainty::discrepancy::findings::{UndetectedBias, biases_beyond_interval};
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::warning_list::percent;
use crate::summary::quantity::number;
use crate::summary::{SummaryTable, TextColumn};

/// The table of parameter, estimate, error, interval and unit, one row per entry of `rows`; a statistical part is
/// indented and has no estimate. `value_heading` is the heading of the estimates. Without numbers the unit is empty.
pub(crate) fn estimate_table(rows: &[QuotedEstimate], value_heading: &str) -> SummaryTable {
    let mut table = SummaryTable::new([
        TextColumn::left("parameter"),
        TextColumn::left(value_heading),
        TextColumn::left(error_heading(rows)),
        TextColumn::left(interval_heading(rows)),
        TextColumn::left("unit"),
    ]);
    for row in rows {
        let [value, error, interval] = cells(row);
        match row.is_part {
            true => table.row([format!("  {}", row.label), String::new(), error, interval]),
            false => {
                let is_known = row.value.is_some() || row.interval.is_some();
                let unit = if is_known { &row.unit } else { "" };
                table.row([row.label.clone(), value, error, interval, unit.into()]);
            }
        }
    }
    table
}

/// Whether the reported interval of an estimate is that of the differences between experiments (cluster jackknife).
pub(crate) fn is_from_clusters(e: &Estimate) -> bool {
    e.cluster_jackknife.as_ref().is_some_and(|clusters| clusters.reported)
}

/// A sentence with the errors that the intervals contain, and a second one with the largest undetected biases, if there
/// are any. The first of these applies: stated input uncertainties, differences between experiments, corrected
/// discretization error, noise only (with an estimated discretization error or without). `None` if no parameter has a
/// standard error and no combination an interval.
pub(crate) fn interval_content(report: &FitReport) -> Option<String> {
    let is_expanded = report.parameters.iter().any(|e| QuotedEstimate::new(e).is_expanded);
    // Undetected biases may exceed the interval, and are reported beside it.
    let bias = largest_biases(report);
    // Combinations of parameters are corrected where the program chose mesh or step.
    let has_combination = report.determined_groups.iter().any(|g| g.interval95.is_some());
    let is_corrected = report.discretization_error.iter().any(|e| e.correction.is_some())
        || has_combination && !report.resolution.is_empty();
    let is_estimated = report.discretization_error.iter().any(|e| e.relative.is_some());
    // One sentence describes all intervals of the table: the first case that applies to any of them.
    let text = match is_expanded {
        _ if report.parameters.iter().all(|e| e.std_error.is_none()) && !has_combination => {
            return None;
        }
        true => "contains noise, stated input uncertainties and discretization error.",
        false if report.parameters.iter().any(is_from_clusters) => {
            "contains noise or, where these are larger, the differences between the experiments: inputs that the \
             experiments have in common are taken as exact."
        }
        false if is_corrected => {
            "contains noise and discretization error: all inputs are taken as exact (see --known)."
        }
        false if is_estimated => {
            "contains noise only: all inputs are taken as exact (see --known)."
        }
        false => {
            "contains noise only: all inputs are taken as exact (see --known), and the \
             discretization error is not estimated."
        }
    };
    let has_interval = report.parameters.iter().filter(|e| e.interval95.is_some()).count();
    let combinations = report.determined_groups.iter().filter(|g| g.interval95.is_some()).count();
    let subject = if has_interval + combinations > 1 { "Each interval" } else { "The interval" };
    let text = format!("{subject} {text}");
    Some(match bias {
        Some(bias) => format!(
            "{text} Not contained: {bias}. Exclude such effects before you quote a total uncertainty."
        ),
        None => text,
    })
}

/// The largest undetected bias of every parameter by [`biases_beyond_interval`] (above one standard error, of at most
/// three parameters), as one text. Each has its size in per cent, the parameter and the effect; `+-` where the data do
/// not determine the sign. `None` without any.
fn largest_biases(report: &FitReport) -> Option<String> {
    let biases = biases_beyond_interval(&report.undetected_bias, &report.parameters);
    let text = |(relative, bias): &(f64, &UndetectedBias)| {
        let size = match (bias.both_signs(), bias.estimate, bias.relative) {
            (Some([low, high]), ..) => format!("{:+.0} to {:+.0} %", 100.0 * low, 100.0 * high),
            (None, Some(_), Some(signed)) if signed < 0.0 => format!("-{}", percent(*relative)),
            (None, Some(_), _) => format!("+{}", percent(*relative)),
            (None, None, _) => format!("+-{}", percent(*relative)),
        };
        format!("{size} of {} ({})", bias.parameter, bias.effect)
    };
    let texts: Vec<String> = biases.iter().map(text).collect();
    (!texts.is_empty()).then(|| {
        let noun = if texts.len() == 1 { "bias" } else { "biases" };
        format!("the largest undetected {noun}, {}", texts.join(", "))
    })
}

/// The table cells of estimate, error and interval of a row. A one-sided bound is `at least` without, or `at most` with
/// the estimate. A value without interval is `no error`, and a row without value `not identifiable`. Estimate and
/// interval have digits by the standard error ([`digits`]).
fn cells(row: &QuotedEstimate) -> [String; 3] {
    match (row.interval, row.value, row.std) {
        (Some(QuotedInterval::AtLeast(bound)), ..) => {
            ["-".into(), "-".into(), format!("at least {bound:.2e} (one-sided)")]
        }
        (Some(QuotedInterval::AtMost(bound)), Some(value), _) => {
            [format!("{value:.2e}"), "-".into(), format!("at most {bound:.2e} (one-sided)")]
        }
        (Some(QuotedInterval::Between(ends)), Some(value), Some(std)) => {
            let [low, high] = ends.map(|end| digits(end, std));
            let error = error_text(std, row.relative, &row.unit);
            [digits(value, std), error, format!("[{low}, {high}]")]
        }
        (_, Some(value), _) => [format!("{value:e}"), "-".into(), "no error".into()],
        _ => ["not identifiable".into(), String::new(), String::new()],
    }
}

/// The `relative` error in per cent with two digits as text, or without one the `error` in its `unit`.
fn error_text(error: f64, relative: Option<f64>, unit: &str) -> String {
    match relative {
        Some(relative) => number(100.0 * relative, 2) + " %",
        None => format!("{} {unit}", digits(error, error)).trim_end().into(),
    }
}

/// The `error` of an estimate as text: in per cent of the value if the parameter is positive, or else in the unit of
/// the parameter.
pub(crate) fn relative_error(e: &Estimate, error: f64) -> String {
    let positive = e.value.filter(|value| e.name.is_positive() && *value > 0.0);
    error_text(error, positive.map(|value| error / value), e.name.unit())
}

//! The validation error of a fit, which belongs to its result.

use crate::fit::report::FitReport;
use crate::fit::uncertainty::discrepancy::prediction::Prediction;
use crate::numerics::total_order;
use crate::summary::Summary;
use crate::summary::quantity::{counted, quantity};

/// Significant digits of errors.
const DIGITS: usize = 3;

/// Adds a line with the errors of the validation data, if there are any.
pub(crate) fn add(summary: Summary, report: &FitReport) -> Summary {
    match text(report) {
        Some(text) => summary.fact("Validation error", text),
        None => summary,
    }
}

fn text(report: &FitReport) -> Option<String> {
    if let Some(held_out) = report.recordings.as_ref().and_then(|r| r.held_out.as_ref()) {
        let [mean, median, worst] =
            [held_out.mean, held_out.median, held_out.worst].map(|x| quantity(x, "m", DIGITS));
        return Some(format!(
            "{}: mean error {mean} per coordinate, median {median}, worst {worst}{}",
            counted(held_out.experiments, "held-out recording"),
            behind(&held_out.worst_experiment)
        ));
    }
    let unit = report.predictions.first().map(|p| &p.unit)?;
    let mut own: Vec<&Prediction> = report.predictions.iter().filter(|p| p.unit == *unit).collect();
    own.sort_by_cached_key(|x| total_order(x.rms));
    let n = own.len();
    let (median, worst) = (0.5 * (own[(n - 1) / 2].rms + own[n / 2].rms), own[n - 1]);
    let shown = |value: f64| {
        let (value, unit) = report.in_data_unit(value, unit);
        quantity(value, unit, DIGITS)
    };
    let [median, rms, expected] = [median, worst.rms, worst.expected].map(shown);
    let observation = &worst.observation;
    Some(match n {
        1 => format!("{observation}: RMS error {median}, {expected} expected"),
        _ => format!(
            "{n} held-out observations: median RMS error {median}, worst {rms}{}",
            behind(observation)
        ),
    })
}

/// A name in brackets, if there is one.
fn behind(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!(" ({name})") }
}

//! The line on the errors of the validation data in the summary of a fit. Validation data are measurements that were
//! held out of the fit.
//!
//! Input: a [`FitReport`] and the summary. If recordings with prescribed ends were held out, an error is the mean
//! absolute difference per coordinate, m, of the simulated markers from the recording. The line then has the mean,
//! median and worst of these errors, or the mean alone of a single recording. Otherwise an error is the RMS difference
//! of a held-out measurement. Only measurements with the unit of the first one count. The line then has the median and
//! the worst, or of a single measurement its error and the expected one. The worst one is named. Output of
//! [`add_validation_error`]: the summary with this line; unchanged without validation data.

use crate::fit::report::FitReport;
use crate::fit::uncertainty::discrepancy::prediction::Prediction;
use crate::numerics::total_order;
use crate::summary::Summary;
use crate::summary::quantity::{counted, quantity};

/// Significant digits of displayed errors.
const DIGITS: usize = 3;

/// The `summary` with a line of the errors of the validation data of the `report`, if there are any.
pub(crate) fn add_validation_error(summary: Summary, report: &FitReport) -> Summary {
    summary.facts("Validation error", validation_text(report))
}

/// The text of the errors of the validation data of a `report`; `None` without any. For held-out recordings with
/// prescribed ends it has the mean, median and worst of their mean errors, m per coordinate, or the mean alone of a
/// single one. Otherwise it has the RMS errors of the held-out measurements with the unit of the first one: median and
/// worst, or of a single one its error and the expected one. The name of the worst one is added.
fn validation_text(report: &FitReport) -> Option<String> {
    if let Some(held_out) = report.recordings.as_ref().and_then(|r| r.held_out.as_ref()) {
        let [mean, median, worst] =
            [held_out.mean, held_out.median, held_out.worst].map(|x| quantity(x, "m", DIGITS));
        // Mean, median and worst of one recording are equal.
        if held_out.experiments == 1 {
            let name = in_parentheses(&held_out.worst_experiment);
            return Some(format!("1 held-out recording{name}: mean error {mean} per coordinate"));
        }
        return Some(format!(
            "{}: mean error {mean} per coordinate, median {median}, worst {worst}{}",
            counted(held_out.experiments, "held-out recording"),
            in_parentheses(&held_out.worst_experiment)
        ));
    }
    // Errors in different units cannot be summarized; those in the first unit are.
    let unit = report.predictions.first().map(|p| &p.unit)?;
    let mut own: Vec<&Prediction> = report.predictions.iter().filter(|p| p.unit == *unit).collect();
    own.sort_by_cached_key(|x| total_order(x.rms));
    let n = own.len();
    let (median, worst) = (0.5 * (own[(n - 1) / 2].rms + own[n / 2].rms), own[n - 1]);
    let [median, rms, expected] =
        [median, worst.rms, worst.expected].map(|x| report.data_quantity(x, unit, DIGITS));
    let observation = &worst.observation;
    Some(match n {
        1 => format!("{observation}: RMS error {median}, {expected} expected"),
        _ => format!(
            "{n} held-out observations: median RMS error {median}, worst {rms}{}",
            in_parentheses(observation)
        ),
    })
}

/// A name in parentheses after a space; empty without a name.
fn in_parentheses(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!(" ({name})") }
}

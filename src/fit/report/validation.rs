//! The errors of the validation data of a fit, as one line of its text.
//!
//! Input: a [`FitReport`]. For recordings with prescribed ends it is the mean error per coordinate, m, of the
//! held-out recordings: mean, median and worst, or the mean alone of a single one. Otherwise it is the RMS error of
//! the held-out measurements with the unit of the first one (others are left out). It has the median and the worst,
//! or of a single one its error and the expected one. Output: the summary with this line; unchanged without
//! validation data.

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

/// With held-out recordings of driven ends the text of their errors: mean, median and worst of the mean errors, m per
/// coordinate. Otherwise that of the RMS errors of the held-out observations in the unit of the first one: median and worst,
/// of a single one the expected error too. The worst has its name. `None` without validation data.
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

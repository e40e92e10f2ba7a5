//! The validation error of a fit, as the first lines of the terminal report have it.

use crate::fit::report::FitReport;
use crate::fit::uncertainty::prediction::Prediction;
use crate::numerics::order;
use std::fmt;

/// One line with the errors of what was held out; none where nothing was.
pub(crate) fn write(f: &mut fmt::Formatter<'_>, report: &FitReport) -> fmt::Result {
    if let Some(held_out) = report.recordings.as_ref().and_then(|r| r.held_out.as_ref()) {
        return writeln!(
            f,
            "validation, {} held-out recordings: mean error {:.2e} m per coordinate, median {:.2e} m, worst \
             {:.2e} m{}",
            held_out.experiments,
            held_out.mean,
            held_out.median,
            held_out.worst,
            behind(&held_out.worst_experiment)
        );
    }
    let Some(unit) = report.predictions.first().map(|p| &p.unit) else { return Ok(()) };
    let mut own: Vec<&Prediction> = report.predictions.iter().filter(|p| p.unit == *unit).collect();
    order::sort_by(&mut own, |p| p.rms);
    let n = own.len();
    let (median, worst) = (0.5 * (own[(n - 1) / 2].rms + own[n / 2].rms), own[n - 1]);
    let shown = |value: f64| report.in_data_unit(value, unit);
    let ((median, shown_unit), (rms, _), (expected, _)) =
        (shown(median), shown(worst.rms), shown(worst.expected));
    let (observation, unit) = (&worst.observation, shown_unit);
    match n {
        1 => writeln!(
            f,
            "validation, {observation}: RMS error {median:.2e} {unit}, {expected:.2e} expected"
        ),
        _ => writeln!(
            f,
            "validation, {n} held-out observations: median RMS error {median:.2e} {unit}, worst {rms:.2e} {unit}{}",
            behind(observation)
        ),
    }
}

/// A name in brackets, if there is one.
fn behind(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!(" ({name})") }
}

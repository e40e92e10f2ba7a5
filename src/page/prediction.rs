//! The page of predictions: the errors of every measurement, then data and model.

use crate::fit::{MeasurementError, ValidationReport, ValidationSummary};
use crate::page::card::{Tone, card};
use crate::page::html::{escaped, note, section, section_if_any};
use crate::page::number::quantity;
use crate::page::recordings::recordings;
use crate::page::table::Table;
use crate::page::{page, residuals, settings, shapes};

/// Measurements that are not folded.
const SHOWN: usize = 12;

/// A self-contained HTML page of predictions. `title` names them, such as the scene. Series are shown if they were
/// [kept](crate::Fit::keep_plot_data).
pub fn prediction_page(report: &ValidationReport, title: &str) -> String {
    let mut body = first_card(report);
    body += &section("Prediction errors", &errors(&report.errors));
    let plots = report.plot_data.as_ref();
    if let Some(errors) = &report.recordings {
        let drawn = plots.and_then(|plots| plots.recordings.as_ref());
        body += &section("Free-run prediction errors", &recordings(errors, drawn));
    }
    if let Some(plots) = plots {
        body += &section("Residuals", &residuals::all_series(&plots.series, None));
        let shapes = shapes::shapes(false, plots);
        body += &section_if_any(shapes::heading(plots), &shapes);
        body += &section("Settings", &settings::settings(&plots.settings));
    }
    page("Prediction", title, &body, plots.map(|plots| &plots.version[..]))
}

/// The errors of all measurements, and the warnings.
fn first_card(report: &ValidationReport) -> String {
    let heads = ["measurements", "mean error", "median", "worst", "worst measurement"];
    let mut table = Table::new("summary of the prediction errors", heads).id("answer");
    for ValidationSummary { measurements, mean, median, worst, unit, worst_observation, .. } in
        &report.summary
    {
        let [mean, median, worst] =
            [mean, median, worst].map(|x| Some(escaped(&quantity(*x, unit))));
        let cells = vec![mean, median, worst, Some(escaped(worst_observation))];
        table.row(measurements.to_string(), cells);
    }
    let failed = report.failed.iter();
    let failed: Vec<String> =
        failed.map(|f| format!("not simulated: {} ({})", f.experiment, f.reason)).collect();
    let messages: Vec<String> = failed.into_iter().chain(report.warnings.clone()).collect();
    let tone = if messages.is_empty() { Tone::Good } else { Tone::Doubtful };
    card(tone, "Prediction without a fit", &table.html(), &[("Warnings", messages)])
}

fn errors(errors: &[MeasurementError]) -> String {
    let heads = ["measurement", "mean", "median", "worst", "RMS", "values", "remarks"];
    let mut table = Table::new("prediction errors", heads).id("errors");
    for e in errors {
        let [mean, median, worst, rms] =
            [e.mean, e.median, e.worst, e.rms].map(|x| Some(escaped(&quantity(x, &e.unit))));
        let remarks = escaped(&e.remarks().replace("sigma", "\u{3c3}"));
        let cells = vec![mean, median, worst, rms, Some(e.values.to_string()), Some(remarks)];
        table.row(escaped(&e.observation), cells);
    }
    note("Absolute differences between simulated and measured values.")
        + &table.folded_after(SHOWN, "measurements")
}

//! The page of predictions of validation data (`rodfit predict`).
//!
//! Input: a validation report, with plot data if they were kept. The first card has mean, median and worst of the mean
//! errors of the measurements in each unit, failed experiments and warnings. Sections follow with the errors of each
//! measurement and free-run errors of recordings; with plot data also residuals, the rod with the observed points, and
//! settings. Output: a self-contained HTML page.

use crate::fit::{MeasurementError, ValidationReport};
use crate::page::card::{MessageList, card};
use crate::page::html::{note, section};
use crate::page::number::quantity;
use crate::page::overlay::overlays;
use crate::page::recordings::recordings;
use crate::page::table::HtmlTable;
use crate::page::trajectory::trajectories;
use crate::page::{page, residuals, settings};
use crate::summary::Tone;

/// Measurements in the table of errors that are shown at once; further ones are folded.
const SHOWN_MEASUREMENTS: usize = 12;

/// A self-contained HTML page of predictions of validation data. `title` names them, such as the scene. Series, shapes
/// and settings are shown if plot data were [kept](crate::Fit::keep_plot_data).
pub fn prediction_page(report: &ValidationReport, title: &str) -> String {
    let mut body = first_card(report) + &section("Prediction errors", &error_table(&report.errors));
    let plots = report.plot_data.as_ref();
    if let Some(errors) = &report.recordings {
        let drawn = plots.and_then(|plots| plots.recordings.as_ref());
        body += &section("Free-run prediction errors", &recordings(errors, drawn));
    }
    if let Some(plots) = plots {
        body += &section("Residuals", &residuals::all_series(&plots.series, None));
        body += &section("Data and model in pictures", &overlays(&plots.overlays));
        body += &trajectories(false, plots);
        body += &section("Settings", &settings::settings(&plots.settings).render());
    }
    page("Prediction", title, &body, plots.map(|plots| &plots.version[..]))
}

/// The first card, HTML: a table of mean, median and worst of the mean errors of the measurements in each unit, and as
/// warnings the failed experiments and those of the report. Its severity is good without any, else doubtful.
fn first_card(report: &ValidationReport) -> String {
    let table = HtmlTable::new("summary of the prediction errors", &report.summary)
        .id("answer")
        .text("measurements", |s| s.measurements.to_string())
        .text("mean error", |s| quantity(s.mean, &s.unit))
        .text("median", |s| quantity(s.median, &s.unit))
        .text("worst", |s| quantity(s.worst, &s.unit))
        .text("worst measurement", |s| s.worst_observation.clone());
    let failed = report.failed.iter();
    let failed = failed.map(|f| {
        let name = if f.experiment.is_empty() { "the scene" } else { &f.experiment };
        format!("not simulated: {name} ({})", f.reason)
    });
    let messages: Vec<String> = failed.chain(report.warnings.clone()).collect();
    let tone = if messages.is_empty() { Tone::Good } else { Tone::Doubtful };
    let warnings = MessageList { heading: "Warnings", messages };
    card(tone, "Prediction without a fit", &table.render(), &[warnings])
}

/// The HTML table with the errors of every measurement (mean, median and worst absolute difference, RMS, number of
/// values) below a note; rows beyond [`SHOWN_MEASUREMENTS`] are folded.
fn error_table(errors: &[MeasurementError]) -> String {
    let table = HtmlTable::new("prediction errors", errors)
        .id("errors")
        .text("measurement", |e| e.observation.clone())
        .text("mean", |e| quantity(e.mean, &e.unit))
        .text("median", |e| quantity(e.median, &e.unit))
        .text("worst", |e| quantity(e.worst, &e.unit))
        .text("RMS", |e| quantity(e.rms, &e.unit))
        .text("values", |e| e.values.to_string())
        .text("relative RMS", |e| e.remarks().replace("sigma", "\u{3c3}"));
    note("Absolute differences between simulated and measured values.")
        + &table.render_folded(SHOWN_MEASUREMENTS, "measurements")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::FailedPrediction;

    #[test]
    fn failed_experiment_without_a_name_is_the_scene() {
        let failed =
            vec![FailedPrediction { experiment: String::new(), reason: "no equilibrium".into() }];
        let report = ValidationReport {
            summary: Vec::new(),
            errors: Vec::new(),
            recordings: None,
            failed,
            resolution: Vec::new(),
            warnings: Vec::new(),
            warning_codes: Vec::new(),
            wall_seconds: 0.0,
            plot_data: None,
        };
        let shown = first_card(&report);
        assert!(shown.contains("not simulated: the scene (no equilibrium)"), "{shown}");
    }
}

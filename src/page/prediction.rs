//! The page of predictions: errors of every measurement, then data and model.

use crate::fit::{MeasurementError, ValidationReport, ValidationSummary};
use crate::page::coded::with_its_code;
use crate::page::fit::{data, settings_table};
use crate::page::number::quantity;
use crate::page::recordings::recordings;
use crate::page::{escaped, figures, page, section};

/// A self-contained HTML page of predictions. `title` names them, such as the scene. Series are shown if they were
/// [kept](crate::Fit::keep_plot_data).
pub fn prediction_page(report: &ValidationReport, title: &str) -> String {
    let mut body = summary(report);
    body += &section("Errors of the prediction", &errors(&report.errors));
    let plots = report.plot_data.as_ref();
    if let Some(errors) = &report.recordings {
        let drawn = plots.and_then(|plots| plots.recordings.as_ref());
        body += &section("Recordings", &recordings(errors, drawn));
    }
    if let Some(plots) = plots {
        body += &section("Data and model", &data(&plots.series, None));
        let shapes = figures::shapes(false, plots);
        if !shapes.is_empty() {
            body += &section("The rod", &shapes);
        }
        body += &section("What was run", &settings_table(&plots.settings));
    }
    page("Prediction", &escaped(title), &body)
}

fn summary(report: &ValidationReport) -> String {
    let line = |s: &ValidationSummary| {
        let [mean, median, worst] = [s.mean, s.median, s.worst].map(|x| quantity(x, &s.unit));
        format!(
            "<div>{} measurements: mean error {mean}, median {median}, worst {worst} ({})</div>\n",
            s.measurements,
            escaped(&s.worst_observation)
        )
    };
    let lines: String = report.summary.iter().map(line).collect();
    let failed = report.failed.iter().map(|f| {
        format!("<li>not simulated: {} ({})</li>\n", escaped(&f.experiment), escaped(&f.reason))
    });
    let warnings = report.warnings.iter().map(|w| format!("<li>{}</li>\n", with_its_code(w)));
    let items: String = failed.chain(warnings).collect();
    let class = if items.is_empty() { "good" } else { "doubt" };
    let list = match items.is_empty() {
        true => String::new(),
        false => format!("<h2>Warnings</h2>\n<ul>\n{items}</ul>\n"),
    };
    format!(
        "<section class=\"verdict {class}\" id=\"verdict\"><p class=\"words\">Prediction without a fit</p>\n{lines}{list}\
         </section>\n"
    )
}

fn errors(errors: &[MeasurementError]) -> String {
    let row = |e: &MeasurementError| {
        let cells = [
            ("mean", quantity(e.mean, &e.unit)),
            ("median", quantity(e.median, &e.unit)),
            ("worst", quantity(e.worst, &e.unit)),
            ("RMS", quantity(e.rms, &e.unit)),
            ("values", e.values.to_string()),
            ("remarks", e.remarks().replace("sigma", "\u{3c3}")),
        ];
        let cell = |(head, text): (&str, String)| {
            format!("<td data-head=\"{head}\"><span>{}</span></td>", escaped(&text))
        };
        format!("<tr><th>{}</th>{}</tr>\n", escaped(&e.observation), cells.map(cell).concat())
    };
    let heads = ["measurement", "mean", "median", "worst", "RMS", "values", "remarks"];
    format!(
        "<p class=\"note\">Absolute differences between simulated and measured values.</p>\n\
         <div class=\"wide\" tabindex=\"0\"><table id=\"errors\" class=\"cards\"><thead><tr>{}</tr></thead>\n<tbody>{}</tbody>\
         </table></div>\n",
        heads.map(|head| format!("<th>{head}</th>")).concat(),
        errors.iter().map(row).collect::<String>()
    )
}

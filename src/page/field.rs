//! The page of a fit of numbers along the rod: the lists over the arc length, then data and model.

use crate::fit::{FieldEstimate, FieldReport};
use crate::page::chart::Chart;
use crate::page::fit::data;
use crate::page::number::Scale;
use crate::page::{escaped, figures, page, section};

/// Standard errors to either side that have 95 of 100.
const SIDE: f64 = 1.96;

/// A self-contained HTML page of a fit of numbers along the rod. `title` says which, such as the fit file's name.
pub fn field_page(report: &FieldReport, title: &str) -> String {
    let mut body = verdict(report);
    let fields: String = report.fields.iter().map(field).collect();
    body += &section("Along the rod", &fields);
    if !report.parameters.is_empty() {
        body += &section("Parameters", &singles(report));
    }
    body += &section("Data and model", &data(&report.series, None));
    page("Fit", &escaped(title), &body)
}

/// Whether to believe it, and everything that speaks against it.
fn verdict(report: &FieldReport) -> String {
    let (class, word) = match report.converged {
        true => ("good", "Found"),
        false => ("bad", "Not converged"),
    };
    let count: usize = report.fields.iter().map(|field| field.values.len()).sum();
    let notes: String =
        report.warnings.iter().map(|words| format!("<li>{}</li>\n", escaped(words))).collect();
    format!(
        "<section class=\"verdict {class}\" id=\"verdict\"><p class=\"words\">{word}</p>\
         <div>{count} numbers along the rod from {} coordinates, which say {:.1} combinations of them; residuals over \u{3c3} \
         {:.3} (root mean square).</div>\n<p class=\"note\">{:.0} runs or products, {:.1} s</p>\n\
         <h2>Notes</h2>\n<ul>\n{notes}</ul>\n</section>\n",
        report.values,
        report.effective_parameters,
        report.normalized_residual_rms,
        report.simulations,
        report.wall_seconds,
    )
}

/// A list over the arc length, with what the data and the prior say of it together.
fn field(field: &FieldEstimate) -> String {
    let up = Scale::fitting(field.values.iter().copied(), &field.unit);
    let across = Scale::fitting(field.arc_lengths.iter().copied(), "m");
    let at = |k: usize| field.arc_lengths[k] / across.factor;
    let numbers = || 0..field.values.len();
    let around = |k: usize, sigma: f64| {
        (at(k), [-SIDE, SIDE].map(|side| (field.values[k] + side * sigma) / up.factor))
    };
    let chart = Chart::new(
        figures::labelled("arc length", &across.unit),
        figures::labelled(&field.name, &up.unit),
    )
    .size(680.0, 320.0)
    .around(numbers().map(|k| around(k, field.standard_errors[k])), "var(--model)")
    .line(numbers().map(|k| (at(k), field.values[k] / up.factor)), "var(--model)");
    let name = escaped(&field.name);
    let seen = |k: &usize| field.standard_errors[*k] < 0.5 * field.prior_std[*k];
    let caption = format!(
        "the band holds each number with a probability of 95 %; of {} numbers the data more than halve what the prior leaves \
         open at {}",
        numbers().len(),
        numbers().filter(seen).count(),
    );
    figures::figure(&name, &format!("{name} over the arc length"), &chart.svg(), &caption)
}

/// Single numbers.
fn singles(report: &FieldReport) -> String {
    let row = |single: &crate::fit::SingleEstimate| {
        let scale = Scale::of(single.value, single.name.unit());
        let [value, error] = [single.value, single.standard_error]
            .map(|x| format!("{} {}", scale.show(x, Some(single.standard_error)), scale.unit));
        format!(
            "<tr><th>{}</th><td>{value}</td><td>{error}</td></tr>\n",
            escaped(&single.name.to_string())
        )
    };
    let rows: String = report.parameters.iter().map(row).collect();
    format!(
        "<div class=\"wide\" tabindex=\"0\"><table id=\"parameters\"><thead><tr><th>parameter</th><th>value</th>\
         <th>standard error</th></tr></thead>\n<tbody>{rows}</tbody></table></div>\n"
    )
}

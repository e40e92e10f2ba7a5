//! The page of a fit of parameters that vary along the rod (`[[field]]`).
//!
//! Input: the report of the fit. The first card has convergence, numbers of values and of determined combinations, the
//! RMS residual and the warnings. Sections have a plot of each distributed parameter over the arc length, single
//! parameters, and the residuals. A plot has the 95 % interval of each value. Its caption has the number of values that
//! the data determine: those with a standard error below `DETERMINED` of the standard deviation of the prior. Output: a
//! self-contained HTML page.

use crate::fit::{FieldEstimate, FieldReport, SingleEstimate};
use crate::page::card::{MessageList, card};
use crate::page::chart::{ChartAxis, IntervalPoint, PageChart};
use crate::page::figure::{MODEL, figure};
use crate::page::html::{note, section};
use crate::page::number::{Scale, quantity};
use crate::page::page;
use crate::page::residuals::all_series;
use crate::page::table::HtmlTable;
use crate::summary::Tone;

/// Half the width of a 95 % interval, in standard errors.
const COVERAGE_FACTOR: f64 = 1.96;
/// Ratio of a standard error to the standard deviation of the prior below which a value counts as determined by the
/// data.
const DETERMINED: f64 = 0.5;

/// A self-contained HTML page of a fit of values along the rod. `title` names the fit, such as its file.
pub fn field_page(report: &FieldReport, title: &str) -> String {
    let fields: String = report.fields.iter().map(field).collect();
    let body = first_card(report)
        + &section("Values along the rod", &fields)
        + &section("Parameters", &single_parameters(report))
        + &section("Residuals", &all_series(&report.series, None));
    page("Fit", title, &body, None)
}

/// The first card, HTML: whether the fit converged, number of values and of combinations of them that the data
/// determine, RMS residual in units of sigma, cost, and the warnings as notes.
fn first_card(report: &FieldReport) -> String {
    let (tone, headline) = match report.converged {
        true => (Tone::Good, "Converged"),
        false => (Tone::Bad, "Not converged"),
    };
    let count: usize = report.fields.iter().map(|field| field.values.len()).sum();
    let content = format!(
        "<p>{count} values along the rod from {} coordinates, which determine {:.1} combinations of the values. \
         RMS residual {:.3} \u{3c3}.</p>\n",
        report.values, report.effective_parameters, report.normalized_residual_rms,
    );
    let time = quantity(report.wall_seconds, "s");
    let cost = format!("{:.0} simulations or products, {time}", report.simulations);
    let notes = MessageList { heading: "Notes", messages: report.warnings.clone() };
    card(tone, headline, &(content + &note(&cost)), &[notes])
}

/// The figure of a distributed parameter over the arc length, with the 95 % intervals (1.96 standard errors) by data
/// and prior together. The caption has the number of values whose standard error is below [`DETERMINED`] of the
/// standard deviation of the prior.
fn field(field: &FieldEstimate) -> String {
    let values = Scale::for_values(field.values.iter().copied(), &field.unit);
    let arc_lengths = Scale::for_values(field.arc_lengths.iter().copied(), "m");
    let count = field.values.len();
    let point = |k: usize| {
        let [value, std] = [field.values[k], field.standard_errors[k]];
        let ends = [value - COVERAGE_FACTOR * std, value + COVERAGE_FACTOR * std];
        IntervalPoint { at: [field.arc_lengths[k], value], ends }
    };
    let points: Vec<IntervalPoint> = (0..count).map(point).collect();
    let (x, y) = (ChartAxis::new("arc length", &arc_lengths), ChartAxis::new(&field.name, &values));
    let chart = PageChart::new(x, y, [680.0, 320.0]).line_with_band(&field.name, &points, MODEL);
    // If the data have no influence, the standard error is that of the prior.
    let is_determined = |k: &usize| field.standard_errors[*k] < DETERMINED * field.prior_std[*k];
    let caption = format!(
        "band: 95 % interval of each value; the data more than halve the uncertainty of the prior for {} of {count} values",
        (0..count).filter(is_determined).count(),
    );
    figure(&field.name, &format!("{} over the arc length", field.name), &chart, &caption)
}

/// The HTML table of the parameters that are single numbers, with their standard errors in the unit of the value; empty
/// without any.
fn single_parameters(report: &FieldReport) -> String {
    // The error is in the unit of the value.
    let shown = |p: &SingleEstimate, x: f64| {
        Scale::for_size(p.value, p.name.unit()).format_with_unit(x, Some(p.standard_error))
    };
    HtmlTable::new("parameters", &report.parameters)
        .id("parameters")
        .text("parameter", |p| p.name.to_string())
        .text("value", |p| shown(p, p.value))
        .text("standard error", |p| shown(p, p.standard_error))
        .render()
}

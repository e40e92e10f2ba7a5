//! The page of a fit of values along the rod: the lists over the arc length, then data and model.

use crate::fit::{FieldEstimate, FieldReport, SingleEstimate};
use crate::page::card::{Tone, card};
use crate::page::chart::{Chart, labeled};
use crate::page::figure::{MODEL, figure};
use crate::page::html::{escaped, note, section, section_if_any};
use crate::page::number::{Scale, quantity};
use crate::page::page;
use crate::page::residuals::all_series;
use crate::page::table::Table;

/// Half the width of a 95 % interval, in standard errors.
const REACH: f64 = 1.96;
/// Standard errors below this part of the prior are those that the data determine.
const DETERMINED: f64 = 0.5;

/// A self-contained HTML page of a fit of values along the rod. `title` names the fit, such as its file.
pub fn field_page(report: &FieldReport, title: &str) -> String {
    let mut body = first_card(report);
    let fields: String = report.fields.iter().map(field).collect();
    body += &section("Values along the rod", &fields);
    body += &section_if_any("Parameters", &singles(report));
    body += &section("Residuals", &all_series(&report.series, None));
    page("Fit", title, &body, None)
}

/// Whether the fit converged, how much the data determine, and the warnings.
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
    let cost = format!(
        "{:.0} simulations or products, {}",
        report.simulations,
        quantity(report.wall_seconds, "s")
    );
    card(tone, headline, &(content + &note(&cost)), &[("Notes", report.warnings.clone())])
}

/// A list over the arc length, with the 95 % intervals by data and prior together.
fn field(field: &FieldEstimate) -> String {
    let up = Scale::fitting(field.values.iter().copied(), &field.unit);
    let across = Scale::fitting(field.arc_lengths.iter().copied(), "m");
    let point = |k: usize| {
        let ends = [-REACH, REACH]
            .map(|reach| (field.values[k] + reach * field.standard_errors[k]) / up.factor);
        ((field.arc_lengths[k] / across.factor, field.values[k] / up.factor), ends)
    };
    let points: Vec<_> = (0..field.values.len()).map(point).collect();
    let chart = Chart::new(labeled("arc length", &across.unit), labeled(&field.name, &up.unit))
        .size(680.0, 320.0)
        .line_with_band(&field.name, &points, MODEL);
    let is_determined = |k: &usize| field.standard_errors[*k] < DETERMINED * field.prior_std[*k];
    let caption = format!(
        "band: 95 % interval of each value; the data more than halve the uncertainty of the prior for {} of {} values",
        (0..points.len()).filter(is_determined).count(),
        points.len(),
    );
    let name = format!("{} over the arc length", field.name);
    figure(&escaped(&field.name), &name, &chart, &caption)
}

/// The other parameters.
fn singles(report: &FieldReport) -> String {
    let heads = ["parameter", "value", "standard error"];
    let mut table = Table::new("parameters", heads).id("parameters");
    for SingleEstimate { name, value, standard_error, .. } in &report.parameters {
        let scale = Scale::of(*value, name.unit());
        let cells = [*value, *standard_error]
            .map(|x| Some(escaped(&scale.with_unit(x, Some(*standard_error)))));
        table.row(escaped(&name.to_string()), cells.to_vec());
    }
    table.html()
}

//! The section "Discretization error" of a page of a fit: the bias of each estimate by the mesh and the time step.
//!
//! Input: the estimated errors of the report, as fractions of the estimates. The table has the applied correction, the
//! parts by mesh and by time step, and an upper bound of the remaining error. They are in per cent of the estimate, or
//! in its unit for a parameter that is not positive by its kind. A note follows on whether estimates are corrected.
//! Parameters without any estimated error are left out. Output: HTML, empty without errors.

use crate::fit::{DiscretizationError, Estimate};
use crate::page::html::note;
use crate::page::number::{percent, quantity, signed_percent, signed_quantity};
use crate::page::table::HtmlTable;

/// Errors below this fraction of an estimate are shown as `below 0.001 %`.
const NEGLIGIBLE: f64 = 1e-5;

/// The error `fraction` of the estimate `e` as text: in per cent, or in its unit for a parameter that is not positive
/// by its kind and has a value. A correction has a sign; other errors in per cent below [`NEGLIGIBLE`] are `below 0.001
/// %`.
fn shown_error(fraction: f64, e: &Estimate, is_correction: bool) -> String {
    let value = e.value.filter(|_| !e.name.is_positive()).map(f64::abs);
    match (value, is_correction) {
        (Some(value), true) => signed_quantity(fraction * value, e.name.unit()),
        (Some(value), false) => quantity(fraction * value, e.name.unit()),
        (None, true) => signed_percent(fraction),
        (None, false) if fraction < NEGLIGIBLE => "below 0.001 %".into(),
        (None, false) => percent(fraction),
    }
}

/// The HTML table of the estimated errors of all parameters, in their order, with a note on their correction.
/// Parameters without any error are left out; empty without errors.
pub(super) fn discretization(errors: &[DiscretizationError], parameters: &[Estimate]) -> String {
    let has_error = |error: &DiscretizationError| {
        [error.correction, error.mesh, error.step, error.relative].iter().any(Option::is_some)
    };
    let rows = errors.iter().zip(parameters).filter(|(error, _)| has_error(error));
    let table = HtmlTable::new("discretization error", rows)
        .text("parameter", |(_, e)| e.label())
        .text("correction", |(error, e)| error.correction.map(|x| shown_error(x, e, true)))
        .text("mesh", |(error, e)| error.mesh.map(|x| shown_error(x, e, false)))
        .text("time step", |(error, e)| error.step.map(|x| shown_error(x, e, false)))
        .html("remaining error, at most", |(error, e)| {
            error.relative.map(|x| format!("<b>{}</b>", shown_error(x, e, false)))
        })
        .render();
    let correction = match errors.iter().any(|error| error.correction.is_some()) {
        true => "Estimates are corrected; intervals include the remaining error.",
        false => "Estimates are not corrected for a given mesh and step.",
    };
    if table.is_empty() { table } else { table + &note(correction) }
}

//! The discretization error of the parameters.

use crate::fit::{DiscretizationError, Estimate};
use crate::page::html::{escaped, note};
use crate::page::number::{change, percent, quantity};
use crate::page::table::Table;

/// Errors below this part of a value are shown as below it.
const NEGLIGIBLE: f64 = 1e-5;

/// A table of the errors of mesh and step; nothing where none was estimated.
pub(super) fn discretization(errors: &[DiscretizationError], parameters: &[Estimate]) -> String {
    let heads = ["parameter", "correction", "mesh", "time step", "remaining error, at most"];
    let mut table = Table::new("discretization error", heads);
    for (error, e) in errors.iter().zip(parameters) {
        // Fractions of a value near zero have no meaning.
        let in_unit = e.value.filter(|_| !e.name.is_positive()).map(f64::abs);
        let size = |part: f64| match in_unit {
            Some(value) => escaped(&quantity(part * value, e.name.unit())),
            None if part < NEGLIGIBLE => "below 0.001 %".into(),
            None => percent(part),
        };
        let correction = error.correction.map(|by| match in_unit {
            Some(value) => escaped(&change(by * value, e.name.unit())),
            None if by > 0.0 => format!("+{}", percent(by)),
            None => percent(by),
        });
        let cells = vec![
            correction,
            error.mesh.map(size),
            error.step.map(size),
            error.relative.map(|all| format!("<b>{}</b>", size(all))),
        ];
        table.row(escaped(&e.label()), cells);
    }
    let corrected = errors.iter().any(|error| error.correction.is_some());
    match (table.len(), corrected) {
        (0, _) => String::new(),
        (_, true) => {
            table.html() + &note("Estimates are corrected; intervals include the remaining error.")
        }
        (_, false) => {
            table.html() + &note("Estimates are not corrected for a given mesh and step.")
        }
    }
}

//! The section "Correlation matrix": correlation coefficients of the parameters, and singular values of the scaled
//! Jacobian.
//!
//! Input: the estimates, their correlation matrix and the singular values of the Jacobian with columns of unit length.
//! Cells are colored by sign and size; unknown coefficients have a dash. A note has the singular values and the
//! condition number, the ratio of the largest to the smallest: a large one shows combinations of parameters that the
//! data hardly determine. Pages of fits and designs use it. Output: HTML, empty for a single parameter or without any
//! correlation.

use crate::fit::Estimate;
use crate::page::html::note;
use crate::page::number::{three_digits, with_minus_sign};
use crate::page::table::HtmlTable;

/// Opacity of the color of a correlation of one, %.
const LARGEST_OPACITY: f64 = 45.0;

/// The correlation matrix as an HTML table (row and column per parameter; unknown entries have a dash), followed by a
/// note. That has the singular values, in descending order, and the condition number (absent for fewer than two or if
/// the smallest is zero); without singular values there is no note. Empty for a single parameter, or without any
/// correlation.
pub(super) fn correlation_matrix(
    parameters: &[Estimate],
    matrix: &[Vec<Option<f64>>],
    singular_values: &[f64],
) -> String {
    let is_known = matrix.iter().flatten().any(Option::is_some);
    if parameters.len() < 2 || !is_known {
        return String::new();
    }
    let mut table = HtmlTable::new("correlation matrix", parameters.iter().zip(matrix))
        .class("matrix")
        .text("parameter", |(e, _)| e.label());
    for (k, other) in parameters.iter().enumerate() {
        table = table.html(&other.label(), |(_, row)| row.get(k).copied().flatten().and_then(cell));
    }
    // Singular values are in descending order.
    let ratio = match singular_values {
        [first, .., last] if *last > 0.0 => {
            format!("; condition number {}", three_digits(first / last))
        }
        _ => String::new(),
    };
    let values: Vec<String> = singular_values.iter().map(|s| three_digits(*s)).collect();
    let values = values.join(", ");
    let text = format!("Singular values of the Jacobian with normalized columns: {values}{ratio}.");
    table.render() + &if values.is_empty() { values } else { note(&text) }
}

/// The HTML cell of a correlation coefficient with three decimals, in a color by its sign and an opacity by its size;
/// `None` unless it is finite.
fn cell(value: f64) -> Option<String> {
    let color = if value < 0.0 { "var(--minus)" } else { "var(--plus)" };
    let opacity = LARGEST_OPACITY * value.abs().min(1.0);
    // A coefficient that is rounded to zero has no sign.
    let text = with_minus_sign(format!("{value:.3}")).replace("\u{2212}0.000", "0.000");
    value.is_finite().then(|| {
        format!(
            "<td style=\"background:color-mix(in srgb,{color} {opacity:.0}%,transparent)\">{text}</td>"
        )
    })
}

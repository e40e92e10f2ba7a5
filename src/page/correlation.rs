//! The correlation matrix of several parameters.

use crate::fit::{Design, Estimate, FitReport};
use crate::page::html::{escaped, note};
use crate::page::number::{short, signed};
use crate::page::table::Table;

/// Strength of the color of a correlation of one, %.
const STRONGEST: f64 = 45.0;

/// Parameters with what their covariance is made of.
pub(super) struct Correlations<'a> {
    parameters: &'a [Estimate],
    matrix: &'a [Vec<Option<f64>>],
    singular_values: &'a [f64],
}

impl<'a> From<&'a FitReport> for Correlations<'a> {
    fn from(report: &'a FitReport) -> Self {
        Self {
            parameters: &report.parameters,
            matrix: &report.correlation,
            singular_values: &report.singular_values,
        }
    }
}

impl<'a> From<&'a Design> for Correlations<'a> {
    fn from(design: &'a Design) -> Self {
        Self {
            parameters: &design.parameters,
            matrix: &design.correlation,
            singular_values: &design.singular_values,
        }
    }
}

impl Correlations<'_> {
    /// The matrix as a table; nothing for a single parameter, or where no correlation is known.
    pub fn html(&self) -> String {
        let is_known = self.matrix.iter().flatten().any(Option::is_some);
        if self.parameters.len() < 2 || !is_known {
            return String::new();
        }
        let names: Vec<String> = self.parameters.iter().map(|e| escaped(&e.label())).collect();
        let heads = std::iter::once("parameter".to_string()).chain(names.iter().cloned());
        let mut table = Table::new("correlation matrix", heads).class("matrix");
        for (name, row) in names.iter().zip(self.matrix) {
            table.row(name.clone(), row.iter().map(cell).collect());
        }
        let values: Vec<String> = self.singular_values.iter().map(|s| short(*s)).collect();
        let ratio = match (self.singular_values.first(), self.singular_values.last()) {
            (Some(first), Some(last)) if *last > 0.0 => {
                format!("; condition number {}", short(first / last))
            }
            _ => String::new(),
        };
        let values = match values.is_empty() {
            true => String::new(),
            false => note(&format!(
                "Singular values of the Jacobian with normalized columns: {}{ratio}.",
                values.join(", ")
            )),
        };
        table.html() + &values
    }
}

fn cell(value: &Option<f64>) -> Option<String> {
    let value = value.filter(|c| c.is_finite())?;
    let color = if value < 0.0 { "var(--minus)" } else { "var(--plus)" };
    let strength = STRONGEST * value.abs().min(1.0);
    let text = signed(format!("{value:.3}")).replace("\u{2212}0.000", "0.000");
    Some(format!(
        "<td style=\"background:color-mix(in srgb,{color} {strength:.0}%,transparent)\">{text}</td>"
    ))
}

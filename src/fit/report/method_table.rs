//! The table of the 95 % intervals by different methods, as text for a terminal.
//!
//! Input are the intervals of a report and the standard errors of its estimates. Every parameter has two rows, the
//! lower and the upper end, and a column for each method. An open end of a profile is `none`. A method without an
//! interval of the parameter has a blank cell; the table has no column for one without any interval.

use crate::fit::report::{FitReport, digits};
use crate::fit::uncertainty::method_intervals::{METHODS, method_intervals};
use crate::summary::{SummaryTable, TextColumn};

/// The table with the columns parameter, end, methods and unit; none if no methods are compared.
pub(super) fn method_table(report: &FitReport) -> Option<SummaryTable> {
    // From the estimates: stored reports of earlier versions have no list.
    let all = method_intervals(&report.parameters);
    if all.is_empty() {
        return None;
    }
    let left = ["parameter", "end"].map(TextColumn::left);
    let methods = METHODS.map(TextColumn::right);
    let unit = [TextColumn::left("unit")];
    let mut table = SummaryTable::new(left.into_iter().chain(methods).chain(unit));
    for (intervals, estimate) in all.iter().zip(&report.parameters) {
        for (k, end) in ["from", "to"].into_iter().enumerate() {
            // Digits by the standard error; without one, by about that of the interval.
            let text = |ends: [Option<f64>; 2]| {
                let width = ends[0].zip(ends[1]).map(|(low, high)| 0.25 * (high - low));
                let error = estimate.std_error.or(width).unwrap_or(0.0);
                match ends[k] {
                    Some(0.0) => "0".into(),
                    Some(x) => digits(x, error),
                    None => "none".into(),
                }
            };
            let cells = intervals.all().map(|ends| ends.map(text).unwrap_or_default());
            let name = if k == 0 { &intervals.parameter[..] } else { "" };
            let unit = if k == 0 { &intervals.unit[..] } else { "" };
            let row = [name.to_string(), end.to_string()].into_iter().chain(cells);
            table.row(row.chain([unit.to_string()]));
        }
    }
    Some(table)
}

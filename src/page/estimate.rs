//! The interval of an estimate that is to be quoted, and tables of estimates.

use crate::fit::{Estimate, QuotedEstimate, QuotedInterval, interval_heading};
use crate::page::html::{escaped, note};
use crate::page::number::{NONE, Scale, short};
use crate::page::table::Table;

/// The scale of an estimate, or of its bound.
pub(super) fn scale(e: &Estimate) -> Scale {
    let size = e.lower95.or(e.value.filter(|value| *value != 0.0)).or(e.upper95);
    Scale::of(size.unwrap_or(0.0), e.name.unit())
}

/// Ends of an interval with the digits of an error.
pub(super) fn interval([low, high]: [f64; 2], std: Option<f64>, scale: &Scale) -> String {
    format!("[{}, {}]", scale.show(low, std), scale.show(high, std))
}

/// The estimates with the intervals that are to be quoted. `wording` has the heads of the columns of the estimate and of
/// its error.
pub(super) fn table(rows: &[QuotedEstimate], [estimate, error]: [&str; 2]) -> String {
    let heads = ["parameter", estimate, error, interval_heading(rows), "unit"];
    let mut table = Table::new("estimates and intervals", heads).id("answer");
    for row in rows {
        let mut cells = cells(row);
        if row.is_part {
            (cells[0], cells[3]) = (None, None);
            let cells = cells.into_iter().take(3).map(|cell| cell.or(Some(" ".into())));
            table.marked_row("sub", row.label.clone(), cells.collect());
        } else {
            table.row(format!("<b>{}</b>", escaped(&row.label)), cells);
        }
    }
    let basis = match rows.iter().any(|row| row.is_expanded) {
        true => "Expanded interval: noise, inputs with a stated uncertainty, and discretization.",
        false => "Statistical interval: inputs are taken as exact.",
    };
    let has_interval = rows.iter().any(|row| row.std.is_some());
    table.html() + &if has_interval { note(basis) } else { String::new() }
}

fn cells(row: &QuotedEstimate) -> Vec<Option<String>> {
    let scale = Scale::of(row.size(), &row.unit);
    let unit = Some(escaped(&scale.unit));
    let bound = |text: &str, bound: f64| {
        Some(format!("{text} {} (one-sided)", scale.show(bound, Some(0.01 * bound))))
    };
    match (row.interval, row.value) {
        (Some(QuotedInterval::AtLeast(lower)), _) => {
            vec![None, None, bound("at least", lower), unit]
        }
        (_, None) => {
            vec![Some("<td class=\"bad\">not identifiable</td>".into()), None, None, None]
        }
        (Some(QuotedInterval::AtMost(upper)), Some(value)) => {
            let value = scale.show(value, Some(0.01 * upper));
            vec![Some(value), None, bound("at most", upper), unit]
        }
        (ends, Some(value)) => {
            let ends = match ends {
                Some(QuotedInterval::Between(ends)) => Some(interval(ends, row.std, &scale)),
                _ => None,
            };
            let value = format!("<b>{}</b>", scale.show(value, row.std));
            vec![Some(value), row.std.and_then(|std| error_text(row, std, &scale)), ends, unit]
        }
    }
}

/// An error in the unit of the estimate, and in per cent of an estimate that is positive.
fn error_text(row: &QuotedEstimate, std: f64, scale: &Scale) -> Option<String> {
    let own = scale.show(std, Some(std));
    match row.relative {
        _ if own == NONE => None,
        Some(relative) => Some(format!("{own} ({} %)", short(100.0 * relative))),
        None => Some(own),
    }
}

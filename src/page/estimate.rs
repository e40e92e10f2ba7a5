//! The main table of a page: estimates with standard errors and quoted 95 % intervals; and their parts as text.
//!
//! Input of [`estimate_table`]: quoted estimates in SI units, the headings ([`error_heading`]), and a sentence below
//! the table. Values have an SI prefix by their size and digits by their standard error. The error is also in per cent
//! of the value, for positive parameters (identified in their logarithm) and for combinations. The quoted interval is
//! the expanded one if inputs have a stated uncertainty; a row with the statistical part, without value and unit,
//! follows. Else the quoted interval is the statistical one.
//!
//! Where the data bound the parameter on one side, `at least` or `at most` replaces the interval. The standard error is
//! then absent. With a lower bound the value is absent too. Without value and lower bound the cell of the value is
//! `not identifiable`. Pages of fits, designs and comparisons use it. Output: HTML.

use crate::fit::{Estimate, QuotedEstimate, QuotedInterval, interval_heading};
use crate::page::html::{escaped, note};
use crate::page::number::{MISSING, Scale, three_digits};
use crate::page::table::HtmlTable;

/// The cell in the place of the value of a parameter that the data do not determine.
pub(super) const NOT_IDENTIFIABLE: &str = "<td class=\"bad\">not identifiable</td>";

/// The unit with a prefix for an estimate, by the size of its one-sided lower bound, else of its value unless that is
/// zero, else of its upper bound.
pub(super) fn estimate_scale(e: &Estimate) -> Scale {
    let size = e.lower95.or(e.value.filter(|value| *value != 0.0)).or(e.upper95);
    Scale::for_size(size.unwrap_or(0.0), e.name.unit())
}

/// An interval of SI values as text `[low, high]` in the unit of a scale, with digits by the error `std`, SI.
pub(super) fn interval([low, high]: [f64; 2], std: Option<f64>, scale: &Scale) -> String {
    format!("[{}, {}]", scale.format(low, std), scale.format(high, std))
}

/// A quoted interval as text in the unit of a scale, with digits by the error `std`, SI; `at least` or `at most` for a
/// one-sided bound. The digits of a bound follow `bound_error` of it.
pub(super) fn quoted_interval(
    quoted: QuotedInterval,
    std: Option<f64>,
    scale: &Scale,
    bound_error: impl Fn(f64) -> f64,
) -> String {
    let one_sided = |side: &str, bound: f64| {
        format!("{side} {} (one-sided)", scale.format(bound, Some(bound_error(bound))))
    };
    match quoted {
        QuotedInterval::AtLeast(lower) => one_sided("at least", lower),
        QuotedInterval::AtMost(upper) => one_sided("at most", upper),
        QuotedInterval::Between(ends) => interval(ends, std, scale),
    }
}

/// The heading of the column of standard errors: `standard uncertainty` (GUM) if inputs of any row have a stated
/// uncertainty, else `standard error`.
pub(super) fn error_heading(rows: &[QuotedEstimate]) -> &'static str {
    if rows.iter().any(|row| row.is_expanded) { "standard uncertainty" } else { "standard error" }
}

/// The HTML table of estimates with their quoted intervals and units, under the given headings, and below it `basis`: a
/// sentence on the errors that the intervals contain. Rows that are a part of the row above have no value and unit.
pub(super) fn estimate_table(
    rows: &[QuotedEstimate],
    value_heading: &str,
    error_heading: &str,
    basis: &str,
) -> String {
    // The statistical part of an estimate has blank cells where it repeats the row above.
    let or_blank =
        |row: &QuotedEstimate, text: Option<String>| text.or(row.is_part.then(|| " ".into()));
    let table = HtmlTable::new("estimates and intervals", rows)
        .id("answer")
        .row_class(|row| if row.is_part { "sub" } else { "" })
        .html("parameter", |row| match row.is_part {
            true => row.label.clone(),
            false => format!("<b>{}</b>", escaped(&row.label)),
        })
        .html(value_heading, |row| or_blank(row, value_cell(row).filter(|_| !row.is_part)))
        .html(error_heading, |row| or_blank(row, error_cell(row)))
        .html(interval_heading(rows), |row| or_blank(row, interval_cell(row)))
        .text("unit", |row| {
            // The unit stands beside the value or its bound.
            let has_unit = !row.is_part && (row.value.is_some() || is_lower_bound(row));
            has_unit.then(|| scale(row).unit)
        });
    table.render() + &note(&escaped(basis))
}

/// The unit with a prefix in which the numbers of a row are displayed, by the size of the row.
fn scale(row: &QuotedEstimate) -> Scale {
    Scale::for_size(row.size(), &row.unit)
}

/// Whether the data bound the value of a row from below only.
fn is_lower_bound(row: &QuotedEstimate) -> bool {
    matches!(row.interval, Some(QuotedInterval::AtLeast(_)))
}

/// The cell (HTML) of a row's value: `not identifiable` without one, and none beside a one-sided lower bound.
fn value_cell(row: &QuotedEstimate) -> Option<String> {
    match (row.interval, row.value) {
        (Some(QuotedInterval::AtLeast(_)), _) => None,
        (_, None) => Some(NOT_IDENTIFIABLE.into()),
        // Beside an upper bound a value has no error: its digits follow from the bound.
        (Some(QuotedInterval::AtMost(upper)), Some(value)) => {
            Some(scale(row).format(value, Some(0.01 * upper)))
        }
        (_, Some(value)) => Some(format!("<b>{}</b>", scale(row).format(value, row.std))),
    }
}

/// The standard error in the unit of the estimate, and in per cent of an estimate that is positive, as text; none
/// beside a one-sided bound and without a value.
fn error_cell(row: &QuotedEstimate) -> Option<String> {
    let is_two_sided = matches!(row.interval, None | Some(QuotedInterval::Between(_)));
    let std = row.std.filter(|_| is_two_sided && row.value.is_some())?;
    let text = scale(row).format(std, Some(std));
    let percent = row.relative.map(|x| format!(" ({} %)", three_digits(100.0 * x)));
    (text != MISSING).then(|| text + &percent.unwrap_or_default())
}

/// The quoted interval of a row as text; none of a parameter that is not identifiable.
fn interval_cell(row: &QuotedEstimate) -> Option<String> {
    let quoted = row.interval.filter(|_| row.value.is_some() || is_lower_bound(row))?;
    Some(quoted_interval(quoted, row.std, &scale(row), |bound| 0.01 * bound))
}

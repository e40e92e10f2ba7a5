//! The data of a chart as a CSV file (RFC 4180) that is embedded in the page as a link (`data:` URL), so that the page
//! needs no other file.
//!
//! [`csv_link`] returns the link (HTML) for rows of cells, of which the first is the header; the file is named after
//! the chart. Cells that a spreadsheet would compute as formulas get a leading apostrophe. [`csv_number`] is the text
//! of a number with at most `DIGITS` significant digits, with an exponent below 1e-4 and from 1e15 on. Charts use them
//! below their drawing.

use crate::input::text_cell::to_cell;
use crate::page::html::{escaped, percent_encoded};

/// Significant digits of numbers: more than any use needs, without the rounding errors of the last bits.
const DIGITS: usize = 10;
/// Longest name of a CSV file without its ending, in characters; the start of a longer one is cut.
const LONGEST_NAME: usize = 60;

/// An HTML link that saves rows of cells as a CSV file named after `name` (text). The first row is the header. Texts
/// that a spreadsheet would compute as formulas are escaped.
pub(super) fn csv_link(name: &str, rows: &[Vec<String>]) -> String {
    let mut text = String::new();
    for row in rows {
        let cells: Vec<String> = row.iter().map(|cell| quoted(cell)).collect();
        text += &cells.join(",");
        text += "\n";
    }
    format!(
        "<a download=\"{}\" aria-label=\"CSV of {}\" href=\"data:text/csv;charset=utf-8,{}\">CSV</a>",
        file_name(name),
        escaped(name),
        percent_encoded(&text, b",")
    )
}

/// A number with at most [`DIGITS`] significant digits, without trailing zeros, and with an exponent below 1e-4 and
/// from 1e15 on, except for zero.
pub(super) fn csv_number(value: f64) -> String {
    // The exponent format rounds to significant digits, whatever the size of the number.
    let rounded: f64 = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    match rounded.abs() {
        size if size != 0.0 && !(1e-4..1e15).contains(&size) => format!("{rounded:e}"),
        _ => format!("{rounded}"),
    }
}

/// A cell that no spreadsheet computes, in quotes where CSV requires them (RFC 4180).
fn quoted(cell: &str) -> String {
    let cell = to_cell(cell);
    match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.into_owned(),
    }
}

/// The letters, digits and underscores of a name, joined by hyphens, with the ending `.csv`. Of a name longer than
/// [`LONGEST_NAME`] only the end is kept.
fn file_name(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c } else { ' ' };
    let plain: String = name.chars().map(plain).collect();
    let joined = plain.split_whitespace().collect::<Vec<_>>().join("-");
    let from = joined.len().saturating_sub(LONGEST_NAME);
    format!("{}.csv", joined[from..].trim_start_matches('-'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_keep_names_apart_from_markup_addresses_and_formulas() {
        let row = |cells: [&str; 2]| cells.map(String::from).to_vec();
        let link = csv_link("<a> \"b\" & c, x", &[row(["time (s)", "=1+1"]), row(["a,b", "0.5"])]);
        assert!(link.contains("download=\"a-b-c-x.csv\""), "{link}");
        assert!(
            link.contains("aria-label=\"CSV of &lt;a&gt; &quot;b&quot; &amp; c, x\""),
            "{link}"
        );
        assert!(link.contains(",time%20%28s%29,%27%3D1%2B1%0A%22a,b%22,0.5%0A\""), "{link}");
    }

    #[test]
    fn numbers_keep_ten_digits() {
        for (value, text) in
            [(0.1 + 0.2, "0.3"), (-2.5e-7, "-2.5e-7"), (0.0, "0"), (1e6 / 3.0, "333333.3333")]
        {
            assert_eq!(csv_number(value), text);
        }
    }
}

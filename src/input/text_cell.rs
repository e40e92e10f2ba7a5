//! Text in the cells of CSV tables, guarded against evaluation as a formula.
//!
//! Spreadsheets compute cells that begin with `=`, `+`, `-`, `@`, a tab or a carriage return; a leading apostrophe
//! keeps them text (OWASP, "CSV Injection"). [`to_cell`] adds an apostrophe to a text with such a beginning, also
//! behind apostrophes. [`of_cell`] removes one, so that every text is read back unchanged. Numbers, such as `-1`, and
//! other texts are not changed.

use std::borrow::Cow;

/// First characters of text that spreadsheets may evaluate as a formula.
const BEGINS_FORMULA: [char; 6] = ['=', '+', '-', '@', '\t', '\r'];

/// Text for a cell of a table. A text that begins like a formula, also after apostrophes, gets one more apostrophe in
/// front. Numbers, such as `-1`, and other texts are unchanged.
pub(crate) fn to_cell(text: &str) -> Cow<'_, str> {
    let is_formula = is_guarded(text) && text.parse::<f64>().is_err();
    if is_formula { format!("'{text}").into() } else { text.into() }
}

/// Text of a cell without one leading apostrophe, if a text that begins like a formula follows it. Other cells are
/// unchanged.
#[cfg(feature = "cli")]
pub(crate) fn of_cell(cell: &str) -> &str {
    cell.strip_prefix('\'').filter(|text| is_guarded(text)).unwrap_or(cell)
}

/// Whether a text, after any leading apostrophes, begins with one of [`BEGINS_FORMULA`].
fn is_guarded(text: &str) -> bool {
    text.trim_start_matches('\'').starts_with(BEGINS_FORMULA)
}

#[cfg(test)]
mod tests {
    use crate::input::text_cell::{of_cell, to_cell};

    #[test]
    fn formulas_become_text_and_are_read_back() {
        let texts =
            ["=1+1", "+cmd|calc", "-2+3", "@SUM(A1)", "\t=1", "\r=1", "'=1", "''=1", "a=1", "'a"];
        for text in texts {
            assert_eq!(of_cell(&to_cell(text)), text);
        }
        assert_eq!(to_cell("=cmd|calc"), "'=cmd|calc");
        for plain in ["-2.5", "+3e-4", "a=1", "", "'a", "5e3"] {
            assert_eq!(to_cell(plain), plain);
        }
        for number in ["-2.5", "+3", "'a", "'"] {
            assert_eq!(of_cell(number), number);
        }
    }
}

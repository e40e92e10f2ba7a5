//! Check of the decimal signs of a table: whether its commas, or points beside them, may separate thousands.
//!
//! [`Decimals::add`] collects the fields of a table with their lines. [`Decimals::check`] rejects a table whose signs
//! are ambiguous, with the line of its first comma. Points alone are always decimal. Commas alone are decimal if the
//! columns are separated by semicolons, or if at least one number shows it. Where numbers with points and numbers with
//! commas occur, one of each must show it, with any separator. A number shows that its sign is decimal unless exactly
//! three digits follow it and one to three characters precede it, the first of which is not zero.

use crate::error::Error;
use crate::separator::Separator;
use std::path::Path;

/// Evidence in the numbers of a table on decimal points and commas.
#[derive(Default)]
pub(crate) struct Decimals {
    points: DecimalSign,
    commas: DecimalSign,
}

/// The text of a number in a file, and its line.
struct NumberText {
    /// Its line, from 1.
    line: u64,
    /// The field.
    text: String,
}

/// Numbers with one of the two decimal signs.
#[derive(Default)]
struct DecimalSign {
    /// The first number.
    first: Option<NumberText>,
    /// Whether a number shows that its sign does not separate thousands.
    is_decimal: bool,
}

impl DecimalSign {
    /// Adds the evidence of a number, the text `field` of a line (counted from 1), whose sign separates `whole` from
    /// `fraction`. The first number is kept. `is_decimal` becomes true unless the sign may separate thousands: exactly
    /// three digits behind it, and one to three characters before it that do not begin with zero.
    fn add(&mut self, line: u64, field: &str, whole: &str, fraction: &str) {
        if self.first.is_none() {
            self.first = Some(NumberText { line, text: field.into() });
        }
        // Thousands are followed by three digits, and begin with one to three that are no zero.
        let whole = whole.trim_start_matches(['-', '+']);
        let is_thousand = fraction.len() == 3
            && fraction.bytes().all(|b| b.is_ascii_digit())
            && (1..=3).contains(&whole.len())
            && !whole.starts_with('0');
        self.is_decimal |= !is_thousand;
    }
}

impl Decimals {
    /// Adds the evidence of a number, the text `field` of a line, on decimal signs: the first number with a point and
    /// the first with a comma are kept with their lines, and whether any number shows that its sign is a decimal one. A
    /// field without either sign changes nothing.
    pub fn add(&mut self, line: u64, field: &str) {
        for (sign, own) in [('.', &mut self.points), (',', &mut self.commas)] {
            if own.is_decimal {
                continue;
            }
            if let Some((whole, fraction)) = field.split_once(sign) {
                own.add(line, field, whole, fraction);
            }
        }
    }

    /// Rejects numbers with points beside numbers with commas unless one of each shows that its sign is decimal.
    /// Rejects commas alone if none shows it and the separator is no semicolon. The error has the line of the first
    /// comma.
    pub fn check(&self, path: &Path, separator: Separator) -> Result<(), Error> {
        let Some(NumberText { line, text }) = &self.commas.first else { return Ok(()) };
        if let Some(NumberText { line: other, text: point }) = &self.points.first
            && !(self.points.is_decimal && self.commas.is_decimal)
        {
            let message = format!(
                "found `{text}` with a comma, and `{point}` with a point in line {other}, one of which may separate \
                 thousands, allowed: one decimal sign in all numbers"
            );
            return Err(Error::data(path, *line, message));
        }
        if !self.commas.is_decimal && !separator.implies_decimal_commas() {
            let message = format!(
                "found `{text}`, whose comma may be a decimal one or separate thousands, allowed: numbers with \
                 decimal points, or semicolons between the columns"
            );
            return Err(Error::data(path, *line, message));
        }
        Ok(())
    }
}

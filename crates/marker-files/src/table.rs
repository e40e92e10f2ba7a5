//! Reader of tables of numbers with a header of names and units, as `t[ms],x[mm]`.
//!
//! Input are the bytes of a file. The separator is the first comma, semicolon or tab of the header; with the latter
//! two, numbers may have decimal commas. Lines that start with `#` are comments. Every field is a finite number,
//! blank or NaN; blank and NaN are missing values (`None`). Output: [`Table`] with names (in lower case) and units of
//! the columns, and the rows with their lines; values are not converted. Blank columns without a name are left out.
//! Other texts, rows with another number of fields than the header, and files that are no table are errors with the
//! line.

use crate::error::Error;
use crate::printable::{column_name, token};
use crate::unknown_file::{check_text, describe_table};
use std::path::{Path, PathBuf};

/// Units of time with their sizes in s.
pub const TIMES: [(&str, f64); 3] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6)];
/// Units of length with their sizes in m.
pub const LENGTHS: [(&str, f64); 3] = [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)];

/// A table of numbers; missing values are `None`.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    path: PathBuf,
    /// Name and unit of every column: `("x", Some("mm"))` for `x[mm]`.
    pub columns: Vec<(String, Option<String>)>,
    /// The names as they are in the file; those in `columns` are in lower case.
    pub original_names: Vec<String>,
    /// The rows below the header.
    pub rows: Vec<TableRow>,
}

/// A row of a table, with its line in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct TableRow {
    /// Line in the file.
    pub line: u64,
    /// One value per column.
    pub values: Vec<Option<f64>>,
}

impl Table {
    /// Reads a file as a table; every field is a number, blank or NaN. Lines that start with `#` are comments.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, a file that is no table, and a line with another number of fields than the header or
    /// another text.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::of(path, &crate::file::data(path)?)
    }

    /// Reads the bytes of a file as a table; `path` is for messages. Columns without a name are left out if they are
    /// blank, as spreadsheet programs pad lines, and in the first place, as they number rows. A single column is kept.
    ///
    /// # Errors
    ///
    /// Those of [`read`](Self::read); the kind of a file that is no table is described.
    pub fn of(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        check_text(path, bytes)?;
        // A file that is no table is often of another kind, whose description is clearer than the error of the
        // parser.
        Self::of_text(path, bytes).map_err(|error| describe_table(path, bytes, error))
    }

    /// Parses bytes as a table, without a description of files that are none; see [`Table::of`]. A byte-order mark and
    /// comments are skipped, and names become lower case. Errors are a line with another number of fields than the header,
    /// and a field that is no number.
    fn of_text(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        // A header has no decimal commas: its first separator is that of the file.
        let delimiter = delimiter(bytes);
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .delimiter(delimiter)
            .from_reader(bytes);
        let header = reader.headers().map_err(|error| csv_error(path, error))?.clone();
        let records: Vec<csv::StringRecord> =
            reader.records().collect::<Result<_, _>>().map_err(|error| csv_error(path, error))?;
        // Spreadsheet programs pad lines with blank columns, and data frames number their rows in the first one.
        let is_blank = |i: usize| records.iter().all(|record| record[i].is_empty());
        let is_kept =
            |i: &usize| !(header[*i].is_empty() && header.len() > 1 && (*i == 0 || is_blank(*i)));
        let kept: Vec<usize> = (0..header.len()).filter(is_kept).collect();
        let split = |i: &usize| {
            let (original_names, unit) = split_unit(&header[*i]);
            ((original_names.to_lowercase(), unit), original_names)
        };
        let (columns, original_names) = kept.iter().map(split).unzip();
        let mut rows = Vec::with_capacity(records.len());
        for record in &records {
            let line = record.position().map_or(0, |position| position.line());
            let commas = has_decimal_commas(delimiter);
            let value = |i: &usize| number(&record[*i], commas, &header[*i], path, line);
            let values = kept.iter().map(value).collect::<Result<_, _>>()?;
            rows.push(TableRow { line, values });
        }
        Ok(Self { path: path.into(), columns, original_names, rows })
    }

    /// Index of the column with a name in lower case; `None` if the table does not have it.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|(column, _)| column == name)
    }

    /// Index of the column with a name in lower case; an error with the found columns if it is missing.
    pub fn require(&self, name: &str) -> Result<usize, Error> {
        self.find(name).ok_or_else(|| {
            self.error(1, &format!("no column `{name}`; found {}", self.columns_found()))
        })
    }

    /// The names of all columns, joined by commas and cut to 80 characters, for messages.
    pub fn columns_found(&self) -> String {
        let found: Vec<&str> = self.columns.iter().map(|(column, _)| column.as_str()).collect();
        token(&found.join(", "))
    }

    /// Size of the unit in the header of a column, in SI units, by the list of `known` units; 1 without a unit, an error
    /// for another unit. `more` are allowed units beside these, for the message.
    pub fn factor(&self, column: usize, known: &[(&str, f64)], more: &str) -> Result<f64, Error> {
        let (name, unit) = &self.columns[column];
        let Some(unit) = unit else { return Ok(1.0) };
        let found = known.iter().find(|(symbol, _)| symbol == unit);
        found.map(|(_, factor)| *factor).ok_or_else(|| {
            let symbols: Vec<&str> = known.iter().map(|(symbol, _)| *symbol).collect();
            let allowed = symbols.join(", ");
            let (unit, name) = (token(unit), column_name(name));
            self.error(1, &format!("found the unit [{unit}] of `{name}`, allowed: {allowed}{more}"))
        })
    }

    /// An error at a line, counted from 1, of this file.
    pub fn error(&self, line: u64, message: &str) -> Error {
        Error::data(&self.path, line, message)
    }
}

/// The separator of the columns: the first comma, semicolon or tab in the header, which is the first line that is no
/// comment; a comma without any.
pub fn delimiter(bytes: &[u8]) -> u8 {
    let mut lines = bytes.split(|b| *b == b'\n');
    let header = lines.find(|line| !line.starts_with(b"#")).unwrap_or_default();
    *header.iter().find(|b| b",;\t".contains(b)).unwrap_or(&b',')
}

/// Name and unit of a column: `X` and `mm` of `X [mm]` or `X (mm)`; no unit without brackets at the end.
pub fn split_unit(header: &str) -> (String, Option<String>) {
    let brackets = |open: char, close: char| header.strip_suffix(close)?.split_once(open);
    // Brackets within a name belong to it; only those at the end have a unit.
    match brackets('[', ']').or_else(|| brackets('(', ')')) {
        Some((name, unit)) => (name.trim().into(), Some(unit.trim().into())),
        None => (header.into(), None),
    }
}

/// Whether numbers may have decimal commas in a table with this separator: semicolons or tabs.
pub(crate) fn has_decimal_commas(delimiter: u8) -> bool {
    b";\t".contains(&delimiter)
}

/// The finite number in a field, or `None` if it is blank or NaN; other texts are errors. With `commas` it may have a
/// decimal comma. `column`, `path` and `line` are for messages.
pub(crate) fn number(
    field: &str,
    commas: bool,
    column: &str,
    path: &Path,
    line: u64,
) -> Result<Option<f64>, Error> {
    if field.is_empty() || field.eq_ignore_ascii_case("nan") {
        return Ok(None);
    }
    // A comma is a decimal point only where another character separates the columns.
    let found = if commas { field.replace(',', ".").parse() } else { field.parse::<f64>() };
    found.ok().filter(|value| value.is_finite()).map(Some).ok_or_else(|| {
        let (column, field) = (column_name(column), token(field));
        let message =
            format!("column `{column}`: found `{field}`, allowed: a finite number, blank or NaN");
        Error::data(path, line, message)
    })
}

/// The error of a file that cannot be split into fields, with its line: another number of fields than the header, or no
/// UTF-8 text.
pub fn csv_error(path: &Path, error: csv::Error) -> Error {
    let line = error.position().map_or(1, |position| position.line());
    match error.into_kind() {
        csv::ErrorKind::Io(source) => Error::io(path, source),
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            let message = format!("found {len} fields, allowed: {expected_len} as in the header");
            Error::data(path, line, message)
        }
        csv::ErrorKind::Utf8 { err, .. } => {
            let field = err.field() + 1;
            let message =
                format!("field {field} is not UTF-8 text, allowed: a file saved as UTF-8");
            Error::data(path, line, message)
        }
        kind => Error::data(path, line, format!("{kind:?}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_are_no_text_are_named() {
        for (bytes, words) in [
            (&b"t,x[\xb5m]\n0,1\n"[..], "tip.csv:1: field 2 is not UTF-8 text"),
            (&b"t,x\n0,1\n0.5,\xff\n"[..], "tip.csv:3: field 2 is not UTF-8 text"),
        ] {
            let error = Table::of(Path::new("tip.csv"), bytes).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}

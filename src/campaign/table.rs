//! The table of a campaign (CSV): a row for each fit, a column for each changed key.
//!
//! Special columns are `fit` (path of the fit file) and `name`; columns whose name begins with `#` are comments.
//! Without a column `fit` every row applies to every fit file of the campaign; fit files in both places or in neither
//! are an error. Cells are numbers, booleans or lists in the notation of TOML, or texts; empty cells change nothing.
//! The separator is recognized, and with semicolons decimal commas are allowed. Output: [`table_rows`] returns a row
//! with fit file, name, changes and line number for each fit, in the order of the table. Invalid headers, no rows, and
//! rows without a fit file are errors with the line.

use crate::campaign::changes::Key;
use crate::campaign::row::{CampaignRow, TableLine};
use crate::error::Error;
use crate::input::text_cell::of_cell;
use marker_files::file::data;
use marker_files::printable::token;
use marker_files::table::{csv_error, delimiter, record_line};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Name of the column with the fit file, which is no key.
const FIT: &str = "fit";
/// Name of the column with the name of the fit, which is no key.
const NAME: &str = "name";

/// The rows of the table at `path`, in its order, each with the fit file of its own column, or combined with each of
/// `fits`. Errors have the line. They are a file that cannot be read or parsed, an invalid header, no rows, and a row
/// without its fit file. Fit files must come from either the column or `fits`, not from both or neither.
pub(crate) fn table_rows(path: &Path, fits: &[PathBuf]) -> Result<Vec<CampaignRow>, Error> {
    let bytes = data(path)?;
    // The byte order mark of spreadsheets.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let delimiter = delimiter(bytes);
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).delimiter(delimiter).from_reader(bytes);
    let names = reader.headers().map_err(|error| csv_error(path, bytes, error))?.clone();
    let header: Vec<&str> = names.iter().collect();
    let error = |line: u64, message: String| Error::Data { path: path.into(), line, message };
    check_header(&header).map_err(|message| error(1, message))?;
    let names_fits = header.contains(&FIT);
    if names_fits != fits.is_empty() {
        let found = if names_fits {
            "both a column fit and the key fits"
        } else {
            "neither a column fit \
                             nor the key fits"
        };
        return Err(error(1, format!("found {found}, allowed: one of the two")));
    }
    let mut all = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| csv_error(path, bytes, error))?;
        let line = record_line(bytes, record.position());
        let source = Some(TableLine { file: path.into(), line });
        let mut row = CampaignRow { source, ..CampaignRow::default() };
        for (column, cell) in header.iter().zip(&record).filter(|(_, cell)| !cell.is_empty()) {
            let cell = of_cell(cell);
            match *column {
                FIT => row.fit = cell.into(),
                NAME => row.name = cell.into(),
                comment if comment.starts_with('#') => {}
                key => drop(row.changes.insert(key.into(), cell_value(cell, delimiter))),
            }
        }
        if names_fits && row.fit.as_os_str().is_empty() {
            return Err(error(line, "fit: found none, allowed: the name of a fit file".into()));
        }
        // Each row applies to its own fit file, or to every matched one.
        match names_fits {
            true => all.push(row),
            false => {
                all.extend(fits.iter().map(|fit| CampaignRow { fit: fit.clone(), ..row.clone() }))
            }
        }
    }
    match all.is_empty() {
        true => Err(error(1, "found no rows, allowed: one or more".into())),
        false => Ok(all),
    }
}

/// Checks the columns of a table. Err with the message for one that appears twice, that is no key, or that is the same
/// key as another one by another name. `fit`, `name` and comments (`#`) are allowed.
fn check_header(header: &[&str]) -> Result<(), String> {
    let mut keys: Vec<(&str, Key)> = Vec::new();
    for (k, column) in header.iter().enumerate() {
        if header[..k].contains(column) {
            return Err(format!(
                "found the column {} twice, allowed: each column once",
                token(column)
            ));
        }
        if [FIT, NAME].contains(column) || column.starts_with('#') {
            continue;
        }
        // Two names of one key would set it twice, in an order that a user cannot see.
        let also = "; also fit, name, and columns whose name begins with #";
        let key = Key::new(column).map_err(|error| format!("{error}{also}"))?;
        if let Some((other, _)) = keys.iter().find(|(_, other)| *other == key) {
            return Err(format!(
                "found the columns {} and {}, which are the same parameter, allowed: one of the \
                 two",
                token(column),
                token(other)
            ));
        }
        keys.push((column, key));
    }
    Ok(())
}

/// The value of a cell: a number, true or false, a list or a table in the notation of TOML, or else a text; dates are
/// texts. With semicolons as `delimiter` a number may have a decimal comma. A number that TOML does not allow, as `.5`
/// or `007`, is a text.
fn cell_value(cell: &str, delimiter: u8) -> Value {
    let point = cell.replace(',', ".");
    let is_number = delimiter == b';' && point.parse::<f64>().is_ok();
    let cell = if is_number { &point } else { cell };
    // The parser of TOML recognizes numbers, booleans and lists.
    let parsed = format!("value = {cell}").parse::<Table>().ok();
    let value = parsed.filter(|table| table.len() == 1).and_then(|mut table| table.remove("value"));
    value.filter(|value| !value.is_datetime()).unwrap_or_else(|| Value::String(cell.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_below_blank_lines_are_those_of_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("table.csv");
        let rows = |text: &str| {
            std::fs::write(&file, text).unwrap();
            table_rows(&file, &[])
        };
        let found = rows("fit,material.density\n\n\r\na.toml,1000\nb.toml,1200\n").unwrap();
        let lines: Vec<u64> = found.iter().map(|row| row.source.as_ref().unwrap().line).collect();
        assert_eq!(lines, [4, 5]);
        let error = rows("fit,material.density\na.toml,1000\n\n,1200\n").err().unwrap();
        assert!(matches!(error, Error::Data { line: 4, .. }), "{error}");
        let error = rows("fit,material.density\n\na.toml\n").err().unwrap();
        assert!(matches!(error, Error::Data { line: 3, .. }), "{error}");
    }
}

//! The table of a campaign: a row for each fit, whose columns are keys.

use crate::campaign::changes::{Changes, Key};
use crate::campaign::row::Row;
use crate::error::Error;
use crate::input::text_cell::of_cell;
use marker_files::file::data;
use marker_files::printable::token;
use marker_files::table::{csv_error, delimiter};
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Columns that are no keys.
const FIT: &str = "fit";
const NAME: &str = "name";

/// The rows of a table, each with each of `fits`, or with the fit file that it names itself. Cells that are blank leave what the
/// fit file says; columns whose name begins with `#` are for people.
pub(crate) fn rows(path: &Path, fits: &[PathBuf]) -> Result<Vec<Row>, Error> {
    let bytes = data(path)?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let delimiter = delimiter(bytes);
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).delimiter(delimiter).from_reader(bytes);
    let header = reader.headers().map_err(|error| csv_error(path, error))?.clone();
    let at = |line: u64, message: String| Error::Data { path: path.into(), line, message };
    let mut known: Vec<(&str, Key)> = Vec::new();
    for (k, column) in header.iter().enumerate() {
        if header.iter().take(k).any(|other| other == column) {
            return Err(at(
                1,
                format!("found {} twice, allowed: every column once", token(column)),
            ));
        }
        if ![FIT, NAME].contains(&column) && !column.starts_with('#') {
            let also = "; fit, name, and columns whose name begins with #";
            let place = Key::new(column).map_err(|error| at(1, format!("{error}{also}")))?;
            if let Some((other, _)) = known.iter().find(|(_, other)| *other == place) {
                let message = format!(
                    "found {} beside {}, allowed: one of the two, which are the same",
                    token(column),
                    token(other)
                );
                return Err(at(1, message));
            }
            known.push((column, place));
        }
    }
    let own = header.iter().any(|column| column == FIT);
    if own != fits.is_empty() {
        let found = if own { "a column fit beside fits" } else { "neither a column fit nor fits" };
        return Err(at(1, format!("found {found}, allowed: one of the two")));
    }
    let mut all = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| csv_error(path, error))?;
        let line = record.position().map_or(0, |position| position.line());
        let (mut fit, mut name, mut changes) = (PathBuf::new(), String::new(), Changes::new());
        for (column, cell) in header.iter().zip(&record).filter(|(_, cell)| !cell.is_empty()) {
            let cell = of_cell(cell);
            match column {
                FIT => fit = cell.into(),
                NAME => name = cell.into(),
                _ if column.starts_with('#') => {}
                _ => {
                    changes.insert(column.into(), value(cell, delimiter));
                }
            }
        }
        if own && fit.as_os_str().is_empty() {
            return Err(at(line, "fit: found none, allowed: the name of a fit file".into()));
        }
        let from = Some((path.to_path_buf(), line));
        let each = if own { std::slice::from_ref(&fit) } else { fits };
        let row = Row { name, changes, from, ..Row::of(fit.clone()) };
        all.extend(each.iter().map(|fit| Row { fit: fit.clone(), ..row.clone() }));
    }
    match all.is_empty() {
        true => Err(at(1, "found no rows, allowed: one or more".into())),
        false => Ok(all),
    }
}

/// What stands in a cell: a number, beside semicolons also one with a decimal comma, true or false, a list as in TOML, or else
/// text.
fn value(cell: &str, delimiter: u8) -> Value {
    let point = cell.replace(',', ".");
    let is_number = delimiter == b';' && point.parse::<f64>().is_ok();
    let cell = if is_number { &point } else { cell };
    let parsed = format!("value = {cell}").parse::<Table>().ok();
    let value = parsed.filter(|table| table.len() == 1).and_then(|mut table| table.remove("value"));
    value.filter(|value| !value.is_datetime()).unwrap_or_else(|| Value::String(cell.into()))
}

//! Reader of tables of numbers with a header of names and units, as `t[ms],x[mm]`, or with the key `columns`.
//!
//! Input are the bytes of a file. Columns are separated by commas, semicolons, tabs or spaces. Lines that start with
//! `#` are comments. Every field of a column that is read is a finite number, blank or NaN; blank and NaN are missing
//! values (`None`). Decimal commas are read where they cannot be separators. Units stand in brackets, or at the end of
//! a name, as `t_ms,x_mm`. Output: [`Table`] with names (in lower case) and units of the columns, and the rows with
//! their lines; values are not converted. Blank columns without a name, and first columns that number the rows, are
//! left out, with the key `columns` all columns that it does not state. [`Table::of_columns`] is a table of the columns
//! that the key states. [`Table::find`] returns the index of a column, [`Table::require`] an error with the [found
//! columns](Table::columns_found) if it is missing, [`Table::factor`] the size of its unit; `number` reads a single
//! field. Other texts, rows with another number of fields than the header, commas and points that may separate
//! thousands, and files that are no table are errors with the line.

use crate::columns::{ColumnRules, FoundColumns, RuleError};
use crate::decimals::Decimals;
use crate::error::Error;
use crate::printable::{column_name, token};
use crate::separator::{Separator, TextRecord, has_row_names, is_table, stated_separator};
use crate::units::suffix_unit;
use crate::unknown_file::{check_text, describe_table};
use std::path::{Path, PathBuf};

pub use crate::separator::{csv_error, delimiter, record_line};
pub use crate::units::{LENGTHS, TIMES, split_unit};

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
    /// Whether the key `columns` states the columns.
    pub(crate) has_rules: bool,
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
    /// blank, as spreadsheet programs pad lines, and in the first place, as they number rows. So is a first column
    /// `index` or `Unnamed: 0` beside a clock. A single column is kept.
    ///
    /// # Errors
    ///
    /// Those of [`read`](Self::read); the kind of a file that is no table is described.
    pub fn of(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        Self::of_columns(path, bytes, None)
    }

    /// Reads the bytes of a file as a table of the columns that `rules` state, or of all columns; `path` is for
    /// messages.
    ///
    /// # Errors
    ///
    /// Those of [`of`](Self::of), and columns that the file does not have.
    pub fn of_columns(
        path: &Path,
        bytes: &[u8],
        rules: Option<&ColumnRules>,
    ) -> Result<Self, Error> {
        check_text(path, bytes)?;
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let (bytes, stated) = stated_separator(path, bytes)?;
        let separator = stated.unwrap_or_else(|| {
            Separator::detect(path, &bytes, |records, separator| match rules {
                Some(rules) => rules.fit(records),
                None => is_table(records, separator),
            })
        });
        let table = separator.records(path, &bytes).and_then(|records| match rules {
            Some(rules) => Self::by_rules(path, &records, separator, rules),
            None => Self::by_header(path, &records, separator),
        });
        // A file that is no table is often of another kind, whose description is clearer than the error of the
        // parser.
        table.map_err(|error| match rules {
            Some(_) => error,
            None => describe_table(path, &bytes, error),
        })
    }

    /// The table of the columns that `rules` state, in the order of the file, with the names of the rules, in lower
    /// case, and their units. Errors: those of the rules, rows of different width, and other texts than numbers.
    fn by_rules(
        path: &Path,
        records: &[TextRecord],
        separator: Separator,
        rules: &ColumnRules,
    ) -> Result<Self, Error> {
        let refused = |error: RuleError| Error::data(path, error.line, error.message);
        let FoundColumns { columns: found, first_row } = rules.find(records).map_err(refused)?;
        let rows = &records[first_row.min(records.len())..];
        // A name may stand above a column that the rows do not have.
        let least = found.iter().map(|own| own.index + 1).max().unwrap_or(0);
        let width = rows.first().map_or(0, |row| row.fields.len()).max(least);
        let fields: Vec<(usize, String)> =
            found.iter().map(|own| (own.index, own.name.clone())).collect();
        let rows = values(path, rows, &fields, width, separator)?;
        let original_names = found.iter().map(|own| own.name.clone()).collect();
        let columns = found.into_iter().map(|own| (own.name.to_lowercase(), own.unit)).collect();
        Ok(Self { path: path.into(), columns, original_names, rows, has_rules: true })
    }

    /// The table of the columns below a header, the first record. Names become lower case, and units are split from
    /// them. Left out are blank columns without a name, and a first column without a name or, beside a clock, of row
    /// numbers. Errors: rows with another number of fields, and other texts than numbers.
    fn by_header(path: &Path, records: &[TextRecord], separator: Separator) -> Result<Self, Error> {
        let header = records.first();
        let rows = records.get(1..).unwrap_or_default();
        let mut names: Vec<&str> = header.iter().flat_map(|h| h.fields.iter()).collect();
        // A comma may be a decimal one: there a missing name is not known to be that of the first column.
        let is_comma = separator == Separator::Character(b',');
        if header.is_some_and(|header| !is_comma && has_row_names(header, rows)) {
            names.insert(0, "");
        }
        // Spreadsheet programs pad lines with blank columns, and data frames number their rows in the first one.
        let is_blank = |i: usize| rows.iter().all(|row| row.field(i).is_empty());
        let has_clock = names.iter().skip(1).any(|name| is_clock(name));
        let is_index = |name: &str| name.is_empty() || has_clock && is_index_name(name);
        let is_kept = |i: &usize| {
            names.len() == 1
                || !(*i == 0 && is_index(names[0]) || names[*i].is_empty() && is_blank(*i))
        };
        let kept: Vec<usize> = (0..names.len()).filter(is_kept).collect();
        let split = |i: &usize| {
            let (original_name, unit) = split_unit(names[*i]);
            ((original_name.to_lowercase(), unit), original_name)
        };
        let (mut columns, mut original_names): (Vec<(String, Option<String>)>, Vec<String>) =
            kept.iter().map(split).unzip();
        suffix_units(&mut columns, &mut original_names).map_err(|message| {
            Error::data(path, header.map_or(1, |header| header.line), message)
        })?;
        let fields: Vec<(usize, String)> = kept.iter().map(|i| (*i, names[*i].into())).collect();
        let rows = values(path, rows, &fields, names.len(), separator)?;
        Ok(Self { path: path.into(), columns, original_names, rows, has_rules: false })
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

    /// The names of all columns, in lower case, joined by commas and cut to 80 characters, for messages.
    pub fn columns_found(&self) -> String {
        let found: Vec<&str> = self.columns.iter().map(|(column, _)| column.as_str()).collect();
        token(&found.join(", "))
    }

    /// Size of the unit in the header of a column (index from 0), in SI units, by the list of `known` units; 1 without
    /// a unit, an error for another unit. `more` are allowed units beside these, for the message.
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

    /// An error at a line, counted from 1, of this file, with the found and the allowed content as message.
    pub fn error(&self, line: u64, message: &str) -> Error {
        Error::data(&self.path, line, message)
    }
}

/// The rows of a table: the numbers of `fields`, each the index of a column and its name for messages, in records of
/// `width` fields, behind which there may be blank ones.
///
/// # Errors
/// Another number of fields, other texts, and numbers that leave open whether a comma is a decimal one.
fn values(
    path: &Path,
    records: &[TextRecord],
    fields: &[(usize, String)],
    width: usize,
    separator: Separator,
) -> Result<Vec<TableRow>, Error> {
    let mut decimals = Decimals::default();
    let mut rows = Vec::with_capacity(records.len());
    for TextRecord { line, fields: record } in records {
        let more = record.iter().skip(width).any(|field| !field.is_empty());
        if record.len() < width || more {
            let is_doubled = separator == Separator::Character(b',') && more;
            let remedy = match is_doubled {
                true => {
                    ". Decimal commas need semicolons, tabs or spaces between the columns, or quotes"
                }
                false => "",
            };
            let message =
                format!("found {} fields, allowed: {width} as in the header{remedy}", record.len());
            return Err(Error::data(path, *line, message));
        }
        let mut values = Vec::with_capacity(fields.len());
        for (i, name) in fields {
            let value = number(&record[*i], true, name, path, *line)?;
            decimals.add(*line, &record[*i]);
            values.push(value);
        }
        rows.push(TableRow { line: *line, values });
    }
    decimals.check(path, separator)?;
    Ok(rows)
}

/// Moves units at the ends of names, as `t_ms,x_mm`, to the units of the columns, and shortens both lists of names (in
/// lower case, and as written). It does so for `t` and `time`, and for coordinates if all of these have a unit. The
/// error is a message on `cm`, which may be a marker, such as the center of mass, if the time has no such unit.
fn suffix_units(
    columns: &mut [(String, Option<String>)],
    original_names: &mut [String],
) -> Result<(), String> {
    let (mut times, mut lengths, mut all) = (Vec::new(), Vec::new(), true);
    for (k, (name, unit)) in columns.iter().enumerate() {
        let without = |is_time: bool| suffix_unit(name, is_time).filter(|_| unit.is_none());
        match (without(true), without(false)) {
            (Some((own, unit)), _) if ["t", "time"].contains(&own) => times.push((k, unit)),
            (_, Some((own, unit))) if is_coordinate(own) => lengths.push((k, unit)),
            _ => all &= !is_coordinate(name),
        }
    }
    if !all {
        lengths.clear();
    }
    if let Some((k, _)) = lengths.iter().find(|(_, unit)| *unit == "cm" && times.is_empty()) {
        return Err(format!(
            "found the column `{}`, whose ending may be the unit cm or the name of a marker, allowed: the unit in \
             brackets, as x[cm], or the marker in front, as cm_x",
            columns[*k].0
        ));
    }
    for (k, unit) in times.into_iter().chain(lengths) {
        columns[k].1 = Some(unit.into());
        for name in [&mut columns[k].0, &mut original_names[k]] {
            name.truncate(name.rfind('_').unwrap_or(name.len()));
        }
    }
    Ok(())
}

/// Whether a name in lower case is that of a coordinate: `s`, one that begins with an axis, or one that ends with a
/// separator and an axis, as `tip_x`.
fn is_coordinate(name: &str) -> bool {
    let behind = name
        .strip_suffix(['x', 'y', 'z'])
        .is_some_and(|own| own.ends_with(['_', '.', ' ', '-', '/']));
    name == "s" || behind || name.starts_with(['x', 'y', 'z'])
}

/// Whether a header is that of a clock: `t`, `time` or `frame`, with or without a unit.
fn is_clock(header: &str) -> bool {
    let name = split_unit(header).0.to_lowercase();
    let own = suffix_unit(&name, true).map_or(&name[..], |(own, _)| own);
    ["t", "time", "frame"].contains(&own)
}

/// Whether a name of the first column is one of row numbers: `index` or `Unnamed: 0`, in upper or lower case. An empty
/// name is not.
fn is_index_name(name: &str) -> bool {
    ["index", "unnamed: 0"].contains(&&name.to_lowercase()[..])
}

/// Whether numbers in files of programs may have decimal commas with this separator: semicolons or tabs.
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

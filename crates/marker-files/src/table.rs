//! Reader of tables of numbers with a header of names and units, as `t[ms],x[mm]`, or with the key `columns`.
//!
//! Input are the bytes of a file. Columns are separated by commas, semicolons, tabs or spaces
//! ([`separator`](crate::separator)). Lines that start with `#` are comments. Every field is a finite number, blank or
//! NaN; blank and NaN are missing values (`None`). Decimal commas are read where they cannot be separators. Units stand
//! in brackets, or at the end of a name, as `t_ms,x_mm`. Output: [`Table`] with names (in lower case) and units of the
//! columns, and the rows with their lines; values are not converted. Blank columns without a name, and columns that
//! number the rows, are left out. Other texts, rows with another number of fields than the header, numbers with decimal
//! points beside numbers with decimal commas, and files that are no table are errors with the line.

use crate::columns::{ColumnRules, FoundColumns};
use crate::error::Error;
use crate::printable::{column_name, token};
use crate::separator::{Record, Separator, has_row_names, stated_separator};
use crate::unknown_file::{check_text, describe_table};
use std::path::{Path, PathBuf};

/// Units of time with their sizes in s.
pub const TIMES: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
/// Units of length with their sizes in m.
pub const LENGTHS: [(&str, f64); 4] = [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6)];

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
    /// blank, as spreadsheet programs pad lines, and in the first place, as they number rows. A single column is kept.
    ///
    /// # Errors
    ///
    /// Those of [`read`](Self::read); the kind of a file that is no table is described.
    pub fn of(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        Self::of_columns(path, bytes, None)
    }

    /// Reads the bytes of a file as a table of the columns that `rules` state, or of all columns; `path` is for messages.
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
        let separator = stated.unwrap_or_else(|| Separator::detect(path, &bytes, rules));
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

    /// The table of the columns that `rules` state.
    fn by_rules(
        path: &Path,
        records: &[Record],
        separator: Separator,
        rules: &ColumnRules,
    ) -> Result<Self, Error> {
        let refused = |(line, message)| Error::data(path, line, message);
        let FoundColumns { columns: found, first_row } = rules.find(records).map_err(refused)?;
        let rows = &records[first_row.min(records.len())..];
        let width = rows.first().map_or(0, |row| row.fields.len());
        let fields: Vec<(usize, String)> =
            found.iter().map(|own| (own.index, own.name.clone())).collect();
        let rows = values(path, rows, &fields, width, separator)?;
        let original_names = found.iter().map(|own| own.name.clone()).collect();
        let columns = found.into_iter().map(|own| (own.name.to_lowercase(), own.unit)).collect();
        Ok(Self { path: path.into(), columns, original_names, rows, has_rules: true })
    }

    /// The table of all columns below a header. Names become lower case.
    fn by_header(path: &Path, records: &[Record], separator: Separator) -> Result<Self, Error> {
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
    header_separator(bytes).unwrap_or(b',')
}

/// The first comma, semicolon or tab in the header, which is the first line that is no comment; `None` without any.
pub(crate) fn header_separator(bytes: &[u8]) -> Option<u8> {
    let mut lines = bytes.split(|b| *b == b'\n');
    let header = lines.find(|line| !line.starts_with(b"#")).unwrap_or_default();
    header.iter().copied().find(|b| b",;\t".contains(b))
}

/// The rows of a table: the numbers of `fields`, each the index of a column and its name for messages, in records of
/// `width` fields, behind which there may be blank ones.
///
/// # Errors
/// Another number of fields, other texts, and numbers that leave open whether a comma is a decimal one.
fn values(
    path: &Path,
    records: &[Record],
    fields: &[(usize, String)],
    width: usize,
    separator: Separator,
) -> Result<Vec<TableRow>, Error> {
    let mut decimals = Decimals::default();
    let mut rows = Vec::with_capacity(records.len());
    for Record { line, fields: record } in records {
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

/// Evidence in the numbers of a table on decimal points and commas.
#[derive(Default)]
struct Decimals {
    /// Line of the first number with a point.
    point: Option<u64>,
    /// Line and text of the first number with a comma.
    comma: Option<(u64, String)>,
    /// Whether a number shows that its comma is no separator of thousands.
    is_decimal: bool,
}

impl Decimals {
    /// Adds the number in a field of a line.
    fn add(&mut self, line: u64, field: &str) {
        if field.contains('.') {
            self.point.get_or_insert(line);
        }
        let Some((whole, fraction)) = field.split_once(',') else { return };
        if self.comma.is_none() {
            self.comma = Some((line, field.into()));
        }
        // Thousands are followed by three digits, and begin with one to three that are no zero.
        let whole = whole.trim_start_matches(['-', '+']);
        let is_thousand = fraction.len() == 3
            && fraction.bytes().all(|b| b.is_ascii_digit())
            && (1..=3).contains(&whole.len())
            && !whole.starts_with('0');
        self.is_decimal |= !is_thousand;
    }

    /// Rejects numbers with points beside numbers with commas, and commas that may separate thousands.
    fn check(&self, path: &Path, separator: Separator) -> Result<(), Error> {
        let Some((line, text)) = &self.comma else { return Ok(()) };
        if let Some(point) = self.point {
            let message = format!(
                "found `{text}` with a comma, and a number with a point in line {point}, allowed: one decimal sign \
                 in all numbers"
            );
            return Err(Error::data(path, *line, message));
        }
        if !self.is_decimal && !separator.implies_decimal_commas() {
            let message = format!(
                "found `{text}`, whose comma may be a decimal one or separate thousands, allowed: numbers with \
                 decimal points, or semicolons between the columns"
            );
            return Err(Error::data(path, *line, message));
        }
        Ok(())
    }
}

/// Name and unit of a column: `X` and `mm` of `X [mm]` or `X (mm)`; no unit without brackets at the end.
pub fn split_unit(header: &str) -> (String, Option<String>) {
    let brackets = |open: char, close: char| header.strip_suffix(close)?.split_once(open);
    // Brackets within a name belong to it; only those at the end have a unit.
    match brackets('[', ']').or_else(|| brackets('(', ')')) {
        Some((name, unit)) => (name.trim().into(), Some(plain_unit(unit))),
        None => (header.into(), None),
    }
}

/// The symbol of a unit without spaces around it, with `u` for micro.
pub(crate) fn plain_unit(unit: &str) -> String {
    let unit = unit.trim();
    match unit.strip_prefix(['\u{b5}', '\u{3bc}']) {
        Some(rest) => format!("u{rest}"),
        None => unit.into(),
    }
}

/// Name and unit of a column whose name ends with a unit, as `x_mm`: units of time, or of length and pixels. `None` without
/// one.
pub(crate) fn suffix_unit(name: &str, is_time: bool) -> Option<(&str, &'static str)> {
    let (own, ending) = name.rsplit_once('_')?;
    let ending = plain_unit(&ending.to_lowercase());
    let symbols: Vec<&'static str> = match is_time {
        true => TIMES.iter().map(|(symbol, _)| *symbol).collect(),
        false => LENGTHS.iter().map(|(symbol, _)| *symbol).chain(["px"]).collect(),
    };
    let unit = symbols.into_iter().find(|symbol| *symbol == ending)?;
    (!own.is_empty()).then_some((own, unit))
}

/// Moves units at the ends of names, as `t_ms,x_mm`, to the units of the columns. Coordinates have such units if all of them
/// do. The error is a message on `cm`, which may be a marker, such as the center of mass, if the time has no unit.
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

/// Whether a name in lower case is that of a coordinate: `s`, or one that begins or ends with an axis.
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

/// Whether a name of the first column is that of row numbers, as data frames write it.
fn is_index_name(name: &str) -> bool {
    ["index", "unnamed: 0"].contains(&&name.to_lowercase()[..])
}

/// Whether numbers may have decimal commas in a table with this separator: semicolons or tabs.
pub(crate) fn has_decimal_commas(delimiter: u8) -> bool {
    b";\t".contains(&delimiter)
}

/// Whether a field is a finite number, with a decimal point or comma.
pub(crate) fn is_number(field: &str) -> bool {
    field.replace(',', ".").parse().is_ok_and(f64::is_finite)
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

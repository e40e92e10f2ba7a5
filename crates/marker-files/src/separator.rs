//! Separators of the columns of a table, and the splitting of its lines into fields.
//!
//! Separators are tabs, semicolons, commas, and white space. [`Separator::detect`] returns the first of these with
//! which the first lines of a file form a table by a given criterion. In general this is [`is_table`]: a header, and
//! rows with as many fields, which are numbers. Numbers may have decimal commas, except where a comma separates the
//! columns and the number is not quoted. Without such a separator it is the first comma, semicolon or tab of the
//! header; without any of them white space if all lines have equally many words (two or more), else a comma.
//! [`stated_separator`] reads a first line `sep=;`, as Excel writes it; another character there is an error.
//! [`Separator::records`] splits bytes into [`TextRecord`]s with their lines; lines that start with `#` are comments
//! and left out, as are blank lines, also those of spaces or separators only. Fields that are not UTF-8 are errors
//! ([`csv_error`]).
//!
//! [`header_separator`] is the first comma, semicolon or tab of the header, `None` without any, and [`delimiter`] the
//! same with a comma as the default. [`with_tabs`] replaces spaces between columns by tabs. [`is_number_or_blank`] and
//! [`is_number`] test a field. [`has_row_names`] returns whether rows have one field more than the header and begin
//! with their numbers, from 0 or 1. Semicolons [imply decimal commas](Separator::implies_decimal_commas).

use crate::error::Error;
use csv::{ReaderBuilder, StringRecord, Trim};
use std::borrow::Cow;
use std::path::Path;

/// Number of lines at the beginning of a file by which its separator is found.
const SAMPLE_LINES: usize = 64;

/// Separator of the columns of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Separator {
    /// A tab, semicolon or comma.
    Character(u8),
    /// Any number of spaces and tabs.
    Whitespace,
}

/// Separators in the order in which they are tried. A table that both tabs and white space separate is the same table.
const SEPARATORS: [Separator; 4] = [
    Separator::Character(b'\t'),
    Separator::Character(b';'),
    Separator::Character(b','),
    Separator::Whitespace,
];

/// A line of a table, split into fields without spaces around them.
pub(crate) struct TextRecord {
    /// Line in the file, counted from 1.
    pub line: u64,
    pub fields: StringRecord,
}

impl TextRecord {
    /// The field in a column counted from 0; empty beyond the last one.
    pub fn field(&self, column: usize) -> &str {
        self.fields.get(column).unwrap_or("")
    }
}

/// The bytes of a table, in which a first line `sep=;` becomes a comment, and the separator that this line states;
/// `None` without such a line. An error for a separator other than a comma, semicolon, tab or space.
pub(crate) fn stated_separator<'a>(
    path: &Path,
    bytes: &'a [u8],
) -> Result<(Cow<'a, [u8]>, Option<Separator>), Error> {
    let first = bytes.split(|b| *b == b'\n').next().unwrap_or_default();
    let first = first.strip_suffix(b"\r").unwrap_or(first);
    let unquoted = first.strip_prefix(b"\"").unwrap_or(first);
    let Some((word, stated)) = unquoted.split_at_checked(4) else {
        return Ok((bytes.into(), None));
    };
    if !word.eq_ignore_ascii_case(b"sep=") {
        return Ok((bytes.into(), None));
    }
    let separator = match stated.strip_suffix(b"\"").unwrap_or(stated) {
        [own @ (b',' | b';' | b'\t')] => Separator::Character(*own),
        b" " => Separator::Whitespace,
        other => {
            let message = format!(
                "found the separator `{}` after sep=, allowed: a comma, semicolon, tab or space",
                String::from_utf8_lossy(other)
            );
            return Err(Error::data(path, 1, message));
        }
    };
    // A comment keeps the numbers of the lines.
    let mut own = bytes.to_vec();
    own[0] = b'#';
    Ok((own.into(), Some(separator)))
}

impl Separator {
    /// The separator of a file: the first of [`SEPARATORS`] for which `fit` is true of the records of the first
    /// [`SAMPLE_LINES`] lines. Without one, the first comma, semicolon or tab of the header. If the header has none of
    /// them, white space where all lines have as many words as the header (at least two), else a comma.
    pub fn detect(path: &Path, bytes: &[u8], fit: impl Fn(&[TextRecord], Self) -> bool) -> Self {
        let ends = bytes.iter().enumerate().filter(|(_, b)| **b == b'\n');
        let end = ends.map(|(k, _)| k + 1).nth(SAMPLE_LINES - 1).unwrap_or(bytes.len());
        let sample = &bytes[..end];
        let fits = |own: &Self| own.records(path, sample).is_ok_and(|records| fit(&records, *own));
        // A cell that is no number fits none of them; its error needs the columns all the same.
        let of_header = || {
            let own = Self::Whitespace.records(path, sample);
            let is_spaced = own.is_ok_and(|records| {
                let width = records.first().map_or(0, |header| header.fields.len());
                width > 1 && records.iter().all(|record| record.fields.len() == width)
            });
            match header_separator(bytes) {
                Some(separator) => Self::Character(separator),
                None if is_spaced => Self::Whitespace,
                None => Self::Character(b','),
            }
        };
        SEPARATORS.into_iter().find(fits).unwrap_or_else(of_header)
    }

    /// Whether a number may have a decimal comma without evidence in other numbers: with semicolons, where commas are
    /// the usual decimal signs.
    pub fn implies_decimal_commas(self) -> bool {
        self == Self::Character(b';')
    }

    /// Splits bytes into lines of fields, without comments and blank lines, also those of spaces or separators only;
    /// lines may have different numbers of fields.
    ///
    /// # Errors
    ///
    /// Fields that are not UTF-8 text.
    pub fn records(self, path: &Path, bytes: &[u8]) -> Result<Vec<TextRecord>, Error> {
        let (delimiter, bytes) = match self {
            Self::Character(own) => (own, Cow::Borrowed(bytes)),
            Self::Whitespace => (b'\t', Cow::Owned(with_tabs(bytes))),
        };
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(Trim::All)
            .comment(Some(b'#'))
            .delimiter(delimiter)
            .from_reader(&bytes[..]);
        let mut records = Vec::new();
        let mut fields = StringRecord::new();
        while reader.read_record(&mut fields).map_err(|e| csv_error(path, &bytes, e))? {
            let line = fields.position().map_or(1, |at| at.line());
            let from = fields.position().map_or(0, |at| at.byte()) as usize;
            let line = line + skipped_lines(&bytes[from.min(bytes.len())..]);
            // Lines of spaces or separators only are blank, as spreadsheet programs write them below a table.
            if !fields.iter().all(str::is_empty) {
                records.push(TextRecord { line, fields: fields.clone() });
            }
        }
        Ok(records)
    }
}

/// Number of blank lines and comments at the beginning of bytes. The reader of the csv library skips them before a
/// record, but does not count them in the line that it reports.
fn skipped_lines(bytes: &[u8]) -> u64 {
    let lines = bytes.split_inclusive(|b| *b == b'\n');
    lines.take_while(|line| matches!(line, [b'#', ..] | [b'\n'] | [b'\r', b'\n'])).count() as u64
}

/// Whether the first record is a header, and all others, at least one, are rows of as many fields, which are numbers or
/// blank; further blank fields may follow. The table needs two columns. A first column without a name may have any
/// content. Unless commas separate the columns, the header may lack the name of a first column of row numbers
/// ([`has_row_names`]).
pub(crate) fn is_table(records: &[TextRecord], separator: Separator) -> bool {
    let Some((header, rows)) = records.split_first() else { return false };
    let width = header.fields.len();
    let numbered = separator != Separator::Character(b',') && has_row_names(header, rows);
    let first = usize::from(numbered || header.field(0).is_empty());
    let width = width + usize::from(numbered);
    let is_row = |row: &TextRecord| {
        row.fields.len() >= width
            && row.fields.iter().skip(width).all(str::is_empty)
            && (first..width).all(|i| is_number_or_blank(row.field(i)))
    };
    width > 1 && !rows.is_empty() && rows.iter().all(is_row)
}

/// Whether all rows have one field more than the header, and begin with their numbers 0, 1, 2, .. or 1, 2, 3, .., as R
/// writes them. It is false without rows.
pub(crate) fn has_row_names(header: &TextRecord, rows: &[TextRecord]) -> bool {
    let first = rows.first().map_or("", |row| row.field(0));
    let Some(from) = ["0", "1"].iter().position(|own| *own == first) else { return false };
    let counts = |(k, row): (usize, &TextRecord)| {
        row.fields.len() == header.fields.len() + 1 && row.field(0).parse() == Ok(k + from)
    };
    rows.iter().enumerate().all(counts)
}

/// Whether a field is blank, NaN or a finite number. A number with a comma at an end is none: the comma belongs to a
/// separator.
pub(crate) fn is_number_or_blank(field: &str) -> bool {
    field.is_empty()
        || field.eq_ignore_ascii_case("nan")
        || !field.starts_with(',') && !field.ends_with(',') && is_number(field)
}

/// The bytes of a table with a tab for each run of spaces and tabs within a line, and none at its ends; comments and
/// spaces in quotes stay. In the header, the first line that is neither blank nor a comment, spaces before and within
/// brackets stay: `t (s) x (mm)` has two columns. The numbers of the lines stay.
pub(crate) fn with_tabs(bytes: &[u8]) -> Vec<u8> {
    let mut own = Vec::with_capacity(bytes.len());
    let mut is_header = true;
    for line in bytes.split_inclusive(|b| *b == b'\n') {
        let text = line.trim_ascii();
        if text.starts_with(b"#") || text.is_empty() {
            own.extend(line);
            continue;
        }
        let (mut depth, mut quoted, mut k) = (0usize, false, 0);
        while k < text.len() {
            let b = text[k];
            let is_blank = |b: u8| b == b' ' || b == b'\t';
            if is_blank(b) && !quoted {
                let run = text[k..].iter().take_while(|b| is_blank(**b)).count();
                k += run;
                let opens = matches!(text.get(k), Some(b'(' | b'['));
                let joined = is_header && (depth > 0 || opens);
                own.push(if joined { b' ' } else { b'\t' });
                continue;
            }
            match b {
                b'"' => quoted = !quoted,
                b'(' | b'[' => depth += 1,
                b')' | b']' => depth = depth.saturating_sub(1),
                _ => {}
            }
            own.push(b);
            k += 1;
        }
        is_header = false;
        // The end of the line stays, so that the numbers of the lines do.
        own.extend(line.ends_with(b"\n").then_some(b'\n'));
    }
    own
}

/// The separator of the columns: the first comma, semicolon or tab in the header; a comma without any. The header is
/// the first line that is not blank and does not begin with `#`.
pub fn delimiter(bytes: &[u8]) -> u8 {
    header_separator(bytes).unwrap_or(b',')
}

/// The first comma, semicolon or tab in the header; `None` without any. The header is the first line that is not
/// blank and does not begin with `#`.
pub(crate) fn header_separator(bytes: &[u8]) -> Option<u8> {
    let mut lines = bytes.split(|b| *b == b'\n');
    let is_header = |line: &&[u8]| !line.starts_with(b"#") && !line.trim_ascii().is_empty();
    let header = lines.find(is_header).unwrap_or_default();
    header.iter().copied().find(|b| b",;\t".contains(b))
}

/// Whether a field is a finite number, with a decimal point or comma.
pub(crate) fn is_number(field: &str) -> bool {
    field.replace(',', ".").parse().is_ok_and(f64::is_finite)
}

/// The line, from 1, of a record at a `position` in the bytes of a file that the csv library reports: that before the
/// blank lines which it skips. 1 without a position.
pub fn record_line(bytes: &[u8], position: Option<&csv::Position>) -> u64 {
    let Some(position) = position else { return 1 };
    let from = bytes.len().min(position.byte() as usize);
    let blank = bytes[from..].iter().take_while(|b| b"\r\n".contains(b));
    position.line() + blank.filter(|b| **b == b'\n').count() as u64
}

/// The error of a file that cannot be split into fields, with its line: another number of fields than the header, or no
/// UTF-8 text. `bytes` are those of the file. An error of reading the file has no line.
pub fn csv_error(path: &Path, bytes: &[u8], error: csv::Error) -> Error {
    let line = record_line(bytes, error.position());
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
    fn separator_is_the_one_that_makes_a_table() {
        use Separator::{Character, Whitespace};
        for (text, separator) in [
            ("t,x\n0,1\n", Character(b',')),
            ("t, x\n0, 1\n", Character(b',')),
            ("t;x\n0,5;1,5\n", Character(b';')),
            ("t\tx\n0,5\t1,5\n", Character(b'\t')),
            ("t x\n0,5 1,5\n", Whitespace),
            ("  t   x\n  0.5   1e-3\n", Whitespace),
            ("t (s) x [mm]\n0.5 1\n", Whitespace),
            ("t\tmy x\n0\t1\n", Character(b'\t')),
            ("t,x,y\n0,5,1,5,2,5\n", Character(b',')),
            ("\"t\" \"x\"\n\"1\" 0 0.5\n\"2\" 1 0.5\n", Whitespace),
            ("t,x\n\"0,5\",\"1,5\"\n", Character(b',')),
        ] {
            let found = Separator::detect(Path::new("t"), text.as_bytes(), is_table);
            assert_eq!(found, separator, "{text}");
        }
    }

    #[test]
    fn blank_lines_are_no_records() {
        for (separator, text) in [
            (Separator::Character(b','), "t,x\n0,1\n  \n,\n2,3\n \t\n"),
            (Separator::Whitespace, "t x\n0 1\n  \n \t\n2 3\n \n"),
        ] {
            let records = separator.records(Path::new("t"), text.as_bytes()).unwrap();
            let found: Vec<(u64, &str)> = records.iter().map(|r| (r.line, r.field(1))).collect();
            assert_eq!(found, [(1, "x"), (2, "1"), (5, "3")], "{text:?}");
        }
    }

    #[test]
    fn records_have_the_lines_of_the_file() {
        let text = b"# a\n\nt x\n\n# b\n0 1\n\r\n2   3\n";
        let records = Separator::Whitespace.records(Path::new("t"), text).unwrap();
        let found: Vec<(u64, &str)> = records.iter().map(|r| (r.line, r.field(1))).collect();
        assert_eq!(found, [(3, "x"), (6, "1"), (8, "3")]);
    }
}

//! The key `columns` of a recording: the columns of a table by name or number, for files whose header has other names
//! or that have no header.
//!
//! [`ColumnRules`] map the names that the readers of tables use (`t`, `frame`, `x`, `xA`, `A_x`, ..) to columns of the
//! file: a name of the header, a number from 1, or one of both with a unit. [`ColumnRules::find`] takes the lines of a
//! file, split into fields, and returns the stated columns with their units, and the first row of numbers. The header
//! is the first line with all stated names. If only numbers are stated, the rows begin at the first line with a number
//! in one of these columns. A line of units may stand between header and rows: one with a known unit ([`is_unit`]:
//! time, length, px, or a quantity of sensors) in all stated columns. The unit of a column is the stated one, else that
//! in brackets in the header, else of the line of units. Else it is a unit of time or length, or px, at the end of the
//! name, if any. [`ColumnRules::fit`] returns whether [`ColumnRules::find`] succeeds and all rows have equally many
//! fields, with numbers or blanks in the stated columns. Errors, as messages with a line: no rule, the column 0,
//! columns that the file does not have, no number in the stated columns, and a name above several columns. So are two
//! rules for one column, and a stated unit that differs from that in brackets, or without brackets from that of the
//! line of units.

use crate::separator::{TextRecord, is_number_or_blank};
use crate::units::{is_same_unit, is_unit, plain_unit, split_unit, suffix_unit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// Columns of a table by the names that a header would have: `{ t = 1, x = "NAME_x", y = 3 }`. Other columns are
/// ignored.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(transparent)]
pub struct ColumnRules(pub BTreeMap<String, ColumnRule>);

/// Column of a table with its unit, if stated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected the number of a column, counted from 1, the name of a column, or { column = 3, unit = \"mm\" }"
)]
pub enum ColumnRule {
    /// Column with the unit of the header.
    Column(ColumnKey),
    /// Column with a stated unit.
    WithUnit(ColumnWithUnit),
}

/// Column of a table by number or name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected the number of a column, counted from 1, or its name")]
pub enum ColumnKey {
    /// Number of the column, counted from 1.
    Number(usize),
    /// Name of the column in the header, ignoring case, with or without its unit.
    Name(String),
}

/// Column of a table with a stated unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ColumnWithUnit {
    /// Number of the column, counted from 1, or its name.
    pub column: ColumnKey,
    /// Unit of the column: s, ms, us, ns of a time; m, cm, mm, um, px of a coordinate.
    pub unit: String,
}

impl fmt::Display for ColumnRules {
    /// Writes the rules as an inline table of TOML.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rule = |(name, rule): (&String, &ColumnRule)| {
            let column = match rule.source() {
                ColumnKey::Number(number) => number.to_string(),
                ColumnKey::Name(name) => quoted(name),
            };
            match rule.unit() {
                None => format!("{} = {column}", key(name)),
                Some(unit) => {
                    format!("{} = {{ column = {column}, unit = {} }}", key(name), quoted(unit))
                }
            }
        };
        write!(f, "{{ {} }}", self.0.iter().map(rule).collect::<Vec<_>>().join(", "))
    }
}

/// A text as a key of TOML, in quotes unless it is not empty and has ASCII letters, digits and `_` only.
fn key(text: &str) -> String {
    let is_bare = !text.is_empty() && text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    if is_bare { text.into() } else { quoted(text) }
}

/// A text as a quoted string of TOML, with quotes, backslashes and control characters escaped.
fn quoted(text: &str) -> String {
    let mut own = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => own.extend(['\\', c]),
            c if c.is_control() => own += &format!("\\u{:04X}", c as u32),
            c => own.push(c),
        }
    }
    own + "\""
}

impl ColumnRule {
    /// The column, by name or number, without its unit.
    fn source(&self) -> &ColumnKey {
        match self {
            Self::Column(source) => source,
            Self::WithUnit(own) => &own.column,
        }
    }

    /// The stated unit; `None` if the rule states none.
    fn unit(&self) -> Option<&str> {
        match self {
            Self::Column(_) => None,
            Self::WithUnit(own) => Some(&own.unit),
        }
    }
}

/// Brackets around units.
const BRACKETS: [char; 4] = ['[', ']', '(', ')'];

/// Error of rules that a table does not satisfy.
pub(crate) struct RuleError {
    /// Line in the file, counted from 1.
    pub line: u64,
    /// Found and allowed content.
    pub message: String,
}

impl RuleError {
    /// The error at a line, counted from 1, with the found and the allowed content as message.
    fn new(line: u64, message: impl Into<String>) -> Self {
        Self { line, message: message.into() }
    }
}

/// Names, and indices counted from 0, of the columns that rules state.
struct StatedColumns<'a> {
    names: Vec<&'a str>,
    numbers: Vec<usize>,
}

/// Columns of a table that rules have found, in the order of the file, and its first row.
pub(crate) struct FoundColumns {
    pub columns: Vec<FoundColumn>,
    /// Index of the record that is the first row.
    pub first_row: usize,
}

/// A column of a table that a rule has found.
pub(crate) struct FoundColumn {
    /// Name by the rule.
    pub name: String,
    /// Index of the column, counted from 0.
    pub index: usize,
    /// Unit by the rule, the header, the line of units or the ending of the name, in this order; `None` without any.
    pub unit: Option<String>,
}

impl ColumnRules {
    /// Whether records are a table by these rules: [`find`](Self::find) succeeds, there is a row, and all rows have
    /// equally many fields, with numbers or blanks in the stated columns.
    pub(crate) fn fit(&self, records: &[TextRecord]) -> bool {
        let Ok(FoundColumns { columns, first_row }) = self.find(records) else { return false };
        let rows = &records[first_row..];
        let width = rows.first().map_or(0, |row| row.fields.len());
        let is_row = |row: &TextRecord| {
            row.fields.len() == width
                && columns.iter().all(|own| is_number_or_blank(row.field(own.index)))
        };
        !rows.is_empty() && rows.iter().all(is_row) && columns.iter().all(|own| own.index < width)
    }

    /// The stated columns in the records of a file, sorted by position, with their units if known, and the index of the
    /// first row of numbers. The header is the first record with all stated names, or the one above the first row with
    /// a number in a stated column. A record of units may stand between both: one with a known unit ([`is_unit`]) in
    /// all stated columns. A unit is the stated one, else that in brackets in the header, else of the record of units,
    /// else at the end of the name (time, length or px). Errors: no rule, the column 0, a missing name or column, a
    /// name above several columns, two rules for one column, and a stated unit that differs from that in brackets or of
    /// the record of units.
    pub(crate) fn find(&self, records: &[TextRecord]) -> Result<FoundColumns, RuleError> {
        let StatedColumns { names, numbers } = self.names_and_numbers()?;
        let is_value = |field: &str| !field.is_empty() && is_number_or_blank(field);
        let (header, mut first_row) = match names.is_empty() {
            false => {
                let has_all = |record: &TextRecord| {
                    names.iter().all(|name| record.fields.iter().any(|f| is_called(f, name)))
                };
                let Some(header) = records.iter().position(has_all) else {
                    let found = records.first().map_or(String::new(), |record| {
                        record.fields.iter().collect::<Vec<_>>().join(", ")
                    });
                    let message = format!(
                        "found no line with the names {} of columns, allowed: names of the header, or numbers of \
                         columns from 1. The first line has {found}",
                        names.join(", ")
                    );
                    return Err(RuleError::new(
                        records.first().map_or(1, |record| record.line),
                        message,
                    ));
                };
                (Some(header), header + 1)
            }
            true => {
                let has_value =
                    |record: &TextRecord| numbers.iter().any(|i| is_value(record.field(*i)));
                let Some(first) = records.iter().position(has_value) else {
                    let message =
                        "found no number in the stated columns, allowed: at least one row";
                    return Err(RuleError::new(1, message));
                };
                (first.checked_sub(1), first)
            }
        };
        let names_of = |record: usize| &records[record];
        // A line of units stands between the names and the rows.
        let indices =
            self.indices(header.map(names_of), names_of(first_row.min(records.len() - 1)))?;
        let are_units = |record: &TextRecord| indices.iter().all(|i| has_unit(record.field(*i)));
        let (mut header, mut units) = (header, None);
        if names.is_empty() && header.is_some_and(|k| are_units(&records[k])) {
            units = header;
            header = header.and_then(|k| k.checked_sub(1));
        } else if !names.is_empty() && records.get(first_row).is_some_and(are_units) {
            units = Some(first_row);
            first_row += 1;
        }
        let mut columns = Vec::with_capacity(self.0.len());
        for ((name, rule), index) in self.0.iter().zip(indices) {
            let field = |k: Option<usize>| k.map(|k| (records[k].line, records[k].field(index)));
            let above = field(header).map(|(line, field)| (line, split_unit(field)));
            let below =
                field(units).map(|(line, field)| (line, plain_unit(field.trim_matches(BRACKETS))));
            let in_file =
                above.as_ref().and_then(|(line, (_, unit))| Some((*line, unit.clone()?))).or(below);
            let unit = match (rule.unit().map(plain_unit), in_file) {
                (Some(stated), Some((line, found))) if !is_same_unit(&found, &stated) => {
                    let message = format!(
                        "found the unit {found} in the file and {stated} in columns.{name}, allowed: one unit. \
                         Remove unit"
                    );
                    return Err(RuleError::new(line, message));
                }
                (Some(stated), _) => Some(stated),
                (None, Some((_, found))) => Some(found),
                (None, None) => above.and_then(|(_, (own, _))| ending_unit(name, &own)),
            };
            columns.push(FoundColumn { name: name.clone(), index, unit });
        }
        columns.sort_by_key(|own| own.index);
        if let Some(pair) = columns.windows(2).find(|pair| pair[0].index == pair[1].index) {
            let [a, b] = [&pair[0].name, &pair[1].name];
            let message = format!(
                "found columns.{a} and columns.{b} as the same column {}, allowed: each column once",
                pair[0].index + 1
            );
            return Err(RuleError::new(1, message));
        }
        Ok(FoundColumns { columns, first_row })
    }

    /// The names that the rules state, and the indices, counted from 0, of the numbers that they state. An error
    /// without any rule, and for the number 0.
    fn names_and_numbers(&self) -> Result<StatedColumns<'_>, RuleError> {
        if self.0.is_empty() {
            return Err(RuleError::new(1, "found columns = {}, allowed: at least one column"));
        }
        let (mut names, mut numbers) = (Vec::new(), Vec::new());
        for (key, rule) in &self.0 {
            match rule.source() {
                ColumnKey::Name(name) => names.push(&name[..]),
                ColumnKey::Number(0) => {
                    let message = format!("found columns.{key} = 0, allowed: a number from 1");
                    return Err(RuleError::new(1, message));
                }
                ColumnKey::Number(number) => numbers.push(number - 1),
            }
        }
        Ok(StatedColumns { names, numbers })
    }

    /// The index, counted from 0, of the column of each rule, in the order of the rules. Names are looked up in the
    /// `header`; numbers must be within the number of fields of `row`. An error for a larger number, and for a name
    /// that no column or several columns have.
    fn indices(
        &self,
        header: Option<&TextRecord>,
        row: &TextRecord,
    ) -> Result<Vec<usize>, RuleError> {
        let index = |(key, rule): (&String, &ColumnRule)| match rule.source() {
            ColumnKey::Number(number) if *number <= row.fields.len() => Ok(number - 1),
            ColumnKey::Number(number) => {
                let width = row.fields.len();
                let message = format!(
                    "found columns.{key} = {number}, allowed: a column of the file, 1 to {width}"
                );
                Err(RuleError::new(row.line, message))
            }
            ColumnKey::Name(name) => {
                let fields = header.iter().flat_map(|record| record.fields.iter().enumerate());
                let found: Vec<usize> =
                    fields.filter(|(_, f)| is_called(f, name)).map(|(k, _)| k).collect();
                match found[..] {
                    [one] => Ok(one),
                    _ => {
                        let line = header.map_or(1, |record| record.line);
                        let numbers: Vec<String> =
                            found.iter().map(|k| (k + 1).to_string()).collect();
                        let message = format!(
                            "found columns.{key} = `{name}` above the columns {}, allowed: a name that one column \
                             has, or the number of a column",
                            numbers.join(", ")
                        );
                        Err(RuleError::new(line, message))
                    }
                }
            }
        };
        self.0.iter().map(index).collect()
    }
}

/// Whether a field of a header is the column with this `name`, ignoring case, with or without its unit in brackets.
fn is_called(field: &str, name: &str) -> bool {
    let same = |own: &str| own.to_lowercase() == name.trim().to_lowercase();
    same(field) || same(&split_unit(field).0)
}

/// The unit at the end of the name of a column, as `mm` of `tip_mm`, for the rule `key`: of a time for `t` and `time`,
/// of a length or `px` for others. `None` without such an ending.
fn ending_unit(key: &str, name: &str) -> Option<String> {
    let is_time = ["t", "time"].contains(&&key.to_lowercase()[..]);
    suffix_unit(name, is_time).map(|(_, unit)| unit.to_string())
}

/// Whether a field is the symbol of a [known unit](is_unit), with or without brackets.
fn has_unit(field: &str) -> bool {
    is_unit(&plain_unit(field.trim_matches(BRACKETS)))
}

//! Parsing of TOML files with messages that list all missing keys; the TOML reader stops at the first one.
//!
//! [`parse`] deserializes a text. The message of an error lists the keys that have a placeholder (`..`, `...`, `?`,
//! `TODO`, without quotes) as value, with their lines, if there are any. Else, if the error is a missing key, it lists
//! all missing keys by the [`Rule`]s of the file kind, or one key with the line of its table. Else it has the message
//! of the TOML reader with line, column and the token at fault, and with types in words. A [`Rule`] has the required
//! keys of one table, which is required itself ([`always`]) or optional ([`if_there`]). Files of scenes, structures,
//! fits and campaigns are read with it. [`placeholders`] lists the keys with placeholders, and [`has_key`] returns
//! whether a text gives a key of a table.

use crate::error::Error;
use marker_files::printable::{column_name, token, with_tokens_cut};
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

/// Names of keys.
pub(crate) type Keys = &'static [&'static str];

/// Required keys of one table of a file.
pub(crate) struct Rule {
    /// Path of the table: `rod.shape`; `loads.point[]` is each entry of a list.
    table: &'static str,
    /// Whether the table itself is required.
    always: bool,
    /// Required keys of a table, which may depend on its content.
    keys: fn(&Table) -> Keys,
}

/// Rule for a required table at the path `table`. `keys` returns the required keys of the given table; if the table is
/// missing, those for an empty table are all missing.
pub(crate) const fn always(table: &'static str, keys: fn(&Table) -> Keys) -> Rule {
    Rule { table, always: true, keys }
}

/// Rule for an optional table at the path `table`, or each entry of a list: its keys are required only if the table is
/// given. `keys` returns them.
pub(crate) const fn if_there(table: &'static str, keys: fn(&Table) -> Keys) -> Rule {
    Rule { table, always: false, keys }
}

/// Paths of all keys that `rules` require and `file` does not have, in the order of the rules, such as
/// `loads.point[0].force`. Empty if all are there.
pub(crate) fn missing(file: &Table, rules: &[Rule]) -> Vec<String> {
    let mut missing = Vec::new();
    let none = Table::new();
    for rule in rules {
        let mut tables = tables(file, rule.table);
        if rule.always && tables.is_empty() {
            tables.push((rule.table.into(), &none));
        }
        for (path, table) in &tables {
            let absent = (rule.keys)(table).iter().filter(|key| !table.contains_key(**key));
            missing.extend(absent.map(|key| join(path, key)));
        }
    }
    missing
}

/// The path of a key: `table.key`, or the key alone at the root, where `table` is empty.
fn join(table: &str, key: &str) -> String {
    if table.is_empty() { key.into() } else { format!("{table}.{key}") }
}

/// The tables at a path (`loads.point[]`: each entry of a list), each with its own path (`loads.point[0]`). The root
/// has an empty path. Empty if absent or of another type.
fn tables<'a>(file: &'a Table, place: &str) -> Vec<(String, &'a Table)> {
    let mut found = vec![(String::new(), file)];
    for part in place.split('.').filter(|part| !part.is_empty()) {
        let (key, several) = part.strip_suffix("[]").map_or((part, false), |key| (key, true));
        let mut inner = Vec::new();
        for (path, table) in found {
            let path = join(&path, key);
            match table.get(key) {
                Some(Value::Table(table)) if !several => inner.push((path, table)),
                Some(Value::Array(list)) if several => {
                    let tables = list.iter().enumerate().filter_map(|(i, value)| {
                        value.as_table().map(|table| (format!("{path}[{i}]"), table))
                    });
                    inner.extend(tables);
                }
                _ => {}
            }
        }
        found = inner;
    }
    found
}

/// Byte offset in `text` at which the table of a missing `key` begins, such as the second experiment for
/// `experiment[1].name`. None for a key outside of tables, a table that is not found, and a text that is not TOML.
fn place(text: &str, key: &str) -> Option<usize> {
    let (tables, _) = key.rsplit_once('.')?;
    let root = DeTable::parse(text).ok()?;
    let (mut table, mut start) = (root.get_ref(), None);
    for part in tables.split('.') {
        let (name, index) = match part.strip_suffix(']').and_then(|part| part.split_once('[')) {
            Some((name, index)) => (name, Some(index.parse::<usize>().ok()?)),
            None => (part, None),
        };
        let mut value = table.get(name)?;
        if let (Some(index), DeValue::Array(list)) = (index, value.get_ref()) {
            value = list.get(index)?;
        }
        // The innermost table of the path is the one that lacks the key.
        start = Some(value.span().start);
        table = match value.get_ref() {
            DeValue::Table(table) => table,
            _ => return None,
        };
    }
    start
}

/// Texts in place of a value that is still missing, as templates and users write them.
const PLACEHOLDERS: [&str; 4] = ["..", "...", "?", "TODO"];

/// A key with a placeholder in the place of its value.
struct Placeholder<'a> {
    /// Number of the line, from 1.
    line: usize,
    /// The key without the path of its table.
    key: &'a str,
    /// The comment behind it, which describes the value.
    comment: &'a str,
}

/// The keys of a TOML text whose value is one of [`PLACEHOLDERS`] without quotes, with their lines (from 1) and the
/// comments behind them. Lines are searched one by one, so that keys have no path of their table; commented lines are
/// left out.
fn find_placeholders(text: &str) -> Vec<Placeholder<'_>> {
    // A text with placeholders may be no valid TOML: its lines are searched one by one.
    let found = text.lines().enumerate().filter_map(|(k, line)| {
        let (key, rest) = line.split_once('=')?;
        let (value, comment) = rest.split_once('#').unwrap_or((rest, ""));
        let (key, comment) = (key.trim(), comment.trim());
        let is_open = PLACEHOLDERS.contains(&value.trim()) && !key.starts_with('#');
        is_open.then_some(Placeholder { line: k + 1, key, comment })
    });
    found.collect()
}

/// Keys of a TOML text that have a placeholder (`..`, `...`, `?`, `TODO`, without quotes) as their value, in the order
/// of the lines. Keys are without the path of their table.
pub fn placeholders(text: &str) -> Vec<String> {
    find_placeholders(text).into_iter().map(|placeholder| placeholder.key.into()).collect()
}

/// Message that lists the keys still to be filled in, with their lines and comments, separated by semicolons; none
/// without placeholders.
fn placeholder_message(text: &str) -> Option<String> {
    let one = |p: &Placeholder| {
        let comment = if p.comment.is_empty() { "" } else { &format!(" ({})", token(p.comment)) };
        format!("line {}: {} is still to be filled in{comment}", p.line, column_name(p.key))
    };
    let all: Vec<String> = find_placeholders(text).iter().map(one).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// Number, from 1, of the line in which the text `before` ends.
fn line_of(before: &str) -> usize {
    before.matches('\n').count() + 1
}

/// Message of the TOML reader with line and column (both from 1), and the key and token at fault unless the message
/// contains the token. Long tokens are shortened. Nothing else of the file is shown, as it may be one that only the
/// program may read. An error without a position has its message only.
fn described(error: &toml::de::Error, text: &str) -> String {
    // The parser quotes tokens of the file, which may be long.
    let cut = with_tokens_cut(error.message(), '"').into_owned();
    let message = with_tokens_cut(&cut, '`').trim_end().replace('\n', ", ");
    let message = with_plain_types(&message);
    let Some((before, found)) = error.span().and_then(|span| {
        let before = text.get(..span.start)?;
        Some((before, text.get(span)?.lines().next().unwrap_or_default().trim_end()))
    }) else {
        return message;
    };
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    let place = format!("line {}, column {column}", line_of(before));
    // The token is left out if the message contains it, and if the error is a missing key.
    match found.is_empty() || message.contains(found.trim_matches(['"', '\''])) {
        true => format!("{place}: {message}"),
        false => format!("{place}: at `{}{}`: {message}", key_before(before), token(found)),
    }
}

/// A message of the TOML reader with the expected type in words: `expected a number` for `expected f64`. Other messages
/// are unchanged.
fn with_plain_types(message: &str) -> String {
    let Some((found, expected)) = message.rsplit_once(", expected ") else {
        return message.into();
    };
    let expected = match expected {
        "f64" => "a number",
        "usize" | "u8" | "u16" | "u32" | "u64" => "a whole number, 0 or more",
        "a sequence" => "a list",
        "a map" => "a table",
        _ if expected.starts_with("struct ") => "a table",
        _ => expected,
    };
    format!("{found}, expected {expected}")
}

/// The text `key = ` for the key in front of a value, where `text` ends before the value. Empty if the last line of the
/// text does not end with `=`.
fn key_before(text: &str) -> String {
    let line = text.rsplit('\n').next().unwrap_or_default().trim_end();
    let key = line.strip_suffix('=').and_then(|line| line.rsplit(['{', ',']).next());
    key.map_or(String::new(), |key| format!("{} = ", column_name(key.trim())))
}

/// Whether the TOML text of a file has the key `key` in the table `name`; false for a text that cannot be parsed.
pub(crate) fn has_key(text: &str, name: &str, key: &str) -> bool {
    let file = toml::from_str::<toml::Table>(text).unwrap_or_default();
    file.get(name).is_some_and(|table| table.get(key).is_some())
}

/// Deserializes a TOML text into a value of type `T`. `required` has the rules for the required keys of its kind, for
/// the list of all missing ones.
///
/// # Errors
///
/// The message lists the placeholders in place of values, or all missing keys, or has the first error with line,
/// column, and key and token at fault.
pub(crate) fn parse<T: serde::de::DeserializeOwned>(
    text: &str,
    required: &[Rule],
) -> Result<T, Error> {
    toml::from_str(text).map_err(|error: toml::de::Error| {
        // Placeholders cause other errors of the parser, which would be misleading.
        if let Some(message) = placeholder_message(text) {
            return Error::Parse { file: None, message };
        }
        // Only a missing field leads to the complete list; other errors keep their own place.
        let missing = match (error.message().starts_with("missing field"), text.parse()) {
            (true, Ok(table)) => missing(&table, required),
            _ => Vec::new(),
        };
        let message = match &missing[..] {
            [] => described(&error, text),
            [key] => {
                // A single missing key is reported with the line of its table.
                let start = place(text, key).or(error.span().map(|span| span.start));
                let before = start.map_or("", |start| &text[..start]);
                format!("line {}: missing key: {key}", line_of(before))
            }
            keys => format!("missing keys: {}", keys.join(", ")),
        };
        Error::Parse { file: None, message }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::de::DeserializeOwned;
    use std::collections::BTreeMap;

    /// The message for a text whose keys have values of the type `T`.
    fn message<T: DeserializeOwned>(text: &str) -> String {
        parse::<BTreeMap<String, T>>(text, &[]).err().unwrap().to_string()
    }

    #[test]
    fn expected_types_are_named_in_plain_words() {
        for (found, expected) in [
            (message::<f64>("a = \"b\""), "string \"b\", expected a number"),
            (message::<usize>("a = -1"), "integer `-1`, expected a whole number, 0 or more"),
            (message::<Vec<f64>>("a = 1"), "integer `1`, expected a list"),
            (message::<BTreeMap<String, f64>>("a = 1"), "integer `1`, expected a table"),
            (message::<bool>("a = \", expected f64\""), "expected a boolean"),
        ] {
            assert!(found.starts_with("line 1, column 5") && found.ends_with(expected), "{found}");
        }
    }
}

//! Values that pass between Python and Rust as JSON text, and tables that pass as JSON and are read as TOML. Invalid
//! JSON is an `InputError` with the name of the argument, an error in a table one with the key instead of its line.

use crate::error::{failed, raised, refused};
use pyo3::prelude::*;
use rodfit::Error;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Largest number of characters of a text that a message quotes.
const MOST_QUOTED: usize = 80;

/// A value as JSON text; an exception of a failed computation if it cannot be written.
pub fn to_json(py: Python<'_>, value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|error| failed(py, error))
}

/// The value of a JSON text; an input exception if it is invalid. `key` is the name of the argument, for messages.
pub fn from_json<T: DeserializeOwned>(py: Python<'_>, key: &str, text: &str) -> PyResult<T> {
    serde_json::from_str(text).map_err(|error| raised(py, invalid(key, text, &error)))
}

/// The value of parsed JSON; an input exception if it is of another type. `key` and `text` are for messages.
pub fn from_value<T: DeserializeOwned>(
    py: Python<'_>,
    key: &str,
    text: &str,
    value: serde_json::Value,
) -> PyResult<T> {
    serde_json::from_value(value).map_err(|error| raised(py, invalid(key, text, &error)))
}

/// The error of an invalid value for the argument `key`: found is the start of its JSON `text`, allowed the end of the
/// message of `error` behind `expected`. The position in the text, which the user has not written, is left out.
fn invalid(key: &str, text: &str, error: &serde_json::Error) -> Error {
    let message = error.to_string();
    let message = message.split(" at line ").next().unwrap_or_default();
    let allowed = match message.rsplit("expected ").next().unwrap_or_default() {
        "f64" => "a number",
        "usize" | "u64" => "a whole number, 0 or more",
        "a sequence" => "a list",
        "a map" => "a table",
        allowed => allowed,
    };
    let found = match text.char_indices().nth(MOST_QUOTED) {
        Some((end, _)) => format!("{} ..", &text[..end]),
        None => text.into(),
    };
    Error::Invalid { file: None, key: key.into(), found, allowed: allowed.into() }
}

/// Converts a table from JSON to TOML; an input exception for a text that is no JSON object, or that has a null.
pub fn json_to_toml(py: Python<'_>, json: &str) -> PyResult<String> {
    let table: toml::Table = serde_json::from_str(json).map_err(|error| refused(py, error))?;
    toml::to_string(&table).map_err(|error| refused(py, error))
}

/// The exception of an error in a TOML text that was made from a table: it has the key of the line in place of the
/// line. Other errors are raised unchanged.
pub fn raised_in_table(py: Python<'_>, text: &str, error: Error) -> PyErr {
    let Error::Parse { file: None, message } = &error else { return raised(py, error) };
    let Some((key, words)) = key_of(text, message) else { return raised(py, error) };
    let exception = refused(py, format!("{key}: {words}"));
    match exception.value(py).setattr("key", key) {
        Ok(()) => exception,
        Err(error) => error,
    }
}

/// The dotted key, with its table, in the line of `text` that a `message` as `line 3, column 9: words` has, and the
/// words; `None` for other messages.
fn key_of<'a>(text: &str, message: &'a str) -> Option<(String, &'a str)> {
    let (position, words) = message.strip_prefix("line ")?.split_once(": ")?;
    let line: usize = position.split(", column ").next()?.parse().ok()?;
    let mut table = "";
    let mut key = "";
    // The delimiter of a string with several lines, which may look like keys and tables.
    let mut open: Option<&str> = None;
    for line in text.lines().take(line) {
        if let Some(quotes) = open {
            open = open.filter(|_| !line.contains(quotes));
            continue;
        }
        match line.strip_prefix('[') {
            Some(header) => (table, key) = (header.trim_matches(['[', ']']), ""),
            None => {
                let (name, value) = line.split_once(" = ").unwrap_or((line, ""));
                key = name;
                let is_open = |quotes: &&str| {
                    value.strip_prefix(*quotes).is_some_and(|rest| !rest.contains(*quotes))
                };
                open = ["\"\"\"", "'''"].into_iter().find(is_open);
            }
        }
    }
    let path = [table, key].into_iter().filter(|part| !part.is_empty());
    Some((path.collect::<Vec<_>>().join("."), words))
}

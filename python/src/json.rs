//! What goes between Python and Rust as text.

use crate::error::{failed, refused};
use pyo3::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A value as JSON.
pub fn json(py: Python<'_>, value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|error| failed(py, error))
}

/// What a JSON text says, as files do; `key` is what it is called.
pub fn said<T: DeserializeOwned>(py: Python<'_>, key: &str, text: &str) -> PyResult<T> {
    serde_json::from_str(text).map_err(|error| refused(py, format!("{key}: found {text}: {error}")))
}

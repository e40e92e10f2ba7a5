//! Values that pass between Python and Rust as JSON text.

use crate::error::{failed, refused};
use pyo3::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A value as JSON text; an exception of a failed computation if it cannot be written.
pub fn to_json(py: Python<'_>, value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|error| failed(py, error))
}

/// The value of a JSON text; an input exception if it is invalid. `key` is the name of the argument, for messages.
pub fn from_json<T: DeserializeOwned>(py: Python<'_>, key: &str, text: &str) -> PyResult<T> {
    serde_json::from_str(text).map_err(|error| refused(py, format!("{key}: found {text}: {error}")))
}

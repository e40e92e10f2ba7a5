//! Errors as exceptions.

use pyo3::exceptions::{PyException, PyKeyboardInterrupt};
use pyo3::prelude::*;
use pyo3::{PyErr, create_exception};

create_exception!(rodfit, RodfitError, PyException, "What rodfit refuses or cannot compute.");
create_exception!(
    rodfit,
    InputError,
    RodfitError,
    "An input is at fault: `file`, `key`, `found` and `allowed` say where and why, where they are known."
);
create_exception!(
    rodfit,
    ComputationError,
    RodfitError,
    "The input is sound, and could not be computed."
);

/// The exception of an error.
pub fn raised(py: Python<'_>, error: rodfit::Error) -> PyErr {
    if matches!(error, rodfit::Error::Interrupted) {
        return PyKeyboardInterrupt::new_err(());
    }
    let words = error.to_string();
    let exception = match error.is_input() {
        true => InputError::new_err(words),
        false => ComputationError::new_err(words),
    };
    let value = exception.value(py);
    let (file, key, found, allowed) = match error {
        rodfit::Error::Invalid { file, key, found, allowed } => {
            (file, Some(key), Some(found), Some(allowed))
        }
        rodfit::Error::Data { path, .. } => (Some(path), None, None, None),
        rodfit::Error::Parse { file, .. } => (file, None, None, None),
        _ => (None, None, None, None),
    };
    let file = file.map(|file| file.display().to_string());
    for (name, text) in [("file", file), ("key", key), ("found", found), ("allowed", allowed)] {
        if let Err(error) = value.setattr(name, text) {
            return error;
        }
    }
    exception
}

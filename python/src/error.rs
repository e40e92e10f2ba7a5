//! Conversion of errors of the library to Python exceptions, whose classes are defined in `rodfit/_errors.py`: invalid
//! input to `InputError`, failed computations to `ComputationError`, interruptions to `KeyboardInterrupt`.

use pyo3::PyErr;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use std::fmt::Display;

/// The Python class of errors of the input, imported at first use.
static INPUT: PyOnceLock<Py<PyType>> = PyOnceLock::new();
/// The Python class of errors of the computation, imported at first use.
static COMPUTATION: PyOnceLock<Py<PyType>> = PyOnceLock::new();

/// An exception of the class for invalid input or for failed computations, with the message `words`.
fn exception(py: Python<'_>, is_input: bool, words: String) -> PyErr {
    let class = match is_input {
        true => INPUT.import(py, "rodfit._errors", "InputError"),
        false => COMPUTATION.import(py, "rodfit._errors", "ComputationError"),
    };
    class.map_or_else(|error| error, |class| PyErr::from_type(class.clone(), words))
}

/// The exception of an invalid input (`InputError`) with a message.
pub fn refused(py: Python<'_>, words: impl Display) -> PyErr {
    exception(py, true, words.to_string())
}

/// The exception of a failed computation (`ComputationError`) with a message.
pub fn failed(py: Python<'_>, words: impl Display) -> PyErr {
    exception(py, false, words.to_string())
}

/// The exception of an error of the library, with its text: `KeyboardInterrupt` (without a text) for an interruption,
/// `InputError` for an invalid input, else `ComputationError`. Errors of files and keys set the attributes `file`,
/// `line`, `key`, `found` and `allowed`, to `None` where the error does not have them. Other errors set none.
pub fn raised(py: Python<'_>, error: rodfit::Error) -> PyErr {
    if matches!(error, rodfit::Error::Interrupted) {
        return PyKeyboardInterrupt::new_err(());
    }
    let raised = exception(py, error.is_input(), error.to_string());
    let value = raised.value(py);
    let (file, line, [key, found, allowed]) = match error {
        rodfit::Error::Invalid { file, key, found, allowed } => {
            (file, None, [key, found, allowed].map(Some))
        }
        rodfit::Error::Data { path, line, .. } => (Some(path), Some(line), [None, None, None]),
        rodfit::Error::Io { path, .. } => (Some(path), None, [None, None, None]),
        rodfit::Error::Parse { file, .. } => (file, None, [None, None, None]),
        _ => return raised,
    };
    let file = file.map(|file| file.display().to_string());
    let texts = [("file", file), ("key", key), ("found", found), ("allowed", allowed)];
    let mut set = texts.iter().map(|(name, text)| value.setattr(*name, text));
    match set.find_map(Result::err).or(value.setattr("line", line).err()) {
        Some(error) => error,
        None => raised,
    }
}

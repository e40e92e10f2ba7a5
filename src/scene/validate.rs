//! Rejection of invalid numbers and vectors in a scene: not positive, not finite, or a direction of no length.
//!
//! Each function takes the key and the value, and returns an error with key, found value and allowed values:
//! [`positive`] for a number, [`finite`] for a vector, [`direction`] for a vector whose length must not be zero, and
//! [`check_name`] for a name that is part of the names of parameters ([`is_name`]).

use crate::error::{Error, ensure};

/// Rejects a number that is not finite or not above 0; `key` is its path, for the error.
pub(crate) fn positive(key: &str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::invalid(key, value, "a finite number above 0"))
}

/// Rejects a vector with a component that is not finite; `key` is its path, for the error.
pub(crate) fn finite(key: &str, values: &[f64; 3]) -> Result<(), Error> {
    if values.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    Err(Error::invalid(key, format!("{values:?}"), "finite numbers"))
}

/// Whether a name can be part of the path of a parameter, which has dots between its parts: a letter, then letters,
/// digits, - and _.
pub(crate) fn is_name(name: &str) -> bool {
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(is_allowed)
}

/// Rejects a name that cannot be part of the path of a parameter ([`is_name`]); `key` is its path, for the error.
pub(crate) fn check_name(key: &str, name: &str) -> Result<(), Error> {
    let allowed = "a letter followed by letters, digits, - and _";
    ensure(is_name(name), key, format!("{name:?}"), allowed)
}

/// Rejects a direction of length zero, or with a component that is not finite; `key` is its path, for the error.
pub(crate) fn direction(key: &str, vector: &[f64; 3]) -> Result<(), Error> {
    finite(key, vector)?;
    let length = nalgebra::Vector3::from(*vector).norm();
    if length > 0.0 && length.is_finite() {
        return Ok(());
    }
    Err(Error::invalid(key, format!("{vector:?}"), "a direction of non-zero length"))
}

//! What numbers may be, wherever they stand in a scene.

use crate::error::Error;

/// A finite number above zero.
pub(crate) fn positive(key: &str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::invalid(key, value, "a finite number above 0"))
}

/// A finite number, zero or above.
pub(crate) fn not_negative(key: &str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(Error::invalid(key, value, "a finite number, 0 or above"))
}

/// Finite components.
pub(crate) fn finite(key: &str, values: &[f64; 3]) -> Result<(), Error> {
    if values.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    Err(Error::invalid(key, format!("{values:?}"), "finite numbers"))
}

/// A finite direction of non-zero length.
pub(crate) fn direction(key: &str, vector: &[f64; 3]) -> Result<(), Error> {
    finite(key, vector)?;
    let length = nalgebra::Vector3::from(*vector).norm();
    if length > 0.0 && length.is_finite() {
        return Ok(());
    }
    Err(Error::invalid(key, format!("{vector:?}"), "a direction of non-zero length"))
}

//! Deserialization of lists of a fixed length, for which the TOML reader ignores excess numbers, and of infinite numbers,
//! which are null in JSON.

use serde::de::{Deserialize, Deserializer, Error};

/// Reads exactly `N` numbers.
pub(crate) fn numbers<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[T; N], D::Error> {
    exactly(Vec::deserialize(deserializer)?)
}

/// Reads exactly `N` numbers, or none of a key that is absent or null.
pub(crate) fn some_numbers<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Option<[T; N]>, D::Error> {
    Option::deserialize(deserializer)?.map(exactly).transpose()
}

/// Reads lists of exactly `N` numbers each.
pub(crate) fn rows<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Vec<[T; N]>, D::Error> {
    Vec::<Vec<T>>::deserialize(deserializer)?.into_iter().map(exactly).collect()
}

/// Converts a list of exactly `N` values.
fn exactly<T, E: Error, const N: usize>(values: Vec<T>) -> Result<[T; N], E> {
    let expected = format!("{N} numbers");
    <[T; N]>::try_from(values).map_err(|values| E::invalid_length(values.len(), &expected.as_str()))
}

/// Reads a number; null is infinity.
pub(crate) fn or_infinite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

/// Reads a list of numbers; null is infinity.
pub(crate) fn all_or_infinite<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<f64>, D::Error> {
    let values = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|value| value.unwrap_or(f64::INFINITY)).collect())
}

//! Numbers as files write them: lists of a given length, of which TOML's reader ignores what is too many,
//! and those that JSON has no digits for.

use serde::de::{Deserialize, Deserializer, Error};

/// As many numbers as the key has, no more and no fewer.
pub(crate) fn numbers<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[T; N], D::Error> {
    so_many(Vec::deserialize(deserializer)?)
}

/// The same of a key that may be absent, or null.
pub(crate) fn some_numbers<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Option<[T; N]>, D::Error> {
    Option::deserialize(deserializer)?.map(so_many).transpose()
}

/// Lists of so many numbers each.
pub(crate) fn rows<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Vec<[T; N]>, D::Error> {
    Vec::<Vec<T>>::deserialize(deserializer)?.into_iter().map(so_many).collect()
}

fn so_many<T, E: Error, const N: usize>(values: Vec<T>) -> Result<[T; N], E> {
    let expected = format!("{N} numbers");
    <[T; N]>::try_from(values).map_err(|values| E::invalid_length(values.len(), &expected.as_str()))
}

/// A number that JSON writes as null where it is infinite.
pub(crate) fn or_infinite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

/// Such numbers.
pub(crate) fn all_or_infinite<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<f64>, D::Error> {
    let values = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|value| value.unwrap_or(f64::INFINITY)).collect())
}

//! Deserialization (serde) of lists of exactly `N` numbers, and of numbers that JSON writes as null because they are
//! infinite.
//!
//! The TOML reader ignores excess numbers of an array of fixed length. [`numbers`], [`some_numbers`] (of an optional
//! list, for which null is none) and [`rows`] (of each row of a list) return an error with both lengths instead.
//! [`three_or_last_two`] reads three numbers, or only the last two of them, with zero as the first. [`or_infinite`]
//! reads a number and [`all_or_infinite`] a list of numbers, in which a null becomes plus infinity; JSON writes NaN as
//! null too. Fields of scenes, fits and reports name the functions in `#[serde(deserialize_with = ..)]`.

use serde::de::{Deserialize, Deserializer, Error};

/// Reads a list of exactly `N` numbers; an error with both lengths for another one.
pub(crate) fn numbers<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[T; N], D::Error> {
    exactly(Vec::deserialize(deserializer)?)
}

/// Reads a list of exactly `N` numbers; none for null. Another length is an error with both lengths. A field with
/// `#[serde(default)]` is none if its key is absent.
pub(crate) fn some_numbers<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Option<[T; N]>, D::Error> {
    Option::deserialize(deserializer)?.map(exactly).transpose()
}

/// Reads a list of three numbers, or of the last two, with the first one zero; an error with the length for another.
pub(crate) fn three_or_last_two<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<[f64; 3], D::Error> {
    match Vec::deserialize(deserializer)?[..] {
        [first, second, third] => Ok([first, second, third]),
        [second, third] => Ok([0.0, second, third]),
        ref other => Err(D::Error::invalid_length(other.len(), &"3 numbers, or 2")),
    }
}

/// Reads a list like [`three_or_last_two`]; none for null. A field with `#[serde(default)]` is none if its key is
/// absent.
pub(crate) fn some_three_or_last_two<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<[f64; 3]>, D::Error> {
    three_or_last_two(deserializer).map(Some)
}

/// Reads a list, of any length, of lists of exactly `N` numbers each; another length of a row is an error with both
/// lengths.
pub(crate) fn rows<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Vec<[T; N]>, D::Error> {
    Vec::<Vec<T>>::deserialize(deserializer)?.into_iter().map(exactly).collect()
}

/// The array of `N` values; an error of serde with both lengths if there are more or fewer.
fn exactly<T, E: Error, const N: usize>(values: Vec<T>) -> Result<[T; N], E> {
    let expected = format!("{N} numbers");
    <[T; N]>::try_from(values).map_err(|values| E::invalid_length(values.len(), &expected.as_str()))
}

/// Reads a number; null, as which JSON writes infinite numbers and NaN, becomes plus infinity.
pub(crate) fn or_infinite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    // JSON cannot write infinite errors; they must not become zero when they are read.
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

/// Reads a list of numbers; each null, as which JSON writes infinite numbers and NaN, becomes plus infinity.
pub(crate) fn all_or_infinite<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<f64>, D::Error> {
    let values = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|value| value.unwrap_or(f64::INFINITY)).collect())
}

//! Lists of a given number of numbers. TOML's reader ignores what is too many.

use serde::de::{Deserialize, Deserializer, Error};

/// As many numbers as the key has, no more and no fewer.
pub(crate) fn numbers<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[f64; N], D::Error> {
    let values = Vec::<f64>::deserialize(deserializer)?;
    let expected = format!("{N} numbers");
    <[f64; N]>::try_from(values)
        .map_err(|values| D::Error::invalid_length(values.len(), &expected.as_str()))
}

/// The same of a key that may be absent.
pub(crate) fn some_numbers<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Option<[f64; N]>, D::Error> {
    numbers(deserializer).map(Some)
}

//! Lists of a given number of numbers. TOML's reader ignores what is too many.

use serde::de::{Deserialize, Deserializer, Error};

/// As many numbers as the key has, no more and no fewer.
pub(crate) fn numbers<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[T; N], D::Error> {
    let values = Vec::<T>::deserialize(deserializer)?;
    let expected = format!("{N} numbers");
    <[T; N]>::try_from(values)
        .map_err(|values| D::Error::invalid_length(values.len(), &expected.as_str()))
}

/// The same of a key that may be absent.
pub(crate) fn some_numbers<'de, T: Deserialize<'de>, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Option<[T; N]>, D::Error> {
    numbers(deserializer).map(Some)
}

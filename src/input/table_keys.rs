//! Keys of a table of an input file, from the type that it is deserialized as.
//!
//! [`table_keys`] takes the names of the fields of a struct from its deserialization (serde), and reads no value.
//! Fields that are not part of files are left out, and renamed ones have their name in the file.

use serde::de::value::Error;
use serde::de::{Deserialize, Deserializer, Error as _, Visitor};

/// The keys of the table that is deserialized as `T`, a struct, in the order of its fields. Empty for other types.
pub(crate) fn table_keys<'de, T: Deserialize<'de>>() -> &'static [&'static str] {
    let mut keys: &'static [&'static str] = &[];
    // The reader has no values: it always ends with an error, after the names were given.
    drop(T::deserialize(KeyReader(&mut keys)));
    keys
}

/// A serde source without values, which stores the names of the fields of the struct that is read from it.
struct KeyReader<'a>(&'a mut &'static [&'static str]);

impl<'de> Deserializer<'de> for KeyReader<'_> {
    type Error = Error;

    /// An error: there is no value.
    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Error> {
        Err(Error::custom("no value"))
    }

    /// Keeps the names of the `fields`, and ends with an error.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        _: V,
    ) -> Result<V::Value, Error> {
        *self.0 = fields;
        Err(Error::custom("no value"))
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

//! Files as users write them: text, tables of numbers, and keys that are missing.

pub(crate) mod arrays;
pub(crate) mod file;
pub(crate) mod missing_keys;
pub(crate) mod table;

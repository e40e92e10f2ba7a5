//! Files as users and their programs write them: text, tables of numbers, markers, and keys that are missing.

pub(crate) mod arrays;
pub(crate) mod file;
pub(crate) mod hints;
pub(crate) mod missing_keys;
pub(crate) mod onset;
pub(crate) mod table;
pub(crate) mod track;

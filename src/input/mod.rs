//! Files as users and their programs write them: text, tables of numbers, markers, and keys that are missing.

pub(crate) mod arrays;
pub(crate) mod file;
pub(crate) mod hints;
pub(crate) mod missing_keys;
pub(crate) mod onset;
#[cfg(feature = "cli")]
pub mod part_file;
pub(crate) mod table;
#[cfg(feature = "cli")]
pub(crate) mod text_cell;
pub(crate) mod track;
pub(crate) mod unknown_file;

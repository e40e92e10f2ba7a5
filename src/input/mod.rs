//! Files as users and their programs write them: lists of numbers, and keys that are missing.

pub(crate) mod arrays;
pub(crate) mod hints;
pub(crate) mod missing_keys;
pub(crate) mod onset;
#[cfg(feature = "cli")]
pub mod part_file;
#[cfg(feature = "cli")]
pub(crate) mod text_cell;

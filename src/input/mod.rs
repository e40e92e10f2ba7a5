//! Input and output of text files: lists of numbers, missing keys, likely mistakes, onset of a recorded motion, and
//! files that are replaced only when complete.

pub(crate) mod arrays;
pub(crate) mod hints;
pub(crate) mod missing_keys;
pub(crate) mod onset;
#[cfg(feature = "cli")]
pub mod part_file;
#[cfg(feature = "cli")]
pub(crate) mod text_cell;

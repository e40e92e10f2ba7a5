//! Input and output of text files: lists of fixed length, messages about missing keys and likely mistakes, and the onset of a
//! recorded motion. With the feature `cli` there are also table cells safe for spreadsheets, and output files that are
//! replaced only when complete.

pub(crate) mod arrays;
pub(crate) mod hints;
pub(crate) mod missing_keys;
pub(crate) mod onset;
#[cfg(feature = "cli")]
pub mod part_file;
#[cfg(feature = "cli")]
pub(crate) mod text_cell;

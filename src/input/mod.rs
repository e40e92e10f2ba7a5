//! Input and output of text files, for scenes, fits, recordings and campaigns.
//!
//! `arrays` deserializes lists of fixed length, and null as an infinite number. `missing_keys` parses TOML; its error
//! messages list all placeholders, or else all missing keys. `hints` replaces the message of an error by a likely
//! mistake, such as another kind of file. `onset` estimates the time at which a recorded motion begins. With the
//! feature `cli` there are also output files that are replaced only when complete (`part_file`), and the keys of the
//! table that is read as a type (`table_keys`). `text_cell` (features `cli` and `page`) guards text in CSV cells
//! against evaluation as a formula.

pub(crate) mod arrays;
pub(crate) mod hints;
pub(crate) mod missing_keys;
pub(crate) mod onset;
#[cfg(feature = "cli")]
pub mod part_file;
#[cfg(feature = "cli")]
pub(crate) mod table_keys;
#[cfg(any(feature = "cli", feature = "page"))]
pub(crate) mod text_cell;

//! Errors of files of markers: the file, the line, the found content and the allowed content.
//!
//! [`Error`] is a file that cannot be read or is no regular file (`Io`), a line that cannot be used (`Data`), or a
//! table of accelerations instead of positions. All have the path; `Data` has the line, counted from 1, and a message.
//! In C3D files the line is the number of the frame, or 1. In the text of an error, control characters of paths and
//! messages are escaped, and messages of `Data` have long tokens, words and lines cut.

use crate::printable::{io_reason, printable_path, shown};
use std::path::{Path, PathBuf};

/// A file that cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be opened or is no regular file.
    #[error("{}: {}", printable_path(path), io_reason(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// A line of a file cannot be used.
    #[error("{}:{line}: {}", printable_path(path), shown(message))]
    Data {
        /// The file.
        path: PathBuf,
        /// The line, the header being line 1.
        line: u64,
        /// What was found and what is allowed.
        message: String,
    },
    /// A table has accelerations instead of positions.
    #[error(
        "{}:1: found accelerations instead of positions, allowed: {allowed}",
        printable_path(path)
    )]
    Accelerations {
        /// The file.
        path: PathBuf,
        /// The files that are read.
        allowed: String,
    },
}

impl Error {
    /// An error at a line (counted from 1) of a file, with the found and the allowed content as message.
    pub fn data(path: &Path, line: u64, message: impl Into<String>) -> Self {
        Self::Data { path: path.into(), line, message: message.into() }
    }

    /// The error of the operating system for a file.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.into(), source }
    }
}

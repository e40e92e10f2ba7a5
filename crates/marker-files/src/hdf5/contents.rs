//! An HDF5 file opened by the crate `hdf5-pure`, and the names of its members.
//!
//! [`with_file`] opens the bytes of a file as a [`LimitedSource`] and calls a function with it, in a thread with a large
//! stack: types of data that contain each other thousands of times are read recursively. [`listed`] sorts names of members,
//! [`frames`] finds the tables of pandas, [`reason`] is the text of an error. Errors are messages; a panic of the reader
//! is one, too.

use crate::hdf5::limited_source::LimitedSource;
use hdf5_pure::{AttrValue, File, FormatError};

/// Size of the stack of the reader, bytes. A type of 64 kB nests 8190 times, with less than 8 kB each.
const STACK: usize = 64 << 20;
/// Most groups of a file that are examined.
pub(crate) const MOST_GROUPS: usize = 16;

/// Reads bytes as an HDF5 file, in a thread of its own.
pub(crate) fn with_file<T: Send>(
    bytes: &[u8],
    read: impl FnOnce(&File) -> Result<T, String> + Send,
) -> Result<T, String> {
    let opened = || read(&File::from_source(LimitedSource::new(bytes.to_vec())).map_err(reason)?);
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, opened);
        // A panic of the reader is an error of the file.
        let unknown = |_| {
            Err("found a structure that is not known, allowed: a file that is not damaged".into())
        };
        thread.map_err(|error| error.to_string())?.join().unwrap_or_else(unknown)
    })
}

/// The names of members of a group in alphabetical order, or the reason why they cannot be read.
pub(crate) fn listed(names: Result<Vec<String>, hdf5_pure::Error>) -> Result<Vec<String>, String> {
    let mut names = names.map_err(reason)?;
    names.sort();
    Ok(names)
}

/// The groups of a file that are tables of pandas, with their kinds: `frame_table` or `frame`.
pub(crate) fn frames(file: &File) -> Result<Vec<(String, String)>, String> {
    let root = file.root();
    let mut found = Vec::new();
    for name in listed(root.groups())?.into_iter().take(MOST_GROUPS) {
        let attributes = root.group(&name).and_then(|group| group.attrs()).map_err(reason)?;
        if let Some(kind) = attributes.get("pandas_type").and_then(AttrValue::as_str) {
            found.push((name, kind.into()));
        }
    }
    Ok(found)
}

/// The reason of an error of `hdf5-pure`, without the parts before that of [`LimitedSource`].
pub(crate) fn reason(error: hdf5_pure::Error) -> String {
    match error {
        hdf5_pure::Error::Format(FormatError::Source(reason)) => reason,
        other => other.to_string(),
    }
}

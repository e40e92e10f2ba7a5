//! HDF5 files of DeepLabCut and SLEAP as the CSV tables of the same programs, which their readers take.
//!
//! Input are the bytes of a file. Data sets determine the program: `tracks` and `node_names` are those of the analysis of
//! SLEAP ([`is_sleap`]), a table of pandas is one of DeepLabCut ([`is_deeplabcut`]). [`sleap_table`] and
//! [`deeplabcut_table`] return the CSV table that the program would export, with all digits, and bytes that are no HDF5
//! file unchanged. [`description`] names the data sets of a file for messages. Errors name the data set, what was found and what is allowed.

mod contents;
mod data_set;
mod deeplabcut;
mod limited_source;
mod pickled_names;
mod sleap;

use crate::error::Error;
use crate::hdf5::contents::{MOST_GROUPS, frames, listed, with_file};
use crate::printable::column_name;
use crate::signatures::is_hdf5;
use hdf5_pure::File;
use std::borrow::Cow;
use std::path::Path;

/// Most data sets that a description names.
const MOST_NAMED: usize = 8;

/// Whether the bytes are an analysis file of SLEAP.
pub(crate) fn is_sleap(bytes: &[u8]) -> bool {
    let has_tracks = |file: &File| {
        let sets = listed(file.root().datasets())?;
        Ok(["tracks", "node_names"].iter().all(|name| sets.iter().any(|set| set == name)))
    };
    with_file(bytes, has_tracks).unwrap_or_default()
}

/// Whether the bytes are an HDF5 file with a table of pandas, as DeepLabCut writes it.
pub(crate) fn is_deeplabcut(bytes: &[u8]) -> bool {
    with_file(bytes, |file| Ok(!frames(file)?.is_empty())).unwrap_or_default()
}

/// The table in CSV that SLEAP exports, of an analysis file; bytes that are no HDF5 file unchanged. An error for other
/// data sets.
pub(crate) fn sleap_table<'a>(path: &Path, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>, Error> {
    table(path, bytes, sleap::table)
}

/// The table in CSV that DeepLabCut exports, of its HDF5 file; bytes that are no HDF5 file unchanged. An error for other
/// data sets.
pub(crate) fn deeplabcut_table<'a>(path: &Path, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>, Error> {
    table(path, bytes, deeplabcut::table)
}

/// The table that `convert` makes of an HDF5 file and its size; bytes that are no HDF5 file unchanged.
fn table<'a>(
    path: &Path,
    bytes: &'a [u8],
    convert: impl FnOnce(&File, usize) -> Result<Vec<u8>, String> + Send,
) -> Result<Cow<'a, [u8]>, Error> {
    if !is_hdf5(bytes) {
        return Ok(bytes.into());
    }
    let table = with_file(bytes, move |file| convert(file, bytes.len()));
    table.map(Cow::Owned).map_err(|message| Error::data(path, 1, message))
}

/// What an HDF5 file has: the names of its data sets, or the reason why they cannot be read.
pub(crate) fn description(bytes: &[u8]) -> String {
    let names = with_file(bytes, |file| {
        let root = file.root();
        let mut names = listed(root.datasets())?;
        for group in listed(root.groups())?.iter().take(MOST_GROUPS) {
            let members = listed(root.group(group).and_then(|group| group.datasets()))?;
            names.extend(members.into_iter().map(|name| format!("{group}/{name}")));
        }
        Ok(names)
    });
    let names = match names {
        Err(reason) => {
            return format!(
                "an HDF5 file that cannot be read ({reason}); rodfit.hdf5_to_csv in Python may read it"
            );
        }
        Ok(names) if names.is_empty() => {
            return "an HDF5 file without data sets in its first groups".into();
        }
        Ok(names) => names,
    };
    let named = names.iter().take(MOST_NAMED).map(|name| format!("`{}`", column_name(name)));
    let rest = match names.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    format!(
        "an HDF5 file with the data sets {}{rest}; HDF5 is read of DeepLabCut, and of SLEAP the analysis file, with \
         `tracks` and `node_names`",
        named.collect::<Vec<_>>().join(", ")
    )
}

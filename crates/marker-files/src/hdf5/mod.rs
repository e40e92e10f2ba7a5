//! HDF5 files of DeepLabCut and SLEAP as the CSV tables of the same programs, which their readers take.
//!
//! Input are the bytes of a file. [`program`] finds the program by the data sets: `tracks` and `node_names` are the
//! analysis of SLEAP, a table of pandas is a file of DeepLabCut. [`as_table`] returns the CSV table that the program
//! would export, with all digits, and bytes that are no HDF5 file unchanged. [`description`] names the data sets of a
//! file for messages. Errors name the data set, what was found and what is allowed.

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

/// Programs whose HDF5 files are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Hdf5Program {
    DeepLabCut,
    Sleap,
}

/// The program that wrote an HDF5 file; `None` for files of others and damaged ones.
pub(crate) fn program(bytes: &[u8]) -> Option<Hdf5Program> {
    let find = |file: &File| {
        let sets = listed(file.root().datasets())?;
        let has = |name: &str| sets.iter().any(|set| set == name);
        if has("tracks") && has("node_names") {
            return Ok(Some(Hdf5Program::Sleap));
        }
        Ok((!frames(file)?.is_empty()).then_some(Hdf5Program::DeepLabCut))
    };
    with_file(bytes, find).ok().flatten()
}

/// The table in CSV that a program exports, of an HDF5 file with the same contents; bytes that are no HDF5 file
/// unchanged. An error for other data sets than those of the program.
pub(crate) fn as_table<'a>(
    path: &Path,
    program: Hdf5Program,
    bytes: &'a [u8],
) -> Result<Cow<'a, [u8]>, Error> {
    if !is_hdf5(bytes) {
        return Ok(bytes.into());
    }
    let size = bytes.len();
    let table = with_file(bytes, |file| match program {
        Hdf5Program::Sleap => sleap::table(file, size),
        Hdf5Program::DeepLabCut => deeplabcut::table(file, size),
    });
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

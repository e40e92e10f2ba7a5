//! One reader for the files of every tracking program; each returns a [`MarkerFile`] in the units of the file.
//!
//! [`open`] reads the bytes of a file, without a byte-order mark, and takes the stated format or determines it from
//! the first bytes. [`parse`] calls the reader of the format, which has a file of its own here (`plain_table` for CSV
//! without a program). Files of the wrong kind and lines that the program does not write are errors with their line.

mod deeplabcut;
mod dltdv;
mod kinovea;
mod motive;
mod plain_table;
mod qualisys;
mod sleap;
mod tracker;
mod trackmate;
mod trc;
mod vicon;

use crate::error::Error;
use crate::file::data;
use crate::format::Format;
use crate::marker_file::MarkerFile;
use std::path::Path;

/// The format of a file, the `stated` one or that of its first bytes, and its bytes without a byte-order mark.
///
/// # Errors
///
/// A file that cannot be read.
pub fn open(path: &Path, stated: Option<Format>) -> Result<(Format, Vec<u8>), Error> {
    let mut bytes = data(path)?;
    if bytes.starts_with(b"\xef\xbb\xbf") {
        bytes.drain(..3);
    }
    Ok((stated.unwrap_or_else(|| Format::detect(&bytes)), bytes))
}

/// The frames and markers of a file that was [opened](open), by the reader of its format; `path` is for messages.
///
/// # Errors
///
/// A line that is not as the program writes it.
pub fn parse(path: &Path, format: Format, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let read = match format {
        Format::Csv => plain_table::read,
        Format::Motive => motive::read,
        Format::Vicon => vicon::read,
        Format::Tracker => tracker::read,
        Format::DeepLabCut => deeplabcut::read,
        Format::Dltdv => dltdv::read,
        Format::Qualisys => qualisys::read,
        Format::Kinovea => kinovea::read,
        Format::Sleap => sleap::read,
        Format::TrackMate => trackmate::read,
        Format::Trc => trc::read,
    };
    read(path, bytes)
}

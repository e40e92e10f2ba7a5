//! One reader for the files of every tracking program; each returns a [`MarkerFile`] with the units of its clock and
//! positions.
//!
//! [`open`] reads the bytes of a file, without a byte-order mark, and takes the stated format or determines it from the
//! first bytes. [`parse`] calls the reader of the format, which has a file of its own here (`plain_table` for CSV
//! without a program). `open_as` does the same, and [`load`] both, by the keys `format` and `columns` of a recording.
//! [`read_bodies`] reads the rigid bodies of Motive. Files of the wrong kind and lines that the program does not write
//! are errors, in general with their line; so is the key `columns` with the format of a program.

mod c3d;
mod c3d_parameters;
mod deeplabcut;
mod dltdv;
mod kinovea;
mod motive;
mod motive_bodies;
mod opensim;
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
use crate::recording::Recording;
pub use motive_bodies::{RecordedBodies, RecordedBody, RecordedBodyPose, read_bodies};
pub(crate) use plain_table::read_columns;
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

/// The frames and markers of a file, by the keys `format` and `columns` of a recording. With `columns` the file is read
/// as a table.
///
/// # Errors
///
/// Those of [`open`] and [`parse`], and the key `columns` beside a `format` of a program.
pub fn load(path: &Path, recording: &Recording) -> Result<MarkerFile, Error> {
    let (format, bytes) = open_as(path, recording)?;
    match &recording.columns {
        Some(_) => plain_table::read_columns(path, &bytes, recording.columns.as_ref()),
        None => parse(path, format, &bytes),
    }
}

/// The format and the bytes of a file, as [`open`] returns them, by the keys of a recording. With the key `columns` the
/// format is a table; an error if the key `format` then states a program.
pub(crate) fn open_as(path: &Path, recording: &Recording) -> Result<(Format, Vec<u8>), Error> {
    let stated = match (&recording.columns, recording.format) {
        (Some(_), Some(program)) if program != Format::Csv => {
            let message = format!(
                "found columns and format = \"{}\", allowed: columns of tables, format = \"csv\". Remove one of both",
                program.key()
            );
            return Err(Error::data(path, 1, message));
        }
        (Some(_), _) => Some(Format::Csv),
        (None, stated) => stated,
    };
    open(path, stated)
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
        Format::Sto => opensim::read,
        Format::C3d => c3d::read,
    };
    read(path, bytes)
}

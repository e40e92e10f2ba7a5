//! Files of markers as motion-capture and video-tracking programs write them, and tables of one's own: each reader
//! makes the same sheet of its file, and a recording says how that becomes seconds and metres of the world.

pub(crate) mod axes;
pub(crate) mod deeplabcut;
pub(crate) mod dltdv;
pub(crate) mod format;
pub(crate) mod kinovea;
pub(crate) mod motive;
pub(crate) mod qualisys;
pub(crate) mod recording;
pub(crate) mod sheet;
pub(crate) mod sightings;
pub(crate) mod sigma;
pub(crate) mod sleap;
pub(crate) mod table;
pub(crate) mod tracker;
pub(crate) mod trackmate;
pub(crate) mod trc;
pub(crate) mod vicon;

use crate::error::Error;
use crate::input::file::data;
use crate::input::track::format::Format;
use crate::input::track::sheet::Sheet;
use std::path::Path;

/// The bytes of a file without a mark of their order, and its format: `said`, or found from the first of them.
pub(crate) fn open(path: &Path, said: Option<Format>) -> Result<(Format, Vec<u8>), Error> {
    let mut bytes = data(path)?;
    if bytes.starts_with(b"\xef\xbb\xbf") {
        bytes.drain(..3);
    }
    Ok((said.unwrap_or_else(|| Format::of(&bytes)), bytes))
}

/// The markers of a file that was opened.
pub(crate) fn parse(path: &Path, format: Format, bytes: &[u8]) -> Result<Sheet, Error> {
    let read = match format {
        Format::Csv => table::read,
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

//! Without the feature `hdf5`: HDF5 files are described, and not read.

use crate::error::Error;
use std::borrow::Cow;
use std::path::Path;

/// No file is read.
pub(crate) fn is_sleap(_: &[u8]) -> bool {
    false
}

/// No file is read.
pub(crate) fn is_deeplabcut(_: &[u8]) -> bool {
    false
}

/// The bytes unchanged; the reader of SLEAP rejects those of HDF5 files.
pub(crate) fn sleap_table<'a>(_: &Path, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>, Error> {
    Ok(bytes.into())
}

/// The bytes unchanged; the reader of DeepLabCut rejects those of HDF5 files.
pub(crate) fn deeplabcut_table<'a>(_: &Path, bytes: &'a [u8]) -> Result<Cow<'a, [u8]>, Error> {
    Ok(bytes.into())
}

/// What an HDF5 file is.
pub(crate) fn description(_: &[u8]) -> String {
    "an HDF5 file (.h5, .mat, .slp), which this build does not read (feature hdf5); DeepLabCut and SLEAP also write CSV".into()
}

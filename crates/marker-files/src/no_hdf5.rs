//! Without the feature `hdf5`: HDF5 files are described, and not read.

use crate::error::Error;
use std::borrow::Cow;
use std::path::Path;

/// Programs whose HDF5 files are read with the feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Hdf5Program {
    DeepLabCut,
    Sleap,
}

/// No program: no HDF5 file is read.
pub(crate) fn program(_: &[u8]) -> Option<Hdf5Program> {
    None
}

/// The bytes unchanged; the reader of the program rejects those of HDF5 files.
pub(crate) fn as_table<'a>(
    _: &Path,
    _: Hdf5Program,
    bytes: &'a [u8],
) -> Result<Cow<'a, [u8]>, Error> {
    Ok(bytes.into())
}

/// What an HDF5 file is.
pub(crate) fn description(_: &[u8]) -> String {
    "an HDF5 file (.h5, .mat, .slp), which this build does not read (feature hdf5); DeepLabCut and SLEAP also write CSV".into()
}

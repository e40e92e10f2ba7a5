//! Recognition of C3D and HDF5 files by their first bytes, and of storage files of OpenSim by the end of their header.
//!
//! An HDF5 file begins with 8 fixed bytes ([`is_hdf5`]).
//! A C3D file has the number of its parameter block and 0x50 in the first two bytes, and the number of a processor in
//! that block ([`is_c3d`]). The header of a storage file ends with a line `endheader` ([`is_end_of_header`]).

/// Size of a block of a C3D file, bytes.
pub(crate) const C3D_BLOCK: usize = 512;
/// Second byte of a C3D file, and of its section of parameters.
pub(crate) const C3D_MARK: u8 = 0x50;
/// Numbers of the processors whose formats of numbers exist: Intel, DEC and SGI/MIPS.
const PROCESSORS: [u8; 3] = [84, 85, 86];
/// Largest number of the parameter block of a file that is recognized without a processor.
const LARGEST_BLOCK: u8 = 16;

/// First bytes of an HDF5 file.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Text of the last line of the header of a storage file of OpenSim.
const END_OF_HEADER: &str = "endheader";

/// Whether a line is the last one of the header of a storage file: `endheader`, ignoring case and spaces around it.
pub(crate) fn is_end_of_header(line: &str) -> bool {
    line.trim().eq_ignore_ascii_case(END_OF_HEADER)
}

/// Whether bytes begin as those of an HDF5 file.
pub(crate) fn is_hdf5(bytes: &[u8]) -> bool {
    bytes.starts_with(HDF5)
}

/// Whether bytes begin as those of a C3D file: the number of the parameter block (from 1, blocks of [`C3D_BLOCK`]
/// bytes) and [`C3D_MARK`]. The fourth byte of that block must be the number of a processor. If the bytes end before
/// it, the first two decide: the number is at most [`LARGEST_BLOCK`], and no white space, with which a text may begin.
pub(crate) fn is_c3d(bytes: &[u8]) -> bool {
    let [block @ 1..=u8::MAX, C3D_MARK, ..] = bytes else { return false };
    match bytes.get((usize::from(*block) - 1) * C3D_BLOCK + 3) {
        Some(processor) => PROCESSORS.contains(processor),
        None => *block <= LARGEST_BLOCK && !block.is_ascii_whitespace(),
    }
}

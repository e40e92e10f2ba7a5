//! First bytes of C3D files, and the header of storage files of OpenSim, by which they are recognized.
//!
//! A C3D file has the number of its parameter block and 0x50 in the first two bytes, and the number of a processor in that
//! block. The header of a storage file ends with a line `endheader`.

/// Size of a block of a C3D file, bytes.
pub(crate) const C3D_BLOCK: usize = 512;
/// Second byte of a C3D file, and of its section of parameters.
pub(crate) const C3D_MARK: u8 = 0x50;
/// Numbers of the processors whose formats of numbers exist: Intel, DEC and SGI/MIPS.
const PROCESSORS: [u8; 3] = [84, 85, 86];
/// Largest number of the parameter block of a file that is recognized without a processor.
const LARGEST_BLOCK: u8 = 16;

/// Text of the last line of the header of a storage file of OpenSim.
const END_OF_HEADER: &str = "endheader";

/// Whether a line is the last one of the header of a storage file.
pub(crate) fn is_end_of_header(line: &str) -> bool {
    line.trim().eq_ignore_ascii_case(END_OF_HEADER)
}

/// Whether bytes begin as those of a C3D file: the number of the parameter block and [`C3D_MARK`], with the number of a processor
/// in that block. A file that ends before is recognized by the first two bytes, unless it may be a text.
pub(crate) fn is_c3d(bytes: &[u8]) -> bool {
    let [block @ 1..=u8::MAX, C3D_MARK, ..] = bytes else { return false };
    match bytes.get((usize::from(*block) - 1) * C3D_BLOCK + 3) {
        Some(processor) => PROCESSORS.contains(processor),
        None => *block <= LARGEST_BLOCK && !block.is_ascii_whitespace(),
    }
}

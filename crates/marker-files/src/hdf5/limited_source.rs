//! The bytes of an HDF5 file as a source of `hdf5-pure`, with limits for what a damaged or hostile file can cost.
//!
//! Input are the bytes of a file. Output is a [`LimitedSource`] for the reader of the crate `hdf5-pure`, which has no
//! such limits of its own: in version 0.47 nodes of B-trees that refer to one node several times take exponential time,
//! and many links with one long name take memory of the square of the size of the file. Every structure is read through
//! this source. It returns errors when the bytes read exceed a multiple of the size of the file, for groups with long
//! names or many links, and for structures of the newer file format, which the programs do not write.

use hdf5_pure::{FormatError, Source};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bytes that may be read, per byte of the file: each structure and each data set is read a few times.
const READS: usize = 8;
/// Bytes that may be read beside them. Small files are read more often than large ones, as their structures are.
const FREE_READS: usize = 1_000_000;
/// Bytes that a read costs beside its own ones.
const COST: usize = 32;
/// Largest size of the names of a group, bytes.
const MOST_NAMES: u64 = 16_384;
/// Most links of groups that are read, counted each time.
const MOST_LINKS: usize = 8192;

/// Signatures of the structures of the newer file format: object headers, fractal heaps, B-trees of version 2,
/// extensible and fixed arrays, and shared messages.
const NEWER: [&[u8]; 17] = [
    b"OHDR", b"OCHK", b"FRHP", b"FHDB", b"FHIB", b"BTHD", b"BTIN", b"BTLF", b"EAHD", b"EAIB",
    b"EASB", b"EADB", b"FAHD", b"FADB", b"SMTB", b"SMLI", b"FSHD",
];

/// The bytes of a file, of which a limited number can be read.
pub(crate) struct LimitedSource {
    bytes: Vec<u8>,
    /// Bytes that may still be read.
    left: AtomicUsize,
    /// Links of groups that may still be read.
    links: AtomicUsize,
}

impl LimitedSource {
    /// A source of these bytes, with the limits for their number.
    pub fn new(bytes: Vec<u8>) -> Self {
        let left = bytes.len().saturating_mul(READS).saturating_add(FREE_READS);
        Self { bytes, left: left.into(), links: MOST_LINKS.into() }
    }

    /// Takes `count` from what is `left`; an error with the `reason` if there is less.
    fn spend(left: &AtomicUsize, count: usize, reason: &str) -> Result<(), FormatError> {
        let take = |left: usize| left.checked_sub(count);
        let taken = left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take);
        taken.map(drop).map_err(|_| refused(reason))
    }
}

/// The error of a file that exceeds a limit.
fn refused(reason: &str) -> FormatError {
    FormatError::Source(reason.into())
}

/// The little-endian number of `N` bytes at a place.
fn word<const N: usize>(bytes: &[u8], at: usize) -> Option<u64> {
    let mut word = [0; 8];
    word[..N].copy_from_slice(bytes.get(at..at + N)?);
    Some(u64::from_le_bytes(word))
}

impl Source for LimitedSource {
    fn len(&self) -> u64 {
        self.bytes.len() as u64
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<(), FormatError> {
        let outside = || refused("an address beyond the end of the file");
        let cost = buffer.len().saturating_add(COST);
        Self::spend(
            &self.left,
            cost,
            "structures that refer to each other more often than in a sound file",
        )?;
        let from = usize::try_from(offset).map_err(|_| outside())?;
        let to = from.checked_add(buffer.len()).ok_or_else(outside)?;
        buffer.copy_from_slice(self.bytes.get(from..to).ok_or_else(outside)?);
        if NEWER.iter().any(|signature| buffer.starts_with(signature)) {
            return Err(refused("structures of the newer file format (libver=\"latest\")"));
        }
        // A local heap has the names of a group, a symbol table its links.
        if buffer.starts_with(b"HEAP") && word::<8>(buffer, 8).is_some_and(|size| size > MOST_NAMES)
        {
            return Err(refused("a group whose names are longer than 16384 bytes"));
        }
        if let (true, Some(count)) = (buffer.starts_with(b"SNOD"), word::<2>(buffer, 6)) {
            Self::spend(&self.links, count as usize, "groups with too many members")?;
        }
        Ok(())
    }
}

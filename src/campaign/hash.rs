//! SHA-256 of bytes in lower-case hexadecimal, cut to a given number of leading bytes (two characters each).
//!
//! Input: bytes, and a length in bytes (at most 32). Output: a text of twice as many characters. Ids of tasks, digests
//! of plans, hashes of data files and checksums of stored results are such hashes. So is the hash of the mathematical
//! library in the key of the platform.

use sha2::{Digest, Sha256};

/// The first `length` bytes (at most 32) of the SHA-256 of `bytes`, as lower-case hexadecimal of `2 * length`
/// characters.
pub(crate) fn hash(bytes: &[u8], length: usize) -> String {
    Sha256::digest(bytes).iter().take(length).map(|byte| format!("{byte:02x}")).collect()
}

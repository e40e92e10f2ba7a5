//! A data set of an HDF5 file: its shape, and its elements as numbers or texts.
//!
//! Input are a file, the name of a data set and the size of the file. [`DataSet::open`] checks the size of the data
//! before anything is allocated: at most 100 times the file and 256 MB, filters deflate, shuffle and checksum only, and
//! no more chunks than the shape has. [`DataSet::numbers`] are integers or floats of any width and order of bytes as
//! `f64`, [`DataSet::texts`] texts of fixed or variable length, [`DataSet::bytes`] the elements as they are.
//! [`NumberKind`] decodes a single number. Errors are messages with the name of the data set.

use crate::hdf5::contents::reason;
use crate::printable::token;
use hdf5_pure::{Dataset, Datatype, DatatypeByteOrder, File, VlenStringReadOptions};

/// Largest size of the elements, per byte of the file; deflate compresses up to 1000 times.
const EXPANSION: u64 = 100;
/// Size of the elements that any file may have, bytes.
const FREE_DATA: u64 = 1_000_000;
/// Largest size of the elements, bytes: as text and as positions they need several times this memory.
const MOST_DATA: u64 = 256_000_000;
/// Largest number of texts of variable length, and of their bytes.
const MOST_TEXTS: usize = 100_000;
const MOST_TEXT: usize = 10_000_000;
/// Numbers of the filters deflate, shuffle and checksum (Fletcher).
const FILTERS: std::ops::RangeInclusive<u16> = 1..=3;

/// A data set whose size was checked.
pub(crate) struct DataSet {
    name: String,
    set: Dataset,
    /// Numbers of elements along its axes.
    pub shape: Vec<usize>,
    /// Type of an element.
    pub kind: Datatype,
}

impl DataSet {
    /// The data set of a file of `size` bytes, by its path in the file. An error if there is none, or if its elements
    /// would need too much memory.
    pub fn open(file: &File, name: &str, size: usize) -> Result<Self, String> {
        let named = |error| unreadable(name, error);
        let set = file.dataset(name).map_err(named)?;
        let (shape, kind) = (set.shape().map_err(named)?, set.datatype().map_err(named)?);
        let width = set.element_size().map_err(named)?;
        let most = (size as u64).saturating_mul(EXPANSION).saturating_add(FREE_DATA).min(MOST_DATA);
        let bytes = |counts: &[u64]| {
            let size = counts.iter().try_fold(width.max(1), |a, n| a.checked_mul((*n).max(1)));
            size.filter(|size| *size <= most)
        };
        let refused = |found: String, allowed: &str| {
            Err(format!("found the data set `{}` with {found}, allowed: {allowed}", token(name)))
        };
        let few = format!("up to {most} bytes in a file of {size} bytes");
        if bytes(&shape).is_none() {
            return refused(format!("the shape {shape:?} and {width} bytes per element"), &few);
        }
        if let Some(filter) = set.filters().iter().find(|filter| !FILTERS.contains(filter)) {
            return refused(
                format!("the compression {filter}"),
                "none, or 1 (deflate: complib=\"zlib\", compression=\"gzip\")",
            );
        }
        if let Some(chunk) = set.chunk_shape().map_err(named)? {
            let along = |(n, each): (&u64, &u64)| n.div_ceil((*each).max(1));
            let counts = shape.iter().zip(&chunk).map(along);
            let count = counts.clone().try_fold(1, u64::checked_mul).unwrap_or(u64::MAX);
            let all: Vec<u64> = chunk.iter().copied().chain([count]).collect();
            if bytes(&all).is_none() {
                return refused(format!("chunks of the shape {chunk:?}"), &few);
            }
            let found = set.chunks().map_err(named)?.len() as u64;
            if found > count {
                return refused(format!("{found} chunks"), &format!("{count} by its shape"));
            }
        }
        // It fits into memory.
        let shape = shape.iter().map(|n| *n as usize).collect();
        Ok(Self { name: name.into(), set, shape, kind })
    }

    /// The elements as they are in the file, in the order of the last axis first.
    pub fn bytes(&self) -> Result<Vec<u8>, String> {
        self.set.read_raw().map_err(|error| unreadable(&self.name, error))
    }

    /// The elements as numbers; an error for other types.
    pub fn numbers(&self) -> Result<Vec<f64>, String> {
        let kind = NumberKind::of(&self.kind)
            .ok_or_else(|| self.refused("no numbers", "integers or floats"))?;
        Ok(self.bytes()?.chunks_exact(kind.width).map(|bytes| kind.number(bytes)).collect())
    }

    /// The elements as texts, without zeros at their ends; an error for other types.
    pub fn texts(&self) -> Result<Vec<String>, String> {
        let limits = VlenStringReadOptions::new()
            .with_max_elements(MOST_TEXTS)
            .with_max_payload_bytes(MOST_TEXT);
        let texts = match self.kind {
            Datatype::String { .. } => self.set.read_string(),
            Datatype::VariableLength { is_string: true, .. } => self.set.read_vlen_strings(limits),
            _ => return Err(self.refused("no texts", "texts")),
        };
        texts.map_err(|error| unreadable(&self.name, error))
    }

    /// The message for a data set with another content than the allowed one.
    pub fn refused(&self, found: &str, allowed: &str) -> String {
        let (name, shape) = (token(&self.name), &self.shape);
        format!("found {found} in the data set `{name}` of the shape {shape:?}, allowed: {allowed}")
    }

    /// The attribute with this name that is a text; `None` if it is missing or something else.
    pub fn text_attribute(&self, name: &str) -> Result<Option<String>, String> {
        let all = self.set.attrs().map_err(|error| unreadable(&self.name, error))?;
        Ok(all.get(name).and_then(|value| value.as_str()).map(Into::into))
    }
}

/// The message for a data set that cannot be read.
fn unreadable(name: &str, error: hdf5_pure::Error) -> String {
    let allowed = "the data set of a file that is not damaged";
    format!("found {} at the data set `{}`, allowed: {allowed}", reason(error), token(name))
}

/// Width and representation of a number.
#[derive(Clone, Copy)]
pub(crate) struct NumberKind {
    /// Width in bytes: 1, 2, 4 or 8.
    pub width: usize,
    is_float: bool,
    is_signed: bool,
    is_big: bool,
}

impl NumberKind {
    /// The kind of an integer with all its bits, or of a float of IEEE with 4 or 8 bytes; `None` for other types.
    pub fn of(kind: &Datatype) -> Option<Self> {
        let (width, order, is_float, is_signed) = match kind {
            Datatype::FixedPoint { size: size @ (1 | 2 | 4 | 8), byte_order, layout }
                if layout.bit_offset == 0 && u32::from(layout.bit_precision) == 8 * size =>
            {
                (*size, byte_order, false, layout.signed)
            }
            Datatype::FloatingPoint { size, byte_order, layout }
                if (*size, layout.exponent_size) == (8, 11)
                    || (*size, layout.exponent_size) == (4, 8) =>
            {
                (*size, byte_order, true, true)
            }
            _ => return None,
        };
        let is_big = match order {
            DatatypeByteOrder::LittleEndian => false,
            DatatypeByteOrder::BigEndian => true,
            DatatypeByteOrder::Vax => return None,
        };
        Some(Self { width: width as usize, is_float, is_signed, is_big })
    }

    /// The number in the first bytes, as many as its width; NaN for fewer bytes.
    pub fn number(self, bytes: &[u8]) -> f64 {
        let Some(own) = bytes.get(..self.width) else { return f64::NAN };
        let mut word = [0; 8];
        for (k, byte) in own.iter().enumerate() {
            word[if self.is_big { self.width - 1 - k } else { k }] = *byte;
        }
        let word = u64::from_le_bytes(word);
        let unused = 64 - 8 * self.width as u32;
        match (self.is_float, self.is_signed) {
            (true, _) if self.width == 8 => f64::from_bits(word),
            (true, _) => f64::from(f32::from_bits(word as u32)),
            (false, true) => ((word << unused).cast_signed() >> unused) as f64,
            (false, false) => word as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_all_widths_and_orders_are_decoded() {
        let kind =
            |width, is_float, is_signed, is_big| NumberKind { width, is_float, is_signed, is_big };
        assert_eq!(kind(1, false, true, false).number(&[0xfe]), -2.0);
        assert_eq!(kind(1, false, false, false).number(&[0xfe]), 254.0);
        assert_eq!(kind(2, false, true, true).number(&[0xff, 0xfe]), -2.0);
        assert_eq!(kind(4, false, false, false).number(&[1, 2, 0, 0]), 513.0);
        assert_eq!(kind(8, false, true, false).number(&(-5i64).to_le_bytes()), -5.0);
        assert_eq!(kind(8, true, true, true).number(&1.25f64.to_be_bytes()), 1.25);
        assert_eq!(kind(4, true, true, false).number(&(-0.5f32).to_le_bytes()), -0.5);
        assert!(kind(4, true, true, false).number(&[0; 3]).is_nan());
    }
}

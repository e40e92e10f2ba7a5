//! Parameters of a C3D file: numbers and texts in groups, in little-endian form.
//!
//! The section begins with four bytes. Records follow: the length of the name (negative if it is locked), the number of
//! the group (negative for the group itself), the name, and a distance. The next record is at this distance from the
//! number that states it; a distance of 0 or a name of length 0 ends the section. A parameter has the type of its
//! values (-1 text, 1 byte, 2 integer, 4 float), the number of dimensions, their sizes and the values. Input are the
//! bytes of the file and the place of the section ([`Parameters::read`]). Output are the first number, the texts, or
//! the number of 32 bits in two integers (`long`) of a parameter by the names, in upper case, of its group and of
//! itself; nothing if it is missing. Records that lie outside of the file are errors as messages. Parameters of another
//! type, with more than seven dimensions, or with values that do not end are ignored. [`word`] and [`float`] read
//! single numbers at a place.

use std::collections::HashMap;

/// Largest number of dimensions of a parameter.
const MOST_DIMENSIONS: usize = 7;

/// The two bytes at a place, counted from 0, as a little-endian number without sign; `None` beyond the end.
pub(super) fn word(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?))
}

/// The four bytes at a place, counted from 0, as a little-endian float; `None` beyond the end.
pub(super) fn float(bytes: &[u8], at: usize) -> Option<f32> {
    Some(f32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

/// The values of a parameter.
struct StoredParameter<'a> {
    /// Type of the values: -1 for characters, else their size in bytes.
    kind: i8,
    /// Number of characters of a text, 1 for numbers.
    length: usize,
    values: &'a [u8],
}

/// The parameters of a file by the number of the group and the name.
pub(super) struct Parameters<'a> {
    groups: HashMap<String, u8>,
    parameters: HashMap<(u8, String), StoredParameter<'a>>,
}

impl<'a> Parameters<'a> {
    /// Reads the parameters of the section that begins at the byte `section` of a file. Parameters of an unknown type,
    /// or whose values do not end, are ignored. The error, for a record outside of the file, is a message.
    pub fn read(bytes: &'a [u8], section: usize) -> Result<Self, String> {
        let (mut groups, mut parameters) = (HashMap::new(), HashMap::new());
        let mut at = section + 4;
        let cut =
            || "found parameters that do not end, allowed: a file that is not cut off".to_string();
        loop {
            let &[length, group, ..] = bytes.get(at..).ok_or_else(cut)? else { return Err(cut()) };
            let length = usize::from(length.cast_signed().unsigned_abs());
            if length == 0 {
                break;
            }
            let name = bytes.get(at + 2..at + 2 + length).ok_or_else(cut)?;
            let name = String::from_utf8_lossy(name).to_uppercase();
            let distance = word(bytes, at + 2 + length).ok_or_else(cut)?;
            let content = at + 4 + length;
            let group = group.cast_signed();
            match group < 0 {
                true => drop(groups.insert(name, group.unsigned_abs())),
                false => {
                    if let Some(parameter) =
                        StoredParameter::read(bytes.get(content..).ok_or_else(cut)?)
                    {
                        parameters.insert((group.unsigned_abs(), name), parameter);
                    }
                }
            }
            if distance == 0 {
                break;
            }
            at += 2 + length + usize::from(distance);
        }
        Ok(Self { groups, parameters })
    }

    /// The parameter with a name in a group, both in upper case; `None` if the file does not have it.
    fn get(&self, group: &str, name: &str) -> Option<&StoredParameter<'a>> {
        self.parameters.get(&(*self.groups.get(group)?, name.into()))
    }

    /// The first number of a parameter; integers are without sign. `None` if it is missing, empty or a text.
    pub fn number(&self, group: &str, name: &str) -> Option<f64> {
        let StoredParameter { kind, values, .. } = self.get(group, name)?;
        match kind {
            4 => float(values, 0).map(f64::from),
            2 => word(values, 0).map(f64::from),
            1 => values.first().map(|byte| f64::from(*byte)),
            _ => None,
        }
    }

    /// The number of 32 bits that the first two integers of a parameter form, the lower one first; a missing second one
    /// is 0. `None` if the parameter is missing, empty or has another type.
    pub fn long(&self, group: &str, name: &str) -> Option<u64> {
        let StoredParameter { kind: 2, values, .. } = self.get(group, name)? else { return None };
        let high = word(values, 2).unwrap_or(0);
        Some(u64::from(word(values, 0)?) + (u64::from(high) << 16))
    }

    /// The texts of a parameter, without spaces and zeros around them; none if it is missing or no text.
    pub fn texts(&self, group: &str, name: &str) -> Vec<String> {
        let Some(StoredParameter { kind: -1, length, values }) = self.get(group, name) else {
            return Vec::new();
        };
        let text = |bytes: &[u8]| {
            let text = String::from_utf8_lossy(bytes);
            text.trim_matches(|c: char| c == '\0' || c.is_whitespace()).to_string()
        };
        values.chunks((*length).max(1)).map(text).collect()
    }
}

impl<'a> StoredParameter<'a> {
    /// The parameter at the beginning of bytes: type, sizes and values. `None` for an unknown type, more than
    /// [`MOST_DIMENSIONS`] dimensions, or values that do not end.
    fn read(bytes: &'a [u8]) -> Option<Self> {
        let &[kind, dimensions, ..] = bytes else { return None };
        let kind = kind.cast_signed();
        let count = usize::from(dimensions);
        if count > MOST_DIMENSIONS || ![-1, 1, 2, 4].contains(&kind) {
            return None;
        }
        let sizes = bytes.get(2..2 + count)?;
        let total =
            sizes.iter().try_fold(1usize, |all, size| all.checked_mul(usize::from(*size)))?;
        let total = total.checked_mul(usize::from(kind.unsigned_abs()))?;
        let values = bytes.get(2 + count..(2 + count).checked_add(total)?)?;
        let length = sizes.first().map_or(1, |size| usize::from(*size));
        Some(Self { kind, length, values })
    }
}

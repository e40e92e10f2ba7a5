//! Files of pictures: kind, width and height of a PNG or JPEG, which is not decoded.
//!
//! Input: the path of a file of at most [`MOST_BYTES`]. Output: [`ImageFile`] with its bytes, as pages embed them. Kind
//! and size are those in the header, whatever the name. Other kinds, sides of zero or more than [`LONGEST_SIDE`] px,
//! and JPEGs that a viewer rotates (by the orientation in Exif) are errors: tracking programs use either
//! orientation for their pixel coordinates. Broken headers are errors, and never panic.

use crate::error::Error;
use std::path::Path;

/// Largest file of a picture, bytes, which is also the largest sum of all pictures of a page.
pub(crate) const MOST_BYTES: u64 = 10_000_000;
/// Longest side of a picture, px. A small file may claim a size that no browser can show.
const LONGEST_SIDE: usize = 20_000;
/// Tag of the orientation in Exif.
const ORIENTATION: u32 = 0x0112;

/// A picture with the bytes of its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ImageFile {
    /// Media type: `image/png` or `image/jpeg`.
    pub media_type: &'static str,
    /// Width and height, px.
    pub size: [u32; 2],
    /// The file.
    pub bytes: Vec<u8>,
}

/// The picture in the file at `path`. `key` is the key of the fit file that names it. Errors: a file that cannot be
/// read or is larger than [`MOST_BYTES`]; a file that is no picture of the allowed kinds, with the key.
pub(crate) fn read_image(path: &Path, key: &str) -> Result<ImageFile, Error> {
    let bytes = marker_files::file::limited(path, MOST_BYTES)?;
    let (media_type, size) = recognize(&bytes).map_err(|found| {
        let found = format!("{}: {found}", path.display());
        Error::invalid(
            key,
            found,
            format!("PNG or JPEG up to {LONGEST_SIDE} px wide and high, upright"),
        )
    })?;
    Ok(ImageFile { media_type, size, bytes })
}

/// Media type, and width and height in px, of a picture by its first bytes. An error with what was found instead.
pub(crate) fn recognize(bytes: &[u8]) -> Result<(&'static str, [u32; 2]), String> {
    let (media_type, width, height) = dimensions(bytes)?;
    let side =
        |side: usize| u32::try_from(side).ok().filter(|_| (1..=LONGEST_SIDE).contains(&side));
    let (Some(width), Some(height)) = (side(width), side(height)) else {
        return Err(format!("{width} x {height} px"));
    };
    match exif_orientation(bytes).filter(|_| media_type == "image/jpeg") {
        None | Some(1) => Ok((media_type, [width, height])),
        Some(other) => Err(format!(
            "a JPEG with the orientation {other}, which viewers rotate. Save it upright, and track it in this picture"
        )),
    }
}

/// Media type, width and height of a PNG or JPEG by its header; else what was found.
#[cfg(feature = "page")]
fn dimensions(bytes: &[u8]) -> Result<(&'static str, usize, usize), String> {
    let media_type = match imagesize::image_type(bytes) {
        Ok(imagesize::ImageType::Png) => "image/png",
        Ok(imagesize::ImageType::Jpeg) => "image/jpeg",
        _ => return Err("another kind of file".into()),
    };
    match imagesize::blob_size(bytes) {
        Ok(size) => Ok((media_type, size.width, size.height)),
        Err(_) => Err(format!("a broken header of {media_type}")),
    }
}

/// Without pages no picture is read.
#[cfg(not(feature = "page"))]
fn dimensions(_: &[u8]) -> Result<(&'static str, usize, usize), String> {
    Err("a picture in a build without the feature page".into())
}

/// The orientation of a JPEG by its Exif segment (1 is upright); `None` without a valid one.
fn exif_orientation(bytes: &[u8]) -> Option<u32> {
    let mut rest = bytes.strip_prefix(b"\xff\xd8")?;
    // Segments up to the start of the image data: marker, length with its own two bytes, content.
    while let [0xff, next, ..] = *rest {
        // Any number of fill bytes may precede a marker.
        if next == 0xff {
            rest = &rest[1..];
            continue;
        }
        let [_, marker @ 0xc0..=0xfe, high, low, ..] = *rest else { return None };
        let length = usize::from(u16::from_be_bytes([high, low]));
        let segment = rest.get(4..2 + length)?;
        match (marker, segment.strip_prefix(b"Exif\0\0")) {
            (0xe1, Some(tiff)) => return tiff_orientation(tiff),
            (0xda, _) => return None,
            _ => rest = rest.get(2 + length..)?,
        }
    }
    None
}

/// The orientation in the first directory of a TIFF header, of either byte order.
fn tiff_orientation(tiff: &[u8]) -> Option<u32> {
    let is_little = match tiff.get(..2)? {
        b"II" => true,
        b"MM" => false,
        _ => return None,
    };
    let number = |at: usize, bytes: usize| -> Option<u32> {
        let own = tiff.get(at..at.checked_add(bytes)?)?;
        let digits = |value: u32, byte: &u8| value << 8 | u32::from(*byte);
        Some(match is_little {
            true => own.iter().rev().fold(0, digits),
            false => own.iter().fold(0, digits),
        })
    };
    let directory = usize::try_from(number(4, 4)?).ok()?;
    // An entry has 12 bytes; the value of a short is in the first two of the last four.
    let entry = |k: u32| directory.checked_add(2 + 12 * k as usize);
    let own = (0..number(directory, 2)?)
        .find(|k| entry(*k).and_then(|at| number(at, 2)).is_some_and(|tag| tag == ORIENTATION))?;
    number(entry(own)?.checked_add(8)?, 2)
}

#[cfg(test)]
#[cfg(feature = "page")]
mod tests {
    use super::*;

    /// The header of a PNG.
    fn png(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
        bytes.extend(width.to_be_bytes());
        bytes.extend(height.to_be_bytes());
        bytes.extend([8, 2, 0, 0, 0, 0, 0, 0, 0]);
        bytes
    }

    /// The header of a JPEG, with an orientation in Exif of this byte order.
    fn jpeg(orientation: Option<(u8, &[u8; 2])>) -> Vec<u8> {
        let mut bytes = b"\xff\xd8".to_vec();
        if let Some((orientation, order)) = orientation {
            let number = |value: u32, size: usize| match order {
                b"II" => value.to_le_bytes()[..size].to_vec(),
                _ => value.to_be_bytes()[4 - size..].to_vec(),
            };
            let mut tiff = order.to_vec();
            tiff.extend(number(42, 2));
            tiff.extend(number(8, 4));
            tiff.extend(number(1, 2));
            tiff.extend(number(ORIENTATION, 2));
            tiff.extend(number(3, 2));
            tiff.extend(number(1, 4));
            tiff.extend(number(orientation.into(), 2));
            tiff.extend([0, 0]);
            bytes.extend(b"\xff\xe1");
            bytes.extend((tiff.len() as u16 + 8).to_be_bytes());
            bytes.extend(b"Exif\0\0");
            bytes.extend(tiff);
        }
        bytes.extend(b"\xff\xc0\0\x11\x08\0\x30\0\x40\x03\x01\x22\0\x02\x11\x01\x03\x11\x01");
        bytes
    }

    #[test]
    fn size_and_kind_are_those_of_the_header() {
        assert_eq!(recognize(&png(640, 480)), Ok(("image/png", [640, 480])));
        assert_eq!(recognize(&jpeg(None)), Ok(("image/jpeg", [64, 48])));
        for order in [b"II", b"MM"] {
            assert_eq!(recognize(&jpeg(Some((1, order)))), Ok(("image/jpeg", [64, 48])));
            let rotated = recognize(&jpeg(Some((6, order)))).unwrap_err();
            assert!(rotated.contains("orientation 6"), "{rotated}");
        }
        for wrong in
            [&b""[..], b"GIF89a\x01\0\x01\0", b"<svg xmlns='..'>", &png(0, 5), &png(20_001, 5)]
        {
            assert!(recognize(wrong).is_err(), "{wrong:?}");
        }
    }

    /// JPEG allows any number of fill bytes 0xff before a marker.
    #[test]
    fn orientation_is_found_behind_fill_bytes() {
        let mut filled = jpeg(Some((6, b"II")));
        filled.splice(2..2, [0xff, 0xff]);
        assert_eq!(exif_orientation(&filled), Some(6));
    }

    #[test]
    fn truncated_and_changed_headers_are_errors_or_sizes() {
        for whole in [png(64, 48), jpeg(Some((6, b"II"))), jpeg(Some((3, b"MM")))] {
            for end in 0..whole.len() {
                let _ = recognize(&whole[..end]);
                for value in [0, 1, 0x7f, 0xff] {
                    let mut changed = whole.clone();
                    changed[end] = value;
                    let _ = recognize(&changed);
                }
            }
        }
    }
}

//! Descriptions of files that cannot be read as tables of markers, for error messages.
//!
//! Input are the path and the bytes of a file, in general the first 4096. Binary files are recognized by their first
//! bytes (zip, HDF5, C3D, video and others) or a zero byte. Texts are recognized by their first lines: TOML, JSON, XML,
//! no header, columns separated by spaces, and for tables of positions accelerations. Output: an error with the kind of
//! file and the kinds that are read ([`check_text`] for binary files, [`describe_table`] and
//! [`describe_position_table`] for texts). For a text that is none of these it is the error that the reader had.

use crate::error::Error;
use crate::format::Format;
use crate::hdf5;
use crate::signatures::{is_c3d, is_hdf5};
use std::path::Path;

/// Number of bytes at the beginning of a file that are examined.
const EXAMINED: usize = 4096;

/// First bytes of binary files, with their descriptions.
const BINARY: [(&[u8], &str); 18] = [
    (
        b"PK\x03\x04",
        "a zip archive, such as a spreadsheet (.xlsx, .ods; save it as CSV) or a Capture file (.cap)",
    ),
    (b"MATLAB 5.0", "a MATLAB file (.mat)"),
    (b"\xd0\xcf\x11\xe0", "an old Office file (.xls)"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"7z\xbc\xaf", "a 7z archive"),
    (b"SQLite format 3", "an SQLite database"),
    (b"%PDF", "a PDF document"),
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"\x93NUMPY", "a NumPy array (.npy)"),
    (b"\x1aE\xdf\xa3", "a video (.mkv, .webm)"),
    (b"Kaydara FBX", "an animation (.fbx)"),
    (b"TDSm", "a LabVIEW file (.tdms)"),
    (b"HIERARCHY", "a skeleton with its motion (.bvh)"),
    (b"RIFF", "a video or sound (.avi, .wav)"),
    (b"PAR1", "a Parquet file"),
    (b"\xff\xfe", "UTF-16 text"),
    (b"\xfe\xff", "UTF-16 text"),
];
/// Rejects binary files, by their first bytes or a zero among the first 4096, with an error that has their kind and the
/// files that are read. Texts are accepted.
pub(crate) fn check_text(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    match binary(bytes) {
        Some(_) if is_zip_of_tables(bytes) => Err(unknown(
            path,
            "a zip archive of CSV tables, as phyphox exports; unpack it and name the table, such as Raw Data.csv",
        )),
        Some(found) => Err(unknown(path, found)),
        None if is_hdf5(bytes) => Err(unknown(path, &hdf5::description(bytes))),
        None => Ok(()),
    }
}

/// The error of a file that could not be read as a table: the description of its kind, if its first lines show that it
/// is no table with a header, else `error` unchanged.
pub(crate) fn describe_table(path: &Path, bytes: &[u8], error: Error) -> Error {
    match text(bytes) {
        Some(found) => unknown(path, &found),
        None => error,
    }
}

/// The error of a file that could not be read as a table of positions: the description of its kind, if it is no table
/// with a header. Else it is an error on accelerations if its header names them, or `error` unchanged.
pub(crate) fn describe_position_table(path: &Path, bytes: &[u8], error: Error) -> Error {
    match text(bytes) {
        Some(found) => unknown(path, &found),
        None if has_accelerations(bytes) => accelerations(path),
        None => error,
    }
}

/// The error of a table of accelerations that is to be read as positions.
pub(crate) fn accelerations(path: &Path) -> Error {
    Error::Accelerations { path: path.into(), allowed: readable_files() }
}

/// The error of a file with the description `found`, in line 1; the message also has the kinds of files that are read.
fn unknown(path: &Path, found: &str) -> Error {
    Error::data(path, 1, format!("found {found}, allowed: {}", readable_files()))
}

/// The kinds of files that are read, as text for messages.
fn readable_files() -> String {
    let programs: Vec<&str> =
        Format::ALL.iter().filter(|f| **f != Format::Csv).map(|f| f.program()).collect();
    format!(
        "a table (a header such as `t,x,y`, with commas, semicolons, tabs or spaces, or the key columns), or an \
         export of {}",
        programs.join(", ")
    )
}

/// The description of a binary file by its first bytes ([`BINARY`], C3D, MP4), or `a binary file` with a zero among the
/// first 4096; `None` for a text.
fn binary(bytes: &[u8]) -> Option<&'static str> {
    if let Some((_, found)) = BINARY.iter().find(|(start, _)| bytes.starts_with(start)) {
        return Some(found);
    }
    match bytes {
        // Described by their data sets.
        _ if is_hdf5(bytes) => None,
        _ if is_c3d(bytes) => Some("a C3D file"),
        [_, _, _, _, b'f', b't', b'y', b'p', ..] => Some("a video (.mp4, .mov)"),
        _ if bytes.iter().take(EXAMINED).any(|b| *b == 0) => Some("a binary file"),
        _ => None,
    }
}

/// Whether bytes begin as a zip archive whose first file is a table: its name, at byte 30, ends with .csv or .txt.
fn is_zip_of_tables(bytes: &[u8]) -> bool {
    let (true, Some([low, high])) = (bytes.starts_with(b"PK\x03\x04"), bytes.get(26..28)) else {
        return false;
    };
    let length = usize::from(u16::from_le_bytes([*low, *high]));
    let Some(name) = bytes.get(30..30 + length) else { return false };
    [&b".csv"[..], b".txt"].iter().any(|ending| name.to_ascii_lowercase().ends_with(ending))
}

/// The description of a text that is no table with a header, by its first two lines that are neither blank nor
/// comments. Described are TOML, JSON, XML or HTML, numbers without a header, and columns with spaces between them
/// below another number of names. `None` for other texts, for no text, and for a first line that does not end within
/// the examined bytes.
fn text(bytes: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(EXAMINED)]).to_lowercase();
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#'));
    let (first, second) = (lines.next()?, lines.next().unwrap_or(""));
    // A line without an end has another error.
    if bytes.len() > EXAMINED && second.is_empty() {
        return None;
    }
    let separated = |line: &str| line.contains([',', ';', '\t']);
    let is_number = |field: &str| field.trim().trim_matches('"').parse::<f64>().is_ok();
    let spaced = |line: &str| !separated(line) && line.split_whitespace().count() > 1;
    if is_toml(first) {
        return Some("a TOML file, such as a scene or a fit file".into());
    }
    if first.starts_with(['{', '[']) {
        return Some("a JSON file".into());
    }
    if first.starts_with('<') {
        return Some("an XML or HTML file".into());
    }
    if first.split([',', ';', '\t']).all(is_number)
        || spaced(first) && first.split_whitespace().all(is_number)
    {
        return Some(
            "no header, but numbers in the first line; state the columns, as columns = { t = 1, x = 2, y = 3 }".into(),
        );
    }
    // A title may stand above columns with spaces. Equally many names and columns are a table, which has another error.
    if spaced(second)
        && !separated(first)
        && first.split_whitespace().count() != second.split_whitespace().count()
    {
        return Some("columns with spaces between them below another number of names".into());
    }
    None
}

/// Whether a line in lower case is the header of a TOML table, as `[rod]` or `[[rods]]`, or a key with a value after a
/// spaced equals sign, as `model = "planar"`.
fn is_toml(line: &str) -> bool {
    let is_key = |text: &str| {
        text.starts_with(|c: char| c.is_ascii_lowercase())
            && text
                .chars()
                .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "_-.".contains(c))
    };
    let line = line.split('#').next().unwrap_or("").trim();
    let table = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let name =
        table.map(|name| name.strip_prefix('[').and_then(|n| n.strip_suffix(']')).unwrap_or(name));
    name.is_some_and(|name| is_key(name.trim()))
        || line
            .split_once(" = ")
            .is_some_and(|(key, value)| is_key(key.trim()) && !value.is_empty())
}

/// Whether a column in the header of a text is one of accelerations, ignoring case. Its name is then `ax`, `ay` or
/// `az`, or it contains `accel` or a unit m/s^2. The header is the first line that is neither blank nor a comment.
fn has_accelerations(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(EXAMINED)]).to_lowercase();
    let mut lines = text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#'));
    let Some(header) = lines.next() else { return false };
    let mut fields = header.split([',', ';', '\t']).map(|field| field.trim().trim_matches('"'));
    // The unit counts too, as columns may have any name.
    fields.any(|field| {
        ["accel", "m/s^2", "m/s\u{b2}", "m/s2"].iter().any(|word| field.contains(word))
            || ["ax", "ay", "az"].contains(&field.split(['[', '(']).next().unwrap_or("").trim())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_without_a_reader_are_described() {
        for (bytes, words) in [
            (&b"PK\x03\x04\x14\0"[..], "a zip archive"),
            (b"\x89HDF\r\n\x1a\n\0\0", "an HDF5 file"),
            (b"\x02P\x0f\0\x01\0", "a C3D file"),
            (b"\xff\xfet\0,\0x\0", "UTF-16 text"),
            (b"\0\0\0\x18ftypmp42", "a video"),
            (b"\x1aE\xdf\xa3\x01", "a video"),
            (b"TDSm\x0e", "a LabVIEW file"),
            (b"HIERARCHY\nROOT Hips\n", "a skeleton"),
            (b"t\0x", "a binary file"),
        ] {
            let error = check_text(Path::new("a.c3d"), bytes).unwrap_err().to_string();
            assert!(error.contains(words) && error.contains("OptiTrack Motive"), "{error}");
        }
        for (content, words) in [
            ("0,0.5,0\n0.01,0.5,0\n", "no header"),
            ("0.0 0.5 0\n0.01 0.5 0\n", "no header"),
            ("t x y\n0.0 0.5\n", "spaces between"),
            ("mass_A\nt x y\n0.0 0.5 0\n", "spaces between"),
            ("{\"t\": [0, 1]}\n", "a JSON file"),
            ("[1, 2]\n", "a JSON file"),
            ("# A rod.\n[rod] # of steel\nsegments = 5\n", "a TOML file"),
            ("[[experiment]]\nscene = \"a.toml\"\n", "a TOML file"),
            ("model = \"planar\"\n", "a TOML file"),
        ] {
            let found = text(content.as_bytes()).unwrap_or_default();
            assert!(found.contains(words), "{content}: {found}");
        }
        for content in
            ["\"Time (s)\";\"Linear Acceleration x (m/s^2)\"\n0,0E0;1,2E-1\n", "t,ax,ay\n"]
        {
            assert!(has_accelerations(content.as_bytes()), "{content}");
        }
    }

    #[test]
    fn tables_are_not_described() {
        for content in ["t,x,y\n0,1,2\n", "t\n0\n", "t[s]\tx[mm]\n0\t1\n", "dear diary\n", ""] {
            assert!(check_text(Path::new("a.csv"), content.as_bytes()).is_ok(), "{content}");
            assert_eq!(text(content.as_bytes()), None, "{content}");
        }
    }
}

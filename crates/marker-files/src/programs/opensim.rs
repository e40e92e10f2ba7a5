//! Reader of storage files of OpenSim (STO and MOT): frames by time in seconds, and points as markers.
//!
//! Lines up to `endheader` are a title, keys with values, and text. Below are the names of the columns, beginning with
//! `time`, and the rows, with tabs or spaces between the columns. With `DataType=Vec3` every column is a marker with
//! three numbers. Otherwise a marker has the columns `NAME_X, NAME_Y, NAME_Z` (points and bodies), or `NAME_tx,
//! NAME_ty, NAME_tz` (coordinates of joints); other columns, such as angles and forces, are skipped. The unit is that
//! of the key `Units`, or m if the text states S.I. units; without both it is not known. Files of velocities or
//! accelerations, data types other than numbers and Vec3, other units, and files without `endheader`, `time` or a
//! position are errors.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{
    Clock, ColumnKind, ColumnLayout, FieldLine, FieldLines, LengthUnit, MarkerFile, length_unit,
};
use crate::separator::with_tabs;
use crate::signatures::is_end_of_header;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

/// Reads the bytes of a storage file into frames by time, s, and points as markers; `path` is for messages. An error
/// for a file without `endheader`, without positions, with velocities, accelerations or other types, and for unknown
/// units.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let mut all = bytes.split_inclusive(|b| *b == b'\n');
    let is_end = |line: &[u8]| line.trim_ascii().eq_ignore_ascii_case(b"endheader");
    let names = all
        .by_ref()
        .find(|line| is_end(line))
        .and_then(|_| all.find(|line| !line.trim_ascii().is_empty()));
    let is_vector_type = |line: &[u8]| line.trim_ascii().eq_ignore_ascii_case(b"DataType=Vec3");
    let header = bytes.split(|b| *b == b'\n').take_while(|line| !is_end(line));
    let are_vectors = header.into_iter().any(is_vector_type);
    let mut content = Cow::Borrowed(bytes);
    // Without tabs between the names spaces separate the columns; in vectors commas separate the numbers.
    if !names.unwrap_or_default().contains(&b'\t') {
        content = with_tabs(&content).into();
    }
    if are_vectors {
        content = content.iter().map(|b| if *b == b',' { b'\t' } else { *b }).collect();
    }
    let lines = FieldLines::new(path, Format::Sto, &content, b'\t')?;
    let Some(end) = lines.list.iter().position(|l| is_end_of_header(l.field(0))) else {
        return lines.rejected(
            1,
            "no line `endheader`",
            "such a line above the names of the columns",
        );
    };
    let (header, below) = (&lines.list[..end], &lines.list[end + 1..]);
    check_content(&lines, header)?;
    let lengths = unit(&lines, header)?;
    let Some((names, rows)) = below.split_first() else {
        return lines.rejected(lines.list[end].number, "nothing below `endheader`", "a table");
    };
    if !names.field(0).eq_ignore_ascii_case("time") {
        let found = format!("`{}` as the first column", names.field(0));
        return lines.rejected(names.number, &found, "`time`");
    }
    let mut layout = ColumnLayout::new(&lines, names.number);
    let named = names.fields().enumerate().skip(1).filter(|(_, name)| !name.is_empty());
    let mut width = names.len();
    if are_vectors {
        width = 1;
        for (_, name) in named {
            for axis in 0..3 {
                layout.add(width + axis, name, ColumnKind::Axis(axis))?;
            }
            width += 3;
        }
    } else {
        let found: Vec<(usize, &str, usize)> = named
            .filter_map(|(k, name)| position(name).map(|(own, axis)| (k, own, axis)))
            .collect();
        // A joint may have a coordinate along one axis only: it is no point.
        let mut axes: HashMap<&str, [bool; 3]> = HashMap::new();
        for (_, name, axis) in &found {
            axes.entry(name).or_default()[*axis] = true;
        }
        for (column, name, axis) in found {
            if axes[name][..2] == [true; 2] {
                layout.add(column, name, ColumnKind::Axis(axis))?;
            }
        }
    }
    if layout.is_empty() {
        return lines.rejected(
            names.number,
            "no column with a position",
            "columns NAME_X and NAME_Y, or NAME_tx and NAME_ty, or DataType=Vec3",
        );
    }
    let time = |_, line: &FieldLine| lines.required_number(line, 0, "time");
    let table = layout.read(width, rows.iter().filter(|l| !l.is_empty()), time)?;
    Ok(lines.file(Clock::Time(1.0), lengths, table))
}

/// Name of the point and index of the axis of a column with a coordinate: `NAME_X` or `NAME_tx`, of joints also with
/// `/value` behind; `None` for others.
fn position(column: &str) -> Option<(&str, usize)> {
    let (name, ending) = column.strip_suffix("/value").unwrap_or(column).rsplit_once('_')?;
    let axis = ["X", "Y", "Z"].iter().zip(["tx", "ty", "tz"]);
    let axis = axis.into_iter().position(|(point, joint)| ending == *point || ending == joint)?;
    (!name.is_empty()).then_some((name, axis))
}

/// The value of a key in the lines of a header, with its line: the text behind `=` after the key, ignoring the case of
/// the key. `None` without it.
fn value<'a>(header: &'a [FieldLine], key: &str) -> Option<(u64, &'a str)> {
    header.iter().find_map(|line| {
        let (own, value) = line.field(0).split_once('=')?;
        own.trim().eq_ignore_ascii_case(key).then_some((line.number, value.trim()))
    })
}

/// Rejects files whose title (first line) names velocities, speeds or accelerations, and values of the key `DataType`
/// other than `double` and `Vec3`.
fn check_content(lines: &FieldLines, header: &[FieldLine]) -> Result<(), Error> {
    let title = header.first().map_or(String::new(), |line| line.field(0).to_lowercase());
    // Analyses write `Velocities`, `PointVelocity`, `Speeds` and the like, with the names of the positions.
    let derivatives =
        [("velocit", "velocities"), ("speeds", "velocities"), ("accelerat", "accelerations")];
    if let Some((_, found)) = derivatives.iter().find(|(word, _)| title.contains(word)) {
        return lines.rejected(1, found, "positions");
    }
    match value(header, "DataType") {
        Some((line, own)) if !["double", "vec3"].contains(&&own.to_lowercase()[..]) => {
            lines.rejected(line, &format!("DataType={own}"), "double or Vec3")
        }
        _ => Ok(()),
    }
}

/// The unit of length of a file: that of the key `Units`, else m if the header states S.I. units, else that of a
/// calibration. An error for another value of the key.
fn unit(lines: &FieldLines, header: &[FieldLine]) -> Result<LengthUnit, Error> {
    if let Some((line, stated)) = value(header, "Units") {
        return match length_unit(stated) {
            Some(unit) => Ok(unit),
            None => lines.rejected(line, &format!("Units={stated}"), "um, mm, cm or m"),
        };
    }
    let is_si = header.iter().any(|line| line.field(0).contains("S.I. units"));
    Ok(if is_si { LengthUnit::Known("m", 1.0) } else { LengthUnit::Calibrated })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_positions_have_their_point() {
        for (column, found) in [
            ("toe_X", Some(("toe", 0))),
            ("pelvis_ty", Some(("pelvis", 1))),
            ("/jointset/base/base_tz/value", Some(("/jointset/base/base", 2))),
            ("toe_Ox", None),
            ("ground_force_vx", None),
            ("/jointset/base/base_tz/speed", None),
            ("_X", None),
        ] {
            assert_eq!(position(column), found, "{column}");
        }
    }
}

//! Reader of TSV exports of Qualisys Track Manager: frames by number, with their rate, and positions in mm.
//!
//! Keys with values come first, among them `FREQUENCY` (frames per second) and `MARKER_NAMES`, then x, y and z of each
//! marker. The frame number, or the frame number and the time, may precede them, and the names of the columns may be
//! above. Frames without a number are counted from 1. Missing coordinates are empty; a position of three zeros is
//! missing. A file without these keys or a positive rate, data other than 3D, and another number of columns are errors.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{
    Clock, ColumnKind, ColumnLayout, FieldLine, FieldLines, LengthUnit, MarkerFile,
};
use std::path::Path;

/// Reads the bytes of a file of Qualisys into frames by number, with their rate, and positions in mm; `path` is for
/// messages. Frames without a number are counted from 1. Positions of three zeros are missing. An error without
/// `MARKER_NAMES` or `FREQUENCY`, and for data other than 3D. Rows must have three columns per marker, after at most a
/// frame number and a time.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let lines = FieldLines::new(path, Format::Qualisys, bytes, b'\t')?;
    let named = lines.list.iter().position(|l| l.field(0) == "MARKER_NAMES");
    let types = |l: &FieldLine| l.field(0) == "TRAJECTORY_TYPES";
    let header =
        named.map_or(0, |at| at + 1 + usize::from(lines.list.get(at + 1).is_some_and(types)));
    let key = |name: &str| lines.list[..header].iter().find(|l| l.field(0) == name);
    let Some(called) = key("MARKER_NAMES") else {
        return lines.rejected(
            1,
            "no line `MARKER_NAMES`",
            "this line. Export the file with the header switched on",
        );
    };
    let Some(rate) = key("FREQUENCY") else {
        return lines.rejected(
            1,
            "no line `FREQUENCY`",
            "this line. Export the file with the \
                                  header switched on",
        );
    };
    if let Some(data) = key("DATA_INCLUDED").filter(|l| l.field(1) != "3D") {
        return lines.rejected(data.number, &format!("DATA_INCLUDED `{}`", data.field(1)), "3D");
    }
    let per_second = lines.rate(rate, 1, "FREQUENCY")?;
    let names: Vec<&str> = called.fields().skip(1).filter(|name| !name.is_empty()).collect();
    let mut rows = &lines.list[header..];
    // The names of the columns.
    if let [first, rest @ ..] = rows
        && first.field(0).parse::<f64>().is_err()
        && !first.field(0).is_empty()
    {
        rows = rest;
    }
    // The frame number and the time may precede the positions, and a tab may end each line.
    let found = rows.first().map_or(0, FieldLine::len);
    let tab = found > 0 && rows.iter().all(|l| l.field(found - 1).is_empty());
    let columns = match found.saturating_sub(3 * names.len()) {
        1 | 3 if tab => found - 1,
        _ => found,
    };
    let before = columns.saturating_sub(3 * names.len());
    if columns < 3 * names.len() || before > 2 {
        let line = rows.first().map_or(called.number, |line| line.number);
        let found = format!("{columns} columns for {} markers", names.len());
        return lines.rejected(
            line,
            &found,
            "three columns for each marker, after at most a frame number and a time",
        );
    }
    let mut layout = ColumnLayout::new(&lines, called.number);
    for (k, name) in names.iter().enumerate() {
        for axis in 0..3 {
            layout.add(before + 3 * k + axis, name, ColumnKind::Axis(axis))?;
        }
    }
    // A frame number, if there is one, is the first column.
    let frame = |k: usize, line: &FieldLine| match before {
        0 => Ok((k + 1) as f64),
        _ => lines.required_number(line, 0, "Frame"),
    };
    let rows = rows.iter();
    let mut table = layout.read(columns, rows, frame)?;
    // Three zeros mark a missing position.
    for position in table.markers.iter_mut().flat_map(|m| &mut m.positions) {
        if *position == [Some(0.0); 3] {
            *position = [None; 3];
        }
    }
    let clock = Clock::Frames { first: 1.0, rate: Some(per_second) };
    let lengths = LengthUnit::Known("mm", 1e-3);
    Ok(lines.file(clock, lengths, table))
}

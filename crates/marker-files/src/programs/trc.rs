//! Reader of TRC files, the text format of Motion Analysis, also written by OpenSim, Pose2Sim and Mokka.
//!
//! Keys and values are in two lines, among them `Units` (um, mm, cm or m). Then follow `Frame#`, `Time` and the names
//! of the markers, each above the first of its three columns, then `X1 Y1 Z1` and so on. Separators are tabs, commas or
//! semicolons. Output: frames by time in s, and markers in the unit of the file; blank and NaN positions are missing. A
//! file without a known unit, `Frame#`, `Time`, a marker or a row is an error. So are another number of columns, a
//! marker named twice, texts in place of numbers, and times that are blank or do not increase.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{
    Clock, ColumnKind, ColumnLayout, FieldLine, FieldLines, MarkerFile, length_unit,
};
use crate::table::delimiter;
use std::path::Path;

/// Number of columns in front of the first marker: the frame number and the time.
const BEFORE: usize = 2;

/// Reads the bytes of a TRC file into frames by time, s, and markers; `path` is for messages. The unit of length is
/// that of the key `Units`. The line `X1 Y1 Z1` is skipped. An error without a known unit, without `Frame#` and `Time`,
/// without a marker, or for another number of columns than three per marker.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let lines = FieldLines::new(path, Format::Trc, bytes, delimiter(bytes))?;
    let starts = |l: &FieldLine, word: &str| l.field(0).to_lowercase().starts_with(word);
    let Some(header) = lines.list.iter().position(|l| starts(l, "frame")) else {
        return lines.rejected(
            1,
            "no line that begins with `Frame#`",
            "such a line above the \
                                  numbers",
        );
    };
    let called = &lines.list[header];
    if !called.field(1).to_lowercase().starts_with("time") {
        return lines.rejected(
            called.number,
            &format!("`{}` next to `Frame#`", called.field(1)),
            "`Time`",
        );
    }
    // The line of keys is directly above the line of values.
    let keys = lines.list[..header].iter().position(|l| l.fields().any(|f| f == "Units"));
    let stated = keys.and_then(|at| {
        let column = lines.list[at].fields().position(|field| field == "Units")?;
        Some(lines.list.get(at + 1)?.field(column))
    });
    let Some(lengths) = stated.and_then(length_unit) else {
        let found = stated.map_or("no `Units`".into(), |stated| format!("Units `{stated}`"));
        return lines.rejected(
            keys.map_or(1, |at| lines.list[at].number),
            &found,
            "mm, cm, m or um",
        );
    };
    let names: Vec<&str> = called.fields().skip(BEFORE).filter(|name| !name.is_empty()).collect();
    let mut layout = ColumnLayout::new(&lines, called.number);
    for (k, name) in names.iter().enumerate() {
        for axis in 0..3 {
            let column = BEFORE + 3 * k + axis;
            layout.add(column, name, ColumnKind::Axis(axis))?;
        }
    }
    if layout.is_empty() {
        return lines.rejected(called.number, "no marker after `Time`", "at least one marker");
    }
    let rows = lines.list[header + 1..].iter().filter(|l| !l.is_empty());
    // The line `X1 Y1 Z1`, whose indices may be in any order.
    let rows = rows.skip_while(|l| {
        l.field(0).parse::<f64>().is_err() && l.field(BEFORE).parse::<f64>().is_err()
    });
    let time = |_, line: &FieldLine| lines.required_number(line, 1, "Time");
    let width = BEFORE + 3 * names.len();
    let table = layout.read(width, rows, time)?;
    let clock = Clock::Time(1.0);
    Ok(lines.file(clock, lengths, table))
}

//! Reader of data exports of Tracker: frames by time in seconds, and tracks as markers in the unit of the calibration.
//!
//! The first line has the names of the tracks, each above the first of its columns, and a single one in the first
//! column. The second has the names of the columns, beginning with `t`. The columns of a track may be in several
//! groups; columns other than x, y and z are skipped. Columns are separated by tabs, commas, semicolons or spaces. A
//! file without `t` or any track, and a track without x or y, are errors.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{
    Clock, ColumnKind, ColumnLayout, FieldLine, FieldLines, LengthUnit, MarkerFile,
};
use crate::separator::with_tabs;
use std::borrow::Cow;
use std::path::Path;

/// The bytes of a file with a tab for each run of spaces between its columns. The first line that is not blank, the
/// name of a track, is unchanged.
fn spaced(bytes: &[u8]) -> Vec<u8> {
    let start = bytes.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(0);
    let end = bytes[start..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |k| start + k);
    [&bytes[..end], &with_tabs(&bytes[end..])[..]].concat()
}

/// Reads the bytes of a file of Tracker into frames by time, s, and tracks as markers, in the unit of the calibration;
/// `path` is for messages. Columns other than x, y and z are skipped. An error if the first column is not `t`, if no
/// track has a column x, y or z, and for a track without x or y.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    // The first line may be a single name without a separator: the second one shows it.
    let text = bytes.split(|b| *b == b'\n').filter(|line| !line.trim_ascii().is_empty()).nth(1);
    let text = text.unwrap_or_default();
    let delimiter = text.iter().find(|b| b",;\t".contains(b)).copied();
    let content = match delimiter {
        None if text.contains(&b' ') => spaced(bytes).into(),
        _ => Cow::Borrowed(bytes),
    };
    let lines = FieldLines::new(path, Format::Tracker, &content, delimiter.unwrap_or(b'\t'))?;
    let [called, names, rows @ ..] = &lines.list[..] else {
        return lines.rejected(
            1,
            "fewer than two lines",
            "a line with the names of the tracks and a line with the names of the columns",
        );
    };
    if names.field(0) != "t" {
        let found = format!("`{}` as the first column", names.field(0));
        return lines.rejected(
            names.number,
            &found,
            "the time `t`. Switch it on in the exported table",
        );
    }
    // The name of a single track stands in the first column.
    let single = called.fields().skip(1).all(str::is_empty).then(|| called.field(0));
    let mut layout = ColumnLayout::new(&lines, names.number);
    let mut track = single.unwrap_or("");
    for column in 1..names.len() {
        if single.is_none() && !called.field(column).is_empty() {
            track = called.field(column);
        }
        if let Some(kind @ ColumnKind::Axis(_)) = ColumnKind::axis(names.field(column)) {
            layout.add(column, track, kind)?;
        }
    }
    if layout.is_empty() {
        return lines.rejected(
            names.number,
            "no columns x and y",
            "columns x and y of at least \
                                             one track",
        );
    }
    let time = |_, line: &FieldLine| lines.required_number(line, 0, "t");
    let rows = rows.iter().filter(|l| !l.is_empty());
    let table = layout.read(names.len(), rows, time)?;
    Ok(lines.file(Clock::Time(1.0), LengthUnit::Calibrated, table))
}

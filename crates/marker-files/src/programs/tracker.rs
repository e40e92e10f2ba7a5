//! Data export of Tracker: the names of the tracks, each above the first of its columns, then the names of the columns,
//! beginning with `t`. The columns of a track may be in several groups. Lengths are in the unit of the calibration.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{Clock, ColumnKind, Layout, LengthUnit, Line, Lines, MarkerFile};
use std::path::Path;

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let text = bytes.split(|b| *b == b'\n').filter(|line| !line.trim_ascii().is_empty()).nth(1);
    let delimiter = text.unwrap_or_default().iter().find(|b| b",;\t".contains(b)).unwrap_or(&b'\t');
    let lines = Lines::of(path, bytes, *delimiter)?;
    let rejected = |line, found: &str, allowed: &str| {
        Err(lines.format_error(Format::Tracker, line, found, allowed))
    };
    let [called, names, rows @ ..] = &lines.list[..] else {
        return rejected(1, "fewer than two lines", "the tracks' names, and those of the columns");
    };
    if names.field(0) != "t" {
        let found = format!("`{}` before all columns", names.field(0));
        return rejected(
            names.number,
            &found,
            "the time `t`: switch it on in the table that is exported",
        );
    }
    let single = called.fields().skip(1).all(str::is_empty).then(|| called.field(0));
    let (mut layout, mut track) = (Layout::default(), single.unwrap_or(""));
    for column in 1..names.len() {
        if single.is_none() && !called.field(column).is_empty() {
            track = called.field(column);
        }
        if let Some(kind @ ColumnKind::Axis(_)) = ColumnKind::axis(names.field(column)) {
            layout.add(&lines, names.number, (column, track, kind))?;
        }
    }
    if layout.is_empty() {
        return rejected(names.number, "no columns x and y", "those of one track at least");
    }
    let time = |_, line: &Line| lines.required_number(line, 0, "t");
    let rows = rows.iter().filter(|l| !l.is_empty());
    let (frames, markers) = layout.read(&lines, (names.number, names.len()), rows, time)?;
    let (format, clock) = (Format::Tracker, Clock::Time(1.0));
    Ok(MarkerFile {
        path: path.into(),
        format,
        clock,
        lengths: LengthUnit::Calibrated,
        frames,
        markers,
    })
}

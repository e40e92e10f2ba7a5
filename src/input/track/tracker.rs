//! Tracker's data export: the tracks' names, each over the first of its columns, then the names of the columns,
//! beginning with `t`. A track's columns may come in several parts. Lengths are in the unit of its calibration.

use crate::error::Error;
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Layout, Lengths, Line, Lines, Says, Sheet};
use std::path::Path;

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    let text = bytes.split(|b| *b == b'\n').filter(|line| !line.trim_ascii().is_empty()).nth(1);
    let delimiter = text.unwrap_or_default().iter().find(|b| b",;\t".contains(b)).unwrap_or(&b'\t');
    let lines = Lines::of(path, bytes, *delimiter)?;
    let not =
        |line, found: &str, allowed: &str| Err(lines.not_of(Format::Tracker, line, found, allowed));
    let [called, names, rows @ ..] = &lines.list[..] else {
        return not(1, "fewer than two lines", "the tracks' names, and those of the columns");
    };
    if names.field(0) != "t" {
        let found = format!("`{}` before all columns", names.field(0));
        return not(
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
        if let Some(says @ Says::Axis(_)) = Says::axis(names.field(column)) {
            layout.add(&lines, names.number, (column, track, says))?;
        }
    }
    if layout.is_empty() {
        return not(names.number, "no columns x and y", "those of one track at least");
    }
    let time = |_, line: &Line| lines.some_number(line, 0, "t");
    let rows = rows.iter().filter(|l| !l.is_empty());
    let (rows, markers) = layout.read(&lines, (names.number, names.len()), rows, time)?;
    let (format, clock) = (Format::Tracker, Clock::Time(1.0));
    Ok(Sheet { path: path.into(), format, clock, lengths: Lengths::Calibrated, rows, markers })
}

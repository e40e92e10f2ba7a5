//! Reader of exports of Kinovea, of two kinds: frames by time, and trajectories as markers.
//!
//! A spreadsheet has the time, and `NAME/X`, `NAME/Y` of every trajectory, in the units of the header; without units in
//! seconds and the unit of the calibration. Positions in pixels have y up. A text begins with `#` and has the
//! trajectories one below the other, below two comments that name no trajectory. Each trajectory is below its name in a
//! comment, or after a blank line and then numbered from 1. Its lines are `T X Y`, in seconds and the unit of the
//! calibration. Time codes, as `0:00:01`, other columns, several or unknown units, lines of a text without three
//! fields, and two positions of a trajectory at one time are errors.

use crate::detections::Detections;
use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{
    Clock, ColumnKind, ColumnLayout, FieldLine, FieldLines, FrameReading, LengthUnit, MarkerFile,
    length_unit,
};
use crate::table::{LENGTHS, TIMES, delimiter, split_unit};
use std::path::Path;

/// Reads the bytes of a file of Kinovea into frames by time and trajectories as markers; `path` is for messages. A file
/// that begins with `#` is a text, others are a spreadsheet. There the time without a unit is in s, lengths without one
/// are in the unit of the calibration, and pixels have y up. An error for time codes, a first column other than `Time`,
/// other columns, and unknown or several units.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    if bytes.starts_with(b"#") {
        return read_text(path, bytes);
    }
    let lines = FieldLines::new(path, Format::Kinovea, bytes, delimiter(bytes))?;
    let Some((names, rows)) = lines.list.split_first() else {
        return lines.rejected(1, "nothing", "a header with `Time` and the trajectories");
    };
    let (clock, unit_of_time) = split_unit(names.field(0));
    if !clock.eq_ignore_ascii_case("time") {
        return lines.rejected(
            names.number,
            &format!("`{}` as the first column", names.field(0)),
            "`Time`",
        );
    }
    let seconds = match unit_of_time.as_deref() {
        None => 1.0,
        Some(stated) => match TIMES.iter().find(|(name, _)| *name == stated) {
            Some((_, seconds)) => *seconds,
            None => {
                return lines.rejected(
                    names.number,
                    &format!("unit [{stated}] of the time"),
                    "s, ms or us",
                );
            }
        },
    };
    let mut layout = ColumnLayout::new(&lines, names.number);
    let mut lengths: Option<LengthUnit> = None;
    // Spreadsheet programs pad lines with empty columns.
    let named = names.fields().enumerate().skip(1).filter(|(_, name)| !name.is_empty());
    for (column, name) in named {
        let (name, stated) = split_unit(name);
        let Some((trajectory, axis)) = name.rsplit_once('/') else {
            return lines.rejected(names.number, &format!("column `{name}`"), "NAME/X and NAME/Y");
        };
        let Some(kind) = ColumnKind::axis(axis) else {
            return lines.rejected(names.number, &format!("column `{name}`"), "NAME/X and NAME/Y");
        };
        let own = match stated.as_deref() {
            None => LengthUnit::Calibrated,
            // The origin is the center of the image, and y points up.
            Some("px") => LengthUnit::Pixels { down: Some(false) },
            Some(stated) => {
                match length_unit(stated)
                    .filter(|_| LENGTHS.iter().any(|(name, _)| *name == stated))
                {
                    Some(own) => own,
                    None => {
                        return lines.rejected(
                            names.number,
                            &format!("unit [{stated}]"),
                            "m, cm, mm or px",
                        );
                    }
                }
            }
        };
        if lengths.replace(own).is_some_and(|before| before != own) {
            return lines.rejected(names.number, "several units", "one unit for all trajectories");
        }
        layout.add(column, trajectory, kind)?;
    }
    let time = |_, line: &FieldLine| match line.field(0).contains(':') {
        true => Err(time_code(&lines, line)),
        false => lines.required_number(line, 0, "Time"),
    };
    let rows = rows.iter().filter(|l| !l.is_empty());
    let table = layout.read(names.len(), rows, time)?;
    let lengths = lengths.unwrap_or(LengthUnit::Calibrated);
    let clock = Clock::Time(seconds);
    Ok(lines.file(clock, lengths, table))
}

/// The error of a line with a time code in place of a number.
fn time_code(lines: &FieldLines, line: &FieldLine) -> Error {
    let words = "allowed: a number. Choose seconds or milliseconds as the time marker of Kinovea";
    lines.error(line.number, format!("found the time `{}`, {words}", line.field(0)))
}

/// Reads a text of lines `T X Y`, which may have decimal commas, in seconds and the unit of the calibration.
/// Trajectories without a name are numbered from 1. The first two lines are a header. Errors: time codes, lines without
/// three fields, other texts than numbers, and two positions of a trajectory at one time.
fn read_text(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    // A comma is a decimal point here, but not in names, which are in comments.
    let point = |b: &u8| if *b == b',' { b'.' } else { *b };
    let plain = |line: &[u8]| match line.trim_ascii_start().starts_with(b"#") {
        true => line.to_vec(),
        false => line.iter().map(point).collect(),
    };
    let text: Vec<u8> = bytes.split_inclusive(|b| *b == b'\n').flat_map(plain).collect();
    let lines = FieldLines::new(path, Format::Kinovea, &text, b' ')?;
    let mut detections = Detections::default();
    let (mut name, mut count, mut last) = (None::<String>, 0, None::<u64>);
    for line in lines.list.iter().filter(|line| !line.is_empty()) {
        if let Some(comment) = line.field(0).strip_prefix('#') {
            // The first two comments are the header of the file.
            if line.number > 2 {
                let rest = line.fields().skip(1).filter(|field| !field.is_empty());
                let words: Vec<&str> = std::iter::once(comment).chain(rest).collect();
                name = Some(words.join(" ").trim().to_string());
                last = None;
            }
            continue;
        }
        if line.field(0).contains(':') {
            return Err(time_code(&lines, line));
        }
        // Aligned columns have several spaces between them.
        let filled: Vec<usize> = (0..line.len()).filter(|i| !line.field(*i).is_empty()).collect();
        let [t, x, y] = filled[..] else {
            let found = format!("{} numbers", filled.len());
            return lines.rejected(line.number, &found, "three numbers: T, X and Y");
        };
        // A blank line separates trajectories.
        if last.is_none_or(|last| line.number > last + 1) {
            count += 1;
        }
        last = Some(line.number);
        let row = FrameReading { line: line.number, clock: lines.required_number(line, t, "T")? };
        let position = [lines.number(line, x, "X")?, lines.number(line, y, "Y")?, None];
        detections.add(row, name.as_deref().unwrap_or(&count.to_string()), position, None);
    }
    let table = detections.table(&lines, [true, true, false], false)?;
    let (clock, lengths) = (Clock::Time(1.0), LengthUnit::Calibrated);
    Ok(lines.file(clock, lengths, table))
}

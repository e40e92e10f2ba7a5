//! Reader of the spots of TrackMate in CSV: a line for every spot with the number of its track, in any order.
//!
//! Each track is a marker, named by its number; spots without a track are left out. Up to three lines with names and
//! units are below the header. The clock is the time if its unit is stated and is not frames, else the frame number,
//! without a rate. Lengths without a unit are pixels with y down; for other units the user must state the direction of
//! y. If z is 0 in all spots, it is missing. A missing column, unknown units, another number of fields than the header,
//! blank coordinates, no spot with a track, and two spots of a track at one time are errors.

use crate::detections::Detections;
use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{
    Clock, FieldLine, FieldLines, FrameReading, LengthUnit, MarkerFile, length_unit,
};
use crate::table::TIMES;
use std::path::Path;

/// Reads the bytes of a file of TrackMate into frames and tracks as markers, named by their number; `path` is for
/// messages. If z is 0 in all spots, it is missing in the result. Lengths without a unit are pixels with y down.
/// Errors: a missing column, an unknown unit, another number of fields than the header, a blank coordinate. No spot
/// with a track, and two spots of a track at one time, are errors too.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let lines = FieldLines::new(path, Format::TrackMate, bytes, b',')?;
    let Some((header, below)) = lines.list.split_first() else {
        return lines.rejected(1, "nothing", "a header with `TRACK_ID` and `POSITION_X`");
    };
    let mut columns = [0; 5];
    let names = ["TRACK_ID", "POSITION_X", "POSITION_Y", "POSITION_Z", "FRAME"];
    for (column, name) in columns.iter_mut().zip(names) {
        match header.fields().position(|field| field == name) {
            Some(found) => *column = found,
            None => {
                let allowed = "this column. Export the spots, not the edges or the tracks";
                return lines.rejected(header.number, &format!("no column `{name}`"), allowed);
            }
        }
    }
    let [track, x, y, z, frame] = columns;
    let time = header.fields().position(|field| field == "POSITION_T");
    // Descriptive names, and units in parentheses.
    let is_name =
        |line: &&FieldLine| !line.field(x).is_empty() && line.field(x).parse::<f64>().is_err();
    let named = below.iter().take(3).take_while(is_name).count();
    let units = below[..named].iter().find(|line| line.field(x).starts_with('('));
    let stated =
        |column: usize| units.map_or("", |line| line.field(column).trim_matches(['(', ')']));
    let lengths = match stated(x) {
        "" | "pixel" | "pixels" => LengthUnit::Pixels { down: Some(true) },
        "micron" | "microns" | "um" | "\u{b5}m" | "\u{3bc}m" => LengthUnit::Known("um", 1e-6),
        other => match length_unit(other) {
            Some(lengths) => lengths,
            None => {
                let line = units.map_or(1, |line| line.number);
                return lines.rejected(
                    line,
                    &format!("unit ({other})"),
                    "pixel, micron, mm, cm or m",
                );
            }
        },
    };
    // A time in a unit of frames is no time: the frame number is used, with the frame rate of the user.
    let (clock, column, name) = match (time, time.map(stated)) {
        (Some(time), Some(stated)) if !["", "frame", "frames"].contains(&stated) => {
            // TrackMate writes `sec` and `msec`, the list of units has `s` and `ms`.
            let short = stated.strip_suffix("ec").unwrap_or(stated);
            let Some((_, seconds)) = TIMES.iter().find(|(name, _)| *name == short) else {
                let line = units.map_or(1, |line| line.number);
                return lines.rejected(
                    line,
                    &format!("time in ({stated})"),
                    "sec, ms, us or frame",
                );
            };
            (Clock::Time(*seconds), time, "POSITION_T")
        }
        _ => (Clock::Frames { first: 0.0, rate: None }, frame, "FRAME"),
    };
    // Spots may be in any order, with several tracks per frame. All have z = 0 in a video.
    let mut detections = Detections::default();
    let mut flat = true;
    for line in below[named..].iter().filter(|line| !line.is_empty()) {
        if line.len() != header.len() {
            let found = format!("{} fields", line.len());
            return lines.rejected(
                line.number,
                &found,
                &format!("{} fields, as in the header", header.len()),
            );
        }
        if ["", "None"].contains(&line.field(track)) {
            continue;
        }
        let mut position = [None; 3];
        for (axis, column) in position.iter_mut().zip([x, y, z]) {
            *axis = Some(lines.required_number(line, column, header.field(column))?);
        }
        flat &= position[2] == Some(0.0);
        let row =
            FrameReading { line: line.number, clock: lines.required_number(line, column, name)? };
        detections.add(row, line.field(track), position, None);
    }
    let mut table = detections.table(&lines, [true, true, !flat], false)?;
    if flat {
        table
            .markers
            .iter_mut()
            .flat_map(|m| &mut m.positions)
            .for_each(|position| position[2] = None);
    }
    Ok(lines.file(clock, lengths, table))
}

//! TrackMate's spots in CSV: a line for every spot, with the number of its track, in any order; below the header stand
//! longer and shorter names and the units. Spots of no track are left out. An image's y points down, whatever the unit.

use crate::error::Error;
use crate::input::table::TIMES;
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Lengths, Line, Lines, Row, Sheet, unit};
use crate::input::track::sightings::Sightings;
use std::path::Path;

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    let lines = Lines::of(path, bytes, b',')?;
    let format = Format::TrackMate;
    let not = |line, found: &str, allowed: &str| Err(lines.not_of(format, line, found, allowed));
    let Some((header, below)) = lines.list.split_first() else {
        return not(1, "nothing", "a header with `TRACK_ID` and `POSITION_X`");
    };
    let mut columns = [0; 5];
    let names = ["TRACK_ID", "POSITION_X", "POSITION_Y", "POSITION_Z", "FRAME"];
    for (column, name) in columns.iter_mut().zip(names) {
        match header.fields().position(|field| field == name) {
            Some(found) => *column = found,
            None => {
                let allowed = "it: export the spots, not the edges or the tracks";
                return not(header.number, &format!("no column `{name}`"), allowed);
            }
        }
    }
    let [track, x, y, z, frame] = columns;
    let time = header.fields().position(|field| field == "POSITION_T");
    // Names that people read, and units in parentheses.
    let is_name = |line: &&Line| !line.is_empty() && line.field(x).parse::<f64>().is_err();
    let named = below.iter().take(3).take_while(is_name).count();
    let units = below[..named].iter().find(|line| line.field(x).starts_with('('));
    let said = |column: usize| units.map_or("", |line| line.field(column).trim_matches(['(', ')']));
    let lengths = match said(x) {
        "" | "pixel" | "pixels" => Lengths::Pixels { down: Some(true) },
        "micron" | "microns" | "um" | "\u{b5}m" | "\u{3bc}m" => Lengths::Known("um", 1e-6),
        other => match unit(other) {
            Some(lengths) => lengths,
            None => {
                let line = units.map_or(1, |line| line.number);
                return not(line, &format!("unit ({other})"), "pixel, micron, mm, cm or m");
            }
        },
    };
    let (clock, column, name) = match (time, time.map(said)) {
        (Some(time), Some(said)) if !["", "frame", "frames"].contains(&said) => {
            let short = said.strip_suffix("ec").unwrap_or(said);
            let Some((_, seconds)) = TIMES.iter().find(|(name, _)| *name == short) else {
                let line = units.map_or(1, |line| line.number);
                return not(line, &format!("time in ({said})"), "sec, ms, us or frame");
            };
            (Clock::Time(*seconds), time, "POSITION_T")
        }
        _ => (Clock::Frames { first: 0.0, rate: None }, frame, "FRAME"),
    };
    let mut sightings = Sightings::default();
    let mut flat = true;
    for line in below[named..].iter().filter(|line| !line.is_empty()) {
        if line.len() != header.len() {
            let found = format!("{} fields", line.len());
            return not(line.number, &found, &format!("{} as in the header", header.len()));
        }
        if ["", "None"].contains(&line.field(track)) {
            continue;
        }
        let mut place = [None; 3];
        for (axis, column) in place.iter_mut().zip([x, y, z]) {
            *axis = Some(lines.some_number(line, column, header.field(column))?);
        }
        flat &= place[2] == Some(0.0);
        let row = Row { line: line.number, clock: lines.some_number(line, column, name)? };
        sightings.add(row, line.field(track), place, None);
    }
    let (rows, mut markers) = sightings.table(&lines, [true, true, !flat], false)?;
    if flat {
        markers.iter_mut().flat_map(|m| &mut m.places).for_each(|place| place[2] = None);
    }
    Ok(Sheet { path: path.into(), format, clock, lengths, rows, markers })
}

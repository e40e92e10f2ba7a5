//! Kinovea's export to a spreadsheet: the time, and `NAME/X`, `NAME/Y` of every trajectory, in the units of the
//! header; without one seconds, and the unit of its calibration. Its export to text has the trajectories one below the
//! other, each below its name in a comment, or after a blank line.

use crate::error::Error;
use crate::input::table::{LENGTHS, TIMES, delimiter, split_unit};
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Layout, Lengths, Line, Lines, Row, Says, Sheet, unit};
use crate::input::track::sightings::Sightings;
use std::path::Path;

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    if bytes.starts_with(b"#") {
        return read_text(path, bytes);
    }
    let lines = Lines::of(path, bytes, delimiter(bytes))?;
    let not =
        |line, found: &str, allowed: &str| Err(lines.not_of(Format::Kinovea, line, found, allowed));
    let Some((names, rows)) = lines.list.split_first() else {
        return not(1, "nothing", "a header with `Time` and the trajectories");
    };
    let (clock, unit_of_time) = split_unit(names.field(0));
    if !clock.eq_ignore_ascii_case("time") {
        return not(names.number, &format!("`{}` first", names.field(0)), "`Time`");
    }
    let seconds = match unit_of_time.as_deref() {
        None => 1.0,
        Some(said) => match TIMES.iter().find(|(name, _)| *name == said) {
            Some((_, seconds)) => *seconds,
            None => return not(names.number, &format!("unit [{said}] of the time"), "s, ms or us"),
        },
    };
    let (mut layout, mut lengths): (Layout, Option<Lengths>) = (Layout::default(), None);
    // Spreadsheet programs pad the line with empty columns.
    let named = names.fields().enumerate().skip(1).filter(|(_, name)| !name.is_empty());
    for (column, name) in named {
        // Names keep their case.
        let name = name.split(['(', '[']).next().unwrap_or(name).trim();
        let said = split_unit(names.field(column)).1;
        let Some((trajectory, axis)) = name.rsplit_once('/') else {
            return not(names.number, &format!("column `{name}`"), "NAME/X and NAME/Y");
        };
        let Some(says) = Says::axis(axis) else {
            return not(names.number, &format!("column `{name}`"), "NAME/X and NAME/Y");
        };
        let own = match said.as_deref() {
            None => Lengths::Calibrated,
            // From the centre of the picture, upwards.
            Some("px") => Lengths::Pixels { down: Some(false) },
            Some(said) => {
                match unit(said).filter(|_| LENGTHS.iter().any(|(name, _)| *name == said)) {
                    Some(own) => own,
                    None => return not(names.number, &format!("unit [{said}]"), "m, cm, mm or px"),
                }
            }
        };
        if lengths.replace(own).is_some_and(|before| before != own) {
            return not(names.number, "several units", "one for all trajectories");
        }
        layout.add(&lines, names.number, (column, trajectory, says))?;
    }
    let time = |_, line: &Line| match line.field(0).contains(':') {
        true => Err(time_code(&lines, line)),
        false => lines.some_number(line, 0, "Time"),
    };
    let rows = rows.iter().filter(|l| !l.is_empty());
    let (rows, markers) = layout.read(&lines, (names.number, names.len()), rows, time)?;
    let lengths = lengths.unwrap_or(Lengths::Calibrated);
    let clock = Clock::Time(seconds);
    Ok(Sheet { path: path.into(), format: Format::Kinovea, clock, lengths, rows, markers })
}

/// The error of a time that is no number.
fn time_code(lines: &Lines, line: &Line) -> Error {
    let words = "allowed: a number; choose seconds or milliseconds as Kinovea's time marker";
    lines.error(line.number, format!("time `{}`, {words}", line.field(0)))
}

/// `T X Y` with spaces between them, s and the unit of the calibration.
fn read_text(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    // A decimal comma is no separator here.
    let text: Vec<u8> = bytes.iter().map(|b| if *b == b',' { b'.' } else { *b }).collect();
    let lines = Lines::of(path, &text, b' ')?;
    let mut sightings = Sightings::default();
    let (mut name, mut count, mut last) = (None::<String>, 0, None::<u64>);
    for line in lines.list.iter().filter(|line| !line.is_empty()) {
        if let Some(comment) = line.field(0).strip_prefix('#') {
            // The first two say what the file is.
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
        let fields = line.fields().filter(|field| !field.is_empty()).count();
        if fields != 3 {
            let found = format!("{fields} numbers");
            return Err(lines.not_of(Format::Kinovea, line.number, &found, "three, T X Y"));
        }
        // After a blank line the next trajectory begins.
        if last.is_none_or(|last| line.number > last + 1) {
            count += 1;
        }
        last = Some(line.number);
        let row = Row { line: line.number, clock: lines.some_number(line, 0, "T")? };
        let place = [lines.number(line, 1, "X")?, lines.number(line, 2, "Y")?, None];
        sightings.add(row, name.as_deref().unwrap_or(&count.to_string()), place, None);
    }
    let (rows, markers) = sightings.table(&lines, [true, true, false], false)?;
    let (clock, lengths) = (Clock::Time(1.0), Lengths::Calibrated);
    Ok(Sheet { path: path.into(), format: Format::Kinovea, clock, lengths, rows, markers })
}

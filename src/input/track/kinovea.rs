//! Kinovea's export to a spreadsheet: the time, and `NAME/X`, `NAME/Y` of every trajectory, in the units of the
//! header; without one seconds, and the unit of its calibration.

use crate::error::Error;
use crate::input::table::{LENGTHS, TIMES, delimiter, split_unit};
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Layout, Lengths, Line, Lines, Says, Sheet, unit};
use std::path::Path;

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    let lines = Lines::of(path, bytes, delimiter(bytes))?;
    let not =
        |line, found: &str, allowed: &str| Err(lines.not_of(Format::Kinovea, line, found, allowed));
    let Some((names, rows)) = lines.list.split_first() else {
        return not(1, "nothing", "a header with `Time` and the trajectories");
    };
    let (clock, unit_of_time) = split_unit(names.field(0));
    if clock != "time" {
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
    for (column, name) in names.fields().enumerate().skip(1) {
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
            Some("px") => Lengths::Pixels { down: None },
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
    let time = |_, line: &Line| {
        match line.field(0).contains(':') {
        true => Err(lines.error(
            line.number,
            format!(
                "time `{}`, allowed: a number; choose seconds or milliseconds as Kinovea's time marker",
                line.field(0)
            ),
        )),
        false => lines.some_number(line, 0, "Time"),
    }
    };
    let rows = rows.iter().filter(|l| !l.is_empty());
    let (rows, markers) = layout.read(&lines, (names.number, names.len()), rows, time)?;
    let lengths = lengths.unwrap_or(Lengths::Calibrated);
    let clock = Clock::Time(seconds);
    Ok(Sheet { path: path.into(), format: Format::Kinovea, clock, lengths, rows, markers })
}

//! TRC, the text format of marker trajectories of Motion Analysis, which OpenSim, Pose2Sim and Mokka write too: keys and
//! their values in two lines, then `Frame#`, `Time` and the names of the markers, each over the first of its three
//! columns, then `X1 Y1 Z1` and so on. Commas may stand for tabs. Frames that were not seen are blank or NaN.

use crate::error::Error;
use crate::input::table::delimiter;
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Layout, Line, Lines, Says, Sheet, unit};
use std::path::Path;

/// Columns before the first marker: the frame's number and the time.
const BEFORE: usize = 2;

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    let lines = Lines::of(path, bytes, delimiter(bytes))?;
    let not =
        |line, found: &str, allowed: &str| Err(lines.not_of(Format::Trc, line, found, allowed));
    let starts = |l: &Line, word: &str| l.field(0).to_lowercase().starts_with(word);
    let Some(header) = lines.list.iter().position(|l| starts(l, "frame")) else {
        return not(1, "no line that begins with `Frame#`", "it, over the numbers");
    };
    let called = &lines.list[header];
    if !called.field(1).to_lowercase().starts_with("time") {
        return not(called.number, &format!("`{}` beside `Frame#`", called.field(1)), "`Time`");
    }
    let keys = lines.list[..header].iter().position(|l| l.fields().any(|f| f == "Units"));
    let said = keys.and_then(|at| {
        let column = lines.list[at].fields().position(|field| field == "Units")?;
        Some(lines.list.get(at + 1)?.field(column))
    });
    let Some(lengths) = said.and_then(unit) else {
        let found = said.map_or("no `Units`".into(), |said| format!("Units `{said}`"));
        return not(keys.map_or(1, |at| lines.list[at].number), &found, "mm, cm or m");
    };
    let names: Vec<&str> = called.fields().skip(BEFORE).filter(|name| !name.is_empty()).collect();
    let mut layout = Layout::default();
    for (k, name) in names.iter().enumerate() {
        for axis in 0..3 {
            let column = BEFORE + 3 * k + axis;
            layout.add(&lines, called.number, (column, name, Says::Axis(axis)))?;
        }
    }
    if layout.is_empty() {
        return not(called.number, "no marker behind `Time`", "one at least");
    }
    let rows = lines.list[header + 1..].iter().filter(|l| !l.is_empty());
    // The line `X1 Y1 Z1`, whose numbers may be in any order.
    let rows = rows.skip_while(|l| {
        l.field(0).parse::<f64>().is_err() && l.field(BEFORE).parse::<f64>().is_err()
    });
    let time = |_, line: &Line| lines.some_number(line, 1, "Time");
    let width = BEFORE + 3 * names.len();
    let (rows, markers) = layout.read(&lines, (called.number, width), rows, time)?;
    let clock = Clock::Time(1.0);
    Ok(Sheet { path: path.into(), format: Format::Trc, clock, lengths, rows, markers })
}

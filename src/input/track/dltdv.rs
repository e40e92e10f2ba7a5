//! DLTdv's points: `pt1_cam1_X, pt1_cam1_Y` of each camera, in pixels that count from 1, or `pt1_X, pt1_Y, pt1_Z`
//! in the unit of the calibration. There is no clock: row k is frame k. NaN was not seen.

use crate::error::Error;
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Layout, Lengths, Lines, Says, Sheet};
use std::path::Path;

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    let lines = Lines::of(path, bytes, b',')?;
    let not =
        |line, found: &str, allowed: &str| Err(lines.not_of(Format::Dltdv, line, found, allowed));
    let [names, rows @ ..] = &lines.list[..] else {
        return not(1, "nothing", "columns `pt1_cam1_X` or `pt1_X`");
    };
    let (mut layout, mut cameras) = (Layout::default(), Vec::new());
    // Spreadsheet programs pad the line with empty columns.
    for (column, name) in names.fields().enumerate().filter(|(_, name)| !name.is_empty()) {
        let says = name.rsplit_once('_').and_then(|(point, axis)| Some((point, Says::axis(axis)?)));
        let Some((point, says)) = says.filter(|(point, _)| point.starts_with("pt")) else {
            return not(names.number, &format!("column `{name}`"), "`pt1_cam1_X` or `pt1_X` alone");
        };
        cameras.push(point.contains("_cam"));
        layout.add(&lines, names.number, (column, point, says))?;
    }
    let pixels = cameras.iter().all(|camera| *camera);
    if !pixels && cameras.contains(&true) {
        return not(names.number, "columns with a camera and without", "either");
    }
    let frame = |k: usize, _: &_| Ok((k + 1) as f64);
    let (rows, markers) = layout.read(&lines, (names.number, names.len()), rows.iter(), frame)?;
    let lengths = if pixels { Lengths::Pixels { down: None } } else { Lengths::Calibrated };
    let clock = Clock::Frames { first: 1.0, rate: None };
    Ok(Sheet { path: path.into(), format: Format::Dltdv, clock, lengths, rows, markers })
}

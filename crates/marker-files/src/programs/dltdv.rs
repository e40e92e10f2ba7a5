//! Reader of CSV files of DLTdv: frames by number, without a rate, and points as markers.
//!
//! Columns are points `pt1_cam1_X, pt1_cam1_Y` of each camera in pixels, or `pt1_X, pt1_Y, pt1_Z` in the unit of the
//! calibration. Other columns and a mixture of both kinds are errors. A point is a marker of its own for each camera,
//! as `pt1_cam1`; the direction of y in pixels is not known. There is no clock: row k below the header, counted from 1,
//! is frame k. Missing positions are NaN or blank.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{Clock, ColumnKind, ColumnLayout, FieldLines, LengthUnit, MarkerFile};
use std::path::Path;

/// Reads the bytes of a file of DLTdv into frames by number and points as markers; `path` is for messages. A point of
/// each camera is a marker of its own. An error for other columns, and for a mixture of columns with and without a
/// camera.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let lines = FieldLines::new(path, Format::Dltdv, bytes, b',')?;
    let [names, rows @ ..] = &lines.list[..] else {
        return lines.rejected(1, "nothing", "columns `pt1_cam1_X` or `pt1_X`");
    };
    let mut layout = ColumnLayout::new(&lines, names.number);
    let mut cameras = Vec::new();
    // Spreadsheet programs pad lines with empty columns.
    for (column, name) in names.fields().enumerate().filter(|(_, name)| !name.is_empty()) {
        let kind =
            name.rsplit_once('_').and_then(|(point, axis)| Some((point, ColumnKind::axis(axis)?)));
        let Some((point, kind)) = kind.filter(|(point, _)| point.starts_with("pt")) else {
            return lines.rejected(
                names.number,
                &format!("column `{name}`"),
                "columns such as `pt1_cam1_X` or `pt1_X` only",
            );
        };
        cameras.push(point.contains("_cam"));
        layout.add(column, point, kind)?;
    }
    let pixels = cameras.iter().all(|camera| *camera);
    if !pixels && cameras.contains(&true) {
        return lines.rejected(
            names.number,
            "columns with a camera number and columns without \
                                             one",
            "one of the two kinds",
        );
    }
    let frame = |k: usize, _: &_| Ok((k + 1) as f64);
    let table = layout.read(names.len(), rows.iter(), frame)?;
    let lengths = if pixels { LengthUnit::Pixels { down: None } } else { LengthUnit::Calibrated };
    let clock = Clock::Frames { first: 1.0, rate: None };
    Ok(lines.file(clock, lengths, table))
}

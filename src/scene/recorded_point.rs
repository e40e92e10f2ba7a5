//! Recordings of one point: its positions, or its accelerations from rest, which are integrated twice.
//!
//! [`Track::read_one`] reads a file, [`Track::read_point`] also with stated columns of a CSV file, as
//! `[[supports.motion]]` may give them. Columns x, y, z (z may be absent) are positions. Columns ax, ay, az of a CSV
//! file are accelerations, linear between rows; absent ones are zero, and units of the header are converted to m/s^2.
//! Rows before a given start time, in the unit of the file's clock, are skipped. The clock, minus the start time, must
//! start at 0.
//!
//! The result is a track with one marker, m and s. An integrated one begins at rest at the origin. If the size of its
//! mean acceleration is within `NEAR_GRAVITY` of standard gravity, it has a defect: gravity was not subtracted. Errors
//! are files that cannot be read, several points, and other columns beside accelerations.

use crate::error::Error;
use crate::scene::track::{CLOCK_TOLERANCE, PathPoint, TIME_ZERO_REMEDY, Track, check_clock};
use crate::scene::track_defect::TrackDefect;
use marker_files::table::{TIMES, Table};
use marker_files::{ColumnRules, Format, Recording};
use std::path::Path;

/// Standard gravity, m/s^2.
const STANDARD_GRAVITY: f64 = 9.806_65;
/// Units of accelerations and their factors to m/s^2.
const ACCELERATIONS: [(&str, f64); 4] =
    [("m/s^2", 1.0), ("cm/s^2", 1e-2), ("mm/s^2", 1e-3), ("g", STANDARD_GRAVITY)];
/// Relative difference from standard gravity below which a mean acceleration is that of an accelerometer at rest;
/// errors of calibration are smaller.
const NEAR_GRAVITY: f64 = 0.05;

impl Track {
    /// Reads the motion of one point by its columns x, y and z, of which z may be absent. The columns `ax, ay, az` of a
    /// CSV file are its accelerations from rest, in m/s^2 or the unit of the header. Rows before `time_zero`, on the
    /// file's clock and in its unit, are skipped, and times count from there; 0 if absent.
    ///
    /// # Errors
    /// Those of [`read`](Self::read), and files with more than one point.
    pub fn read_one(path: &Path, time_zero: Option<f64>) -> Result<Self, Error> {
        Self::read_point(path, time_zero, None)
    }

    /// Reads the motion of one point as [`read_one`](Self::read_one), with the columns that `rules` state, if any.
    ///
    /// # Errors
    /// Those of [`read_one`](Self::read_one), and columns that the file does not have.
    pub fn read_point(
        path: &Path,
        time_zero: Option<f64>,
        rules: Option<&ColumnRules>,
    ) -> Result<Self, Error> {
        let stated = rules.map(|_| Format::Csv);
        let (format, bytes) = marker_files::open(path, stated)?;
        if format == Format::Csv {
            let table = Table::of_columns(path, &bytes, rules)?;
            if ["ax", "ay", "az"].iter().any(|name| table.find(name).is_some()) {
                return Ok(integrated(&table, time_zero)?);
            }
        }
        let recording = Recording { time_zero, columns: rules.cloned(), ..Recording::default() };
        let track = Self::read_as(path, &recording, &[])?;
        match track.markers() {
            [_] => Ok(track),
            more => {
                let message =
                    format!("found {} points, allowed: one point with x, y and z", more.len());
                Err(Error::Data { path: path.into(), line: 1, message })
            }
        }
    }
}

/// Motion of a point from rest at the origin by its columns `ax`, `ay` and `az`, m/s^2 or the unit of the header;
/// absent ones are zero. With an acceleration linear over a time h from `a` to `b`, velocity and position change by `h
/// (a + b)/2` and `h v + h^2 (2 a + b)/6`. Rows before `time_zero`, on the file's clock and in its unit, are skipped. A
/// mean acceleration of the size of gravity becomes a defect of the track.
///
/// # Errors
/// Other columns and units, blanks, fewer than two rows, and a clock that does not start at 0 or does not increase.
fn integrated(table: &Table, time_zero: Option<f64>) -> Result<Track, marker_files::Error> {
    // The clock, and the columns of the axes; other columns are rejected.
    let clocks = ["t", "time"].into_iter().filter_map(|name| table.find(name));
    let clock = match clocks.collect::<Vec<_>>()[..] {
        [clock] => clock,
        _ => table.require("t")?,
    };
    let axes = ["ax", "ay", "az"].map(|name| table.find(name));
    if let Some(other) = (0..table.columns.len()).find(|i| *i != clock && !axes.contains(&Some(*i)))
    {
        let name = &table.columns[other].0;
        let message = format!(
            "found the column `{name}` in a file of accelerations, allowed: t, ax, ay and \
                     az, once each"
        );
        return Err(table.error(1, &message));
    }
    // Units of the header, then row by row from rest.
    let unit = table.factor(clock, &TIMES, "")?;
    let mut factors = [1.0; 3];
    for (factor, column) in factors.iter_mut().zip(axes) {
        *factor = column.map_or(Ok(1.0), |column| acceleration_unit(table, column))?;
    }
    let mut path: Vec<PathPoint> = Vec::with_capacity(table.rows.len());
    let mut last = [0.0; 3];
    for row in &table.rows {
        let blank = || table.error(row.line, "found a blank, allowed: a number");
        let time = (row.values[clock].ok_or_else(blank)? - time_zero.unwrap_or(0.0)) * unit;
        if time_zero.is_some() && time < -CLOCK_TOLERANCE {
            continue;
        }
        let mut a = [0.0; 3];
        for (c, column) in axes.iter().enumerate() {
            let value = column.map_or(Some(0.0), |column| row.values[column]);
            a[c] = value.ok_or_else(blank)? * factors[c];
        }
        let [mut position, mut velocity] = [[0.0; 3]; 2];
        match path.last() {
            None => check_clock(time, TIME_ZERO_REMEDY)
                .map_err(|message| table.error(row.line, &message))?,
            Some(before) => {
                let h = time - before.time;
                if h <= 0.0 {
                    let message =
                        format!("t = {time} s after {} s, allowed: increasing", before.time);
                    return Err(table.error(row.line, &message));
                }
                // The acceleration is linear over the interval h.
                let (x, v) = (before.position, before.velocity);
                for c in 0..3 {
                    velocity[c] = v[c] + 0.5 * h * (last[c] + a[c]);
                    position[c] = x[c] + h * v[c] + h * h * (2.0 * last[c] + a[c]) / 6.0;
                }
            }
        }
        path.push(PathPoint { time, position, velocity });
        last = a;
    }
    if path.len() < 2 {
        return Err(table.error(
            1,
            "found fewer than two rows below the header, allowed: at least \
                                   two",
        ));
    }
    // A mean acceleration of the size of gravity is a defect of the recording.
    let gravity = gravity_fault(&path);
    let track = Track::from_integrated(path).map_err(|message| table.error(1, &message))?;
    Ok(match gravity {
        Some(fault) => track.with_first_fault(fault),
        None => track,
    })
}

/// Factor to m/s^2 from the unit in the header of a column, which may be spelled in several ways (`mm/s2`, `m s^-2`); 1
/// without a unit. An error for a unit other than those of [`ACCELERATIONS`].
fn acceleration_unit(table: &Table, column: usize) -> Result<f64, marker_files::Error> {
    let (name, unit) = &table.columns[column];
    let Some(unit) = unit else { return Ok(1.0) };
    // "mm/s2", "m s^-2" and the like.
    let spelled = unit.replace('\u{b2}', "^2").replace("s^-2", "/s^2").replace("/s/s", "/s^2");
    let spelled: String = spelled.chars().filter(|c| !"*\u{b7} ".contains(*c)).collect();
    let spelled = match spelled.strip_suffix("/s2") {
        Some(length) => format!("{length}/s^2"),
        None => spelled.replace("//", "/"),
    };
    let found = ACCELERATIONS.iter().find(|(symbol, _)| *symbol == spelled);
    found.map(|(_, factor)| *factor).ok_or_else(|| {
        let allowed = ACCELERATIONS.map(|(symbol, _)| symbol).join(", ");
        table.error(1, &format!("unit [{unit}] of `{name}`, allowed: {allowed}"))
    })
}

/// The defect [`TrackDefect::Gravity`] if the size of the mean acceleration, the last velocity over the last time,
/// differs from standard gravity by less than [`NEAR_GRAVITY`] of that. None otherwise, and for an empty path.
fn gravity_fault(path: &[PathPoint]) -> Option<TrackDefect> {
    let last = path.last()?;
    let mean = last.velocity.map(|v| v / last.time);
    let size = mean.iter().map(|a| a * a).sum::<f64>().sqrt();
    ((size / STANDARD_GRAVITY - 1.0).abs() < NEAR_GRAVITY).then_some(TrackDefect::Gravity { mean })
}

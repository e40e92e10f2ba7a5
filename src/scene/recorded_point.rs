//! Recordings of one point: its positions, or its accelerations from rest, which are integrated twice.
//!
//! [`Track::read_one`] reads a file, [`Track::read_point`] also with the columns, axes and subtraction of
//! `[[supports.motion]]`. Columns x, y, z (z may be absent) are positions. Columns ax, ay, az of a CSV file, or of a
//! log of an accelerometer ([`AccelerationColumns`]), are accelerations, linear between rows; absent ones are zero, and
//! units of the header are converted to m/s^2. Gravity and the offset of the sensor are subtracted with the
//! key `subtract` ([`Subtraction`]), in axes of the sensor. Rows before a given start time, in the unit of the file's clock, are
//! skipped. The clock, minus the start time, must start at 0.
//!
//! The result is a track with one marker, m and s. An integrated one begins at rest at the origin. If the size of its
//! mean acceleration is within `NEAR_GRAVITY` of standard gravity, it has a defect: gravity was not subtracted. Errors
//! are files that cannot be read, several points, and other columns beside accelerations.

use crate::error::Error;
use crate::numerics::vector::{add, scale, sub};
use crate::scene::track::{CLOCK_TOLERANCE, PathPoint, TIME_ZERO_REMEDY, Track, check_clock};
use crate::scene::track_defect::TrackDefect;
use marker_files::table::{TIMES, Table, TableRow};
use marker_files::{AccelerationColumns, Axes, ColumnRules, Format, Recording, STANDARD_GRAVITY};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Relative difference from standard gravity below which a mean acceleration is that of an accelerometer at rest;
/// errors of calibration are smaller.
const NEAR_GRAVITY: f64 = 0.05;

/// Acceleration that is subtracted from every row of an accelerometer: gravity and the offset of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected \"mean\", \"rest\", or three numbers, m/s^2")]
pub enum Subtraction {
    /// A mean of the record.
    Mean(SubtractedMean),
    /// Known acceleration along the axes of the sensor, m/s^2.
    Known([f64; 3]),
}

/// Mean of a record of accelerations that is subtracted from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SubtractedMean {
    /// Mean over the time of the motion, which begins and ends at rest.
    Mean,
    /// Mean of the rows before `time_zero`, during which the sensor is at rest.
    Rest,
}

/// Interpretation of a recording of one point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PointReading<'a> {
    /// Time on the file's own clock, in its unit, at which the simulation starts.
    pub time_zero: Option<f64>,
    /// Columns by name or number.
    pub columns: Option<&'a ColumnRules>,
    /// Axes of the file along the world's x, y and z.
    pub axes: Option<Axes>,
    /// Acceleration that is subtracted.
    pub subtract: Option<Subtraction>,
}

impl Track {
    /// Reads the motion of one point by its columns x, y and z, of which z may be absent. The columns `ax, ay, az` of a
    /// CSV file are its accelerations from rest, in m/s^2 or the unit of the header. Rows before `time_zero`, on the
    /// file's clock and in its unit, are skipped, and times count from there; 0 if absent.
    ///
    /// # Errors
    /// Those of [`read`](Self::read), and files with more than one point.
    pub fn read_one(path: &Path, time_zero: Option<f64>) -> Result<Self, Error> {
        Self::read_point(path, &PointReading { time_zero, ..PointReading::default() })
    }

    /// Reads the motion of one point as [`read_one`](Self::read_one), with the columns, axes and start of `reading`.
    ///
    /// # Errors
    /// Those of [`read_one`](Self::read_one), columns that the file does not have, and a subtraction from positions or
    /// without rows at rest.
    pub(super) fn read_point(path: &Path, reading: &PointReading) -> Result<Self, Error> {
        let rules = reading.columns;
        let stated = rules.map(|_| Format::Csv);
        let (format, bytes) = marker_files::open(path, stated)?;
        if format == Format::Csv {
            let table = Table::of_columns(path, &bytes, rules)?;
            if let Some(columns) = AccelerationColumns::find(&table)? {
                return Ok(integrated(&table, &columns, reading)?);
            }
        }
        if reading.subtract.is_some() {
            let message =
                "found subtract with a recording of positions, allowed: with accelerations only";
            return Err(marker_files::Error::data(path, 1, message).into());
        }
        let (time_zero, axes) = (reading.time_zero, reading.axes);
        let recording =
            Recording { time_zero, axes, columns: rules.cloned(), ..Recording::default() };
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
fn integrated(
    table: &Table,
    columns: &AccelerationColumns,
    reading: &PointReading,
) -> Result<Track, marker_files::Error> {
    // The clock, and the columns of the axes; other columns are rejected, except the size of the acceleration.
    let clocks = ["t", "time"].into_iter().filter_map(|name| table.find(name));
    let clock = match clocks.collect::<Vec<_>>()[..] {
        [clock] => clock,
        _ => table.require("t")?,
    };
    let axes = columns.axes;
    let is_other = |column: &usize| {
        let name = &table.columns[*column].0;
        let is_own = axes.iter().flatten().any(|(own, _)| own == column);
        *column != clock && !is_own && !AccelerationColumns::is_size(name)
    };
    if let Some(other) = (0..table.columns.len()).find(is_other) {
        let name = &table.columns[other].0;
        let message = format!(
            "found the column `{name}` in a file of accelerations, allowed: t, ax, ay and \
                     az, once each"
        );
        return Err(table.error(1, &message));
    }
    let unit = table.factor(clock, &TIMES, "")?;
    let start = reading.time_zero.unwrap_or(0.0);
    let removed = removed_acceleration(table, columns, clock, reading)?;
    // The accelerations row by row, integrated from rest.
    let mut path: Vec<PathPoint> = Vec::with_capacity(table.rows.len());
    let mut last = [0.0; 3];
    for row in &table.rows {
        let blank = || table.error(row.line, "found a blank, allowed: a number");
        let time = (row.values[clock].ok_or_else(blank)? - start) * unit;
        if reading.time_zero.is_some() && time < -CLOCK_TOLERANCE {
            continue;
        }
        let a = sub(components(columns, row).ok_or_else(blank)?, removed);
        let a = reading
            .axes
            .map_or(a, |axes| axes.to_world(a.map(Some)).map(Option::unwrap_or_default));
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
        if position.iter().chain(&velocity).chain(&a).any(|x| !x.is_finite()) {
            let message = "found a motion beyond the range of numbers, allowed: smaller accelerations and times";
            return Err(table.error(row.line, message));
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

/// The components of a row, m/s^2; absent ones are zero. `None` for a row with a blank.
fn components(columns: &AccelerationColumns, row: &TableRow) -> Option<[f64; 3]> {
    let mut found = [0.0; 3];
    for (own, column) in found.iter_mut().zip(columns.axes) {
        if let Some((column, factor)) = column {
            *own = row.values[column]? * factor;
        }
    }
    Some(found)
}

/// The acceleration that is subtracted from every row, m/s^2, along the axes of the sensor; zero unless it is asked
/// for. The mean over the motion is the integral by trapezoids over the duration, so that the velocity at the end is
/// zero. The mean at rest is that of the rows before the start.
///
/// # Errors
/// No rows at rest, or no start that separates them; no duration; a stated acceleration that is not finite, or not zero
/// along an axis without a column.
fn removed_acceleration(
    table: &Table,
    columns: &AccelerationColumns,
    clock: usize,
    reading: &PointReading,
) -> Result<[f64; 3], marker_files::Error> {
    let is_present = |known: [f64; 3]| {
        let mut axes = known.iter().zip(columns.axes);
        axes.all(|(a, column)| a.is_finite() && (*a == 0.0 || column.is_some()))
    };
    let mean = match reading.subtract {
        None => return Ok([0.0; 3]),
        Some(Subtraction::Known(known)) if is_present(known) => return Ok(known),
        Some(Subtraction::Known(known)) => {
            let message = format!(
                "found subtract = {known:?}, allowed: finite numbers, m/s^2, and 0 for axes without a column"
            );
            return Err(table.error(1, &message));
        }
        Some(Subtraction::Mean(mean)) => mean,
    };
    let start = reading.time_zero;
    let known = |row: &TableRow| Some((row.values[clock]?, components(columns, row)?));
    let rows = table.rows.iter().filter_map(known);
    let (mut sum, mut weight) = ([0.0; 3], 0.0);
    match mean {
        SubtractedMean::Rest => {
            for (_, a) in rows.filter(|(time, _)| start.is_some_and(|start| *time < start)) {
                sum = add(sum, a);
                weight += 1.0;
            }
        }
        SubtractedMean::Mean => {
            let rows: Vec<_> = rows
                .filter(|(time, _)| start.is_none_or(|start| *time >= start - CLOCK_TOLERANCE))
                .collect();
            for pair in rows.windows(2) {
                let [(before, a), (after, b)] = [pair[0], pair[1]];
                sum = add(sum, scale(add(a, b), 0.5 * (after - before)));
                weight += after - before;
            }
        }
    }
    match weight > 0.0 && weight.is_finite() {
        true => Ok(scale(sum, weight.recip())),
        false if mean == SubtractedMean::Rest => Err(table.error(
            1,
            "found subtract = \"rest\" without a row before time_zero, allowed: with a sensor at rest in these rows",
        )),
        false => Err(table.error(
            1,
            "found fewer than two rows in ascending order of time from time_zero on, allowed: at least two",
        )),
    }
}

/// The defect [`TrackDefect::Gravity`] if the size of the mean acceleration, the last velocity over the last time,
/// differs from standard gravity by less than [`NEAR_GRAVITY`] of that. None otherwise, and for an empty path.
fn gravity_fault(path: &[PathPoint]) -> Option<TrackDefect> {
    let last = path.last()?;
    let mean = last.velocity.map(|v| v / last.time);
    let size = mean.iter().map(|a| a * a).sum::<f64>().sqrt();
    ((size / STANDARD_GRAVITY - 1.0).abs() < NEAR_GRAVITY).then_some(TrackDefect::Gravity { mean })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Size of the test acceleration `A sin(2 pi t)`, m/s^2, whose mean over a period is zero.
    const SIZE: f64 = 2.0;
    const ROWS: u32 = 200;

    /// A log of `rest` rows at rest and [`ROWS`] rows of motion along x. `offset`, m/s^2, is added to every row.
    fn log(header: &str, separator: &str, comma: bool, rest: u32, offset: [f64; 3]) -> String {
        let row = |k: u32| {
            let t = f64::from(k) / f64::from(ROWS);
            let phase = std::f64::consts::TAU * (f64::from(k) - f64::from(rest)) / f64::from(ROWS);
            let own = if k < rest { 0.0 } else { SIZE * phase.sin() };
            let a = [offset[0] + own, offset[1], offset[2]];
            let size = a.iter().map(|c| c * c).sum::<f64>().sqrt();
            let numbers = [t, a[0], a[1], a[2], size].map(|x| format!("{x:.9E}"));
            let line = numbers.join(separator);
            if comma { line.replace('.', ",") } else { line }
        };
        format!("{header}\n") + &(0..=rest + ROWS).map(|k| row(k) + "\n").collect::<String>()
    }

    /// The header of phyphox with a separator.
    fn header(separator: &str, word: &str) -> String {
        let axis = |axis: &str| format!("\"{word}cceleration {axis} (m/s^2)\"");
        let names = ["x", "y", "z"].map(axis).join(separator);
        format!("\"Time (s)\"{separator}{names}{separator}\"Absolute acceleration (m/s^2)\"")
    }

    /// Reads a log.
    fn read(text: &str, reading: &PointReading) -> Result<Track, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("Accelerometer.csv");
        std::fs::write(&path, text).unwrap();
        Track::read_point(&path, reading).map_err(|error| error.to_string())
    }

    /// Position after one period of `SIZE sin(2 pi t)` from rest: the mean velocity is `SIZE/(2 pi)`.
    fn is_at_the_end(track: &Track, axis: usize, name: &str) {
        let expected = SIZE / std::f64::consts::TAU;
        let found = track.markers()[0].at(1.0_f64);
        // Accelerations are linear between 200 rows: a relative error of (2 pi/200)^2/12.
        for (c, x) in found.into_iter().enumerate() {
            let own = if c == axis { expected } else { 0.0 };
            assert!((x - own).abs() < 2e-4 * expected, "{name}: {found:?}, {expected}");
        }
    }

    #[test]
    fn logs_of_phyphox_are_integrated_in_every_dialect() {
        let dialects = [(",", false), (";", false), ("\t", false), (";", true), ("\t", true)];
        for (separator, comma) in dialects {
            for word in ["A", "Linear A"] {
                let text = log(&header(separator, word), separator, comma, 0, [0.0; 3]);
                let track = read(&text, &PointReading::default()).unwrap();
                is_at_the_end(&track, 0, &format!("{word} {separator:?} {comma}"));
            }
        }
        // Axes of the sensor: its x axis is the world's y axis.
        let axes = Some(Axes::new(["-y", "x", "z"]).unwrap());
        let text = log(&header(",", "A"), ",", false, 0, [0.0; 3]);
        is_at_the_end(
            &read(&text, &PointReading { axes, ..Default::default() }).unwrap(),
            1,
            "axes",
        );
    }

    #[test]
    fn gravity_and_offset_are_subtracted_only_if_asked() {
        let offset = [0.07, -0.11, 9.7];
        let still = log(&header(",", "A"), ",", false, 0, offset);
        let plain = read(&still, &PointReading::default()).unwrap();
        assert!((plain.markers()[0].at(1.0_f64)[2] - 0.5 * 9.7).abs() < 1e-6);
        for subtract in [Subtraction::Known(offset), Subtraction::Mean(SubtractedMean::Mean)] {
            let reading = PointReading { subtract: Some(subtract), ..Default::default() };
            is_at_the_end(&read(&still, &reading).unwrap(), 0, &format!("{subtract:?}"));
        }
        let early = log(&header(",", "A"), ",", false, ROWS, offset);
        let subtract = Some(Subtraction::Mean(SubtractedMean::Rest));
        let reading = PointReading { subtract, time_zero: Some(1.0), ..Default::default() };
        is_at_the_end(&read(&early, &reading).unwrap(), 0, "rest");
        let error = read(&early, &PointReading { time_zero: None, ..reading }).unwrap_err();
        assert!(error.contains("without a row before time_zero"), "{error}");
    }

    #[test]
    fn logs_that_cannot_be_a_motion_are_refused() {
        let subtract = Some(Subtraction::Mean(SubtractedMean::Mean));
        for (text, subtract, words) in [
            ("Time (s),Acceleration x (m/s^2)\n3,0\n4,0\n", None, "Set time_zero"),
            ("t,ax,acc_x\n0,0,0\n1,0,0\n", None, "`ax` and `acc_x`, allowed: one"),
            ("t,ax (furlong)\n0,0\n1,0\n", None, "unit [furlong] of `ax`"),
            ("t,ax,mood\n0,0,0\n1,0,0\n", None, "the column `mood`"),
            ("t,x,y\n0,0,0\n1,0,0\n", subtract, "found subtract with a recording of positions"),
            ("t,ax\n0,0\n", subtract, "fewer than two rows"),
            ("t,ax,ay\n0,0,0\n1,0,0\n", Some(Subtraction::Known([0.0, 0.0, 9.81])), "axes without"),
        ] {
            let error = read(text, &PointReading { subtract, ..Default::default() }).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}

//! Reads the trajectory of a marker from a file, in seconds and meters in the axes of the world.
//!
//! [`read`] converts one marker of a table or of a file of a tracking program, by the keys of a [`Recording`];
//! [`read_several`] markers by their names. Output: [`MarkerTrajectory`] with times, positions, and standard deviations
//! if the key `sigma` states their columns (tables with one marker). It also has the numbers of the frames, and the
//! pixels of the picture in which the positions were measured. Rows before the stated start of the motion and
//! rows without any position are dropped and counted. Times that are negative without a stated start or do not
//! increase, numbers that are not finite, and a file without a usable row are errors, with their line.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{Clock, MarkerFile};
use crate::programs::{load, open_as, parse, read_columns};
use crate::recording::{NOT_FINITE, PixelAxes, Recording, is_finite};
use crate::table::Table;
use crate::unknown_file::describe_position_table;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::Path;

/// Numbers of dropped rows of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Dropped {
    /// Number of rows before the start of the motion.
    pub before_time_zero: usize,
    /// Number of rows without any position.
    pub empty: usize,
}

impl fmt::Display for Dropped {
    /// Writes the numbers of dropped rows that are not zero, each with its reason, separated by commas.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [(self.before_time_zero, "before time_zero"), (self.empty, "without a value")];
        let shown = counts.iter().filter(|(count, _)| *count > 0);
        let shown: Vec<String> = shown.map(|(count, reason)| format!("{count} {reason}")).collect();
        write!(f, "{}", shown.join(", "))
    }
}

/// Positions of a marker at increasing times.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct MarkerTrajectory {
    /// Times since the start of the motion, s.
    pub times: Vec<f64>,
    /// Positions at these times: x, y and z, m; a coordinate that was not observed is `None`.
    pub positions: Vec<[Option<f64>; 3]>,
    /// Standard deviations of all observed coordinates, position by position, m; empty where the file has none.
    pub sigmas: Vec<f64>,
    /// Numbers of rows that were left out.
    pub dropped: Dropped,
    /// Number of the frame of each position: that in the file, or that of its row, from 0, where the file has times
    /// only.
    pub frames: Vec<f64>,
    /// Pixels of the picture in which the positions were measured; `None` if they are lengths.
    pub pixels: Option<PixelAxes>,
}

/// A row of a file in seconds and meters: line, number of the frame, time, position, and standard deviations of its
/// coordinates.
struct ConvertedRow {
    line: u64,
    frame: f64,
    time: f64,
    position: [Option<f64>; 3],
    sigma: [Option<f64>; 3],
}

/// Reads the trajectory of one marker, in seconds and meters in the axes of the world.
///
/// Tables have a column t (or time, or frame) and at least one of x, y, z, in any order, or the key `columns` states
/// them. Separators are commas, semicolons, tabs or spaces; all but commas permit decimal commas, and so do quotes.
/// Units stand in brackets or parentheses, `t[ms],x[mm]`, or at the end, `t_ms,x_mm`; without them s and m. Blank or
/// NaN is missing; lines that start with `#` are comments. Files of programs, and tables of named markers, are
/// recognized.
///
/// # Errors
///
/// A file that cannot be read, a marker that it does not have, and a key that is missing or contradicts it. A line that
/// cannot be used, with its number.
pub fn read(path: &Path, recording: &Recording) -> Result<MarkerTrajectory, Error> {
    let (format, bytes) = open_as(path, recording)?;
    let rules = recording.columns.as_ref();
    let parsed = || match format {
        Format::Csv => read_columns(path, &bytes, rules),
        program => parse(path, program, &bytes),
    };
    if format != Format::Csv || recording.marker.is_some() {
        return convert(&parsed()?, recording);
    }
    let table = Table::of_columns(path, &bytes, rules)?;
    let columns = match recording.columns(&table) {
        Ok(columns) => columns,
        // A table of several markers, or of one with a name.
        Err(error) => {
            let is_unnamed = ["x", "y", "z"].iter().any(|name| table.find(name).is_some());
            return match parsed() {
                Ok(file) if !is_unnamed && recording.sigma.is_none() => convert(&file, recording),
                // An error below the header shows that the header is one of named markers: that error is the useful
                // one.
                Err(own @ Error::Data { line: 2.., .. }) if !is_unnamed => Err(own),
                _ if rules.is_some() => Err(error),
                _ => Err(describe_position_table(path, &bytes, error)),
            };
        }
    };
    let (clock, unit) = columns.time;
    let start = recording.time_zero.unwrap_or(0.0);
    if !start.is_finite() {
        return Err(table.error(1, &format!("found time_zero = {start}, allowed: a finite number")));
    }
    let numbers = table.find("frame");
    let rows = table.rows.iter().enumerate().map(|(k, row)| {
        let reading = row.values[clock]
            .ok_or_else(|| table.error(row.line, "found a blank time, allowed: a number"))?;
        let position = recording.position(&columns.axes, &row.values);
        let time = (reading - start) * unit;
        // Rows that are left out need no standard deviation.
        let observed = position.map(|x| x.is_some() && time >= 0.0 && recording.sigma.is_some());
        let sigma = recording.row_sigma(&table, &columns.sigma, row, observed)?;
        let frame = match numbers {
            Some(column) => row.values[column].unwrap_or(f64::NAN),
            None => k as f64,
        };
        Ok(ConvertedRow { line: row.line, frame, time, position, sigma })
    });
    let read = collect(path, recording, rows)?;
    Ok(MarkerTrajectory { pixels: recording.pixel_axes(&columns.axes), ..read })
}

/// Reads the trajectories, s and m, of several markers by their names, in the order of `markers`; the key `marker` is
/// ignored.
///
/// # Errors
///
/// Those of [`read`]; the key `sigma` is one too.
pub fn read_several<'a>(
    path: &Path,
    recording: &Recording,
    markers: impl IntoIterator<Item = &'a str>,
) -> Result<Vec<MarkerTrajectory>, Error> {
    let file = load(path, recording)?;
    let one =
        |name: &str| convert(&file, &Recording { marker: Some(name.into()), ..recording.clone() });
    markers.into_iter().map(one).collect()
}

/// The trajectory, without standard deviations, of the marker that `recording` selects in a file of a tracking program
/// or a table of named markers, from time zero on if `recording` states it. Errors: no such marker, keys that
/// contradict the file or are missing, times and numbers that cannot be used.
fn convert(file: &MarkerFile, recording: &Recording) -> Result<MarkerTrajectory, Error> {
    let converted = recording.convert(file, recording.select_marker(file)?)?;
    let row = |k: usize| {
        let (line, time) = converted.times[k];
        let frame = match file.clock {
            Clock::Frames { .. } => file.frames[k].clock,
            Clock::Time(_) => k as f64,
        };
        Ok(ConvertedRow { line, frame, time, position: converted.positions[k], sigma: [None; 3] })
    };
    let read = collect(&file.path, recording, (0..converted.times.len()).map(row))?;
    Ok(MarkerTrajectory { pixels: converted.pixels, ..read })
}

/// The trajectory of rows with increasing times, from time zero on if `recording` states the start of the motion
/// (`time_zero`). Rows without any position are left out; rows left out are counted. Errors: that of a row, a number
/// that is not finite, a negative time without `time_zero`, times that do not increase, no usable row.
fn collect(
    path: &Path,
    recording: &Recording,
    rows: impl ExactSizeIterator<Item = Result<ConvertedRow, Error>>,
) -> Result<MarkerTrajectory, Error> {
    let error = |line, message: String| Error::data(path, line, message);
    let count = rows.len();
    let mut own = MarkerTrajectory::default();
    let mut last = f64::NEG_INFINITY;
    for row in rows {
        let ConvertedRow { line, frame, time, position, sigma } = row?;
        if !is_finite(time, &position) {
            return Err(error(line, NOT_FINITE.into()));
        }
        // Without `time_zero` a negative time is a mistake; with it, it is before the start of the motion.
        if time < 0.0 {
            if recording.time_zero.is_some() {
                own.dropped.before_time_zero += 1;
                continue;
            }
            let message = format!(
                "found t = {time} s, allowed: 0 or later. Set time_zero to the time in the file \
                 at which the motion starts"
            );
            return Err(error(line, message));
        }
        if last >= time {
            let message = format!("found t = {time} s after {last} s, allowed: increasing times");
            return Err(error(line, message));
        }
        last = time;
        // A frame in which the marker was lost keeps no row, but its time counts for the order.
        match position.iter().any(Option::is_some) {
            true => {
                own.times.push(time);
                own.frames.push(frame);
                own.positions.push(position);
            }
            false => own.dropped.empty += 1,
        }
        own.sigmas.extend(sigma.iter().flatten());
    }
    if own.times.is_empty() {
        let message = match own.dropped == Dropped::default() {
            true => "found no value below the header, allowed: at least one row with a \
                     value"
                .into(),
            false => format!(
                "no usable value in {count} rows ({}). Check time_zero, likelihood and the units",
                own.dropped
            ),
        };
        return Err(error(1, message));
    }
    Ok(own)
}

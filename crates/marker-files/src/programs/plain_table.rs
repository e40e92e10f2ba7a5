//! Reader of plain tables of markers (CSV).
//!
//! The clock is the column `t`, else `time`, else `frame`; a column `frame` beside a time is skipped. All other columns
//! are `xA, yA, zA` or `A_x, A_y, A_z` of markers A, or x, y and z of a marker without a name. Output: frames with the
//! clock in the unit of the header (s without one) or as frame numbers, and positions. These are in pixels if all
//! columns are, else in m, converted from the units of the header; columns without a unit are in m. If the key
//! `columns` states the columns and none has a unit, the key `scale` may state the unit. Errors, with the line: no
//! clock, other columns or units, two columns of one coordinate, a named marker without x or y, a blank time, times
//! that do not increase, no row.

use crate::accelerations::AccelerationColumns;
use crate::columns::ColumnRules;
use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{Clock, FrameReading, LengthUnit, MarkerData, MarkerFile};
use crate::table::{LENGTHS, TIMES, Table};
use crate::unknown_file::{accelerations, describe_position_table};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Reads the bytes of a table into frames and named markers, with positions in m, or in pixels if all columns are;
/// `path` is for messages. The error of a file that is no table, or that has accelerations, describes its kind.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    read_columns(path, bytes, None)
}

/// Reads the bytes of a table as [`read`], with the columns that `rules` state, if any. With rules the errors are those
/// of the rules and the table, without a description of the kind of the file.
pub(crate) fn read_columns(
    path: &Path,
    bytes: &[u8],
    rules: Option<&ColumnRules>,
) -> Result<MarkerFile, Error> {
    let table = Table::of_columns(path, bytes, rules)?;
    // Names such as `acc_x` would also be those of a marker `acc`.
    if rules.is_none() && matches!(AccelerationColumns::find(&table), Ok(Some(_))) {
        return Err(accelerations(path));
    }
    of_table(path, &table).map_err(|error| match rules {
        Some(_) => error,
        None => describe_position_table(path, bytes, error),
    })
}

/// The markers of a table, with names as in the file and positions in m. They are in pixels if all columns are, and in
/// the unit of a calibration if rules state the columns and none has a unit. The clock is the column `t`, else `time`,
/// else `frame`; a column `frame` beside a time is skipped. Columns are `xA`, or `A_x` if all end with an axis and one
/// does not begin with one. Errors, with the line: no clock, an unknown column or unit, two columns of one coordinate,
/// a named marker without x or y, a blank time, times that do not increase, no row.
fn of_table(path: &Path, table: &Table) -> Result<MarkerFile, Error> {
    let clocks = ["t", "time", "frame"];
    let Some(column) = clocks.into_iter().find_map(|name| table.find(name)) else {
        return Err(table.error(
            1,
            "found no column t, time or frame, allowed: a column of times; points of a rod at \
             rest belong to [[shape]]",
        ));
    };
    let is_frame = table.columns[column].0 == "frame";
    // A frame number is a count; a unit would contradict the frame rate.
    if let Some(unit) = table.columns[column].1.as_ref().filter(|_| is_frame) {
        let message = format!("found the unit [{unit}] of `frame`, allowed: no unit");
        return Err(table.error(1, &message));
    }
    let clock = match is_frame {
        true => Clock::Frames { first: 0.0, rate: None },
        false => Clock::Time(table.factor(column, &TIMES, "")?),
    };
    // A table may have frame numbers in addition to a clock.
    let is_clock = |i: usize| i == column || table.columns[i].0 == "frame";
    let coordinates: Vec<usize> = (0..table.columns.len()).filter(|i| !is_clock(*i)).collect();
    // `tipx` is x of the marker `tip`, not t of `ipx`.
    let behind = coordinates.iter().all(|i| axis_behind(&table.columns[*i].0).is_some())
        && coordinates.iter().any(|i| axis_before(&table.columns[*i].0).is_none());
    let mut names: Vec<(String, &str)> = Vec::new();
    let mut called: HashSet<String> = HashSet::new();
    let mut columns: HashMap<(usize, String), usize> = HashMap::new();
    for i in coordinates {
        let name = &table.columns[i].0;
        let found = if behind { axis_behind(name) } else { axis_before(name) };
        let Some((axis, marker)) = found else {
            let message = format!(
                "found the column `{name}`, allowed: t, and the coordinates of markers as xNAME, \
                 yNAME, zNAME or as NAME_x, NAME_y, NAME_z"
            );
            return Err(table.error(1, &message));
        };
        if columns.insert((axis, marker.to_string()), i).is_some() {
            return Err(table.error(1, &format!("found two columns `{name}`, allowed: one")));
        }
        if called.insert(marker.to_string()) {
            // The name as it is in the file.
            let written = &table.original_names[i];
            let written = match behind {
                true => written.get(..marker.len()),
                false => written.get(1..),
            };
            names.push((marker.to_string(), written.unwrap_or_default()));
        }
    }
    // The clock must be present in every row and increase.
    let mut frames: Vec<FrameReading> = Vec::with_capacity(table.rows.len());
    for row in &table.rows {
        let blank = || table.error(row.line, "found a blank time, allowed: a number");
        let time = row.values[column].ok_or_else(blank)?;
        if let Some(before) = frames.last().filter(|before| before.clock >= time) {
            let message =
                format!("found t = {time} after {}, allowed: increasing times", before.clock);
            return Err(table.error(row.line, &message));
        }
        frames.push(FrameReading { line: row.line, clock: time });
    }
    if frames.is_empty() {
        return Err(table.error(1, "found no row below the header, allowed: at least one"));
    }
    // A mixture of pixels and lengths has no common unit: the factor of each column then rejects pixels.
    let pixels = |i: usize| is_clock(i) || table.columns[i].1.as_deref() == Some("px");
    let pixels = table.columns.len() > 1 && (0..table.columns.len()).all(pixels);
    let mut markers = Vec::with_capacity(names.len());
    for (name, written) in names {
        let mut axes = [None; 3];
        for (c, axis) in axes.iter_mut().enumerate() {
            if let Some(column) = columns.get(&(c, name.clone())).copied() {
                let factor = match pixels {
                    true => 1.0,
                    false => table.factor(column, &LENGTHS, "")?,
                };
                *axis = Some((column, factor));
            }
        }
        if !name.is_empty() && axes[..2].contains(&None) {
            let message = format!(
                "found the marker `{name}` without a column x{name} or y{name}, \
                                   allowed: both columns"
            );
            return Err(table.error(1, &message));
        }
        let position = |row: &crate::table::TableRow| {
            axes.map(|axis| axis.and_then(|(column, factor)| Some(row.values[column]? * factor)))
        };
        markers.push(MarkerData {
            name: written.into(),
            axes: axes.map(|axis| axis.is_some()),
            positions: table.rows.iter().map(position).collect(),
            likelihood: None,
        });
    }
    // The key `columns` may select columns whose unit the file does not name.
    let is_unnamed = |i: usize| is_clock(i) || table.columns[i].1.is_none();
    let unnamed = table.has_rules && (0..table.columns.len()).all(is_unnamed);
    let lengths = match (pixels, unnamed) {
        (true, _) => LengthUnit::Pixels { down: None },
        (false, true) => LengthUnit::Calibrated,
        (false, false) => LengthUnit::Known("m", 1.0),
    };
    Ok(MarkerFile { path: path.into(), format: Format::Csv, clock, lengths, frames, markers })
}

/// Names of the axes, in columns.
const AXES: [char; 3] = ['x', 'y', 'z'];

/// Index of the axis and name of the marker of a column `xA` (the name may be empty); `None` if the column does not
/// begin with an axis.
fn axis_before(name: &str) -> Option<(usize, &str)> {
    let axis = AXES.iter().position(|axis| name.starts_with(*axis))?;
    Some((axis, &name[1..]))
}

/// Index of the axis and name of the marker of a column `A_x`, `A.x`, `A x`, `A-x` or `A/x`; `None` without an axis at
/// the end, a separator or a name.
fn axis_behind(name: &str) -> Option<(usize, &str)> {
    let axis = AXES.iter().position(|axis| name.ends_with(*axis))?;
    let marker = &name[..name.len() - 1];
    let named = marker.strip_suffix(['_', '.', ' ', '-', '/'])?;
    (!named.is_empty()).then_some((axis, named))
}

//! Tables of sensors: columns `fx`, `fy`, `fz`, or `mx`, `ax` and so on, or `angle`, `k1`, `strain`, with a clock, or
//! without one at rest.
//!
//! Input: a file (table of numbers, by its header or the key `columns`), the quantity, the end of the rod, the frame
//! rate, the start of the motion and the window of the readings. Moments may also be named `tx`, `ty`, `tz`. Names of
//! forces and moments may begin with the end, as `start_fx`, and end with the SI unit: `fx_n`, `mx_nm`, `mx_n_m`. Units
//! in brackets: N, mN, kN; `N m`, `mN m`, `N mm`; m/s^2, mm/s^2, g; rad, mrad, deg; 1/m, 1/mm; %, um/m. Output: the
//! readings of every component that the file has, s and N, N m, m/s^2, rad, 1/m or parts of the length. The numbers of
//! rows that were left out, before the start and without a value, are output too. Errors have file and line: a file
//! that is no table or has no component or reading, other units, and angles above a turn or strains above 1 without a
//! unit. So are a blank clock, frames without a rate, times that are negative without a start or do not increase, and a
//! window without a clock.

use crate::error::Error;
use crate::fit::measurement::reading::Reading;
use crate::scene::End;
use crate::scene::pose_table::{LARGEST_ROUNDED_TURN, turns_without_unit};
use marker_files::table::{TIMES, Table, TableRow};
use marker_files::{
    ACCELERATIONS, ANGLES, AccelerationColumns, CURVATURES, ColumnRules, Dropped, FORCES, MOMENTS,
    STRAINS,
};
use serde::Deserialize;
use std::path::Path;

/// Tolerance of the ends of a window, s: rounding errors of times since the start of the motion.
const WINDOW_TOLERANCE: f64 = 1e-9;

/// Quantity of a sensor in a fit file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum SensorQuantity {
    /// Force of a support on the rod, N.
    Force,
    /// Moment of a support on the rod about the point of the support, N m.
    Moment,
    /// Acceleration of a point less gravity, m/s^2, in axes of the rod.
    Acceleration,
    /// Angle of the tangent at a point, rad.
    Angle,
    /// Curvature at a point along both material directors, 1/m.
    Curvature,
    /// Strain along the rod at a point, on the axis or beside it.
    Strain,
    /// Orientation of the rod at a point, tangent and directors.
    Pose,
}

impl SensorQuantity {
    /// Whether the sensor is under a support, and not at a point of the rod.
    pub fn is_of_support(self) -> bool {
        matches!(self, Self::Force | Self::Moment)
    }

    /// Number of components: one of an angle or strain, two of a curvature, else three. Those of a pose are the
    /// rotations about three axes.
    pub fn components(self) -> usize {
        match self {
            Self::Angle | Self::Strain => 1,
            Self::Curvature => 2,
            Self::Force | Self::Moment | Self::Acceleration | Self::Pose => 3,
        }
    }

    /// Alternative names of the columns of the three components, without a prefix of the end, and the allowed units
    /// with their factors to the SI unit. A name is empty for a component that the quantity does not have. A pose has
    /// no such columns: `read_rotations` reads its tables.
    fn columns(self) -> (Vec<[String; 3]>, &'static [(&'static str, f64)]) {
        let by_axis = |letter: &str, ending: &str| {
            ["x", "y", "z"].map(|axis| format!("{letter}{axis}{ending}"))
        };
        let all = |letters: &[&str], endings: &[&str]| {
            let with = |letter: &str| endings.iter().map(|end| by_axis(letter, end)).collect();
            letters.iter().flat_map(|letter| -> Vec<_> { with(letter) }).collect::<Vec<_>>()
        };
        let alone = |name: &str| [name.to_string(), String::new(), String::new()];
        match self {
            Self::Force => (all(&["f"], &["", "_n"]), &FORCES),
            Self::Moment => (all(&["m", "t"], &["", "_nm", "_n_m"]), &MOMENTS),
            Self::Acceleration => (all(&["a", "acc_", "acc"], &[""]), &ACCELERATIONS),
            Self::Angle => (["angle", "theta"].map(alone).into(), &ANGLES),
            Self::Curvature => {
                let both = |k: &str| [format!("{k}1"), format!("{k}2"), String::new()];
                (vec![both("k"), both("kappa"), alone("curvature")], &CURVATURES)
            }
            Self::Strain => (["strain", "eps", "epsilon"].map(alone).into(), &STRAINS),
            Self::Pose => (vec![alone("")], &ANGLES),
        }
    }
}

/// Interpretation of a table of a sensor.
pub(crate) struct SensorTable<'a> {
    /// The measured quantity.
    pub quantity: SensorQuantity,
    /// End of the rod, for names that begin with it; `None` of a sensor at a point.
    pub of: Option<End>,
    /// Columns by name or number.
    pub columns: Option<&'a ColumnRules>,
    /// Frames per second, Hz, for a clock of frame numbers.
    pub fps: Option<f64>,
    /// Time on the file's own clock, in its unit, at which the motion starts.
    pub time_zero: Option<f64>,
    /// First and last time of the readings that are used, s after the start of the motion; `None`: all.
    pub window: Option<[f64; 2]>,
}

/// Readings of the three components, empty for a component that the file does not have, and dropped rows.
pub(crate) struct ComponentReadings {
    pub components: [Vec<Reading>; 3],
    pub dropped: Dropped,
    /// Name of the column of an angle without a unit, which was read as rad.
    pub assumed_unit: Option<String>,
}

/// Use of a row of a file by its time.
pub(super) enum RowUse {
    /// A reading of the sensor.
    Reading,
    /// A row before the given start of the motion.
    BeforeStart,
    /// A row outside the window.
    OutsideWindow,
}

/// Clock of a table: its column, and its unit in s.
#[derive(Clone, Copy)]
pub(super) struct TableClock {
    column: usize,
    unit: f64,
}

impl SensorTable<'_> {
    /// Reads the components of a sensor from the file at `path`, in SI units, s after the start of the motion. Rows
    /// before a given start and rows without a value are left out and counted. Rows outside the window are left out.
    ///
    /// # Errors
    /// A file that cannot be read or is no table, without a component or any reading, or with another unit. Times that
    /// cannot be used: blank, negative without a start, not after that of the reading before, or frames without a rate.
    /// A start that is not finite. A
    /// window of a table without a clock.
    pub fn read(&self, path: &Path) -> Result<ComponentReadings, Error> {
        let bytes = marker_files::file::data(path)?;
        let table = Table::of_columns(path, &bytes, self.columns)?;
        let columns = self.component_columns(&table)?;
        let clock = self.clock(&table)?;
        self.check_window(&table, clock.is_some())?;
        let start = self.start().map_err(|message| table.error(1, &message))?;
        let mut read = ComponentReadings {
            components: std::array::from_fn(|_| Vec::new()),
            dropped: Dropped::default(),
            assumed_unit: None,
        };
        for row in &table.rows {
            let time = clock.map(|clock| clock.time(&table, row, start)).transpose()?;
            match self.row_use(time).map_err(|message| table.error(row.line, &message))? {
                RowUse::Reading => {}
                RowUse::BeforeStart => {
                    read.dropped.before_time_zero += 1;
                    continue;
                }
                RowUse::OutsideWindow => continue,
            }
            let mut is_empty = true;
            for (readings, column) in read.components.iter_mut().zip(columns) {
                let Some((column, unit)) = column else { continue };
                let Some(value) = row.values[column] else { continue };
                check_order(readings.last().and_then(|last| last.time), time)
                    .map_err(|message| table.error(row.line, &message))?;
                readings.push(Reading { time, value: value * unit });
                is_empty = false;
            }
            read.dropped.empty += usize::from(is_empty);
        }
        read.assumed_unit =
            self.assumed_unit(&table, columns[0].map(|own| own.0), &read.components[0])?;
        if !read.components.iter().all(Vec::is_empty) {
            return Ok(read);
        }
        Err(table.error(1, &self.no_reading()).into())
    }

    /// Name of the column of an angle without a unit, which is read as rad; none of other quantities. Errors for more
    /// than a turn, which are degrees in most files, and for strains above 1 in a column without a unit.
    fn assumed_unit(
        &self,
        table: &Table,
        column: Option<usize>,
        readings: &[Reading],
    ) -> Result<Option<String>, Error> {
        let column = column.map(|column| &table.columns[column]);
        let Some((name, _)) = column.filter(|(_, unit)| unit.is_none()) else { return Ok(None) };
        let largest = readings.iter().map(|reading| reading.value.abs()).fold(0.0, f64::max);
        match self.quantity {
            SensorQuantity::Angle if largest > LARGEST_ROUNDED_TURN => {
                Err(table.error(1, &turns_without_unit(name, largest)).into())
            }
            SensorQuantity::Angle => Ok(Some(name.clone())),
            SensorQuantity::Strain if largest > 1.0 => {
                let message = format!(
                    "found strains up to {largest} in the column {name} without a unit, which is a part of the length, \
                     allowed: {name}[um/m] or {name}[%]"
                );
                Err(table.error(1, &message).into())
            }
            _ => Ok(None),
        }
    }

    /// The start of the motion on the clock of the file, in its unit. A message if it is not finite.
    pub(super) fn start(&self) -> Result<f64, String> {
        let start = self.time_zero.unwrap_or(0.0);
        match start.is_finite() {
            true => Ok(start),
            false => Err(format!("found time_zero = {start}, allowed: a finite number")),
        }
    }

    /// Rejects the window of a table without a clock.
    pub(super) fn check_window(&self, table: &Table, has_clock: bool) -> Result<(), Error> {
        if !has_clock && self.window.is_some() {
            let message = "found the key window and no clock, allowed: a column t, time or frame";
            return Err(table.error(1, message).into());
        }
        Ok(())
    }

    /// The use of a row by its time, s after the start of the motion; `None` of a row at rest. A message for a time
    /// before 0 without a given start.
    pub(super) fn row_use(&self, time: Option<f64>) -> Result<RowUse, String> {
        let Some(time) = time else { return Ok(RowUse::Reading) };
        if time < 0.0 {
            return match self.time_zero {
                Some(_) => Ok(RowUse::BeforeStart),
                None => Err(format!(
                    "found the time {time} s, allowed: times from 0 on. State time_zero, the time at which the motion \
                     starts"
                )),
            };
        }
        let is_inside = self.window.is_none_or(|[first, last]| {
            (first - WINDOW_TOLERANCE..=last + WINDOW_TOLERANCE).contains(&time)
        });
        Ok(if is_inside { RowUse::Reading } else { RowUse::OutsideWindow })
    }

    /// The message for a file without any reading.
    pub(super) fn no_reading(&self) -> String {
        let within = self.window.map_or(String::new(), |[first, last]| {
            format!(" in the window from {first} to {last} s after the start of the motion")
        });
        format!("found no reading{within}, allowed: at least one row with a value")
    }

    /// The column of each of the three components, with the factor to the SI unit; `None` for a component that the
    /// table does not have. Names may begin with the end of the rod. An error without any component, or for an unknown
    /// unit.
    fn component_columns(&self, table: &Table) -> Result<[Option<(usize, f64)>; 3], Error> {
        // Logs of accelerometers have names of their own.
        if self.quantity == SensorQuantity::Acceleration
            && let Some(found) = AccelerationColumns::find(table)?
        {
            return match found.is_linear {
                false => Ok(found.axes),
                true => {
                    let message = "found linear accelerations, from which the program has subtracted gravity, allowed: \
                                   accelerations with gravity, as the sensor measures them";
                    Err(table.error(1, message).into())
                }
            };
        }
        let end = self.of.map(|of| match of {
            End::Start => "start",
            End::End => "end",
        });
        let (names, units) = self.quantity.columns();
        let mut columns = [None; 3];
        for (axis, slot) in columns.iter_mut().enumerate() {
            let own = names.iter().map(|names| &names[axis]).filter(|name| !name.is_empty());
            let candidates = own.flat_map(|own| {
                end.map(|end| format!("{end}_{own}")).into_iter().chain([own.clone()])
            });
            if let Some(column) = candidates.into_iter().find_map(|name| table.find(&name)) {
                *slot = Some((column, table.factor(column, units, "")?));
            }
        }
        if columns.iter().all(Option::is_none) {
            let first = names[0].iter().filter(|name| !name.is_empty());
            let allowed = first.cloned().collect::<Vec<_>>().join(", ");
            let message = format!(
                "found the columns {}, allowed: at least one of {allowed}, or the key columns",
                table.columns_found()
            );
            return Err(table.error(1, &message).into());
        }
        Ok(columns)
    }

    /// The clock of a table, column and unit in s: `t` or `time` in its unit, or `frame` by the frame rate; `None` of a
    /// table without one, at rest. An error for frames without a rate, and an unknown unit.
    pub(super) fn clock(&self, table: &Table) -> Result<Option<TableClock>, Error> {
        if let Some(column) = table.find("t").or_else(|| table.find("time")) {
            return Ok(Some(TableClock { column, unit: table.factor(column, &TIMES, "")? }));
        }
        let Some(column) = table.find("frame") else { return Ok(None) };
        match self.fps {
            Some(fps) if fps.is_finite() && fps > 0.0 => {
                Ok(Some(TableClock { column, unit: fps.recip() }))
            }
            _ => {
                let found = "found the clock frame without a rate, allowed: fps, frames per second";
                Err(table.error(1, found).into())
            }
        }
    }
}

/// Rejects the time, s, of a reading that is not after that of the reading before. Readings at rest have none. The
/// message has both.
pub(super) fn check_order(before: Option<f64>, time: Option<f64>) -> Result<(), String> {
    match before.zip(time) {
        Some((before, time)) if time <= before => {
            Err(format!("found t = {time} s after {before} s, allowed: increasing times"))
        }
        _ => Ok(()),
    }
}

impl TableClock {
    /// The time of a `row`, s: its clock reading less `start`, both in the unit of the clock, times this unit. An error
    /// for a blank.
    pub(super) fn time(self, table: &Table, row: &TableRow, start: f64) -> Result<f64, Error> {
        let reading = row.values[self.column]
            .ok_or_else(|| table.error(row.line, "found a blank time, allowed: a number"))?;
        Ok((reading - start) * self.unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<ComponentReadings, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("Accelerometer.csv");
        std::fs::write(&path, text).unwrap();
        let table = SensorTable {
            quantity: SensorQuantity::Acceleration,
            of: None,
            columns: None,
            fps: None,
            time_zero: None,
            window: None,
        };
        table.read(&path).map_err(|error| error.to_string())
    }

    /// The error names file, line and both times. A row without a value may repeat a time, as may another component.
    #[test]
    fn times_that_do_not_increase_are_rejected_with_their_line() {
        for (last, found) in [("0.1", "t = 0.1 s after 0.2 s"), ("0.2", "t = 0.2 s after 0.2 s")] {
            let error = read(&format!("t,ax\n0,1\n0.2,2\n{last},3\n")).map(|_| ()).unwrap_err();
            assert!(error.contains(&format!("Accelerometer.csv:4: found {found}")), "{error}");
        }
        let found = read("t,ax,ay\n0,1,\n0,,2\n0.1,1,\n0.1,,2\n").unwrap();
        assert_eq!(found.components.map(|readings| readings.len()), [2, 2, 0]);
    }

    #[test]
    fn logs_of_accelerometers_are_read_in_si_units() {
        let rows = "0.1;1.5E0;-2,5E-1;9.806650000E0;3\n".replace('.', ",");
        let head = "\"Time (s)\";\"Acceleration x (UNIT)\";\"Acceleration y (UNIT)\";\"Acceleration z (UNIT)\"";
        let head = format!("{head};\"Absolute acceleration (UNIT)\"\n");
        for (unit, factor) in [("m/s^2", 1.0), ("m/s\u{b2}", 1.0), ("g", 9.80665)] {
            let found = read(&(head.replace("UNIT", unit) + &rows)).unwrap();
            let values = found.components.map(|readings| (readings[0].time, readings[0].value));
            let expected = [1.5, -0.25, 9.80665].map(|a| (Some(0.1), a * factor));
            assert_eq!(values, expected, "{unit}");
        }
        for header in ["t,accel_x,accel_y", "time,Acc X,Acc Y", "t,acceleration_x,acceleration_y"] {
            let found = read(&format!("{header}\n0,1,2\n")).unwrap();
            assert_eq!(found.components.map(|readings| readings.len()), [1, 1, 0], "{header}");
        }
        let text = "Time (s),Linear Acceleration x (m/s^2)\n0,1\n";
        let error = read(text).map(|_| ()).unwrap_err();
        assert!(error.contains("has subtracted gravity"), "{error}");
    }
}

//! Tables of force and moment sensors: columns `fx`, `fy`, `fz` or `mx`, `my`, `mz` with a clock, or without one at rest.
//!
//! Input: a file (table of numbers, by its header or the key `columns`), the part of the reaction, the end of the rod, the
//! frame rate and the start of the motion. Moments may also be named `tx`, `ty`, `tz`; names may begin with the end, as
//! `start_fx`, and end with a unit, as `fx_n`. Units in brackets are mN, N, kN, or N m, mN m, N mm. Output: the readings of
//! every component that the file has, s and N or N m, and the numbers of rows that were left out: those before the start,
//! and those without a value. A file that is no table or has no component, other units, a blank clock, and times that are
//! negative without a start are errors with file and line.

use crate::error::Error;
use crate::fit::measurement::reading::Reading;
use crate::fit::measurement::sensor::ReactionPart;
use crate::scene::End;
use marker_files::table::{TIMES, Table, TableRow};
use marker_files::{ColumnRules, Dropped};
use std::path::Path;

/// Units of force with their sizes in N.
pub(crate) const FORCES: [(&str, f64); 3] = [("N", 1.0), ("mN", 1e-3), ("kN", 1e3)];
/// Units of moment with their sizes in N m.
pub(crate) const MOMENTS: [(&str, f64); 8] = [
    ("N m", 1.0),
    ("Nm", 1.0),
    ("N*m", 1.0),
    ("mN m", 1e-3),
    ("mNm", 1e-3),
    ("N mm", 1e-3),
    ("Nmm", 1e-3),
    ("N*mm", 1e-3),
];

/// Interpretation of a table of a sensor.
pub(crate) struct SensorTable<'a> {
    /// Force or moment.
    pub part: ReactionPart,
    /// End of the rod, for names that begin with it.
    pub of: End,
    /// Columns by name or number.
    pub columns: Option<&'a ColumnRules>,
    /// Frames per second, Hz, for a clock of frame numbers.
    pub fps: Option<f64>,
    /// Time on the file's own clock, in its unit, at which the motion starts.
    pub time_zero: Option<f64>,
}

/// Readings of the three components, empty for a component that the file does not have, and dropped rows.
pub(crate) struct ComponentReadings {
    pub components: [Vec<Reading>; 3],
    pub dropped: Dropped,
}

/// Clock of a table: its column, and its unit in s.
#[derive(Clone, Copy)]
struct TableClock {
    column: usize,
    unit: f64,
}

impl SensorTable<'_> {
    /// Reads the components of a sensor from a file.
    ///
    /// # Errors
    /// A file that cannot be read or is no table, without a component, with another unit, or with times that cannot be used.
    pub fn read(&self, path: &Path) -> Result<ComponentReadings, Error> {
        let bytes = marker_files::file::data(path)?;
        let table = Table::of_columns(path, &bytes, self.columns)?;
        let columns = self.component_columns(&table)?;
        let clock = self.clock(&table)?;
        let start = self.time_zero.unwrap_or(0.0);
        if !start.is_finite() {
            let message = format!("found time_zero = {start}, allowed: a finite number");
            return Err(table.error(1, &message).into());
        }
        let mut read = ComponentReadings {
            components: std::array::from_fn(|_| Vec::new()),
            dropped: Dropped::default(),
        };
        for row in &table.rows {
            let time = clock.map(|clock| clock.time(&table, row, start)).transpose()?;
            if let Some(early) = time.filter(|time| *time < 0.0) {
                if self.time_zero.is_none() {
                    let message = format!(
                        "found the time {early} s, allowed: times from 0 on. State time_zero, the time at which the \
                         motion starts"
                    );
                    return Err(table.error(row.line, &message).into());
                }
                read.dropped.before_time_zero += 1;
                continue;
            }
            let mut is_empty = true;
            for (readings, column) in read.components.iter_mut().zip(columns) {
                let Some((column, unit)) = column else { continue };
                let Some(value) = row.values[column] else { continue };
                readings.push(Reading { time, value: value * unit });
                is_empty = false;
            }
            read.dropped.empty += usize::from(is_empty);
        }
        match read.components.iter().all(Vec::is_empty) {
            true => Err(table
                .error(1, "found no reading, allowed: at least one row with a value")
                .into()),
            false => Ok(read),
        }
    }

    /// The columns of the three components with their units; an error without any.
    fn component_columns(&self, table: &Table) -> Result<[Option<(usize, f64)>; 3], Error> {
        let end = match self.of {
            End::Start => "start",
            End::End => "end",
        };
        let (letters, endings, units): (&[&str], &[&str], &[(&str, f64)]) = match self.part {
            ReactionPart::Force => (&["f"], &["", "_n"], &FORCES),
            ReactionPart::Moment => (&["m", "t"], &["", "_nm", "_n_m"], &MOMENTS),
        };
        let mut columns = [None; 3];
        for (slot, axis) in columns.iter_mut().zip(["x", "y", "z"]) {
            let names = letters.iter().flat_map(|letter| {
                endings.iter().flat_map(move |ending| {
                    let own = format!("{letter}{axis}{ending}");
                    [format!("{end}_{own}"), own]
                })
            });
            if let Some(column) = names.into_iter().find_map(|name| table.find(&name)) {
                *slot = Some((column, table.factor(column, units, "")?));
            }
        }
        if columns.iter().all(Option::is_none) {
            let letter = letters[0];
            let message = format!(
                "found the columns {}, allowed: at least one of {letter}x, {letter}y, {letter}z, or the key columns",
                table.columns_found()
            );
            return Err(table.error(1, &message).into());
        }
        Ok(columns)
    }

    /// The clock of a table: `t` or `time`, or `frame` with the frame rate; `None` of a table without one, at rest.
    fn clock(&self, table: &Table) -> Result<Option<TableClock>, Error> {
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

impl TableClock {
    /// The time of a row since the `start`, in the unit of the clock, s; an error for a blank.
    fn time(self, table: &Table, row: &TableRow, start: f64) -> Result<f64, Error> {
        let reading = row.values[self.column]
            .ok_or_else(|| table.error(row.line, "found a blank time, allowed: a number"))?;
        Ok((reading - start) * self.unit)
    }
}

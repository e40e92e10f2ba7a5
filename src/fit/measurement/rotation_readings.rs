//! Files of measured rotations of a sensor that is fixed to a point of the rod.
//!
//! Input of [`SensorTable::read_rotations`]: a table of numbers with one form of the rotation of recorded poses (a
//! quaternion `qw, qx, qy, qz`, a rotation vector `rx, ry, rz`, or an axis `ux, uy, uz` with an `angle`), with a clock,
//! or without one at rest; or an export of OptiTrack Motive with rigid bodies. Clock, start and window are those of
//! other sensors. Output: the quaternions of length one of the rotation from the axes of the sensor to those of the
//! world ([`RotationReading`]), with times in s, and the numbers of rows that were left out. Positions are ignored.
//!
//! Errors, with file and line: those of clocks of sensors, a rotation in no form or in several, a row that is blank in
//! part, a quaternion or axis whose length is not 1 within 1 %, a rigid body that the file does not have, a body of a
//! table, and no reading.

use crate::error::Error;
use crate::fit::measurement::sensor_table::{RowUse, SensorQuantity, SensorTable, check_order};
use crate::scene::gripper_frame::unit_quaternion;
use crate::scene::pose_table::RotationColumns;
use marker_files::table::Table;
use marker_files::{Dropped, Format, Recording};
use std::path::Path;

/// A measured rotation of a sensor, with its time in a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotationReading {
    /// Time from the start of the motion, s; none of a rod at rest under the loads of the scene.
    pub time: Option<f64>,
    /// Quaternion `[w, x, y, z]` of the rotation from the axes of the sensor to those of the world. Its length is 1
    /// within 1 %. The negative of it is the same rotation.
    pub quaternion: [f64; 4],
}

impl RotationReading {
    /// Reads the rotations in the file at `path`: a table, or an export of Motive, of whose rigid bodies `body` is the
    /// name (default: the only one). Of the `recording` the columns, the frame rate and the start of the motion are
    /// used.
    ///
    /// # Errors
    /// A file that cannot be read, and those of the module's header, with file and line.
    ///
    /// ```
    /// use rodfit::fit::{Recording, RotationReading};
    /// # let folder = tempfile::tempdir()?;
    /// # let path = folder.path().join("cluster.csv");
    /// std::fs::write(&path, "t[ms],rx[deg],ry[deg],rz[deg]\n0,0,0,0\n10,0,0,180\n")?;
    /// let readings = RotationReading::read_all(&path, &Recording::default(), None)?;
    /// assert_eq!((readings[1].time, readings[1].quaternion[3]), (Some(0.01), 1.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn read_all(
        path: &Path,
        recording: &Recording,
        body: Option<&str>,
    ) -> Result<Vec<Self>, Error> {
        let table = SensorTable {
            quantity: SensorQuantity::Pose,
            of: None,
            columns: recording.columns.as_ref(),
            fps: recording.fps,
            time_zero: recording.time_zero,
            window: None,
        };
        Ok(table.read_rotations(path, body)?.readings)
    }
}

/// The rotations of a file, the numbers of rows that were left out, and a column without a unit.
#[derive(Default)]
pub(crate) struct RecordedRotations {
    pub readings: Vec<RotationReading>,
    pub dropped: Dropped,
    /// Name of a column of angles without a unit, which were read as rad.
    pub assumed_unit: Option<String>,
}

impl RecordedRotations {
    /// Adds a row with its use by its time, s, and its quaternion, none of a blank row. A message for a quaternion
    /// whose length is not 1, and for a time that is not after that of the reading before.
    fn push(
        &mut self,
        row_use: RowUse,
        time: Option<f64>,
        quaternion: impl FnOnce() -> Result<Option<[f64; 4]>, String>,
    ) -> Result<(), String> {
        match row_use {
            RowUse::OutsideWindow => return Ok(()),
            RowUse::BeforeStart => self.dropped.before_time_zero += 1,
            RowUse::Reading => match quaternion()? {
                None => self.dropped.empty += 1,
                Some(found) => {
                    let quaternion = unit_quaternion(found)?;
                    check_order(self.readings.last().and_then(|last| last.time), time)?;
                    self.readings.push(RotationReading { time, quaternion });
                }
            },
        }
        Ok(())
    }
}

impl SensorTable<'_> {
    /// Reads the rotations in the file at `path`. In an export of Motive `body` is the name of the rigid body; without
    /// it the export must have exactly one. Errors are those of the header.
    pub fn read_rotations(
        &self,
        path: &Path,
        body: Option<&str>,
    ) -> Result<RecordedRotations, Error> {
        let (format, bytes) = marker_files::open(path, self.columns.map(|_| Format::Csv))?;
        let at = |line: u64, message: String| marker_files::Error::data(path, line, message);
        let start = self.start().map_err(|message| at(1, message))?;
        let mut found = RecordedRotations::default();
        if format == Format::Motive {
            let read = marker_files::read_bodies(path, &bytes)?;
            let body = read.select(body).map_err(|message| at(1, message))?;
            for ((line, clock), pose) in read.lines.iter().zip(&read.times).zip(&body.poses) {
                let time = Some(clock - start);
                let quaternion = || Ok(pose.map(|pose| pose.quaternion));
                let pushed = self.row_use(time).and_then(|own| found.push(own, time, quaternion));
                pushed.map_err(|message| at(*line, message))?;
            }
        } else if let Some(body) = body {
            let message = format!("found body = {body:?}, allowed: with an export of Motive only");
            return Err(at(1, message).into());
        } else {
            let table = Table::of_columns(path, &bytes, self.columns)?;
            let columns = RotationColumns::find(&table, |name| table.find(name))?;
            found.assumed_unit = columns.assumed_unit(&table);
            let clock = self.clock(&table)?;
            self.check_window(&table, clock.is_some())?;
            for row in &table.rows {
                let time = clock.map(|clock| clock.time(&table, row, start)).transpose()?;
                let is_blank = || columns.columns().iter().all(|c| row.values[*c].is_none());
                let quaternion = || match is_blank() {
                    true => Ok(None),
                    false => columns.quaternion(&table, row).map(Some),
                };
                let pushed = self.row_use(time).and_then(|own| found.push(own, time, quaternion));
                pushed.map_err(|message| table.error(row.line, &message))?;
            }
        }
        match found.readings.is_empty() {
            true => Err(at(1, self.no_reading()).into()),
            false => Ok(found),
        }
    }
}

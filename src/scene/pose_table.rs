//! Tables of the recorded position and rotation of a gripper.
//!
//! Input of [`Track::read_poses`]: a table of numbers with a clock, the position x, y, z, and one of three forms of the
//! rotation from the axes of the gripper to those of the world: the quaternion `qw, qx, qy, qz`, the rotation vector
//! `rx, ry, rz`, rad, or the unit axis `ux, uy, uz` with the `angle`, rad. Names may begin with the end of the rod, as
//! `start_x`. Other columns are ignored. Rows before a given start time, in the unit of the file's clock, are skipped;
//! rows with blanks only are missing frames. Instead of a table the file may be an export of OptiTrack Motive, whose
//! rigid bodies have positions and rotations.
//!
//! Output: the [`Track`] of three points of the gripper ([`gripper_frame`](crate::scene::gripper_frame)), m and s.
//!
//! Errors, with file and line: a rotation in no form or in several, a partly blank row, a clock that does not increase
//! or does not start at 0, a rigid body that the file does not have, an axis whose length is not 1 within 1 %, more
//! than a turn in a column without a unit, and invalid or too distant poses of the track.

use crate::error::Error;
use crate::numerics::vector::{Vector, dot, scale};
use crate::scene::gripper_frame::{GripperFrame, PosedFrames, check_length};
use crate::scene::support::End;
use crate::scene::track::{CLOCK_TOLERANCE, TIME_ZERO_REMEDY, Track, check_clock};
use marker_files::table::{LENGTHS, TIMES, Table, TableRow};
use marker_files::{ANGLES, ColumnRules, Format, RecordedBodyPose};
use std::f64::consts::TAU;
use std::path::Path;

/// Angle in a column without a unit above which it is more than a turn, rad: a turn, with a margin for rounding.
pub(crate) const LARGEST_ROUNDED_TURN: f64 = TAU * (1.0 + 1e-3);

/// Columns of the rotation in a table, with the factors of their units.
pub(crate) enum RotationColumns {
    /// A quaternion `qw, qx, qy, qz`.
    Quaternion([usize; 4]),
    /// A rotation vector `rx, ry, rz`; `factors` convert it to rad.
    Vector { columns: [usize; 3], factors: [f64; 3] },
    /// An axis `ux, uy, uz` and an `angle`; `factor` converts the angle to rad.
    AxisAngle { axis: [usize; 3], angle: usize, factor: f64 },
}

/// Columns of a table of poses, with the factors of the units of clock and position.
struct PoseColumns {
    clock: usize,
    clock_unit: f64,
    position: [usize; 3],
    position_units: [f64; 3],
    rotation: RotationColumns,
}

impl Track {
    /// Reads the motion of a gripper from the table of numbers at `path`. `columns` states the columns of the clock,
    /// the position and the rotation, if the header has other names. Names may begin with `end`. Rows before
    /// `time_zero`, on the file's clock and in its unit, are skipped, and times count from there; 0 if absent. In an
    /// export of OptiTrack Motive `body` is the name of the rigid body; without it the export must have exactly one.
    ///
    /// # Errors
    /// A file that cannot be read or is no table, and those of the module's header, with the line. Columns of an
    /// export, and a body of a table.
    pub fn read_poses(
        path: &Path,
        time_zero: Option<f64>,
        columns: Option<&ColumnRules>,
        end: End,
        body: Option<&str>,
    ) -> Result<Self, Error> {
        let (format, bytes) = marker_files::open(path, columns.map(|_| Format::Csv))?;
        let refused = |message: String| Error::from(marker_files::Error::data(path, 1, message));
        if format == Format::Motive {
            return Self::of_body(path, &bytes, time_zero, body);
        }
        if let Some(body) = body {
            let message = format!("found body = {body:?}, allowed: with an export of Motive only");
            return Err(refused(message));
        }
        let table = Table::of_columns(path, &bytes, columns)?;
        let columns = PoseColumns::find(&table, end)?;
        let (mut times, mut frames) = (Vec::<f64>::new(), PosedFrames::default());
        for row in &table.rows {
            let in_row = |message: String| Error::from(table.error(row.line, &message));
            let blank = || in_row("found a blank time, allowed: a number".into());
            let clock = row.values[columns.clock].ok_or_else(blank)?;
            let time = (clock - time_zero.unwrap_or(0.0)) * columns.clock_unit;
            if time_zero.is_some() && time < -CLOCK_TOLERANCE {
                continue;
            }
            match times.last() {
                None => check_clock(time, TIME_ZERO_REMEDY).map_err(in_row)?,
                Some(before) if time <= *before => {
                    let message = format!("t = {time} s after {before} s, allowed: increasing");
                    return Err(in_row(message));
                }
                Some(_) => {}
            }
            let pose = columns.pose(&table, row).map_err(in_row)?;
            frames.push(pose).map_err(in_row)?;
            times.push(time);
        }
        Ok(frames.into_track(times).map_err(|message| table.error(1, &message))?)
    }

    /// The motion of a rigid body in the bytes of an export of Motive. Frames before `time_zero`, s, are skipped.
    fn of_body(
        path: &Path,
        bytes: &[u8],
        time_zero: Option<f64>,
        body: Option<&str>,
    ) -> Result<Self, Error> {
        let read = marker_files::read_bodies(path, bytes)?;
        let at = |line: u64, message: String| marker_files::Error::data(path, line, message);
        let body = read.select(body).map_err(|message| at(1, message))?;
        let (mut times, mut frames) = (Vec::new(), PosedFrames::default());
        for ((line, clock), pose) in read.lines.iter().zip(&read.times).zip(&body.poses) {
            let time = clock - time_zero.unwrap_or(0.0);
            if time_zero.is_some() && time < -CLOCK_TOLERANCE {
                continue;
            }
            if times.is_empty() {
                check_clock(time, TIME_ZERO_REMEDY).map_err(|message| at(*line, message))?;
            }
            let frame = pose.map(|RecordedBodyPose { position, quaternion }| GripperFrame {
                position,
                quaternion,
            });
            frames.push(frame).map_err(|message| at(*line, message))?;
            times.push(time);
        }
        Ok(frames.into_track(times).map_err(|message| at(1, message))?)
    }
}

impl PoseColumns {
    /// The columns of a table. Names with the prefix of the `end` are preferred. An error for a missing clock or
    /// position, for rotations in no form or in several, and for unknown units.
    fn find(table: &Table, end: End) -> Result<Self, Error> {
        let prefix = match end {
            End::Start => "start_",
            End::End => "end_",
        };
        let column =
            |name: &str| table.find(&format!("{prefix}{name}")).or_else(|| table.find(name));
        let clock = match table.find("t").or_else(|| table.find("time")) {
            Some(clock) => clock,
            None => table.require("t")?,
        };
        let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(column) else {
            let allowed = "t and x, y, z of the position, or the key columns";
            return Err(missing(table, allowed));
        };
        let rotation = RotationColumns::find(table, column)?;
        let length = |column: usize| table.factor(column, &LENGTHS, "");
        Ok(Self {
            clock,
            clock_unit: table.factor(clock, &TIMES, "")?,
            position: [x, y, z],
            position_units: [length(x)?, length(y)?, length(z)?],
            rotation,
        })
    }

    /// The pose in a row; none if all of its fields are blank. A message for a row that is blank in part, and for an
    /// axis whose length is not 1.
    fn pose(&self, table: &Table, row: &TableRow) -> Result<Option<GripperFrame>, String> {
        let own = [&self.position[..], &self.rotation.columns()].concat();
        if own.iter().all(|column| row.values[*column].is_none()) {
            return Ok(None);
        }
        let mut position = [0.0; 3];
        for (c, x) in position.iter_mut().enumerate() {
            *x = value(table, row, self.position[c])? * self.position_units[c];
        }
        let quaternion = self.rotation.quaternion(table, row)?;
        Ok(Some(GripperFrame { position, quaternion }))
    }
}

impl RotationColumns {
    /// The columns of the rotation in a table; `column` returns that of a name. An error for rotations in no form or in
    /// several, and for unknown units of an angle.
    pub fn find(table: &Table, column: impl Fn(&str) -> Option<usize>) -> Result<Self, Error> {
        let quaternion = ["qw", "qx", "qy", "qz"].map(&column);
        let vector = ["rx", "ry", "rz"].map(&column);
        let axis = ["ux", "uy", "uz", "angle"].map(&column);
        let forms = [&quaternion[..], &vector, &axis];
        let begun = forms.map(|form| form.iter().any(Option::is_some));
        let whole = forms.map(|form| form.iter().all(Option::is_some));
        let one = "one form of the rotation: qw, qx, qy, qz, or rx, ry, rz, or ux, uy, uz, angle";
        if begun.iter().filter(|is_begun| **is_begun).count() != 1 || begun != whole {
            return Err(missing(table, one));
        }
        let angle = |column: usize| table.factor(column, &ANGLES, "");
        match (quaternion, vector, axis) {
            ([Some(w), Some(x), Some(y), Some(z)], ..) => Ok(Self::Quaternion([w, x, y, z])),
            (_, [Some(x), Some(y), Some(z)], _) => {
                let factors = [angle(x)?, angle(y)?, angle(z)?];
                Ok(Self::Vector { columns: [x, y, z], factors })
            }
            (.., [Some(x), Some(y), Some(z), Some(turn)]) => {
                Ok(Self::AxisAngle { axis: [x, y, z], angle: turn, factor: angle(turn)? })
            }
            _ => Err(missing(table, one)),
        }
    }

    /// Name of the first column of an angle without a unit, which is read as rad; none if all have units, and of
    /// quaternions.
    pub fn assumed_unit(&self, table: &Table) -> Option<String> {
        let angles = match self {
            Self::Quaternion(_) => &[][..],
            Self::Vector { columns, .. } => columns,
            Self::AxisAngle { angle, .. } => std::slice::from_ref(angle),
        };
        let mut names = angles.iter().map(|column| &table.columns[*column]);
        names.find(|(_, unit)| unit.is_none()).map(|(name, _)| name.clone())
    }

    /// An angle in a row, rad. A message for a blank field, and for more than a turn in a column without a unit.
    fn angle(table: &Table, row: &TableRow, column: usize, factor: f64) -> Result<f64, String> {
        let own = value(table, row, column)?;
        let (name, unit) = &table.columns[column];
        match unit.is_none() && own.abs() > LARGEST_ROUNDED_TURN {
            true => Err(turns_without_unit(name, own)),
            false => Ok(own * factor),
        }
    }

    /// Indices of all columns of the rotation.
    pub fn columns(&self) -> Vec<usize> {
        match self {
            Self::Quaternion(columns) => columns.to_vec(),
            Self::Vector { columns, .. } => columns.to_vec(),
            Self::AxisAngle { axis, angle, .. } => [&axis[..], &[*angle]].concat(),
        }
    }

    /// The quaternion `[w, x, y, z]` of the rotation in a row; a quaternion of the table is not
    /// normalized. A message for a blank field, an axis whose length is not 1, and more than a turn without a unit.
    pub fn quaternion(&self, table: &Table, row: &TableRow) -> Result<[f64; 4], String> {
        let value = |column: usize| value(table, row, column);
        match self {
            Self::Quaternion([w, x, y, z]) => Ok([value(*w)?, value(*x)?, value(*y)?, value(*z)?]),
            Self::Vector { columns, factors } => {
                let mut vector = [0.0; 3];
                for (c, r) in vector.iter_mut().enumerate() {
                    *r = Self::angle(table, row, columns[c], factors[c])?;
                }
                let angle = dot(vector, vector).sqrt();
                let axis = if angle == 0.0 { vector } else { scale(vector, angle.recip()) };
                Ok(quaternion_about(axis, angle))
            }
            Self::AxisAngle { axis: [x, y, z], angle, factor } => {
                let axis = [value(*x)?, value(*y)?, value(*z)?];
                let length = check_length("rotation axis", &axis)?;
                let angle = Self::angle(table, row, *angle, *factor)?;
                Ok(quaternion_about(scale(axis, length.recip()), angle))
            }
        }
    }
}

/// The error for a table without the columns of a pose: those found, and those `allowed`.
fn missing(table: &Table, allowed: &str) -> Error {
    let found = table.columns_found();
    table.error(1, &format!("found the columns {found}, allowed: {allowed}")).into()
}

/// The message for an angle of more than a turn in a column without a unit: degrees in most files.
pub(crate) fn turns_without_unit(name: &str, largest: f64) -> String {
    format!(
        "found angles up to {largest} in the column {name} without a unit, more than a turn in rad, allowed: \
         {name}[deg], or {name}[rad] for turns"
    )
}

/// The number of a row in a column. A message for a blank field.
fn value(table: &Table, row: &TableRow, column: usize) -> Result<f64, String> {
    row.values[column].ok_or_else(|| {
        let name = &table.columns[column].0;
        format!("found a pose without `{name}`, allowed: all of its numbers, or none")
    })
}

/// Quaternion `[w, x, y, z]` of the rotation by an angle, rad, about a unit axis.
fn quaternion_about(axis: Vector<f64>, angle: f64) -> [f64; 4] {
    let (sine, cosine) = (0.5 * angle).sin_cos();
    let [x, y, z] = scale(axis, sine);
    [cosine, x, y, z]
}

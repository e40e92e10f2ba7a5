//! `[[supports.motion]]`: prescribed motion of an end of the rod, by a ramp, a frequency or a recording.
//!
//! Displacement (m), rotation vector (rad) and twist (rad) of a [`Motion`] are multiplied by one factor of time. It is
//! a quintic from 0 to 1 over the ramp (s), `sin(2 pi f t)` with the frequency f (Hz), or 1 without both. A recording
//! of a point adds its displacement since t = 0, m. Motions of one end are added. With `pose` the recording is the
//! position and rotation of a gripper ([`GripperPose`]).
//!
//! In the search for an equilibrium ([`MotionTime::Approach`]) the factor is the progress of the search, from 0 to 1.
//! It is 0 for a frequency, and for a ramp unless the equilibrium after all ramps is searched. Recorded displacements
//! are left out there.
//!
//! `Motion::read` reads the recording. `Motion::check` rejects motions that the support does not allow: clamped ends
//! may have any motion, pinned ones no rotation and twist, recorded ones a constant twist only; free ends and rollers
//! have none. Errors are also a ramp beside a frequency, a start time or columns without a file, and a recorded pose
//! without a recording or of an end that is not clamped.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::gripper_pose::{EndPose, GripperPose};
use crate::scene::number::{Quantity, is_default};
use crate::scene::recorded_point::{PointReading, Subtraction};
use crate::scene::support::{End, Support};
use crate::scene::table::{TABLE, table};
use crate::scene::track::Track;
use marker_files::{Axes, ColumnRules};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;

table! {
    /// `[[supports.motion]]`: prescribed motion of a clamped or pinned end, or twist of a recorded one.
    /// Motions of one end are added.
    #[derive(Default)]
    pub struct Motion {
        /// End of the rod that moves.
        pub end: End,
        /// Displacement of the end, m.
        #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
        pub displacement: [D; 3] = Quantity::signed("m"),
        /// Rotation vector of a clamped end about an axis through it, rad.
        #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
        pub rotation: [D; 3] = Quantity::signed("rad"),
        /// Rotation of a clamped end about the rod itself, rad, right-handed from start to end, counted
        /// beyond full turns. Of a recorded end: constant rotation relative to the position of least
        /// energy between the first markers.
        #[serde(default)]
        pub twist: D = Quantity::signed("rad"),
        /// Duration of a motion from rest to rest, s; without ramp and frequency the end is displaced
        /// from the beginning.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub ramp: Option<D> = Quantity::positive("s"),
        /// Frequency of a motion `sin(2 pi frequency t)`, Hz.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub frequency: Option<D> = Quantity::positive("Hz"),
        /// Recording of the motion, relative to the scene file: a CSV file with a clock `t` and columns
        /// x, y, z of a point that moves with the end, m, or `ax, ay, az` of an accelerometer that
        /// starts at rest, m/s^2. With `pose`: columns of position and rotation of the gripper, or an export of
        /// OptiTrack Motive with rigid bodies.
        #[serde(default, skip_serializing_if = "is_default")]
        pub file: PathBuf,
        /// Columns of the recording by name or number, where the header has other names or is missing.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub columns: Option<ColumnRules>,
        /// Time on the recording's own clock, in its unit, at which the simulation starts; default 0.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub time_zero: Option<f64>,
        /// Axes of the recording that are the world's x, y and z, as `["x", "z", "-y"]`; default: its own.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub axes: Option<Axes>,
        /// Acceleration that is subtracted from recorded accelerations, in axes of the sensor: `"mean"`, the mean over
        /// the motion, which begins and ends at rest; `"rest"`, the mean of the rows before `time_zero`; or three numbers,
        /// m/s^2. Default: none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub subtract: Option<Subtraction>,
        /// The recording has position and rotation of the gripper of a clamped end, which this table relates to the
        /// rod.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub pose: Option<GripperPose<D>> = TABLE,
        /// The recording, once it is read.
        #[serde(skip)]
        pub track: Option<Arc<Track>>,
    }
}

/// Time at which prescribed motions are evaluated.
#[derive(Clone, Copy, Debug)]
pub enum MotionTime<D> {
    /// Time of a simulation, s.
    Time(D),
    /// Step of the search for an equilibrium: that at t = 0, or, `settled`, the one after every ramp.
    Approach {
        /// Fraction of the displacements that is applied, 0 to 1.
        progress: D,
        /// Whether ramps have ended.
        settled: bool,
    },
}

impl<D> MotionTime<D> {
    /// The same time, with its number (time, s, or progress) converted by `convert`.
    pub fn map<E>(self, convert: impl Fn(D) -> E) -> MotionTime<E> {
        match self {
            Self::Time(time) => MotionTime::Time(convert(time)),
            Self::Approach { progress, settled } => {
                MotionTime::Approach { progress: convert(progress), settled }
            }
        }
    }
}

impl<D: Scalar> Motion<D> {
    /// The same motion with its numbers (displacement, rotation, twist, ramp, frequency) converted by `convert`; the
    /// recording is shared.
    pub(crate) fn map<E>(&self, convert: impl Fn(D) -> E + Copy) -> Motion<E> {
        Motion {
            end: self.end,
            displacement: self.displacement.map(convert),
            rotation: self.rotation.map(convert),
            twist: convert(self.twist),
            ramp: self.ramp.map(convert),
            frequency: self.frequency.map(convert),
            file: self.file.clone(),
            columns: self.columns.clone(),
            time_zero: self.time_zero,
            axes: self.axes,
            subtract: self.subtract,
            pose: self.pose.as_ref().map(|pose| pose.map(convert)),
            track: self.track.clone(),
        }
    }

    /// Displacement since t = 0 of the first marker of the recording, m, in world axes. `None` without a recording that
    /// has been read, or without markers, in the search for an equilibrium, and of a recorded pose.
    pub(crate) fn recorded_displacement(&self, at: MotionTime<D>) -> Option<[D; 3]> {
        let track = self.track.as_ref().filter(|_| self.pose.is_none())?;
        let [marker, ..] = track.markers() else { return None };
        let MotionTime::Time(time) = at else { return None };
        // The origin of the recording is arbitrary: only the change since t = 0 moves the end.
        let (start, now) = (marker.at(0.0), marker.at(time));
        Some(std::array::from_fn(|c| now[c] - start[c]))
    }

    /// Position and orientation of the end at a time, s, by the recorded pose of its gripper. `None` without `pose`,
    /// and before the recording is read.
    pub(crate) fn end_pose(&self, time: D) -> Option<EndPose<D>> {
        self.pose.as_ref()?.end_pose(self.track.as_ref()?, time)
    }

    /// Factor on displacement, rotation and twist. At a time t, s, it is 1 without ramp and frequency, and `sin(2 pi f
    /// t)` with a frequency f. With a ramp it is the quintic `u^3 (10 - 15 u + 6 u^2)` of `u = t/ramp`, 0 before the
    /// ramp and 1 after it. In the search for an equilibrium it is the progress without both, and with a ramp that has
    /// ended (`settled`); otherwise 0. It has derivatives with respect to time, ramp, frequency and progress.
    pub(crate) fn factor(&self, at: MotionTime<D>) -> D {
        let (zero, one) = (D::from(0.0), D::from(1.0));
        match (at, self.ramp, self.frequency) {
            (MotionTime::Time(_), None, None) => one,
            (MotionTime::Approach { progress, .. }, None, None) => progress,
            (MotionTime::Time(t), None, Some(frequency)) => (t * frequency * TAU).sin(),
            (MotionTime::Time(t), Some(ramp), _) => {
                // The quintic without velocity and acceleration at its ends.
                let u = t / ramp;
                match u.value() {
                    ..=0.0 => zero,
                    1.0.. => one,
                    _ => u * u * u * ((u * 6.0 - 15.0) * u + 10.0),
                }
            }
            (MotionTime::Approach { progress, settled: true }, Some(_), _) => progress,
            (MotionTime::Approach { .. }, _, _) => zero,
        }
    }
}

impl Motion {
    /// Reads the recording of one point from its file, relative to `folder`, unless there is a track already. A track
    /// that has not been examined is replaced by a copy with its defects (missing frames, jumps) and bandwidth. With
    /// `pose` the recording is one of a gripper. No effect without file and track. An error for a file that cannot be
    /// read, or that has several points.
    pub(super) fn read(&mut self, folder: &Path) -> Result<(), Error> {
        let track = match self.track.take() {
            Some(track) => track,
            None if is_default(&self.file) => return Ok(()),
            None => {
                let file = marker_files::file::at(folder, &self.file);
                let columns = self.columns.as_ref();
                let track = match &self.pose {
                    Some(pose) => {
                        let body = pose.body.as_deref();
                        Track::read_poses(&file, self.time_zero, columns, self.end, body)
                    }
                    None => {
                        let (time_zero, axes, subtract) =
                            (self.time_zero, self.axes, self.subtract);
                        let reading = PointReading { time_zero, columns, axes, subtract };
                        Track::read_point(&file, &reading)
                    }
                };
                track?.into()
            }
        };
        let driving: &[usize] = if self.pose.is_some() { &[0, 1, 2] } else { &[0] };
        let unguarded =
            (!track.is_examined()).then(|| Track::clone(&track).with_motion_defects(driving));
        self.track = Some(unguarded.map_or(track, Arc::new));
        Ok(())
    }

    /// Whether the motion has neither ramp, frequency nor a recording that has been read, so that its displacement,
    /// rotation and twist are constant from the beginning.
    pub(crate) fn is_offset(&self) -> bool {
        self.ramp.is_none() && self.frequency.is_none() && self.track.is_none()
    }

    /// Rejects ramp beside frequency, a start time that is not finite, and a start time or columns without a file. Also
    /// rejects motions that the `support` of the end does not allow. Clamped ends may have any motion, pinned ones no
    /// rotation and twist, recorded ones a constant twist only; free ones and rollers have none. A recorded pose needs
    /// a clamped end and a recording. `key` is the path of the motion, for the error. Displacement, rotation, twist,
    /// ramp and frequency are not checked.
    pub(super) fn check(&self, key: &str, support: Support) -> Result<(), Error> {
        let invalid = |name: &str, found: &dyn ToString, allowed: &str| {
            Err(Error::invalid(format!("{key}.{name}"), found.to_string(), allowed))
        };
        // A start time belongs to a recording.
        if let Some(time_zero) = self.time_zero {
            if !time_zero.is_finite() {
                return invalid("time_zero", &time_zero, "a finite number");
            }
            if is_default(&self.file) {
                return invalid("time_zero", &time_zero, "with the file of a recording only");
            }
        }
        if let Some(columns) = self.columns.as_ref().filter(|_| is_default(&self.file)) {
            return invalid("columns", columns, "with the file of a recording only");
        }
        let own = [
            ("axes", self.axes.is_some(), "axes in pose"),
            ("subtract", self.subtract.is_some(), "with accelerations only"),
        ];
        for (name, _, remedy) in own.into_iter().filter(|(_, is_given, _)| *is_given) {
            if is_default(&self.file) {
                return invalid(
                    name,
                    &"this key without file",
                    "with the file of a recording only",
                );
            }
            if self.pose.is_some() {
                return invalid(name, &"this key beside pose", remedy);
            }
        }
        if self.ramp.is_some() && self.frequency.is_some() {
            return invalid("frequency", &"both ramp and frequency", "one of the two");
        }
        if let Some(pose) = &self.pose {
            pose.check(&format!("{key}.pose"))?;
            if support != Support::Clamped {
                let found = "a recorded pose of an end that is not clamped";
                return invalid(
                    "pose",
                    &found,
                    "start or end = \"clamped\" for an end with a recorded pose",
                );
            }
            let points = self.track.as_ref().map(|track| track.markers().len());
            if points.map_or(is_default(&self.file), |points| points != 3) {
                let allowed = "with the file of a recording of position and rotation";
                return invalid("pose", &"no recording of a pose", allowed);
            }
        }
        // A recording prescribes all of an end but its rotation about the rod.
        let twist_alone = Self { twist: self.twist, end: self.end, ..Self::default() };
        match support {
            Support::Clamped => Ok(()),
            Support::Pinned if self.rotation == [0.0; 3] && self.twist == 0.0 => Ok(()),
            Support::Pinned => {
                invalid("rotation", &"a rotation of a pinned end", "rotations of clamped ends")
            }
            Support::Recorded if *self == twist_alone => Ok(()),
            Support::Recorded => invalid(
                "end",
                &"a motion of a recorded end other than a constant twist",
                "twist only, as the recording prescribes the motion of the end",
            ),
            Support::Free | Support::Roller => invalid(
                "end",
                &"a motion of an end without clamp or hinge",
                "clamped, pinned or recorded ends",
            ),
        }
    }
}

//! `[[contacts.motion]]`: prescribed translation of an obstacle in time.
//!
//! The displacement of an obstacle is the sum of the displacements (m) of its motions. Each has a constant velocity, a
//! displacement over a ramp or with a frequency, and a recording, as [motions of
//! supports](crate::scene::prescribed_motion) have:
//!
//! ```text
//! u(t) = velocity t + displacement f(t) + x(t) - x(0)
//! ```
//!
//! It is zero at t = 0. `support_motion` returns displacement and recording as the motion of a support, of which a
//! `ObstaclePath` computes displacements and velocities (m/s) over any number type, along given axes. `check` rejects
//! a displacement without ramp and frequency, and what `Motion::check` rejects; `read` reads the recording.

use crate::error::Error;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, scale};
use crate::scene::number::{Quantity, is_default};
use crate::scene::prescribed_motion::{Motion, MotionTime};
use crate::scene::support::Support;
use crate::scene::table::table;
use crate::scene::track::Track;
use marker_files::ColumnRules;
use num_dual::Dual;
use std::path::{Path, PathBuf};
use std::sync::Arc;

table! {
    /// `[[contacts.motion]]`: prescribed translation of an obstacle. Motions of one obstacle are added.
    #[derive(Default)]
    pub struct ObstacleMotion {
        /// Constant velocity, m/s.
        #[serde(
            deserialize_with = "crate::input::arrays::numbers",
            default,
            skip_serializing_if = "is_default"
        )]
        pub velocity: [D; 3] = Quantity::signed("m/s"),
        /// Displacement by the ramp, or amplitude of the frequency, m.
        #[serde(
            deserialize_with = "crate::input::arrays::numbers",
            default,
            skip_serializing_if = "is_default"
        )]
        pub displacement: [D; 3] = Quantity::signed("m"),
        /// Duration of the displacement from rest to rest, s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub ramp: Option<D> = Quantity::positive("s"),
        /// Frequency of a displacement `sin(2 pi frequency t)`, Hz.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub frequency: Option<D> = Quantity::positive("Hz"),
        /// Recording of the motion, relative to the scene file: a CSV file with a clock `t` and columns
        /// x, y, z of a point that moves with the obstacle, m, or `ax, ay, az` of an accelerometer that
        /// starts at rest, m/s^2.
        #[serde(default, skip_serializing_if = "is_default")]
        pub file: PathBuf,
        /// Columns of the recording by name or number, where the header has other names or is missing.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub columns: Option<ColumnRules>,
        /// Time on the recording's own clock, in its unit, at which the simulation starts; default 0.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub time_zero: Option<f64>,
        /// The recording, once it is read.
        #[serde(skip)]
        pub track: Option<Arc<Track>>,
    }
}

impl<D: Scalar> ObstacleMotion<D> {
    /// Displacement, ramp, frequency and recording as the motion of a support; the velocity is left out.
    pub(crate) fn support_motion(&self) -> Motion<D> {
        let zero = D::from(0.0);
        Motion {
            end: Default::default(),
            displacement: self.displacement,
            rotation: [zero; 3],
            twist: zero,
            ramp: self.ramp,
            frequency: self.frequency,
            file: self.file.clone(),
            columns: self.columns.clone(),
            time_zero: self.time_zero,
            axes: None,
            subtract: None,
            pose: None,
            track: self.track.clone(),
        }
    }
}

impl ObstacleMotion {
    /// Reads the recording from its file, relative to `folder`, as [`Motion::read`] does.
    pub(super) fn read(&mut self, folder: &Path) -> Result<(), Error> {
        let mut motion = self.support_motion();
        motion.read(folder)?;
        self.track = motion.track;
        Ok(())
    }

    /// Rejects a displacement without ramp and frequency, both of these, and a start time or columns without a file.
    /// `key` is the path of the motion, for the error. Numbers are not checked.
    pub(super) fn check(&self, key: &str) -> Result<(), Error> {
        self.support_motion().check(key, Support::Clamped)?;
        if self.displacement != [0.0; 3] && self.ramp.is_none() && self.frequency.is_none() {
            let found = "a displacement without ramp and frequency";
            let allowed =
                "ramp or frequency; the place of an obstacle at t = 0 is given by its own keys";
            return Err(Error::invalid(format!("{key}.displacement"), found, allowed));
        }
        Ok(())
    }
}

/// Translation of an obstacle in time, along given axes.
#[derive(Clone, Debug)]
pub(crate) struct ObstaclePath<D> {
    parts: Vec<PathPart<D>>,
    /// Axes along which displacements are returned, in the world, for recordings.
    axes: [[f64; 3]; 3],
}

/// One motion of an obstacle: a constant velocity, m/s, and the motion of a support, with vectors along the axes.
#[derive(Clone, Debug)]
struct PathPart<D> {
    velocity: Vector<D>,
    motion: Motion<D>,
}

impl<D: Scalar> PathPart<D> {
    /// Displacement at a time, s, along the axes, m.
    fn displacement(&self, time: D, axes: &[[f64; 3]; 3]) -> Vector<D> {
        let at = MotionTime::Time(time);
        let given = scale(self.motion.displacement, self.motion.factor(at));
        let moved = add(given, scale(self.velocity, time));
        self.motion.recorded_displacement(at).map_or(moved, |x| {
            add(moved, axes.map(|axis| x[0] * axis[0] + x[1] * axis[1] + x[2] * axis[2]))
        })
    }
}

impl<D: Scalar> ObstaclePath<D> {
    /// The path of an obstacle with these motions along three `axes` of the world. `None` without motions.
    pub fn new(motions: &[ObstacleMotion<D>], axes: [[f64; 3]; 3]) -> Option<Self> {
        let along =
            |v: Vector<D>| axes.map(|axis| v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2]);
        let part = |own: &ObstacleMotion<D>| {
            let motion = own.support_motion();
            let displacement = along(motion.displacement);
            PathPart { velocity: along(own.velocity), motion: Motion { displacement, ..motion } }
        };
        (!motions.is_empty()).then(|| Self { parts: motions.iter().map(part).collect(), axes })
    }

    /// Displacement since t = 0 at a time, s, along the axes, m.
    pub fn displacement(&self, time: f64) -> Vector<D> {
        let of = |part: &PathPart<D>| part.displacement(D::from(time), &self.axes);
        self.parts.iter().map(of).fold([D::from(0.0); 3], add)
    }
}

impl<D: RodScalar> ObstaclePath<D> {
    /// Velocity at a time, s, along the axes, m/s: the derivative of the displacement.
    pub fn velocity(&self, time: f64) -> Vector<D> {
        // Derivative by time in dual numbers, of the same function as the displacement.
        let now = Dual::new(D::from(time), D::from(1.0));
        let of = |part: &PathPart<D>| {
            let velocity = part.velocity.map(Dual::from_re);
            let part = PathPart { velocity, motion: part.motion.map(Dual::from_re) };
            part.displacement(now, &self.axes).map(|x| x.eps)
        };
        self.parts.iter().map(of).fold([D::from(0.0); 3], add)
    }
}

//! Recorded positions and rotations of a gripper, as the track of three of its points.
//!
//! Input: at each time, s, the position of the origin of the gripper, m, and the quaternion of the rotation from its
//! axes to those of the world ([`GripperFrame`]); none in a missing frame. Output: a [`Track`] of the origin and of two
//! points at the distance `ARM` on the first two axes of the gripper. The quaternions q and -q are the same rotation,
//! and have the same points.
//!
//! Errors, as messages: a quaternion whose length is not 1 within `LENGTH_TOLERANCE`, a coordinate beyond `FARTHEST`, a
//! rotation by more than a right angle from one pose to the next, and fewer than two poses.

use crate::numerics::rotation::identity;
use crate::numerics::vector::{Vector, add, cross, scale};
use crate::scene::track::Track;
use std::f64::consts::FRAC_1_SQRT_2;

/// Distance of the two points on the axes of a gripper from its origin, m: the size of a gripper, so that defects of
/// rotations and of positions have comparable sizes.
const ARM: f64 = 0.1;
/// Largest difference of the length of a quaternion or axis from 1; files with three digits have 2e-3.
const LENGTH_TOLERANCE: f64 = 0.01;
/// Largest coordinate, m. Beyond it rounding errors of positions exceed 1e-9 of an edge of a millimeter.
const FARTHEST: f64 = 1e4;
/// Cosine of half a right angle: the least product of two successive quaternions.
const LEAST_PRODUCT: f64 = FRAC_1_SQRT_2 - 1e-9;
/// Names of the points of a track of poses.
const POINTS: [&str; 3] = ["origin", "first axis", "second axis"];

/// Position and rotation of a gripper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripperFrame {
    /// Position of its origin in the world, m.
    pub position: [f64; 3],
    /// Unit quaternion `[w, x, y, z]` of the rotation from its axes to those of the world.
    pub quaternion: [f64; 4],
}

impl GripperFrame {
    /// The frame with a quaternion of length one. A message if its length is not 1 within [`LENGTH_TOLERANCE`], or a
    /// coordinate is not finite or beyond [`FARTHEST`].
    fn normalized(self) -> Result<Self, String> {
        if let Some(x) = self.position.iter().find(|x| x.is_nan() || x.abs() > FARTHEST) {
            return Err(format!(
                "found the coordinate {x} m, allowed: -{FARTHEST} .. {FARTHEST} m"
            ));
        }
        Ok(Self { quaternion: unit_quaternion(self.quaternion)?, ..self })
    }

    /// A message if the rotation from the frame `before` exceeds a right angle. Both quaternions have length one.
    fn check_after(&self, before: &Self) -> Result<(), String> {
        let product: f64 = self.quaternion.iter().zip(before.quaternion).map(|(a, b)| a * b).sum();
        match product.abs() < LEAST_PRODUCT {
            true => {
                let angle = (2.0 * product.abs().acos()).to_degrees();
                Err(format!(
                    "found a rotation by {angle:.0} deg since the pose before, allowed: up to 90 deg between two poses"
                ))
            }
            false => Ok(()),
        }
    }

    /// Positions, m, of the origin and of the points at the distance [`ARM`] on the first two axes.
    fn points(&self) -> [Vector<f64>; 3] {
        let [first, second, _] = rotated_axes(self.quaternion);
        let point = |axis| add(self.position, scale(axis, ARM));
        [self.position, point(first), point(second)]
    }
}

/// The three axes turned by the unit quaternion `[w, x, y, z]`, one after the other.
pub(crate) fn rotated_axes([w, x, y, z]: [f64; 4]) -> [Vector<f64>; 3] {
    // A unit quaternion rotates e to `e + 2 v x (w e + v x e)` with v = (x, y, z).
    let v = [x, y, z];
    identity::<f64>().map(|e| add(e, scale(cross(v, add(scale(e, w), cross(v, e))), 2.0)))
}

/// The quaternion scaled to length one. A message if its length is not 1 within [`LENGTH_TOLERANCE`].
pub(crate) fn unit_quaternion(quaternion: [f64; 4]) -> Result<[f64; 4], String> {
    let length = check_length("quaternion", &quaternion)?;
    Ok(quaternion.map(|c| c / length))
}

/// Length of a vector of four or three numbers. A message, with the `name` of the vector, if it differs from 1 by more
/// than [`LENGTH_TOLERANCE`], or is not a number.
pub(super) fn check_length(name: &str, vector: &[f64]) -> Result<f64, String> {
    let length = vector.iter().map(|c| c * c).sum::<f64>().sqrt();
    match (length - 1.0).abs() <= LENGTH_TOLERANCE {
        true => Ok(length),
        false => {
            let [low, high] = [1.0 - LENGTH_TOLERANCE, 1.0 + LENGTH_TOLERANCE];
            Err(format!("found a {name} of the length {length}, allowed: {low} .. {high}"))
        }
    }
}

impl Track {
    /// Motion of a gripper: the positions of its origin and of two points on its first two axes. Times are increasing,
    /// s; a frame without a pose is missing. The quaternions are scaled to length one.
    ///
    /// # Errors
    /// A message about the first invalid pose: a quaternion whose length is not 1 within 1 %, a coordinate beyond 10
    /// km, a rotation by more than 90 degrees since the pose before. Also fewer than two poses.
    pub fn of_poses(times: Vec<f64>, poses: &[Option<GripperFrame>]) -> Result<Self, String> {
        let mut frames = PosedFrames::default();
        for (k, pose) in poses.iter().enumerate() {
            frames.push(*pose).map_err(|message| format!("pose {k}: {message}"))?;
        }
        frames.into_track(times)
    }
}

/// Points of a gripper at successive frames.
#[derive(Default)]
pub(super) struct PosedFrames {
    points: [Vec<Option<Vector<f64>>>; 3],
    last: Option<GripperFrame>,
}

impl PosedFrames {
    /// Adds a frame, without a pose if it is missing. A message for an invalid pose.
    pub fn push(&mut self, pose: Option<GripperFrame>) -> Result<(), String> {
        let pose = pose.map(GripperFrame::normalized).transpose()?;
        if let (Some(pose), Some(before)) = (&pose, &self.last) {
            pose.check_after(before)?;
        }
        self.last = pose.or(self.last);
        let points = pose.map(|pose| pose.points());
        for (c, seen) in self.points.iter_mut().enumerate() {
            seen.push(points.map(|points| points[c]));
        }
        Ok(())
    }

    /// The track of the points at these times, s. A message for fewer than two poses.
    pub fn into_track(self, times: Vec<f64>) -> Result<Track, String> {
        let known = self.points[0].iter().flatten().count();
        if known < 2 {
            return Err(format!("found {known} poses, allowed: at least two"));
        }
        let named = POINTS.map(String::from).into_iter().zip(self.points);
        Track::new(times, named.collect())
    }
}

//! The camera model: the recorded position of a point, and the time of the motion at a time of the recording.
//!
//! Input: the camera of a scene (displacement, m, rotation in the plane, rad, scale of lengths, time offset, s), with
//! derivatives by its parameters. Output: a [`View`], which maps a position `x` in the world, m, to the recorded one
//! (`recorded`), m, `wall + displacement + scale R (x - wall)`. `R` is the rotation about the normal of the plane, and
//! `wall` is the start of the rod, or of the first rod of a structure. It maps a time `t` on the clock of the recording
//! to the time of the motion (`time`), `t - offset`, at least 0.

use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::{Vector, add, dot, rotate, scale, sub};
use crate::problem::Problem;
use crate::scene::Parameter;

/// The [camera](crate::scene::Camera) of a scene, over a scalar type that may carry derivatives by its parameters.
pub(crate) struct View<D> {
    /// Center of rotation and scaling: the wall, m.
    centre: Vector<D>,
    /// Displacement of the picture, m.
    shift: Vector<D>,
    /// Rotation vector, rad.
    rotation: Vector<D>,
    /// Ratio of recorded to true lengths.
    pixel_scale: D,
    /// Time on the clock of the recording at which the motion starts, s.
    time_offset: D,
}

impl<D: Nestable> View<D> {
    /// The camera of a problem, with the wall of its rod (the start of the first rod of a structure) as center and the
    /// normal of its plane as axis. `seed` returns the scalar of a parameter from its value, with derivatives where the
    /// parameter is an unknown.
    pub fn new(problem: &Problem, seed: impl Fn(Parameter, f64) -> D) -> Self {
        let (wall, scene) = problem.wall_over(seed);
        let camera = scene.camera;
        // The camera of a structure turns about the start of its first rod.
        let first = scene.structure.as_ref().and_then(|structure| structure.rods.first());
        let wall = first.map_or(wall, |rod| rod.origin.unwrap_or([D::from(0.0); 3]));
        Self {
            centre: wall,
            shift: camera.clamp_position,
            rotation: problem.normal().map(|n| camera.in_plane_rotation * n),
            pixel_scale: camera.pixel_scale,
            time_offset: camera.time_offset,
        }
    }
}

impl<D: Scalar> View<D> {
    /// The time of the motion, s, at `time`, s, on the clock of the recording: `time - offset`, at least zero, with
    /// derivatives by the offset if above zero, without any at zero.
    pub fn time(&self, time: f64) -> D {
        let since = -self.time_offset + time;
        if since.value() > 0.0 { since } else { D::from(0.0) }
    }

    /// The recorded position, m, of a point at the position `x` in the world, m: `wall + shift + scale R (x - wall)`
    /// with the rotation `R` of the camera.
    pub fn recorded(&self, x: Vector<D>) -> Vector<D> {
        let arm = sub(x, self.centre);
        let centre = add(self.centre, self.shift);
        // Without derivatives a rotation by zero is skipped: most cameras are not rotated.
        match dot(self.rotation, self.rotation).value() == 0.0 && D::ORDER == 0 {
            true => add(centre, scale(arm, self.pixel_scale)),
            false => add(centre, scale(rotate(self.rotation, arm), self.pixel_scale)),
        }
    }
}

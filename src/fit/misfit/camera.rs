//! What the camera makes of the rod's motion.

use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::{Vector, add, dot, rotate, scale, sub};
use crate::problem::Problem;
use crate::scene::Parameter;

/// The [camera](crate::scene::Camera) of a scene, over numbers that may carry derivatives.
pub(crate) struct View<D> {
    centre: Vector<D>,
    shift: Vector<D>,
    rotation: Vector<D>,
    pixel_scale: D,
    time_offset: D,
}

impl<D: Nestable> View<D> {
    /// The camera of a problem; `seed` makes the numbers of the parameters.
    pub fn new(problem: &Problem, seed: impl Fn(Parameter, f64) -> D) -> Self {
        let (wall, scene) = problem.wall_over(seed);
        let camera = scene.camera;
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
    /// The motion's time, s, when the recording's clock shows `time`; zero before it starts.
    pub fn time(&self, time: f64) -> D {
        let since = -self.time_offset + time;
        if since.value() > 0.0 { since } else { D::from(0.0) }
    }

    /// Where a point is recorded, m.
    pub fn recorded(&self, x: Vector<D>) -> Vector<D> {
        let arm = sub(x, self.centre);
        let place = add(self.centre, self.shift);
        match dot(self.rotation, self.rotation).value() == 0.0 && D::ORDER == 0 {
            true => add(place, scale(arm, self.pixel_scale)),
            false => add(place, scale(rotate(self.rotation, arm), self.pixel_scale)),
        }
    }
}

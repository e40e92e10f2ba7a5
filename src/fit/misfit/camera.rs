//! The camera model: recorded positions of points, positions without distortion, and times of the motion.
//!
//! [`View`] has the numbers of [`camera`](crate::scene::camera) of a scene, whose header has the equations, over a
//! scalar type that may carry derivatives. Residuals compare the [undistorted](View::undistorted) observed position
//! with the [recorded](View::recorded) position of the model, m, which is affine in the position in the world. They
//! convert the difference to one in the [picture](View::distorted_difference). The position of the model is that at the
//! [time](View::sample_time), s, at which the row of the observed point is read. [`View::pictured`] applies rotation,
//! scale and distortion to a position of the model, for curves over the data.

use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, dot, rotate, scale, sub};
use crate::problem::Problem;
use crate::scene::Parameter;

/// Newton iterations that invert the distortion; they double the number of digits.
const INVERSIONS: usize = 30;
/// Relative error of a distance that the inversion may leave.
const INVERSION_ERROR: f64 = 1e-9;
/// Length of a component of the axis of the camera above which the coordinate is not in the picture.
const ALONG_AXIS: f64 = 1.0 - 1e-9;

/// The [camera](crate::scene::Camera) of a scene, over a scalar type that may carry derivatives by its parameters.
pub(crate) struct View<D> {
    /// Center of rotation and scaling: the wall, m.
    centre: Vector<D>,
    /// Displacement of the picture, m.
    shift: Vector<D>,
    /// Unit vector along the optical axis.
    axis: Vector<f64>,
    /// Rotation vector, rad.
    rotation: Vector<D>,
    /// Ratio of recorded to true lengths.
    pixel_scale: D,
    /// Time on the clock of the recording at which the motion starts, s.
    time_offset: D,
    /// Ratio of recorded to true durations.
    time_scale: D,
    /// Coefficient of radial distortion, 1/m^2, with its center, m; none without distortion.
    lens: Option<Lens<D>>,
    /// Delay of a rolling shutter, s/m; none without delay.
    row_delay: Option<Vector<D>>,
}

/// Radial distortion of a lens.
struct Lens<D> {
    /// First coefficient of Brown's model, 1/m^2.
    distortion: D,
    /// Recorded position of the optical center, m.
    center: Vector<D>,
}

impl<D: RodScalar> View<D> {
    /// The camera of a problem, with the wall of its rod (the `origin` of the first rod of a structure) as center and
    /// the normal of its plane as axis. `seed` returns the scalar of a parameter from its value, with derivatives where
    /// the parameter is an unknown.
    pub fn new(problem: &Problem, seed: impl Fn(Parameter, f64) -> D) -> Self {
        let (wall, scene) = problem.wall_over(seed);
        let camera = scene.camera;
        // The camera of a structure turns about the origin of its first rod.
        let first = scene.structure.as_ref().and_then(|structure| structure.rods.first());
        let wall = first.map_or(wall, |rod| rod.origin.unwrap_or([D::from(0.0); 3]));
        let lens = Lens { distortion: camera.distortion, center: camera.optical_center };
        let is_delayed = camera.row_delay.iter().any(|d| !d.is_identically_zero());
        Self {
            centre: wall,
            shift: camera.clamp_position,
            axis: problem.normal(),
            rotation: problem.normal().map(|n| camera.in_plane_rotation * n),
            pixel_scale: camera.pixel_scale,
            time_offset: camera.time_offset,
            time_scale: camera.time_scale,
            lens: (!camera.distortion.is_identically_zero()).then_some(lens),
            row_delay: is_delayed.then_some(camera.row_delay),
        }
    }
}

impl<D: Scalar> View<D> {
    /// The time of the motion, s, at `time`, s, on the clock of the recording, in the row of the clamp:
    /// `(time - offset)/scale`, at least zero, with derivatives by offset and scale if above zero, without any at zero.
    pub fn time(&self, time: f64) -> D {
        self.time_at_delay(time, D::from(0.0))
    }

    /// The time of the motion, s, at which a point was recorded at the position `observed`, m, in the frame with the
    /// time `time`, s, on the clock of the recording: [`time`](Self::time) with the delay of the row of that position.
    /// Coordinates that were not observed have no delay.
    pub fn sample_time(&self, time: f64, observed: &[Option<f64>; 3]) -> D {
        let mut delay = D::from(0.0);
        if let Some(row_delay) = self.row_delay {
            let clamp = add(self.centre, self.shift);
            for c in 0..3 {
                if let Some(observed) = observed[c] {
                    delay += row_delay[c] * (-clamp[c] + observed);
                }
            }
        }
        self.time_at_delay(time, delay)
    }

    /// `(time - offset - delay)/scale`, s, at least zero, without derivatives at zero.
    fn time_at_delay(&self, time: f64, delay: D) -> D {
        let since = (-self.time_offset - delay + time) / self.time_scale;
        if since.value() > 0.0 { since } else { D::from(0.0) }
    }

    /// The recorded position, m, without distortion, of a point at the position `x` in the world, m:
    /// `wall + shift + scale rotation(x - wall)`.
    pub fn recorded(&self, x: Vector<D>) -> Vector<D> {
        let arm = sub(x, self.centre);
        let centre = add(self.centre, self.shift);
        // Without derivatives a rotation by zero is skipped: most cameras are not rotated.
        match dot(self.rotation, self.rotation).value() == 0.0 && D::ORDER == 0 {
            true => add(centre, scale(arm, self.pixel_scale)),
            false => add(centre, scale(rotate(self.rotation, arm), self.pixel_scale)),
        }
    }

    /// The coordinates of an `observed` position, m, as a lens without distortion would record them. Coordinates that
    /// were not observed remain `None` and are taken as those of the optical center.
    pub fn undistorted(&self, observed: &[Option<f64>; 3]) -> [Option<D>; 3] {
        let Some(lens) = &self.lens else { return observed.map(|x| x.map(D::from)) };
        let radial = self.optical_arm(lens, observed);
        let factor = lens.distortion * dot(radial, radial);
        std::array::from_fn(|c| observed[c].map(|x| radial[c] * factor + x))
    }

    /// A small `difference` from an [undistorted](Self::undistorted) position, m, as the lens records it: times the
    /// inverse of the derivative of the undistorted by the recorded position, which is `observed`. The noise of an
    /// observed position then has the same size for every distortion.
    pub fn distorted_difference(
        &self,
        difference: Vector<D>,
        observed: &[Option<f64>; 3],
    ) -> Vector<D> {
        let Some(lens) = &self.lens else { return difference };
        let radial = self.optical_arm(lens, observed);
        let one = D::from(1.0);
        let square = lens.distortion * dot(radial, radial);
        let [across, along] = [one + square, one + square * 3.0];
        // Beyond the fold of the distortion a position has no picture: such a trial is rejected.
        if along.value() <= 0.0 {
            return [D::from(f64::NAN); 3];
        }
        let part = self.in_picture(difference);
        // (1 + k r^2) 1 + 2 k r r' is the derivative of (1 + k r^2) r.
        let radially = lens.distortion * 2.0 * dot(radial, part) / (across * along);
        let recorded = sub(scale(part, across.recip()), scale(radial, radially));
        add(sub(difference, part), recorded)
    }

    /// The vector from the optical center to an `observed` position, m, across the optical axis. Coordinates that were
    /// not observed are taken as those of the optical center.
    fn optical_arm(&self, lens: &Lens<D>, observed: &[Option<f64>; 3]) -> Vector<D> {
        let zero = D::from(0.0);
        let arm = std::array::from_fn(|c| observed[c].map_or(zero, |x| -lens.center[c] + x));
        self.in_picture(arm)
    }

    /// The part of a vector across the optical axis: the vector less its component along the axis.
    fn in_picture(&self, arm: Vector<D>) -> Vector<D> {
        let axis = self.axis.map(D::from);
        sub(arm, scale(axis, dot(axis, arm)))
    }
}

impl View<f64> {
    /// The recorded position, m, of a point at the position `x` in the world, m, with distortion: the solution of
    /// `undistorted(p) = recorded(x)`, by Newton's method. Positions that the lens cannot record stay undistorted.
    pub fn pictured(&self, x: Vector<f64>) -> Vector<f64> {
        let recorded = self.recorded(x);
        let Some(lens) = &self.lens else { return recorded };
        let radial = self.in_picture(sub(recorded, lens.center));
        let distance = dot(radial, radial).sqrt();
        let mut found = distance;
        for _ in 0..INVERSIONS {
            let square = lens.distortion * found * found;
            // Beyond the largest undistorted distance no point of the picture exists: that without distortion remains.
            if 1.0 + 3.0 * square <= 0.0 {
                return recorded;
            }
            found -= (found * (1.0 + square) - distance) / (1.0 + 3.0 * square);
        }
        let factor = 1.0 + lens.distortion * found * found;
        match (found * factor - distance).abs() <= INVERSION_ERROR * distance {
            true => add(sub(recorded, radial), scale(radial, factor.recip())),
            false => recorded,
        }
    }

    /// The latest time of the motion, s, at which a point within the `range` of recorded coordinates, m, is read in a
    /// frame at `time`, s, on the clock of the recording. It may be negative.
    pub fn latest_time(&self, time: f64, range: &[Option<[f64; 2]>; 3]) -> f64 {
        let clamp = add(self.centre, self.shift);
        let mut latest = time - self.time_offset;
        for (c, row_delay) in self.row_delay.iter().flatten().enumerate() {
            let delays = range[c].map(|ends| ends.map(|x| -row_delay * (x - clamp[c])));
            latest += delays.map_or(0.0, |[a, b]| a.max(b));
        }
        latest / self.time_scale
    }
}

/// Whether a coordinate is in the picture of the camera of a `problem`, so that lens distortion acts on it: its axis is
/// not the optical axis, the normal of the problem's plane.
pub(crate) fn is_in_picture(problem: &Problem, coordinate: usize) -> bool {
    problem.normal()[coordinate].abs() < ALONG_AXIS
}

//! Sensors that measure the orientation of a point of the rod, as clusters of markers or inertial units on it do.
//!
//! Input: a [`PoseSensor`], with the point of the rod, the measured rotations from the axes of the sensor to those of
//! the world, and the mounting of the sensor on the rod. With the rotation matrix `M` of a reading and the constant
//! mounting rotation `C` the measured directions of tangent, first and second director are the columns of
//!
//! ```text
//! [t, d1, d2] = M C,   C = exp(rotation) A
//! ```
//!
//! where the columns of `A` are the signed axes of the sensor named in `axes`, as for recorded ends. A free mounting is
//! an unknown `C`, a nuisance of three numbers.
//!
//! Output of [`PoseSensor::measurements`]: in space three measurements, `rt`, `r1` and `r2`, of the rotation about
//! tangent and directors ([`PoseReadings`]). In a planar scene it is one measurement of the angle of the tangent about
//! the normal of the plane, rad; a free mounting is then a free tare of this angle. Errors: structures, an axis `none`,
//! a rotation that is not finite, a quaternion whose length is not 1 within 1 %, no reading, a free mounting of
//! rotations at rest, and in a planar scene a measured plane of the motion that is tilted by more than `LARGEST_TILT`.

use crate::error::{Error, ensure};
use crate::fit::measurement::Measurement;
use crate::fit::measurement::point_channel::{PointChannel, PointQuantity};
use crate::fit::measurement::point_pose::PoseReadings;
use crate::fit::measurement::reading::Reading;
use crate::fit::measurement::rotation_readings::RotationReading;
use crate::fit::measurement::sensor::{Sensor, Tare};
use crate::fit::measurement::sensor_reference::SensorReference;
use crate::fit::structure::structure_problem::refuse_structure;
use crate::numerics::rotation::{
    Matrix3, column, orthonormal, product, times, transpose, transposed_times,
};
use crate::numerics::vector::{cross, dot, sub};
use crate::problem::Problem;
use crate::scene::gripper_frame::{rotated_axes, unit_quaternion};
use crate::scene::{GripperPose, Point};
use marker_files::Axes;

/// Largest angle, rad, between the normal of a planar scene and the direction that the measured rotations have for it:
/// 10 degrees. Up to it the angle about the normal is in error by at most 1 %.
const LARGEST_TILT: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// How a sensor of orientation is fixed to the rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mounting {
    /// A known mounting.
    Known {
        /// Axes of the sensor along tangent, first and second director of the rod; none: x, y and z.
        axes: Option<Axes>,
        /// Rotation vector of tangent and directors beyond `axes`, in the axes of the sensor, rad.
        rotation: [f64; 3],
    },
    /// An unknown constant rotation, a nuisance parameter of the readings.
    Free,
}

impl Default for Mounting {
    /// A sensor whose axes x, y and z are tangent, first and second director of the rod.
    fn default() -> Self {
        Self::Known { axes: None, rotation: [0.0; 3] }
    }
}

/// Measured orientations of a point of the rod.
#[derive(Clone, Debug)]
pub struct PoseSensor {
    /// The point.
    pub point: Point,
    /// Measured rotations, in the order of their times.
    pub readings: Vec<RotationReading>,
    /// Mounting of the sensor on the rod.
    pub mounting: Mounting,
    /// Cutoff frequency of the first-order low-pass filter of the sensor, Hz; none without a filter.
    pub low_pass: Option<f64>,
    /// Name of the sensor in `[[sensors]]` of the scene, with its clock and filter; none without one.
    pub sensor: Option<String>,
}

impl PoseSensor {
    /// Measured rotations of a `point` by a sensor whose axes are tangent and directors of the rod, without a filter.
    ///
    /// ```
    /// use rodfit::{Point, Scene, fit::{PoseSensor, RotationReading}};
    /// // At rest the tip of a rod along x droops by 0.02 rad, about z.
    /// let quaternion = [f64::cos(0.01), 0.0, 0.0, -f64::sin(0.01)];
    /// let sensor = PoseSensor::new(Point::Tip, vec![RotationReading { time: None, quaternion }]);
    /// let mut scene = Scene::load("data/cantilever.toml")?;
    /// # scene.rod.segments = Some(12);
    /// let angle = &sensor.measurements(&scene.problem()?)?[0];
    /// assert!((angle.data.readings()[0].value + 0.02).abs() < 1e-12);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn new(point: Point, readings: Vec<RotationReading>) -> Self {
        Self { point, readings, mounting: Mounting::default(), low_pass: None, sensor: None }
    }

    /// The sensor with another mounting.
    pub fn mounting(self, mounting: Mounting) -> Self {
        Self { mounting, ..self }
    }

    /// The sensor with a first-order low-pass filter of this cutoff frequency, Hz.
    pub fn low_pass(self, frequency: f64) -> Self {
        Self { low_pass: Some(frequency), ..self }
    }

    /// The sensor with delay and filter of `[[sensors]]` of the scene, by its name.
    pub fn of_sensor(self, name: &str) -> Self {
        Self { sensor: Some(name.into()), ..self }
    }

    /// The measurements of the sensor on the rod of a problem: three in space, one in a plane, with unknown noise and
    /// squared loss. Errors have the keys `quantity`, `tare`, `axes`, `rotation`, `point` and `file`, and are those of
    /// the header.
    pub fn measurements(&self, problem: &Problem) -> Result<Vec<Measurement>, Error> {
        refuse_structure(problem, "quantity", "an orientation of a point")?;
        let rests = self.readings.iter().any(|reading| reading.time.is_none());
        let found =
            "\"free\" of rotations at rest, which the mounting explains whatever the rod is";
        let allowed = "readings over time, or axes and rotation of the sensor";
        ensure(!rests || self.mounting != Mounting::Free, "tare", found, allowed)?;
        let directions = self.directions()?;
        let rest = rest_axes(self.point, problem)?;
        let mut measured = Vec::with_capacity(self.readings.len());
        for (k, reading) in self.readings.iter().enumerate() {
            let unit = unit_quaternion(reading.quaternion).map_err(|message| {
                let found = format!("reading {}: {message}", k + 1);
                Error::invalid("file", found, "unit quaternions")
            })?;
            measured.push(transpose(&rotated_axes(unit)));
        }
        let Some(first) = measured.first().copied() else {
            return Err(Error::invalid("file", "no reading", "at least one reading"));
        };
        // With a free mounting the rod has its rest axes at the first reading; their error is part of the mounting.
        let mounting = directions.unwrap_or_else(|| product(&transpose(&first), &rest));
        let measured: Vec<_> = measured.iter().map(|own| product(own, &mounting)).collect();
        let times: Vec<_> = self.readings.iter().map(|reading| reading.time).collect();
        if problem.planar().is_some() {
            return Ok(vec![self.angle(&measured, &rest, problem.normal())?.into()]);
        }
        let mut readings = PoseReadings::components(self.point, &times, &measured, &rest);
        for own in &mut readings {
            own.data.has_free_mounting = self.mounting == Mounting::Free;
            own.data.low_pass = self.low_pass;
            own.data.sensor = SensorReference(self.sensor.clone());
        }
        Ok(readings.into_iter().map(Measurement::from).collect())
    }

    /// The mounting rotation `C`; `None` of a free one. Errors for an axis `none`, and a rotation that is not finite.
    fn directions(&self) -> Result<Option<Matrix3<f64>>, Error> {
        let Mounting::Known { axes, rotation } = self.mounting else { return Ok(None) };
        let pose = GripperPose { axes, rotation, ..GripperPose::default() };
        let is_complete = axes.is_none_or(|axes| !axes.to_world([Some(1.0); 3]).contains(&None));
        ensure(is_complete, "axes", "an axis \"none\"", "three axes of the sensor")?;
        let is_finite = rotation.iter().all(|x| x.is_finite());
        ensure(is_finite, "rotation", format!("{rotation:?}"), "finite numbers, rad")?;
        Ok(Some(pose.directions()))
    }

    /// The angle of the measured tangents about the `normal` of a planar scene, from the tangent of the rest shape. An
    /// error if the `measured` axes tilt the normal, which is constant in the axes of the rod.
    fn angle(
        &self,
        measured: &[Matrix3<f64>],
        rest: &Matrix3<f64>,
        normal: [f64; 3],
    ) -> Result<Sensor, Error> {
        let from = column(rest, 0);
        let across = cross(normal, from);
        let own_normal = transposed_times(rest, normal);
        let mut readings = Vec::with_capacity(measured.len());
        for (RotationReading { time, .. }, axes) in self.readings.iter().zip(measured) {
            let tilt = dot(times(axes, own_normal), normal).clamp(-1.0, 1.0).acos();
            let at = time.map_or_else(|| "at rest".into(), |time| format!("at {time} s"));
            let found = format!(
                "a rotation {at} that tilts the normal of the plane by {:.1} deg",
                tilt.to_degrees()
            );
            let allowed = format!(
                "rotations about the normal of the planar scene, within {:.0} deg; the mounting by axes and rotation \
                 or tare = \"free\"; or rod.dimension = \"spatial\"",
                LARGEST_TILT.to_degrees()
            );
            ensure(tilt <= LARGEST_TILT, "file", found, allowed)?;
            let tangent = column(axes, 0);
            let value = dot(tangent, across).atan2(dot(tangent, from));
            readings.push(Reading { time: *time, value });
        }
        let quantity = PointQuantity::Angle { from, about: normal };
        let tare = match self.mounting {
            Mounting::Known { .. } => Tare::Known(0.0),
            Mounting::Free => Tare::Free,
        };
        let channel = PointChannel { point: self.point, quantity };
        let mut sensor = Sensor::new(channel, readings).tare(tare);
        sensor.data.low_pass = self.low_pass;
        sensor.data.sensor = SensorReference(self.sensor.clone());
        Ok(sensor)
    }
}

/// Tangent and directors at a point of the rest shape, in columns. An error for a point outside the rod.
fn rest_axes(point: Point, problem: &Problem) -> Result<Matrix3<f64>, Error> {
    let place = |offset| {
        problem
            .marker_at_rest(point, offset)
            .map_err(|error| Error::invalid("point", error, "a point of the rod"))
    };
    let center = place([0.0; 3])?;
    let [tangent, first] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(place);
    let [tangent, first] = [sub(tangent?, center), sub(first?, center)];
    Ok(orthonormal(&transpose(&[tangent, first, [0.0; 3]])))
}

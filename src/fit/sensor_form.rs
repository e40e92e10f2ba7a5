//! `[[observation]]` with the key `quantity`: readings of a sensor, under a support or at a point of the rod.
//!
//! Input: the keys of the table, the folder of the fit file and the prepared scene. The components of the file are
//! mapped by `axes` and then turned by `rotation`, rad: to the world for forces and moments, to the axes of the rod for
//! accelerations. An angle has one component, and `rotation` turns its axes. The components of a curvature, and the
//! `offset` of a strain, m, are along both directors of the rod, and `rotation` turns them about the tangent. Output:
//! one [`Measurement`] per component that the file has and `axes` does not leave out, N, N m, m/s^2, rad, 1/m or part
//! of the length, each with its tare, filter, standard deviation, loss and `held_out`. Those of a pose are made in
//! `pose_form`.
//!
//! Errors have the key: an end without a support, a filter or tare that is not valid, keys of another quantity, and no
//! component that remains. A file that cannot be read is an error with its path. [`refuse_given`] rejects keys that a
//! table must not have.

use crate::error::{Error, ensure};
use crate::fit::measurement::Measurement;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::point_channel::{PointChannel, PointQuantity};
use crate::fit::measurement::sensor::{Sensor, Tare};
use crate::fit::measurement::sensor_channel::{Channel, ReactionPart, SensorChannel};
use crate::fit::measurement::sensor_reference::SensorReference;
use crate::fit::measurement::sensor_table::{SensorQuantity, SensorTable};
use crate::problem::Problem;
use crate::scene::validate::positive;
use crate::scene::{End, Point, Support};
use marker_files::{Axes, Recording};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Offset of a sensor in a fit file.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "Tare"))]
#[serde(
    untagged,
    expecting = "expected \"free\", or three numbers, in the axes of the file and the unit of the quantity; of a \
                 curvature two numbers, of an angle or strain one"
)]
pub(crate) enum TareForm {
    /// Unknown constant offsets, one of each component.
    Nuisance(NuisanceTare),
    /// Known offset of an angle, rad, or of a strain.
    Number(f64),
    /// Known offsets of both components of a curvature, 1/m.
    Pair([f64; 2]),
    /// Known offsets of x, y and z in the axes of the file, N, N m or m/s^2.
    Known([f64; 3]),
}

/// Offset that is a nuisance parameter.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum NuisanceTare {
    /// Unknown constant.
    Free,
}

/// Filter of a sensor.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct SensorFilter {
    /// Cutoff frequency of a first-order low-pass filter, Hz.
    pub low_pass: f64,
}

/// Keys of `[[observation]]` that sensors have.
pub(crate) struct SensorForm {
    /// Measured quantity.
    pub quantity: SensorQuantity,
    /// End of the rod with the support of the sensor.
    pub of: Option<End>,
    /// Point of the rod with the sensor; default: the tip.
    pub point: Option<Point>,
    /// File of the readings.
    pub file: Option<PathBuf>,
    /// Rotation vector of the frame of the sensor, rad.
    pub rotation: [f64; 3],
    /// Position of the sensor of a strain relative to the axis, m, along tangent, first and second director; none of
    /// other quantities.
    pub offset: Option<[f64; 3]>,
    /// Name of the rigid body of an export of Motive whose rotation is measured.
    pub body: Option<String>,
    /// Offset of the sensor.
    pub tare: Option<TareForm>,
    /// Filter of the sensor.
    pub filter: Option<SensorFilter>,
    /// Name of the sensor in the scene.
    pub sensor: Option<String>,
    /// First and last time of the readings that are used, s after the start of the motion.
    pub window: Option<[f64; 2]>,
    /// Interpretation of the file.
    pub recording: Recording,
    /// Standard deviation of a reading, in the unit of the quantity.
    pub sigma: Option<f64>,
    /// Loss function of the residuals.
    pub loss: Loss,
    /// Whether the readings are validation data.
    pub held_out: bool,
}

impl SensorForm {
    /// The measurements of the table, one per component of the file that `axes` does not leave out. The path of the
    /// file is relative to `folder`. `key` is that of the table in the fit file, for errors: those of the module's
    /// header.
    pub fn read(
        self,
        folder: &Path,
        problem: &Problem,
        key: &str,
    ) -> Result<Vec<Measurement>, Error> {
        self.check_place(problem, key)?;
        if let Some(filter) = self.filter {
            positive(&format!("{key}.filter.low_pass"), filter.low_pass)?;
        }
        if let Some([first, last]) = self.window {
            let found = format!("[{first}, {last}]");
            let is_valid = first.is_finite() && last.is_finite() && first < last;
            let allowed = "two times in s, the first one smaller";
            ensure(is_valid, format!("{key}.window"), found, allowed)?;
        }
        let recording = &self.recording;
        let positions = [
            GivenKey("format", recording.format.is_some()),
            GivenKey("marker", recording.marker.is_some()),
            GivenKey("likelihood", recording.likelihood.is_some()),
            GivenKey("scale", recording.scale.is_some()),
            GivenKey("origin", recording.origin.is_some()),
            GivenKey("y", recording.y.is_some()),
            GivenKey("sigma", recording.sigma.is_some()),
        ];
        let allowed = "this key with positions only; a sensor has one number as sigma";
        refuse_given(key, &positions, "a key of a position with quantity", allowed)?;
        let path = marker_files::file::at(folder, &self.file.clone().unwrap_or_default());
        let table = SensorTable {
            quantity: self.quantity,
            of: self.of,
            columns: recording.columns.as_ref(),
            fps: recording.fps,
            time_zero: recording.time_zero,
            window: self.window,
        };
        if self.quantity == SensorQuantity::Pose {
            return self.read_pose(&table, &path, problem, key);
        }
        let read = table.read(&path)?;
        let mut measurements = Vec::new();
        for (axis, readings) in read.components.into_iter().enumerate() {
            let Some(direction) = world_direction(recording.axes, axis) else { continue };
            if readings.is_empty() {
                continue;
            }
            let channel = self.channel(axis, direction);
            let tare = match self.tare {
                None => Tare::Known(0.0),
                Some(TareForm::Nuisance(NuisanceTare::Free)) => Tare::Free,
                Some(TareForm::Number(offset)) => Tare::Known(offset),
                Some(TareForm::Pair(offsets)) => Tare::Known(offsets[axis.min(1)]),
                Some(TareForm::Known(offsets)) => Tare::Known(offsets[axis]),
            };
            let mut sensor = Sensor::new(channel, readings).tare(tare);
            sensor.data.low_pass = self.filter.map(|filter| filter.low_pass);
            sensor.data.sensor = SensorReference(self.sensor.clone());
            let mut sensor = sensor.with_source(&path, recording, read.dropped);
            sensor.header.assumed_unit = read.assumed_unit.clone();
            measurements.push(sensor.with_properties(self.sigma, self.loss, self.held_out).into());
        }
        let found = "none of the components of the file";
        ensure(!measurements.is_empty(), format!("{key}.axes"), found, "at least one of them")?;
        Ok(measurements)
    }
}

/// The name of a key, and whether a table has it.
pub(crate) struct GivenKey(pub &'static str, pub bool);

/// Rejects a table `key` that has any of the `keys`. The error is that of the first one given, with its path `key.NAME`
/// and the texts `found` and `allowed`.
pub(crate) fn refuse_given(
    key: &str,
    keys: &[GivenKey],
    found: &str,
    allowed: &str,
) -> Result<(), Error> {
    keys.iter().try_for_each(|GivenKey(own, is_given)| {
        ensure(!is_given, format!("{key}.{own}"), found, allowed)
    })
}

impl SensorForm {
    /// Rejects an end or a point that the quantity does not have, an end without a support, `axes` of a quantity other
    /// than a vector, an offset of another quantity than strain, and a tare for another number of components. Errors
    /// have the key; `key` is that of the table.
    fn check_place(&self, problem: &Problem, key: &str) -> Result<(), Error> {
        let components = self.quantity.components();
        let given = match self.tare {
            Some(TareForm::Number(_)) => 1,
            Some(TareForm::Pair(_)) => 2,
            Some(TareForm::Known(_)) => 3,
            Some(TareForm::Nuisance(_)) | None => components,
        };
        let allowed = match components {
            1 => "\"free\", or one number",
            2 => "\"free\", or two numbers",
            _ => "\"free\", or three numbers",
        };
        let is_own = given == components || self.quantity == SensorQuantity::Pose;
        ensure(is_own, format!("{key}.tare"), "a tare of another quantity", allowed)?;
        let is_strain = self.quantity == SensorQuantity::Strain;
        let allowed = "the position of the gauge, m, along the first and second director, such as [0.002, 0.0]; \
                       [0.0, 0.0] is the strain of the axis, which bending does not change";
        ensure(
            !is_strain || self.offset.is_some(),
            format!("{key}.offset"),
            "no such key",
            allowed,
        )?;
        let has_offset = self.offset.is_some_and(|offset| offset != [0.0; 3]) && !is_strain;
        let (found, allowed) =
            ("an offset with this quantity", "this key with positions and strain only");
        ensure(!has_offset, format!("{key}.offset"), found, allowed)?;
        let has_body = self.body.is_some() && self.quantity != SensorQuantity::Pose;
        let found = "a rigid body with this quantity";
        ensure(!has_body, format!("{key}.body"), found, "this key with quantity = \"pose\" only")?;
        if !self.quantity.is_of_support() {
            let (found, allowed) = ("a key of forces and moments", "point with this quantity");
            ensure(self.of.is_none(), format!("{key}.of"), found, allowed)?;
            let has_axes = components < 3 && self.recording.axes.is_some();
            let found = "axes of a quantity that is no vector";
            let allowed = "rotation, which turns the axis of an angle, and the directors of curvature and strain";
            return ensure(!has_axes, format!("{key}.axes"), found, allowed);
        }
        let (found, allowed) = ("a key of a sensor at a point", "of with this quantity");
        ensure(self.point.is_none(), format!("{key}.point"), found, allowed)?;
        let Some(of) = self.of else {
            let found = "no such key with this quantity";
            return Err(Error::invalid(format!("{key}.of"), found, "\"start\" or \"end\""));
        };
        // A scene of several rods is refused by the check of the measurement.
        let supports = &problem.scene().supports;
        let (name, support) = match of {
            End::Start => ("start", supports.start),
            End::End => ("end", supports.end),
        };
        let is_held = support != Support::Free || problem.scene().structure.is_some();
        let found = format!("\"{name}\", a free end");
        ensure(is_held, format!("{key}.of"), found, "an end that a support holds")
    }

    /// The channel (measured quantity, place and direction) of the component with the number `axis` (0 to 2) in the
    /// file. `direction` is that of a component of a vector before the rotation, which is applied here; the other
    /// quantities do not use it. The point is the tip, and the end the start of the rod, unless given.
    fn channel(&self, axis: usize, direction: [f64; 3]) -> SensorChannel {
        let point = self.point.unwrap_or(Point::Tip);
        let of = self.of.unwrap_or(End::Start);
        let support = |part| Channel { of, part, axis, direction }.rotated(self.rotation).into();
        match self.quantity {
            SensorQuantity::Force => support(ReactionPart::Force),
            SensorQuantity::Moment => support(ReactionPart::Moment),
            SensorQuantity::Acceleration => {
                let quantity = PointQuantity::Acceleration { axis, direction };
                PointChannel { point, quantity }.rotated(self.rotation).into()
            }
            // `read_pose` makes the measurements of a pose, in a plane those of an angle.
            SensorQuantity::Angle | SensorQuantity::Pose => {
                PointChannel::angle(point).rotated(self.rotation).into()
            }
            SensorQuantity::Curvature => {
                PointChannel::curvature(point, axis).rotated(self.rotation).into()
            }
            SensorQuantity::Strain => {
                let quantity = PointQuantity::Strain { offset: self.offset.unwrap_or_default() };
                PointChannel { point, quantity }.rotated(self.rotation).into()
            }
        }
    }
}

/// The direction in the world, a unit vector along a world axis, of axis `axis` (0 to 2) of a file by `axes` (without
/// them the same axis); `None` for an axis that `axes` leaves out.
fn world_direction(axes: Option<Axes>, axis: usize) -> Option<[f64; 3]> {
    let own: [Option<f64>; 3] = std::array::from_fn(|c| (c == axis).then_some(1.0));
    let world = axes.map_or(own, |axes| axes.to_world(own));
    world.iter().any(Option::is_some).then(|| world.map(|c| c.unwrap_or(0.0)))
}

//! `[[sensors]]`: frame, clock and filter of sensors, to which the observations of a fit refer by name.
//!
//! A [`SensorModel`] has a rotation of the frame beyond that of the observation (rotation vector, rad), the position of
//! a load cell relative to the support, m, a gain, a delay, s, and the cutoff frequency of a first-order low-pass
//! filter, Hz. A reading at `t` is the filtered component at `t - delay` times the gain. A dial gauge of
//! load-deflection curves has the reading without load, m. Only fits use sensors, with these numbers as possible
//! parameters (`sensors.NAME.delay`). By default there is no effect. Names that are not valid or used twice are
//! rejected.

use crate::error::{Error, ensure};
use crate::scene::number::{Quantity, is_default, is_one, one};
use crate::scene::table::table;
use crate::scene::validate::check_name;

table! {
    /// `[[sensors]]`: frame, clock and filter of a sensor. An observation with the key `sensor` refers to it by its
    /// name. The motion does not depend on it.
    ///
    /// ```
    /// use rodfit::Scene;
    /// use rodfit::scene::SensorModel;
    /// let mut scene = Scene::load("data/cantilever.toml")?;
    /// scene.sensors = vec![SensorModel { delay: 0.02, ..SensorModel::new("cell") }]; // s
    /// let delay: rodfit::Parameter = "sensors.cell.delay".parse()?;
    /// assert_eq!(delay.of(&scene), Some(0.02));
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub struct SensorModel by name {
        /// Name, part of the names of its parameters: a letter, then letters, digits, - and _.
        pub name: String,
        /// Rotation vector of its frame, rad, beyond `axes` and `rotation` of the observation: in axes of the world
        /// under a support, in axes of the rod (tangent, first and second director) at a point.
        #[serde(default, deserialize_with = "crate::input::arrays::numbers")]
        pub rotation: [D; 3] = Quantity::ANGLE.of_the_recording(),
        /// Position, m, relative to the point of the support, in axes of the world: of moments that a load cell
        /// measures about a point away from the support. Forces do not depend on it.
        #[serde(default, deserialize_with = "crate::input::arrays::numbers")]
        pub position: [D; 3] = Quantity::signed("m").within(-1e3, 1e3).of_the_recording(),
        /// Delay of its readings, s: that of the time `t` shows the rod at `t - delay`.
        #[serde(default)]
        pub delay: D = Quantity::signed("s").within(-1e6, 1e6).of_the_recording(),
        /// Ratio of readings to the measured quantity, before the tare: of forces, moments, accelerations, curvatures
        /// and strains.
        #[serde(default = "one::<D>", skip_serializing_if = "is_one")]
        pub gain: D = Quantity::positive("").within(1e-6, 1e6).of_the_recording(),
        /// Reading of a displacement without load, m: that of a dial gauge in `[[load_deflection]]`.
        #[serde(default, skip_serializing_if = "is_default")]
        pub zero_offset: D = Quantity::signed("m").within(-1e3, 1e3).of_the_recording(),
        /// Cutoff frequency of its first-order low-pass filter, Hz; none without a filter.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub low_pass: Option<D> = Quantity::positive("Hz").within(1e-6, 1e9).of_the_recording(),
    }
}

impl<D: From<f64>> SensorModel<D> {
    /// A sensor of this name at the support with a gain of 1, without rotation, delay and filter.
    pub fn new(name: &str) -> Self {
        let zero = || D::from(0.0);
        let zeros = || [zero(), zero(), zero()];
        let (rotation, position) = (zeros(), zeros());
        let (gain, delay, zero_offset) = (one(), zero(), zero());
        Self { name: name.into(), rotation, position, delay, gain, zero_offset, low_pass: None }
    }
}

/// Rejects the first sensor whose name is not valid, or the name of one before it. The error has the path
/// `sensors[i].name`.
pub(super) fn check_sensors(sensors: &[SensorModel]) -> Result<(), Error> {
    for (i, sensor) in sensors.iter().enumerate() {
        let key = format!("sensors[{i}].name");
        check_name(&key, &sensor.name)?;
        let is_new = sensors[..i].iter().all(|other| other.name != sensor.name);
        ensure(is_new, key, format!("a second sensor {:?}", sensor.name), "each name once")?;
    }
    Ok(())
}

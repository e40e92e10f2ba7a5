//! Reference of readings to a sensor of the scene by its name in `[[sensors]]`.
//!
//! Input: the name, or none, and a scene over any scalar. Output: the [`SensorModel`], its delay and its filter, and
//! the [time of the motion](SensorReference::time_of_motion) that a reading shows. `check` rejects a name that no
//! sensor of the scene has, filters of both the sensor and the observation, and one of readings at rest.
//! `check_without_position` rejects the position of a sensor at a point, `check_without_gain` the gain of one of
//! angles, `check_gauge` all numbers of a dial gauge but its zero offset, which sensors of readings do not have.
//! `require` adds the time of the last reading to the required outputs of a simulation, and `is_delayed` returns
//! whether times are on a clock with a delay. Without a name the clock is that of the motion.

use crate::error::{Error, ensure};
use crate::fit::measurement::reading::Reading;
use crate::fit::measurement::simulated::{DelayedReading, Requirements};
use crate::numerics::scalar::Scalar;
use crate::problem::Problem;
use crate::scene::validate::positive;
use crate::scene::{Parameter, Scene, SensorModel};

/// Change of a rotation, rad, that shows whether a quantity has it: any value that is not a whole turn.
const TRIAL_ROTATION: f64 = 0.1;

/// Readings of an observation, with the cutoff frequency of its own filter, Hz.
pub(crate) struct FilteredReadings<'a> {
    pub readings: &'a [Reading],
    pub low_pass: Option<f64>,
}

/// Name of a sensor of the scene; none for readings without one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorReference(pub Option<String>);

impl SensorReference {
    /// The sensor of the scene; none without a name.
    pub(crate) fn model<'s, D>(&self, scene: &'s Scene<D>) -> Option<&'s SensorModel<D>> {
        let name = self.0.as_ref()?;
        scene.sensors.iter().find(|sensor| sensor.name == *name)
    }

    /// Cutoff frequency of the filter of the sensor, Hz, or else that of the observation.
    pub(crate) fn low_pass<D: Scalar>(
        &self,
        scene: &Scene<D>,
        observation: Option<f64>,
    ) -> Option<D> {
        let own = self.model(scene).and_then(|model| model.low_pass);
        own.or(observation.map(D::from))
    }

    /// The time of the motion, s, that a reading at `time`, s, shows: `time - delay`, at least zero, and without
    /// derivatives at zero.
    pub(crate) fn time_of_motion<D: Scalar>(&self, time: f64, scene: &Scene<D>) -> D {
        let delay = self.model(scene).map(|model| model.delay);
        let since = delay.map_or(D::from(time), |delay| -delay + time);
        if since.value() > 0.0 { since } else { D::from(0.0) }
    }

    /// Whether the times are on a clock with a delay, which the scene has or one of `parameters` is.
    pub(crate) fn is_delayed(&self, scene: &Scene, parameters: &[Parameter]) -> bool {
        let Some(model) = self.model(scene) else { return false };
        let own = format!("sensors.{}.delay", model.name);
        model.delay != 0.0 || parameters.iter().any(|parameter| parameter.path() == own)
    }

    /// Adds the time of the last reading to the required `outputs`, on the clock of the sensor or else of the motion.
    pub(crate) fn require(&self, last: Option<f64>, outputs: &mut Requirements) {
        match (last, &self.0) {
            (Some(last), Some(name)) => {
                outputs.last_delayed.push(DelayedReading { sensor: name.clone(), time: last });
            }
            (Some(last), None) => outputs.last_read = outputs.last_read.max(last),
            (None, _) => {}
        }
    }

    /// Rejects a sensor of the quantity of a point with a position, as the point of the observation determines it.
    pub(crate) fn check_without_position(&self, problem: &Problem) -> Result<(), Error> {
        let Some(SensorModel { name, position, .. }) = self.model(problem.scene()) else {
            return Ok(());
        };
        let allowed = "0 at a point of the rod: `point` of the observation places the sensor";
        let key = format!("sensors.{name}.position");
        ensure(*position == [0.0; 3], key, format!("{position:?}"), allowed)
    }

    /// Rejects a sensor of angles or rotations with a gain, which they do not have.
    pub(crate) fn check_without_gain(&self, problem: &Problem) -> Result<(), Error> {
        let Some(SensorModel { name, gain, .. }) = self.model(problem.scene()) else {
            return Ok(());
        };
        ensure(*gain == 1.0, format!("sensors.{name}.gain"), gain, "1 of angles and rotations")
    }

    /// The sensor of the scene; none without a name. A name that no sensor of the scene has is an error with `key`.
    fn known_model<'s>(
        &self,
        scene: &'s Scene,
        key: &str,
    ) -> Result<Option<&'s SensorModel>, Error> {
        let Some(name) = &self.0 else { return Ok(None) };
        let model = self.model(scene);
        let names: Vec<_> = scene.sensors.iter().map(|sensor| &*sensor.name).collect();
        let allowed = match names.is_empty() {
            true => "a sensor of the scene, which has no [[sensors]]".into(),
            false => format!("one of {}", names.join(", ")),
        };
        ensure(model.is_some(), format!("{key}.sensor"), format!("{name:?}"), allowed)?;
        Ok(model)
    }

    /// Rejects a name that no sensor of the scene has, and a dial gauge with other numbers than its zero offset, which
    /// have no meaning for displacements at rest. Errors have the key.
    pub(crate) fn check_gauge(&self, problem: &Problem, key: &str) -> Result<(), Error> {
        let Some(model) = self.known_model(problem.scene(), key)? else { return Ok(()) };
        let plain = SensorModel { zero_offset: model.zero_offset, ..SensorModel::new(&model.name) };
        let (key, found) = (format!("sensors.{}", model.name), "other numbers");
        ensure(*model == plain, key, found, "zero_offset only, for displacements under loads")
    }

    /// Rejects a filter of the observation that is not positive, a name that no sensor of the scene has, filters of
    /// both the sensor and the observation, and a filter of readings at rest. `check_rotation` rejects a rotation
    /// vector of the sensor, rad, that the quantity does not have. Errors have the key.
    pub(crate) fn check(
        &self,
        FilteredReadings { readings, low_pass }: FilteredReadings,
        problem: &Problem,
        key: &str,
        parameters: &[Parameter],
        check_rotation: impl Fn([f64; 3], &str) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let moves = readings.iter().all(|r| r.time.is_some());
        let check_filter = |is_filtered: bool, key: String| {
            let found = "a filter of readings at rest";
            ensure(moves || !is_filtered, key, found, "a filter of readings over time only")
        };
        if let Some(frequency) = low_pass {
            positive(&format!("{key}.filter.low_pass"), frequency)?;
        }
        check_filter(low_pass.is_some(), format!("{key}.filter"))?;
        let Some(model) = self.known_model(problem.scene(), key)? else { return Ok(()) };
        let name = &model.name;
        let allowed = "0: `tare` of the observation is the offset of its readings";
        let offset = model.zero_offset;
        ensure(offset == 0.0, format!("sensors.{name}.zero_offset"), offset, allowed)?;
        check_rotation(model.rotation, name)?;
        // A component that is a parameter takes other values.
        for (c, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let path = format!("sensors.{name}.rotation.{axis}");
            if parameters.iter().any(|parameter| parameter.path() == path) {
                let mut rotation = model.rotation;
                rotation[c] += TRIAL_ROTATION;
                check_rotation(rotation, name)?;
            }
        }
        let (found, allowed) = ("a filter", "no filter, as the sensor of the scene has low_pass");
        let is_one = model.low_pass.is_none() || low_pass.is_none();
        ensure(is_one, format!("{key}.filter"), found, allowed)?;
        check_filter(model.low_pass.is_some(), format!("sensors.{name}.low_pass"))
    }
}

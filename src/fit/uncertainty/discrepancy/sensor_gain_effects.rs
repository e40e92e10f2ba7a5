//! Effects of gains of sensors: calibrations, gauge factors and sensitivities that differ from those stated.
//!
//! `SensorGain::effects` lists them for one experiment: one for each sensor of forces, moments, accelerations,
//! curvatures or strains. Its number is `sensors.NAME.gain`, with a plausible error of [`GAIN`]. All observations of a
//! quantity without a sensor have one gain, moments one per end of the rod: other readings do not reveal a common error
//! of calibration. `SensorGain::add_to` adds the sensor to the scene, and refers these observations to it. Angles and
//! rotations have no gain.

use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::sensor::SensorReadings;
use crate::fit::measurement::sensor_reference::SensorReference;
use crate::fit::measurement::{MeasuredData, Measurement};
use crate::fit::uncertainty::discrepancy::experiment_effect::{
    EffectTerm, ExperimentEffect, with_sensor,
};
use crate::fit::uncertainty::discrepancy::load_cell_effects::{load_cell_at, moment_of};
use crate::scene::Parameter;

/// Plausible relative error of a calibration: that of gauge factors of strain gauges, and of load cells off their axis.
const GAIN: f64 = 0.01;

/// A sensor with a gain that differs from the stated one.
#[derive(PartialEq)]
pub(super) struct SensorGain {
    /// Name of the sensor of the scene.
    sensor: String,
    /// Indices of its measurements.
    measurements: Vec<usize>,
}

/// The readings of a measurement with a gain; none of other measurements.
fn readings_of(measurement: &Measurement) -> Option<&SensorReadings> {
    match &measurement.data {
        MeasuredData::SensorReadings(own) if !own.channel.is_angle() => Some(own),
        _ => None,
    }
}

/// Name of the quantity with this unit.
fn quantity_in(unit: &str) -> &'static str {
    match unit {
        "N" => "force",
        "N m" => "moment",
        "m/s^2" => "acceleration",
        "1/m" => "curvature",
        _ => "strain",
    }
}

impl EffectTerm for SensorGain {
    /// The effects of an experiment; none without such sensors, and for sensors with a gain in the scene.
    fn effects(experiment: &Experiment) -> Vec<ExperimentEffect<Self>> {
        let scene = experiment.problem.scene();
        let mut found: Vec<ExperimentEffect<Self>> = Vec::new();
        for (k, measurement) in experiment.measurements.iter().enumerate() {
            let Some(readings) = readings_of(measurement) else { continue };
            let quantity = quantity_in(readings.channel.unit());
            let (sensor, name) = match readings.sensor.model(scene) {
                Some(model) if model.gain != 1.0 => continue,
                Some(model) => (model.name.clone(), format!("sensor {}", model.name)),
                // Moments have the sensor of the effects of load cells.
                None => match moment_of(&measurement.data) {
                    Some((end, _)) => (load_cell_at(end), format!("sensor {}", load_cell_at(end))),
                    None => (format!("{quantity}-sensors"), format!("{quantity} sensors")),
                },
            };
            match found.iter_mut().find(|effect| effect.term.sensor == sensor) {
                Some(effect) => effect.term.measurements.push(k),
                None => found.push(ExperimentEffect {
                    path: Parameter::at(&format!("sensors.{sensor}.gain")).path(),
                    name: format!("different gain of the {name}"),
                    size: GAIN,
                    test: "calibrate the sensor with known loads",
                    term: Self { sensor, measurements: vec![k] },
                }),
            }
        }
        found
    }

    /// Adds the sensor to the scene of an experiment, unless it has it, and refers its measurements to it. False,
    /// without a change, if the scene does not allow it.
    fn add_to(effect: &ExperimentEffect<Self>, experiment: &mut Experiment) -> bool {
        let Self { sensor, measurements } = &effect.term;
        let Some(problem) = with_sensor(&experiment.problem, sensor, effect.path) else {
            return false;
        };
        experiment.problem = problem;
        for k in measurements {
            if let MeasuredData::SensorReadings(own) = &mut experiment.measurements[*k].data {
                own.sensor = SensorReference(Some(sensor.clone()));
            }
        }
        true
    }
}

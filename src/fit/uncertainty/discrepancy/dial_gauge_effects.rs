//! Effects of dial gauges that do not show zero without load, in load-deflection curves.
//!
//! A gauge that was not set to zero, or set to zero before a hook or a pan was hung, adds a constant to all
//! displacements. `DialGauge::effects` lists one effect for each curve of an experiment, unless its gauge in the scene
//! has a zero offset. Its number is `sensors.NAME.zero_offset`, with a plausible size of [`ZERO_OFFSET`] of the largest
//! displacement. `DialGauge::add_to` adds a sensor to the scene where the curve has none, and refers the curve to it.

use crate::fit::measurement::MeasuredData;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::load_deflection::LoadCurve;
use crate::fit::measurement::sensor_reference::SensorReference;
use crate::fit::uncertainty::discrepancy::experiment_effect::{
    EffectTerm, ExperimentEffect, with_sensor,
};
use crate::scene::Parameter;

/// Plausible reading without load over the largest displacement.
const ZERO_OFFSET: f64 = 0.01;

/// A gauge with a reading without load.
#[derive(PartialEq)]
pub(super) struct DialGauge {
    /// Name of the sensor of the scene.
    sensor: String,
    /// Index of the curve among the measurements of the experiment.
    curve: usize,
}

/// The curve of a measurement; none of other measurements.
fn curve_of(data: &mut MeasuredData) -> Option<&mut LoadCurve> {
    match data {
        MeasuredData::LoadCurve(own) => Some(own),
        _ => None,
    }
}

impl EffectTerm for DialGauge {
    /// The effects of an experiment; none without curves, and for gauges with a zero offset in the scene.
    fn effects(experiment: &Experiment) -> Vec<ExperimentEffect<Self>> {
        let scene = experiment.problem.scene();
        let mut all: Vec<ExperimentEffect<Self>> = Vec::new();
        for (curve, measurement) in experiment.measurements.iter().enumerate() {
            let Some(own) = measurement.load_curve() else { continue };
            let model = own.gauge.model(scene);
            if model.is_some_and(|model| model.zero_offset != 0.0) {
                continue;
            }
            let sensor = model.map_or_else(|| format!("gauge-{curve}"), |own| own.name.clone());
            let path = Parameter::at(&format!("sensors.{sensor}.zero_offset")).path();
            let displacements = own.curve.iter().map(|row| row.displacement.abs());
            let effect = ExperimentEffect {
                path,
                name: format!(
                    "{}: gauge not at zero without load, or a load that is not counted",
                    measurement.label()
                ),
                size: ZERO_OFFSET * displacements.fold(0.0, f64::max),
                test: "read the gauge without load, also after unloading",
                term: Self { sensor, curve },
            };
            // Curves of one gauge have one zero offset.
            if all.iter().all(|other| other.path != path) {
                all.push(effect);
            }
        }
        all
    }

    /// Adds the sensor to the scene of an experiment, unless it has it, and refers the curve to it. False, without a
    /// change, if the scene does not allow it.
    fn add_to(effect: &ExperimentEffect<Self>, experiment: &mut Experiment) -> bool {
        let DialGauge { sensor, curve } = &effect.term;
        let Some(problem) = with_sensor(&experiment.problem, sensor, effect.path) else {
            return false;
        };
        let Some(own) = curve_of(&mut experiment.measurements[*curve].data) else { return false };
        own.gauge = SensorReference(Some(sensor.clone()));
        experiment.problem = problem;
        true
    }
}

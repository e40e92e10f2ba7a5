//! Effects of load cells that measure moments about another point than that of the support.
//!
//! `LoadCell::effects` lists them for one experiment: one for each end of the rod whose moment is observed, by a
//! sensor without a position. Its number is the coordinate of `sensors.NAME.position` along the axis of the world that
//! is nearest to the tangent there, with a plausible size of [`POSITION`] lengths of the rod.
//! `LoadCell::add_to` adds a sensor to the scene where the observations have none, and refers them to it.

use crate::fit::measurement::MeasuredData;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::sensor_channel::{Channel, ReactionPart, SensorChannel};
use crate::fit::measurement::sensor_reference::SensorReference;
use crate::fit::uncertainty::discrepancy::experiment_effect::{
    EffectTerm, ExperimentEffect, with_sensor,
};
use crate::numerics::total_order;
use crate::numerics::vector::{Vector, sub};
use crate::scene::{End, Parameter};

/// Plausible distance of the origin of a load cell from the clamp, where none is stated, over the length of the rod.
const POSITION: f64 = 0.02;

/// A load cell at a distance from the point of the support of an end.
#[derive(PartialEq)]
pub(super) struct LoadCell {
    /// Name of the sensor of the scene.
    sensor: String,
    /// End of the rod with the support.
    end: End,
}

/// The end and the sensor of a measurement of a moment; none of other measurements.
pub(super) fn moment_of(data: &MeasuredData) -> Option<(End, &SensorReference)> {
    match data {
        MeasuredData::SensorReadings(own) => match own.channel {
            SensorChannel::Support(Channel { of, part: ReactionPart::Moment, .. }) => {
                Some((of, &own.sensor))
            }
            _ => None,
        },
        _ => None,
    }
}

/// Name of the sensor of moments of an end without a sensor in the scene.
pub(super) fn load_cell_at(end: End) -> String {
    format!("load-cell-{}", name_of(end))
}

/// Name of an end of the rod.
fn name_of(end: End) -> &'static str {
    match end {
        End::Start => "start",
        End::End => "end",
    }
}

impl EffectTerm for LoadCell {
    /// The effects of an experiment; none without an observed moment, and for sensors with a position in the scene.
    fn effects(experiment: &Experiment) -> Vec<ExperimentEffect<Self>> {
        let problem = &experiment.problem;
        let mut all = Vec::new();
        for (end, reference) in experiment.measurements.iter().filter_map(|m| moment_of(&m.data)) {
            let model = reference.model(problem.scene());
            if model.is_some_and(|model| model.position != [0.0; 3]) {
                continue;
            }
            let sensor = model.map_or_else(|| load_cell_at(end), |model| model.name.clone());
            let nodes = problem.rest_positions();
            let edge: Vector<f64> = match (end, &nodes[..]) {
                (End::Start, [first, second, ..]) => sub(*second, *first),
                (End::End, [.., before, last]) => sub(*last, *before),
                _ => continue,
            };
            let axis = (0..3).max_by_key(|c| total_order(edge[*c].abs())).unwrap_or(0);
            let axis = ["x", "y", "z"][axis];
            let effect = ExperimentEffect {
                path: Parameter::at(&format!("sensors.{sensor}.position.{axis}")).path(),
                name: format!(
                    "load cell at a distance along {axis} from the support of the {}",
                    name_of(end)
                ),
                size: POSITION * problem.length(),
                test: "measure the distance of the sensor from the clamp, and state it as position in [[sensors]]",
                term: Self { sensor, end },
            };
            if !all.contains(&effect) {
                all.push(effect);
            }
        }
        all
    }

    /// Adds the sensor to the scene of an experiment, unless it has it, and refers the moments of the end to it. False,
    /// without a change, if the scene does not allow it.
    fn add_to(effect: &ExperimentEffect<Self>, experiment: &mut Experiment) -> bool {
        let Self { sensor, end } = &effect.term;
        let Some(problem) = with_sensor(&experiment.problem, sensor, effect.path) else {
            return false;
        };
        experiment.problem = problem;
        for measurement in &mut experiment.measurements {
            if moment_of(&measurement.data).is_some_and(|(of, own)| of == *end && own.0.is_none())
                && let MeasuredData::SensorReadings(own) = &mut measurement.data
            {
                own.sensor = SensorReference(Some(sensor.clone()));
            }
        }
        true
    }
}

//! Omitted effects whose numbers and sizes depend on an experiment: those of structures, load cells, gains of sensors,
//! gravity and dial gauges.
//! All others are in the table of omitted effects.
//!
//! [`ExperimentEffect`] is one such effect: number, plausible size, and the experiment that would distinguish it from
//! the parameters. It adds an [`EffectTerm`] to the scene: that of a
//! [structure](crate::fit::uncertainty::discrepancy::structure_effects), of a [load
//! cell](crate::fit::uncertainty::discrepancy::load_cell_effects), of a [sensor with a
//! gain](crate::fit::uncertainty::discrepancy::sensor_gain_effects), of
//! [gravity](crate::fit::uncertainty::discrepancy::gravity_effects) or of a [dial
//! gauge](crate::fit::uncertainty::discrepancy::dial_gauge_effects). `EffectTerm::effects` lists all effects of an
//! experiment, `add_to` adds the term of one to it. [`with_sensor`] adds a sensor to a scene, for effects of sensors.

use crate::fit::measurement::experiment::Experiment;
use crate::problem::Problem;
use crate::scene::{Parameter, SensorModel};

/// An omitted effect of an experiment, with the term that it adds.
#[derive(PartialEq)]
pub(super) struct ExperimentEffect<T> {
    /// Path of its number.
    pub path: &'static str,
    /// Name, as text.
    pub name: String,
    /// Plausible size in the unit of the number.
    pub size: f64,
    /// Experiment that would distinguish the effect from the parameters.
    pub test: &'static str,
    /// The added term.
    pub term: T,
}

/// A term that an effect adds to an experiment.
pub(super) trait EffectTerm: Sized {
    /// All effects of an experiment, with their plausible sizes; empty where it can have none.
    fn effects(experiment: &Experiment) -> Vec<ExperimentEffect<Self>>;

    /// The effect with the path of its number in `problem`, to which other effects may have been added. Unchanged by
    /// default.
    fn beside_others_of(
        effect: ExperimentEffect<Self>,
        _problem: &Problem,
    ) -> ExperimentEffect<Self> {
        effect
    }

    /// Adds the term of an effect to an experiment, in place. False, without a change, if the scene cannot have it, or
    /// the model has no derivative by the number.
    fn add_to(effect: &ExperimentEffect<Self>, experiment: &mut Experiment) -> bool;
}

/// A copy of a problem whose scene has a sensor of this name, which is added unless it is there. `None` if the scene
/// does not allow it, or the model has no derivative by the number at `path`.
pub(super) fn with_sensor(problem: &Problem, name: &str, path: &'static str) -> Option<Problem> {
    let mut scene = problem.scene().clone();
    if scene.sensors.iter().all(|model| model.name != name) {
        scene.sensors.push(SensorModel::new(name));
    }
    let added = problem.with_scene(scene).ok()?;
    added.check_parameter(Parameter::at(path)).ok()?;
    Some(added)
}

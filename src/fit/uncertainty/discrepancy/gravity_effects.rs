//! Effects of gravity that differs from the stated one: in size or sign, and in direction.
//!
//! `GravityChange::effects` lists them for an experiment of one rod whose gravity is along an axis of the world. The
//! number of the first is that component, with a plausible relative error of [`SIZE`]; a wrong sign is a large one. The
//! numbers of the others are the components along the other axes that the rod moves in, with a plausible tilt of
//! [`TILT`]. Scenes have all of them, so that nothing is added. Gravity along no axis, and structures, have no such
//! effects.

use crate::fit::measurement::experiment::Experiment;
use crate::fit::uncertainty::discrepancy::experiment_effect::{EffectTerm, ExperimentEffect};
use crate::scene::Parameter;

/// Plausible relative error of gravity: its variation on the earth.
const SIZE: f64 = 3e-3;
/// Plausible tilt of the axes of the scene against the vertical, by eye, rad.
const TILT: f64 = 0.01;
/// Component of the normal of a planar scene along an axis, above which the rod does not move along it.
const ALONG_NORMAL: f64 = 1e-9;

/// A change of gravity, which every scene has.
#[derive(PartialEq)]
pub(super) struct GravityChange;

impl EffectTerm for GravityChange {
    /// The effects of an experiment; none of a structure, without gravity, and of gravity along no axis.
    fn effects(experiment: &Experiment) -> Vec<ExperimentEffect<Self>> {
        let (problem, scene) = (&experiment.problem, experiment.problem.scene());
        let gravity = scene.loads.gravity;
        let along = |c: &usize| gravity[*c] != 0.0;
        let axes: Vec<usize> = (0..3).filter(along).collect();
        let ([vertical], true) = (&axes[..], scene.structure.is_none()) else { return Vec::new() };
        let is_planar = problem.planar().is_some();
        let moves_along = |c: usize| !is_planar || problem.normal()[c].abs() < ALONG_NORMAL;
        // Experiments with other directions of gravity have effects of their own.
        let sign = if gravity[*vertical] > 0.0 { "" } else { "-" };
        let effect = |c: usize| {
            let axis = ["x", "y", "z"][c];
            let (name, relative, test) = match c == *vertical {
                true => (
                    format!("different gravity along {sign}{axis}"),
                    SIZE,
                    "check the sign of loads.gravity, and the medium about the rod",
                ),
                false => (
                    format!(
                        "gravity along {sign}{} tilted along {axis}",
                        ["x", "y", "z"][*vertical]
                    ),
                    TILT,
                    "place a plumb line in the picture",
                ),
            };
            ExperimentEffect {
                path: Parameter::at(&format!("loads.gravity.{axis}")).path(),
                name,
                size: relative * gravity[*vertical].abs(),
                test,
                term: Self,
            }
        };
        (0..3).filter(|c| moves_along(*c)).map(effect).collect()
    }

    /// Whether the model has a derivative by the component; nothing is added.
    fn add_to(effect: &ExperimentEffect<Self>, experiment: &mut Experiment) -> bool {
        experiment.problem.check_parameter(Parameter::at(effect.path)).is_ok()
    }
}

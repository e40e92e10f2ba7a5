//! Coarse models of the experiments: few edges and large time steps, for the many simulations of a scan.
//!
//! Input: a search with its experiments, the first period of each, s, and a number of steps in it. The mesh has at
//! least [`COARSE_SEGMENTS`] edges (per rod of a structure) and [`COARSE_PER_MODE`] times the highest measured mode.
//! Its turning angle per edge is at most [`COARSE_TURN`], or [`COARSE_CORRECTED_TURN`] for elements that are corrected
//! for the curvature. A mesh that is coarser already stays. The step is the first period over the number of steps, at
//! most one that resolves moving supports and signals, never below that of the scene. The numerical damping of the
//! scene stays, and a scheme with a stability limit becomes the default one. Step and scheme stay if Newmark's beta is
//! an unknown of the experiment. A rod driven by a recording keeps its mesh, a structure with a recording also its step
//! and scheme.
//!
//! Output: [`ScanModel`] with these experiments, or with copies of the full ones (`from_full_model`), for use where
//! coarse models fail. It returns a search over them (`search`), and converts points between both models
//! (`to_full_model`, `reduced_point`). `ln E` of Young's modulus differs by four times the logarithm of the ratio of
//! the free lengths on both meshes; other unknowns are equal. A coarse scene that is not valid is an error.

use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::Search;
use crate::fit::unknown::Unknown;
use crate::problem::Problem;
use crate::scene::{Clamp, Discretization, Parameter, Scheme, Support};

/// Smallest number of edges of a coarse model. Fewer are faster, but shift the minimum from that of the full model.
const COARSE_SEGMENTS: usize = 12;
/// Largest turning angle per edge of a curved rod, rad. A coarser polygon is too stiff for the modulus to be within the
/// basin of the minimum.
const COARSE_TURN: f64 = 0.2;
/// Like [`COARSE_TURN`], for elements that are [corrected](Discretization) for the curvature of a helix or an arc: the
/// modulus has an error of 0.1 % with the correction, and of 30 % without.
const COARSE_CORRECTED_TURN: f64 = 1.0;
/// Smallest number of edges over the number of the highest measured mode: twelve edges have 44 modes, higher ones need
/// two each.
const COARSE_PER_MODE: usize = 2;

/// The experiments of a search on coarse meshes and with large steps, with their measurements.
pub(crate) struct ScanModel {
    experiments: Vec<Experiment>,
}

impl ScanModel {
    /// The coarse models of all experiments of a search, in their order. `first` is the first period of each
    /// experiment, s, and `steps` the number of time steps in it: the step is `first/steps` within the limits of the
    /// header. An error if a coarse scene is invalid.
    pub fn new(search: &Search, first: &[f64], steps: f64) -> Result<Self, Error> {
        let coarse = |(experiment, first): (&Experiment, &f64)| {
            let unknowns: Vec<&Unknown> =
                search.unknowns.iter().filter(|u| u.is_of(experiment)).collect();
            Ok::<_, Error>(experiment.with_problem(coarse(experiment, &unknowns, *first / steps)?))
        };
        let experiments = search.experiments.iter().zip(first).map(coarse);
        Ok(Self { experiments: experiments.collect::<Result<_, _>>()? })
    }

    /// A `ScanModel` with clones of the search's experiments on their own meshes and with their own steps. It is used
    /// where coarse ones fail.
    pub fn from_full_model(search: &Search) -> Self {
        Self { experiments: search.experiments.to_vec() }
    }

    /// A search over the coarse experiments, with unknowns, sigmas, weights and tolerance of the `full` search. Its
    /// counter of the work and its journal are new, and it has no progress callback.
    pub fn search<'a>(&'a self, full: &Search<'a>) -> Search<'a> {
        Search { experiments: &self.experiments, ..full.detached() }
    }

    /// The point of the full model with the same frequencies as the point `x` of the coarse one, both on the unknowns'
    /// scales. Clamps at nodes make a rod half an edge too short, which is more on the coarse mesh. Frequencies are
    /// proportional to `sqrt(E)/length^2`. So `ln E` rises by `4 ln(full/coarse)`, with the free lengths of both meshes
    /// in the first experiment of the modulus; other unknowns stay.
    pub fn to_full_model(&self, search: &Search, mut x: Vec<f64>) -> Vec<f64> {
        for (x, unknown) in x.iter_mut().zip(search.unknowns) {
            let mut both = search.experiments.iter().zip(&self.experiments);
            let own = both.find(|(e, _)| unknown.is_of(e));
            if let Some((full, coarse)) = own
                && unknown.parameter == Parameter::YoungsModulus
            {
                let ratio = free_length_ratio(&full.problem) / free_length_ratio(&coarse.problem);
                *x += 4.0 * ratio.ln();
            }
        }
        x
    }

    /// The point of the coarse model whose [point of the full model](Self::to_full_model) is `x`, both on the unknowns'
    /// scales: `ln E` changes by the opposite shift, other unknowns stay.
    pub fn reduced_point(&self, search: &Search, x: Vec<f64>) -> Vec<f64> {
        // The shift does not depend on the point: x less the shift is 2 x less the shifted point.
        let full = self.to_full_model(search, x.clone());
        x.iter().zip(full).map(|(x, full)| 2.0 * x - full).collect()
    }
}

/// Free length of a rod over its length: `1 - w/(2 n)` with clamps at nodes, `n` edges and `w` clamped ends (0 to 2).
/// It is 1 with clamps in the middle of an edge.
fn free_length_ratio(problem: &Problem) -> f64 {
    let supports = &problem.scene().supports;
    let walls = [supports.start, supports.end].iter().filter(|s| **s == Support::Clamped).count();
    match supports.clamp {
        Clamp::Nodes => 1.0 - 0.5 * walls as f64 / problem.segments() as f64,
        Clamp::MidEdge => 1.0,
    }
}

/// The problem of an experiment on a coarse mesh, as the module's header describes it, with steps of `step`, s. Steps
/// are at most those that resolve moving supports and signals, and never below the scene's own. The numerical damping
/// `(beta - 1/2) h` of Newmark's scheme stays, and schemes with a stability limit become the default one. Step and
/// scheme stay if beta is among the `unknowns`. The mesh stays where it is coarse already or a recording drives the
/// rod. A structure with a recording is unchanged. An error if the new scene is invalid.
fn coarse(experiment: &Experiment, unknowns: &[&Unknown], step: f64) -> Result<Problem, Error> {
    let problem = &experiment.problem;
    let mut scene = problem.scene().clone();
    // Steps of a structure that follows a recording are already as large as the motion allows.
    if scene.structure.as_ref().is_some_and(|structure| structure.recording.is_some()) {
        return Ok(problem.clone());
    }
    let has_formula = scene.rod.shape.turning().is_some();
    let largest_turn = match has_formula && scene.discretization() != Discretization::Paper {
        true => COARSE_CORRECTED_TURN,
        false => COARSE_TURN,
    };
    let turns = problem.turning() / largest_turn;
    let modes = COARSE_PER_MODE * experiment.highest_mode();
    let rods = scene.structure.as_ref().map_or(1, |structure| structure.rods.len());
    let coarse = (rods * COARSE_SEGMENTS).max(turns.ceil() as usize).max(modes);
    // Markers along a recorded rod are at its nodes, which stay.
    if coarse < problem.segments() && scene.supports.path.is_none() {
        scene = problem.remeshed(coarse);
    }
    let largest_step = scene.largest_good_step();
    let beta_is_known = unknowns.iter().all(|u| u.parameter != Parameter::Beta);
    if let Some(time) = &mut scene.time
        && beta_is_known
    {
        let step = step.min(largest_step).max(time.step_size());
        // The numerical damping is proportional to (beta - 1/2) h, which stays.
        time.beta = 0.5 + (time.beta - 0.5) * time.step_size() / step;
        // Large steps are beyond the limit of a conditionally stable scheme.
        if time.scheme.traits().stability_limit.is_some() {
            time.scheme = Scheme::default();
        }
        time.step = Some(step);
    }
    problem.with_scene(scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::measurement::frequencies::Frequencies;
    use crate::scene::{Material, Scene, Section, Shape, Time};

    /// Twelve edges have 44 modes; higher ones need two edges per mode, at most those of the scene.
    #[test]
    fn coarse_mesh_resolves_highest_measured_mode() {
        let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
        let section = Section::Circle { radius: 0.005 };
        let mut scene = Scene::new(150, shape, section, Material::new(1273.52, 1e8));
        scene.time = Some(Time::new(0.4, 1e-3));
        let problem = scene.problem().unwrap();
        for (mode, segments) in [(1, 12), (6, 12), (50, 100), (80, 150)] {
            let measured = Frequencies::new(&[1.0], 0.1).of_modes(&[mode]).unwrap();
            let experiment = Experiment::new("", &problem).observe(measured);
            let coarse = coarse(&experiment, &[], 0.3 / 48.0).unwrap();
            assert_eq!(coarse.segments(), segments, "mode {mode}");
            assert!(coarse.time().unwrap().step_size() > 6e-3);
        }
    }
}

//! A coarse model of every experiment, cheap enough to be tried at thousands of values.

use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::{Search, Task};
use crate::fit::unknown::Unknown;
use crate::problem::Problem;
use crate::scene::Parameter;
use crate::scene::{Clamp, Discretization, Scheme, Support};

/// Edges of the coarse model of a straight rod.
const COARSE_SEGMENTS: usize = 12;
/// Largest turn per edge of the coarse model of a curved rod, rad: a coarser polygon is stiffer
/// than the curve by more than the search forgives.
const COARSE_TURN: f64 = 0.2;
/// The same where the elements are [corrected](Discretization) for the curve, a helix or an arc: its
/// modulus is 0.1 % off with that, without it 30 %.
const COARSE_CORRECTED_TURN: f64 = 1.0;
/// The same for each mode up to the highest whose frequency was measured.
const COARSE_PER_MODE: usize = 2;
/// The experiments on coarse meshes with large steps.
pub(crate) struct Coarse {
    experiments: Vec<Experiment>,
}

impl Coarse {
    /// With so many steps in the first periods `first`, s.
    pub fn new(search: &Search, first: &[f64], steps: f64) -> Result<Self, Error> {
        let coarse = |(experiment, first): (&Experiment, &f64)| {
            let unknowns: Vec<&Unknown> =
                search.unknowns.iter().filter(|u| u.is_of(experiment)).collect();
            Ok::<_, Error>(experiment.posed_as(coarse(experiment, &unknowns, *first / steps)?))
        };
        let experiments = search.experiments.iter().zip(first).map(coarse);
        Ok(Self { experiments: experiments.collect::<Result<_, _>>()? })
    }

    /// No coarser than the search's own.
    pub fn as_it_is(search: &Search) -> Self {
        Self { experiments: search.experiments.to_vec() }
    }

    /// The search's problem with the coarse experiments.
    pub fn task<'a>(&'a self, search: &'a Search) -> Task<'a> {
        Task { experiments: &self.experiments, ..search.task() }
    }

    /// Walls at nodes make a rod half an edge too short, on the coarse mesh more than on the full
    /// one; frequencies go with sqrt(E)/length^2.
    pub fn correct(&self, search: &Search, mut x: Vec<f64>) -> Vec<f64> {
        for (x, unknown) in x.iter_mut().zip(search.unknowns) {
            let mut both = search.experiments.iter().zip(&self.experiments);
            let own = both.find(|(e, _)| unknown.is_of(e));
            if let Some((full, coarse)) = own
                && unknown.parameter == Parameter::YoungsModulus
            {
                *x += 4.0 * (free(&full.problem) / free(&coarse.problem)).ln();
            }
        }
        x
    }

    /// What is [corrected](Self::correct) to `x`.
    pub fn wrong(&self, search: &Search, x: Vec<f64>) -> Vec<f64> {
        let corrected = self.correct(search, x.clone());
        x.iter().zip(corrected).map(|(x, corrected)| 2.0 * x - corrected).collect()
    }
}

/// The part of a rod's length that walls at nodes leave free.
fn free(problem: &Problem) -> f64 {
    let supports = &problem.scene().supports;
    let walls = [supports.start, supports.end].iter().filter(|s| **s == Support::Clamped).count();
    match supports.clamp {
        Clamp::Nodes => 1.0 - 0.5 * walls as f64 / problem.segments() as f64,
        Clamp::MidEdge => 1.0,
    }
}

/// The problem on a coarse mesh with steps of about `step`, s.
fn coarse(experiment: &Experiment, unknowns: &[&Unknown], step: f64) -> Result<Problem, Error> {
    let problem = &experiment.problem;
    let mut scene = problem.scene().clone();
    let formula = scene.rod.shape.turning().is_some();
    let most = match formula && scene.discretization() != Discretization::Paper {
        true => COARSE_CORRECTED_TURN,
        false => COARSE_TURN,
    };
    let turns = problem.turning() / most;
    let modes = COARSE_PER_MODE * experiment.highest_mode();
    let coarse = COARSE_SEGMENTS.max(turns.ceil() as usize).max(modes);
    // Markers along a rod stand at its nodes.
    if coarse < problem.segments() && scene.supports.path.is_none() {
        scene = problem.remeshed(coarse);
    }
    let good = scene.supports.largest_good_step();
    let beta_is_known = unknowns.iter().all(|u| u.parameter != Parameter::Beta);
    if let Some(time) = &mut scene.time
        && beta_is_known
    {
        let step = step.min(good).max(time.step_size());
        // The scheme damps like (beta - 1/2) h.
        time.beta = 0.5 + (time.beta - 0.5) * time.step_size() / step;
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

    /// Twelve edges have 44 modes: higher ones need more.
    #[test]
    fn the_mesh_has_the_modes_that_were_measured() {
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

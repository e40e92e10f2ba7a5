//! Mesh and step of a fit, where scenes leave them to the program.
//!
//! A search begins with a coarse mesh and large steps, as the motion that was recorded takes them. At its optimum
//! another mesh and another step show how far every parameter is from where edges and steps of no length have it.
//! That is corrected in the estimates, and half of it stated as the error of the correction. Where this half is more
//! than a quarter of a standard error (or, of exact data, than 1e-4 of the value), or where discretization errors are a
//! visible part of the residuals, mesh and step are refined, and the fit goes on from the expected optimum.

use crate::accuracy::{Aim, ErrorModel};
use crate::error::Error;
use crate::fit::measurement::experiment::{Experiment, full_work};
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::discretization::bias::{DiscretizationBias, REMAINING_FRACTION};
use crate::fit::unknown::Unknown;
use crate::scene::StepTolerance;

/// Part of a standard error that mesh and step may leave open together, and of a value, where data are exact.
const OF_ERROR: f64 = 0.25;
const OF_VALUE: f64 = 1e-4;
/// Edges to begin with, edges for each mode up to the highest that was measured, and steps in the first period.
const FIRST_EDGES: usize = 24;
const FIRST_PER_MODE: usize = 6;
const FIRST_STEPS: f64 = 60.0;
/// Refinements at most, and each by so many times at most.
const ROUNDS: usize = 4;
const MOST_FINER: f64 = 4.0;
/// Most work of a simulation of all experiments, steps times edges.
const MOST_WORK: f64 = 4e6;

/// The experiments as a search begins with them.
pub(crate) fn begun(experiments: Vec<Experiment>) -> Result<Vec<Experiment>, Error> {
    experiments.into_iter().map(begin).collect()
}

fn begin(experiment: Experiment) -> Result<Experiment, Error> {
    let problem = &experiment.problem;
    let chosen = problem.scene().chosen();
    if !chosen.any() {
        return Ok(experiment);
    }
    let modes = FIRST_PER_MODE * experiment.highest_mode();
    // A mesh that was chosen for a motion that was not recorded is finer, and says nothing.
    let guess = problem.scene().reopened().problem_for(Aim::Guess)?.segments();
    let segments = guess.max(FIRST_EDGES).max(modes);
    let swing = experiment.records().map(|o| 2.0 * o.rise_time()).fold(f64::INFINITY, f64::min);
    let own = problem.scene().time.as_ref().map_or(1.0, |time| time.step_size());
    let step = swing / FIRST_STEPS;
    let good = problem.scene().supports.largest_good_step();
    let step = if step.is_finite() && step > 0.0 { step.min(good) } else { own };
    posed(experiment, segments, step)
}

/// The experiments on the mesh and in the steps of their scenes, where the program has chosen these for a simulation: their
/// steps solved so exactly that residuals follow the unknowns smoothly.
pub(crate) fn smooth(experiments: Vec<Experiment>) -> Result<Vec<Experiment>, Error> {
    let smooth = |experiment: Experiment| {
        let mut scene = experiment.problem.scene().clone();
        let chosen = scene.chosen().scheme;
        let Some(time) = scene.time.as_mut().filter(|_| chosen) else { return Ok(experiment) };
        time.tolerance = StepTolerance::default();
        let other = experiment.problem.with_scene(scene)?;
        Ok(experiment.posed_as(other))
    };
    experiments.into_iter().map(smooth).collect()
}

/// The experiment with other numerics, where the program chooses them.
fn posed(experiment: Experiment, segments: usize, step: f64) -> Result<Experiment, Error> {
    let problem = &experiment.problem;
    let spans = match &problem.scene().supports.path {
        Some(path) => path.track()?.markers().len().max(2) - 1,
        None => 1,
    };
    let segments = segments.div_ceil(spans) * spans;
    let other = problem.with_scene(problem.scene().resolved(segments, step))?;
    Ok(experiment.posed_as(other))
}

/// A refined discretization, and the expected optimum on it.
pub(crate) struct RefinedStart {
    pub experiments: Vec<Experiment>,
    /// The unknowns on their scales.
    pub x: Vec<f64>,
}

/// The experiments as finely as an optimum needs them, whose unknowns have this `bias` by mesh and step;
/// none where they are fine enough, cannot be finer, or have been refined often enough.
pub(crate) fn refined(
    experiments: &[Experiment],
    Fitted { search, optimum }: Fitted,
    local: &LocalAnalysis,
    bias: Option<&DiscretizationBias>,
    round: usize,
) -> Result<Option<RefinedStart>, Error> {
    let open = experiments.iter().any(|e| e.problem.scene().chosen().any());
    if !open || round >= ROUNDS {
        return Ok(None);
    }
    let [mut mesh, mut step] = [1.0_f64; 2];
    let segments = experiments.iter().map(|e| e.problem.segments()).max().unwrap_or(0);
    let corrections = |i: usize| bias.map_or([0.0; 2], |bias| bias.corrections(i));
    for (i, unknown) in search.unknowns.iter().enumerate() {
        let Some(sd) = local.covariance.deviation[i] else { continue };
        let exact = OF_VALUE * size(unknown, optimum.x[i], search);
        let allowed = (OF_ERROR * sd).max(exact) / REMAINING_FRACTION;
        let finer = ErrorModel::of_second_order(corrections(i)).finer_for(allowed, segments);
        (mesh, step) = (mesh.max(finer.mesh), step.max(finer.step));
    }
    for combination in &local.covariance.combinations {
        let errors = bias.map_or([0.0; 2], |bias| bias.corrections_along(&combination.exponents));
        let allowed = (OF_ERROR * combination.deviation).max(OF_VALUE) / REMAINING_FRACTION;
        let finer = ErrorModel::of_second_order(errors).finer_for(allowed, segments);
        (mesh, step) = (mesh.max(finer.mesh), step.max(finer.step));
    }
    if let Some(bias) = bias {
        let [by_mesh, by_step] = bias.refinement();
        (mesh, step) = (mesh.max(by_mesh), step.max(by_step));
    }
    if optimum.halved {
        // Steps that are taken in halves make the misfit jump.
        step = step.max(2.0);
    }
    let work = full_work(search.experiments)?;
    let room = (MOST_WORK / work).sqrt().max(1.0);
    let [mesh, step] = [mesh, step].map(|factor| factor.min(MOST_FINER).min(room));
    if mesh.max(step) < 1.01 {
        return Ok(None);
    }
    let finer = |e: &Experiment| {
        let segments = (e.problem.segments() as f64 * mesh).ceil() as usize;
        let own = e.problem.scene().time.as_ref().map_or(1.0, |time| time.step_size());
        match e.problem.scene().chosen().any() {
            true => posed(e.clone(), segments, own / step),
            false => Ok(e.clone()),
        }
    };
    let experiments = experiments.iter().map(finer).collect::<Result<_, _>>()?;
    let expected = optimum.x.iter().enumerate().zip(search.unknowns).map(|((i, x), unknown)| {
        let [low, high] = unknown.scaled_bounds();
        let [by_mesh, by_step] = corrections(i);
        let there = by_mesh * (1.0 - mesh.powi(-2)) + by_step * (1.0 - step.powi(-2));
        (x + there).clamp(low, high)
    });
    Ok(Some(RefinedStart { experiments, x: expected.collect() }))
}

/// What a value that is not a logarithm is measured by.
fn size(unknown: &Unknown, x: f64, search: &Search) -> f64 {
    let own = search.experiments.iter().find(|e| unknown.is_of(e));
    let scale = match unknown.parameter.unit() {
        _ if unknown.parameter.is_positive() => return 1.0,
        "m" => own.map_or(1.0, |e| e.problem.length()),
        "s" => own.map_or(1.0, Experiment::duration),
        "" | "rad" => 1.0,
        _ => 0.0,
    };
    x.abs().max(scale)
}

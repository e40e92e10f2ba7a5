//! The error that mesh and step leave in the identified parameters.
//!
//! The statistical interval knows nothing of it: it can only be seen with another mesh and another
//! step. Each is changed alone, and the parameters' changes are carried on to zero as if they were of
//! first order. That is on the safe side: two and a half to three times the error of a second-order
//! method, and mesh and step never cancel. A mesh and a step that are twice as coarse cost one simulation, half as coarse again
//! 1.3, where finer ones cost 2.5 by a quarter and 4 by half, and none covers better
//! (`cargo run --release --example discretization_error -- 400`). Where coarser ones would not resolve the
//! motion, or cannot be simulated, they are finer by a quarter: nothing here is random, and that is enough.
//!
//! Where the program [chose](crate::fit::resolution) mesh or step, their changes are carried on with the order of the
//! method, and the values are corrected by that; what is stated is what the order leaves open, half of the correction:
//! it would be 1.5 times as large at an order of 1.5, and half as large at 3.

use crate::accuracy::{Extrapolation, smooth_mesh_order, step_order};
use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::search::{Search, Task};
use crate::fit::uncertainty::analysis::Refinement;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::{Severity, Warnings, percent};
use crate::fit::uncertainty::noise::residual_noise::Noise;
use crate::fit::uncertainty::shifts::{MESH_TO_BLAME, OPEN, Response, Shifts};
use crate::fit::unknown::Unknown;
use crate::scene::{Parameter, Scene, Shape};
use serde::{Deserialize, Serialize};

/// How much coarser, of numerics that are given, in the order in which they are tried; of those that the program chose, whose
/// changes are carried on with the order of the method; and how much finer where a coarser one says nothing.
const COARSER: [f64; 2] = [2.0, 1.5];
const COARSER_CHOSEN: [f64; 1] = [1.5];
const FINER: f64 = 1.25;
/// What a coarser model needs: edges, edges for each mode up to the highest whose frequency was measured,
/// and steps in the first period.
const FEWEST_EDGES: f64 = 16.0;
const FEWEST_PER_MODE: f64 = 4.0;
const FEWEST_STEPS: f64 = 100.0;
/// The same of steps where the program chose them.
const FEWEST_CHOSEN_STEPS: f64 = 40.0;

/// Discretization error of a parameter, as fractions of its value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct DiscretizationError {
    /// Name of the parameter.
    pub name: Parameter,
    /// Experiments with this parameter; empty: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub experiments: Vec<String>,
    /// Error of mesh and step as a fraction of the value; null if the parameter is not
    /// identifiable.
    pub relative: Option<f64>,
    /// Error of the mesh as a fraction of the value; null if the parameter is not identifiable.
    pub mesh: Option<f64>,
    /// Error of the time step as a fraction of the value; null where the fit identifies beta.
    pub step: Option<f64>,
    /// Correction of the value for mesh and step, as a fraction of it; null where the scene gives
    /// them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correction: Option<f64>,
}

/// An experiment with another mesh or step, and the error over the change that makes.
type Other = (Experiment, f64);
/// That of every experiment, where there is one.
type Others = Result<Vec<Option<Other>>, Error>;

/// The order with which changes of the mesh are carried on: the first where it is given.
fn carried_mesh_order(scene: &Scene) -> f64 {
    if scene.chosen().segments { smooth_mesh_order(scene) } else { 1.0 }
}

/// The same of a step.
fn carried_step_order(scene: &Scene) -> f64 {
    scene.time.as_ref().filter(|_| scene.chosen().step).map_or(1.0, step_order)
}

/// How much coarser a mesh or a step may be.
fn coarser_by(chosen: bool) -> &'static [f64] {
    if chosen { &COARSER_CHOSEN } else { &COARSER }
}

/// The experiments with fewer edges where `coarser` ones will do, else with more.
fn other_meshes(search: &Search, coarser: bool) -> Others {
    let other = |experiment: &Experiment| {
        let problem = &experiment.problem;
        let own = problem.segments() as f64;
        let needed = FEWEST_EDGES.max(FEWEST_PER_MODE * experiment.highest_mode() as f64);
        // Markers along a rod stand at its nodes: a node between any two is the next mesh.
        let marked = problem.scene().supports.path.is_some();
        let fewer = coarser_by(problem.scene().chosen().segments).iter();
        let mut fewer = fewer.map(|ratio| (own / ratio).round()).filter(|_| coarser);
        let segments = match fewer.find(|fewer| *fewer >= needed) {
            _ if marked => 2.0 * own,
            Some(fewer) => fewer,
            None => (own * FINER).round(),
        };
        let other = problem.like_it(problem.remeshed(segments as usize))?;
        let order = carried_mesh_order(problem.scene());
        let finer = Extrapolation { ratio: segments / own, order };
        Ok(Some((experiment.posed_as(other), finer.error_before())))
    };
    search.experiments.iter().map(other).collect()
}

/// The experiments with a larger step where `coarser` ones will do, else with a smaller one; none where
/// nothing moves or beta is to be found.
fn other_steps(search: &Search, coarser: bool) -> Others {
    let other = |experiment: &Experiment| {
        let beta = |u: &Unknown| u.parameter == Parameter::Beta && u.is_of(experiment);
        if search.unknowns.iter().any(beta) || !experiment.moves() {
            return Ok(None);
        }
        let mut scene = experiment.problem.scene().clone();
        let swing = experiment.records().map(|o| 2.0 * o.rise_time()).fold(f64::INFINITY, f64::min);
        let (chosen, order) = (scene.chosen().step, carried_step_order(&scene));
        let fewest = if chosen { FEWEST_CHOSEN_STEPS } else { FEWEST_STEPS };
        let most = (swing / fewest).min(scene.supports.largest_good_step());
        let mut ratio = FINER;
        if let Some(time) = &mut scene.time {
            let explicit = time.scheme.traits().stability_limit.is_some();
            let mut larger = coarser_by(chosen).iter().filter(|_| coarser && !explicit);
            if let Some(larger) = larger.find(|larger| *larger * time.step_size() <= most) {
                ratio = larger.recip();
            }
            time.step = time.step.map(|step| step / ratio);
        }
        let other = experiment.problem.like_it(scene)?;
        let finer = Extrapolation { ratio, order };
        Ok(Some((experiment.posed_as(other), finer.error_before())))
    };
    search.experiments.iter().map(other).collect()
}

/// How far the unknowns, on their scales, are from those of the limit that the models of `task` and
/// the `others`, one per experiment, are on the way to; and the work that took. None if no experiment has
/// another one.
fn change(
    task: Task,
    others: Vec<Option<Other>>,
    optimum: &Optimum,
    (covariance, weights): (&Covariance, &[f64]),
    how: Refinement,
) -> Result<Option<Change>, Error> {
    if others.iter().all(Option::is_none) {
        return Ok(None);
    }
    let (experiments, to_zero): (Vec<Experiment>, Vec<f64>) = others
        .into_iter()
        .zip(task.experiments)
        .map(|(other, experiment)| other.unwrap_or_else(|| (experiment.clone(), 0.0)))
        .unzip();
    let search = Task { experiments: &experiments, ..task }.search();
    let (moved, left): (Vec<Option<f64>>, f64) = match how {
        Refinement::Refitted => {
            let there = search.polish(&optimum.x)?;
            let most = to_zero.iter().copied().fold(0.0, f64::max);
            let moved = there.x.iter().zip(&optimum.x).map(|(a, b)| most * (a - b));
            let moved = moved.zip(&covariance.deviation).map(|(d, sd)| sd.map(|_| d)).collect();
            let left = there.residuals.iter().zip(&optimum.residuals).map(|(a, b)| most * (a - b));
            (moved, norm(left.enumerate().map(|(k, r)| r * search.growth_weight(k))))
        }
        _ => {
            let there = search.all_residuals()?.plain(&optimum.x)?;
            let mut factors = Vec::with_capacity(there.len());
            let mut counts = optimum.counts.iter();
            for (experiment, to_zero) in experiments.iter().zip(&to_zero) {
                let own = counts.by_ref().take(experiment.measurements.len()).sum();
                factors.extend(std::iter::repeat_n(*to_zero, own));
            }
            factors.resize(there.len(), 0.0);
            let pairs = there.iter().zip(&optimum.residuals).zip(&factors);
            let change: Vec<f64> = pairs.map(|((a, b), f)| f * (a - b)).collect();
            let Response { unknowns, residuals } =
                Response::to(&change, covariance, weights, &optimum.jacobian);
            let left = residuals.iter().enumerate().map(|(k, r)| r * search.growth_weight(k));
            (unknowns, norm(left))
        }
    };
    Ok(Some(Change { moved, left, work: search.work.total() }))
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|x| x * x).sum::<f64>().sqrt()
}

/// What a limit of zero mesh or step changes.
struct Change {
    /// The unknowns on their scales, where they are identifiable.
    moved: Vec<Option<f64>>,
    /// The residuals, in units of the noise, once the unknowns have followed.
    left: f64,
    /// To find it, steps times segments.
    work: f64,
}

/// What mesh and step may leave in the `estimates`.
pub(crate) fn errors_of(
    estimates: &[Estimate],
    fitted: Fitted,
    shifts: &Shifts,
    noise: &Noise,
    warnings: &mut Warnings,
) -> Vec<DiscretizationError> {
    let search = fitted.search;
    let mut errors = errors(fitted, shifts);
    for (error, _) in errors.iter_mut().zip(estimates).filter(|(_, e)| !e.identifiable) {
        [error.relative, error.mesh, error.step, error.correction] = [None; 4];
    }
    let remedy = remedy(search.experiments);
    let mut weight = Severity::Numerics;
    let given = search.experiments.iter().any(|e| {
        let chosen = e.problem.scene().chosen();
        !chosen.segments || e.moves() && !chosen.step
    });
    if given && shifts.left > MESH_TO_BLAME && warnings.has_misfit() {
        weight = Severity::Mesh;
        let words = "a finer mesh or step changes the motion by as much as the residuals. The residuals may be \
                     discretization error. Refine the numerics before searching for a missing effect";
        warnings.add(Severity::Mesh, Code::NumericsNotModel, format!("{words} ({remedy})"));
    }
    for ((i, estimate), error) in estimates.iter().enumerate().zip(&errors) {
        // What was chosen is corrected, and in the interval.
        let unsure = |(_, chosen): &(Option<f64>, bool)| !chosen;
        let relative = [error.mesh, error.step].into_iter().zip(shifts.parts(i));
        let relative: f64 =
            relative.filter(|(_, part)| unsure(part)).filter_map(|(part, _)| part).sum();
        if let (Some(value), Some(sd)) = (estimate.value, estimate.std_error)
            && relative * value.abs() > 2.0 * noise.reach * sd
        {
            let name = estimate.name;
            let off = match name.is_positive() {
                true => percent(relative),
                false => format!("{:.1e} {}", relative * value.abs(), name.unit()),
            };
            let words = format!(
                "{}: the discretization error may be {}, more than the half-width of the 95 % interval. The \
                 interval is too narrow. {remedy}",
                estimate.label(),
                off.trim_end()
            );
            warnings.add(weight, Code::DiscretizationError, words);
        }
    }
    errors
}

/// What helps against numerics that are given.
fn remedy(experiments: &[Experiment]) -> &'static str {
    let line = |e: &Experiment| matches!(e.problem.scene().rod.shape, Shape::Polyline { .. });
    match experiments.iter().any(line) {
        true => "Leave out time.step, and the program chooses it; the mesh is that of the polyline",
        false => "Leave out rod.segments and time.step, and the program chooses them",
    }
}

/// How far the unknowns of an optimum are from those of the continuum; `None` where that is not looked for.
pub(crate) fn shifts(
    Fitted { search, optimum }: Fitted,
    (covariance, weights): (&Covariance, &[f64]),
    how: Refinement,
) -> Result<Option<Shifts>, Error> {
    let all = |chosen: fn(&Experiment) -> bool| search.experiments.iter().all(chosen);
    let chosen = [
        all(|e| e.problem.scene().chosen().segments),
        all(|e| !e.moves() || e.problem.scene().chosen().step),
    ];
    let open = search.experiments.iter().any(|e| e.problem.scene().chosen().any());
    let how = match how {
        Refinement::None if !open => return Ok(None),
        Refinement::None => Refinement::Linearized,
        how => how,
    };
    if !optimum.converged {
        return Ok(None);
    }
    let task = search.task();
    let part = |others: fn(&Search, bool) -> Others| {
        let change =
            |coarser| change(task, others(search, coarser)?, optimum, (covariance, weights), how);
        // A fit of a coarser model may end elsewhere.
        match change(how == Refinement::Linearized) {
            Err(Error::Interrupted) => Err(Error::Interrupted),
            Err(_) if how == Refinement::Linearized => change(false),
            found => found,
        }
    };
    let (mesh, step) = rayon::join(|| part(other_meshes), || part(other_steps));
    let mut left = 0.0_f64;
    let [mesh, step] = [mesh?, step?].map(|part| {
        part.map(|change| {
            search.work.add(change.work);
            left = left.max(change.left);
            change.moved
        })
    });
    let residuals = optimum.residuals.iter().enumerate();
    let residuals = norm(residuals.map(|(k, r)| r * search.growth_weight(k)));
    search.report("discretisation error");
    Ok(Some(Shifts { mesh, step, chosen, left: left / residuals }))
}

/// The discretisation error of every unknown.
fn errors(Fitted { search, optimum }: Fitted, shifts: &Shifts) -> Vec<DiscretizationError> {
    let error = |(i, unknown): (usize, &Unknown)| {
        let correction = shifts.correction(i);
        let value = unknown.from_scale(optimum.x[i] + correction);
        // A change of the logarithm is a relative one.
        let size = if unknown.parameter.is_positive() { 1.0 } else { value.abs() };
        let relative = |(shift, chosen): (Option<f64>, bool)| {
            let part = if chosen { OPEN } else { 1.0 };
            Some(part * (shift? / size).abs())
        };
        let [mesh, step] = shifts.parts(i).map(relative);
        let known = mesh.is_some() || step.is_some();
        let relative = known.then_some(mesh.unwrap_or(0.0) + step.unwrap_or(0.0));
        let corrected = shifts.parts(i).iter().any(|(shift, chosen)| shift.is_some() && *chosen);
        let correction = corrected.then_some(correction / size);
        let experiments = unknown.experiments.clone();
        DiscretizationError {
            name: unknown.parameter,
            experiments,
            relative,
            mesh,
            step,
            correction,
        }
    };
    search.unknowns.iter().enumerate().map(error).collect()
}

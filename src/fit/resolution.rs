//! Choice of mesh and time step of a fit, where scenes leave them to the program: coarse ones first, which are refined
//! until their error is small.
//!
//! [`with_initial_resolution`] gives experiments the mesh and the step with which a search begins: few edges, and large
//! steps for the recorded motion. [`refined_start`] has as input the optimum of a search with its covariance and its
//! discretization bias: the shift of every parameter from the limit of zero edge and step size. Estimates are corrected
//! by this shift; half of it may remain as an error. Mesh and step are refined where this error exceeds both
//! [`MAX_ERROR_RATIO`] of a standard error and [`MAX_RELATIVE_ERROR`] of the value. They are also refined where
//! discretization errors are a visible part of the residuals; the step also where steps were halved. Output: the
//! refined experiments, with the optimum expected on them as the next start. It is `None` if scenes give mesh and step,
//! or these suffice. It is `None` also after [`ROUNDS`] refinements or at the limit of work [`MOST_WORK`] (steps times
//! edges of one simulation of all experiments).
//!
//! [`with_smooth_steps`] keeps meshes and steps of the scenes. Where the program chose the scheme, it replaces the
//! tolerance of the steps by the smaller default one, so that the residuals are smooth functions of the unknowns.
//! [`with_reported_resolution`] restores the meshes and steps of a stored report, for the same number of experiments. A
//! scene that does not allow its new mesh or step is an error.

use crate::accuracy::{Calculation, ErrorModel};
use crate::error::Error;
use crate::fit::measurement::experiment::{Experiment, full_work};
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::discretization::bias::{DiscretizationBias, REMAINING_FRACTION};
use crate::fit::unknown::Unknown;
use crate::scene::{Resolution, StepTolerance};

/// Largest discretization error that may remain after correction, as a fraction of the standard error. At a quarter it
/// widens a combined standard error by 3 %.
const MAX_ERROR_RATIO: f64 = 0.25;
/// Largest discretization error that may always remain, relative to the value. It limits the refinement for nearly
/// exact data.
const MAX_RELATIVE_ERROR: f64 = 1e-4;
/// Smallest number of edges of the initial mesh. Fewer are faster, but give an optimum farther from that of the fine
/// mesh.
const FIRST_EDGES: usize = 24;
/// Smallest number of edges of the initial mesh, over the number of the highest measured mode. More edges cost more in
/// every simulation of the search; fewer shift the frequencies more.
const FIRST_PER_MODE: usize = 6;
/// Initial number of time steps in the shortest recorded period, which is twice the rise time of a recording. More
/// steps cost more in every simulation of the search; fewer shift its optimum more.
const FIRST_STEPS: f64 = 60.0;
/// Largest number of refinements in a row; larger discretization errors are then reported.
const ROUNDS: usize = 4;
/// Largest factor of one refinement, on the number of edges and on that of steps. A larger one takes fewer rounds, but
/// relies on an extrapolation over a larger range.
const MOST_FINER: f64 = 4.0;
/// Smallest factor on edges or steps that is worth a refinement. Each refinement costs a further fit.
const LEAST_FINER: f64 = 1.01;
/// Smallest factor on the number of steps after a simulation that halved steps which did not converge. Such steps make
/// the misfit discontinuous.
const FINER_IF_HALVED: f64 = 2.0;
/// Largest work of one simulation of all experiments, as the sum of steps times edges. A larger limit permits slower
/// fits with smaller discretization errors.
const MOST_WORK: f64 = 4e6;

/// The experiments with the mesh and the step with which a search begins, where the scenes leave these open; others
/// unchanged. The mesh has at least the edges of a first guess for the measurements, [`FIRST_EDGES`], and
/// [`FIRST_PER_MODE`] times the highest measured mode. The step, s, is twice the shortest rise time of the recordings
/// over [`FIRST_STEPS`], at most one that resolves moving supports and signals. Without a
/// [rise time](Experiment::rise_time) it is the scene's own. An error if a scene does not allow them.
pub(crate) fn with_initial_resolution(
    experiments: Vec<Experiment>,
) -> Result<Vec<Experiment>, Error> {
    let initial = |experiment: Experiment| {
        let scene = experiment.problem.scene();
        if !scene.chosen().any() {
            return Ok(experiment);
        }
        let modes = FIRST_PER_MODE * experiment.highest_mode();
        // The mesh is chosen for the measurements: the scene's own may resolve a motion that was not recorded.
        let guess = scene.reopened().problem_for(Calculation::Guess)?.segments();
        let segments = guess.max(FIRST_EDGES).max(modes);
        let step = match experiment.rise_time() {
            Some(rise) => (2.0 * rise / FIRST_STEPS).min(scene.largest_good_step()),
            None => step_size(&experiment),
        };
        with_resolution(experiment, segments, step)
    };
    experiments.into_iter().map(initial).collect()
}

/// The experiments on the meshes and with the steps of their scenes. Where the program chose the scheme for a
/// simulation, the tolerance of its steps becomes the (smaller) default one, so that the residuals are smooth functions
/// of the unknowns. Errors are those of building a problem.
pub(crate) fn with_smooth_steps(experiments: Vec<Experiment>) -> Result<Vec<Experiment>, Error> {
    let smooth = |experiment: Experiment| {
        let mut scene = experiment.problem.scene().clone();
        let chosen = scene.chosen().scheme;
        let Some(time) = scene.time.as_mut().filter(|_| chosen) else { return Ok(experiment) };
        time.tolerance = StepTolerance::default();
        let other = experiment.problem.with_scene(scene)?;
        Ok(experiment.with_problem(other))
    };
    experiments.into_iter().map(smooth).collect()
}

/// The experiments with the edges and steps of a report's `resolutions`, one for each experiment in their order, where
/// their scenes leave these open. Experiments without a reported resolution are unchanged. An error if the numbers of
/// both lists differ, unless `resolutions` is empty: then all are unchanged.
pub(crate) fn with_reported_resolution(
    experiments: &[Experiment],
    resolutions: &[Option<Resolution>],
) -> Result<Vec<Experiment>, Error> {
    if resolutions.is_empty() {
        return Ok(experiments.to_vec());
    }
    if resolutions.len() != experiments.len() {
        let found = format!("the meshes of {} experiments", resolutions.len());
        let allowed = format!("a report of this fit, with {}", experiments.len());
        return Err(Error::invalid("report", found, allowed));
    }
    let on_mesh = |(own, reported): (&Experiment, &Option<Resolution>)| match reported {
        Some(Resolution { segments, step, .. }) => {
            with_resolution(own.clone(), *segments, step.unwrap_or(step_size(own)))
        }
        None => Ok(own.clone()),
    };
    experiments.iter().zip(resolutions).map(on_mesh).collect()
}

/// The time step of an experiment's scene, s; 1 without one.
fn step_size(experiment: &Experiment) -> f64 {
    experiment.problem.scene().time.as_ref().map_or(1.0, |time| time.step_size())
}

/// The experiment with at least this number of edges (`segments`) and this `step`, s, where its scene leaves them open
/// or the program chose them. With the step, a scheme that is open or that the program chose becomes generalised-alpha
/// with the default tolerance. The markers of a recording that prescribes the ends are at nodes: the number of edges is
/// rounded up to a multiple of the spans between markers. Errors: a recording that is not read, and those of building
/// the problem.
fn with_resolution(
    experiment: Experiment,
    segments: usize,
    step: f64,
) -> Result<Experiment, Error> {
    let problem = &experiment.problem;
    let spans = match &problem.scene().supports.path {
        Some(path) => path.track()?.markers().len().max(2) - 1,
        None => 1,
    };
    let segments = segments.div_ceil(spans) * spans;
    let other = problem.with_scene(problem.scene().resolved(segments, step))?;
    Ok(experiment.with_problem(other))
}

/// Experiments with a refined mesh and step, and the optimum expected on them.
pub(crate) struct RefinedStart {
    pub experiments: Vec<Experiment>,
    /// The unknowns on their scales.
    pub x: Vec<f64>,
}

/// The experiments with finer meshes and steps, as the accuracy of the optimum requires, and the optimum expected on
/// them by second-order extrapolation. `bias` is the shift of the unknowns by mesh and step (`None`: no shift). `None`
/// if the scenes give all meshes and steps, or if these suffice (factors below [`LEAST_FINER`]) or are at the limit of
/// work. Also `None` if `round`, the number of refinements so far, is [`ROUNDS`]. The factors on edges and steps are
/// the largest that any determined unknown, combination of unknowns or visible discretization error of the residuals
/// requires. Halved steps require [`FINER_IF_HALVED`] for the steps. A factor is at most [`MOST_FINER`], and both
/// together stay within [`MOST_WORK`]. The expected optimum is within the bounds.
pub(crate) fn refined_start(
    experiments: &[Experiment],
    Fitted { search, optimum }: Fitted,
    local: &LocalAnalysis,
    bias: Option<&DiscretizationBias>,
    round: usize,
) -> Result<Option<RefinedStart>, Error> {
    // Only meshes and steps that the scenes leave open are refined, a limited number of times.
    let open = experiments.iter().any(|e| e.problem.scene().chosen().any());
    if !open || round >= ROUNDS {
        return Ok(None);
    }
    // The factors on edges and steps are the largest that any unknown or combination of unknowns requires.
    let [mut mesh, mut step] = [1.0_f64; 2];
    let segments = experiments.iter().map(|e| e.problem.segments()).max().unwrap_or(0);
    let mut require = |errors: [f64; 2], deviation: f64, exact: f64| {
        let allowed = (MAX_ERROR_RATIO * deviation).max(exact) / REMAINING_FRACTION;
        let finer = ErrorModel::of_second_order(errors).finer_for(allowed, segments);
        (mesh, step) = (mesh.max(finer.mesh), step.max(finer.step));
    };
    // Corrections for edges and for steps of a value.
    let corrections = |i: usize| bias.map_or([0.0; 2], |bias| bias.corrections(i));
    for (i, unknown) in search.unknowns.iter().enumerate() {
        let Some(deviation) = local.covariance.deviation[i] else { continue };
        let exact = MAX_RELATIVE_ERROR * value_scale(unknown, optimum.x[i], search);
        require(corrections(i), deviation, exact);
    }
    for combination in &local.covariance.combinations {
        let errors = bias.map_or([0.0; 2], |bias| bias.corrections_along(&combination.exponents));
        // Combinations are logarithms of products: their error is relative to the value already.
        require(errors, combination.deviation, MAX_RELATIVE_ERROR);
    }
    if let Some(bias) = bias {
        let [by_mesh, by_step] = bias.refinement();
        (mesh, step) = (mesh.max(by_mesh), step.max(by_step));
    }
    if optimum.halved {
        step = step.max(FINER_IF_HALVED);
    }
    // The work grows with the product of both factors.
    let work = full_work(search.experiments)?;
    let most = MOST_FINER.min((MOST_WORK / work).sqrt().max(1.0));
    let [mesh, step] = [mesh, step].map(|factor| factor.min(most));
    if mesh.max(step) < LEAST_FINER {
        return Ok(None);
    }
    let finer = |e: &Experiment| {
        let segments = (e.problem.segments() as f64 * mesh).ceil() as usize;
        match e.problem.scene().chosen().any() {
            true => with_resolution(e.clone(), segments, step_size(e) / step),
            false => Ok(e.clone()),
        }
    };
    let experiments = experiments.iter().map(finer).collect::<Result<_, _>>()?;
    // Errors of second order: a refinement by a factor f leaves 1/f^2 of the shift.
    let expected = optimum.x.iter().enumerate().zip(search.unknowns).map(|((i, x), unknown)| {
        let [low, high] = unknown.scaled_bounds();
        let [by_mesh, by_step] = corrections(i);
        let shift = by_mesh * (1.0 - mesh.powi(-2)) + by_step * (1.0 - step.powi(-2));
        (x + shift).clamp(low, high)
    });
    Ok(Some(RefinedStart { experiments, x: expected.collect() }))
}

/// The scale of the relative error of an unknown at `x`, on the scale of the fit: 1 for a positive parameter, whose
/// scale is logarithmic. For others it is the larger of `|x|` and the typical size of the parameter in its first
/// experiment (1 without one).
fn value_scale(unknown: &Unknown, x: f64, search: &Search) -> f64 {
    if unknown.parameter.is_positive() {
        return 1.0;
    }
    let own = search.experiments.iter().find(|e| unknown.is_of(e));
    x.abs().max(own.map_or(1.0, |e| unknown.typical_size(e)))
}

//! Distance of the estimates to the limit of zero element and step size, from runs on another mesh and with another
//! step.
//!
//! Input: an optimum with its local analysis, and the options of the fit. A run on another mesh, and one with another
//! step, change one of the two alone, so that their errors never cancel. The change of the residuals, and that of the
//! unknowns (linear response, or a refit on request), is extrapolated to zero size (Richardson). The order is that of
//! the method for structures and for a mesh or step that the program [chose](crate::fit::resolution), and the first for
//! those that the scene of a rod gives. Of a method of second order, the first order yields 2.5 to 3 times the error
//! from coarser sizes, and 1.5 to 1.8 times from finer ones. Sizes are coarser by the first of [`COARSER`], or
//! [`COARSER_CHOSEN`] for chosen ones, that resolves the motion. Where none does, or the run fails, and for refits and
//! explicit steps, they are finer by [`FINER`]. The mesh of a rod with recorded ends is twice as fine instead.
//!
//! [`estimate_bias`] returns one [`DiscretizationBias`]: the limit less the optimum for all unknowns, on their scales,
//! by mesh and by step, and the discretization errors of the residuals by each over the residuals. The estimates are
//! corrected later, where the program chose mesh or step for all experiments. The result is none without convergence,
//! if the bias is not requested and the program chose neither, for residuals of rounding errors, and with a warning
//! where a run fails; a stop is an error. Experiments without a motion, or with beta (numerical damping) as an unknown,
//! have no bias by the step.

use crate::accuracy::{Extrapolation, smooth_mesh_order, step_order};
use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::analysis::{Analysis, Refinement};
use crate::fit::uncertainty::covariance::gauss_newton::LinearResponse;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::discretization::bias::{BiasPart, DiscretizationBias};
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::fit::unknown::Unknown;
use crate::scene::{Parameter, Scene};

/// Ratios of coarser to own element or step sizes, in the order of the trials, where the scene gives the mesh or the
/// step. The runs for mesh and step together cost one simulation at twice the sizes, and 1.3 at 1.5 times. With the
/// same coverage finer sizes cost 2.5 by a quarter and 4 by half
/// (`cargo run --release --example discretization_error -- 400`).
const COARSER: [f64; 2] = [2.0, 1.5];
/// The same where the program chose the mesh or the step: changes are extrapolated with the order of the method.
const COARSER_CHOSEN: [f64; 1] = [1.5];
/// Ratio of own to finer element or step sizes, where no coarser ones resolve the motion.
const FINER: f64 = 1.25;
/// Fewest edges of a coarser model. Below it, a mesh is refined instead of coarsened.
const FEWEST_EDGES: f64 = 16.0;
/// Fewest edges of a coarser model for each mode up to the highest measured one.
const FEWEST_PER_MODE: f64 = 4.0;
/// Fewest steps in the first period of a coarser model, where the scene gives the step. Below it, a step is refined
/// instead.
const FEWEST_STEPS: f64 = 100.0;
/// The same where the program chose the step.
const FEWEST_CHOSEN_STEPS: f64 = 40.0;

/// Order of the errors of a structure in the element size.
const STRUCTURE_ORDER: f64 = 2.0;

/// An experiment with another mesh or step, and its extrapolation.
struct OtherNumerics {
    /// The experiment on the other mesh, or with the other step.
    experiment: Experiment,
    /// Limit of zero size less the result of the original experiment, over the result of this one less that of the
    /// original.
    error_ratio: f64,
}

/// Creates other numerics of an experiment: coarser ones if the argument allows these and they resolve the motion, else
/// finer ones. None where the experiment does not depend on mesh or step, or cannot be compared.
type Variation = fn(&Search, &Experiment, bool) -> Result<Option<OtherNumerics>, Error>;

/// Limit of zero element or step size less the optimum.
struct LimitDifference {
    /// Difference of each unknown on its scale; none if it does not respond to changes of the residuals.
    shifts: Vec<Option<f64>>,
    /// Norm of the difference of the residuals, in units of sigma and with growth weights, after the response of the
    /// unknowns.
    residual_norm: f64,
    /// Work of the runs, steps times segments.
    work: f64,
}

/// Ratios of coarser element or step sizes, in the order of the trials: [`COARSER_CHOSEN`] if the program chose the
/// mesh or the step in question (`is_chosen`), [`COARSER`] if the scene gives it.
fn coarser_ratios(is_chosen: bool) -> &'static [f64] {
    if is_chosen { &COARSER_CHOSEN } else { &COARSER }
}

/// The experiment on another mesh, with the factor of the extrapolation; never none. With recorded ends
/// (`supports.path`) it has twice as many edges, so that markers stay at nodes. Otherwise, if `coarser`, it has fewer
/// edges by the first of [`coarser_ratios`] that leaves [`FEWEST_EDGES`], and [`FEWEST_PER_MODE`] for each mode up to
/// the highest measured one. If none does, or not `coarser`, it has more by [`FINER`]. The extrapolation is of the
/// order of the method for a chosen mesh, of second order for a structure, and of first order for a given mesh of a
/// rod. Error: a scene that does not allow the mesh.
fn on_other_mesh(
    _: &Search,
    experiment: &Experiment,
    coarser: bool,
) -> Result<Option<OtherNumerics>, Error> {
    let problem = &experiment.problem;
    let (own, scene) = (problem.segments() as f64, problem.scene());
    // A coarser model must still resolve the measured modes.
    let needed = FEWEST_EDGES.max(FEWEST_PER_MODE * experiment.highest_mode() as f64);
    let is_chosen = scene.chosen().segments;
    let mut fewer = coarser_ratios(is_chosen).iter().map(|ratio| (own / ratio).round());
    let segments = match fewer.find(|fewer| coarser && *fewer >= needed) {
        // Markers along a rod are at its nodes: the next mesh has a node between any two.
        _ if scene.supports.path.is_some() || has_recording(scene) => 2.0 * own,
        Some(fewer) => fewer,
        None => (own * FINER).round(),
    };
    let other = problem.with_scene(problem.remeshed(segments as usize))?;
    // A structure has no chosen mesh; its errors are of second order.
    let order = match (is_chosen, &scene.structure) {
        (true, _) => smooth_mesh_order(scene),
        (false, Some(_)) => STRUCTURE_ORDER,
        (false, None) => 1.0,
    };
    let error_ratio = Extrapolation { ratio: segments / own, order }.error_before();
    Ok(Some(OtherNumerics { experiment: experiment.with_problem(other), error_ratio }))
}

/// Whether ends of the structure of a `scene` follow a recording, whose markers must be at nodes.
fn has_recording(scene: &Scene) -> bool {
    scene.structure.as_ref().is_some_and(|structure| structure.recording.is_some())
}

/// The experiment with another step, and the factor of the extrapolation. If `coarser` and the scheme is implicit, the
/// step is larger by the first of [`coarser_ratios`] that resolves the motion. Twice the shortest rise time of the
/// records must have at least [`FEWEST_STEPS`] steps (chosen steps: [`FEWEST_CHOSEN_STEPS`]), and the step must not
/// exceed `largest_good_step` of the scene, for moved supports. Otherwise the step is smaller by [`FINER`]. The
/// extrapolation is of the order of the scheme for a chosen step and for structures, and of first order for a given
/// step of a rod. None without a motion, or where beta is identified: its damping depends on the step. Error: a scene
/// that does not allow the step.
fn with_other_step(
    search: &Search,
    experiment: &Experiment,
    coarser: bool,
) -> Result<Option<OtherNumerics>, Error> {
    let is_beta = |u: &Unknown| u.parameter == Parameter::Beta && u.is_of(experiment);
    if search.unknowns.iter().any(is_beta) || !experiment.moves() {
        return Ok(None);
    }
    let mut scene = experiment.problem.scene().clone();
    let period = experiment.rise_time().map_or(f64::INFINITY, |rise| 2.0 * rise);
    let is_chosen = scene.chosen().step;
    let fewest = if is_chosen { FEWEST_CHOSEN_STEPS } else { FEWEST_STEPS };
    // A larger step must still resolve the first oscillation and the motion of the supports.
    let largest = (period / fewest).min(scene.largest_good_step());
    let (mut ratio, mut order) = (FINER, 1.0);
    if let Some(time) = &mut scene.time {
        let is_explicit = time.scheme.traits().stability_limit.is_some();
        // An explicit scheme may be at its stability limit: its step does not grow.
        let mut larger = coarser_ratios(is_chosen).iter().filter(|_| coarser && !is_explicit);
        if let Some(larger) = larger.find(|larger| *larger * time.step_size() <= largest) {
            ratio = larger.recip();
        }
        if is_chosen || scene.structure.is_some() {
            order = step_order(time);
        }
        time.step = time.step.map(|step| step / ratio);
    }
    let other = experiment.problem.with_scene(scene)?;
    let error_ratio = Extrapolation { ratio, order }.error_before();
    Ok(Some(OtherNumerics { experiment: experiment.with_problem(other), error_ratio }))
}

/// Euclidean norm of `residuals`, each times its growth weight in the search. The weight is below 1 where the
/// derivatives by the parameters grow exponentially, as in chaotic motions.
fn weighted_norm(search: &Search, residuals: &[f64]) -> f64 {
    let weighted = residuals.iter().enumerate().map(|(k, r)| r * search.growth_weight(k));
    weighted.map(|x| x * x).sum::<f64>().sqrt()
}

/// Estimates the limit of zero element or step size less the optimum. `variation` creates another mesh or step of each
/// experiment, coarser if `coarser`; experiments without any stay. One run of all at the optimum yields the change of
/// the residuals. It is multiplied by the `error_ratio` of its experiment (0 for priors and unchanged experiments), and
/// the linear response to it yields the change of the unknowns. If the `method` is [`Refinement::Refitted`], a refit
/// yields both changes, multiplied by the largest ratio. None where no experiment has another mesh or step. Error: a
/// simulation or the refit fails.
fn limit_difference(
    Fitted { search, optimum }: Fitted,
    local: &LocalAnalysis,
    method: Refinement,
    variation: Variation,
    coarser: bool,
) -> Result<Option<LimitDifference>, Error> {
    let others = search.experiments.iter().map(|e| variation(search, e, coarser));
    let others = others.collect::<Result<Vec<_>, Error>>()?;
    if others.iter().all(Option::is_none) {
        return Ok(None);
    }
    let or_same = |(other, own): (Option<OtherNumerics>, &Experiment)| {
        other.map_or_else(|| (own.clone(), 0.0), |other| (other.experiment, other.error_ratio))
    };
    let (experiments, ratios): (Vec<Experiment>, Vec<f64>) =
        others.into_iter().zip(search.experiments).map(or_same).unzip();
    let other = Search { experiments: &experiments, ..search.detached() };
    // A refit includes nonlinear responses; the linear response costs one simulation.
    let LinearResponse { unknowns: shifts, residuals } = match method {
        Refinement::Refitted => {
            let refitted = other.polish(&optimum.x)?;
            let largest = ratios.iter().copied().fold(0.0, f64::max);
            // One ratio for all experiments, as they share the fit: the largest is on the safe side.
            let difference = |a: &[f64], b: &[f64]| -> Vec<f64> {
                a.iter().zip(b).map(|(a, b)| largest * (a - b)).collect()
            };
            let shifts = difference(&refitted.x, &optimum.x).into_iter();
            let shifts = shifts.zip(&local.covariance.deviation).map(|(d, sd)| sd.map(|_| d));
            let residuals = difference(&refitted.residuals, &optimum.residuals);
            LinearResponse { unknowns: shifts.collect(), residuals }
        }
        _ => {
            let residuals = other.all_residuals()?.plain_residuals(&optimum.x)?;
            // Every residual is extrapolated by the ratio of its experiment; priors do not change.
            let mut counts = optimum.counts.iter();
            let mut factors = Vec::with_capacity(residuals.len());
            for (experiment, ratio) in experiments.iter().zip(&ratios) {
                let own = counts.by_ref().take(experiment.measurements.len()).sum();
                factors.extend(std::iter::repeat_n(*ratio, own));
            }
            factors.resize(residuals.len(), 0.0);
            let pairs = residuals.iter().zip(&optimum.residuals).zip(&factors);
            let change: Vec<f64> = pairs.map(|((a, b), factor)| factor * (a - b)).collect();
            local.covariance.response(&change, &local.noise.weights, &optimum.jacobian)
        }
    };
    let residual_norm = weighted_norm(&other, &residuals);
    Ok(Some(LimitDifference { shifts, residual_norm, work: other.work.total() }))
}

/// Bias of an optimum by mesh and step. None where `analysis` does not request it and the program chose neither mesh
/// nor step, and without convergence. None also where the residuals are rounding errors, unless there are as many
/// values as unknowns. A run that fails adds a warning, and the result is none. Error: the fit is stopped.
pub(crate) fn estimate_bias(
    fitted: Fitted,
    local: &LocalAnalysis,
    analysis: &Analysis,
    warnings: &mut Warnings,
) -> Result<Option<DiscretizationBias>, Error> {
    let Fitted { search, optimum } = fitted;
    // Rounding errors do not depend on the mesh. With as many values as unknowns the residuals of any fit are rounding
    // errors.
    if optimum.residuals.len() != search.unknowns.len() && search.is_rounding(optimum) {
        return Ok(None);
    }
    match bias(fitted, local, analysis.discretization_error) {
        Err(Error::Interrupted) => Err(Error::Interrupted),
        Err(error) => {
            let text = format!(
                "the discretization error is unknown: a run on another mesh failed ({error}). The \
                         intervals do not include it. Leave rod.segments and time.step out of the scene"
            );
            warnings.add(Severity::Numerics, Code::NumericsUnknown, text);
            Ok(None)
        }
        bias => bias,
    }
}

/// Bias of an optimum by mesh and step, each changed alone, in parallel. They are coarser, or finer if that run fails;
/// refits always use finer ones. `residual_fraction` of each part is the ratio of the norms, with growth weights, of
/// its discretization errors of the residuals and of the residuals. A part counts as chosen if the program chose it for
/// all experiments; the step of one without a motion does not matter. With the `method` [`Refinement::None`] the bias
/// is computed, linearly, only if the program chose a mesh or step of any experiment; otherwise the result is none. It
/// is none too without convergence. The work is added to that of the search. Error: a run fails, or the fit is stopped.
fn bias(
    fitted: Fitted,
    local: &LocalAnalysis,
    method: Refinement,
) -> Result<Option<DiscretizationBias>, Error> {
    let Fitted { search, optimum } = fitted;
    let experiments = || search.experiments.iter();
    let is_any_chosen = experiments().any(|e| e.problem.scene().chosen().any());
    if !optimum.converged || method == Refinement::None && !is_any_chosen {
        return Ok(None);
    }
    // Chosen numerics need their correction even if no error is requested.
    let method = if method == Refinement::None { Refinement::Linearized } else { method };
    let part = |variation: Variation| {
        let difference = |coarser| limit_difference(fitted, local, method, variation, coarser);
        // A fit of a coarser model may end in another minimum.
        let is_linearized = method == Refinement::Linearized;
        match difference(is_linearized) {
            Err(Error::Interrupted) => Err(Error::Interrupted),
            Err(_) if is_linearized => difference(false),
            found => found,
        }
    };
    // Mesh and step are changed alone, so that their errors cannot cancel.
    let (mesh, step) = rayon::join(|| part(on_other_mesh), || part(with_other_step));
    let norm = weighted_norm(search, &optimum.residuals);
    let part = |difference: Option<LimitDifference>, is_chosen: bool| {
        let Some(difference) = difference else {
            return BiasPart { is_chosen, ..BiasPart::default() };
        };
        search.work.add(difference.work);
        let LimitDifference { shifts, residual_norm, .. } = difference;
        BiasPart { shifts, is_chosen, residual_fraction: residual_norm / norm }
    };
    let mesh_chosen = experiments().all(|e| e.problem.scene().chosen().segments);
    let step_chosen = experiments().all(|e| !e.moves() || e.problem.scene().chosen().step);
    let bias =
        DiscretizationBias { mesh: part(mesh?, mesh_chosen), step: part(step?, step_chosen) };
    search.report("discretization error");
    Ok(Some(bias))
}

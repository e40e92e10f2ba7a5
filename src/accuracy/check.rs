//! Check of a chosen run by the last trial run, with repetition where its error is too large.
//!
//! Positions of both runs are compared at seven to nine points, at the first step after each of the times of `samples`,
//! of which there are at most about 180. Where they differ by more than the estimated change of the errors, these were
//! underestimated, and are enlarged until they explain the difference. A run with less than [`LEAST_GROWTH`] times the
//! work of the trial run enlarges no error. The run is accepted if its error is at most the requested one, or
//! [`CORRECTED_PART`] of it after an enlargement. Otherwise it is repeated with finer numerics. A run whose simulation
//! fails is repeated with [`AFTER_FAILURE`] times the steps, unless invalid input, a file or a stop ended it; a failed
//! run of `rodas4` is repeated with generalised-alpha if the program chose the scheme, and its error is then unknown.
//! There are at most [`MAX_REPETITIONS`] repetitions, within limits of work, and none where the scene gives the step;
//! then the run is kept unchanged. Output: the last run that reached the end, and its estimated error over the length,
//! `None` for a failed run or without estimates. A repetition that fails thus gives the run before it.
//! [`Scene::simulate`] does this for a scene, [`run_checked`] for any kind of run, and [`simulate_checked`] for a run
//! that is recorded as a trajectory.
//!
//! `RunCheck` is made from the last trial run (`Basis`). `RunCheck::monitor` returns a `RunMonitor`, whose `push`
//! compares each state of the run with the trial run. `RunCheck::assess` takes the outcome of the run and the monitor,
//! and returns the decision (`RunAssessment`): accepted with its error, or to be repeated with other numerics.

use crate::accuracy::basis::Basis;
use crate::accuracy::calculation::{RUN_TOLERANCE, set_newton_tolerance};
use crate::accuracy::refinement::{ErrorModel, RefinementFactors};
use crate::accuracy::trial::{Numerics, PARTS, RunCost, comparison_points, largest_stable_step};
use crate::dynamics::record::Record;
use crate::dynamics::{Snapshot, Trajectory};
use crate::error::Error;
use crate::problem::Problem;
use crate::scene::resolution::Bound;
use crate::scene::{Scene, Scheme, Stencil};
use std::sync::Arc;

/// Largest number of repetitions of the chosen run.
const MAX_REPETITIONS: usize = 3;
/// Error for which a repeated run is chosen over the requested one: its estimate was corrected by a run.
const REPEATED_TARGET: f64 = 0.8;
/// Largest growth of the work from a run to the repeated one.
const REPEATED_GROWTH: f64 = 10.0;
/// Growth of the work from the last trial run below which both runs are too similar to check one by the other.
const LEAST_GROWTH: f64 = 1.3;
/// Smallest expected change of the chosen run over the error of the trial run: errors of mesh and step may cancel.
const LEAST_CHANGE: f64 = 0.3;
/// Refinement of the step after a run that failed. A larger one is safer and costs more.
const AFTER_FAILURE: f64 = 3.0;
/// Largest accepted error over the requested one, where the estimate was corrected: a reserve for its uncertainty.
const CORRECTED_PART: f64 = 0.9;
/// Largest factor of a correction: the upper end of its bisection.
const MAX_UNDERESTIMATION: f64 = 1e3;
/// Lowest order of convergence that a correction assumes for motions of many modes.
const LOWEST_ORDER: f64 = 0.25;
/// Bisections for the factor of a correction: its logarithm is found to more than ten digits.
const BISECTIONS: usize = 40;
/// Relative error of the time of a step, as a sum of steps, at which a time of comparison counts as reached.
const TIME_ROUNDING: f64 = 1e-9;

/// The check of a run with numerics that the program chose.
#[derive(Clone)]
pub struct RunCheck {
    /// The scene as given, whose open numerics are chosen again for a repetition.
    scene: Scene,
    /// The last trial run and its estimated errors.
    basis: Basis,
    /// Whether the run may be repeated with smaller steps.
    can_repeat: bool,
    /// Refinement of the run over the numerics of the basis.
    finer: RefinementFactors,
    /// Numerics of the run that is checked.
    numerics: Numerics,
    /// Number of repetitions so far.
    attempts: usize,
    /// Estimated error over the length of the last run that reached the end, if one did and is repeated.
    completed: Option<f64>,
    /// Work of the trial runs and of the runs that were repeated, edges times Newton iterations.
    work: f64,
}

/// The largest difference between a run and the last trial run, updated during the run.
pub struct RunMonitor {
    /// Of the compared points on the mesh of the run and on that of the trial run.
    stencils: Vec<[Stencil; 2]>,
    /// The recorded motion of the trial run.
    trial: Arc<Record>,
    /// One over the length of the rod, 1/m.
    over: f64,
    /// Times of comparison, s, ascending.
    times: Arc<[f64]>,
    /// Number of these times that the run has reached.
    reached: usize,
    /// Largest distance of a compared point in both runs so far, over the length.
    difference: f64,
    cost: RunCost,
    /// Work so far, edges times Newton iterations.
    work: f64,
}

/// The result of the check of a run.
pub enum RunAssessment {
    /// The run is kept; its estimated error over the length, where there is one.
    Accepted(Option<f64>),
    /// The run is to be repeated: the problem with finer numerics, and its check.
    Repeat(Box<(Problem, RunCheck)>),
}

impl RunCheck {
    /// The check of a run of `scene` whose numerics are refined from the trial run in `basis`. `can_repeat`: whether a
    /// run that fails the check may be repeated with smaller steps. `work`: the work of the search for these numerics,
    /// edges times Newton iterations.
    pub(super) fn new(scene: &Scene, basis: Basis, can_repeat: bool, work: f64) -> Self {
        // The search chose the run by the same functions, so that its numerics follow from the basis.
        let finer = basis.refinement();
        let numerics = basis.refined(finer, scene);
        Self {
            scene: scene.clone(),
            basis,
            can_repeat,
            finer,
            numerics,
            attempts: 0,
            completed: None,
            work,
        }
    }

    /// A monitor of a run of this problem, which compares it with the last trial run; nothing is compared yet.
    ///
    /// # Errors
    /// None for the problem that the check was made for; for another one, points that it does not have.
    pub fn monitor(&self, problem: &Problem) -> Result<RunMonitor, Error> {
        let points = comparison_points(problem, PARTS);
        // The points are the same on both meshes, with different nodes around them.
        let own = points.iter().map(|point| problem.stencil(*point));
        let of_trial = self.basis.trial.stencils.iter();
        let pair = |(own, other): (Result<Stencil, Error>, &Stencil)| Ok([own?, other.clone()]);
        Ok(RunMonitor {
            stencils: own.zip(of_trial).map(pair).collect::<Result<_, Error>>()?,
            trial: self.basis.trial.record.clone(),
            over: problem.length().recip(),
            times: self.basis.trial.times.clone(),
            reached: 0,
            difference: 0.0,
            cost: RunCost::of(problem),
            work: 0.0,
        })
    }

    /// Assesses a run from its `outcome` and its largest difference from the last trial run. A completed run is
    /// accepted with its estimated error over the length if that is at most the requested one. If the difference
    /// enlarged the estimate, the limit is `CORRECTED_PART` of the requested one. Otherwise it is to be repeated with
    /// finer numerics, and a failed run with `AFTER_FAILURE` times the steps. Without `can_repeat`, after
    /// `MAX_REPETITIONS`, or where no finer run is affordable, the run is accepted unchanged. So are failures of
    /// repetitions of a completed run, and errors of the input, of files or of a stop. The accepted estimate is `None`
    /// for a failed run, and where the trial runs have no estimated errors.
    ///
    /// # Errors
    /// Those of building another problem.
    pub fn assess(
        mut self,
        outcome: &Result<(), Error>,
        monitor: &RunMonitor,
    ) -> Result<RunAssessment, Error> {
        let can_refine = self.can_repeat && self.attempts < MAX_REPETITIONS;
        self.work += monitor.work;
        // Errors of the input or of the user are no question of numerics.
        match outcome {
            Ok(()) => {}
            Err(error)
                if can_refine && self.completed.is_none() && is_failure_of_numerics(error) =>
            {
                return self.repeat_failed();
            }
            Err(_) => return Ok(RunAssessment::Accepted(None)),
        }
        if !self.basis.is_known {
            return Ok(RunAssessment::Accepted(None));
        }
        // Error expected from the trial runs against the one that the difference shows.
        let expected = self.basis.errors.after(self.finer);
        let errors = self.corrected(monitor.difference);
        let error = errors.after(self.finer);
        // A corrected estimate is less certain, so that a part of the request remains in reserve.
        let is_corrected = error > expected;
        let allowed = if is_corrected { CORRECTED_PART } else { 1.0 } * self.basis.requested;
        if error <= allowed || !can_refine {
            return Ok(RunAssessment::Accepted(Some(error)));
        }
        match self.repeat_refinement(errors, expected) {
            Some(finer) => {
                self.completed = Some(error);
                self.repeat_with(finer, Some(errors))
            }
            None => Ok(RunAssessment::Accepted(Some(error))),
        }
    }

    /// The request of a repetition of a failed run, with [`AFTER_FAILURE`] times the steps. A run of `rodas4` is
    /// repeated with generalised-alpha where the program chose the scheme; its error is then unknown. Error: the
    /// problem cannot be built.
    fn repeat_failed(mut self) -> Result<RunAssessment, Error> {
        let scheme = &mut self.basis.trial.numerics.scheme;
        if *scheme == Scheme::Rodas4 && self.scene.left_open().scheme {
            // The error of the step was estimated for the other scheme.
            (*scheme, self.basis.is_known) = (Scheme::GeneralisedAlpha, false);
        }
        // A failed run has no difference that could correct the errors: only its step is refined.
        let finer = RefinementFactors { step: AFTER_FAILURE * self.finer.step, ..self.finer };
        let errors = self.basis.is_known.then_some(self.basis.errors);
        self.repeat_with(finer, errors)
    }

    /// The refinement of the trial run for a repetition after the `errors` were corrected: that with the least work for
    /// [`REPEATED_TARGET`] of the requested error. If that is not affordable, and the error `expected` before the run
    /// was low enough, the most accurate one within [`REPEATED_GROWTH`] times the work of this run. `None` if neither
    /// is affordable.
    fn repeat_refinement(&self, errors: ErrorModel, expected: f64) -> Option<RefinementFactors> {
        let free = self.basis.free;
        let segments = self.basis.trial.numerics.segments as f64;
        let target = REPEATED_TARGET * self.basis.requested;
        // The cheapest that reaches the request; else the best for the allowed work.
        let cheapest = errors.cheapest(target, segments, free).map(|(finer, _)| finer);
        // If not even the first choice was expected to reach the request, a partial improvement is not worth a run.
        let was_promised = expected <= self.basis.requested;
        let most = REPEATED_GROWTH * self.basis.growth(self.numerics);
        let partly = was_promised.then(|| errors.best_within(most, segments, free));
        [cheapest, partly].into_iter().flatten().find(|finer| self.is_affordable(*finer))
    }

    /// Whether a run with the trial run's numerics refined by `finer` is affordable. It takes more work than this run,
    /// at most [`LEAST_GROWTH`] times [`REPEATED_GROWTH`] of it, and at most the largest work of a chosen run.
    fn is_affordable(&self, finer: RefinementFactors) -> bool {
        let numerics = self.basis.refined(finer, &self.scene);
        let [next, this] = [numerics, self.numerics].map(|numerics| self.basis.growth(numerics));
        self.basis.is_affordable(numerics)
            && next > this
            && next <= LEAST_GROWTH * REPEATED_GROWTH * this
    }

    /// The errors of the trial run, both enlarged by the smallest common factor that explains the `difference` of both
    /// runs, over the length. With `e` the sum of mesh and step errors, errors explain a difference up to `|e_trial -
    /// e_run|`, or up to [`LEAST_CHANGE`] times `e_trial` if that is larger. The factor is found by bisection from 1 to
    /// [`MAX_UNDERESTIMATION`]. For motions of many modes it also lowers the orders, to [`LOWEST_ORDER`] at least. The
    /// errors stay if they explain the difference, are zero, or the run has less than [`LEAST_GROWTH`] times the work
    /// of the trial run.
    fn corrected(&self, difference: f64) -> ErrorModel {
        let errors = self.basis.errors;
        let change = |errors: ErrorModel| {
            let trial = errors.mesh + errors.step;
            (trial - errors.after(self.finer)).abs().max(LEAST_CHANGE * trial)
        };
        // The modes that a finer run adds lower the order; errors of a few modes do not always have the same sign.
        let lowest = if self.basis.has_many_modes { LOWEST_ORDER } else { f64::INFINITY };
        let is_alike = self.basis.growth(self.numerics) < LEAST_GROWTH;
        if is_alike || change(errors) >= difference || errors.mesh + errors.step == 0.0 {
            return errors;
        }
        // The factor by which the errors were underestimated, by bisection of its logarithm.
        let [mut low, mut high] = [1.0, MAX_UNDERESTIMATION];
        for _ in 0..BISECTIONS {
            let middle = (low * high).sqrt();
            match change(errors.underestimated(middle, lowest)) < difference {
                true => low = middle,
                false => high = middle,
            }
        }
        errors.underestimated(high, lowest)
    }

    /// The request of a repetition: the problem with the trial run's numerics refined by `finer`, and its check with
    /// one more attempt counted. The problem's expected error is that of the trial run's `errors` after the refinement;
    /// none without them. Error: the problem cannot be built.
    fn repeat_with(
        mut self,
        finer: RefinementFactors,
        errors: Option<ErrorModel>,
    ) -> Result<RunAssessment, Error> {
        self.finer = finer;
        self.attempts += 1;
        let numerics = self.basis.refined(finer, &self.scene);
        self.numerics = numerics;
        let error = errors.map(|errors| errors.after(finer));
        let problem = problem_with_numerics(&self.scene, numerics, error, self.work)?;
        Ok(RunAssessment::Repeat(Box::new((problem, self))))
    }
}

/// The problem of a scene with these numerics where it leaves them out, its estimated `error` over the length, the
/// `work` of the search, and the Newton tolerance of chosen runs. Without a known error within the request it has the
/// limit of work as the reason. The step is reduced to a stable one of an explicit scheme, and to one that resolves the
/// motions of supports and the signals well. Error: the scene cannot be built with them.
fn problem_with_numerics(
    scene: &Scene,
    numerics: Numerics,
    error: Option<f64>,
    work: f64,
) -> Result<Problem, Error> {
    let end = scene.time.as_ref().map_or(0.0, |time| time.end);
    // A step is limited by the samples of recorded supports and by the stability of explicit
    // schemes.
    let mut step = (end / numerics.steps as f64).min(scene.largest_good_step());
    let posed = scene.resolved(numerics.segments, step).by(numerics.scheme).build()?;
    if let Some(largest) = largest_stable_step(&posed)? {
        step = step.min(largest);
    }
    let mut scene = scene.resolved(numerics.segments, step).by(numerics.scheme);
    if let Some(resolution) = &mut scene.resolution {
        (resolution.error, resolution.work) = (error, work);
        let is_within = error.is_some_and(|error| error <= resolution.accuracy);
        resolution.bound = (!is_within).then_some(Bound::Work);
    }
    set_newton_tolerance(&mut scene, RUN_TOLERANCE);
    scene.build()
}

/// Whether a run failed for its numerics: not by invalid input, a file or a stop.
fn is_failure_of_numerics(error: &Error) -> bool {
    !matches!(error, Error::Invalid { .. } | Error::Io { .. } | Error::Interrupted)
}

impl Scene {
    /// Simulates the scene with the numerics that it gives, or that are chosen and checked by the run. If the step is
    /// left out, the run is repeated with finer ones, within limits of work, where it fails or where its estimated
    /// error turns out to be above the requested one. All nodes are recorded at every step.
    ///
    /// ```
    /// use rodfit::{Point, Scene};
    /// let (problem, run) = Scene::load("data/cantilever.toml")?.simulate()?;
    /// let (place, _) = run.at(Point::Tip, problem.time()?.end)?;
    /// assert!(place[1] < 0.0);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`problem`](Self::problem) and of [`Trajectory::run`].
    pub fn simulate(&self) -> Result<(Problem, Trajectory), Error> {
        let (problem, check) = self.checked_problem()?;
        simulate_checked(problem, check, |problem| {
            let all: Vec<usize> = (0..problem.nodes()).collect();
            let trajectory = Trajectory::new(&problem, &all, &[])?;
            Ok((problem, trajectory))
        })
    }
}

/// A run of a problem, how it ended, and what was recorded of it.
pub struct Attempt<R> {
    /// The problem that was run, with its estimated error once its check accepted the run.
    pub problem: Problem,
    /// What was recorded of the run.
    pub record: R,
    /// How the run ended.
    pub outcome: Result<(), Error>,
}

/// Runs a problem of [`Scene::checked_problem`], and repeats the run with finer numerics while its check requires it.
/// Without a check it runs once.
///
/// `attempt` runs a problem once, and calls the function that it is given with the initial state and after every step.
/// Returned is the last attempt, or the one before if a repetition of a run that reached the end fails or is refused.
/// With a check its problem has the estimated error of the check. Without such an estimate, as after a failed run, it
/// keeps that of the search.
///
/// # Errors
/// Those of the first `attempt`, and of building the problem of a repetition; that of a run is in its outcome.
pub fn run_checked<R>(
    mut problem: Problem,
    mut check: Option<RunCheck>,
    mut attempt: impl FnMut(Problem, &mut dyn FnMut(&dyn Snapshot)) -> Result<Attempt<R>, Error>,
) -> Result<Attempt<R>, Error> {
    let mut completed = None;
    loop {
        let mut monitor = check.as_ref().map(|check| check.monitor(&problem)).transpose()?;
        let tried = attempt(problem, &mut |state| {
            monitor.iter_mut().for_each(|monitor| monitor.push(state));
        });
        let mut done = match tried {
            Ok(done) => done,
            // A repetition that is refused, as by a limit of memory or time, leaves the run before it.
            Err(error) => return completed.ok_or(error),
        };
        let Some((own, monitor)) = check.take().zip(monitor) else { return Ok(done) };
        match own.assess(&done.outcome, &monitor)? {
            RunAssessment::Repeat(next) => {
                let (finer, next) = *next;
                done.problem.set_estimated_error(next.completed);
                completed = done.outcome.is_ok().then_some(done);
                (problem, check) = (finer, Some(next));
            }
            RunAssessment::Accepted(error) => {
                done.problem.set_estimated_error(error);
                // A stop and errors of files are those of the user's last run.
                let is_failed = done.outcome.as_ref().is_err_and(is_failure_of_numerics);
                return Ok(completed.filter(|_| is_failed).unwrap_or(done));
            }
        }
    }
}

/// [`run_checked`] for a run that is recorded in a [`Trajectory`]. Before each run `prepare` returns the problem, with
/// a stop flag or another kind of derivatives, and the empty trajectory. Returned are the problem of the last run, with
/// its estimated error if there is a check, and the recorded run.
///
/// # Errors
/// Those of `prepare`, of [`run_checked`] and of [`Trajectory::run`].
pub fn simulate_checked(
    problem: Problem,
    check: Option<RunCheck>,
    mut prepare: impl FnMut(Problem) -> Result<(Problem, Trajectory), Error>,
) -> Result<(Problem, Trajectory), Error> {
    let last = run_checked(problem, check, |problem, observe| {
        let (problem, mut record) = prepare(problem)?;
        let outcome = record.run(&problem, problem.time()?.steps(), observe);
        Ok(Attempt { problem, record, outcome })
    })?;
    last.outcome.map(|()| (last.problem, last.record))
}

impl RunMonitor {
    /// Compares a state of the run with the trial run at the same time, if one of the times of comparison has been
    /// reached since the last comparison. Keeps the largest distance of the compared points, over the length. The work
    /// of the run is updated in every call.
    pub fn push(&mut self, state: &dyn Snapshot) {
        let time = state.time();
        self.work = self.cost.work(state.work());
        // The comparisons are as many as these times at most, however many steps the run has.
        let before = self.reached;
        let limit = time * (1.0 + TIME_ROUNDING);
        while self.times.get(self.reached).is_some_and(|next| *next <= limit) {
            self.reached += 1;
        }
        if self.reached == before {
            return;
        }
        let recorded = self.trial.read();
        for [own, other] in &self.stencils {
            let Ok(places) = recorded.places(other, std::iter::once(time)) else { continue };
            let mut square = 0.0;
            for c in 0..3 {
                let here: f64 =
                    own.nodes.iter().map(|(i, weight)| weight * state.position(*i)[c]).sum();
                square += (here - places[0][c]).powi(2);
            }
            self.difference = self.difference.max(self.over * square.sqrt());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Parameter;

    const SCENE: &str = "accuracy = 1e-2\n[rod]\nshape = { kind = \"straight\", length = 0.5, direction = [1.0, 0.0, 0.0] }\nsection = { kind = \"circle\", radius = 0.005 }\n\
        [material]\nyoungs_modulus = 1e8\ndensity = 1200.0\n[supports]\nstart = \"clamped\"\n[loads]\ngravity = [0.0, -9.81, 0.0]\n\
        [time]\nend = 0.3\n";

    fn checked() -> (Problem, RunCheck) {
        let scene = Scene::from_toml(SCENE, ".").unwrap();
        let (problem, check) = scene.checked_problem().unwrap();
        (problem, check.unwrap())
    }

    /// A part whose error no difference determined has no error, which is not an error of zero.
    #[test]
    fn unknown_error_of_a_trial_run_is_not_reported_as_zero() {
        let (problem, mut check) = checked();
        check.basis.errors = ErrorModel { mesh: 0.0, step: 0.0, mesh_order: 2.0, step_order: 2.0 };
        let monitor = check.monitor(&problem).unwrap();
        let known = check.clone().assess(&Ok(()), &monitor).unwrap();
        assert!(matches!(known, RunAssessment::Accepted(Some(0.0))));
        check.basis.is_known = false;
        let unknown = check.assess(&Ok(()), &monitor).unwrap();
        assert!(matches!(unknown, RunAssessment::Accepted(None)));
    }

    /// A failed run of `rodas4` is repeated with generalised-alpha, whose error is unknown, with a warning.
    #[test]
    fn failed_run_of_rodas4_is_repeated_with_generalised_alpha() {
        let (problem, mut check) = checked();
        check.basis.trial.numerics.scheme = Scheme::Rodas4;
        let monitor = check.monitor(&problem).unwrap();
        let steps = check.basis.refined(check.finer, &check.scene).steps;
        let failed = Err(Error::SingularEquilibrium);
        let RunAssessment::Repeat(next) = check.assess(&failed, &monitor).unwrap() else {
            panic!("a failed run is accepted")
        };
        let (problem, check) = *next;
        let resolution = problem.resolution().unwrap();
        assert_eq!(problem.time().unwrap().scheme, Scheme::GeneralisedAlpha);
        assert!(problem.time().unwrap().steps() > 2 * steps);
        assert_eq!((resolution.error, resolution.bound), (None, Some(Bound::Work)));
        assert!(matches!(check.assess(&Ok(()), &monitor).unwrap(), RunAssessment::Accepted(None)));
    }

    /// A repetition that fails or is refused gives the run before it, with that run's estimated error and a warning.
    /// The first run has half the modulus, so that it is repeated.
    #[test]
    fn failed_repetition_gives_the_completed_run() {
        for is_refused in [false, true] {
            let (problem, check) = checked();
            let mut runs = 0;
            let last = run_checked(problem, Some(check), |problem, observe| {
                runs += 1;
                if runs > 1 {
                    let outcome = Err(Error::SingularEquilibrium);
                    let failed = Attempt { problem, record: runs, outcome };
                    let refused = || Error::invalid("memory", "too much", "less");
                    return if is_refused { Err(refused()) } else { Ok(failed) };
                }
                let other = problem.with([(Parameter::YoungsModulus, 5e7)])?;
                let steps = other.time()?.steps();
                let outcome = Trajectory::unrecorded(&other)?.run(&other, steps, observe);
                Ok(Attempt { problem, record: runs, outcome })
            })
            .unwrap();
            assert!(runs == 2 && last.record == 1 && last.outcome.is_ok());
            let resolution = last.problem.resolution().unwrap();
            assert!(resolution.error.unwrap() > 1e-2 && resolution.bound == Some(Bound::Work));
        }
    }

    /// Errors that explain a larger difference change by it from the trial run to the chosen one; with new modes in
    /// every refinement the order is lower, and the error of the chosen run grows by more than that of the trial run.
    #[test]
    fn corrected_errors_explain_the_difference_of_the_run() {
        let (_, mut check) = checked();
        let errors = ErrorModel { mesh: 0.01, step: 0.02, mesh_order: 1.2, step_order: 1.2 };
        check.basis.errors = errors;
        check.finer = RefinementFactors { mesh: 3.0, step: 4.0 };
        let change = |errors: ErrorModel| errors.mesh + errors.step - errors.after(check.finer);
        let difference = 1.3 * change(errors);
        let corrected = |has_many_modes: bool| {
            let mut check = check.clone();
            check.basis.has_many_modes = has_many_modes;
            assert_eq!(check.corrected(0.9 * change(errors)).mesh, errors.mesh);
            check.corrected(difference)
        };
        let growth =
            |corrected: ErrorModel| corrected.after(check.finer) / errors.after(check.finer);
        let [few, many] = [false, true].map(corrected);
        for found in [few, many] {
            assert!((change(found) / difference - 1.0).abs() < 1e-6, "{found:?}");
        }
        assert!((growth(few) - 1.3).abs() < 1e-6 && growth(many) > 1.7, "{few:?}, {many:?}");
    }
}

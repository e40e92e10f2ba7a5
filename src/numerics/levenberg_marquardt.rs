//! Bounded Levenberg-Marquardt method for `min 1/2 |r(x)|^2`, as a solver for argmin's Executor.
//!
//! The problem implements argmin's `Operator` (the residuals `r`) and `Jacobian`; bounds of the unknowns are given to
//! [`LevenbergMarquardt`]. [`LevenbergMarquardt::longest_steps`] limits the change of each unknown in one iteration
//! (default: unlimited). Output: the state with iterate, Jacobian, residuals and cost.
//!
//! The search converges if the Gauss-Newton step within the bounds changes no unknown by more than `step_tolerance`, or
//! the linear model by at most `noise_tolerance` standard deviations of the residuals. A short step that changes the
//! linear model by at most `last_step` (default 0) of these, and whose extrapolated model error is below
//! `noise_tolerance`, ends it too. That step is not evaluated: residuals and cost are then those of the linear model,
//! and the Jacobian is that of the iterate before.
//!
//! The damping is scaled by the column norms of the Jacobian (Marquardt 1963) with a decaying maximum of earlier norms
//! (More 1978), so that it does not depend on units. It follows the gain ratio of the last step (Nielsen 1999). A trial
//! point is rejected if it achieves at most `LEAST_GAIN` of the predicted decrease, if the problem returns an error, or
//! if an unknown loses its effect: plateaus have no minimum.
//!
//! Rounding errors of the cost hide small changes of the model. A Gauss-Newton step that changes it by at most
//! `COST_RESOLUTION` of the norm of the residuals is accepted even if the cost rises by less than 1e-8 of it. Its
//! change must be below `LARGEST_CHANGE_RATIO` of that of the last such step. That yields the minimum to rounding. The
//! minimum is also reached if no step lowers the cost at such a small change, or if the predicted decrease is below
//! `COST_ROUNDING` of the cost. If the residuals themselves are rounding errors, the search may end with "no step
//! lowers the cost". Errors: bounds or longest steps of a wrong number, bounds that are not ascending, negative
//! longest steps, a missing start value, and a problem that fails, or is not finite, at the start or in the last trial.
//!
//! A misfit may have corners, for example where strands of a cable begin to slip. There a Gauss-Newton step predicts
//! a decrease that no step achieves. The search ends after a shortened step that lowers the cost by less than a step
//! of `last_step` standard errors would, if the Gauss-Newton step is below half a standard error, or if
//! [several](LevenbergMarquardt::patience) such steps follow each other.
//!
//! `cargo test --release --test fits nist:: -- --nocapture` compares the results with the reference problems of NIST.

use crate::numerics::half_sum_of_squares;
use crate::numerics::linearized::{BoundedStep, Linearized};
use argmin::core::{
    Error, IterState, Jacobian, KV, Operator, Problem, Solver, State, TerminationReason,
};

/// The state of a least-squares problem in argmin: iterate, Jacobian, residuals and cost.
pub type LeastSquaresState = IterState<Vec<f64>, (), Vec<Vec<f64>>, (), Vec<f64>, f64>;

/// The solver, with its settings and the state of the damping. It converges when a Gauss-Newton step would change no
/// unknown by more than `step_tolerance`, or the linear model by at most `noise_tolerance` standard deviations of the
/// residuals, or when rounding errors stop it. With both tolerances zero only rounding errors do.
#[derive(Clone, Debug)]
pub struct LevenbergMarquardt {
    /// Lower and upper bound of each unknown.
    bounds: Vec<[f64; 2]>,
    /// Largest change of each unknown in one iteration.
    longest_steps: Vec<f64>,
    step_tolerance: f64,
    noise_tolerance: f64,
    last_step: f64,
    /// Damping of the next trial, relative to the squared scales.
    damping: f64,
    /// Factor of the next increase of the damping; it doubles with every rejected step.
    growth: f64,
    /// Scale of each unknown in the damping: the norm of its column of the Jacobian, or the decayed scale before if
    /// that is larger.
    scale: Vec<f64>,
    /// Norm of the change of the linear model by the last accepted Gauss-Newton step below the resolution of the cost.
    last_change: f64,
    /// The error of the linear model in the last accepted step.
    model_error: Option<ModelError>,
    /// Number of steps with a negligible decrease after which the search ends.
    patience: usize,
    /// Number of successive accepted steps with a negligible decrease, the first of them after a rejection.
    negligible_steps: usize,
}

/// Error of the linear model in a step: it is proportional to the square of the step's length.
#[derive(Clone, Debug)]
struct ModelError {
    /// The step, one number per unknown.
    step: Vec<f64>,
    /// Norm of the difference between the change of the residuals and that of the model.
    norm: f64,
}

/// Damping at the start, relative to the squared scales.
const FIRST_DAMPING: f64 = 1e-4;
/// Smallest damping; smaller values have no effect on the step.
const LEAST_DAMPING: f64 = 1e-15;
/// Smallest damping from which an increase starts, so that a nearly undamped search needs few rejections.
const LEAST_RAISED_DAMPING: f64 = 1e-6;
/// Damping from which on a step is too short to change anything; the search for a step ends there.
const LARGEST_DAMPING: f64 = 1e20;
/// Damping of a Gauss-Newton step: enough to define the step along combinations that the data do not determine.
const NO_DAMPING: f64 = 1e-16;
/// Smallest factor on the damping after a good step: smaller ones approach Gauss-Newton steps faster.
const LEAST_FACTOR: f64 = 0.03;
/// Smallest factor on the damping after longer steps were rejected: the next iteration would reject them too.
const LEAST_FACTOR_AFTER_REJECTION: f64 = 0.5;
/// Decay of the largest column norm per step. At 1 the scale of a far start would persist; at 0 there is no memory.
const SCALE_DECAY: f64 = 0.7;
/// A step of an unknown is short below this fraction of its longest step; only short steps are taken without
/// evaluation.
const SHORT: f64 = 0.01;
/// Smallest ratio of the achieved to the predicted decrease of the cost at which a step is accepted.
const LEAST_GAIN: f64 = 1e-4;
/// A step that predicts more than this fraction of the decrease predicted by a rejected one is nearly the same step,
/// and is skipped without an evaluation.
const NEARLY_SAME: f64 = 0.8;
/// Factor on the damping while steps are nearly the rejected one.
const SKIP_FACTOR: f64 = 4.0;
/// Number of unknowns from which on a trial first runs without derivatives: these take longer than the run itself.
const MANY_UNKNOWNS: usize = 8;
/// At a corner of the misfit the search ends where the Gauss-Newton step is below this part of a standard error.
const CORNER_TOLERANCE: f64 = 0.5;
/// Smallest fraction of its effect (column norm of the Jacobian) that every unknown must keep in a step.
const LEAST_EFFECT: f64 = 1e-6;
/// Changes of the linear model up to this fraction of the norm of the residuals are hidden by rounding errors of the
/// cost.
const COST_RESOLUTION: f64 = 3e-5;
/// Predicted decreases below this part of the cost are rounding errors of it.
const COST_ROUNDING: f64 = 1e-12;

/// Ratio of the change of the linear model by a step below the resolution of the cost to that by the last such step,
/// below which it is taken. Values near 1 allow many steps that only exchange rounding errors.
const LARGEST_CHANGE_RATIO: f64 = 0.95;

/// Default of the largest Gauss-Newton step that counts as zero, in the unit of the unknowns.
const STEP_TOLERANCE: f64 = 1e-10;

/// Default of the change of the model that counts as zero, in standard deviations of the residuals.
const NOISE_TOLERANCE: f64 = 1e-3;

/// Residuals and derivatives at a point.
struct PointEvaluation {
    jacobian: Vec<Vec<f64>>,
    residuals: Vec<f64>,
    cost: f64,
}

/// Jacobian, residuals and cost `1/2 |r|^2` of the problem at `x`; argmin counts both calls. An error is that of the
/// problem, or that the cost or an entry of the Jacobian is not finite. The Jacobian comes first: its run yields the
/// residuals too.
fn evaluate<O>(problem: &mut Problem<O>, x: &Vec<f64>) -> Result<PointEvaluation, Error>
where
    O: Operator<Param = Vec<f64>, Output = Vec<f64>>
        + Jacobian<Param = Vec<f64>, Jacobian = Vec<Vec<f64>>>,
{
    let jacobian = problem.problem("jacobian_count", |p| p.jacobian(x))?;
    let residuals = problem.problem("operator_count", |p| p.apply(x))?;
    let cost = half_sum_of_squares(&residuals);
    if !cost.is_finite() || !jacobian.iter().flatten().all(|d| d.is_finite()) {
        return Err(argmin::argmin_error!(
            ConditionViolated,
            "Levenberg-Marquardt: the residuals or their derivatives are not finite"
        ));
    }
    Ok(PointEvaluation { jacobian, residuals, cost })
}

/// The argmin state with the iterate `x`, and with the Jacobian, residuals and cost of its evaluation `there`.
fn state_at(state: LeastSquaresState, x: Vec<f64>, there: PointEvaluation) -> LeastSquaresState {
    state.param(x).cost(there.cost).jacobian(there.jacobian).residuals(there.residuals)
}

impl LevenbergMarquardt {
    /// A solver for unknowns within `bounds`, a pair of lower and upper bound for each, with the default settings:
    /// unlimited steps, step tolerance 1e-10, noise tolerance 1e-3, no last step, unlimited patience.
    pub fn new(bounds: Vec<[f64; 2]>) -> Self {
        Self {
            scale: vec![0.0; bounds.len()],
            longest_steps: vec![f64::INFINITY; bounds.len()],
            bounds,
            step_tolerance: STEP_TOLERANCE,
            noise_tolerance: NOISE_TOLERANCE,
            last_step: 0.0,
            damping: FIRST_DAMPING,
            growth: 2.0,
            last_change: f64::INFINITY,
            model_error: None,
            patience: usize::MAX,
            negligible_steps: 0,
        }
    }

    /// Sets the longest step of each unknown per iteration; default: unlimited. A parameter whose best value is zero
    /// has the logarithm minus infinity: an unlimited step would reach a plateau and be rejected.
    pub fn longest_steps(self, longest_steps: Vec<f64>) -> Self {
        Self { longest_steps, ..self }
    }

    /// Sets the largest Gauss-Newton step of an unknown, in its unit, that counts as zero: the search converges below
    /// it; default 1e-10.
    pub fn step_tolerance(self, step_tolerance: f64) -> Self {
        Self { step_tolerance, ..self }
    }

    /// Sets the change of the linear model by a Gauss-Newton step that counts as zero, in standard deviations of the
    /// residuals; default 1e-3.
    pub fn noise_tolerance(self, noise_tolerance: f64) -> Self {
        Self { noise_tolerance, ..self }
    }

    /// Sets the change of the linear model, in standard deviations of the residuals (standard errors), up to which the
    /// last step is taken without evaluating its result; default 0. The error of the linear model is proportional to
    /// the square of the step. Extrapolated from the step before, it must be below the noise tolerance. At a corner of
    /// the misfit, a decrease below that of such a step ends the search (see the module). Data without noise have no
    /// standard errors and are fitted to rounding.
    pub fn last_step(self, last_step: f64) -> Self {
        Self { last_step, ..self }
    }

    /// Sets the number of consecutive shortened steps with a negligible decrease (below that of a step of `last_step`
    /// standard errors) after which the search ends; default: unlimited. At a corner of the misfit, and where it has
    /// jumps, steps with such decreases may go on without end.
    pub fn patience(self, patience: usize) -> Self {
        Self { patience, ..self }
    }

    /// Whether `step`, which changes the linear model by `change` at residuals with the standard deviation `noise`, is
    /// the last one and need not be evaluated. Every unknown moves by at most [`SHORT`] of its longest step, and
    /// `change` is at most `last_step` times the noise. The extrapolated error of the linear model is at most
    /// `noise_tolerance` times the noise. It is the error in the last accepted damped step, times the square of the
    /// largest ratio of an unknown's change now to that in that step. Without such a step the result is false.
    fn is_last(&self, step: &[f64], change: f64, noise: f64) -> bool {
        let Some(ModelError { step: before, norm }) = &self.model_error else { return false };
        let parts = step.iter().zip(before).map(|(now, before)| match *now == 0.0 {
            true => 0.0,
            false => (now / before).abs(),
        });
        let part = parts.fold(0.0, f64::max);
        // Far from its last value a logarithm has another derivative.
        let is_short = |(j, step): (usize, &f64)| {
            self.longest_steps.get(j).is_none_or(|l| step.abs() <= SHORT * l)
        };
        step.iter().enumerate().all(is_short)
            && change <= self.last_step * noise
            && norm * part * part <= self.noise_tolerance * noise
    }

    /// Multiplies the damping, at least `LEAST_RAISED_DAMPING`, by the growth factor after a rejected step, and doubles
    /// the factor (Nielsen 1999).
    fn raise_damping(&mut self) {
        self.damping = self.damping.max(LEAST_RAISED_DAMPING) * self.growth;
        self.growth *= 2.0;
    }

    /// Multiplies the damping by `1 - (2 gain - 1)^3` (Nielsen 1999), from [`LEAST_FACTOR`] to 2, after an accepted
    /// step with this gain ratio. After a rejection the factor is at least [`LEAST_FACTOR_AFTER_REJECTION`]. The
    /// damping stays above [`LEAST_DAMPING`]; the growth factor becomes 2.
    fn relax_damping(&mut self, gain: f64, after_rejection: bool) {
        let factor = 1.0 - (2.0 * gain - 1.0).powi(3);
        let least = if after_rejection { LEAST_FACTOR_AFTER_REJECTION } else { LEAST_FACTOR };
        self.damping = (self.damping * factor.clamp(least, 2.0)).max(LEAST_DAMPING);
        self.growth = 2.0;
    }

    /// Bounds of the next iterate, a pair for each unknown: the intersection of its own bounds and of the longest step
    /// from `x`.
    fn step_bounds(&self, x: &[f64]) -> Vec<[f64; 2]> {
        let within = |((x, [low, high]), longest): ((&f64, &[f64; 2]), &f64)| {
            [low.max(x - longest), high.min(x + longest)]
        };
        x.iter().zip(&self.bounds).zip(&self.longest_steps).map(within).collect()
    }
}

/// The point `x` moved to the nearest point within its bounds, unknown by unknown.
fn clamp(x: Vec<f64>, bounds: &[[f64; 2]]) -> Vec<f64> {
    x.iter().zip(bounds).map(|(x, [low, high])| x.clamp(*low, *high)).collect()
}

impl<O> Solver<O, LeastSquaresState> for LevenbergMarquardt
where
    O: Operator<Param = Vec<f64>, Output = Vec<f64>>
        + Jacobian<Param = Vec<f64>, Jacobian = Vec<Vec<f64>>>,
{
    /// Name of the solver in argmin's reports.
    fn name(&self) -> &str {
        "Levenberg-Marquardt"
    }

    /// The state of argmin at the start value moved into the bounds, with residuals, Jacobian and cost. An error
    /// without a start value, for bounds or longest steps of another number, for bounds that are descending or NaN, for
    /// longest steps that are negative or NaN, or from the problem.
    fn init(
        &mut self,
        problem: &mut Problem<O>,
        mut state: LeastSquaresState,
    ) -> Result<(LeastSquaresState, Option<KV>), Error> {
        let start = state.take_param().ok_or_else(|| -> Error {
            argmin::argmin_error!(
                NotInitialized,
                "Levenberg-Marquardt needs a start: Executor::configure(|state| state.param(..))"
            )
        })?;
        if start.len() != self.bounds.len() || start.len() != self.longest_steps.len() {
            return Err(argmin::argmin_error!(
                InvalidParameter,
                "Levenberg-Marquardt needs one pair of bounds, and one longest step, per unknown"
            ));
        }
        let are_ascending = self.bounds.iter().all(|[low, high]| low <= high);
        if !are_ascending || !self.longest_steps.iter().all(|longest| *longest >= 0.0) {
            return Err(argmin::argmin_error!(
                InvalidParameter,
                "Levenberg-Marquardt needs ascending bounds, and longest steps that are not negative"
            ));
        }
        let x = clamp(start, &self.bounds);
        // A start outside of the bounds begins at the nearest bound.
        let start = evaluate(problem, &x)?;
        Ok((state_at(state, x, start), None))
    }

    /// One iteration: the state with the next iterate, or the same one with the reason why the search ends. It
    /// converges if the Gauss-Newton step is negligible, or small enough to be taken without evaluation (`is_last`). A
    /// step below the resolution of the cost is taken if it shrinks and the cost rises by no more than rounding. Else
    /// the damping is raised until a step lowers the cost; the search converges there at a corner (header). Without
    /// such a step it ends: with the problem's error if the last trial failed, converged within rounding, else by a
    /// `SolverExit`.
    fn next_iter(
        &mut self,
        problem: &mut Problem<O>,
        mut state: LeastSquaresState,
    ) -> Result<(LeastSquaresState, Option<KV>), Error> {
        let missing = || -> Error {
            argmin::argmin_error!(PotentialBug, "Levenberg-Marquardt: state without values")
        };
        let x = state.take_param().ok_or_else(missing)?;
        let jacobian = state.take_jacobian().ok_or_else(missing)?;
        let residuals = state.take_residuals().ok_or_else(missing)?;
        let cost = state.get_cost();
        // Linear model of the residuals at this iterate.
        let linear = Linearized::new(&jacobian, &residuals, &x, &self.bounds);
        for (scale, norm) in self.scale.iter_mut().zip(&linear.norms) {
            // The largest column norm decays, so that the scale of a far start is forgotten.
            *scale = (*scale * SCALE_DECAY).max(*norm);
        }
        let here = PointEvaluation { jacobian, residuals, cost };
        let converged = || TerminationReason::SolverConverged;
        let end = |state, x, there, reason| {
            Ok((state_at(state, x, there).terminate_with(reason), None::<KV>))
        };

        // The Gauss-Newton step, whose size decides on convergence.
        let freedom = here.residuals.len().saturating_sub(x.len()).max(1) as f64;
        // Standard deviation of the residuals, sqrt(2 cost/(n - p)): one standard error is a
        // change of the model by it.
        let noise = (2.0 * cost / freedom).sqrt();
        let bounds = self.step_bounds(&x);
        let Some(BoundedStep { step, change, .. }) =
            linear.step(&x, &bounds, &linear.norms, NO_DAMPING)
        else {
            let reason = TerminationReason::SolverExit("the Jacobian is not finite".to_string());
            return end(state, x, here, reason);
        };
        let target = clamp(add(&x, &step), &bounds);
        let moved = target.iter().zip(&x).map(|(t, x)| (t - x).abs()).fold(0.0, f64::max);
        // Converged: the undamped step changes no unknown, or the model by less than the noise
        // allows.
        if moved <= self.step_tolerance || change <= self.noise_tolerance * noise {
            return end(state, x, here, converged());
        }
        // A small last step is taken on the linear model, which saves a run.
        let step = difference(&target, &x);
        if self.is_last(&step, change, noise) {
            let residuals = add(&here.residuals, &times(&here.jacobian, &step));
            let cost = half_sum_of_squares(&residuals);
            return end(state, target, PointEvaluation { residuals, cost, ..here }, converged());
        }
        // Below the resolution of the cost, Gauss-Newton steps need no lower cost as long as they shrink.
        let below_resolution = change <= COST_RESOLUTION * (2.0 * cost).sqrt();
        if below_resolution
            && change < LARGEST_CHANGE_RATIO * self.last_change
            && let Ok(there) = evaluate(problem, &target)
            && there.cost <= cost * (1.0 + 10.0 * COST_RESOLUTION * COST_RESOLUTION)
        {
            self.last_change = change;
            return Ok((state_at(state, target, there), None));
        }

        // Damped steps, shorter and shorter, until one lowers the cost.
        let mut failure = None;
        // Decrease that the last rejected step predicted.
        let mut rejected = f64::INFINITY;
        while self.damping < LARGEST_DAMPING {
            let Some(BoundedStep { step, .. }) =
                linear.step(&x, &bounds, &self.scale, self.damping)
            else {
                break;
            };
            // The step within the bounds; a step of nothing ends the search.
            let next = clamp(add(&x, &step), &bounds);
            let step = difference(&next, &x);
            if step.iter().zip(&x).all(|(s, x)| s.abs() <= f64::EPSILON * x.abs()) {
                break;
            }
            let predicted = linear.predicted(&step);
            if predicted <= 0.0 {
                // Rounding errors or a bound made an ascent step; a shorter step descends.
                self.raise_damping();
                continue;
            }
            // A step almost like the rejected one would be rejected too.
            if predicted > NEARLY_SAME * rejected {
                self.damping = self.damping.max(LEAST_RAISED_DAMPING) * SKIP_FACTOR;
                continue;
            }
            let at_rounding = predicted <= COST_ROUNDING * cost;
            // After a rejection another one is likely: of many unknowns a run without derivatives decides on it.
            if x.len() >= MANY_UNKNOWNS
                && rejected.is_finite()
                && !at_rounding
                && let Ok(residuals) = problem.problem("operator_count", |p| p.apply(&next))
                && decrease(&here.residuals, &residuals) <= LEAST_GAIN * predicted
            {
                failure = None;
                rejected = predicted;
                self.raise_damping();
                continue;
            }
            match evaluate(problem, &next) {
                Ok(there) => {
                    failure = None;
                    // Gain ratio: achieved over predicted decrease of the cost (Nielsen 1999).
                    let gain = decrease(&here.residuals, &there.residuals) / predicted;
                    let lost = linear.least_kept_effect(&there.jacobian) <= LEAST_EFFECT;
                    if gain > LEAST_GAIN && !lost {
                        self.relax_damping(gain, rejected.is_finite());
                        // Error of the linear model in this step, which scales with the square of
                        // the length.
                        let change_made = difference(&there.residuals, &here.residuals);
                        let error = difference(&change_made, &times(&here.jacobian, &step));
                        let norm = (2.0 * half_sum_of_squares(&error)).sqrt();
                        self.model_error = Some(ModelError { step, norm });
                        let damping = argmin::kv!("damping" => self.damping;);
                        let mut state = state_at(state, next, there);
                        // Negligible decreases after rejections are the sign of a corner.
                        let lowered = 2.0 * gain * predicted;
                        let negligible = lowered <= (self.last_step * noise).powi(2)
                            && (rejected.is_finite() || self.negligible_steps > 0);
                        self.negligible_steps =
                            if negligible { self.negligible_steps + 1 } else { 0 };
                        let is_patient = self.negligible_steps < self.patience;
                        if negligible && (change <= CORNER_TOLERANCE * noise || !is_patient) {
                            state = state.terminate_with(converged());
                        }
                        return Ok((state, Some(damping)));
                    }
                    // The predicted decrease is below the rounding of the cost: nothing more to
                    // gain.
                    if at_rounding && !lost {
                        return end(state, x, here, converged());
                    }
                }
                Err(error) => failure = Some(error),
            }
            rejected = predicted;
            self.raise_damping();
        }
        // No damping gave a lower cost: an error of the problem, rounding, or a point that is no
        // minimum.
        match failure {
            Some(error) => Err(error),
            None if below_resolution => end(state, x, here, converged()),
            None => {
                let reason =
                    "no step lowers the cost, yet the gradient does not vanish".to_string();
                end(state, x, here, TerminationReason::SolverExit(reason))
            }
        }
    }
}

/// Decrease of the cost between two lists of residuals, `1/2 sum (a^2 - b^2)`, without the cancellation of two large
/// sums.
fn decrease(before: &[f64], after: &[f64]) -> f64 {
    0.5 * before.iter().zip(after).map(|(a, b)| (a - b) * (a + b)).sum::<f64>()
}

/// The sum `x + step`, entry by entry.
fn add(x: &[f64], step: &[f64]) -> Vec<f64> {
    x.iter().zip(step).map(|(x, s)| x + s).collect()
}

/// The difference `to - from`, entry by entry.
fn difference(to: &[f64], from: &[f64]) -> Vec<f64> {
    to.iter().zip(from).map(|(to, from)| to - from).collect()
}

/// The product `J step`, an entry for each residual: the change of the linear model by the step.
fn times(jacobian: &[Vec<f64>], step: &[f64]) -> Vec<f64> {
    jacobian.iter().map(|row| row.iter().zip(step).map(|(d, s)| d * s).sum()).collect()
}

#[cfg(test)]
mod tests;

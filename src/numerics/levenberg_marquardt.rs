//! Bounded Levenberg-Marquardt, as a solver for argmin's Executor.
//!
//! Minimises `1/2 |r(x)|^2` for a problem with argmin's `Operator` (the residuals) and `Jacobian`.
//! The damping scales with the columns of the Jacobian (Marquardt 1963), with a memory of how large
//! they have been (More 1978), so that it does not depend on units, and follows the gain of the
//! last step (Nielsen 1999). A trial point is rejected where the cost rises, where the problem
//! returns an error, and where an unknown loses its effect: plateaus have no minimum.
//!
//! Costs can only tell steps apart that change them by more than their rounding errors, about
//! `1e-8` of the residuals. Closer to the minimum full steps are taken as long as each promises
//! less than the one before it; that gives the minimum to rounding. Where no step lowers the cost and
//! the full step promises no more than that, the minimum is reached; a fit that leaves nothing but
//! rounding errors may still end with "no step lowers the cost".
//!
//! A misfit may have corners, as where parts of a cable begin to slip on each other. There full steps promise
//! what no step keeps: a shorter one that lowers the cost by less than a step of `last_step` standard errors would is
//! the last, where the full one is no longer than half of one, or where [several](LevenbergMarquardt::patience) before it were no
//! better.
//!
//! `cargo test --release --test fits nist:: -- --nocapture` shows what that is worth on the reference
//! problems of NIST.

use crate::numerics::linearized::Linearized;
use crate::numerics::linearized::half_sum_of_squares;
use argmin::core::{
    Error, IterState, Jacobian, KV, Operator, Problem, Solver, State, TerminationReason,
};

/// The state argmin keeps of a least-squares problem.
pub type LeastSquaresState = IterState<Vec<f64>, (), Vec<Vec<f64>>, (), Vec<f64>, f64>;

/// The solver. Ends as converged when a full Gauss-Newton step would move no unknown by more than
/// `step_tolerance`, or would move the model by less than `noise_tolerance` of the residuals'
/// standard deviation, or when rounding errors stop it. With both tolerances zero only they do.
#[derive(Clone, Debug)]
pub struct LevenbergMarquardt {
    bounds: Vec<[f64; 2]>,
    longest_steps: Vec<f64>,
    step_tolerance: f64,
    noise_tolerance: f64,
    last_step: f64,
    damping: f64,
    growth: f64,
    /// Norms of the Jacobian's columns, or what is remembered of larger ones.
    scale: Vec<f64>,
    /// Change of the model by the last full step that was taken without asking for its cost.
    last_change: f64,
    /// The last step that was taken, and what the linear model left out of the change it made.
    curvature: Option<(Vec<f64>, f64)>,
    /// After how many such steps in a row the search ends.
    patience: usize,
    /// How many of the last steps lowered the cost by next to nothing, since longer ones were refused.
    crawled: usize,
}

/// Damping at the start, relative to the squared scales.
const FIRST_DAMPING: f64 = 1e-4;
/// Smallest damping, and the least to go up from.
const LEAST_DAMPING: [f64; 2] = [1e-15, 1e-6];
/// Above this damping a step is too short to change anything.
const LARGEST_DAMPING: f64 = 1e20;
/// Damping of a full step: just enough to be defined where the data say nothing.
const NO_DAMPING: f64 = 1e-16;
/// The most that one good step lowers the damping by, and one that came after longer ones were refused: those of the next
/// iteration would be too.
const LEAST_FACTOR: [f64; 2] = [0.03, 0.5];
/// Part of the largest norm of a column that is remembered at every step.
const MEMORY: f64 = 0.7;
/// A step of an unknown is short below this part of the longest.
const SHORT: f64 = 0.01;
/// Least part of the predicted drop of the cost that a step must achieve.
const LEAST_GAIN: f64 = 1e-4;
/// A step that promises more than this part of what one promised that was refused is nearly that one.
const ALIKE: f64 = 0.8;
/// The damping grows by this factor as long as steps are nearly those that were refused.
const ON: f64 = 4.0;
/// Derivatives by so many unknowns take longer than the run that tells whether they are needed.
const MANY: usize = 8;
/// A minimum with a corner in it is not looked for more closely from within this part of a standard error.
const NEAR: f64 = 0.5;
/// A step must leave every unknown this part of its effect.
const LEAST_EFFECT: f64 = 1e-6;
/// A change of the model below this part of the residuals is beyond what costs can judge.
const BELOW_COST: f64 = 3e-5;

/// What the problem says about a point.
struct Trial {
    jacobian: Vec<Vec<f64>>,
    residuals: Vec<f64>,
    cost: f64,
}

/// The Jacobian first: its run yields the residuals too.
fn evaluate<O>(problem: &mut Problem<O>, x: &Vec<f64>) -> Result<Trial, Error>
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
    Ok(Trial { jacobian, residuals, cost })
}

fn at(state: LeastSquaresState, x: Vec<f64>, trial: Trial) -> LeastSquaresState {
    state.param(x).cost(trial.cost).jacobian(trial.jacobian).residuals(trial.residuals)
}

impl LevenbergMarquardt {
    /// A solver for unknowns within `bounds` (one pair per unknown).
    pub fn new(bounds: Vec<[f64; 2]>) -> Self {
        Self {
            scale: vec![0.0; bounds.len()],
            longest_steps: vec![f64::INFINITY; bounds.len()],
            bounds,
            step_tolerance: 1e-10,
            noise_tolerance: 1e-3,
            last_step: 0.0,
            damping: FIRST_DAMPING,
            growth: 2.0,
            last_change: f64::INFINITY,
            curvature: None,
            patience: usize::MAX,
            crawled: 0,
        }
    }

    /// Sets how far each unknown may go in one step; default: as far as it likes. A logarithm whose
    /// value the data want at zero would otherwise lose its effect in one step, and the step with it.
    pub fn longest_steps(self, longest_steps: Vec<f64>) -> Self {
        Self { longest_steps, ..self }
    }

    /// Sets the largest Gauss-Newton step that counts as none; default 1e-10.
    pub fn step_tolerance(self, step_tolerance: f64) -> Self {
        Self { step_tolerance, ..self }
    }

    /// Sets the part of a standard deviation that counts as none; default 1e-3.
    pub fn noise_tolerance(self, noise_tolerance: f64) -> Self {
        Self { noise_tolerance, ..self }
    }

    /// Sets the part of a standard error below which the last step is taken on the linear model, without
    /// looking at where it leads; default 0. What that leaves out goes with the square of the step; it
    /// must be below the noise tolerance by what the step before has shown. In a corner of the misfit it is the
    /// part below which the search ends. Data without noise have no
    /// standard errors, and are fitted to rounding as ever.
    pub fn last_step(self, last_step: f64) -> Self {
        Self { last_step, ..self }
    }

    /// Sets after how many steps in a row the search ends that lowered the cost by less than a step of `last_step` standard
    /// errors would, each after longer ones were refused; default: never. A misfit with a corner at its
    /// minimum lets none go further, but so does one that jumps for other reasons.
    pub fn patience(self, patience: usize) -> Self {
        Self { patience, ..self }
    }

    /// Whether a step that changes the linear model by `change` is the last, and need not be looked at.
    /// No unknown moves by a larger part of its standard error than the model by that of the noise.
    fn is_last(&self, step: &[f64], change: f64, noise: f64) -> bool {
        let Some((before, left_out)) = &self.curvature else { return false };
        let parts = step.iter().zip(before).map(|(now, before)| match *now == 0.0 {
            true => 0.0,
            false => (now / before).abs(),
        });
        let part = parts.fold(0.0, f64::max);
        // The derivative by a logarithm on its way to zero is soon another one.
        let is_short = |(j, step): (usize, &f64)| {
            self.longest_steps.get(j).is_none_or(|l| step.abs() <= SHORT * l)
        };
        step.iter().enumerate().all(is_short)
            && change <= self.last_step * noise
            && left_out * part * part <= self.noise_tolerance * noise
    }

    fn raise_damping(&mut self) {
        self.damping = self.damping.max(LEAST_DAMPING[1]) * self.growth;
        self.growth *= 2.0;
    }

    /// After a step with this gain, at first or after others were `refused`.
    fn relax_damping(&mut self, gain: f64, refused: bool) {
        let factor = 1.0 - (2.0 * gain - 1.0).powi(3);
        let least = LEAST_FACTOR[usize::from(refused)];
        self.damping = (self.damping * factor.clamp(least, 2.0)).max(LEAST_DAMPING[0]);
        self.growth = 2.0;
    }

    /// Where one step may lead from `x`.
    fn reach(&self, x: &[f64]) -> Vec<[f64; 2]> {
        let within = |((x, [low, high]), longest): ((&f64, &[f64; 2]), &f64)| {
            [low.max(x - longest), high.min(x + longest)]
        };
        x.iter().zip(&self.bounds).zip(&self.longest_steps).map(within).collect()
    }
}

fn clamp(x: Vec<f64>, bounds: &[[f64; 2]]) -> Vec<f64> {
    x.iter().zip(bounds).map(|(x, [low, high])| x.clamp(*low, *high)).collect()
}

impl<O> Solver<O, LeastSquaresState> for LevenbergMarquardt
where
    O: Operator<Param = Vec<f64>, Output = Vec<f64>>
        + Jacobian<Param = Vec<f64>, Jacobian = Vec<Vec<f64>>>,
{
    fn name(&self) -> &str {
        "Levenberg-Marquardt"
    }

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
        let x = clamp(start, &self.bounds);
        let start = evaluate(problem, &x)?;
        Ok((at(state, x, start), None))
    }

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
        let linear = Linearized::new(&jacobian, &residuals, &x, &self.bounds);
        for (scale, norm) in self.scale.iter_mut().zip(&linear.norms) {
            *scale = (*scale * MEMORY).max(*norm);
        }
        let here = Trial { jacobian, residuals, cost };

        let freedom = here.residuals.len().saturating_sub(x.len()).max(1) as f64;
        let noise = (2.0 * cost / freedom).sqrt();
        let reach = self.reach(&x);
        let Some((full, change)) = linear.step(&x, &reach, &linear.norms, NO_DAMPING) else {
            let why = TerminationReason::SolverExit("the Jacobian is not finite".to_string());
            return Ok((at(state, x, here).terminate_with(why), None));
        };
        let target = clamp(add(&x, &full), &reach);
        let moved = target.iter().zip(&x).map(|(t, x)| (t - x).abs()).fold(0.0, f64::max);
        if moved <= self.step_tolerance || change <= self.noise_tolerance * noise {
            let converged = TerminationReason::SolverConverged;
            return Ok((at(state, x, here).terminate_with(converged), None));
        }
        let step = difference(&target, &x);
        if self.is_last(&step, change, noise) {
            let residuals = add(&here.residuals, &times(&here.jacobian, &step));
            let cost = half_sum_of_squares(&residuals);
            let there = Trial { residuals, cost, ..here };
            let converged = TerminationReason::SolverConverged;
            return Ok((at(state, target, there).terminate_with(converged), None));
        }
        if change <= BELOW_COST * (2.0 * cost).sqrt() && change < 0.95 * self.last_change {
            let trial = evaluate(problem, &target);
            if let Ok(trial) = trial
                && trial.cost <= cost * (1.0 + 10.0 * BELOW_COST * BELOW_COST)
            {
                self.last_change = change;
                return Ok((at(state, target, trial), None));
            }
        }

        let mut failure = None;
        // What the last step promised that was refused.
        let mut refused = f64::INFINITY;
        while self.damping < LARGEST_DAMPING {
            let Some((step, _)) = linear.step(&x, &reach, &self.scale, self.damping) else {
                break;
            };
            let next = clamp(add(&x, &step), &reach);
            let step = difference(&next, &x);
            if step.iter().zip(&x).all(|(s, x)| s.abs() <= f64::EPSILON * x.abs()) {
                break;
            }
            let predicted = linear.predicted(&step);
            if predicted <= 0.0 {
                // Rounding errors, or a bound, made a step that leads up; a shorter one does not.
                self.raise_damping();
                continue;
            }
            if predicted > ALIKE * refused {
                self.damping = self.damping.max(LEAST_DAMPING[1]) * ON;
                continue;
            }
            if x.len() >= MANY
                && refused.is_finite()
                && predicted > 1e-12 * cost
                && let Ok(residuals) = problem.problem("operator_count", |p| p.apply(&next))
                && drop(&here.residuals, &residuals) <= LEAST_GAIN * predicted
            {
                // Refused as the last one was, and its derivatives are saved.
                failure = None;
                refused = predicted;
                self.raise_damping();
                continue;
            }
            match evaluate(problem, &next) {
                Ok(trial) => {
                    failure = None;
                    let gain = drop(&here.residuals, &trial.residuals) / predicted;
                    let lost = linear.least_kept(&trial.jacobian) <= LEAST_EFFECT;
                    if gain > LEAST_GAIN && !lost {
                        self.relax_damping(gain, refused.is_finite());
                        let made = difference(&trial.residuals, &here.residuals);
                        let left_out = difference(&made, &times(&here.jacobian, &step));
                        self.curvature =
                            Some((step, (2.0 * half_sum_of_squares(&left_out)).sqrt()));
                        let damping = argmin::kv!("damping" => self.damping;);
                        let mut state = at(state, next, trial);
                        let lowered = 2.0 * gain * predicted;
                        let next_to_nothing = lowered <= (self.last_step * noise).powi(2);
                        // The damping that others were refused for stays a while.
                        let crawls = next_to_nothing && (refused.is_finite() || self.crawled > 0);
                        self.crawled = if crawls { self.crawled + 1 } else { 0 };
                        if crawls && (change <= NEAR * noise || self.crawled >= self.patience) {
                            state = state.terminate_with(TerminationReason::SolverConverged);
                        }
                        return Ok((state, Some(damping)));
                    }
                    // At the rounding level of the cost, nothing more can be gained.
                    if predicted <= 1e-12 * cost && !lost {
                        let converged = TerminationReason::SolverConverged;
                        return Ok((at(state, x, here).terminate_with(converged), None));
                    }
                }
                Err(error) => failure = Some(error),
            }
            refused = predicted;
            self.raise_damping();
        }
        match failure {
            Some(error) => Err(error),
            // What is left to gain is beyond what costs can judge.
            None if change <= BELOW_COST * (2.0 * cost).sqrt() => {
                let converged = TerminationReason::SolverConverged;
                Ok((at(state, x, here).terminate_with(converged), None))
            }
            None => {
                let why = "no step lowers the cost, yet the gradient does not vanish".to_string();
                let exit = TerminationReason::SolverExit(why);
                Ok((at(state, x, here).terminate_with(exit), None))
            }
        }
    }
}

/// Half the difference of the sums of squares, without the cancellation of two large sums.
fn drop(before: &[f64], after: &[f64]) -> f64 {
    0.5 * before.iter().zip(after).map(|(a, b)| (a - b) * (a + b)).sum::<f64>()
}

fn add(x: &[f64], step: &[f64]) -> Vec<f64> {
    x.iter().zip(step).map(|(x, s)| x + s).collect()
}

fn difference(to: &[f64], from: &[f64]) -> Vec<f64> {
    to.iter().zip(from).map(|(to, from)| to - from).collect()
}

/// The change that the linear model makes of a step.
fn times(jacobian: &[Vec<f64>], step: &[f64]) -> Vec<f64> {
    jacobian.iter().map(|row| row.iter().zip(step).map(|(d, s)| d * s).sum()).collect()
}

#[cfg(test)]
mod tests;

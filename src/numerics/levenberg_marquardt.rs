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
use crate::numerics::linearized::half_square;
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
    /// How many of the last steps lowered the cost by next to nothing, after longer ones were refused.
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
/// The most that one good step lowers the damping by.
const LEAST_FACTOR: f64 = 0.03;
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
    let cost = half_square(&residuals);
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

    /// After a step with this gain.
    fn relax_damping(&mut self, gain: f64) {
        let factor = 1.0 - (2.0 * gain - 1.0).powi(3);
        self.damping = (self.damping * factor.clamp(LEAST_FACTOR, 2.0)).max(LEAST_DAMPING[0]);
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
            let cost = half_square(&residuals);
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
            match evaluate(problem, &next) {
                Ok(trial) => {
                    failure = None;
                    let gain = drop(&here.residuals, &trial.residuals) / predicted;
                    let lost = linear.least_kept(&trial.jacobian) <= LEAST_EFFECT;
                    if gain > LEAST_GAIN && !lost {
                        self.relax_damping(gain);
                        let made = difference(&trial.residuals, &here.residuals);
                        let left_out = difference(&made, &times(&here.jacobian, &step));
                        self.curvature = Some((step, (2.0 * half_square(&left_out)).sqrt()));
                        let damping = argmin::kv!("damping" => self.damping;);
                        let mut state = at(state, next, trial);
                        let lowered = 2.0 * gain * predicted;
                        let crawls =
                            refused.is_finite() && lowered <= (self.last_step * noise).powi(2);
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
mod tests {
    use super::*;
    use argmin::core::Executor;

    /// Rosenbrock's function as two residuals; fails for x[0] above `wall`.
    struct Rosenbrock {
        wall: f64,
    }

    impl Operator for Rosenbrock {
        type Param = Vec<f64>;
        type Output = Vec<f64>;
        fn apply(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
            if x[0] > self.wall {
                return Err(argmin::argmin_error!(ConditionViolated, "beyond the wall"));
            }
            Ok(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]])
        }
    }
    impl Jacobian for Rosenbrock {
        type Param = Vec<f64>;
        type Jacobian = Vec<Vec<f64>>;
        fn jacobian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
            self.apply(x)?;
            Ok(vec![vec![-20.0 * x[0], 10.0], vec![-1.0, 0.0]])
        }
    }

    fn solve(wall: f64, start: [f64; 2], bounds: [[f64; 2]; 2]) -> (Vec<f64>, bool) {
        let result = Executor::new(
            Rosenbrock { wall },
            LevenbergMarquardt::new(bounds.to_vec()).noise_tolerance(1e-9),
        )
        .configure(|state| state.param(start.to_vec()).max_iters(200))
        .run()
        .unwrap();
        let state = result.state();
        let converged = state.get_termination_reason() == Some(&TerminationReason::SolverConverged);
        (state.get_best_param().unwrap().clone(), converged)
    }

    const WIDE: [[f64; 2]; 2] = [[-10.0, 10.0], [-10.0, 10.0]];

    #[test]
    fn reaches_the_minimum() {
        let (x, converged) = solve(f64::MAX, [-1.2, 1.0], WIDE);
        assert!(converged && (x[0] - 1.0).abs() < 1e-10 && (x[1] - 1.0).abs() < 1e-10);
    }

    #[test]
    fn a_failing_trial_is_rejected_and_the_minimum_still_reached() {
        // From here the first steps overshoot the wall.
        let (x, converged) = solve(1.05, [-1.2, 1.0], WIDE);
        assert!(converged && (x[0] - 1.0).abs() < 1e-10);
        let walled = Rosenbrock { wall: 0.5 };
        let run = Executor::new(walled, LevenbergMarquardt::new(WIDE.to_vec()))
            .configure(|state| state.param(vec![-1.2, 1.0]).max_iters(200))
            .run();
        assert!(run.is_err(), "a minimum behind failing simulations is not reported as found");
    }

    #[test]
    fn a_bound_holds_and_the_rest_converges() {
        let (x, converged) = solve(f64::MAX, [-1.2, 1.0], [[-10.0, 0.5], [-10.0, 10.0]]);
        assert!(converged);
        assert_eq!(x[0], 0.5);
        assert!((x[1] - 0.25).abs() < 1e-10);
    }

    /// Values with noise, and a corner where the first unknown is 1: from both sides the linear model leads
    /// beyond it, from the near one by `beyond`; how much the slopes differ, `bend` tells.
    struct Corner {
        beyond: f64,
        bend: f64,
        runs: std::cell::Cell<usize>,
    }

    impl Corner {
        fn residual(&self, k: usize, x: &[f64]) -> (f64, [f64; 2]) {
            // The noise is orthogonal to both columns on the near side.
            let (t, noise) = (0.1 * k as f64, if matches!(k % 4, 0 | 3) { 0.3 } else { -0.3 });
            let slope = if x[0] > 1.0 { t + self.bend * noise } else { t };
            let value = noise - self.beyond * t + slope * (x[0] - 1.0) + (x[1] - 2.0);
            (value, [slope, 1.0])
        }
    }
    impl Operator for &Corner {
        type Param = Vec<f64>;
        type Output = Vec<f64>;
        fn apply(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
            self.runs.set(self.runs.get() + 1);
            Ok((0..40).map(|k| self.residual(k, x).0).collect())
        }
    }
    impl Jacobian for &Corner {
        type Param = Vec<f64>;
        type Jacobian = Vec<Vec<f64>>;
        fn jacobian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
            Ok((0..40).map(|k| self.residual(k, x).1.to_vec()).collect())
        }
    }

    /// In a corner the search ends after a few runs, within a tenth of a standard error of where it ends
    /// without regard to the noise, also where the linear model promises a standard error more; and no run is spent
    /// on a step that was refused a moment before.
    #[test]
    fn a_corner_is_not_polished() {
        for (beyond, bend, most, saved) in [(0.005, 0.6, 20, 4), (0.04, 1.2, 40, 2)] {
            let (runs, exact) = corner(beyond, bend);
            assert!(runs <= most && saved * runs <= exact, "{runs} {exact}");
        }
    }

    /// How many runs it takes, and how many without regard to the noise.
    fn corner(beyond: f64, bend: f64) -> (usize, usize) {
        let solve = |last_step: f64| {
            let problem = Corner { beyond, bend, runs: Default::default() };
            let solver = LevenbergMarquardt::new(WIDE.to_vec()).last_step(last_step).patience(3);
            let result = Executor::new(&problem, solver)
                .configure(|state| state.param(vec![0.2, 0.5]).max_iters(200))
                .run()
                .unwrap();
            let state = result.state();
            let reason = state.get_termination_reason().cloned();
            assert_eq!(reason, Some(TerminationReason::SolverConverged));
            (state.get_param().unwrap().clone(), state.get_cost(), problem.runs.get())
        };
        let ((exact, least, most), (x, cost, runs)) = (solve(0.0), solve(0.05));
        println!("{exact:?} {least} in {most} runs, {x:?} {cost} in {runs}");
        let noise = 2.0 * least / 38.0;
        assert!(cost - least <= 0.5 * 0.1_f64.powi(2) * noise, "{:e}", (cost - least) / noise);
        (runs, most)
    }

    /// A decay at 40 times, with this much noise on it.
    struct Decay {
        noise: f64,
        runs: std::cell::Cell<usize>,
    }

    impl Operator for &Decay {
        type Param = Vec<f64>;
        type Output = Vec<f64>;
        fn apply(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
            self.runs.set(self.runs.get() + 1);
            let residual = |k: usize| {
                let time = 0.05 * k as f64;
                x[0] * (-x[1] * time).exp() - (-time).exp() - self.noise * (7.0 * k as f64).sin()
            };
            Ok((0..40).map(residual).collect())
        }
    }
    impl Jacobian for &Decay {
        type Param = Vec<f64>;
        type Jacobian = Vec<Vec<f64>>;
        fn jacobian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
            let row = |k: usize| {
                let (time, decay) = (0.05 * k as f64, (-x[1] * 0.05 * k as f64).exp());
                vec![decay, -time * x[0] * decay]
            };
            Ok((0..40).map(row).collect())
        }
    }

    fn decay(noise: f64, last_step: f64) -> (Vec<f64>, Vec<f64>, usize) {
        let problem = Decay { noise, runs: Default::default() };
        let solver = LevenbergMarquardt::new(WIDE.to_vec()).last_step(last_step);
        let result = Executor::new(&problem, solver)
            .configure(|state| state.param(vec![1.3, 1.4]).max_iters(50))
            .run()
            .unwrap();
        let state = result.state();
        let converged = state.get_termination_reason() == Some(&TerminationReason::SolverConverged);
        assert!(converged);
        let runs = problem.runs.get();
        (state.get_param().unwrap().clone(), state.get_residuals().unwrap().clone(), runs)
    }

    /// The last step saves a run, and is off by less than a thousandth of a standard error; residuals
    /// and place belong together. Data without noise are fitted to rounding.
    #[test]
    fn the_last_step_is_taken_on_the_linear_model() {
        let (exact, _, most) = decay(0.02, 0.0);
        let (x, residuals, runs) = decay(0.02, 0.05);
        assert_eq!(runs, most - 1);
        // The standard errors are above 0.002.
        let off = difference(&x, &exact).into_iter().map(f64::abs).fold(0.0, f64::max);
        assert!(off > 0.0 && off < 2e-6, "{off:e}");
        let problem = Decay { noise: 0.02, runs: Default::default() };
        let there = (&problem).apply(&x).unwrap();
        let apart = (2.0 * half_square(&difference(&there, &residuals))).sqrt();
        assert!(apart < 1e-3 * 0.02, "{apart:e}");
        let (x, ..) = decay(0.0, 0.05);
        assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-12), "{x:?}");
    }
}

//! Tests of the Levenberg-Marquardt solver: Rosenbrock's valley with a failing region and bounds, misfits with a
//! corner (where steps do not achieve their predicted decrease), and an exponential decay with and without noise.
//!
//! They check minima to 1e-10 and the number of evaluations, with and without derivatives.

use super::*;
use argmin::core::Executor;

/// Rosenbrock's function as two residuals; fails for x[0] above `wall`.
struct RosenbrockValley {
    wall: f64,
}

impl Operator for RosenbrockValley {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    /// The two residuals; an error beyond the wall.
    fn apply(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
        if x[0] > self.wall {
            return Err(argmin::argmin_error!(ConditionViolated, "beyond the wall"));
        }
        Ok(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]])
    }
}
impl Jacobian for RosenbrockValley {
    type Param = Vec<f64>;
    type Jacobian = Vec<Vec<f64>>;
    /// The Jacobian of the residuals.
    fn jacobian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
        self.apply(x)?;
        Ok(vec![vec![-20.0 * x[0], 10.0], vec![-1.0, 0.0]])
    }
}

/// Minimum from a start within bounds, and whether the solver converged.
fn solve(wall: f64, start: [f64; 2], bounds: [[f64; 2]; 2]) -> (Vec<f64>, bool) {
    let result = Executor::new(
        RosenbrockValley { wall },
        LevenbergMarquardt::new(bounds.to_vec()).noise_tolerance(1e-9),
    )
    .configure(|state| state.param(start.to_vec()).max_iters(200))
    .run()
    .unwrap();
    let state = result.state();
    let converged = state.get_termination_reason() == Some(&TerminationReason::SolverConverged);
    (state.get_best_param().unwrap().clone(), converged)
}

/// Bounds far from the minimum.
const WIDE: [[f64; 2]; 2] = [[-10.0, 10.0], [-10.0, 10.0]];

#[test]
fn rosenbrock_minimum_is_found_to_1e_10() {
    // The minimum is at (1, 1); the start is the usual one.
    let (x, converged) = solve(f64::MAX, [-1.2, 1.0], WIDE);
    assert!(converged && (x[0] - 1.0).abs() < 1e-10 && (x[1] - 1.0).abs() < 1e-10);
}

#[test]
fn failing_trials_are_rejected_and_a_failing_minimum_is_an_error() {
    // From here the first steps overshoot the wall.
    let (x, converged) = solve(1.05, [-1.2, 1.0], WIDE);
    assert!(converged && (x[0] - 1.0).abs() < 1e-10);
    let walled = RosenbrockValley { wall: 0.5 };
    let run = Executor::new(walled, LevenbergMarquardt::new(WIDE.to_vec()))
        .configure(|state| state.param(vec![-1.2, 1.0]).max_iters(200))
        .run();
    assert!(run.is_err(), "a minimum behind failing simulations is not reported as found");
}

#[test]
fn unknown_at_a_bound_stays_and_the_other_converges() {
    let (x, converged) = solve(f64::MAX, [-1.2, 1.0], [[-10.0, 0.5], [-10.0, 10.0]]);
    // At x = 0.5 the minimum over y is y = x^2.
    assert!(converged);
    assert_eq!(x[0], 0.5);
    assert!((x[1] - 0.25).abs() < 1e-10);
}

/// Noisy values whose misfit has a corner where the first unknown is 1. The minimum of the linear model lies beyond the
/// corner from both sides, from the near side by `beyond`; `bend` scales the difference of the slopes.
struct Corner {
    beyond: f64,
    bend: f64,
    runs: std::cell::Cell<usize>,
}

impl Corner {
    /// Residual `k` and its derivatives by both unknowns.
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
    /// The residuals; counts a run.
    fn apply(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
        self.runs.set(self.runs.get() + 1);
        Ok((0..40).map(|k| self.residual(k, x).0).collect())
    }
}
impl Jacobian for &Corner {
    type Param = Vec<f64>;
    type Jacobian = Vec<Vec<f64>>;
    /// The Jacobian of the residuals.
    fn jacobian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
        Ok((0..40).map(|k| self.residual(k, x).1.to_vec()).collect())
    }
}

/// At a corner the search ends after a few runs, within a tenth of a standard error of the minimum that a search
/// without noise tolerance finds. This holds also where the linear model predicts a standard error more.
#[test]
fn search_at_a_corner_ends_within_few_runs() {
    for (beyond, bend, most, saved) in [(0.005, 0.6, 20, 4), (0.04, 1.2, 40, 2)] {
        let (runs, exact) = corner(beyond, bend);
        assert!(runs <= most && saved * runs <= exact, "{runs} {exact}");
    }
}

/// Numbers of runs with the noise tolerance, and without it.
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

/// The same corner among eight unknowns; counts evaluations with derivatives, and all runs.
struct Corners {
    corner: Corner,
    with_derivatives: std::cell::Cell<usize>,
}

impl Corners {
    /// Contributions of the other six unknowns to a value, and their slopes: cubic, so that several steps are needed.
    fn others(k: usize, x: &[f64]) -> impl Iterator<Item = [f64; 2]> {
        let wave = move |j: usize| (0.1 * (k * j) as f64).cos();
        x[2..]
            .iter()
            .enumerate()
            .map(move |(j, x)| [x + x.powi(3), 1.0 + 3.0 * x * x].map(|part| wave(j + 3) * part))
    }
}

impl Operator for &Corners {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    /// The residuals; counts a run.
    fn apply(&self, x: &Vec<f64>) -> Result<Vec<f64>, Error> {
        self.corner.runs.set(self.corner.runs.get() + 1);
        let other = |k: usize| Corners::others(k, x).map(|[value, _]| value).sum::<f64>();
        Ok((0..40).map(|k| self.corner.residual(k, x).0 + other(k)).collect())
    }
}
impl Jacobian for &Corners {
    type Param = Vec<f64>;
    type Jacobian = Vec<Vec<f64>>;
    /// The Jacobian of the residuals; counts an evaluation with derivatives.
    fn jacobian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
        self.with_derivatives.set(self.with_derivatives.get() + 1);
        let row = |k: usize| {
            let own = self.corner.residual(k, x).1;
            own.into_iter().chain(Corners::others(k, x).map(|[_, slope]| slope)).collect()
        };
        Ok((0..40).map(row).collect())
    }
}

/// Where long steps are rejected repeatedly, few are tried, and without derivatives.
#[test]
fn rejected_steps_of_many_unknowns_cost_few_derivatives() {
    let (mut with, mut all) = (0, 0);
    for beyond in [0.005, 0.02, 0.04, 0.08] {
        let corner = Corner { beyond, bend: 1.2, runs: Default::default() };
        let problem = Corners { corner, with_derivatives: Default::default() };
        let solver = LevenbergMarquardt::new(vec![WIDE[0]; 8]).last_step(0.05).patience(3);
        let mut start = vec![1.5; 8];
        (start[0], start[1]) = (0.2, 0.5);
        let result = Executor::new(&problem, solver)
            .configure(|state: LeastSquaresState| state.param(start).max_iters(200))
            .run()
            .unwrap();
        let reason = result.state().get_termination_reason().cloned();
        assert_eq!(reason, Some(TerminationReason::SolverConverged));
        let runs = (problem.with_derivatives.get(), problem.corner.runs.get());
        println!("{beyond}: {runs:?}, {}", result.state().get_cost());
        with += runs.0;
        all += runs.1;
    }
    // If all trials had derivatives, and the damping fell as without rejections, the count would be 90.
    assert!(with <= 72 && all <= 105, "{with} with derivatives of {all}");
}

/// An exponential decay at 40 times with noise of this amplitude.
struct Decay {
    noise: f64,
    runs: std::cell::Cell<usize>,
}

impl Operator for &Decay {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    /// The residuals; counts a run.
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
    /// The Jacobian of the residuals.
    fn jacobian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
        let row = |k: usize| {
            let (time, decay) = (0.05 * k as f64, (-x[1] * 0.05 * k as f64).exp());
            vec![decay, -time * x[0] * decay]
        };
        Ok((0..40).map(row).collect())
    }
}

/// Parameters, residuals and number of runs of a fit of the decay.
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

/// The last step saves a run and differs by less than a thousandth of a standard error; the residuals belong to the
/// result. Data without noise are fitted to rounding.
#[test]
fn last_step_is_taken_on_the_linear_model() {
    let (exact, _, most) = decay(0.02, 0.0);
    let (x, residuals, runs) = decay(0.02, 0.05);
    assert_eq!(runs, most - 1);
    // The standard errors are above 0.002.
    let off = difference(&x, &exact).into_iter().map(f64::abs).fold(0.0, f64::max);
    assert!(off > 0.0 && off < 2e-6, "{off:e}");
    let problem = Decay { noise: 0.02, runs: Default::default() };
    let there = (&problem).apply(&x).unwrap();
    let apart = (2.0 * half_sum_of_squares(&difference(&there, &residuals))).sqrt();
    assert!(apart < 1e-3 * 0.02, "{apart:e}");
    let (x, ..) = decay(0.0, 0.05);
    assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-12), "{x:?}");
}

/// Bounds that descend or are no numbers are errors at the start of the solver, as are longest steps below zero.
#[test]
fn descending_bounds_and_negative_steps_are_errors() {
    let refusal = |solver: LevenbergMarquardt| {
        let executor = Executor::new(RosenbrockValley { wall: f64::MAX }, solver);
        let run = executor.configure(|state| state.param(vec![0.0, 0.0]).max_iters(2)).run();
        run.err().map(|error| error.to_string()).unwrap_or_default()
    };
    for first in [[2.0, 1.0], [f64::NAN, 1.0], [0.0, f64::NAN]] {
        let text = refusal(LevenbergMarquardt::new(vec![first, WIDE[1]]));
        assert!(text.contains("ascending bounds"), "{first:?}: {text}");
    }
    let backward = LevenbergMarquardt::new(WIDE.to_vec()).longest_steps(vec![1.0, -1.0]);
    assert!(refusal(backward).contains("not negative"));
    assert_eq!(refusal(LevenbergMarquardt::new(WIDE.to_vec())), "");
}

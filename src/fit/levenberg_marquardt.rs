//! Bounded Levenberg-Marquardt, as a solver for argmin's Executor.
//!
//! Minimises `1/2 |r(x)|^2` for a problem with argmin's `Operator` (the residuals) and `Jacobian`.
//! The damping scales with the columns of the Jacobian (Marquardt 1963, More 1978), so that it
//! does not depend on units. A trial point where the problem returns an error is rejected like one
//! where the cost rises.

use super::residuals::half_square;
use argmin::core::{
    Error, IterState, Jacobian, KV, Operator, Problem, Solver, State, TerminationReason,
};
use nalgebra::{DMatrix, DVector};

/// The state argmin keeps of a least-squares problem.
pub type LeastSquaresState = IterState<Vec<f64>, (), Vec<Vec<f64>>, (), Vec<f64>, f64>;

/// The solver. Ends as converged when a full Gauss-Newton step would move no unknown by more than
/// `step_tolerance`, or would move the model by less than `noise_tolerance` of the residuals'
/// standard deviation.
#[derive(Clone, Debug)]
pub struct LevenbergMarquardt {
    bounds: Vec<[f64; 2]>,
    step_tolerance: f64,
    noise_tolerance: f64,
    damping: f64,
    growth: f64,
}

/// Damping at the start, relative to the squared column norms.
const FIRST_DAMPING: f64 = 1e-4;
/// Above this damping a step is too short to change anything.
const LARGEST_DAMPING: f64 = 1e14;

impl LevenbergMarquardt {
    /// A solver for unknowns within `bounds` (one pair per unknown).
    pub fn new(bounds: Vec<[f64; 2]>) -> Self {
        Self {
            bounds,
            step_tolerance: 1e-10,
            noise_tolerance: 1e-3,
            damping: FIRST_DAMPING,
            growth: 4.0,
        }
    }

    /// Sets the largest Gauss-Newton step that counts as none; default 1e-10.
    pub fn step_tolerance(self, step_tolerance: f64) -> Self {
        Self { step_tolerance, ..self }
    }

    /// Sets the part of a standard deviation that counts as none; default 1e-3.
    pub fn noise_tolerance(self, noise_tolerance: f64) -> Self {
        Self { noise_tolerance, ..self }
    }

    fn raise_damping(&mut self) {
        self.damping = self.damping.max(1e-6) * self.growth;
        self.growth *= 2.0;
    }

    fn clamp(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.bounds).map(|(x, [low, high])| x.clamp(*low, *high)).collect()
    }
}

/// The linear least-squares problem at one iterate, reduced to the unknowns that may move.
struct Linearized {
    free: Vec<usize>,
    /// Upper triangle of the QR factors of the free columns.
    r: DMatrix<f64>,
    /// First rows of Q' residuals.
    qtr: DVector<f64>,
    /// Norms of the free columns, the scale of the damping.
    scale: Vec<f64>,
}

impl Linearized {
    /// Unknowns at a bound that the gradient pushes outward stay there.
    fn new(rows: &[Vec<f64>], residuals: &[f64], x: &[f64], bounds: &[[f64; 2]]) -> Self {
        let gradient =
            |j: usize| rows.iter().zip(residuals).map(|(row, r)| row[j] * r).sum::<f64>();
        let free: Vec<usize> = (0..x.len())
            .filter(|j| {
                let g = gradient(*j);
                !(x[*j] <= bounds[*j][0] && g > 0.0 || x[*j] >= bounds[*j][1] && g < 0.0)
            })
            .collect();
        let n = free.len();
        // At least as many rows as columns, so that R is square.
        let m = rows.len().max(n);
        let jacobian = DMatrix::from_fn(m, n, |i, j| rows.get(i).map_or(0.0, |row| row[free[j]]));
        // An unknown without effect gets a scale too, so that damping keeps it where it is.
        let norms = jacobian.column_iter().map(|c| c.norm());
        let scale = norms.map(|norm| if norm > 0.0 { norm } else { 1.0 }).collect();
        let mut qtr = DVector::from_fn(m, |i, _| residuals.get(i).copied().unwrap_or(0.0));
        let qr = jacobian.qr();
        qr.q_tr_mul(&mut qtr);
        Self { free, r: qr.r(), qtr: qtr.rows(0, n).into_owned(), scale }
    }

    /// The step of every unknown under a damping, and the norm of the model's change.
    fn step(&self, unknowns: usize, damping: f64) -> Option<(Vec<f64>, f64)> {
        let n = self.free.len();
        let mut step = vec![0.0; unknowns];
        if n == 0 {
            return Some((step, 0.0));
        }
        let root = damping.sqrt();
        let stacked = DMatrix::from_fn(2 * n, n, |i, j| match i {
            i if i < n => self.r[(i, j)],
            i if i - n == j => root * self.scale[j],
            _ => 0.0,
        });
        let mut rhs = DVector::from_fn(2 * n, |i, _| if i < n { -self.qtr[i] } else { 0.0 });
        let qr = stacked.qr();
        qr.q_tr_mul(&mut rhs);
        let solution = qr.r().solve_upper_triangular(&rhs.rows(0, n).into_owned())?;
        if !solution.iter().all(|s| s.is_finite()) {
            return None;
        }
        for (j, s) in self.free.iter().zip(solution.iter()) {
            step[*j] = *s;
        }
        Some((step, (&self.r * solution).norm()))
    }

    /// Drop of the cost the linear model predicts for a step.
    fn predicted(&self, step: &[f64]) -> f64 {
        let s = DVector::from_fn(self.free.len(), |j, _| step[self.free[j]]);
        let change = &self.r * s;
        -(change.dot(&self.qtr) + 0.5 * change.norm_squared())
    }
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
        if start.len() != self.bounds.len() {
            return Err(argmin::argmin_error!(
                InvalidParameter,
                "Levenberg-Marquardt needs one pair of bounds per unknown"
            ));
        }
        let x = self.clamp(&start);
        // The Jacobian first: its run yields the residuals too.
        let jacobian = problem.problem("jacobian_count", |p| p.jacobian(&x))?;
        let residuals = problem.problem("operator_count", |p| p.apply(&x))?;
        let cost = half_square(&residuals);
        if !cost.is_finite() {
            return Err(argmin::argmin_error!(
                InvalidParameter,
                "Levenberg-Marquardt: the residuals at the start are not finite"
            ));
        }
        Ok((state.param(x).cost(cost).jacobian(jacobian).residuals(residuals), None))
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
        let n = x.len();
        let linear = Linearized::new(&jacobian, &residuals, &x, &self.bounds);
        let here = |state: LeastSquaresState| {
            state
                .param(x.clone())
                .cost(cost)
                .jacobian(jacobian.clone())
                .residuals(residuals.clone())
        };
        let end = |state: LeastSquaresState, reason| Ok((here(state).terminate_with(reason), None));

        // The undamped step, with just enough damping to be defined where the data say nothing.
        let freedom = residuals.len().saturating_sub(n).max(1) as f64;
        let noise = (2.0 * cost / freedom).sqrt();
        let Some((full, change)) = linear.step(n, 1e-14) else {
            let why = "the Jacobian is not finite".to_string();
            return end(state, TerminationReason::SolverExit(why));
        };
        let target: Vec<f64> = self.clamp(&add(&x, &full));
        let moved = target.iter().zip(&x).map(|(t, x)| (t - x).abs()).fold(0.0, f64::max);
        if moved <= self.step_tolerance || change <= self.noise_tolerance * noise {
            return end(state, TerminationReason::SolverConverged);
        }

        let mut failure = None;
        while self.damping < LARGEST_DAMPING {
            let Some((step, _)) = linear.step(n, self.damping) else { break };
            let trial = self.clamp(&add(&x, &step));
            let step: Vec<f64> = trial.iter().zip(&x).map(|(t, x)| t - x).collect();
            let predicted = linear.predicted(&step);
            if step.iter().all(|s| s.abs() <= f64::EPSILON) {
                break;
            }
            if predicted <= 0.0 {
                // A bound cut the step to one that leads up; a shorter one does not.
                self.raise_damping();
                continue;
            }
            let outcome = problem
                .problem("jacobian_count", |p| p.jacobian(&trial))
                .and_then(|j| Ok((j, problem.problem("operator_count", |p| p.apply(&trial))?)));
            let trial_cost = match &outcome {
                Ok((_, r)) => half_square(r),
                Err(_) => f64::INFINITY,
            };
            let gain = (cost - trial_cost) / predicted;
            if gain > 1e-4 {
                if gain > 0.75 {
                    self.damping = (self.damping * 0.03).max(1e-15);
                } else if gain < 0.25 {
                    self.damping *= 2.0;
                }
                self.growth = 4.0;
                let (jacobian, residuals) = outcome?;
                let next =
                    state.param(trial).cost(trial_cost).jacobian(jacobian).residuals(residuals);
                return Ok((next, Some(argmin::kv!("damping" => self.damping;))));
            }
            // At the rounding level of the cost, nothing more can be gained.
            if outcome.is_ok() && predicted <= 1e-12 * cost {
                return end(state, TerminationReason::SolverConverged);
            }
            failure = outcome.err();
            self.raise_damping();
        }
        match failure {
            Some(error) => Err(error),
            None => {
                let why = "no step lowers the cost, yet the gradient does not vanish".to_string();
                end(state, TerminationReason::SolverExit(why))
            }
        }
    }
}

fn add(x: &[f64], step: &[f64]) -> Vec<f64> {
    x.iter().zip(step).map(|(x, s)| x + s).collect()
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
}

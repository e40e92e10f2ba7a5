//! Residuals of a fit and their exact Jacobian, as any solver of argmin can use them.

use super::view::View;
use super::{Observation, Unknown};
use crate::error::Error;
use crate::parameter::Parameter;
use crate::point::Stencil;
use crate::problem::Problem;
use crate::trajectory::{Lifted, Snapshot, Trajectory};
use argmin::core::{CostFunction, Gradient, Jacobian, Operator};
use num_dual::Dual64;
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// Residuals `(simulated - observed)/sigma` of all seen coordinates, as a function of the unknowns
/// on their [scales](Unknown::to_scale): logarithms of positive parameters.
///
/// Implements argmin's `Operator` (the residuals), `Jacobian`, `CostFunction` (half the sum of
/// squares), `Gradient` and `Hessian` (exact, in second-order dual numbers). A simulation that fails is an error, never a made-up number.
#[derive(Debug)]
pub struct Residuals {
    problem: Problem,
    unknowns: Vec<Unknown>,
    series: Vec<Series>,
    tracked: Vec<usize>,
    /// Time of the last sample, s.
    end: f64,
    full_work: f64,
    last: RefCell<Option<Evaluation>>,
    work: Rc<Cell<f64>>,
}

/// An observation, cut to the horizon, with its point as a sum of nodes.
#[derive(Clone, Debug)]
struct Series {
    stencil: Stencil,
    samples: Vec<super::Sample>,
    weight: f64,
}

/// Residuals, and their Jacobian if it was asked for, at one point.
#[derive(Clone, Debug)]
struct Evaluation {
    x: Vec<f64>,
    residuals: Vec<f64>,
    jacobian: Option<Vec<Vec<f64>>>,
}

impl Residuals {
    /// The residuals of `observations` up to `horizon`, s. `sigmas` has one per observation, m.
    /// `full_work` is the work of one full simulation, steps times segments.
    pub(crate) fn new(
        problem: &Problem,
        observations: &[Observation],
        sigmas: &[f64],
        unknowns: &[Unknown],
        horizon: f64,
        full_work: f64,
    ) -> Result<Self, Error> {
        let mut series = Vec::new();
        let mut tracked = Vec::new();
        let mut end = 0.0_f64;
        for (observation, sigma) in observations.iter().zip(sigmas) {
            let stencil = problem.stencil(observation.point)?;
            tracked.extend(stencil.nodes.iter().map(|(i, _)| *i));
            let samples: Vec<_> =
                observation.samples.iter().copied().filter(|s| s.time <= horizon).collect();
            end = samples.last().map_or(end, |s| end.max(s.time));
            series.push(Series { stencil, samples, weight: 1.0 / sigma });
        }
        tracked.sort_unstable();
        tracked.dedup();
        Ok(Self {
            problem: problem.clone(),
            unknowns: unknowns.to_vec(),
            series,
            tracked,
            end,
            full_work,
            last: RefCell::new(None),
            work: Rc::default(),
        })
    }

    /// Counts its work, steps times segments, in a shared counter.
    pub(super) fn counting(self, work: Rc<Cell<f64>>) -> Self {
        Self { work, ..self }
    }

    /// The unknowns, in the order of the solver's vector.
    pub fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// From the solver's vector to parameter values in SI units.
    pub fn values(&self, x: &[f64]) -> Vec<(Parameter, f64)> {
        let pairs = self.unknowns.iter().zip(x);
        pairs.map(|(unknown, x)| (unknown.parameter, unknown.from_scale(*x))).collect()
    }

    /// Work so far in full simulations: steps times segments over those of one full run. A run
    /// with derivatives counts once.
    pub fn simulations(&self) -> f64 {
        self.work.get() / self.full_work
    }

    /// Number of residuals.
    pub fn len(&self) -> usize {
        self.counts().iter().sum()
    }

    /// Whether there are no residuals.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of residuals of each observation.
    pub(crate) fn counts(&self) -> Vec<usize> {
        let count = |s: &Series| s.samples.iter().flat_map(|s| s.position).flatten().count();
        self.series.iter().map(count).collect()
    }

    /// Residuals at `x`.
    pub fn residuals(&self, x: &[f64]) -> Result<Vec<f64>, Error> {
        self.evaluate(x, false, |e| e.residuals.clone())
    }

    /// Rows of the Jacobian at `x`.
    pub fn jacobian_at(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        self.evaluate(x, true, |e| e.jacobian.clone().unwrap_or_default())
    }

    /// Evaluates unless the last evaluation was at the same point and has what is needed.
    fn evaluate<T>(
        &self,
        x: &[f64],
        with_jacobian: bool,
        read: impl FnOnce(&Evaluation) -> T,
    ) -> Result<T, Error> {
        let mut last = self.last.borrow_mut();
        let usable = |e: &Evaluation| e.x == x && (e.jacobian.is_some() || !with_jacobian);
        if !last.as_ref().is_some_and(usable) {
            *last = None;
            *last = Some(self.simulate(x, with_jacobian)?);
        }
        match &*last {
            Some(evaluation) => Ok(read(evaluation)),
            None => unreachable!("just set"),
        }
    }

    /// The problem at `x`.
    pub(super) fn model(&self, x: &[f64]) -> Result<Problem, Error> {
        self.problem.with(self.values(x))
    }

    /// Simulates at `x`, with derivatives by the parameters `wanted`, as long as the samples last
    /// on the camera's clock.
    pub(super) fn run(
        &self,
        x: &[f64],
        wanted: &[Parameter],
    ) -> Result<(Problem, Trajectory), Error> {
        self.run_seen(x, wanted, |_| {})
    }

    /// The same; `after` sees the simulation at the start and after every step.
    pub(super) fn run_seen(
        &self,
        x: &[f64],
        wanted: &[Parameter],
        after: impl FnMut(&dyn Snapshot),
    ) -> Result<(Problem, Trajectory), Error> {
        let problem = self.model(x)?;
        let time = problem.time()?;
        let end = self.end - problem.scene().camera.time_offset;
        let steps = ((end / time.step - 1e-9).ceil().max(1.0)) as usize;
        let problem = match end > time.end * (1.0 + 1e-9) {
            true => problem.lasting(end),
            false => problem,
        };
        let steps = steps.min(problem.time()?.steps());
        let mut trajectory = Trajectory::new(&problem, &self.tracked, wanted)?;
        let outcome = trajectory.run(&problem, steps, after);
        let steps = trajectory.work().steps + usize::from(outcome.is_err());
        self.work.set(self.work.get() + (steps * problem.segments()) as f64);
        outcome?;
        Ok((problem, trajectory))
    }

    /// Calls `each` with every residual through a view; `tracks` say where the trajectory has the
    /// derivatives that the residuals carry.
    pub(super) fn each_residual<D: Lifted<P>, const P: usize>(
        &self,
        trajectory: &Trajectory,
        view: &View<D>,
        tracks: [Option<usize>; P],
        mut each: impl FnMut(D),
    ) -> Result<(), Error> {
        for series in &self.series {
            for sample in &series.samples {
                let time = view.time(sample.time);
                let position = trajectory.sample_over(&series.stencil, time, tracks)?;
                let recorded = view.recorded(position);
                for c in 0..3 {
                    if let Some(seen) = sample.position[c] {
                        each((recorded[c] - D::from(seen)) * series.weight);
                    }
                }
            }
        }
        Ok(())
    }

    fn simulate(&self, x: &[f64], with_jacobian: bool) -> Result<Evaluation, Error> {
        let values = self.values(x);
        let of_motion = |p: &Parameter| with_jacobian && !p.is_of_the_camera();
        let wanted: Vec<Parameter> = values.iter().map(|(p, _)| *p).filter(of_motion).collect();
        let (problem, trajectory) = self.run(x, &wanted)?;
        let mut residuals = Vec::with_capacity(self.len());
        let plain = View::new(&problem, |_, value| value);
        self.each_residual(&trajectory, &plain, [], |r: f64| residuals.push(r))?;
        if !with_jacobian {
            return Ok(Evaluation { x: x.to_vec(), residuals, jacobian: None });
        }
        let mut rows = vec![Vec::with_capacity(values.len()); residuals.len()];
        for (unknown, (parameter, value)) in self.unknowns.iter().zip(&values) {
            let seed = |p, value| Dual64::new(value, f64::from(p == *parameter));
            let track = wanted.iter().position(|p| p == parameter);
            let slope = unknown.slope(*value);
            let mut row = rows.iter_mut();
            self.each_residual(&trajectory, &View::new(&problem, seed), [track], |r| {
                if let Some(row) = row.next() {
                    row.push(r.eps * slope);
                }
            })?;
        }
        Ok(Evaluation { x: x.to_vec(), residuals, jacobian: Some(rows) })
    }
}

impl Operator for Residuals {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    fn apply(&self, x: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        Ok(self.residuals(x)?)
    }
}

impl Jacobian for Residuals {
    type Param = Vec<f64>;
    type Jacobian = Vec<Vec<f64>>;
    fn jacobian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, argmin::core::Error> {
        Ok(self.jacobian_at(x)?)
    }
}

impl CostFunction for Residuals {
    type Param = Vec<f64>;
    type Output = f64;
    fn cost(&self, x: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        Ok(self.evaluate(x, false, |e| half_square(&e.residuals))?)
    }
}

impl Gradient for Residuals {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;
    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        let rows = self.jacobian_at(x)?;
        let residuals = self.residuals(x)?;
        let component = |j: usize| rows.iter().zip(&residuals).map(|(row, r)| row[j] * r).sum();
        Ok((0..self.unknowns.len()).map(component).collect())
    }
}

/// Half the sum of squares.
pub(crate) fn half_square(residuals: &[f64]) -> f64 {
    0.5 * residuals.iter().map(|r| r * r).sum::<f64>()
}

//! Residuals of a fit, their exact Jacobian and the gradient of the misfit, as an argmin problem.
//!
//! Input: experiments up to horizons (times, s, to which their records are used), sigmas of their measurements,
//! unknowns. At a point `x` on the unknowns' scales all experiments are simulated on several threads; the residuals are
//! those of all measurements in order, then those of the priors. The last evaluation is kept, because solvers evaluate
//! residuals, Jacobian and cost at the same point. Output: vectors and rows in units of sigma. They are either plain
//! (`(simulated - measured)/sigma`: `plain_residuals`, `plain_jacobian`) or transformed by robust loss and leverage
//! weight (`residuals`, `jacobian_at`), so that half their sum of squares is the objective. The gradient is by the
//! adjoint where that costs less for all experiments (`adjoint_gradient`), else the transposed Jacobian times the
//! residuals. A simulation that fails and another count of numbers than of unknowns are errors.
//!
//! `with_leverage_weights`, `with_work_counter` and `with_evaluation` (an evaluation, to be kept as the last one)
//! return changed residuals. `runs` and `run` (one experiment) return simulations; `with_runs` keeps their evaluation
//! as the last one. `simulations` is the work so far in full simulations.

use crate::dynamics::Snapshot;
use crate::error::{Error, ensure};
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::loss::{Loss, WeightedLoss};
use crate::fit::misfit::observed_experiment::{
    ExperimentRun, ObservedExperiment, has_halved_steps,
};
use crate::fit::misfit::work::WorkCounter;
use crate::fit::unknown::{ParameterPoint, Unknown};
use crate::numerics::half_sum_of_squares;
use crate::problem::Problem;
use crate::scene::Parameter;
use argmin::core::{CostFunction, Gradient, Jacobian, Operator};
use num_dual::Dual64;
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Residuals as a function of the unknowns on their [scales](Unknown::to_scale), logarithms of
/// positive parameters: `(simulated - measured)/sigma` of all values, [robust](Loss::robust) where the
/// loss is robust, and `(value - mean)/sigma` of the priors.
///
/// Implements argmin's `Operator` (the residuals), `Jacobian`, `CostFunction` (half the sum of squares), `Gradient` and
/// `Hessian` (exact, in second-order dual numbers). The gradient of recorded motions by more than six unknowns is by
/// the adjoint, where the scene has one, at the cost of about 2.5 runs. A simulation that fails is an error, never a
/// made-up number.
#[derive(Debug)]
pub struct Residuals {
    unknowns: Vec<Unknown>,
    experiments: Vec<ObservedExperiment>,
    /// Leverage weights: factors on the residuals; 1 where the list ends.
    leverage_weights: Vec<f64>,
    /// Work of one simulation of all experiments, steps times segments.
    full_work: f64,
    /// The last evaluation: solvers evaluate residuals and Jacobian at the same point.
    last: Mutex<Option<Evaluation>>,
    work: WorkCounter,
}

/// Plain residuals at one point, and their Jacobian if it was computed.
#[derive(Clone, Debug)]
pub(crate) struct Evaluation {
    /// The unknowns on their scales.
    pub x: Vec<f64>,
    /// Residuals of the measurements and then of the priors, without robust loss and leverage weights.
    pub residuals: Vec<f64>,
    /// Derivatives of these residuals by the unknowns on their scales, row by row.
    pub jacobian: Option<Vec<Vec<f64>>>,
    /// Whether any time step was halved.
    pub halved: bool,
}

/// Plain residuals of one experiment at one point, their derivatives row by row, and whether any time step was halved.
struct ExperimentResiduals {
    residuals: Vec<f64>,
    jacobian: Vec<Vec<f64>>,
    halved: bool,
}

impl Residuals {
    /// The residuals of `experiments` up to `horizons`, s, one per experiment, without leverage weights and with a work
    /// counter of their own. `sigmas` has one per measurement, in its unit. `full_work` is the work of one full
    /// simulation, steps times segments. An error for points that are not on the rod.
    pub(crate) fn new(
        experiments: &[Experiment],
        sigmas: &[f64],
        unknowns: &[Unknown],
        horizons: &[f64],
        full_work: f64,
    ) -> Result<Self, Error> {
        // The sigmas of all measurements are consumed experiment by experiment.
        let mut sigmas = sigmas.iter();
        let pairs = experiments.iter().zip(horizons);
        let observed =
            pairs.map(|(e, horizon)| ObservedExperiment::new(e, unknowns, &mut sigmas, *horizon));
        Ok(Self {
            experiments: observed.collect::<Result<_, Error>>()?,
            unknowns: unknowns.to_vec(),
            leverage_weights: Vec::new(),
            full_work,
            last: Mutex::default(),
            work: WorkCounter::default(),
        })
    }

    /// The residuals with a shared `work` counter, to which their simulations add steps times segments.
    pub(crate) fn with_work_counter(self, work: WorkCounter) -> Self {
        Self { work, ..self }
    }

    /// The residuals with a leverage weight for each, a factor before the loss: the noise counts as larger by the
    /// inverse. Beyond the end of the list the factor is 1.
    pub(crate) fn with_leverage_weights(self, weights: &[f64]) -> Self {
        Self { leverage_weights: weights.to_vec(), ..self }
    }

    /// The residuals with the `known` evaluation at one point as the last one, which is not simulated again.
    pub(crate) fn with_evaluation(self, known: Evaluation) -> Self {
        Self { last: Mutex::new(Some(known)), ..self }
    }

    /// The unknowns, in the order of the solver's vector.
    pub fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// One pair per unknown, in their order: its parameter, and its value in the parameter's unit at a solver's vector
    /// `x`, which is on the unknowns' scales.
    pub fn values(&self, x: &[f64]) -> Vec<(Parameter, f64)> {
        let pairs = self.unknowns.iter().zip(x);
        pairs.map(|(unknown, x)| (unknown.parameter, unknown.from_scale(*x))).collect()
    }

    /// Work so far in full simulations: steps times segments over those of one full run. A run with derivatives counts
    /// once, a failed run in part.
    pub fn simulations(&self) -> f64 {
        self.work.total() / self.full_work
    }

    /// Number of residuals: all values of the measurements up to the horizons, and one per unknown with a prior.
    pub fn len(&self) -> usize {
        let priors = self.unknowns.iter().filter(|u| u.prior.is_some()).count();
        self.counts().iter().sum::<usize>() + priors
    }

    /// Whether there are no residuals.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of residuals of each measurement, in their order. Those of the priors follow after them and are not
    /// counted.
    pub(crate) fn counts(&self) -> Vec<usize> {
        self.experiments.iter().flat_map(ObservedExperiment::counts).collect()
    }

    /// The loss and the leverage weight of every residual, in their order. Those of priors are last and have squares
    /// and the weight 1.
    pub(crate) fn weighted_losses(&self) -> Vec<WeightedLoss> {
        let own = self.experiments.iter().flat_map(ObservedExperiment::losses);
        let losses = own.chain(std::iter::repeat(Loss::Squares)).take(self.len());
        let pairs = losses.zip(self.leverage_weights());
        pairs.map(|(loss, weight)| WeightedLoss { loss, weight }).collect()
    }

    /// The leverage weight of every residual, 1 beyond the end of the given list. Those of priors are last and have the
    /// weight 1.
    pub(crate) fn leverage_weights(&self) -> Vec<f64> {
        let mut weights = self.leverage_weights.clone();
        weights.resize(self.len(), 1.0);
        weights
    }

    /// An error with the key `x` if the length of the vector `x` is not the number of unknowns.
    pub(crate) fn check_length(&self, x: &[f64]) -> Result<(), Error> {
        let (n, found) = (self.unknowns.len(), format!("{} numbers", x.len()));
        ensure(x.len() == n, "x", found, format!("{n} numbers, one for each unknown"))
    }

    /// Residuals at `x`, on the unknowns' scales, in units of sigma, with robust loss and leverage weights: half their
    /// sum of squares is the objective.
    ///
    /// # Errors
    ///
    /// Another count of numbers, or a simulation that fails.
    pub fn residuals(&self, x: &[f64]) -> Result<Vec<f64>, Error> {
        // The robust loss as a transformed residual, whose square is the loss.
        let robust = |(r, loss): (&f64, WeightedLoss)| loss.robust(*r)[0];
        self.evaluate(x, false, |e| {
            e.residuals.iter().zip(self.weighted_losses()).map(robust).collect()
        })
    }

    /// Rows of the Jacobian at `x`: the derivatives of each of the [`residuals`](Self::residuals), with robust loss and
    /// leverage weights, by the unknowns on their scales. Exact, by forward sensitivities and dual numbers.
    ///
    /// # Errors
    ///
    /// Another count of numbers, or a simulation that fails.
    pub fn jacobian_at(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        let mut rows = self.plain_jacobian(x)?;
        let residuals = self.plain_residuals(x)?;
        for ((row, r), loss) in rows.iter_mut().zip(residuals).zip(self.weighted_losses()) {
            // Chain rule: the derivative of the transformed residual by the plain one.
            let [_, slope] = loss.robust(r);
            row.iter_mut().for_each(|d| *d *= slope);
        }
        Ok(rows)
    }

    /// Residuals at `x`, on the unknowns' scales, in units of sigma, without robust loss and leverage weights: those of
    /// the measurements in order, then those of the priors. An error if a simulation fails.
    pub(crate) fn plain_residuals(&self, x: &[f64]) -> Result<Vec<f64>, Error> {
        self.evaluate(x, false, |e| e.residuals.clone())
    }

    /// Jacobian at `x` of the residuals without robust loss and leverage weights, by the unknowns on their scales: a
    /// row per residual, those of the priors last. An error if a simulation fails.
    pub(crate) fn plain_jacobian(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        self.evaluate(x, true, |e| e.jacobian.clone().unwrap_or_default())
    }

    /// Whether the simulations of the last kept evaluation halved any time step, as they do where a step does not
    /// converge; `false` without one. The set of halved steps depends on the unknowns, which makes the misfit
    /// discontinuous.
    pub(crate) fn has_halved_steps(&self) -> bool {
        self.last().as_ref().is_some_and(|e| e.halved)
    }

    /// The last evaluation, locked for this thread. The lock of a thread that panicked is taken over.
    fn last(&self) -> MutexGuard<'_, Option<Evaluation>> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The value of `read` for the evaluation at `x`. The last evaluation is used if it was at `x` and, where
    /// `with_jacobian` is set, has the Jacobian; else all experiments are simulated. The evaluation becomes the last
    /// one. An error for a wrong length or a simulation that fails, after which there is no last evaluation.
    fn evaluate<T>(
        &self,
        x: &[f64],
        with_jacobian: bool,
        read: impl FnOnce(&Evaluation) -> T,
    ) -> Result<T, Error> {
        self.check_length(x)?;
        // Solvers evaluate residuals and Jacobian at one point: one simulation serves both.
        let usable = |e: &Evaluation| e.x == x && (e.jacobian.is_some() || !with_jacobian);
        let known = self.last().take().filter(usable);
        // The lock is released during the simulation: its threads may evaluate other residuals of this fit.
        let evaluation = match known {
            Some(evaluation) => evaluation,
            None => self.simulate(x, with_jacobian)?,
        };
        Ok(read(self.last().insert(evaluation)))
    }

    /// The experiments as functions of the unknowns, in their order.
    pub(crate) fn experiments(&self) -> &[ObservedExperiment] {
        &self.experiments
    }

    /// Simulations of all experiments at `x`, in their order and on several threads, with derivatives by the unknowns
    /// if `derived`. Their work is counted. Error: a simulation fails.
    pub(crate) fn runs(&self, x: &[f64], derived: bool) -> Result<Vec<ExperimentRun>, Error> {
        self.map_experiments(|k, _| self.run(k, x, derived, &mut |_, _| {}))
    }

    /// Simulates the experiment with index `k` at `x`, with derivatives by the unknowns if `derived`, and counts the
    /// work. `after` is called at the start of its motion and after every step. Error: the simulation fails.
    pub(crate) fn run(
        &self,
        k: usize,
        x: &[f64],
        derived: bool,
        after: &mut dyn FnMut(&Problem, &dyn Snapshot),
    ) -> Result<ExperimentRun, Error> {
        self.experiments[k].run(self.point(x), derived, |work| self.work.add(work), after)
    }

    /// The results of `map` for every experiment and its index, on several threads. The error is that of the first
    /// experiment that has one, whatever the number of threads.
    fn map_experiments<T: Send>(
        &self,
        map: impl Fn(usize, &ObservedExperiment) -> Result<T, Error> + Sync,
    ) -> Result<Vec<T>, Error> {
        match &self.experiments[..] {
            [alone] => Ok(vec![map(0, alone)?]),
            several => {
                // All results are collected before the first error is returned, so that it does
                // not depend on threads.
                let all = several.par_iter().enumerate().map(|(k, own)| map(k, own));
                all.collect::<Vec<_>>().into_iter().collect()
            }
        }
    }

    /// The unknowns paired with the values `x` on their scales.
    fn point<'a>(&'a self, x: &'a [f64]) -> ParameterPoint<'a> {
        ParameterPoint { unknowns: &self.unknowns, x }
    }

    /// For every unknown with a prior: its index, and the residual of the prior at `x`, `(value - mean)/sigma` in the
    /// parameter's unit, with its derivative by this unknown on its scale.
    fn prior_residuals(&self, x: &[f64]) -> impl Iterator<Item = (usize, Dual64)> {
        let seeded = self.unknowns.iter().zip(x).enumerate();
        seeded.filter_map(|(i, (unknown, x))| {
            Some((i, unknown.prior_residual(Dual64::new(*x, 1.0))?))
        })
    }

    /// The evaluation at `x` by simulations of all experiments: residuals without robust loss and leverage weights,
    /// whether steps were halved, and the Jacobian if `with_jacobian`. Error: a simulation fails.
    fn simulate(&self, x: &[f64], with_jacobian: bool) -> Result<Evaluation, Error> {
        let parts = self.map_experiments(|k, _| {
            self.part(k, x, &self.run(k, x, with_jacobian, &mut |_, _| {})?, with_jacobian)
        })?;
        Ok(self.assembled(x, parts, with_jacobian))
    }

    /// The residuals with the evaluation at `x`, Jacobian included, as the last one. It follows from `runs`,
    /// simulations of all experiments with derivatives there, which are not repeated. It panics with fewer runs than
    /// experiments.
    pub(crate) fn with_runs(self, x: &[f64], runs: &[ExperimentRun]) -> Result<Self, Error> {
        let parts = self.map_experiments(|k, _| self.part(k, x, &runs[k], true))?;
        let known = self.assembled(x, parts, true);
        Ok(self.with_evaluation(known))
    }

    /// The residuals `(simulated - measured)/sigma` of experiment `k` from its simulation `run` at `x`, with their
    /// Jacobian if `with_jacobian`, and whether time steps were halved. Errors are those of its residuals.
    fn part(
        &self,
        k: usize,
        x: &[f64],
        run: &ExperimentRun,
        with_jacobian: bool,
    ) -> Result<ExperimentResiduals, Error> {
        let (residuals, jacobian) =
            self.experiments[k].residuals_and_jacobian(run, self.point(x), with_jacobian)?;
        let halved = run.moving.as_ref().is_some_and(has_halved_steps);
        Ok(ExperimentResiduals { residuals, jacobian, halved })
    }

    /// The evaluation at `x` from those of the experiments (`parts`): residuals, and rows of the Jacobian if
    /// `with_jacobian`, in the order of the experiments, then those of the priors. Steps are halved if any part has
    /// halved ones.
    fn assembled(
        &self,
        x: &[f64],
        parts: Vec<ExperimentResiduals>,
        with_jacobian: bool,
    ) -> Evaluation {
        let mut residuals = Vec::with_capacity(self.len());
        let mut rows: Vec<Vec<f64>> = Vec::new();
        let mut halved = false;
        for part in parts {
            halved |= part.halved;
            residuals.extend(part.residuals);
            rows.extend(part.jacobian);
        }
        // A prior is one more measurement of one unknown: its row has a single derivative.
        for (i, prior) in self.prior_residuals(x) {
            residuals.push(prior.re);
            if with_jacobian {
                let mut row = vec![0.0; self.unknowns.len()];
                row[i] = prior.eps;
                rows.push(row);
            }
        }
        let jacobian = with_jacobian.then_some(rows);
        Evaluation { x: x.to_vec(), residuals, jacobian, halved }
    }

    /// The gradient of half the sum of squares (losses, weights and priors included) at `x`, on the unknowns' scales,
    /// by the adjoint of the motions. The residuals there become the last evaluation. `None` if the Jacobian at `x` is
    /// already known, or if the adjoint is [no less costly or not possible](ObservedExperiment::has_adjoint_gradient)
    /// for any experiment.
    fn adjoint_gradient(&self, x: &[f64]) -> Result<Option<Vec<f64>>, Error> {
        self.check_length(x)?;
        let is_known = |e: &Evaluation| e.x == x && e.jacobian.is_some();
        if !self.experiments.iter().all(ObservedExperiment::has_adjoint_gradient)
            || self.last().as_ref().is_some_and(is_known)
        {
            return Ok(None);
        }
        let weights = self.leverage_weights();
        let counts: Vec<usize> = self.experiments.iter().map(|c| c.counts().sum()).collect();
        let parts = self.map_experiments(|k, experiment| {
            // Weights are those of the rows of this experiment.
            let first: usize = counts[..k].iter().sum();
            let weights = &weights[first..first + counts[k]];
            experiment.adjoint_gradient(self.point(x), weights, |work| self.work.add(work))
        })?;
        let (mut residuals, mut gradient) = (Vec::new(), vec![0.0; x.len()]);
        let mut halved = false;
        for part in parts {
            halved |= part.halved;
            residuals.extend(part.residuals);
            gradient.iter_mut().zip(part.gradient).for_each(|(sum, by)| *sum += by);
        }
        for (i, prior) in self.prior_residuals(x) {
            residuals.push(prior.re);
            gradient[i] += prior.re * prior.eps;
        }
        // The residuals are kept: solvers evaluate the cost at the point of a gradient.
        let known = Evaluation { x: x.to_vec(), residuals, jacobian: None, halved };
        *self.last() = Some(known);
        Ok(Some(gradient))
    }
}

impl Operator for Residuals {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    /// The residuals at `x` with robust loss and leverage weights, for argmin's solvers. Error: a simulation fails, or
    /// `x` has another length.
    fn apply(&self, x: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        Ok(self.residuals(x)?)
    }
}

impl Jacobian for Residuals {
    type Param = Vec<f64>;
    type Jacobian = Vec<Vec<f64>>;
    /// The rows of the Jacobian at `x` of the residuals with robust loss and leverage weights, for argmin's solvers.
    /// Error: a simulation fails, or `x` has another length.
    fn jacobian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, argmin::core::Error> {
        Ok(self.jacobian_at(x)?)
    }
}

impl CostFunction for Residuals {
    type Param = Vec<f64>;
    type Output = f64;
    /// Half the sum of squares of the residuals at `x`, with robust loss and leverage weights: the objective of
    /// argmin's solvers. Error: a simulation fails, or `x` has another length.
    fn cost(&self, x: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        Ok(half_sum_of_squares(&self.residuals(x)?))
    }
}

impl Gradient for Residuals {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;
    /// The gradient of the objective at `x` for argmin's solvers, on the unknowns' scales. It is by the adjoint of the
    /// motions where that costs less (`adjoint_gradient`). Else it is `J' r` with the Jacobian and the residuals with
    /// robust loss and leverage weights. Error: a simulation fails, or `x` has another length.
    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        if let Some(gradient) = self.adjoint_gradient(x)? {
            return Ok(gradient);
        }
        // The Jacobian comes first: the residuals of the same evaluation then cost no simulation.
        let rows = self.jacobian_at(x)?;
        let residuals = self.residuals(x)?;
        let component = |j: usize| rows.iter().zip(&residuals).map(|(row, r)| row[j] * r).sum();
        Ok((0..self.unknowns.len()).map(component).collect())
    }
}

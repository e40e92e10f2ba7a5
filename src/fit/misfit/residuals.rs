//! Residuals of a fit and their exact Jacobian, as any solver of argmin can use them.

use crate::dynamics::Snapshot;
use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::loss::Loss;
use crate::fit::misfit::observed_experiment::{ObservedExperiment, Run, in_halves};
use crate::fit::misfit::work::Work;
use crate::fit::unknown::Unknown;
use crate::numerics::half_sum_of_squares;
use crate::numerics::scalar::Scalar;
use crate::problem::Problem;
use crate::scene::Parameter;
use argmin::core::{CostFunction, Gradient, Jacobian, Operator};
use num_dual::Dual64;
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Residuals as a function of the unknowns on their [scales](Unknown::to_scale), logarithms of
/// positive parameters: `(simulated - measured)/sigma` of all values, [robust](Loss::robust) where the
/// loss is robust, and `(value - mean)/sigma` of what is known of the unknowns.
///
/// Implements argmin's `Operator` (the residuals), `Jacobian`, `CostFunction` (half the sum of
/// squares), `Gradient` (of more than six unknowns, where the motion can be gone back over, at the cost of about two runs)
/// and `Hessian` (exact, in second-order dual numbers). A simulation that
/// fails is an error, never a made-up number.
#[derive(Debug)]
pub struct Residuals {
    unknowns: Vec<Unknown>,
    comparisons: Vec<ObservedExperiment>,
    /// Factors on the residuals, where any is not 1.
    leverage_weights: Vec<f64>,
    full_work: f64,
    last: Mutex<Option<Evaluation>>,
    work: Work,
}

/// Residuals, plain, and their Jacobian if it was asked for, at one point.
#[derive(Clone, Debug)]
struct Evaluation {
    x: Vec<f64>,
    residuals: Vec<f64>,
    jacobian: Option<Vec<Vec<f64>>>,
    /// Whether steps were taken in halves.
    halved: bool,
}

impl Residuals {
    /// The residuals of `experiments` up to `horizons`, s, one per experiment. `sigmas` has one per
    /// measurement, in its unit. `full_work` is the work of one full simulation, steps times
    /// segments.
    pub(crate) fn new(
        experiments: &[Experiment],
        sigmas: &[f64],
        unknowns: &[Unknown],
        horizons: &[f64],
        full_work: f64,
    ) -> Result<Self, Error> {
        let mut sigmas = sigmas.iter();
        let pairs = experiments.iter().zip(horizons);
        let compared =
            pairs.map(|(e, horizon)| ObservedExperiment::new(e, unknowns, &mut sigmas, *horizon));
        let comparisons = compared.collect::<Result<_, Error>>()?;
        Ok(Self {
            unknowns: unknowns.to_vec(),
            comparisons,
            leverage_weights: Vec::new(),
            full_work,
            last: Mutex::default(),
            work: Work::default(),
        })
    }

    /// Counts its work, steps times segments, in a shared counter.
    pub(crate) fn counting(self, work: Work) -> Self {
        Self { work, ..self }
    }

    /// Takes the noise of every residual for larger, by the inverse of its weight; none for all
    /// at 1.
    pub(crate) fn with_leverage_weights(self, weights: &[f64]) -> Self {
        Self { leverage_weights: weights.to_vec(), ..self }
    }

    /// Knows plain residuals and their Jacobian at `x` from before.
    pub(crate) fn knowing(
        self,
        x: &[f64],
        (residuals, jacobian): (Vec<f64>, Vec<Vec<f64>>),
        halved: bool,
    ) -> Self {
        let known = Evaluation { x: x.to_vec(), residuals, jacobian: Some(jacobian), halved };
        Self { last: Mutex::new(Some(known)), ..self }
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
        self.work.total() / self.full_work
    }

    /// Number of residuals.
    pub fn len(&self) -> usize {
        self.counts().iter().sum::<usize>() + self.priors()
    }

    /// Whether there are no residuals.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of residuals of each measurement; those of the priors come after them.
    pub(crate) fn counts(&self) -> Vec<usize> {
        self.comparisons.iter().flat_map(ObservedExperiment::counts).collect()
    }

    fn priors(&self) -> usize {
        self.unknowns.iter().filter(|u| u.prior.is_some()).count()
    }

    /// The loss of every residual.
    pub(crate) fn losses(&self) -> Vec<Loss> {
        let mut losses: Vec<Loss> =
            self.comparisons.iter().flat_map(ObservedExperiment::losses).collect();
        losses.resize(self.len(), Loss::Squares);
        losses
    }

    /// The factor on every residual.
    pub(crate) fn leverage_weights(&self) -> Vec<f64> {
        let mut weights = self.leverage_weights.clone();
        weights.resize(self.len(), 1.0);
        weights
    }

    /// Refuses a vector that has not one number per unknown.
    pub(crate) fn check_length(&self, x: &[f64]) -> Result<(), Error> {
        match x.len() == self.unknowns.len() {
            true => Ok(()),
            false => {
                let allowed = format!("{}, one per unknown", self.unknowns.len());
                Err(Error::invalid("x", format!("{} numbers", x.len()), allowed))
            }
        }
    }

    /// Residuals at `x`, which has a number per unknown.
    ///
    /// # Errors
    ///
    /// Another count of numbers, or a simulation that fails.
    pub fn residuals(&self, x: &[f64]) -> Result<Vec<f64>, Error> {
        self.evaluate(x, false, |e| self.made_robust(&e.residuals))
    }

    /// Rows of the Jacobian at `x`: the derivatives of each residual by the unknowns on their scales.
    ///
    /// # Errors
    ///
    /// Another count of numbers, or a simulation that fails.
    pub fn jacobian_at(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        let mut rows = self.plain_jacobian(x)?;
        let made = self.losses().into_iter().zip(self.leverage_weights());
        for ((row, r), (loss, weight)) in rows.iter_mut().zip(self.plain(x)?).zip(made) {
            if loss.is_robust() || weight != 1.0 {
                let [_, slope] = loss.robust(weight * r);
                row.iter_mut().for_each(|d| *d *= slope * weight);
            }
        }
        Ok(rows)
    }

    /// Residuals at `x` as they are without a robust loss.
    pub(crate) fn plain(&self, x: &[f64]) -> Result<Vec<f64>, Error> {
        self.evaluate(x, false, |e| e.residuals.clone())
    }

    /// Rows of the Jacobian at `x` as they are without a robust loss.
    pub(crate) fn plain_jacobian(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        self.evaluate(x, true, |e| e.jacobian.clone().unwrap_or_default())
    }

    /// Whether the last simulation took steps in halves: which ones jumps with the unknowns, and the
    /// misfit with it.
    pub(crate) fn halved(&self) -> bool {
        self.last().as_ref().is_some_and(|e| e.halved)
    }

    fn last(&self) -> MutexGuard<'_, Option<Evaluation>> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn made_robust(&self, residuals: &[f64]) -> Vec<f64> {
        let made = self.losses().into_iter().zip(self.leverage_weights());
        residuals.iter().zip(made).map(|(r, (loss, weight))| loss.robust(weight * r)[0]).collect()
    }

    /// Evaluates unless the last evaluation was at the same point and has what is needed.
    fn evaluate<T>(
        &self,
        x: &[f64],
        with_jacobian: bool,
        read: impl FnOnce(&Evaluation) -> T,
    ) -> Result<T, Error> {
        self.check_length(x)?;
        let usable = |e: &Evaluation| e.x == x && (e.jacobian.is_some() || !with_jacobian);
        let known = self.last().take().filter(usable);
        // Simulations share threads, which may want the lock meanwhile.
        let evaluation = match known {
            Some(evaluation) => evaluation,
            None => self.simulate(x, with_jacobian)?,
        };
        Ok(read(self.last().insert(evaluation)))
    }

    /// The experiments.
    pub(crate) fn comparisons(&self) -> &[ObservedExperiment] {
        &self.comparisons
    }

    /// What every experiment does at `x`.
    pub(crate) fn runs(&self, x: &[f64]) -> Result<Vec<Run>, Error> {
        self.each(|_, own| self.run(own, x, false, &mut |_, _| {}))
    }

    /// What experiment `k` does at `x`; `after` sees its motion at the start and after every step.
    pub(crate) fn run_seen(
        &self,
        k: usize,
        x: &[f64],
        after: &mut dyn FnMut(&Problem, &dyn Snapshot),
    ) -> Result<Run, Error> {
        self.run(&self.comparisons[k], x, false, after)
    }

    /// What `of` makes of every experiment. Threads share them; the first error is that of the first
    /// experiment that has one, however many threads there are.
    fn each<T: Send>(
        &self,
        of: impl Fn(usize, &ObservedExperiment) -> Result<T, Error> + Sync,
    ) -> Result<Vec<T>, Error> {
        match &self.comparisons[..] {
            [alone] => Ok(vec![of(0, alone)?]),
            several => {
                let all = several.par_iter().enumerate().map(|(k, own)| of(k, own));
                all.collect::<Vec<_>>().into_iter().collect()
            }
        }
    }

    fn run(
        &self,
        comparison: &ObservedExperiment,
        x: &[f64],
        derived: bool,
        after: &mut dyn FnMut(&Problem, &dyn Snapshot),
    ) -> Result<Run, Error> {
        comparison.run((&self.unknowns, x), derived, |work| self.work.add(work), after)
    }

    fn simulate(&self, x: &[f64], with_jacobian: bool) -> Result<Evaluation, Error> {
        let compared = self.each(|_, comparison| {
            let run = self.run(comparison, x, with_jacobian, &mut |_, _| {})?;
            let (own, by) = comparison.compare(&run, (&self.unknowns, x), with_jacobian)?;
            Ok((own, by, run.moving.as_ref().is_some_and(in_halves)))
        })?;
        let mut residuals = Vec::with_capacity(self.len());
        let mut rows: Vec<Vec<f64>> = Vec::new();
        let mut halved = false;
        for (own, by, in_halves) in compared {
            halved |= in_halves;
            residuals.extend(own);
            rows.extend(by);
        }
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let Some(prior_residual) = unknown.prior_residual(Dual64::new(x[i], 1.0)) else {
                continue;
            };
            residuals.push(prior_residual.value());
            if with_jacobian {
                let mut row = vec![0.0; self.unknowns.len()];
                row[i] = prior_residual.eps;
                rows.push(row);
            }
        }
        let jacobian = with_jacobian.then_some(rows);
        Ok(Evaluation { x: x.to_vec(), residuals, jacobian, halved })
    }
}

impl Residuals {
    /// Half the sum of the squares' gradient by many unknowns at once, where that is cheaper than the Jacobian and the
    /// Jacobian is not known.
    fn gradient_back(&self, x: &[f64]) -> Result<Option<Vec<f64>>, Error> {
        self.check_length(x)?;
        let is_known = |e: &Evaluation| e.x == x && e.jacobian.is_some();
        if !self.comparisons.iter().all(ObservedExperiment::goes_back)
            || self.last().as_ref().is_some_and(is_known)
        {
            return Ok(None);
        }
        let weights = self.leverage_weights();
        let counts: Vec<usize> = self.comparisons.iter().map(|c| c.counts().sum()).collect();
        let parts = self.each(|k, comparison| {
            let first: usize = counts[..k].iter().sum();
            let weights = &weights[first..first + counts[k]];
            comparison.reverse_gradient((&self.unknowns, x), weights, |work| self.work.add(work))
        })?;
        let (mut residuals, mut gradient) = (Vec::new(), vec![0.0; x.len()]);
        let mut halved = false;
        for (own, by, in_halves) in parts {
            halved |= in_halves;
            residuals.extend(own);
            gradient.iter_mut().zip(by).for_each(|(sum, by)| *sum += by);
        }
        for (i, unknown) in self.unknowns.iter().enumerate() {
            if let Some(prior) = unknown.prior_residual(Dual64::new(x[i], 1.0)) {
                residuals.push(prior.re);
                gradient[i] += prior.re * prior.eps;
            }
        }
        let known = Evaluation { x: x.to_vec(), residuals, jacobian: None, halved };
        *self.last() = Some(known);
        Ok(Some(gradient))
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
        Ok(half_sum_of_squares(&self.residuals(x)?))
    }
}

impl Gradient for Residuals {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;
    fn gradient(&self, x: &Vec<f64>) -> Result<Vec<f64>, argmin::core::Error> {
        if let Some(gradient) = self.gradient_back(x)? {
            return Ok(gradient);
        }
        let rows = self.jacobian_at(x)?;
        let residuals = self.residuals(x)?;
        let component = |j: usize| rows.iter().zip(&residuals).map(|(row, r)| row[j] * r).sum();
        Ok((0..self.unknowns.len()).map(component).collect())
    }
}

//! One run of the optimiser, and where it ended.

use crate::error::Error;
use crate::fit::measurement::loss::Loss;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::misfit::work::Work;
use crate::fit::search::journal::{Journal, Stage, Visit};
use crate::fit::search::local_minima::LocalMinima;
use crate::fit::search::{Progress, Search};
use crate::fit::uncertainty::analysis::TOLERANCE;
use crate::fit::unknown::Unknown;
use crate::numerics::levenberg_marquardt::{LeastSquaresState, LevenbergMarquardt};
use argmin::core::observers::{Observe, ObserverMode};
use argmin::core::{Executor, KV, State, TerminationReason};
use std::sync::Arc;

/// A factor of a hundred is as far as the data at one value tell about another.
const LONGEST_LOG_STEP: f64 = 4.6;
/// Part of a standard error below which the last step is taken without another simulation.
const LAST_STEP: f64 = 0.05;
/// Steps in a row that gain next to nothing after which a fit ends whose objective is rough: of a cable whose parts
/// slip on each other, or of a minimum that is compared with another.
const PATIENCE: usize = 3;

/// Where an optimisation ended.
#[derive(Clone, Debug)]
pub(crate) struct Optimum {
    pub x: Vec<f64>,
    /// Half the sum of the losses.
    pub cost: f64,
    /// Residuals of all measurements and then of the priors, plain, without a robust loss.
    pub residuals: Vec<f64>,
    /// Derivatives of those residuals by the unknowns on their scales.
    pub jacobian: Vec<Vec<f64>>,
    /// Residuals of each measurement.
    pub counts: Vec<usize>,
    pub converged: bool,
    pub status: String,
    /// Whether time steps were taken in halves at the end.
    pub halved: bool,
}

impl Search<'_> {
    /// Fits the full model to the whole record.
    pub fn polish(&self, start: &[f64]) -> Result<Optimum, Error> {
        self.finish(self.all_residuals()?, start)
    }

    /// Fits the full model again, from an optimum that had the sigmas `before`: what it does there is
    /// known, in other units.
    pub fn polish_reweighted(&self, known: &Optimum, before: &[f64]) -> Result<Optimum, Error> {
        let units = before.iter().zip(&self.sigmas).zip(&known.counts);
        let mut units: Vec<f64> = units
            .flat_map(|((before, now), count)| std::iter::repeat_n(before / now, *count))
            .collect();
        units.resize(known.residuals.len(), 1.0);
        let residuals = known.residuals.iter().zip(&units).map(|(r, unit)| r * unit).collect();
        let row = |(row, unit): (&Vec<f64>, &f64)| row.iter().map(|d| d * unit).collect();
        let jacobian = known.jacobian.iter().zip(&units).map(row).collect();
        self.polish_knowing(&known.x, (residuals, jacobian), known.halved)
    }

    /// Fits the full model to the whole record from where its plain residuals and their Jacobian are known.
    pub fn polish_knowing(
        &self,
        start: &[f64],
        there: (Vec<f64>, Vec<Vec<f64>>),
        halved: bool,
    ) -> Result<Optimum, Error> {
        self.finish(self.all_residuals()?.knowing(start, there, halved), start)
    }

    fn finish(&self, residuals: Residuals, start: &[f64]) -> Result<Optimum, Error> {
        let tolerances = (1e-10, self.tolerance, 60);
        let mut optimum = self.optimize(residuals, start, tolerances, Some(Stage::Full))?;
        // What leaves nothing but rounding errors has nothing to gain from another step.
        optimum.converged |= self.is_rounding(&optimum);
        Ok(optimum)
    }

    /// Fits `residuals` with these tolerances of step and noise and this many iterations, and notes
    /// each of them as of this stage.
    pub fn optimize(
        &self,
        residuals: Residuals,
        start: &[f64],
        (step_tolerance, noise_tolerance, iterations): (f64, f64, u64),
        stage: Option<Stage>,
    ) -> Result<Optimum, Error> {
        let (counts, losses) = (residuals.counts(), residuals.losses());
        let weights = residuals.leverage_weights();
        let bounds = self.unknowns.iter().map(Unknown::scaled_bounds).collect();
        let longest = |u: &Unknown| match u.parameter.is_positive() {
            true => LONGEST_LOG_STEP,
            false => f64::INFINITY,
        };
        let solver = LevenbergMarquardt::new(bounds)
            .longest_steps(self.unknowns.iter().map(longest).collect())
            .step_tolerance(step_tolerance)
            .noise_tolerance(noise_tolerance)
            .last_step(LAST_STEP * (self.tolerance / TOLERANCE).min(1.0))
            .patience(if self.is_displacement_driven() || self.ends_crawling {
                PATIENCE
            } else {
                usize::MAX
            });
        let observer = Observer {
            progress: self.progress.clone(),
            work: self.work.clone(),
            full_work: self.full_work,
            journal: self.journal.clone(),
            stage,
            counts: counts.clone(),
            losses: losses.clone(),
            leverage_weights: weights.clone(),
        };
        let executor = Executor::new(residuals, solver)
            .configure(|state| state.param(start.to_vec()).max_iters(iterations))
            .add_observer(observer, ObserverMode::Always);
        let mut result = executor.run().map_err(|error| match error.downcast::<Error>() {
            Ok(error) => error,
            Err(error) => Error::Fit(error.to_string()),
        })?;
        let halved = result.problem.take_problem().is_some_and(|residuals| residuals.halved());
        let lost = || Error::Fit("the optimiser lost its state".into());
        let state: &mut LeastSquaresState = &mut result.state;
        let reason = state.get_termination_reason().cloned();
        let cost = state.get_cost();
        let mut residuals = state.take_residuals().ok_or_else(lost)?;
        let mut jacobian = state.take_jacobian().ok_or_else(lost)?;
        let made = losses.into_iter().zip(weights);
        for ((r, row), (loss, weight)) in residuals.iter_mut().zip(&mut jacobian).zip(made) {
            if loss.is_robust() || weight != 1.0 {
                let weighed = loss.plain(*r);
                let [_, slope] = loss.robust(weighed);
                *r = weighed / weight;
                row.iter_mut().for_each(|d| *d /= slope * weight);
            }
        }
        Ok(Optimum {
            x: state.take_param().or_else(|| state.take_best_param()).ok_or_else(lost)?,
            cost,
            residuals,
            jacobian,
            counts,
            converged: reason == Some(TerminationReason::SolverConverged),
            status: reason.map_or("not terminated".into(), |reason| reason.text().to_string()),
            halved,
        })
    }

    /// The minima of the misfit that were seen, of which `chosen` was taken.
    pub fn local_minima(&self, chosen: Option<&Optimum>) -> LocalMinima {
        let chosen = chosen.map(|optimum| self.minimum(optimum));
        self.journal.local_minima(self.unknowns, &self.sigmas, chosen.as_ref())
    }
}

/// Passes the optimiser's iterations on.
struct Observer {
    progress: Option<Progress>,
    work: Work,
    full_work: f64,
    journal: Arc<Journal>,
    /// None: not worth noting.
    stage: Option<Stage>,
    counts: Vec<usize>,
    losses: Vec<Loss>,
    leverage_weights: Vec<f64>,
}

impl Observer {
    fn note(&self, state: &LeastSquaresState) {
        if let (Some(stage), Some(x), Some(robust)) =
            (self.stage, state.get_param(), state.get_residuals())
        {
            let made = self.losses.iter().zip(&self.leverage_weights);
            let residuals =
                robust.iter().zip(made).map(|(r, (loss, weight))| loss.plain(*r) / weight);
            let visit = Visit {
                stage,
                x: x.clone(),
                cost: state.get_cost(),
                residuals: residuals.collect(),
                counts: self.counts.clone(),
            };
            self.journal.visit(visit, self.work.total());
        }
    }
}

impl Observe<LeastSquaresState> for Observer {
    fn observe_init(
        &mut self,
        _: &str,
        state: &LeastSquaresState,
        _: &KV,
    ) -> Result<(), argmin::core::Error> {
        self.note(state);
        Ok(())
    }

    fn observe_iter(
        &mut self,
        state: &LeastSquaresState,
        _: &KV,
    ) -> Result<(), argmin::core::Error> {
        self.note(state);
        if let Some(progress) = &self.progress {
            let (iteration, misfit) = (state.get_iter() + 1, state.get_cost());
            let stage = format!("iteration {iteration}, misfit {misfit:.6e}");
            progress(&stage, self.work.total() / self.full_work);
        }
        Ok(())
    }
}

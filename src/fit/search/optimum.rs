//! Runs of the Levenberg-Marquardt optimizer, and the optimum at which a run ends.
//!
//! Input: residuals as functions of the unknowns, and a start on the unknowns' scales (moved to the nearest bound). A
//! run converges by [`Tolerances`]: a small Gauss-Newton step, or a change of the linear model by it below a fraction
//! of the residuals' standard deviation. Runs of rods with recorded ends, and of the comparison of minima, also
//! converge after [`PATIENCE`] steps that hardly lower the objective. The largest number of iterations, and a point
//! from which no step lowers the objective, end a run without convergence. Bounds and the length of logarithmic steps
//! ([`LONGEST_LOG_STEP`]) limit each step. A last step below [`LAST_STEP`] standard errors is taken without a
//! simulation: residuals and cost are then those of the linear model, and the Jacobian is that of the iterate before.
//! Output: [`Optimum`] with the point, the cost (half the sum of the losses), residuals and Jacobian (robust loss and
//! leverage weights inverted), and the reason of the end. A start that cannot be simulated is an error, and so are a
//! failure of the last trial of a run that finds no lower objective, and an interruption. `optimize` is one run.
//! `polish` fits the full model to the whole records; `polish_from_runs`, `polish_reweighted` and `polish_from` do so
//! from a start that is simulated already. Iterates of a run with a stage enter the journal of the search.
//! `into_evaluation` converts an optimum to a start that is not simulated again.

use crate::error::Error;
use crate::fit::measurement::loss::WeightedLoss;
use crate::fit::misfit::observed_experiment::ExperimentRun;
use crate::fit::misfit::residuals::{Evaluation, Residuals};
use crate::fit::misfit::work::WorkCounter;
use crate::fit::search::journal::{Journal, SearchStage, Visit};
use crate::fit::search::local_minima::LocalMinima;
use crate::fit::search::{Progress, Search};
use crate::fit::uncertainty::analysis::TOLERANCE;
use crate::fit::unknown::Unknown;
use crate::numerics::levenberg_marquardt::{LeastSquaresState, LevenbergMarquardt};
use argmin::core::observers::{Observe, ObserverMode};
use argmin::core::{Executor, KV, State, TerminationReason};
use std::sync::Arc;

/// Largest step of a logarithm: a factor of a hundred. The linear model does not hold over larger factors.
const LONGEST_LOG_STEP: f64 = 4.6;
/// Size of the last step, in standard errors, below which it is taken without another simulation. A larger one saves
/// simulations and leaves a larger error of the linear model.
const LAST_STEP: f64 = 0.05;
/// Number of consecutive steps that hardly lower a rough objective, after which a fit ends. The objective of a cable
/// whose parts slip on each other is rough.
const PATIENCE: usize = 3;
/// Gauss-Newton step, on the unknowns' scales, at which a fit of the full model to the whole records ends.
const FULL_STEP: f64 = 1e-10;
/// Largest number of iterations of a fit of the full model to the whole records.
const FULL_ITERATIONS: u64 = 60;
/// Error message of a fit none of whose starts led to an optimum.
pub(crate) const NO_START: &str =
    "no start value for the fit was found. Give a start or bounds for each parameter";

/// Stopping criteria of a run of the optimizer.
#[derive(Clone, Copy)]
pub(crate) struct Tolerances {
    /// Largest Gauss-Newton step that ends it, on the scales of the unknowns.
    pub step: f64,
    /// Change of the linear model by the Gauss-Newton step that ends it, over the standard deviation of the residuals.
    pub noise: f64,
    /// Largest number of iterations.
    pub iterations: u64,
}

/// The point where a run of the optimizer ended, with residuals and Jacobian there.
#[derive(Clone, Debug, Default)]
pub(crate) struct Optimum {
    /// The unknowns on their scales.
    pub x: Vec<f64>,
    /// Half the sum of the losses.
    pub cost: f64,
    /// Plain residuals of all measurements and then of the priors, without robust loss and leverage weights.
    pub residuals: Vec<f64>,
    /// Derivatives of those residuals by the unknowns on their scales.
    pub jacobian: Vec<Vec<f64>>,
    /// Number of residuals of each measurement.
    pub counts: Vec<usize>,
    pub converged: bool,
    /// Reason of the end, as text.
    pub status: String,
    /// Whether any time step was halved at this point.
    pub halved: bool,
}

impl Optimum {
    /// The point with its residuals and its Jacobian, as the start of another run, which does not simulate it again.
    pub fn into_evaluation(self) -> Evaluation {
        let Self { x, residuals, jacobian, halved, .. } = self;
        Evaluation { x, residuals, jacobian: Some(jacobian), halved }
    }
}

impl Search<'_> {
    /// Fits the full model to the whole records by the Levenberg-Marquardt method from the point `start`, on the
    /// unknowns' scales. Sigmas and leverage weights are those of the search. Iterates enter the journal. An error if
    /// the start cannot be simulated, no step lowers the objective and the last trial fails, or the user stops.
    pub fn polish(&self, start: &[f64]) -> Result<Optimum, Error> {
        self.finish(self.all_residuals()?, start)
    }

    /// Fits the full model to the whole records by the Levenberg-Marquardt method from the point `start`, on the
    /// unknowns' scales. `runs` are the simulations of all experiments with derivatives there, so that it is not
    /// simulated again. Errors as of [`polish`](Self::polish).
    pub fn polish_from_runs(
        &self,
        start: &[f64],
        runs: &[ExperimentRun],
    ) -> Result<Optimum, Error> {
        self.finish(self.all_residuals()?.with_runs(start, runs)?, start)
    }

    /// Fits the full model to the whole records from the optimum `known`, found with the sigmas `before`. Its residuals
    /// and Jacobian are converted to the present sigmas by the factor old over new sigma, instead of being simulated
    /// again; those of priors stay. Errors as of [`polish`](Self::polish).
    pub fn polish_reweighted(&self, known: &Optimum, before: &[f64]) -> Result<Optimum, Error> {
        // Residuals and derivatives are proportional to the inverse of their sigma; those of priors stay.
        let units = before.iter().zip(&self.sigmas).zip(&known.counts);
        let units = units.flat_map(|((old, new), count)| std::iter::repeat_n(old / new, *count));
        let mut start = known.clone();
        for ((r, row), unit) in start.residuals.iter_mut().zip(&mut start.jacobian).zip(units) {
            *r *= unit;
            row.iter_mut().for_each(|d| *d *= unit);
        }
        self.polish_from(start.into_evaluation())
    }

    /// Fits the full model to the whole records by the Levenberg-Marquardt method from the evaluation `start`, which is
    /// not simulated again. It is a point on the unknowns' scales, with residuals and Jacobian without robust loss and
    /// leverage weights. Errors as of [`polish`](Self::polish).
    pub fn polish_from(&self, start: Evaluation) -> Result<Optimum, Error> {
        let x = start.x.clone();
        self.finish(self.all_residuals()?.with_evaluation(start), &x)
    }

    /// Fits the `residuals` of the whole records from `start`, with the tolerances [`FULL_STEP`], [`FULL_ITERATIONS`]
    /// and the search's own. Iterates enter the journal as of the full model. An optimum with residuals at rounding
    /// level ([`Search::is_rounding`]) counts as converged.
    fn finish(&self, residuals: Residuals, start: &[f64]) -> Result<Optimum, Error> {
        let tolerances =
            Tolerances { step: FULL_STEP, noise: self.tolerance, iterations: FULL_ITERATIONS };
        let mut optimum = self.optimize(residuals, start, tolerances, Some(SearchStage::Full))?;
        // Without noise the convergence criteria of the optimizer are below the rounding errors of the cost.
        optimum.converged |= self.is_rounding(&optimum);
        Ok(optimum)
    }

    /// Minimizes half the sum of squares of `residuals` (robust losses and weights applied) from the point `start`,
    /// within the unknowns' bounds, by the Levenberg-Marquardt method. Iterates enter the journal as of `stage`, or not
    /// at all without one. The optimum has residuals and Jacobian without losses and weights, and `converged` only if a
    /// convergence criterion ended the run. A last step below [`LAST_STEP`] standard errors (less for a smaller search
    /// tolerance) is taken without another simulation. A start outside of the bounds begins at the nearest bound. The
    /// other rules are those of the module's header. An error if the start cannot be simulated, no step lowers the
    /// objective and the last trial fails, or the user stops.
    pub fn optimize(
        &self,
        residuals: Residuals,
        start: &[f64],
        tolerances: Tolerances,
        stage: Option<SearchStage>,
    ) -> Result<Optimum, Error> {
        // Counts and losses before the optimizer takes the residuals.
        let (counts, losses) = (residuals.counts(), residuals.weighted_losses());
        let bounds = self.unknowns.iter().map(Unknown::scaled_bounds).collect();
        let longest = |u: &Unknown| match u.parameter.is_positive() {
            true => LONGEST_LOG_STEP,
            false => f64::INFINITY,
        };
        // Steps of logarithms are limited, because the linear model does not hold over large factors.
        let solver = LevenbergMarquardt::new(bounds)
            .longest_steps(self.unknowns.iter().map(longest).collect())
            .step_tolerance(tolerances.step)
            .noise_tolerance(tolerances.noise)
            .last_step(LAST_STEP * (self.tolerance / TOLERANCE).min(1.0))
            // Objectives of driven rods have corners, at which no step tolerance is reached.
            .patience(match self.is_displacement_driven() || self.ends_without_progress {
                true => PATIENCE,
                false => usize::MAX,
            });
        let observer = Observer {
            progress: self.progress.clone(),
            work: self.work.clone(),
            full_work: self.full_work,
            journal: self.journal.clone(),
            stage,
            counts: counts.clone(),
            losses: losses.clone(),
        };
        let executor = Executor::new(residuals, solver)
            .configure(|state| state.param(start.to_vec()).max_iters(tolerances.iterations))
            .add_observer(observer, ObserverMode::Always);
        // The error of a simulation comes back through argmin as its own type.
        let mut result = executor.run().map_err(|error| match error.downcast::<Error>() {
            Ok(error) => error,
            Err(error) => Error::Fit(error.to_string()),
        })?;
        // The residuals of the last iterate are those of the result, with its halved steps.
        let halved = result.problem.take_problem().is_some_and(|r| r.has_halved_steps());
        let lost = || Error::Fit("the optimizer returned no state".into());
        let state: &mut LeastSquaresState = &mut result.state;
        let reason = state.get_termination_reason().cloned();
        let cost = state.get_cost();
        let mut residuals = state.take_residuals().ok_or_else(lost)?;
        let mut jacobian = state.take_jacobian().ok_or_else(lost)?;
        // The analyses of the optimum need plain residuals: the robust loss is inverted.
        for ((r, row), loss) in residuals.iter_mut().zip(&mut jacobian).zip(losses) {
            *r = loss.plain(*r);
            let [_, slope] = loss.robust(*r);
            row.iter_mut().for_each(|d| *d /= slope);
        }
        Ok(Optimum {
            x: state.take_param().or_else(|| state.take_best_param()).ok_or_else(lost)?,
            cost,
            residuals,
            jacobian,
            counts,
            // Every other reason is an exhausted number of iterations, an interruption, or no
            // step that lowers the cost.
            converged: reason == Some(TerminationReason::SolverConverged),
            status: reason.map_or("not terminated".into(), |reason| reason.text().to_string()),
            halved,
        })
    }

    /// The report of the local minima in the journal, with misfits of the full model in units of the present sigmas.
    /// `chosen` is the result; `None` after an interruption, and then no minimum is marked as chosen.
    pub fn local_minima(&self, chosen: Option<&Optimum>) -> LocalMinima {
        let chosen = chosen.map(|optimum| self.minimum(optimum));
        self.journal.local_minima(self.unknowns, &self.sigmas, chosen.as_ref())
    }
}

/// Records the iterates of the optimizer in the journal, and reports the progress.
struct Observer {
    progress: Option<Progress>,
    work: WorkCounter,
    full_work: f64,
    journal: Arc<Journal>,
    /// The stage of the iterates; none if they are not recorded.
    stage: Option<SearchStage>,
    counts: Vec<usize>,
    losses: Vec<WeightedLoss>,
}

impl Observer {
    /// Adds the iterate of an optimizer `state` to the journal, with robust loss and leverage weight of its residuals
    /// inverted, and the work so far; nothing without a stage.
    fn record(&self, state: &LeastSquaresState) {
        if let (Some(stage), Some(x), Some(robust)) =
            (self.stage, state.get_param(), state.get_residuals())
        {
            let residuals = robust.iter().zip(&self.losses).map(|(r, loss)| loss.plain(*r));
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
    /// Records the start point of the run in the journal, as of the observer's stage.
    fn observe_init(
        &mut self,
        _: &str,
        state: &LeastSquaresState,
        _: &KV,
    ) -> Result<(), argmin::core::Error> {
        self.record(state);
        Ok(())
    }

    /// Records an iterate in the journal, and calls the progress callback with iteration number and misfit (as text)
    /// and the work so far in full simulations. Always `Ok`.
    fn observe_iter(
        &mut self,
        state: &LeastSquaresState,
        _: &KV,
    ) -> Result<(), argmin::core::Error> {
        self.record(state);
        if let Some(progress) = &self.progress {
            let (iteration, misfit) = (state.get_iter() + 1, state.get_cost());
            let stage = format!("iteration {iteration}, misfit {misfit:.6e}");
            progress(&stage, self.work.total() / self.full_work);
        }
        Ok(())
    }
}

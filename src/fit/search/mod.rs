//! The search for the optimum of a fit.
//!
//! [`Search`] is the state that all stages share: the experiments with the standard deviations (sigmas, in the unit of
//! each) of their measurements, the unknowns, the counter of the work and the journal of evaluated points. The stages
//! are:
//!
//! - a scan of a coarse model over a grid of values (`scan`, `grid`, `coarse`);
//! - descents from its best points over growing parts of the records (`starts`);
//! - Levenberg-Marquardt fits of the full model to the whole records (`optimum`);
//! - estimation of sigmas that are not given (`weighted_search`, the entry point);
//! - comparison with other minima on the final mesh (`minimum_comparison`).
//!
//! Rods with recorded ends have their own search (`displacement_driven`). `data_precheck` examines the data before
//! the search. `residual_acceptance` decides whether it continues, `neighbors` returns further starts, `damping`
//! raises dampings near zero, and `sensitivity_growth` has weights for chaotic motions. `fitted` is the input of the
//! analyses; `minimum` and `local_minima` are the records of minima and their report. Output: an optimum on the
//! unknowns' scales, which are natural logarithms of positive parameters and values of others. A measured motion in a
//! scene without time, a stop by the user, and a search in which no start leads to an optimum are errors.
//!
//! Methods of [`Search`] here are common to the stages. `residuals` and `all_residuals` are functions of the unknowns
//! up to given times (horizons) and over the whole records. `first_periods` and `durations` are such times, s, of each
//! experiment. `detached` copies a search for a thread, and `with_experiments` continues it on other meshes. `new`
//! starts with the given sigmas, or preliminary ones, and no leverage weights.

pub(crate) mod coarse;
pub(crate) mod damping;
pub(crate) mod data_precheck;
pub(crate) mod displacement_driven;
pub(crate) mod fitted;
pub(crate) mod grid;
pub(crate) mod journal;
pub(crate) mod local_minima;
pub(crate) mod minimum;
pub(crate) mod minimum_comparison;
pub(crate) mod neighbors;
pub(crate) mod optimum;
pub(crate) mod residual_acceptance;
pub(crate) mod scan;
pub(crate) mod sensitivity_growth;
pub(crate) mod starts;
pub(crate) mod weighted_search;

use crate::error::Error;
use crate::fit::measurement::experiment::{Experiment, full_work};
use crate::fit::measurement::motion::PointMotion;
use crate::fit::misfit::initial_sigmas::first_sigmas;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::misfit::work::WorkCounter;
use crate::fit::search::journal::{Journal, Visit};
use crate::fit::unknown::Unknown;
use std::sync::Arc;

/// Receives the stage of a fit, and its work so far in full simulations.
pub type Progress = Arc<dyn Fn(&str, f64) + Send + Sync>;

/// Smallest number of samples in the first horizon, the time up to which a search first fits the records. Fewer may not
/// determine the unknowns.
const FIRST_SAMPLES: usize = 8;
/// Additional samples in the first horizon for each unknown. More lengthen the first horizon, over which the misfit
/// should have few minima.
const FIRST_SAMPLES_PER_UNKNOWN: usize = 4;

/// State of a search that all its stages share: problem, weights, counters and journal.
#[derive(Clone)]
pub(crate) struct Search<'a> {
    pub experiments: &'a [Experiment],
    /// Standard deviation of each measurement, in its unit.
    pub sigmas: Vec<f64>,
    /// Leverage weights: factors on all residuals of the whole records, below 1 at a [high
    /// leverage](displacement_driven) and where [sensitivities grow exponentially](sensitivity_growth); empty where all
    /// are 1.
    pub leverage_weights: Vec<f64>,
    pub unknowns: &'a [Unknown],
    /// Work of one full simulation, steps times segments.
    pub full_work: f64,
    pub work: WorkCounter,
    pub progress: Option<Progress>,
    /// Evaluated points and minima.
    pub journal: Arc<Journal>,
    /// Whether the data precheck found a likely error of the setup: no finer scan is worth its cost.
    pub suspicious: bool,
    /// Whether the search ends at the first optimum that explains most of the motion, because mesh and step are still
    /// too coarse for residuals at the level of the noise.
    pub stops_at_first_fit: bool,
    /// Tolerance of the minimum, in standard errors.
    pub tolerance: f64,
    /// Number of the mesh and the steps. Objectives are comparable where it is the same.
    pub numerics: usize,
    /// Whether the optimizer converges after several steps that hardly lower the objective.
    pub ends_without_progress: bool,
}

impl<'a> Search<'a> {
    /// A search before its first evaluation, with the given sigmas, or preliminary ones by [`first_sigmas`], and no
    /// leverage weights. `tolerance` is that of the minimum, in standard errors, and `progress` a callback that
    /// receives the stage and the work. An error if a motion was measured and its scene has no time.
    pub fn new(
        experiments: &'a [Experiment],
        unknowns: &'a [Unknown],
        progress: Option<Progress>,
        tolerance: f64,
    ) -> Result<Self, Error> {
        Ok(Self {
            experiments,
            // Given sigmas, or preliminary ones until the residuals of an optimum estimate them.
            sigmas: first_sigmas(experiments),
            leverage_weights: Vec::new(),
            unknowns,
            full_work: full_work(experiments)?,
            work: WorkCounter::default(),
            progress,
            journal: Arc::default(),
            suspicious: false,
            stops_at_first_fit: false,
            tolerance,
            numerics: 0,
            ends_without_progress: false,
        })
    }

    /// A copy of the search with the same experiments, unknowns, sigmas, leverage weights and tolerance. Its counter of
    /// the work is zero and its journal empty, both its own; `numerics` is 0. It has no progress callback, no
    /// suspicion, and stops neither at the first fit nor where the objective hardly changes. Several threads run such
    /// searches at the same time, and the caller adds their work.
    pub fn detached(&self) -> Self {
        Self {
            // The caller adds the work of threads in a fixed order, and decides which points enter the journal.
            work: WorkCounter::default(),
            progress: None,
            journal: Arc::default(),
            suspicious: false,
            stops_at_first_fit: false,
            numerics: 0,
            ends_without_progress: false,
            ..self.clone()
        }
    }

    /// The search continued with the same experiments on other meshes or with other steps. The journal counts a new
    /// number of mesh and steps for it. Journal and work counter are shared with this search; sigmas, leverage weights
    /// and tolerance are copied. It does not stop at the first fit. An error if a motion was measured and its scene has
    /// no time.
    pub fn with_experiments<'b>(&self, experiments: &'b [Experiment]) -> Result<Search<'b>, Error>
    where
        'a: 'b,
    {
        Ok(Search {
            experiments,
            full_work: full_work(experiments)?,
            stops_at_first_fit: false,
            // Objectives on other meshes are not comparable: the journal keeps them apart.
            numerics: self.journal.add_numerics(),
            ..self.clone()
        })
    }

    /// Work so far (steps times segments of all simulations) over that of one full simulation of all experiments on the
    /// present mesh: a number of simulations.
    pub fn simulations(&self) -> f64 {
        self.work.total() / self.full_work
    }

    /// The time of the last sample of each experiment's recorded motions and timed gauges, s, in their order; zero for
    /// an experiment without any.
    pub fn durations(&self) -> Vec<f64> {
        self.experiments.iter().map(Experiment::duration).collect()
    }

    /// About the first period of every experiment times `stretch`, s: twice the shortest rise time of its records
    /// (motions and gauges over time) times `stretch`. It is at least the earliest time of the sample with index
    /// [`FIRST_SAMPLES`] plus [`FIRST_SAMPLES_PER_UNKNOWN`] per unknown, and at most the duration. Records with fewer
    /// samples do not count for this; if all have fewer, it is the duration. Zero without records.
    pub fn first_periods(&self, stretch: f64) -> Vec<f64> {
        let enough = FIRST_SAMPLES + FIRST_SAMPLES_PER_UNKNOWN * self.unknowns.len();
        // Fewer samples than these may not determine all unknowns.
        let wait = |o: &PointMotion| o.samples.get(enough).map_or(f64::MAX, |s| s.time);
        let first = |experiment: &Experiment| {
            // Twice the rise of the fastest record is about its first period.
            let rise = experiment.rise_time().unwrap_or(f64::MAX);
            let sampled = experiment.records().map(|o| wait(&o)).fold(f64::MAX, f64::min);
            (2.0 * rise * stretch).max(sampled).min(experiment.duration())
        };
        self.experiments.iter().map(first).collect()
    }

    /// Calls the progress callback, if there is one, with the name of the `stage` and the work so far, in full
    /// simulations.
    pub fn report(&self, stage: &str) {
        if let Some(progress) = &self.progress {
            progress(stage, self.simulations());
        }
    }

    /// Whether the stop flag of any experiment is set: the user stopped the fit.
    pub fn is_stopped(&self) -> bool {
        self.experiments.iter().any(|e| e.problem.is_stopped())
    }

    /// Adds an evaluated point (stage, values, residuals) to the journal, with the work so far.
    pub fn record_visit(&self, visit: Visit) {
        self.journal.visit(visit, self.work.total());
    }

    /// The residuals of the whole records, as functions of the unknowns on their scales, with robust losses and the
    /// leverage weights of the search. Their evaluations add to the work of this search. An error for a measured point
    /// that is not on the rod.
    pub fn all_residuals(&self) -> Result<Residuals, Error> {
        Ok(self.residuals(&self.durations())?.with_leverage_weights(&self.leverage_weights))
    }

    /// The residuals of the records up to `horizons`, s, one per experiment, as functions of the unknowns on their
    /// scales, with robust losses, without leverage weights. Shapes, frequencies and readings at rest are complete at
    /// any horizon. Their evaluations add to the work of this search. An error for a measured point that is not on the
    /// rod.
    pub fn residuals(&self, horizons: &[f64]) -> Result<Residuals, Error> {
        let (sigmas, unknowns) = (&self.sigmas, self.unknowns);
        let residuals =
            Residuals::new(self.experiments, sigmas, unknowns, horizons, self.full_work)?;
        Ok(residuals.with_work_counter(self.work.clone()))
    }
}

//! What every stage of a search works with: the problem with its weights, and the counters and
//! listeners that all stages share.

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
use crate::fit::misfit::work::Work;
use crate::fit::search::journal::{Journal, Visit};
use crate::fit::unknown::Unknown;
use std::sync::Arc;

/// Told what the search does: stage, and how many simulations' worth of work is done.
pub type Progress = Arc<dyn Fn(&str, f64) + Send + Sync>;

/// What every stage needs.
#[derive(Clone)]
pub(crate) struct Search<'a> {
    pub experiments: &'a [Experiment],
    /// One per measurement, in its unit.
    pub sigmas: Vec<f64>,
    /// Leverage weights: factors on all residuals of the whole records, below 1 where a value [runs away](led) or
    /// [sensitivities grow exponentially](sensitivity_growth); empty where all are 1.
    pub leverage_weights: Vec<f64>,
    pub unknowns: &'a [Unknown],
    /// Work of one full simulation, steps times segments.
    pub full_work: f64,
    pub work: Work,
    pub progress: Option<Progress>,
    /// What it comes across.
    pub journal: Arc<Journal>,
    /// Whether the set-up looks wrong: where nothing fits at first, nothing else will.
    pub suspicious: bool,
    /// Whether an optimum that mostly explains the motion ends the search though it leaves more than noise, as mesh and
    /// step are too coarse yet to tell.
    pub stops_at_first_fit: bool,
    /// Part of a standard error by which the minimum may be missed.
    pub tolerance: f64,
    /// Number of the mesh and the steps: objectives can be compared where it is the same.
    pub numerics: usize,
    /// Whether a search that gains next to nothing over several steps has converged.
    pub ends_crawling: bool,
}

/// What threads share of a search.
#[derive(Clone, Copy)]
pub(crate) struct Task<'a> {
    pub experiments: &'a [Experiment],
    pub sigmas: &'a [f64],
    pub leverage_weights: &'a [f64],
    pub unknowns: &'a [Unknown],
    pub full_work: f64,
    pub tolerance: f64,
}

impl<'a> Task<'a> {
    /// A silent search that counts its own work.
    pub fn search(self) -> Search<'a> {
        Search {
            experiments: self.experiments,
            sigmas: self.sigmas.to_vec(),
            leverage_weights: self.leverage_weights.to_vec(),
            unknowns: self.unknowns,
            full_work: self.full_work,
            work: Work::default(),
            progress: None,
            journal: Arc::default(),
            suspicious: false,
            stops_at_first_fit: false,
            tolerance: self.tolerance,
            numerics: 0,
            ends_crawling: false,
        }
    }
}

impl<'a> Search<'a> {
    /// A search that begins.
    pub fn new(
        experiments: &'a [Experiment],
        unknowns: &'a [Unknown],
        progress: Option<Progress>,
        tolerance: f64,
    ) -> Result<Self, Error> {
        let (sigmas, full_work) = (first_sigmas(experiments), full_work(experiments)?);
        let task = Task {
            experiments,
            sigmas: &[],
            leverage_weights: &[],
            unknowns,
            full_work,
            tolerance,
        };
        Ok(Self { sigmas, progress, ..task.search() })
    }

    /// The search goes on with the same experiments on other meshes or in other steps.
    pub fn on<'b>(&self, experiments: &'b [Experiment]) -> Result<Search<'b>, Error>
    where
        'a: 'b,
    {
        Ok(Search {
            experiments,
            full_work: full_work(experiments)?,
            stops_at_first_fit: false,
            numerics: self.journal.add_numerics(),
            ..self.clone()
        })
    }

    /// What other searches of the same problem need.
    pub fn task(&self) -> Task<'_> {
        Task {
            experiments: self.experiments,
            sigmas: &self.sigmas,
            leverage_weights: &self.leverage_weights,
            unknowns: self.unknowns,
            full_work: self.full_work,
            tolerance: self.tolerance,
        }
    }

    /// Work so far, in full simulations.
    pub fn simulations(&self) -> f64 {
        self.work.total() / self.full_work
    }

    /// Ends of the records, s.
    pub fn durations(&self) -> Vec<f64> {
        self.experiments.iter().map(Experiment::duration).collect()
    }

    /// About the first period of every experiment, s, with enough samples to tell the unknowns;
    /// zero without motion.
    pub fn first_periods(&self, stretch: f64) -> Vec<f64> {
        let enough = 8 + 4 * self.unknowns.len();
        let wait = |o: &PointMotion| o.samples.get(enough).map_or(f64::MAX, |s| s.time);
        let first = |experiment: &Experiment| {
            let least = |part: &dyn Fn(&PointMotion) -> f64| {
                experiment.records().map(|o| part(&o)).fold(f64::MAX, f64::min)
            };
            let (rise, sampled) = (least(&PointMotion::rise_time), least(&wait));
            (2.0 * rise * stretch).max(sampled).min(experiment.duration())
        };
        self.experiments.iter().map(first).collect()
    }

    /// Tells the progress.
    pub fn report(&self, stage: &str) {
        if let Some(progress) = &self.progress {
            progress(stage, self.simulations());
        }
    }

    /// Whether the fit shall stop.
    pub fn is_stopped(&self) -> bool {
        self.experiments.iter().any(|e| e.problem.is_stopped())
    }

    /// Notes a point.
    pub fn note(&self, visit: Visit) {
        self.journal.visit(visit, self.work.total());
    }

    /// The residuals of the whole records.
    pub fn all_residuals(&self) -> Result<Residuals, Error> {
        Ok(self.residuals(&self.durations())?.with_leverage_weights(&self.leverage_weights))
    }

    /// The residuals up to `horizons`, s, one per experiment.
    pub fn residuals(&self, horizons: &[f64]) -> Result<Residuals, Error> {
        let (sigmas, unknowns) = (&self.sigmas, self.unknowns);
        let residuals =
            Residuals::new(self.experiments, sigmas, unknowns, horizons, self.full_work)?;
        Ok(residuals.counting(self.work.clone()))
    }
}

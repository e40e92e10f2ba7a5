//! What every stage of a search works with: the problem with its weights, and the counters and
//! listeners that all stages share.

pub(crate) mod basins;
pub(crate) mod coarse;
pub(crate) mod grid;
pub(crate) mod journal;
pub(crate) mod optimum;
pub(crate) mod scan;
pub(crate) mod starts;

use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::motion::Observation;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::journal::{Journal, Visit};
use crate::fit::unknown::Unknown;
use std::cell::Cell;
use std::rc::Rc;

/// Told what the search does: stage, and how many simulations' worth of work is done.
pub type Progress = Rc<dyn Fn(&str, f64)>;

/// What every stage needs.
pub(crate) struct Search<'a> {
    pub experiments: &'a [Experiment],
    /// One per measurement, in its unit.
    pub sigmas: Vec<f64>,
    pub unknowns: &'a [Unknown],
    /// Work of one full simulation, steps times segments.
    pub full_work: f64,
    /// Work so far, steps times segments.
    pub work: Rc<Cell<f64>>,
    pub progress: Option<Progress>,
    /// What it comes across.
    pub journal: Rc<Journal>,
    /// Whether the set-up looks wrong: where nothing fits at first, nothing else will.
    pub suspicious: bool,
}

/// What threads share of a search.
#[derive(Clone, Copy)]
pub(crate) struct Task<'a> {
    pub experiments: &'a [Experiment],
    pub sigmas: &'a [f64],
    pub unknowns: &'a [Unknown],
    pub full_work: f64,
}

impl<'a> Task<'a> {
    /// A silent search that counts its own work.
    pub fn search(self) -> Search<'a> {
        Search {
            experiments: self.experiments,
            sigmas: self.sigmas.to_vec(),
            unknowns: self.unknowns,
            full_work: self.full_work,
            work: Rc::default(),
            progress: None,
            journal: Rc::default(),
            suspicious: false,
        }
    }
}

impl Search<'_> {
    /// What other searches of the same problem need.
    pub fn task(&self) -> Task<'_> {
        Task {
            experiments: self.experiments,
            sigmas: &self.sigmas,
            unknowns: self.unknowns,
            full_work: self.full_work,
        }
    }

    /// Counts the work of another search.
    pub fn count(&self, work: f64) {
        self.work.set(self.work.get() + work);
    }

    /// Ends of the records, s.
    pub fn durations(&self) -> Vec<f64> {
        self.experiments.iter().map(Experiment::duration).collect()
    }

    /// About the first period of every experiment, s, with enough samples to tell the unknowns;
    /// zero without motion.
    pub fn first_periods(&self, stretch: f64) -> Vec<f64> {
        let enough = 8 + 4 * self.unknowns.len();
        let wait = |o: &Observation| o.samples.get(enough).map_or(f64::MAX, |s| s.time);
        let first = |experiment: &Experiment| {
            let least = |part: &dyn Fn(&Observation) -> f64| {
                experiment.records().map(|o| part(&o)).fold(f64::MAX, f64::min)
            };
            let (rise, sampled) = (least(&Observation::rise_time), least(&wait));
            (2.0 * rise * stretch).max(sampled).min(experiment.duration())
        };
        self.experiments.iter().map(first).collect()
    }

    /// Tells the progress.
    pub fn report(&self, stage: &str) {
        if let Some(progress) = &self.progress {
            progress(stage, self.work.get() / self.full_work);
        }
    }

    /// Whether the fit shall stop.
    pub fn is_stopped(&self) -> bool {
        self.experiments.iter().any(|e| e.problem.is_stopped())
    }

    /// Notes a point.
    pub fn note(&self, visit: Visit) {
        self.journal.visit(visit, self.work.get() / self.full_work);
    }

    /// The residuals of the whole records.
    pub fn all_residuals(&self) -> Result<Residuals, Error> {
        self.residuals(&self.durations())
    }

    /// The residuals up to `horizons`, s, one per experiment.
    pub fn residuals(&self, horizons: &[f64]) -> Result<Residuals, Error> {
        let (sigmas, unknowns) = (&self.sigmas, self.unknowns);
        let residuals =
            Residuals::new(self.experiments, sigmas, unknowns, horizons, self.full_work)?;
        Ok(residuals.counting(self.work.clone()))
    }
}

//! What a search came across on its way to the optimum.

use crate::fit::search::grid::{Grid, Landscape};
use crate::fit::search::local_minima::{LocalMinima, SAME, distance, local_minima, values};
use crate::fit::search::minimum::{Minimum, Squares};
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use serde::{Deserialize, Serialize};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// One point of the convergence history.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Iterate {
    /// Stage of the search: `scan`, `coarse model`, `growing horizon` or `full model`.
    pub stage: String,
    /// Cost up to this point, in full simulations on the final mesh and with the final steps.
    pub simulations: f64,
    /// Half the sum of squared residuals or of their losses, in units of the final sigmas, over the
    /// part of the record that the stage uses.
    pub misfit: f64,
    /// Number of residuals in the misfit.
    pub residuals: usize,
    /// Values of the parameters, in their units.
    pub values: Vec<f64>,
}

impl Iterate {
    /// Root mean square residual, in units of the sigmas that the fit ended with.
    pub fn rms(&self) -> f64 {
        (2.0 * self.misfit / self.residuals as f64).sqrt()
    }
}

/// Parts of a search, in their order.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(crate) enum Stage {
    Scan,
    Coarse,
    Growing,
    Full,
}

impl Stage {
    pub fn name(self) -> &'static str {
        match self {
            Self::Scan => "scan",
            Self::Coarse => "coarse model",
            Self::Growing => "growing horizon",
            Self::Full => "full model",
        }
    }
}

/// A point that was looked at.
#[derive(Clone, Debug)]
pub(crate) struct Visit {
    pub stage: Stage,
    pub x: Vec<f64>,
    pub cost: f64,
    /// The residuals there, plain, without a robust loss: more of them the more of the record was
    /// looked at.
    pub residuals: Vec<f64>,
    /// How many each measurement has.
    pub counts: Vec<usize>,
}

/// A visit as the history keeps it: without its residuals, in no weighting.
#[derive(Debug)]
struct JournalEntry {
    stage: Stage,
    x: Vec<f64>,
    /// Work so far, steps times segments.
    work: f64,
    residuals: usize,
    squares: Squares,
}

/// The record of a search.
#[derive(Debug, Default)]
pub(crate) struct Journal(Mutex<Records>);

#[derive(Debug, Default)]
struct Records {
    history: Vec<JournalEntry>,
    /// Sigmas of the measurements that residuals are in units of now.
    sigmas: Vec<f64>,
    best: Option<Visit>,
    grid: Option<Grid>,
    /// Where fits of the full model ended.
    minima: Vec<Minimum>,
    /// How many meshes and steps there have been beside the first.
    numerics: usize,
}

impl Journal {
    fn records(&self) -> MutexGuard<'_, Records> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes a point, after this much work, steps times segments.
    pub fn visit(&self, visit: Visit, work: f64) {
        let mut records = self.records();
        let Visit { stage, x, cost, residuals, counts } = &visit;
        let noted = JournalEntry {
            stage: *stage,
            x: x.clone(),
            work,
            residuals: residuals.len(),
            squares: Squares::new(residuals, counts, &records.sigmas, *cost),
        };
        records.history.push(noted);
        let rank = |v: &Visit| (v.stage, v.residuals.len());
        let better = records.best.as_ref().is_none_or(|b| {
            rank(&visit) > rank(b) || rank(&visit) == rank(b) && visit.cost <= b.cost
        });
        if better {
            records.best = Some(visit);
        }
    }

    /// Notes a scan; only the last is kept.
    pub fn scan(&self, grid: Grid) {
        self.records().grid = Some(grid);
    }

    /// The number of another mesh and other steps.
    pub fn add_numerics(&self) -> usize {
        let mut records = self.records();
        records.numerics += 1;
        records.numerics
    }

    /// Records where a fit of the full model ended.
    pub fn add_minimum(&self, minimum: Minimum) {
        self.records().minima.push(minimum);
    }

    /// Records what became of the minimum at `before` on another mesh or with other weights.
    pub fn move_minimum(&self, before: &[f64], minimum: Minimum) {
        let mut records = self.records();
        records.minima.retain(|other| distance(&other.x, before) > SAME);
        records.minima.push(minimum);
    }

    /// The minima found so far.
    pub fn minima(&self) -> Vec<Minimum> {
        self.records().minima.clone()
    }

    /// The scan's least misfit over all others against an unknown, on its scale; empty if it was not scanned.
    pub fn scanned_line(&self, unknown: usize) -> Vec<(f64, f64)> {
        let records = self.records();
        records.grid.as_ref().map_or(Vec::new(), |grid| grid.line(unknown))
    }

    /// The values of an unknown that the scan had, on its scale; fewer than three if it was not scanned.
    pub fn scanned_values(&self, unknown: usize) -> Vec<f64> {
        let records = self.records();
        let axis = records.grid.as_ref().and_then(|grid| grid.axes.get(unknown));
        axis.cloned().unwrap_or_default()
    }

    /// Residuals are in units of these sigmas from now on: costs before and after this cannot be
    /// compared.
    pub fn reweight(&self, sigmas: &[f64]) {
        let mut records = self.records();
        records.best = None;
        records.sigmas = sigmas.to_vec();
    }

    /// The best point of the farthest stage.
    pub fn best(&self) -> Option<Visit> {
        self.records().best.clone()
    }

    /// The iterates in the order of their work, in the parameters' units, all of them in the weighting of these `sigmas`.
    /// `full_work` is the work of one full simulation: that of another mesh would make the work go back.
    pub fn history(&self, unknowns: &[Unknown], sigmas: &[f64], full_work: f64) -> Vec<Iterate> {
        let iterate = |noted: &JournalEntry| Iterate {
            stage: noted.stage.name().into(),
            simulations: noted.work / full_work,
            misfit: noted.squares.misfit(sigmas),
            residuals: noted.residuals,
            values: values(unknowns, &noted.x),
        };
        let mut history: Vec<Iterate> = self.records().history.iter().map(iterate).collect();
        // Threads share the counter.
        history.sort_by_cached_key(|x| total_order(x.simulations));
        history
    }

    /// The scan over each unknown that it had several values of.
    pub fn landscape(&self, unknowns: &[Unknown]) -> Vec<Landscape> {
        self.records().grid.as_ref().map_or(Vec::new(), |grid| grid.landscape(unknowns))
    }

    /// The minima that were found, of which `chosen` was taken; all objectives with the weights of these `sigmas`.
    pub fn local_minima(
        &self,
        unknowns: &[Unknown],
        sigmas: &[f64],
        chosen: Option<&Minimum>,
    ) -> LocalMinima {
        let records = self.records();
        local_minima(unknowns, (&records.minima, sigmas), records.grid.as_ref(), chosen)
    }
}

#[cfg(test)]
impl Journal {
    /// Forgets all minima.
    pub fn forget_minima(&self) {
        self.records().minima.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Parameter;

    #[test]
    fn the_best_is_that_of_the_farthest_stage() {
        let journal = Journal::default();
        journal.reweight(&[1.0]);
        let visit = |stage, count, cost| Visit {
            stage,
            x: vec![cost],
            cost,
            residuals: vec![0.0; count],
            counts: vec![count],
        };
        journal.visit(visit(Stage::Coarse, 1, 3.0), 0.1);
        journal.visit(visit(Stage::Full, 2, 8.0), 1.0);
        journal.visit(visit(Stage::Full, 2, 5.0), 2.0);
        journal.visit(visit(Stage::Full, 2, 6.0), 3.0);
        journal.visit(visit(Stage::Growing, 1, 1.0), 4.0);
        assert_eq!(journal.best().map(|best| best.cost), Some(5.0));
        let unknowns = [Unknown::new(Parameter::YoungsModulus)];
        assert_eq!(journal.history(&unknowns, &[1.0], 1.0).len(), 5);
    }

    /// A coarse mesh has simulations of less work, and many of them; its iterates still come first.
    #[test]
    fn history_of_a_refined_mesh_has_ascending_work() {
        let journal = Journal::default();
        journal.reweight(&[1.0]);
        let visit = || Visit {
            stage: Stage::Full,
            x: vec![0.0],
            cost: 1.0,
            residuals: vec![1.0],
            counts: vec![1],
        };
        // 20 runs of 10 units on the first mesh, then 3 of 100 on the last.
        let works = (1..=20).map(|k| 10.0 * f64::from(k)).chain([300.0, 500.0, 400.0]);
        works.for_each(|work| journal.visit(visit(), work));
        let history = journal.history(&[Unknown::new(Parameter::YoungsModulus)], &[1.0], 100.0);
        let work: Vec<f64> = history.iter().map(|iterate| iterate.simulations).collect();
        assert!(work.is_sorted(), "{work:?}");
        assert_eq!((work[0], work[22]), (0.1, 5.0));
    }

    /// The same place costs the same before and after the weights have changed.
    #[test]
    fn the_way_is_seen_in_one_weighting() {
        let journal = Journal::default();
        for sigmas in [[2.0, 1.0], [0.5, 4.0]] {
            journal.reweight(&sigmas);
            let residuals = vec![3.0 / sigmas[0], 4.0 / sigmas[1], 5.0 / sigmas[1], 6.0];
            let cost = 0.5 * residuals.iter().map(|r| r * r).sum::<f64>();
            let visit =
                Visit { stage: Stage::Full, x: vec![0.0], cost, residuals, counts: vec![1, 2] };
            journal.visit(visit, 1.0);
        }
        let unknowns = [Unknown::new(Parameter::YoungsModulus)];
        for (sigmas, cost) in [([1.0, 1.0], 43.0), ([0.1, 1.0], 0.5 * (900.0 + 41.0 + 36.0))] {
            for iterate in journal.history(&unknowns, &sigmas, 1.0) {
                assert!((iterate.misfit / cost - 1.0).abs() < 1e-12, "{iterate:?}");
            }
        }
    }
}

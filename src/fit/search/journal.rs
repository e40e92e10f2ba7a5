//! The journal of a search: a record, shared by its threads, of visited points, the best point, the last scan and the
//! minima.
//!
//! A point enters with its stage, residuals and work; a scan enters its new lowest points, a descent of the coarse
//! model its end, and other fits of the search their iterates. The journal stores sums of squares by measurement
//! ([`Squares`]), because sigmas change during a search. So [`Journal::history`] returns all misfits in units of the
//! final sigmas. Its values are in the parameters' units, its costs in full simulations.
//!
//! The best point is returned after an interruption. It is of the latest stage, within that stage one with the most
//! residuals, and of these the one of the lowest cost. A change of the sigmas (`reweight`) converts its residuals and
//! its cost.
//!
//! A scan replaces the last one. Minima are ends of fits of the full model to the whole records. `move_minimum` removes
//! all minima within [`SAME`] of a point and adds another one. Their distance is the largest difference of any unknown,
//! on its scale (logarithm of a positive parameter). `add_numerics` numbers the meshes and steps, by which minima are
//! distinguished. The convergence history, the scan (`landscape`) and the local minima of the fit report come from
//! here.

use crate::fit::search::grid::{Landscape, ScanGrid};
use crate::fit::search::local_minima::{LocalMinima, SAME, distance, local_minima};
use crate::fit::search::minimum::{Minimum, Squares};
use crate::fit::unknown::{ParameterPoint, Unknown};
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
    /// Root mean square residual `sqrt(2 misfit/residuals)`, in units of the sigmas that the fit ended with (no unit).
    pub fn rms(&self) -> f64 {
        (2.0 * self.misfit / self.residuals as f64).sqrt()
    }
}

/// Stages of a search, in their order.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(crate) enum SearchStage {
    /// Coarse model at the points of a grid, over the first period.
    Scan,
    /// Descents of the coarse model.
    Coarse,
    /// Descents of the full model over growing parts of the records.
    Growing,
    /// Descents of the full model over the whole records.
    Full,
}

impl SearchStage {
    /// The name of the stage in reports: `scan`, `coarse model`, `growing horizon` or `full model`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scan => "scan",
            Self::Coarse => "coarse model",
            Self::Growing => "growing horizon",
            Self::Full => "full model",
        }
    }
}

/// An evaluated point of the search with its residuals, as it enters the journal.
#[derive(Clone, Debug)]
pub(crate) struct Visit {
    pub stage: SearchStage,
    /// The unknowns on their scales.
    pub x: Vec<f64>,
    /// Half the sum of the losses.
    pub cost: f64,
    /// Plain residuals: more of them for a larger part of the records.
    pub residuals: Vec<f64>,
    /// Number of residuals of each measurement.
    pub counts: Vec<usize>,
}

/// An evaluated point in the history: sums of squares by measurement instead of residuals, without the sigmas and
/// leverage weights.
#[derive(Debug)]
struct JournalEntry {
    stage: SearchStage,
    x: Vec<f64>,
    /// Work so far, steps times segments.
    work: f64,
    /// Number of residuals.
    residuals: usize,
    squares: Squares,
}

/// The journal of evaluated points and minima, shared by the threads of a search through a lock.
#[derive(Debug, Default)]
pub(crate) struct Journal(Mutex<JournalRecords>);

/// Content of the journal: history, best point, last scan, minima, and the number of changes of mesh and steps.
#[derive(Debug, Default)]
struct JournalRecords {
    history: Vec<JournalEntry>,
    /// Sigmas of the measurements in whose units the residuals are at present.
    sigmas: Vec<f64>,
    /// The best point of the last stage.
    best: Option<Visit>,
    /// The last scan.
    grid: Option<ScanGrid>,
    /// Minima of the full model.
    minima: Vec<Minimum>,
    /// Number of changes of mesh and steps.
    numerics: usize,
}

impl Journal {
    /// The locked content. The lock of a thread that panicked is taken over: every change leaves a valid content.
    fn records(&self) -> MutexGuard<'_, JournalRecords> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds an evaluated point to the history, with the `work` so far, steps times segments. It becomes the best one if
    /// it is of a later stage than the best so far, or has more residuals in the same stage. On the same number of
    /// residuals it must have no higher cost.
    pub fn visit(&self, visit: Visit, work: f64) {
        let mut records = self.records();
        let Visit { stage, x, cost, residuals, counts } = &visit;
        let entry = JournalEntry {
            stage: *stage,
            x: x.clone(),
            work,
            residuals: residuals.len(),
            squares: Squares::new(residuals, counts, &records.sigmas, *cost),
        };
        records.history.push(entry);
        // Costs are comparable for the same stage and the same part of the records.
        let rank = |v: &Visit| (v.stage, v.residuals.len());
        let better = records.best.as_ref().is_none_or(|b| {
            rank(&visit) > rank(b) || rank(&visit) == rank(b) && visit.cost <= b.cost
        });
        if better {
            records.best = Some(visit);
        }
    }

    /// Records the grid of a scan with its misfits; it replaces the last one.
    pub fn set_scan(&self, grid: ScanGrid) {
        self.records().grid = Some(grid);
    }

    /// Counts a change of mesh and steps, and returns its number from 1 on (0 is the first mesh). Minima of different
    /// meshes are distinguished by it.
    pub fn add_numerics(&self) -> usize {
        let mut records = self.records();
        records.numerics += 1;
        records.numerics
    }

    /// Adds a minimum, the end of a fit of the full model to the whole records, to the list; equal ones are not merged.
    pub fn add_minimum(&self, minimum: Minimum) {
        self.records().minima.push(minimum);
    }

    /// Removes the minima within [`SAME`] of the point `before` (on the unknowns' scales), and adds the `minimum` to
    /// which they moved on another mesh or with other weights.
    pub fn move_minimum(&self, before: &[f64], minimum: Minimum) {
        let mut records = self.records();
        // A minimum that moved must not be listed a second time.
        records.minima.retain(|other| distance(&other.x, before) > SAME);
        records.minima.push(minimum);
    }

    /// Copies of the recorded minima of the full model, in the order of recording.
    pub fn minima(&self) -> Vec<Minimum> {
        self.records().minima.clone()
    }

    /// The values in the last scan of the unknown with this index, on its scale, each with the smallest misfit over all
    /// values of the others; empty without a scan.
    pub fn scanned_line(&self, unknown: usize) -> Vec<(f64, f64)> {
        let records = self.records();
        records.grid.as_ref().map_or(Vec::new(), |grid| grid.line(unknown))
    }

    /// The values in the last scan of the unknown with this index, on its scale, ascending; empty without a scan.
    pub fn scanned_values(&self, unknown: usize) -> Vec<f64> {
        let records = self.records();
        let axis = records.grid.as_ref().and_then(|grid| grid.axes.get(unknown));
        axis.cloned().unwrap_or_default()
    }

    /// Sets the `sigmas` in whose units later residuals are, one per measurement. The best point stays, with residuals
    /// and cost in these units ([`Squares::misfit`]).
    pub fn reweight(&self, sigmas: &[f64]) {
        let mut records = self.records();
        if records.sigmas == sigmas {
            return;
        }
        let before = std::mem::replace(&mut records.sigmas, sigmas.to_vec());
        if let Some(best) = &mut records.best {
            // Without it, the next point would replace a better one.
            let squares = Squares::new(&best.residuals, &best.counts, &before, best.cost);
            best.cost = squares.misfit(sigmas);
            let mut residuals = best.residuals.iter_mut();
            for ((count, before), now) in best.counts.iter().zip(&before).zip(sigmas) {
                residuals.by_ref().take(*count).for_each(|residual| *residual *= before / now);
            }
        }
    }

    /// The best point: of the latest stage, in it of the most residuals, and of these of the lowest cost. `None` before
    /// the first evaluation.
    pub fn best(&self) -> Option<Visit> {
        self.records().best.clone()
    }

    /// One [`Iterate`] per recorded point, in ascending order of the work, with values in the units of the parameters
    /// and misfits in units of `sigmas`. `full_work` is the work (steps times segments) of one full simulation on the
    /// final mesh, the unit of all costs.
    pub fn history(&self, unknowns: &[Unknown], sigmas: &[f64], full_work: f64) -> Vec<Iterate> {
        let iterate = |entry: &JournalEntry| Iterate {
            stage: entry.stage.name().into(),
            simulations: entry.work / full_work,
            misfit: entry.squares.misfit(sigmas),
            residuals: entry.residuals,
            values: ParameterPoint { unknowns, x: &entry.x }.values(),
        };
        let mut history: Vec<Iterate> = self.records().history.iter().map(iterate).collect();
        // Threads that share the counter record their points in any order.
        history.sort_by_cached_key(|x| total_order(x.simulations));
        history
    }

    /// The last scan as one curve for each unknown with at least three values in it: its values in its unit, and the
    /// misfit minimized over the others. Empty without a scan.
    pub fn landscape(&self, unknowns: &[Unknown]) -> Vec<Landscape> {
        self.records().grid.as_ref().map_or(Vec::new(), |grid| grid.landscape(unknowns))
    }

    /// The report of the recorded minima of the full model and those of the last scan, of which `chosen` is the result
    /// (`None` if the search was interrupted). Misfits of minima of the full model are in units of `sigmas`, one per
    /// measurement; those of the scan are as it computed them.
    pub fn local_minima(
        &self,
        unknowns: &[Unknown],
        sigmas: &[f64],
        chosen: Option<&Minimum>,
    ) -> LocalMinima {
        let records = self.records();
        local_minima(unknowns, &records.minima, sigmas, records.grid.as_ref(), chosen)
    }
}

#[cfg(test)]
impl Journal {
    /// Removes all minima.
    pub fn clear_minima(&self) {
        self.records().minima.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Parameter;

    /// A point of the full model is better than any of the coarse model, and a larger part of the records than a
    /// smaller one.
    #[test]
    fn best_point_is_lowest_of_last_stage() {
        let journal = Journal::default();
        journal.reweight(&[1.0]);
        let visit = |stage, count, cost| Visit {
            stage,
            x: vec![cost],
            cost,
            residuals: vec![0.0; count],
            counts: vec![count],
        };
        journal.visit(visit(SearchStage::Coarse, 1, 3.0), 0.1);
        journal.visit(visit(SearchStage::Full, 2, 8.0), 1.0);
        journal.visit(visit(SearchStage::Full, 2, 5.0), 2.0);
        journal.visit(visit(SearchStage::Full, 2, 6.0), 3.0);
        journal.visit(visit(SearchStage::Growing, 1, 1.0), 4.0);
        assert_eq!(journal.best().map(|best| best.cost), Some(5.0));
        let unknowns = [Unknown::new(Parameter::YoungsModulus)];
        assert_eq!(journal.history(&unknowns, &[1.0], 1.0).len(), 5);
    }

    /// A search that is stopped just after its sigmas changed still has its best point, with residuals in the new
    /// units.
    #[test]
    fn best_point_stays_when_sigmas_change() {
        let journal = Journal::default();
        journal.reweight(&[1.0, 1.0]);
        let visit = |cost| Visit {
            stage: SearchStage::Full,
            x: vec![cost],
            cost,
            residuals: vec![3.0, 4.0, 5.0],
            counts: vec![1, 1],
        };
        journal.visit(visit(25.0), 1.0);
        journal.reweight(&[2.0, 0.5]);
        // The last residual is that of a prior.
        let best = journal.best().expect("a best point");
        assert_eq!(best.residuals, [1.5, 8.0, 5.0]);
        journal.reweight(&[2.0, 0.5]);
        // (1.5^2 + 8^2 + 5^2)/2 = 45.625: a higher cost in the same units is no better point.
        assert_eq!(best.cost, 45.625);
        journal.visit(visit(46.0), 2.0);
        assert_eq!(journal.best().map(|best| best.cost), Some(45.625));
        journal.visit(visit(45.0), 3.0);
        assert_eq!(journal.best().map(|best| best.cost), Some(45.0));
    }

    /// Work is in units of the final mesh, so that the many small simulations of a coarse mesh come first.
    #[test]
    fn history_of_a_refined_mesh_has_ascending_work() {
        let journal = Journal::default();
        journal.reweight(&[1.0]);
        let visit = || Visit {
            stage: SearchStage::Full,
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

    /// A point has the same misfit whether it was recorded before or after the weights changed. With sigmas of 1 it is
    /// (3^2 + 4^2 + 5^2 + 6^2)/2 = 43, the last square being that of a prior.
    #[test]
    fn history_misfits_have_one_weighting() {
        let journal = Journal::default();
        for sigmas in [[2.0, 1.0], [0.5, 4.0]] {
            journal.reweight(&sigmas);
            let residuals = vec![3.0 / sigmas[0], 4.0 / sigmas[1], 5.0 / sigmas[1], 6.0];
            let cost = 0.5 * residuals.iter().map(|r| r * r).sum::<f64>();
            let (stage, counts) = (SearchStage::Full, vec![1, 2]);
            journal.visit(Visit { stage, x: vec![0.0], cost, residuals, counts }, 1.0);
        }
        let unknowns = [Unknown::new(Parameter::YoungsModulus)];
        for (sigmas, cost) in [([1.0, 1.0], 43.0), ([0.1, 1.0], 0.5 * (900.0 + 41.0 + 36.0))] {
            for iterate in journal.history(&unknowns, &sigmas, 1.0) {
                assert!((iterate.misfit / cost - 1.0).abs() < 1e-12, "{iterate:?}");
            }
        }
    }
}

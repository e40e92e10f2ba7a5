//! What a search came across on its way to the optimum.

use crate::fit::search::basins::{Basins, Reached, basins, values};
use crate::fit::search::grid::{Grid, Landscape};
use crate::fit::unknown::Unknown;
use serde::{Deserialize, Serialize};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A point on the way to the optimum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Iterate {
    /// `scan`, `coarse model`, `growing horizon` or `full model`.
    pub stage: String,
    /// Work so far, in full simulations.
    pub simulations: f64,
    /// Half the sum of squared residuals (or their losses), over the part of the record that the stage
    /// looks at, in units of the sigmas that the fit ended with.
    pub misfit: f64,
    /// Number of residuals that the misfit is made of.
    pub residuals: usize,
    /// The parameters, in their units.
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
struct Noted {
    stage: Stage,
    x: Vec<f64>,
    simulations: f64,
    residuals: usize,
    /// Sums of squares of each measurement in its own unit, and of the priors.
    squares: Vec<f64>,
    priors: f64,
    /// What robust losses make of the sum of squares, as a part of it.
    robust: f64,
}

impl Noted {
    fn of(visit: &Visit, sigmas: &[f64], simulations: f64) -> Self {
        let mut rest = &visit.residuals[..];
        let square = |r: &[f64]| r.iter().map(|r| r * r).sum::<f64>();
        let counts = visit.counts.iter().zip(sigmas);
        let squares: Vec<f64> = counts
            .map(|(count, sigma)| {
                let (own, others) = rest.split_at(*count);
                rest = others;
                square(own) * sigma * sigma
            })
            .collect();
        let whole = square(&visit.residuals);
        Self {
            stage: visit.stage,
            x: visit.x.clone(),
            simulations,
            residuals: visit.residuals.len(),
            squares,
            priors: square(rest),
            robust: if whole > 0.0 { 2.0 * visit.cost / whole } else { 1.0 },
        }
    }

    /// Half the sum of squares or of losses in a weighting; of robust losses as their own weighting
    /// had it.
    fn misfit(&self, sigmas: &[f64]) -> f64 {
        let pairs = self.squares.iter().zip(sigmas);
        let squares: f64 = pairs.map(|(square, sigma)| square / (sigma * sigma)).sum();
        0.5 * self.robust * (squares + self.priors)
    }
}

/// The record of a search.
#[derive(Debug, Default)]
pub(crate) struct Journal(Mutex<Records>);

#[derive(Debug, Default)]
struct Records {
    history: Vec<Noted>,
    /// Sigmas of the measurements that residuals are in units of now.
    sigmas: Vec<f64>,
    best: Option<Visit>,
    grid: Option<Grid>,
    reached: Vec<Reached>,
}

impl Journal {
    fn records(&self) -> MutexGuard<'_, Records> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes a point, after the work of this many simulations.
    pub fn visit(&self, visit: Visit, simulations: f64) {
        let mut records = self.records();
        let noted = Noted::of(&visit, &records.sigmas, simulations);
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

    /// Notes where the full model ended.
    pub fn reach(&self, end: Reached) {
        self.records().reached.push(end);
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

    /// The way, in the parameters' units, all of it in the weighting of these `sigmas`.
    pub fn history(&self, unknowns: &[Unknown], sigmas: &[f64]) -> Vec<Iterate> {
        let iterate = |noted: &Noted| Iterate {
            stage: noted.stage.name().into(),
            simulations: noted.simulations,
            misfit: noted.misfit(sigmas),
            residuals: noted.residuals,
            values: values(unknowns, &noted.x),
        };
        self.records().history.iter().map(iterate).collect()
    }

    /// The scan over each unknown that it had several values of.
    pub fn landscape(&self, unknowns: &[Unknown]) -> Vec<Landscape> {
        self.records().grid.as_ref().map_or(Vec::new(), |grid| grid.landscape(unknowns))
    }

    /// The minima that were seen, of which the one at `chosen` was taken.
    pub fn basins(&self, unknowns: &[Unknown], chosen: Option<(&[f64], f64)>) -> Basins {
        let records = self.records();
        basins(unknowns, &records.reached, records.grid.as_ref(), chosen)
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
        assert_eq!(journal.history(&[Unknown::new(Parameter::YoungsModulus)], &[1.0]).len(), 5);
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
            for iterate in journal.history(&unknowns, &sigmas) {
                assert!((iterate.misfit / cost - 1.0).abs() < 1e-12, "{iterate:?}");
            }
        }
    }
}

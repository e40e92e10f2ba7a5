//! What a search came across on its way to the optimum.

use super::basins::{Reached, basins, values};
use super::grid::Grid;
use super::{Basins, Iterate, Landscape, Unknown};
use std::cell::RefCell;

/// Parts of a search, in their order.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) enum Stage {
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
pub(super) struct Visit {
    pub stage: Stage,
    pub x: Vec<f64>,
    pub cost: f64,
    /// The residuals there, not bent by a robust loss: more of them the more of the record was
    /// looked at.
    pub residuals: Vec<f64>,
    /// How many each measurement has.
    pub counts: Vec<usize>,
}

/// The record of a search.
#[derive(Debug, Default)]
pub(super) struct Journal {
    history: RefCell<Vec<(Visit, usize, f64)>>,
    best: RefCell<Option<Visit>>,
    grid: RefCell<Option<Grid>>,
    reached: RefCell<Vec<Reached>>,
}

impl Journal {
    /// Notes a point, after the work of this many simulations.
    pub fn visit(&self, mut visit: Visit, simulations: f64) {
        let mut best = self.best.borrow_mut();
        let rank = |v: &Visit| (v.stage, v.residuals.len());
        let better = best.as_ref().is_none_or(|b| {
            rank(&visit) > rank(b) || rank(&visit) == rank(b) && visit.cost <= b.cost
        });
        if better {
            *best = Some(visit.clone());
        }
        let count = std::mem::take(&mut visit.residuals).len();
        self.history.borrow_mut().push((visit, count, simulations));
    }

    /// Notes a scan; only the last is kept.
    pub fn scan(&self, grid: Grid) {
        *self.grid.borrow_mut() = Some(grid);
    }

    /// Notes where the full model ended.
    pub fn reach(&self, end: Reached) {
        self.reached.borrow_mut().push(end);
    }

    /// Costs before and after this cannot be compared: the weights have changed.
    pub fn reweight(&self) {
        *self.best.borrow_mut() = None;
    }

    /// The best point of the farthest stage.
    pub fn best(&self) -> Option<Visit> {
        self.best.borrow().clone()
    }

    /// The way, in the parameters' units.
    pub fn history(&self, unknowns: &[Unknown]) -> Vec<Iterate> {
        let iterate = |(visit, count, simulations): &(Visit, usize, f64)| Iterate {
            stage: visit.stage.name().into(),
            simulations: *simulations,
            misfit: visit.cost,
            residuals: *count,
            values: values(unknowns, &visit.x),
        };
        self.history.borrow().iter().map(iterate).collect()
    }

    /// The scan over each unknown that it had several values of.
    pub fn landscape(&self, unknowns: &[Unknown]) -> Vec<Landscape> {
        self.grid.borrow().as_ref().map_or(Vec::new(), |grid| grid.landscape(unknowns))
    }

    /// The minima that were seen, of which the one at `chosen` was taken.
    pub fn basins(&self, unknowns: &[Unknown], chosen: Option<(&[f64], f64)>) -> Basins {
        basins(unknowns, &self.reached.borrow(), self.grid.borrow().as_ref(), chosen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parameter;

    #[test]
    fn the_best_is_that_of_the_farthest_stage() {
        let journal = Journal::default();
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
        assert_eq!(journal.history(&[Unknown::new(Parameter::YoungsModulus)]).len(), 5);
    }
}

//! What a search came across on its way to the optimum.

use super::search::Optimum;
use super::{Basin, Basins, Iterate, Landscape, Seen, Unknown};
use std::cell::RefCell;

/// Minima of the scan that are listed; all are counted.
const LISTED: usize = 20;
/// Optima nearer than this on the unknowns' scales are one.
const SAME: f64 = 1e-2;

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

/// Misfits of a grid of starts; infinite where the simulation failed.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Values of each unknown on its scale, ascending. The last unknown's vary fastest.
    pub axes: Vec<Vec<f64>>,
    pub points: Vec<(Vec<f64>, f64)>,
}

/// The record of a search.
#[derive(Debug, Default)]
pub(super) struct Journal {
    history: RefCell<Vec<(Visit, usize, f64)>>,
    best: RefCell<Option<Visit>>,
    grid: RefCell<Option<Grid>>,
    reached: RefCell<Vec<(Vec<f64>, f64, bool)>>,
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
    pub fn reach(&self, optimum: &Optimum) {
        self.reached.borrow_mut().push((optimum.x.clone(), optimum.cost, optimum.converged));
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
        let grid = self.grid.borrow();
        let Some(grid) = grid.as_ref() else { return Vec::new() };
        let over = |(i, axis): (usize, &Vec<f64>)| {
            let least = |x: &f64| {
                let slice = grid.points.iter().filter(|(point, _)| point[i] == *x);
                slice.map(|(_, cost)| *cost).fold(f64::INFINITY, f64::min)
            };
            Landscape {
                name: unknowns[i].parameter,
                label: unknowns[i].to_string(),
                values: axis.iter().map(|x| unknowns[i].from_scale(*x)).collect(),
                misfit: axis.iter().map(least).collect(),
            }
        };
        grid.axes.iter().enumerate().filter(|(_, axis)| axis.len() > 2).map(over).collect()
    }

    /// The minima that were seen, of which the one at `chosen` was taken.
    pub fn basins(&self, unknowns: &[Unknown], chosen: Option<(&[f64], f64)>) -> Basins {
        let mut reached: Vec<(Vec<f64>, f64, bool)> = Vec::new();
        let mut all = self.reached.borrow().clone();
        all.sort_by(|a, b| a.1.total_cmp(&b.1));
        for (x, cost, converged) in all {
            if reached.iter().all(|(y, ..)| distance(&x, y) > SAME) {
                reached.push((x, cost, converged));
            }
        }
        let least = reached.first().map_or(0.0, |(_, cost, _)| *cost);
        let mut list: Vec<Basin> = reached
            .iter()
            .map(|(x, cost, converged)| Basin {
                seen: Seen::Fit,
                values: values(unknowns, x),
                misfit: *cost,
                relative: ratio(*cost, least),
                converged: *converged,
                chosen: false,
            })
            .collect();
        // New weights move the optimum a little.
        let nearest = chosen.and_then(|(x, _)| {
            let far = |(y, ..): &(Vec<f64>, f64, bool)| distance(x, y);
            (0..reached.len()).min_by(|a, b| far(&reached[*a]).total_cmp(&far(&reached[*b])))
        });
        if let (Some(i), Some((x, cost))) = (nearest, chosen) {
            list[i] = Basin {
                values: values(unknowns, x),
                misfit: cost,
                chosen: true,
                ..list[i].clone()
            };
            list[..=i].rotate_right(1);
        }
        let scanned = self.grid.borrow().as_ref().map_or(Vec::new(), Grid::minima);
        let points = self.grid.borrow().as_ref().map_or(0, |grid| grid.points.len());
        let least = scanned.first().map_or(0.0, |(_, cost, _)| *cost);
        let unfollowed = scanned.iter().filter(|(x, _, spacing)| {
            let at = |(y, ..): &(Vec<f64>, f64, bool)| {
                x.iter().zip(y).zip(spacing).all(|((x, y), h)| (x - y).abs() <= 1.5 * h)
            };
            !reached.iter().any(at)
        });
        let unfollowed: Vec<Basin> = unfollowed
            .map(|(x, cost, _)| Basin {
                seen: Seen::Scan,
                values: values(unknowns, x),
                misfit: *cost,
                relative: ratio(*cost, least),
                converged: false,
                chosen: false,
            })
            .collect();
        let count = list.len() + unfollowed.len();
        let words = in_words(unknowns, &list, &unfollowed, points);
        list.extend(unfollowed.into_iter().take(LISTED));
        Basins { count, list, words }
    }
}

impl Grid {
    /// Inner points below all their neighbours, diagonal ones too, with the grid's spacing there;
    /// best first. The edges are slopes, not basins.
    fn minima(&self) -> Vec<(Vec<f64>, f64, Vec<f64>)> {
        let lengths: Vec<usize> = self.axes.iter().map(Vec::len).collect();
        let place = |index: usize| {
            let mut rest = index;
            let mut place = vec![0; lengths.len()];
            for (slot, length) in place.iter_mut().zip(&lengths).rev() {
                (*slot, rest) = (rest % length, rest / length);
            }
            place
        };
        let cost = |place: &[usize]| {
            let index = place.iter().zip(&lengths).fold(0, |index, (i, n)| index * n + i);
            self.points[index].1
        };
        let is_minimum = |index: usize| {
            let here = place(index);
            let inner = |(i, n): (&usize, &usize)| *n < 3 || (*i > 0 && i + 1 < *n);
            here.iter().zip(&lengths).all(inner)
                && neighbours(&here, &lengths).iter().all(|there| {
                    // Of equal ones the first.
                    let (a, b) = (self.points[index].1, cost(there));
                    a < b || a == b && here < *there
                })
        };
        let spacing = |index: usize| {
            let spacing = |(axis, i): (&Vec<f64>, usize)| {
                let gap = |j: usize| axis.get(j + 1).map_or(0.0, |next| next - axis[j]);
                // A single value says nothing about where others are.
                if axis.len() < 2 { f64::INFINITY } else { gap(i).max(gap(i.saturating_sub(1))) }
            };
            self.axes.iter().zip(place(index)).map(spacing).collect()
        };
        let mut minima: Vec<_> = (0..self.points.len())
            .filter(|index| self.points[*index].1.is_finite() && is_minimum(*index))
            .map(|index| (self.points[index].0.clone(), self.points[index].1, spacing(index)))
            .collect();
        minima.sort_by(|a, b| a.1.total_cmp(&b.1));
        minima
    }
}

/// All places one step away along some axes.
fn neighbours(here: &[usize], lengths: &[usize]) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for (i, n) in here.iter().zip(lengths) {
        let range = i.saturating_sub(1)..=(i + 1).min(n - 1);
        all =
            all.iter().flat_map(|head| range.clone().map(|j| [&head[..], &[j]].concat())).collect();
    }
    all.retain(|there| there != here);
    all
}

fn in_words(unknowns: &[Unknown], fitted: &[Basin], scanned: &[Basin], points: usize) -> String {
    let at = |basin: &Basin| {
        let pairs = unknowns.iter().zip(&basin.values);
        let words = pairs.map(|(unknown, value)| {
            format!("{unknown} = {} {}", four_digits(*value), unknown.parameter.unit())
        });
        words.collect::<Vec<_>>().join(", ").replace(" ,", ",").trim_end().to_string()
    };
    let scan = match points {
        0 => "from the start given".to_string(),
        _ => format!("in a scan of {points} points and fits from its best"),
    };
    let chosen = match fitted.first() {
        Some(first) if first.chosen => first,
        _ => return String::new(),
    };
    let mut words = match fitted.len() + scanned.len() {
        1 => format!("one minimum of the misfit seen {scan}"),
        n => format!("{n} minima of the misfit seen {scan}"),
    };
    if let Some(next) = fitted.get(1) {
        words += &match next.misfit / chosen.misfit {
            more if more >= 1.0 => {
                format!("; the next, {}, has {} times this one's misfit", at(next), times(more))
            }
            _ => format!("; {} fits better than this one", at(next)),
        };
    }
    if let Some(next) = scanned.first() {
        let more = times(next.relative);
        words += &format!(
            "; not followed: {}, {more} times the least misfit over the first period",
            at(next)
        );
        if scanned.len() > 1 {
            words += &format!(", and {} with more", scanned.len() - 1);
        }
    }
    words
}

fn four_digits(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if (1e-2..1e4).contains(&size) => {
            let decimals = (3.0 - size.log10().floor()).max(0.0) as usize;
            format!("{value:.decimals$}")
        }
        _ => format!("{value:.3e}"),
    }
}

fn times(ratio: f64) -> String {
    if ratio < 100.0 { format!("{ratio:.2}") } else { format!("{ratio:.0e}") }
}

fn values(unknowns: &[Unknown], x: &[f64]) -> Vec<f64> {
    unknowns.iter().zip(x).map(|(unknown, x)| unknown.from_scale(*x)).collect()
}

fn distance(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn ratio(cost: f64, least: f64) -> f64 {
    if cost == least { 1.0 } else { cost / least }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parameter;

    fn unknowns() -> [Unknown; 2] {
        [Parameter::YoungsModulus, Parameter::Beta].map(Unknown::new)
    }

    /// Two wells, at (1, 0.7) and (5, 0.7) of a grid with flat ground between.
    fn grid() -> Grid {
        let axes = vec![(0..8).map(f64::from).collect(), vec![0.5, 0.6, 0.7, 0.8, 0.9]];
        let well = |x: f64, y: f64, a: f64| (x - a).powi(2) + 25.0 * (y - 0.7).powi(2);
        let points = axes[0].iter().flat_map(|x| {
            let row: &Vec<f64> = &axes[1];
            row.iter().map(|y| {
                let (deep, shallow) = (1.0 + well(*x, *y, 1.0), 3.0 + 0.5 * well(*x, *y, 5.0));
                (vec![*x, *y], deep.min(shallow).min(5.0))
            })
        });
        Grid { points: points.collect(), axes: axes.clone() }
    }

    #[test]
    fn minima_of_a_grid_are_its_wells() {
        let minima = grid().minima();
        let places: Vec<&[f64]> = minima.iter().map(|(x, ..)| &x[..]).collect();
        assert_eq!(places, [&[1.0, 0.7][..], &[5.0, 0.7]]);
        // Edges and flat ground are none.
        let mut slope = grid();
        slope.points.iter_mut().for_each(|(x, cost)| *cost = x[0] + x[1]);
        assert!(slope.minima().is_empty());
        slope.points.iter_mut().for_each(|(_, cost)| *cost = 1.0);
        assert!(slope.minima().is_empty());
    }

    #[test]
    fn basins_count_what_was_followed_once() {
        let journal = Journal::default();
        journal.scan(grid());
        let optimum = |x: [f64; 2], cost: f64| Optimum {
            x: x.to_vec(),
            cost,
            residuals: Vec::new(),
            jacobian: Vec::new(),
            counts: Vec::new(),
            converged: true,
            status: String::new(),
        };
        journal.reach(&optimum([1.2, 0.71], 4.0));
        journal.reach(&optimum([1.2005, 0.71], 4.1));
        journal.reach(&optimum([2.9, 0.71], 8.0));
        let basins = journal.basins(&unknowns(), Some((&[1.2, 0.71], 4.0)));
        assert_eq!((basins.count, basins.list.len()), (3, 3), "{basins:?}");
        let seen: Vec<_> = basins.list.iter().map(|b| (b.seen, b.chosen, b.relative)).collect();
        assert_eq!(
            seen,
            [(Seen::Fit, true, 1.0), (Seen::Fit, false, 2.0), (Seen::Scan, false, 3.0)]
        );
        assert!(basins.words.contains("3 minima") && basins.words.contains("2.00 times"));
        let landscape = journal.landscape(&unknowns());
        assert_eq!((landscape.len(), landscape[0].misfit[1]), (2, 1.0));
        // Nothing seen, nothing said.
        let empty = Journal::default().basins(&unknowns(), None);
        assert_eq!((empty.count, empty.words.as_str()), (0, ""));
    }

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
        assert_eq!(journal.history(&unknowns()[..1]).len(), 5);
    }
}

//! The misfit over a grid of starts: its minima are where fits may end.

use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};

/// Misfit of the coarse model over the first period, as a function of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Landscape {
    /// Name of the parameter.
    pub name: Parameter,
    /// Name of the parameter with its experiments, if it does not belong to all.
    pub label: String,
    /// Values of the parameter, ascending, in its unit.
    pub values: Vec<f64>,
    /// Misfit minimized over the other parameters; null where nothing could be simulated.
    #[serde(deserialize_with = "crate::input::arrays::all_or_infinite")]
    pub misfit: Vec<f64>,
}

/// Misfits of a grid of starts; infinite where the simulation failed.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    /// Values of each unknown on its scale, ascending. The last unknown's vary fastest.
    pub axes: Vec<Vec<f64>>,
    pub points: Vec<(Vec<f64>, f64)>,
}

impl Grid {
    /// The least misfit over each unknown that has several values.
    pub fn landscape(&self, unknowns: &[Unknown]) -> Vec<Landscape> {
        let over = |(i, _): (usize, &Vec<f64>)| {
            let line = self.line(i);
            Landscape {
                name: unknowns[i].parameter,
                label: unknowns[i].to_string(),
                values: line.iter().map(|(x, _)| unknowns[i].from_scale(*x)).collect(),
                misfit: line.into_iter().map(|(_, misfit)| misfit).collect(),
            }
        };
        self.axes.iter().enumerate().filter(|(_, axis)| axis.len() > 2).map(over).collect()
    }

    /// The values of an unknown on its scale, each with the least misfit over all values of the others.
    pub fn line(&self, unknown: usize) -> Vec<(f64, f64)> {
        let least = |x: &f64| {
            let slice = self.points.iter().filter(|(point, _)| point[unknown] == *x);
            slice.map(|(_, cost)| *cost).fold(f64::INFINITY, f64::min)
        };
        let axis = self.axes.get(unknown).into_iter().flatten();
        axis.map(|x| (*x, least(x))).collect()
    }

    /// Number of values of each unknown.
    fn lengths(&self) -> Vec<usize> {
        self.axes.iter().map(Vec::len).collect()
    }

    /// Where on each axis a point is.
    fn place(&self, index: usize) -> Vec<usize> {
        let mut rest = index;
        let mut place = vec![0; self.axes.len()];
        for (slot, axis) in place.iter_mut().zip(&self.axes).rev() {
            (*slot, rest) = (rest % axis.len(), rest / axis.len());
        }
        place
    }

    fn cost(&self, place: &[usize]) -> f64 {
        let index = place.iter().zip(&self.axes).fold(0, |index, (i, axis)| index * axis.len() + i);
        self.points[index].1
    }

    /// Whether a point is below all its neighbours, diagonal ones too; of equal ones the first.
    fn is_lowest(&self, index: usize) -> bool {
        let (here, cost) = (self.place(index), self.points[index].1);
        neighbours(&here, &self.lengths()).iter().all(|there| {
            let other = self.cost(there);
            cost < other || cost == other && here < *there
        })
    }

    /// The least misfit that a descent from a point may end with. Infinite on a slope, which leads to
    /// where a better point leads. In a hollow it may be lower than the point by eight times as much as
    /// parabolas through the neighbours can be: hollows are sharper than those. Anything, where an
    /// unknown has fewer than three values: the scan says nothing about it.
    pub fn floor(&self, index: usize) -> f64 {
        if self.axes.iter().any(|axis| axis.len() < 3) {
            return f64::NEG_INFINITY;
        }
        if !self.is_lowest(index) {
            return f64::INFINITY;
        }
        let (here, cost) = (self.place(index), self.points[index].1);
        let rise = |(k, axis): (usize, &Vec<f64>)| {
            let at = |i: usize| {
                let mut there = here.clone();
                there[k] = i;
                self.cost(&there) - cost
            };
            // At an end of the axis as if it went on alike.
            let (low, high) =
                (here[k].checked_sub(1), Some(here[k] + 1).filter(|i| *i < axis.len()));
            at(low.or(high).unwrap_or(here[k])) + at(high.or(low).unwrap_or(here[k]))
        };
        cost - self.axes.iter().enumerate().map(rise).sum::<f64>()
    }

    /// Inner points below all their neighbours, diagonal ones too, with the grid's spacing there;
    /// best first. The edges are slopes, not basins.
    pub fn minima(&self) -> Vec<(Vec<f64>, f64, Vec<f64>)> {
        let lengths = self.lengths();
        let is_minimum = |index: usize| {
            let inner = |(i, n): (&usize, &usize)| *n < 3 || (*i > 0 && i + 1 < *n);
            self.place(index).iter().zip(&lengths).all(inner) && self.is_lowest(index)
        };
        let spacing = |index: usize| {
            let spacing = |(axis, i): (&Vec<f64>, usize)| {
                let gap = |j: usize| axis.get(j + 1).map_or(0.0, |next| next - axis[j]);
                // A single value says nothing about where others are.
                if axis.len() < 2 { f64::INFINITY } else { gap(i).max(gap(i.saturating_sub(1))) }
            };
            self.axes.iter().zip(self.place(index)).map(spacing).collect()
        };
        let mut minima: Vec<_> = (0..self.points.len())
            .filter(|index| self.points[*index].1.is_finite() && is_minimum(*index))
            .map(|index| (self.points[index].0.clone(), self.points[index].1, spacing(index)))
            .collect();
        minima.sort_by_cached_key(|x| total_order(x.1));
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

#[cfg(test)]
impl Grid {
    /// Two wells, at (1, 0.7) and (5, 0.7) of a grid with flat ground between.
    pub fn two_wells() -> Self {
        let axes = vec![(0..8).map(f64::from).collect(), vec![0.5, 0.6, 0.7, 0.8, 0.9]];
        let well = |x: f64, y: f64, a: f64| (x - a).powi(2) + 25.0 * (y - 0.7).powi(2);
        let points = axes[0].iter().flat_map(|x| {
            let row: &Vec<f64> = &axes[1];
            row.iter().map(|y| {
                let (deep, shallow) = (1.0 + well(*x, *y, 1.0), 3.0 + 0.5 * well(*x, *y, 5.0));
                (vec![*x, *y], deep.min(shallow).min(5.0))
            })
        });
        Self { points: points.collect(), axes: axes.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wells of other grids, seen at whole numbers, are not below what is said of them.
    #[test]
    fn descents_from_a_grid_end_above_their_floors() {
        let grid = Grid::two_wells();
        for (index, (x, cost)) in grid.points.iter().enumerate() {
            match x[..] == [1.0, 0.7] || x[..] == [5.0, 0.7] {
                true => assert!(grid.floor(index) < *cost, "{x:?}"),
                false => assert_eq!(grid.floor(index), f64::INFINITY, "{x:?}"),
            }
        }
        // A well between two points, as narrow as the basins of a vibration are.
        for (place, lowest) in [(2.5, 2), (2.8, 3), (3.0, 3)] {
            let axis: Vec<f64> = (0..8).map(f64::from).collect();
            let misfit = |x: &f64| (vec![*x], 1.0 - (-2.0 * (x - place).powi(2)).exp());
            let grid = Grid { points: axis.iter().map(misfit).collect(), axes: vec![axis] };
            assert!(grid.floor(lowest) <= 0.0, "{place}: {}", grid.floor(lowest));
        }
        let one = Grid { axes: vec![vec![0.0]], points: vec![(vec![0.0], 1.0)] };
        assert_eq!(one.floor(0), f64::NEG_INFINITY);
    }

    #[test]
    fn minima_of_a_grid_are_its_wells() {
        let minima = Grid::two_wells().minima();
        let places: Vec<&[f64]> = minima.iter().map(|(x, ..)| &x[..]).collect();
        assert_eq!(places, [&[1.0, 0.7][..], &[5.0, 0.7]]);
        // Edges and flat ground are none.
        let mut slope = Grid::two_wells();
        slope.points.iter_mut().for_each(|(x, cost)| *cost = x[0] + x[1]);
        assert!(slope.minima().is_empty());
        slope.points.iter_mut().for_each(|(_, cost)| *cost = 1.0);
        assert!(slope.minima().is_empty());
    }
}

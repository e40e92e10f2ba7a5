//! The misfit of a model on a rectangular grid of values of the unknowns, as the scan computes it.
//!
//! [`ScanGrid`] has the misfit at all combinations of values on the unknowns' scales; it is infinite where a simulation
//! failed. Three results are computed from it. `landscape` is the misfit over each unknown with at least
//! [`FEWEST_VALUES`] values (in its unit), minimized over the others, for reports; `line` is the same for one unknown
//! on its scale. A point is lowest if it is below all neighbors, diagonal ones included; of equal neighbors the first
//! one is. `minima` are the lowest points with a finite misfit, in ascending order, without points at the end of an
//! axis that has [`FEWEST_VALUES`] or more values. `descent_bound` estimates a lower bound of the misfit that a descent
//! from a point can reach, by which the search omits hopeless starts. It is minus infinity if an axis has fewer than
//! [`FEWEST_VALUES`] values, else infinite for a point that is not lowest. Otherwise it is the misfit less the rises to
//! the neighbors on both sides along every axis (at an end, twice the one side).

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

/// Misfits of the coarse model over all combinations of values (a tensor-product grid).
#[derive(Clone, Debug)]
pub(crate) struct ScanGrid {
    /// Values of each unknown on its scale, ascending.
    pub axes: Vec<Vec<f64>>,
    /// All combinations of values; those of the last unknown vary fastest.
    pub points: Vec<GridPoint>,
}

/// A point of the grid with its misfit.
#[derive(Clone, Debug)]
pub(crate) struct GridPoint {
    /// The unknowns on their scales.
    pub x: Vec<f64>,
    /// Misfit; infinite where the simulation failed.
    pub misfit: f64,
}

/// A local minimum of the grid with the spacing of the grid around it.
#[derive(Clone, Debug)]
pub(crate) struct GridMinimum {
    /// The unknowns on their scales.
    pub x: Vec<f64>,
    pub misfit: f64,
    /// Distance to the next value of each unknown, the larger one of both sides; infinite for a single value.
    pub spacing: Vec<f64>,
}

/// Smallest number of values of an unknown that show a basin: a minimum needs a higher value on both sides.
const FEWEST_VALUES: usize = 3;

impl ScanGrid {
    /// One curve for each unknown with at least [`FEWEST_VALUES`] scanned values. It has the values in its unit,
    /// ascending, and at each the smallest misfit over all values of the other unknowns (infinite where nothing could
    /// be simulated).
    pub fn landscape(&self, unknowns: &[Unknown]) -> Vec<Landscape> {
        // One curve per scanned unknown: the misfit minimized over the grid of all others.
        let over = |(i, _): (usize, &Vec<f64>)| {
            let line = self.line(i);
            Landscape {
                name: unknowns[i].parameter,
                label: unknowns[i].to_string(),
                values: line.iter().map(|(x, _)| unknowns[i].from_scale(*x)).collect(),
                misfit: line.into_iter().map(|(_, misfit)| misfit).collect(),
            }
        };
        let axes = self.axes.iter().enumerate();
        axes.filter(|(_, axis)| axis.len() >= FEWEST_VALUES).map(over).collect()
    }

    /// The scanned values of the unknown with this index on its scale, ascending, each with the smallest misfit over
    /// all values of the others (infinite where all simulations failed). Empty without such an axis.
    pub fn line(&self, unknown: usize) -> Vec<(f64, f64)> {
        let least = |x: &f64| {
            let slice = self.points.iter().filter(|point| point.x[unknown] == *x);
            slice.map(|point| point.misfit).fold(f64::INFINITY, f64::min)
        };
        let axis = self.axes.get(unknown).into_iter().flatten();
        axis.map(|x| (*x, least(x))).collect()
    }

    /// The index on each axis of the point with this number in `points`, in which the last axis varies fastest.
    fn indices(&self, point: usize) -> Vec<usize> {
        let mut rest = point;
        let mut indices = vec![0; self.axes.len()];
        for (index, axis) in indices.iter_mut().zip(&self.axes).rev() {
            (*index, rest) = (rest % axis.len(), rest / axis.len());
        }
        indices
    }

    /// The misfit at the grid point with these `indices`, one on every axis; infinite where the simulation failed.
    fn misfit(&self, indices: &[usize]) -> f64 {
        let pairs = indices.iter().zip(&self.axes);
        self.points[pairs.fold(0, |point, (i, axis)| point * axis.len() + i)].misfit
    }

    /// Whether the misfit of the point with this number is below those of all its neighbors, diagonal ones included. Of
    /// neighbors with an equal misfit the first one in the order of the indices counts as lowest.
    fn is_lowest(&self, point: usize) -> bool {
        let (own, misfit) = (self.indices(point), self.points[point].misfit);
        self.neighbors(&own).iter().all(|other| {
            let other_misfit = self.misfit(other);
            // Equal neighbors, as on a plateau, are one minimum: the first of them.
            misfit < other_misfit || misfit == other_misfit && own < *other
        })
    }

    /// Indices on the axes of all other points that differ by at most one step on each axis from the point with the
    /// indices `own`.
    fn neighbors(&self, own: &[usize]) -> Vec<Vec<usize>> {
        let mut all = vec![Vec::new()];
        for (i, axis) in own.iter().zip(&self.axes) {
            let range = i.saturating_sub(1)..=(i + 1).min(axis.len() - 1);
            let longer = |head: &Vec<usize>| {
                let head = head.clone();
                range.clone().map(move |j| [&head[..], &[j]].concat())
            };
            all = all.iter().flat_map(longer).collect();
        }
        // The point itself is no neighbor.
        all.retain(|other| other != own);
        all
    }

    /// A lower bound of the misfit at which a descent from the point with this number may end. Minus infinity if any
    /// axis has fewer than [`FEWEST_VALUES`] values. Else it is infinite for a point that is not below all its
    /// neighbors: a descent from it leads into the basin of a better point. Otherwise it is the misfit less the sum,
    /// over all axes, of the rises to both neighbors: eight times the largest drop of parabolas, because basins are
    /// sharper. At an end of an axis the other side's rise counts twice.
    pub fn descent_bound(&self, point: usize) -> f64 {
        if self.axes.iter().any(|axis| axis.len() < FEWEST_VALUES) {
            return f64::NEG_INFINITY;
        }
        if !self.is_lowest(point) {
            return f64::INFINITY;
        }
        let (own, misfit) = (self.indices(point), self.points[point].misfit);
        let rise = |(k, axis): (usize, &Vec<f64>)| {
            let at = |i: usize| {
                let mut other = own.clone();
                other[k] = i;
                self.misfit(&other) - misfit
            };
            // Beyond an end of the axis the misfit is taken to rise as on the other side.
            let low = own[k].checked_sub(1);
            let high = Some(own[k] + 1).filter(|i| *i < axis.len());
            at(low.or(high).unwrap_or(own[k])) + at(high.or(low).unwrap_or(own[k]))
        };
        misfit - self.axes.iter().enumerate().map(rise).sum::<f64>()
    }

    /// The points with a finite misfit below those of all neighbors, diagonal ones included, the lowest first. Each has
    /// its spacing on every axis, the larger distance to the next value. A point at an end of an axis is no minimum,
    /// unless the axis has fewer than [`FEWEST_VALUES`] values.
    pub fn minima(&self) -> Vec<GridMinimum> {
        let is_minimum = |point: usize| {
            let is_inner = |(i, axis): (&usize, &Vec<f64>)| {
                axis.len() < FEWEST_VALUES || (*i > 0 && i + 1 < axis.len())
            };
            self.indices(point).iter().zip(&self.axes).all(is_inner) && self.is_lowest(point)
        };
        let spacing = |(axis, i): (&Vec<f64>, usize)| {
            let gap = |j: usize| axis.get(j + 1).map_or(0.0, |next| next - axis[j]);
            if axis.len() < 2 { f64::INFINITY } else { gap(i).max(gap(i.saturating_sub(1))) }
        };
        let minimum = |(index, point): (usize, &GridPoint)| GridMinimum {
            x: point.x.clone(),
            misfit: point.misfit,
            spacing: self.axes.iter().zip(self.indices(index)).map(spacing).collect(),
        };
        let points = self.points.iter().enumerate();
        let is_candidate =
            |(i, point): &(usize, &GridPoint)| point.misfit.is_finite() && is_minimum(*i);
        // Failed simulations have an infinite misfit and are no minima.
        let mut minima: Vec<GridMinimum> = points.filter(is_candidate).map(minimum).collect();
        minima.sort_by_cached_key(|minimum| total_order(minimum.misfit));
        minima
    }
}

#[cfg(test)]
impl ScanGrid {
    /// A grid with two basins, at (1, 0.7) and (5, 0.7), and a constant misfit between them.
    pub fn two_wells() -> Self {
        let axes = vec![(0..8).map(f64::from).collect(), vec![0.5, 0.6, 0.7, 0.8, 0.9]];
        let well = |x: f64, y: f64, a: f64| (x - a).powi(2) + 25.0 * (y - 0.7).powi(2);
        let points = axes[0].iter().flat_map(|x| {
            let row: &Vec<f64> = &axes[1];
            row.iter().map(|y| {
                let (deep, shallow) = (1.0 + well(*x, *y, 1.0), 3.0 + 0.5 * well(*x, *y, 5.0));
                GridPoint { x: vec![*x, *y], misfit: deep.min(shallow).min(5.0) }
            })
        });
        Self { points: points.collect(), axes: axes.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bound is below the minimum of a basin between two grid points, and infinite outside of basins.
    #[test]
    fn descent_bound_is_below_minima_between_grid_points() {
        let grid = ScanGrid::two_wells();
        for (index, GridPoint { x, misfit }) in grid.points.iter().enumerate() {
            match x[..] == [1.0, 0.7] || x[..] == [5.0, 0.7] {
                true => assert!(grid.descent_bound(index) < *misfit, "{x:?}"),
                false => assert_eq!(grid.descent_bound(index), f64::INFINITY, "{x:?}"),
            }
        }
        // A basin 1 - exp(-2 (x - place)^2), as narrow as those of a vibration; its minimum is 0.
        for (place, lowest) in [(2.5, 2), (2.8, 3), (3.0, 3)] {
            let axis: Vec<f64> = (0..8).map(f64::from).collect();
            let point = |x: &f64| GridPoint {
                x: vec![*x],
                misfit: 1.0 - (-2.0 * (x - place).powi(2)).exp(),
            };
            let grid = ScanGrid { points: axis.iter().map(point).collect(), axes: vec![axis] };
            let bound = grid.descent_bound(lowest);
            assert!(bound <= 0.0, "{place}: {bound}");
        }
        let point = GridPoint { x: vec![0.0], misfit: 1.0 };
        let one = ScanGrid { axes: vec![vec![0.0]], points: vec![point] };
        assert_eq!(one.descent_bound(0), f64::NEG_INFINITY);
    }

    /// The two basins are minima. A slope has its lowest point at an edge, and a constant misfit has no minimum.
    #[test]
    fn grid_minima_are_its_basins() {
        let minima = ScanGrid::two_wells().minima();
        let places: Vec<&[f64]> = minima.iter().map(|minimum| &minimum.x[..]).collect();
        assert_eq!(places, [&[1.0, 0.7][..], &[5.0, 0.7]]);
        let mut slope = ScanGrid::two_wells();
        slope.points.iter_mut().for_each(|point| point.misfit = point.x[0] + point.x[1]);
        assert!(slope.minima().is_empty());
        slope.points.iter_mut().for_each(|point| point.misfit = 1.0);
        assert!(slope.minima().is_empty());
    }
}

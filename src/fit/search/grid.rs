//! The misfit over a grid of starts: its minima are where fits may end.

use crate::fit::unknown::Unknown;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};

/// The misfit of the coarse model over the first period, against one unknown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Landscape {
    /// The unknown.
    pub name: Parameter,
    /// Its name with the experiments it is of, if it is not of all.
    pub label: String,
    /// Values of the unknown, ascending, in its unit.
    pub values: Vec<f64>,
    /// The least misfit over all values of the others; infinite, in JSON null, where nothing could be
    /// simulated.
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
        let over = |(i, axis): (usize, &Vec<f64>)| {
            let least = |x: &f64| {
                let slice = self.points.iter().filter(|(point, _)| point[i] == *x);
                slice.map(|(_, cost)| *cost).fold(f64::INFINITY, f64::min)
            };
            Landscape {
                name: unknowns[i].parameter,
                label: unknowns[i].to_string(),
                values: axis.iter().map(|x| unknowns[i].from_scale(*x)).collect(),
                misfit: axis.iter().map(least).collect(),
            }
        };
        self.axes.iter().enumerate().filter(|(_, axis)| axis.len() > 2).map(over).collect()
    }

    /// Inner points below all their neighbours, diagonal ones too, with the grid's spacing there;
    /// best first. The edges are slopes, not basins.
    pub fn minima(&self) -> Vec<(Vec<f64>, f64, Vec<f64>)> {
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

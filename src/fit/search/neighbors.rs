//! Minima beside one that leaves more than white noise.
//!
//! Where stiffness moves a rod only a little, as that of a pendulum's arm, every value leaves little of the motion, and
//! the grid of the scan is too coarse for the minima. A fit then ends in the wrong one, and explains the motion but
//! for a hundredth. Its residuals are correlated: noise of the recording is not. So the full model is evaluated along
//! each scanned unknown, more finely than the scan does, and the minima on these lines are starts.

use crate::error::Error;
use crate::fit::search::Search;
use crate::fit::search::damping::is_damping;
use crate::fit::search::optimum::Optimum;
use crate::numerics::half_sum_of_squares;
use crate::numerics::total_order;
use rayon::prelude::*;

/// Distance of the points on a line, on the scale of logarithms: a quarter of the scan's.
const SPACING: f64 = 0.18;
/// Points to each side of the minimum: a factor of four.
const POINTS: i32 = 8;
/// Length of the records that is compared, in first periods. Over longer ones the minima along a stiffness are
/// narrower than the spacing.
pub(crate) const PERIODS: f64 = 4.0;
/// Points with more than this many times the objective of the minimum are no starts.
const HIGHEST: f64 = 4.0;
/// So many lines are followed, and so many starts taken.
const MOST_LINES: usize = 3;
const MOST_STARTS: usize = 3;

impl Search<'_> {
    /// Starts beside a minimum: minima of the objective along the scanned unknowns, the lowest first.
    pub fn neighbors(&self, optimum: &Optimum) -> Result<Vec<Vec<f64>>, Error> {
        let first = self.first_periods(1.0);
        let horizons: Vec<f64> =
            first.iter().zip(self.durations()).map(|(t, end)| end.min(PERIODS * t)).collect();
        let mut starts = Vec::new();
        let lines: Vec<usize> = (0..self.unknowns.len()).filter(|j| self.is_scanned(*j)).collect();
        let here = self.objectives(&horizons, std::slice::from_ref(&optimum.x))?;
        for j in lines.into_iter().take(MOST_LINES) {
            let points = self.line(optimum, j);
            let objectives = self.objectives(&horizons, &points)?;
            let at = |i: usize| objectives.get(i).copied().unwrap_or(f64::INFINITY);
            let lowest = (0..points.len()).filter(|i| {
                let below = i.checked_sub(1).map_or(f64::INFINITY, at);
                at(*i) < below && at(*i) < at(i + 1) && at(*i) < HIGHEST * here[0]
            });
            // The valley of the minimum itself leads nowhere else.
            let is_other = |i: &usize| (points[*i][j] - optimum.x[j]).abs() > 0.5 * SPACING;
            starts.extend(lowest.filter(is_other).map(|i| (points[i].clone(), at(i))));
        }
        starts.sort_by_cached_key(|x| total_order(x.1));
        starts.truncate(MOST_STARTS);
        Ok(starts.into_iter().map(|(x, _)| x).collect())
    }

    /// Whether an unknown is a logarithm of which the scan had several values. The objective has one minimum along a
    /// damping.
    fn is_scanned(&self, j: usize) -> bool {
        let unknown = &self.unknowns[j];
        unknown.parameter.is_positive()
            && !is_damping(unknown)
            && self.journal.scanned_values(j).len() > 2
    }

    /// Points along an unknown through an optimum, in order.
    fn line(&self, optimum: &Optimum, j: usize) -> Vec<Vec<f64>> {
        let [low, high] = self.unknowns[j].scaled_bounds();
        let values = (-POINTS..=POINTS).map(|k| optimum.x[j] + SPACING * f64::from(k));
        let values = values.filter(|x| *x > low && *x < high);
        let point = |value| {
            let mut x = optimum.x.clone();
            x[j] = value;
            x
        };
        values.map(point).collect()
    }

    /// The objective of the full model at some points up to `horizons`, s; infinite where it cannot be simulated.
    fn objectives(&self, horizons: &[f64], points: &[Vec<f64>]) -> Result<Vec<f64>, Error> {
        let task = self.task();
        let objective = |x: &Vec<f64>| {
            let search = task.search();
            let found = search.residuals(horizons).and_then(|residuals| residuals.residuals(x));
            (found.map(|residuals| half_sum_of_squares(&residuals)), search.work.total())
        };
        let found: Vec<_> = points.par_iter().map(objective).collect();
        let mut objectives = Vec::with_capacity(points.len());
        for (objective, work) in found {
            self.work.add(work);
            match objective {
                Ok(objective) => objectives.push(objective),
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                Err(_) => objectives.push(f64::INFINITY),
            }
        }
        Ok(objectives)
    }
}

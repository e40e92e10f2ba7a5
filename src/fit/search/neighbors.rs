//! Starts near a minimum whose residuals are more than white noise.
//!
//! Where the stiffness hardly changes the motion, as that of a pendulum's arm, every value explains most of it. The
//! grid of the scan is then too coarse for the minima. A fit ends in a wrong minimum with residuals of about 1 % of the
//! motion, which are correlated. Input: such an optimum. The objective of a coarse model over [`PERIODS`] first periods
//! is evaluated on lines through it, along one unknown each. Their points are [`SPACING`] apart on the logarithmic
//! scale, closer than those of the scan. If the coarse model fails at the optimum, the full one is used. There are at
//! most [`MOST_LINES`] lines, along scanned positive parameters other than dampings; points are strictly within the
//! bounds. Output: starts on the unknowns' scales, at most [`MOST_STARTS`], the lowest first. They are the minima on
//! these lines farther than half a [`SPACING`] from the optimum and below [`HIGHEST`] times its objective in the same
//! model. An interruption, and a coarse scene that is not valid, are errors.

use crate::error::{Error, none_on_failure};
use crate::fit::search::Search;
use crate::fit::search::coarse::ScanModel;
use crate::fit::search::damping::may_vanish;
use crate::fit::search::optimum::Optimum;
use crate::numerics::half_sum_of_squares;
use crate::numerics::total_order;
use rayon::prelude::*;

/// Distance of the points on a line, on the logarithmic scale: a quarter of that of the scan.
const SPACING: f64 = 0.18;
/// Number of points to each side of the minimum: they span a factor of four.
const POINTS: i32 = 8;
/// Time steps of the coarse model in the first period: their error of the frequency is 0.6 %, and points of the line
/// differ by 9 %.
const COARSE_STEPS: f64 = 24.0;
/// Horizon of the objective, in first periods. Over longer horizons the minima along a stiffness are
/// narrower than the spacing.
pub(crate) const PERIODS: f64 = 4.0;
/// Largest objective of a start over that of the minimum, both of the coarse model. A larger one adds starts that are
/// less likely to end lower.
const HIGHEST: f64 = 4.0;
/// Largest number of unknowns along which lines are evaluated. Each line costs 17 simulations of the coarse model.
const MOST_LINES: usize = 3;
/// Largest number of starts. Each costs a fit of the full model.
const MOST_STARTS: usize = 3;

/// A point on a line, on the unknowns' scales of the full model, with its objective of the coarse model.
struct LinePoint {
    x: Vec<f64>,
    objective: f64,
}

impl Search<'_> {
    /// Starts near an optimum, on the unknowns' scales: minima of the coarse objective along at most [`MOST_LINES`]
    /// scanned unknowns, all others as at the optimum. They are more than half a [`SPACING`] from it and below
    /// [`HIGHEST`] times its objective, the lowest first, at most [`MOST_STARTS`]. Each experiment ends after
    /// [`PERIODS`] first periods. If the coarse model fails at the optimum the full one is evaluated. Empty without
    /// such minima. An error if the user stops, or a coarse scene is invalid.
    pub fn neighboring_starts(&self, optimum: &Optimum) -> Result<Vec<Vec<f64>>, Error> {
        let first = self.first_periods(1.0);
        let horizons: Vec<f64> =
            first.iter().zip(self.durations()).map(|(t, end)| end.min(PERIODS * t)).collect();
        let mut coarse = ScanModel::new(self, &first, COARSE_STEPS)?;
        let mut own = self.coarse_objectives(&coarse, &horizons, vec![optimum.x.clone()])?;
        if own[0].objective.is_infinite() {
            // Soft rods with large steps cannot always be simulated.
            coarse = ScanModel::from_full_model(self);
            own = self.coarse_objectives(&coarse, &horizons, vec![optimum.x.clone()])?;
        }
        // Only positive parameters that are no damping have several minima of the objective along them.
        let mut starts: Vec<LinePoint> = Vec::new();
        let lines: Vec<usize> = (0..self.unknowns.len()).filter(|j| self.is_scanned(*j)).collect();
        let highest = HIGHEST * own[0].objective;
        for j in lines.into_iter().take(MOST_LINES) {
            let points = self.coarse_objectives(&coarse, &horizons, self.line(optimum, j))?;
            let at = |i: Option<usize>| {
                i.and_then(|i| points.get(i)).map_or(f64::INFINITY, |point| point.objective)
            };
            let is_minimum: Vec<bool> = (0..points.len())
                .map(|i| {
                    let own = points[i].objective;
                    own < at(i.checked_sub(1)) && own < at(Some(i + 1)) && own < highest
                })
                .collect();
            // The basin of the optimum itself is known.
            let is_other = |point: &LinePoint| (point.x[j] - optimum.x[j]).abs() > 0.5 * SPACING;
            let minima = points.into_iter().zip(is_minimum).filter(|(_, is_minimum)| *is_minimum);
            starts.extend(minima.map(|(point, _)| point).filter(is_other));
        }
        starts.sort_by_cached_key(|point| total_order(point.objective));
        starts.truncate(MOST_STARTS);
        Ok(starts.into_iter().map(|point| point.x).collect())
    }

    /// Whether the scan had at least three values of the unknown with index `j`, and it is positive and no damping.
    /// Along a damping the objective has one minimum.
    fn is_scanned(&self, j: usize) -> bool {
        let unknown = &self.unknowns[j];
        unknown.parameter.is_positive()
            && !may_vanish(unknown)
            && self.journal.scanned_values(j).len() > 2
    }

    /// The points of all unknowns, on their scales, on the line through an optimum along unknown `j`. They are
    /// [`SPACING`] apart, up to [`POINTS`] to each side, strictly within the bounds, ascending. The optimum is one of
    /// them, unless it is at a bound.
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

    /// The objective of a `coarse` model at each of `points` of the full model, in their order. It is half the sum of
    /// squares of the robust residuals, priors included: one number for all experiments. Each experiment is simulated
    /// up to its own of the `horizons`, s. The returned points stay those of the full model. Infinite where a
    /// simulation fails; an interruption is an error. Several threads compute; the work is added to that of this
    /// search.
    fn coarse_objectives(
        &self,
        coarse: &ScanModel,
        horizons: &[f64],
        points: Vec<Vec<f64>>,
    ) -> Result<Vec<LinePoint>, Error> {
        let model = coarse.search(self);
        let residuals = model.residuals(horizons)?;
        let evaluate = |x: Vec<f64>| {
            // The minimum of the coarse model is shifted by its mesh: the point is shifted likewise.
            let reduced = coarse.reduced_point(self, x.clone());
            let found = none_on_failure(residuals.residuals(&reduced))?;
            let objective =
                found.map_or(f64::INFINITY, |residuals| half_sum_of_squares(&residuals));
            Ok(LinePoint { x, objective })
        };
        let found = points.into_par_iter().map(evaluate).collect();
        self.work.add(model.work.total());
        found
    }
}

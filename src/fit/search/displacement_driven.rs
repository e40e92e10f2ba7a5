//! Search of fits of rods whose ends are prescribed by a recording (displacement driven).
//!
//! Input: a search whose moving rods all have recorded ends. The recording forces the motion: no period can be missed,
//! as in a free vibration. The fit therefore begins at one start over the whole recordings: given start, else prior
//! mean, else the scene's value. If the only Young's modulus has neither start nor prior, or another parameter has no
//! value to start from, the full model is scanned over the first period instead. Only Young's modulus has several
//! values there. Up to [`DESCENTS`] minima of the scan (at most [`COMPETITIVE`] times the lowest) are then starts. Each
//! fit is repeated from larger dampings where these are near zero. Output: the optimum with the lowest objective, and
//! its leverage weights in the search (`driven_optimum`). If no start leads to an optimum, that is an error; so is an
//! interruption.
//!
//! Where such a rod whips, the motion depends extremely on the parameters and on effects that the model lacks: values
//! there have derivatives far above all others, and would dominate the fit. The leverage of a value is
//! `sqrt(sum_j J_ij^2/sum_k J_kj^2)`, with the derivative `J_ij` of value `i` by unknown `j`: its fraction of the
//! squared derivatives of all values by an unknown, summed over the unknowns, and the root. Values whose leverage
//! exceeds the limit of [`MAX_LEVERAGE`] medians get the weight `limit/leverage`. Weights and fits alternate; the
//! weights are computed at most [`WEIGHTINGS`] times. The sum over the unknowns keeps local effects: a curvature of the
//! rod at one place moves the markers there far more than the others without a whip.

use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::residuals::Evaluation;
use crate::fit::search::Search;
use crate::fit::search::coarse::ScanModel;
use crate::fit::search::fitted::MeasuredResiduals;
use crate::fit::search::journal::SearchStage;
use crate::fit::search::optimum::{NO_START, Optimum, Tolerances};
use crate::fit::search::scan::Candidate;
use crate::fit::search::sensitivity_growth::are_alike;
use crate::fit::unknown::Unknown;
use crate::numerics::half_sum_of_squares;
use crate::numerics::total_order;
use statrs::statistics::{Data, Median};

/// Largest leverage of a value with weight 1, over the median leverage. A smaller number down-weights more values.
const MAX_LEVERAGE: f64 = 10.0;
/// Root of the sum of squares of an unknown's derivatives, in units of the noise, below which the unknown is left out
/// of the leverage. With a smaller bound unknowns without effect on the data change the weights.
const NO_EFFECT: f64 = 0.1;
/// Largest number of times that the weights are computed: at the start, and after the fits with them.
const WEIGHTINGS: usize = 3;
/// Tolerances of the fits between two weightings: only their end matters, as the start of the next one.
const BETWEEN_WEIGHTINGS: Tolerances = Tolerances { step: 1e-10, noise: 0.1, iterations: 12 };
/// Largest difference of the logarithms of two weights that are taken to be the same. At it the iteration of weights
/// and fits ends.
const SAME_WEIGHT: f64 = 0.2;
/// Largest number of minima of a scan that are refined. Each costs a complete fit.
const DESCENTS: usize = 2;
/// Largest misfit of a minimum of the scan that is refined, over the lowest one. A larger ratio refines worse minima,
/// at the cost of a fit each.
const COMPETITIVE: f64 = 1.5;

/// An optimum with the leverage weight of each of its residuals, with which it was found.
struct WeightedOptimum {
    optimum: Optimum,
    weights: Vec<f64>,
}

impl Search<'_> {
    /// Whether any experiment has a recorded motion (or a gauge over time), and in all that have one, a recording
    /// prescribes ends: `supports.path` of a rod, recorded supports of a structure.
    pub fn is_displacement_driven(&self) -> bool {
        let is_driven = |experiment: &Experiment| {
            let scene = experiment.problem.scene();
            let structure = scene.structure.as_ref();
            scene.supports.path.is_some() || structure.is_some_and(|own| own.has_recorded_ends())
        };
        let mut moving = self.experiments.iter().filter(|e| e.moves()).peekable();
        moving.peek().is_some() && moving.all(is_driven)
    }

    /// The optimum with the lowest objective of all starts on the whole recordings. Each start has leverage weights of
    /// its own: two optima are compared with the smaller of both weights of each value. The weights of the best one
    /// become those of the search. An error if no start leads to an optimum, or if the user stops the fit.
    pub fn driven_optimum(&mut self) -> Result<Optimum, Error> {
        // Each start has its own leverage weights, so that costs are compared with common ones.
        let mut best: Option<WeightedOptimum> = None;
        let mut failure = None;
        for start in self.driven_starts()? {
            match self.fit_driven(start) {
                Ok(optimum) => {
                    let is_lower = |best: &WeightedOptimum| {
                        self.cost_with(&optimum, &best.weights)
                            < self.cost_with(&best.optimum, &best.weights)
                    };
                    if best.as_ref().is_none_or(is_lower) {
                        let weights = self.leverage_weights.clone();
                        best = Some(WeightedOptimum { optimum, weights });
                    }
                }
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                Err(error) => failure = Some(error),
            }
        }
        // A failure is reported only if no start succeeded.
        let best = best.ok_or_else(|| match failure {
            Some(error) => Error::Fit(format!(
                "the scene cannot be simulated at the start values: {error}. Give another start"
            )),
            None => Error::Fit(NO_START.into()),
        })?;
        self.leverage_weights = best.weights;
        Ok(best.optimum)
    }

    /// The objective (half the sum of the robust losses, priors included) at an optimum, where each value has the
    /// smaller one of two weights: those of this search and `weights`. Beyond the end of `weights` it is 1.
    fn cost_with(&self, optimum: &Optimum, weights: &[f64]) -> f64 {
        let weight = |k: usize| weights.get(k).copied().unwrap_or(1.0).min(self.leverage_weight(k));
        // Residuals of the priors have no leverage weights.
        let mut cost = half_sum_of_squares(&optimum.residuals[optimum.counts.iter().sum()..]);
        for MeasuredResiduals { measurement, residuals, rows, .. } in self.measured(optimum) {
            let loss = measurement.loss();
            let robust = |(k, r)| 0.5 * loss.robust(weight(k) * r)[0].powi(2);
            cost += rows.zip(residuals).map(robust).sum::<f64>();
        }
        cost
    }

    /// The start points, on the unknowns' scales. If every unknown has a [start](Self::driven_start) this is the only
    /// point. Else they are minima of a scan of the full model over the first period, the lowest first. These are
    /// points not above those before and after in the order of the grid. At most [`DESCENTS`] are taken, with a misfit
    /// of at most [`COMPETITIVE`] times the lowest. An error if no point of the scan can be simulated, or if the user
    /// stops.
    fn driven_starts(&self) -> Result<Vec<Vec<f64>>, Error> {
        // A start of all unknowns makes a scan unnecessary: the recording forces the motion.
        let given = |u: &Unknown| Some(u.to_scale(self.driven_start(u)?));
        if let Some(start) = self.unknowns.iter().map(given).collect() {
            return Ok(vec![start]);
        }
        let first = self.first_periods(1.0);
        let scanned = self.scan(&ScanModel::from_full_model(self), &first, 1)?;
        let cost = |k: Option<usize>| {
            k.and_then(|k| scanned.get(k)).map_or(f64::INFINITY, |candidate| candidate.cost)
        };
        // Local minima of the scan over the modulus, both neighbors included.
        let is_minimum = |k: &usize| {
            cost(Some(*k)) <= cost(k.checked_sub(1)) && cost(Some(*k)) <= cost(Some(k + 1))
        };
        let mut minima: Vec<&Candidate> =
            (0..scanned.len()).filter(is_minimum).map(|k| &scanned[k]).collect();
        // Only minima of the scan with a competitive misfit descend: each descent costs many simulations.
        minima.sort_by_cached_key(|x| total_order(x.cost));
        let least = minima.first().map_or(0.0, |c| c.cost);
        let competitive = minima.into_iter().filter(|c| c.cost <= COMPETITIVE * least);
        Ok(competitive.take(DESCENTS).map(|c| c.x.clone()).collect())
    }

    /// The start of an unknown, in its unit: the given one, else the mean of the prior, else the value of the scene.
    /// `None` for Young's modulus without start and prior, which is scanned, and where the scene has no value to start
    /// from. Of several moduli of a structure none is scanned: that would cost the product of their values.
    pub(super) fn driven_start(&self, unknown: &Unknown) -> Option<f64> {
        let hint = unknown.start.or(unknown.prior.map(|prior| prior.mean));
        let of_structure = |unknown: &Unknown| unknown.parameter.is_of_structure();
        let moduli =
            self.unknowns.iter().filter(|own| own.is_stiffness() && of_structure(own)).count();
        if hint.is_some() || (unknown.is_stiffness() && (!of_structure(unknown) || moduli == 1)) {
            return hint;
        }
        self.scene_value(unknown)
    }

    /// The value of an unknown in the first scene that it belongs to, in its unit. `None` if that has none, or if a
    /// positive parameter is zero there, whose logarithm is no start.
    pub(super) fn scene_value(&self, unknown: &Unknown) -> Option<f64> {
        let own = self.experiments.iter().find(|e| unknown.is_of(e))?;
        let value = unknown.parameter.of(own.problem.scene())?;
        (value > 0.0 || !unknown.parameter.is_positive()).then_some(value)
    }

    /// Fits the whole recordings from the start `x`, on the unknowns' scales. Leverage weights at the start, fits with
    /// loose tolerances and weights at their ends alternate. They end when the logarithm of every weight changes by
    /// less than [`SAME_WEIGHT`], or after [`WEIGHTINGS`] weightings. A final fit with full tolerances follows, and
    /// another one from [larger dampings](Search::with_raised_damping) where these are near zero. Its end is recorded
    /// as a minimum in the journal. The weights become those of the search. An error if the start or one of the fits
    /// fails.
    fn fit_driven(&mut self, x: Vec<f64>) -> Result<Optimum, Error> {
        self.leverage_weights.clear();
        let residuals = self.all_residuals()?;
        let jacobian = residuals.plain_jacobian(&x)?;
        // Rows of priors are behind those of the measurements, and have the weight 1.
        let measured: usize = residuals.counts().iter().sum();
        self.leverage_weights = weights_by_leverage(&jacobian[..measured]);
        let mut start = Evaluation {
            residuals: residuals.plain_residuals(&x)?,
            jacobian: Some(jacobian),
            halved: residuals.has_halved_steps(),
            x,
        };
        // Weights and optimum depend on each other: a fixed-point iteration from the weights at the start.
        for _ in 1..WEIGHTINGS {
            let from = start.x.clone();
            let known = self.all_residuals()?.with_evaluation(start);
            let near = self.optimize(known, &from, BETWEEN_WEIGHTINGS, Some(SearchStage::Full))?;
            let weights = weights_by_leverage(&near.jacobian[..measured]);
            start = near.into_evaluation();
            if are_alike(&weights, &self.leverage_weights, SAME_WEIGHT) {
                break;
            }
            self.leverage_weights = weights;
        }
        // The final fit has the full tolerances, with the weights of the last iteration.
        let optimum = self.with_raised_damping(self.polish_from(start)?)?;
        self.add_minimum(&optimum);
        Ok(optimum)
    }
}

/// The leverage weights of the residuals of measurements, from their rows of the Jacobian in units of the noise. The
/// leverage of row `i` is `sqrt(sum_j J_ij^2/sum_k J_kj^2)`, without columns below [`NO_EFFECT`]; above
/// [`MAX_LEVERAGE`] medians of the nonzero leverages the weight is this limit over the leverage, else 1. Empty where
/// all are 1.
fn weights_by_leverage(rows: &[Vec<f64>]) -> Vec<f64> {
    // The leverage of a row: its part of the squared norm of each column, summed over the columns.
    let mut squares = vec![0.0; rows.len()];
    for j in 0..rows.first().map_or(0, Vec::len) {
        let effect = rows.iter().map(|row| row[j] * row[j]).sum::<f64>();
        if effect < NO_EFFECT * NO_EFFECT {
            continue;
        }
        for (square, row) in squares.iter_mut().zip(rows) {
            *square += row[j] * row[j] / effect;
        }
    }
    let positive: Vec<f64> = squares.iter().map(|s| s.sqrt()).filter(|size| *size > 0.0).collect();
    if positive.is_empty() {
        return Vec::new();
    }
    // The median is independent of the rows of large leverage.
    let most = MAX_LEVERAGE * Data::new(positive).median();
    let weights: Vec<f64> = squares.iter().map(|square| most / square.sqrt().max(most)).collect();
    if weights.iter().all(|t| *t == 1.0) { Vec::new() } else { weights }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Derivatives by four unknowns. Each moves the values of its own place by 1 and the others by `far`.
    fn local(far: f64) -> Vec<Vec<f64>> {
        (0..400).map(|i| (0..4).map(|j| if i % 4 == j { 1.0 } else { far }).collect()).collect()
    }

    /// Every value has the same leverage: the sum over the unknowns is 1 of 100 for each.
    #[test]
    fn local_effects_of_unknowns_keep_full_weight() {
        assert!(weights_by_leverage(&local(1e-3)).is_empty());
    }

    /// Values with 50 times the median leverage have the weight 10/50. An unknown without effect changes nothing.
    #[test]
    fn high_leverage_rows_are_down_weighted() {
        let mut rows = local(0.1);
        for row in &mut rows[..8] {
            row.iter_mut().for_each(|d| *d *= 50.0);
        }
        rows.iter_mut().enumerate().for_each(|(i, row)| row.push(1e-6 * i as f64));
        let found = weights_by_leverage(&rows);
        for (i, weight) in found.iter().enumerate() {
            assert_relative_eq!(*weight, if i < 8 { 0.2 } else { 1.0 }, max_relative = 1e-12);
        }
        assert_eq!(found.len(), 400);
    }
}

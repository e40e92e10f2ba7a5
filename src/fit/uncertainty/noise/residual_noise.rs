//! Variance of the residuals at an optimum, weights of the rows of the Jacobian, and effects of robust losses.
//!
//! Residuals are in units of sigma. Their variance is 1 if all sigmas are stated, or where weights depend on the fit
//! (sigma is then estimated before). Else it is `sum (w r)^2/nu`, with the leverage weights `w` and `nu` degrees of
//! freedom. These are the number of residuals, those of priors included, less unknowns and unknown arc lengths, and
//! less the sum of `1 - w^2` where the weights are those of growing sensitivities. With such weights or arc lengths
//! `nu` is at least 1.
//!
//! A robust loss `rho` with `psi = rho'/2` reduces the information of every value to `(mean psi')^2/mean psi^2`, with
//! Huber's correction for the number of unknowns. A rise of twice the misfit then has the scale `sum psi^2/sum psi'`
//! (Huber 1981). The weight of a row is the root of this information (1 for squares and for priors) times its leverage
//! weight.
//!
//! [`ResidualNoise::new`] computes variance, degrees of freedom and weights at an optimum, the basis of covariance and
//! intervals. [`residual_rms`] and [`loss_effects`] are entries of the report. [`weighted_rows`] and
//! [`weighted_residuals`] are the Jacobian and the residuals (`psi`) times these weights. [`misfit_slopes`] and
//! [`score_covariance`] are the derivatives of the misfit by the residuals, and the covariance of its gradient by the
//! unknowns.

use crate::fit::measurement::experiment::all;
use crate::fit::measurement::loss::Loss;
use crate::fit::misfit::initial_sigmas::weights_depend_on_the_fit;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::search::optimum::Optimum;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Size of a residual, in sigma, above which a [`LossEffect`] counts it as beyond five sigma.
const OUTLYING: f64 = 5.0;

/// Variance and weights of the residuals at an optimum, without autocorrelation.
pub(crate) struct ResidualNoise {
    /// Variance of the residuals in units of sigma squared; 1 where all sigmas are stated or have been estimated
    /// before.
    pub variance: f64,
    /// Whether `variance` is estimated from the residuals.
    pub is_estimated: bool,
    /// Rise of twice the misfit by one standard deviation of a parameter: the variance, or `sum psi^2/sum psi'` of
    /// robust losses.
    pub misfit_scale: f64,
    /// Degrees of freedom of the variance, also of a sigma that was estimated before; none where all sigmas are stated.
    pub degrees_of_freedom: Option<f64>,
    /// Weight of every row: root of the information of its loss, times the leverage weight.
    pub weights: Vec<f64>,
}

impl ResidualNoise {
    /// Estimates the variance of the residuals at an optimum, its degrees of freedom, and the weights of the rows. The
    /// degrees of freedom are the number of residuals, those of priors included, less the numbers of unknowns and of
    /// unknown arc lengths. Weights `w` of growing sensitivities lower them by the sum of `1 - w^2`. With such weights
    /// or arc lengths they are at least 1. The variance is 1 if all sigmas are stated, or where the weights depend on
    /// the fit, as sigma is then estimated before. The misfit scale is the variance, or `sum psi^2/sum psi'` over all
    /// measured values if any loss is robust. The weight of a row is the root of the information of its loss times the
    /// entry of the row in the leverage weights of the search. The root is one number for all rows of a measurement,
    /// and 1 for priors.
    pub fn new(fitted: Fitted) -> Self {
        let Fitted { search, optimum } = fitted;
        let total = optimum.residuals.len();
        // A value with the leverage weight w counts as w^2 values; unknown arc lengths use up a value each.
        let growth_weights = search.growth_weights().iter();
        let lost: f64 = growth_weights.map(|weight| 1.0 - weight * weight).sum();
        let arc_lengths: usize = all(search.experiments).map(|(_, m)| m.fitted_nuisances()).sum();
        let freedom = total as f64 - search.unknowns.len() as f64 - lost - arc_lengths as f64;
        let freedom = if lost > 0.0 || arc_lengths > 0 { freedom.max(1.0) } else { freedom };

        // Where the weights depend on the fit, sigma has been estimated before and is the unit of the residuals.
        let is_stated = all(search.experiments).all(|(_, m)| m.sigma().is_some());
        let is_estimated =
            !is_stated && !weights_depend_on_the_fit(search.experiments, search.unknowns);
        let weighted = |(k, r): (usize, &f64)| (search.leverage_weight(k) * r).powi(2);
        let square: f64 = optimum.residuals.iter().enumerate().map(weighted).sum();
        let variance = if is_estimated { square / freedom } else { 1.0 };

        // Weights by the losses; the sums are those of the misfit scale.
        let mut weights = Vec::with_capacity(total);
        let (mut sum_of_slopes, mut sum_of_squares) = (0.0, 0.0);
        for MeasuredResiduals { measurement, residuals, .. } in fitted.measured() {
            let loss = measurement.loss();
            // Each measurement has its share of the fitted unknowns.
            let share = search.unknowns.len() * residuals.len() / total;
            let weight = loss.information(residuals, share).sqrt();
            weights.extend(std::iter::repeat_n(weight, residuals.len()));
            for r in residuals {
                let [psi, slope] = loss.influence(*r);
                sum_of_slopes += slope;
                sum_of_squares += psi * psi;
            }
        }
        // Priors have squares and no leverage weight.
        weights.resize(total, 1.0);
        weights.iter_mut().zip(&search.leverage_weights).for_each(|(w, leverage)| *w *= leverage);
        let is_robust = all(search.experiments).any(|(_, m)| m.loss().is_robust());
        Self {
            variance,
            is_estimated,
            misfit_scale: if is_robust { sum_of_squares / sum_of_slopes } else { variance },
            degrees_of_freedom: (!is_stated).then_some(freedom),
            weights,
        }
    }
}

/// The rows of a Jacobian, each times its weight, in their order; rows beyond the end of `weights` are left out.
pub(crate) fn weighted_rows(rows: &[Vec<f64>], weights: &[f64]) -> Vec<Vec<f64>> {
    let scaled = |(row, w): (&Vec<f64>, &f64)| row.iter().map(|d| d * w).collect();
    rows.iter().zip(weights).map(scaled).collect()
}

/// `psi(r)`, half the derivative of the loss `rho`, of each of the `residuals` of a measurement, in their order.
fn influences(loss: Loss, residuals: &[f64]) -> impl Iterator<Item = f64> {
    residuals.iter().map(move |r| loss.influence(*r)[0])
}

/// `psi` of all residuals in their order, those of priors as they are, each times the weight of its row. For squares
/// `psi` is the residual.
pub(crate) fn weighted_residuals(fitted: Fitted, noise: &ResidualNoise) -> DVector<f64> {
    let all = &fitted.optimum.residuals;
    let own = fitted.measured().flat_map(|own| influences(own.measurement.loss(), own.residuals));
    let mut weighted: Vec<f64> = own.collect();
    weighted.extend_from_slice(&all[weighted.len()..]);
    weighted.iter_mut().zip(&noise.weights).for_each(|(r, w)| *r *= w);
    weighted.into()
}

/// Derivatives of the misfit by the residuals at an optimum, one each: `w psi(w r)` with the leverage weights `w`.
pub(crate) fn misfit_slopes(residuals: &Residuals, optimum: &Optimum) -> Vec<f64> {
    let losses = residuals.weighted_losses();
    losses.iter().zip(&optimum.residuals).map(|(loss, r)| loss.influence(*r)).collect()
}

/// Covariance of the gradient of the misfit by the unknowns on their scales: the sum of `w^2 m j j'` over the
/// unweighted rows `j` of the Jacobian. Here `m` is the mean of `psi^2` over the measurement of the row (1 for priors),
/// and `w` the leverage weight of the row.
pub(crate) fn score_covariance(fitted: Fitted) -> DMatrix<f64> {
    let Fitted { search, optimum } = fitted;
    let mut squares = Vec::with_capacity(optimum.residuals.len());
    for MeasuredResiduals { measurement, residuals, .. } in fitted.measured() {
        let sum: f64 = influences(measurement.loss(), residuals).map(|psi| psi.powi(2)).sum();
        // A single value does not estimate its own variance: all values of a measurement share one mean of psi^2.
        let mean = sum / residuals.len().max(1) as f64;
        squares.extend(std::iter::repeat_n(mean, residuals.len()));
    }
    squares.resize(optimum.residuals.len(), 1.0);
    squares.iter_mut().zip(&search.leverage_weights).for_each(|(square, w)| *square *= w * w);
    let n = optimum.x.len();
    let rows = optimum.jacobian.iter().zip(&squares);
    DMatrix::from_fn(n, n, |i, j| rows.clone().map(|(row, square)| square * row[i] * row[j]).sum())
}

/// Root mean square residual, unweighted, of all positions, m. Without positions it is that of all frequencies, rad/s,
/// else of all measurements with the unit of the first one. 0 without measurements.
pub(crate) fn residual_rms(fitted: Fitted) -> f64 {
    let of_unit = |unit: &str| {
        let (mut sum, mut count) = (0.0, 0);
        for own in fitted.measured().filter(|own| own.measurement.unit() == unit) {
            let sigmas = own.measurement.sigmas(own.sigma);
            sum += own.residuals.iter().zip(sigmas).map(|(r, s)| (r * s).powi(2)).sum::<f64>();
            count += own.residuals.len();
        }
        (count > 0).then(|| (sum / count as f64).sqrt())
    };
    // Units are not mixed: positions have priority.
    let first = all(fitted.search.experiments).next().map_or("m", |(_, m)| m.unit());
    of_unit("m").or_else(|| of_unit("rad/s")).or_else(|| of_unit(first)).unwrap_or(0.0)
}

/// Effect of a robust loss on a measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct LossEffect {
    /// Name of the measurement.
    pub observation: String,
    /// Loss function of the measurement.
    pub loss: Loss,
    /// Number of down-weighted values, beyond the scale of the loss.
    pub down_weighted: usize,
    /// Number of values with residuals above five sigma.
    pub beyond_5_sigma: usize,
    /// Number of values of the measurement.
    pub values: usize,
    /// Ratio of standard errors to those of least squares on normal noise of the same sigma: about
    /// 1.03 for clean data.
    pub std_error_factor: f64,
}

impl LossEffect {
    /// Adds another measurement with the same name. Counts add up. The common factor of the standard errors follows
    /// from the sum of the information, the number of values over the squared factor.
    fn merge(&mut self, other: &Self) {
        let [own, others] = [self.values as f64, other.values as f64];
        let information =
            own / self.std_error_factor.powi(2) + others / other.std_error_factor.powi(2);
        self.std_error_factor = ((own + others) / information).sqrt();
        self.down_weighted += other.down_weighted;
        self.beyond_5_sigma += other.beyond_5_sigma;
        self.values += other.values;
    }
}

/// Effects of the robust losses, one entry per measurement with such a loss, in their order; all markers of a recording
/// share one. Values beyond the scale of the loss, and beyond [`OUTLYING`] sigma, are counted. The factor of the
/// standard errors is the inverse of the largest weight of its rows in `noise`; 1 without values.
pub(crate) fn loss_effects(fitted: Fitted, noise: &ResidualNoise) -> Vec<LossEffect> {
    let mut effects: Vec<LossEffect> = Vec::new();
    for MeasuredResiduals { experiment, measurement, residuals, rows, .. } in fitted.measured() {
        let loss = measurement.loss();
        if loss == Loss::Squares {
            continue;
        }
        let beyond = |size: f64| residuals.iter().filter(|r| r.abs() > size).count();
        // Values of one loss share a weight, but for their leverage.
        let largest_weight = noise.weights[rows].iter().copied().reduce(f64::max);
        let effect = LossEffect {
            observation: experiment.group(measurement),
            loss,
            down_weighted: beyond(loss.scale()),
            beyond_5_sigma: beyond(OUTLYING),
            values: residuals.len(),
            std_error_factor: largest_weight.map_or(1.0, f64::recip),
        };
        // Markers of one recording follow each other.
        match effects.last_mut() {
            Some(last)
                if measurement.marker().is_some() && last.observation == effect.observation =>
            {
                last.merge(&effect);
            }
            _ => effects.push(effect),
        }
    }
    effects
}

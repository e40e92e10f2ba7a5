//! What the residuals say of the noise, and the noise of what is worth how much: weights of the
//! measurements in the fit, and of the residuals in its errors.

use crate::fit::measurement::experiment::all;
use crate::fit::measurement::loss::Loss;
use crate::fit::misfit::initial_sigmas::weights_depend_on_the_fit;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::noise::coverage_factor::{one_sided95, quantile95};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// What the noise at an optimum makes of misfits and derivatives.
pub(crate) struct Noise {
    /// Variance of the residuals under squares; 1 when sigma is known or was estimated before.
    pub variance: f64,
    /// Whether that is estimated from the residuals.
    pub is_estimated: bool,
    /// A rise of twice the misfit by the square of a quantile times this ends an interval.
    pub rise: f64,
    /// How many standard deviations a 95 % interval reaches to each side.
    pub reach: f64,
    /// How many it reaches up when it is open downward.
    pub up: f64,
    /// Degrees of freedom from which it was estimated; none where sigma is given.
    pub freedom: Option<f64>,
    /// Root of the information of every residual: below 1 under robust losses.
    pub weights: Vec<f64>,
}

impl Noise {
    /// What the residuals at an optimum say of the noise.
    pub fn at(fitted: Fitted) -> Self {
        let Fitted { search, optimum } = fitted;
        let total = optimum.residuals.len();
        // Values of small leverage weights are less than one value each.
        let weights = search.growth_weights().iter();
        let lost: f64 = weights.map(|weight| 1.0 - weight * weight).sum();
        // Unknown arc lengths use up a value each.
        let arc_lengths: usize = all(search.experiments).map(|(_, m)| m.fitted_arc_lengths()).sum();
        let freedom = (total - search.unknowns.len()) as f64 - lost - arc_lengths as f64;
        let freedom = if lost > 0.0 || arc_lengths > 0 { freedom.max(1.0) } else { freedom };
        let known = all(search.experiments).all(|(_, m)| m.sigma().is_some());
        let settled = known || weights_depend_on_the_fit(search.experiments, search.unknowns);
        let weighted = |(k, r): (usize, &f64)| (search.leverage_weight(k) * r).powi(2);
        let square: f64 = optimum.residuals.iter().enumerate().map(weighted).sum();
        let variance = if settled { 1.0 } else { square / freedom };
        let mut weights = Vec::with_capacity(total);
        // Sums of psi' and psi^2 (Huber 1981).
        let (mut slope, mut square) = (0.0, 0.0);
        for MeasuredResiduals { measurement, residuals, .. } in fitted.measured() {
            let loss = measurement.loss();
            let part = search.unknowns.len() * residuals.len() / total;
            let weight = loss.information(residuals, part).sqrt();
            weights.extend(std::iter::repeat_n(weight, residuals.len()));
            for r in residuals {
                let [psi, by_r] = loss.influence(*r);
                (slope, square) = (slope + by_r, square + psi * psi);
            }
        }
        weights.resize(total, 1.0);
        weights.iter_mut().zip(&search.leverage_weights).for_each(|(w, leverage)| *w *= leverage);
        let robust = all(search.experiments).any(|(_, m)| m.loss().is_robust());
        let freedom = (!known).then_some(freedom);
        let (reach, up) = (quantile95(freedom), one_sided95(freedom));
        let rise = if robust { square / slope } else { variance };
        Self { variance, is_estimated: !settled, rise, reach, up, freedom, weights }
    }
}

pub(crate) fn weighted(rows: &[Vec<f64>], weights: &[f64]) -> Vec<Vec<f64>> {
    let scaled = |(row, w): (&Vec<f64>, &f64)| row.iter().map(|d| d * w).collect();
    rows.iter().zip(weights).map(scaled).collect()
}

/// What is left of the data, weighted as the rows of the Jacobian are.
pub(crate) fn weighted_residuals(fitted: Fitted, noise: &Noise) -> DVector<f64> {
    let mut influences = Vec::with_capacity(fitted.optimum.residuals.len());
    for MeasuredResiduals { measurement, residuals, .. } in fitted.measured() {
        influences.extend(residuals.iter().map(|r| measurement.loss().influence(*r)[0]));
    }
    influences.extend_from_slice(&fitted.optimum.residuals[influences.len()..]);
    influences.iter_mut().zip(&noise.weights).for_each(|(r, w)| *r *= w);
    influences.into()
}

/// Covariance of the gradient of the misfit: `sum psi^2 j j'`, measurement by measurement with the
/// mean of `psi^2`, and 1 for priors.
pub(crate) fn score_covariance(fitted: Fitted) -> DMatrix<f64> {
    let Fitted { search, optimum } = fitted;
    let mut sizes = Vec::with_capacity(optimum.residuals.len());
    for MeasuredResiduals { measurement, residuals, .. } in fitted.measured() {
        let square = |r: &f64| measurement.loss().influence(*r)[0].powi(2);
        let mean = residuals.iter().map(square).sum::<f64>() / residuals.len().max(1) as f64;
        sizes.extend(std::iter::repeat_n(mean, residuals.len()));
    }
    sizes.resize(optimum.residuals.len(), 1.0);
    sizes
        .iter_mut()
        .zip(&search.leverage_weights)
        .for_each(|(size, leverage)| *size *= leverage * leverage);
    let n = optimum.x.len();
    let rows = optimum.jacobian.iter().zip(&sizes);
    DMatrix::from_fn(n, n, |i, j| rows.clone().map(|(row, size)| size * row[i] * row[j]).sum())
}

/// Of all positions, m; of frequencies, rad/s, where there are only those.
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
    /// Takes another one of the same group in.
    fn join(&mut self, other: &Self) {
        let [own, others] = [self.values as f64, other.values as f64];
        // Variances add as their inverses do.
        let information =
            own / self.std_error_factor.powi(2) + others / other.std_error_factor.powi(2);
        self.std_error_factor = ((own + others) / information).sqrt();
        self.down_weighted += other.down_weighted;
        self.beyond_5_sigma += other.beyond_5_sigma;
        self.values += other.values;
    }
}

/// What robust losses did; the markers of a recording are one.
pub(crate) fn losses(fitted: Fitted, noise: &Noise) -> Vec<LossEffect> {
    let mut effects: Vec<LossEffect> = Vec::new();
    for MeasuredResiduals { experiment, measurement, residuals, rows, .. } in fitted.measured() {
        let weights = &noise.weights[rows];
        let loss = measurement.loss();
        if loss != Loss::Squares {
            let effect = LossEffect {
                observation: experiment.group(measurement),
                loss,
                down_weighted: residuals.iter().filter(|r| r.abs() > loss.scale()).count(),
                beyond_5_sigma: residuals.iter().filter(|r| r.abs() > 5.0).count(),
                values: residuals.len(),
                std_error_factor: weights.iter().copied().reduce(f64::max).map_or(1.0, f64::recip),
            };
            let same = |last: &&mut LossEffect| {
                measurement.marker().is_some() && last.observation == effect.observation
            };
            match effects.last_mut().filter(same) {
                Some(last) => last.join(&effect),
                None => effects.push(effect),
            }
        }
    }
    effects
}

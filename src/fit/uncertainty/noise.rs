//! What the residuals say of the noise, and the noise of what is worth how much: weights of the
//! measurements in the fit, and of the residuals in its errors.

use crate::fit::measurement::experiment::all;
use crate::fit::measurement::loss::Loss;
use crate::fit::misfit::noise::weights_depend_on_the_fit;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::quantile::{one_sided95, quantile95};
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
    pub fn at(search: &Search, optimum: &Optimum) -> Self {
        let total = optimum.residuals.len();
        // Values of small leverage weights are less than one value each.
        let weights = search.growth_weights().iter();
        let lost: f64 = weights.map(|weight| 1.0 - weight * weight).sum();
        // Unknown arc lengths use up a value each.
        let fitted: usize = all(search.experiments).map(|(_, m)| m.fitted_arc_lengths()).sum();
        let freedom = (total - search.unknowns.len()) as f64 - lost - fitted as f64;
        let freedom = if lost > 0.0 || fitted > 0 { freedom.max(1.0) } else { freedom };
        let known = all(search.experiments).all(|(_, m)| m.sigma().is_some());
        let settled = known || weights_depend_on_the_fit(search.experiments, search.unknowns);
        let trusted = |(k, r): (usize, &f64)| (search.trust.get(k).unwrap_or(&1.0) * r).powi(2);
        let square: f64 = optimum.residuals.iter().enumerate().map(trusted).sum();
        let variance = if settled { 1.0 } else { square / freedom };
        let mut weights = Vec::with_capacity(total);
        // Sums of psi' and psi^2 (Huber 1981).
        let (mut slope, mut square) = (0.0, 0.0);
        for (_, measurement, _, own) in search.measured(optimum) {
            let loss = measurement.loss();
            let part = search.unknowns.len() * own.len() / total;
            let weight = loss.information(own, part).sqrt();
            weights.extend(std::iter::repeat_n(weight, own.len()));
            for r in own {
                let [psi, by_r] = loss.influence(*r);
                (slope, square) = (slope + by_r, square + psi * psi);
            }
        }
        weights.resize(total, 1.0);
        weights.iter_mut().zip(&search.trust).for_each(|(w, trust)| *w *= trust);
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
pub(crate) fn left(search: &Search, optimum: &Optimum, noise: &Noise) -> DVector<f64> {
    let mut felt = Vec::with_capacity(optimum.residuals.len());
    for (_, measurement, _, own) in search.measured(optimum) {
        felt.extend(own.iter().map(|r| measurement.loss().influence(*r)[0]));
    }
    felt.extend_from_slice(&optimum.residuals[felt.len()..]);
    felt.iter_mut().zip(&noise.weights).for_each(|(r, w)| *r *= w);
    felt.into()
}

/// Covariance of the gradient of the misfit: `sum psi^2 j j'`, measurement by measurement with the
/// mean of `psi^2`, and 1 for priors.
pub(crate) fn scatter(search: &Search, optimum: &Optimum) -> DMatrix<f64> {
    let mut sizes = Vec::with_capacity(optimum.residuals.len());
    for (_, measurement, _, own) in search.measured(optimum) {
        let square = |r: &f64| measurement.loss().influence(*r)[0].powi(2);
        let mean = own.iter().map(square).sum::<f64>() / own.len().max(1) as f64;
        sizes.extend(std::iter::repeat_n(mean, own.len()));
    }
    sizes.resize(optimum.residuals.len(), 1.0);
    sizes.iter_mut().zip(&search.trust).for_each(|(size, trust)| *size *= trust * trust);
    let n = optimum.x.len();
    let rows = optimum.jacobian.iter().zip(&sizes);
    DMatrix::from_fn(n, n, |i, j| rows.clone().map(|(row, size)| size * row[i] * row[j]).sum())
}

/// Of all positions, m; of frequencies, rad/s, where there are only those.
pub(crate) fn residual_rms(search: &Search, optimum: &Optimum) -> f64 {
    let of_unit = |unit: &str| {
        let (mut sum, mut count) = (0.0, 0);
        for (_, m, sigma, own) in search.measured(optimum).filter(|(_, m, ..)| m.unit() == unit) {
            sum += own.iter().zip(m.sigmas(sigma)).map(|(r, s)| (r * s).powi(2)).sum::<f64>();
            count += own.len();
        }
        (count > 0).then(|| (sum / count as f64).sqrt())
    };
    let first = all(search.experiments).next().map_or("m", |(_, m)| m.unit());
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
pub(crate) fn losses(search: &Search, optimum: &Optimum, noise: &Noise) -> Vec<LossEffect> {
    let mut weights = &noise.weights[..];
    let mut effects: Vec<LossEffect> = Vec::new();
    for (experiment, measurement, _, own) in search.measured(optimum) {
        let (mine, others) = weights.split_at(own.len());
        weights = others;
        let loss = measurement.loss();
        if loss != Loss::Squares {
            let effect = LossEffect {
                observation: experiment.group(measurement),
                loss,
                down_weighted: own.iter().filter(|r| r.abs() > loss.scale()).count(),
                beyond_5_sigma: own.iter().filter(|r| r.abs() > 5.0).count(),
                values: own.len(),
                std_error_factor: mine.iter().copied().reduce(f64::max).map_or(1.0, f64::recip),
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

//! What the residuals say of the noise, and the noise of what is worth how much: weights of the
//! measurements in the fit, and of the residuals in its errors.

use crate::fit::Fit;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::experiment::all;
use crate::fit::measurement::loss::Loss;
use crate::fit::report::LossEffect;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::covariance::{one_sided95, quantile95};
use crate::fit::uncertainty::warnings::UNEXPLAINED;
use nalgebra::DMatrix;

/// Noise below this part of the rod's length is none.
const EXACT: f64 = 1e-12;

/// What the noise at an optimum makes of misfits and derivatives.
pub(crate) struct Noise {
    /// Variance of the residuals under squares; 1 when sigma is known or was estimated before.
    pub variance: f64,
    /// A rise of twice the misfit by the square of a quantile times this ends an interval.
    pub rise: f64,
    /// How many standard deviations a 95 % interval reaches to each side.
    pub reach: f64,
    /// How many it reaches up when it is open downward.
    pub up: f64,
    /// Root of the information of every residual: below 1 under robust losses.
    pub weights: Vec<f64>,
}

impl Fit {
    /// Whether noise that is estimated from the residuals changes what the residuals come out as:
    /// not so where all have the same.
    pub(crate) fn weights_depend_on_the_fit(&self, fitted: &[Experiment]) -> bool {
        let mut unknown = all(fitted).filter(|(_, m)| m.sigma().is_none());
        let robust = unknown.clone().any(|(_, m)| m.loss().is_robust());
        let several = all(fitted).count() > 1 || self.unknowns.iter().any(|u| u.prior.is_some());
        unknown.next().is_some() && (robust || several)
    }

    /// What the residuals at an optimum say of the noise.
    pub(crate) fn noise(&self, search: &Search, optimum: &Optimum) -> Noise {
        let total = optimum.residuals.len();
        let freedom = (total - self.unknowns.len()) as f64;
        let known = all(search.experiments).all(|(_, m)| m.sigma().is_some());
        let settled = known || self.weights_depend_on_the_fit(search.experiments);
        let variance = if settled { 1.0 } else { 2.0 * optimum.cost / freedom };
        let mut weights = Vec::with_capacity(total);
        // Sums of psi' and psi^2 (Huber 1981).
        let (mut slope, mut square) = (0.0, 0.0);
        for (_, measurement, _, own) in search.measured(optimum) {
            let loss = measurement.loss();
            let part = self.unknowns.len() * own.len() / total;
            let weight = loss.information(own, part).sqrt();
            weights.extend(std::iter::repeat_n(weight, own.len()));
            for r in own {
                let [psi, by_r] = loss.influence(*r);
                (slope, square) = (slope + by_r, square + psi * psi);
            }
        }
        weights.resize(total, 1.0);
        let robust = all(search.experiments).any(|(_, m)| m.loss().is_robust());
        let freedom = (!known).then_some(freedom);
        let (reach, up) = (quantile95(freedom), one_sided95(freedom));
        Noise { variance, rise: if robust { square / slope } else { variance }, reach, up, weights }
    }
}

/// Sigmas given, and for the others the size of the rod, a common scale; where outliers shall count
/// less, what may be left of the motion at first.
pub(crate) fn first_sigmas(experiments: &[Experiment]) -> Vec<f64> {
    let first = |(experiment, measurement): (&Experiment, &Measurement)| {
        let problem = &experiment.problem;
        measurement.sigma().unwrap_or_else(|| match measurement.loss().is_robust() {
            // What hardly moves leaves what the camera sees of it.
            true => 0.5 * UNEXPLAINED * measurement.size(problem).max(1e-2 * problem.length()),
            false => problem.length(),
        })
    };
    all(experiments).map(first).collect()
}

impl Search<'_> {
    /// Root mean square residual of each measurement, in its unit; whatever outliers do, where the
    /// loss is robust.
    pub fn spreads(&self, optimum: &Optimum) -> Vec<f64> {
        let spread = |(_, m, sigma, r): (_, &Measurement, f64, &[f64])| m.loss().spread(r) * sigma;
        self.measured(optimum).map(spread).collect()
    }

    /// Replaces the sigmas that are not given by the spread of the residuals.
    pub fn estimate_sigmas(&self, optimum: &Optimum, sigmas: &mut [f64]) {
        let total = optimum.residuals.len() as f64;
        let freedom = (1.0 - self.unknowns.len() as f64 / total).max(1.0 / total);
        let spreads = self.spreads(optimum);
        for ((sigma, (experiment, measurement)), spread) in
            sigmas.iter_mut().zip(all(self.experiments)).zip(spreads)
        {
            if measurement.sigma().is_none() && spread > 0.0 {
                // Perfect data have no noise to estimate.
                let least = EXACT * measurement.scale(&experiment.problem);
                *sigma = (spread / freedom.sqrt()).max(least);
            }
        }
    }
}

pub(crate) fn weighted(rows: &[Vec<f64>], weights: &[f64]) -> Vec<Vec<f64>> {
    let scaled = |(row, w): (&Vec<f64>, &f64)| row.iter().map(|d| d * w).collect();
    rows.iter().zip(weights).map(scaled).collect()
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
    let n = optimum.x.len();
    let rows = optimum.jacobian.iter().zip(&sizes);
    DMatrix::from_fn(n, n, |i, j| rows.clone().map(|(row, size)| size * row[i] * row[j]).sum())
}

/// Of all positions, m; of frequencies, rad/s, where there are only those.
pub(crate) fn residual_rms(search: &Search, optimum: &Optimum) -> f64 {
    let of_unit = |unit: &str| {
        let (mut sum, mut count) = (0.0, 0);
        for (_, _, sigma, own) in search.measured(optimum).filter(|(_, m, ..)| m.unit() == unit) {
            sum += own.iter().map(|r| (r * sigma).powi(2)).sum::<f64>();
            count += own.len();
        }
        (count > 0).then(|| (sum / count as f64).sqrt())
    };
    let first = all(search.experiments).next().map_or("m", |(_, m)| m.unit());
    of_unit("m").or_else(|| of_unit("rad/s")).or_else(|| of_unit(first)).unwrap_or(0.0)
}

/// What robust losses did.
pub(crate) fn losses(search: &Search, optimum: &Optimum, noise: &Noise) -> Vec<LossEffect> {
    let mut weights = &noise.weights[..];
    let mut effects = Vec::new();
    for (experiment, measurement, _, own) in search.measured(optimum) {
        let (mine, others) = weights.split_at(own.len());
        weights = others;
        let loss = measurement.loss();
        if loss != Loss::Squares {
            effects.push(LossEffect {
                observation: experiment.label(measurement),
                loss,
                beyond_scale: own.iter().filter(|r| r.abs() > loss.scale()).count(),
                beyond_5_sigma: own.iter().filter(|r| r.abs() > 5.0).count(),
                values: own.len(),
                error_factor: mine.first().map_or(1.0, |w| w.recip()),
            });
        }
    }
    effects
}

//! Damping that came out at zero, or cannot be told from it: how large it may be at most.
//!
//! The logarithm that the search works on is no scale for that. On the parameter's own, the misfit is
//! a parabola about an estimate that may be negative, where no damping can be; the upper end is where
//! it has risen, from the least it takes for damping that is not negative, by what ends a one-sided
//! 95 % interval.

use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::damping::is_damping;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::identifiability::SUSPICIOUS;
use crate::fit::uncertainty::noise::autocorrelation::Correlations;
use crate::fit::uncertainty::noise::residual_noise::Noise;
use crate::numerics::half_sum_of_squares;
use nalgebra::DMatrix;

/// How much of the rise that the parabola predicts at the upper end must be there.
const CONFIRMED: f64 = 0.3;
/// Standard errors from zero below which a damping is bounded from above only: one that is zero is farther off once
/// in 700 times.
const DETECTED: f64 = 3.0;
/// Standard deviation of a logarithm above which a small change of the residuals is a large one of the logarithm.
const LARGEST_LOGARITHMIC: f64 = 3.0;

/// An unknown that is bounded from one side, or is known too little for its logarithm to be normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bound {
    /// The estimate, never negative.
    pub value: f64,
    /// Lower end of the one-sided 95 % interval, where it has no upper one.
    pub lower95: Option<f64>,
    /// Upper end of the one-sided 95 % interval, where it may be zero.
    pub upper95: Option<f64>,
    /// Standard deviation of the logarithm.
    pub log_deviation: f64,
}

impl Bound {
    /// Whether the data bound it from one side only.
    pub fn is_one_sided(&self) -> bool {
        self.lower95.is_some() || self.upper95.is_some()
    }

    /// Whether its upper end is known, and its logarithm has an effect where it came out.
    pub fn is_away_from_zero(&self) -> bool {
        self.upper95.is_some() && self.log_deviation < LARGEST_LOGARITHMIC
    }
}

/// Which of the unknowns may be zero. `rows` are those of the Jacobian in units of the noise.
pub(crate) fn zero_bounds(
    Fitted { search, optimum }: Fitted,
    rows: &[Vec<f64>],
    noise: &Noise,
    correlations: &Correlations,
    residuals: &Residuals,
) -> Vec<Option<Bound>> {
    let unknowns = search.unknowns;
    let n = unknowns.len();
    let mut found = vec![None; n];
    if !optimum.converged || !unknowns.iter().any(is_damping) {
        return found;
    }
    // Columns of length one, whatever the scale of the unknowns.
    let norm = |j: usize| rows.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt();
    let norms: Vec<f64> = (0..n).map(norm).collect();
    let seen: Vec<usize> = (0..n).filter(|j| norms[*j] > 0.0).collect();
    let column = |row: &Vec<f64>, a: usize| row[seen[a]] / norms[seen[a]];
    let normal = DMatrix::<f64>::from_fn(seen.len(), seen.len(), |a, b| {
        rows.iter().map(|row| column(row, a) * column(row, b)).sum()
    });
    let Some(factors) = normal.cholesky() else { return found };
    let inverse = factors.inverse();
    // The slopes of the misfit itself, which are zero along all others, over those of its parabola.
    let robust = noise.rise / noise.variance;
    let made = residuals.losses().into_iter().zip(residuals.leverage_weights()).zip(&noise.weights);
    let felt: Vec<f64> = optimum
        .residuals
        .iter()
        .zip(made)
        .map(|(r, ((loss, weight), w))| weight * loss.influence(weight * r)[0] / (robust * w))
        .collect();
    let gradient: Vec<f64> = (0..seen.len())
        .map(|a| rows.iter().zip(&felt).map(|(row, r)| column(row, a) * r).sum())
        .collect();
    for (a, j) in seen.iter().enumerate().filter(|(_, j)| is_damping(&unknowns[**j])) {
        let (quantile, inflation) = (correlations.up[*j], correlations.inflation[*j]);
        let white = (noise.variance * inverse[(a, a)]).sqrt();
        let log_deviation = inflation * white / norms[*j];
        let here = unknowns[*j].from_scale(optimum.x[*j]);
        if log_deviation <= SUSPICIOUS || here == 0.0 {
            continue;
        }
        let step: f64 = -(0..seen.len()).map(|b| inverse[(a, b)] * gradient[b]).sum::<f64>();
        let deviation = here * log_deviation;
        let estimate = here + here * step / norms[*j];
        let below = estimate.min(0.0);
        let upper95 = estimate + (below * below + (quantile * deviation).powi(2)).sqrt();
        // There, with the others where they then want to be.
        let mut x = optimum.x.clone();
        let way = (upper95 - here) / here * norms[*j] / inverse[(a, a)];
        for (b, k) in seen.iter().enumerate().filter(|(_, k)| *k != j) {
            if !is_damping(&unknowns[*k]) {
                x[*k] += way * inverse[(a, b)] / norms[*k];
            }
        }
        x[*j] = unknowns[*j].to_scale(upper95);
        let rise = residuals
            .residuals(&x)
            .map_or(f64::INFINITY, |r| 2.0 * (half_sum_of_squares(&r) - optimum.cost) / noise.rise);
        // The search may have ended at zero, short of the least misfit.
        let missed =
            if estimate > here { (estimate - here) / (deviation / inflation) } else { 0.0 };
        let rise = rise + missed * missed;
        if upper95.is_finite()
            && rise.is_finite()
            && rise >= CONFIRMED * (quantile * inflation).powi(2)
        {
            let value = if estimate > 1e-3 * upper95 { estimate } else { 0.0 };
            let upper95 = (estimate < DETECTED * deviation).then_some(upper95);
            found[*j] = Some(Bound { value, lower95: None, upper95, log_deviation });
        }
    }
    found
}

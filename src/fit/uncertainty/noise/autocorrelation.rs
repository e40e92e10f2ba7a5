//! Covariance of the estimates under noise that is not white: autocorrelated noise, and coordinates with a variance
//! of their own.
//!
//! Input: an optimum, the rows of its weighted Jacobian `J` in units of sigma, and the common variance `v` of the
//! noise. The result is a [`NoiseModel`]. The estimate stays that of least squares, whose errors then have the
//! covariance
//!
//! ```text
//! (J'J)^-1 J'VJ (J'J)^-1,    V = v R in each coordinate of each measurement
//! ```
//!
//! with an [AR(1) correlation](crate::fit::misfit::ar1::Ar1Correlation) `R`. Significant correlations, and variances of
//! such series or of unequal coordinates, are estimated from the residuals by [`ROUNDS`] of moment matching; stated
//! sigmas stay. A correlated series whose innovations are no white noise (p-value below [`COLORED_INNOVATIONS`]) is
//! unexplained motion, and counts as uncorrelated with the common variance. For motions of a few frequencies least
//! squares is asymptotically as efficient as any weighting (Grenander 1954). Residuals of rounding errors count as
//! white noise.
//!
//! The [`NoiseModel`] has two results per unknown. The inflation is the standard deviation over that for white noise.
//! The degrees of freedom of its variance (Satterthwaite 1946; none where it is known) determine Student's t of the
//! intervals. It also has the score covariance `J'VJ` over the common variance (none for white noise), for the
//! covariance of the estimates. It contains the errors of
//! [estimated weights](crate::fit::uncertainty::noise::estimated_weights) where these change a standard deviation by
//! more than [`NEGLIGIBLE`]. `variance_along` returns the variance along a direction of the weighted residuals.
//!
//! `coverage_factor` and `one_sided_factor` return the quantiles of two-sided and one-sided 95 % intervals of an
//! unknown, in standard deviations.

use crate::fit::misfit::residual_tests::innovation_p_value;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::noise::coordinate_series::{CoordinateSeries, coordinate_series};
use crate::fit::uncertainty::noise::coverage_factor::{one_sided95, quantile95};
use crate::fit::uncertainty::noise::estimated_weights::{
    EstimatedInformation, information_with_estimated_weights, weight_errors,
};
use crate::fit::uncertainty::noise::residual_noise::ResidualNoise;
use nalgebra::{DMatrix, SymmetricEigen};

/// Probability of white noise below which the innovations of a series are taken for motion: its AR(1) model is then
/// rejected.
const COLORED_INNOVATIONS: f64 = 4e-4;
/// Rounds of moment matching: correlations and variances depend on each other through the covariance of the unknowns.
/// More rounds change the result less.
const ROUNDS: usize = 8;
/// Eigenvalues of the scaled normal matrix up to this part of the largest count as zero: rounding errors.
const ZERO_EIGENVALUE: f64 = 1e-12;
/// Step of a correlation `r`, over `1 - r`, for the numerical derivative of a variance by it. Larger: truncation error;
/// smaller: rounding error.
const CORRELATION_STEP: f64 = 1e-3;
/// Largest relative change of a standard deviation by the errors of estimated weights that is left out.
const NEGLIGIBLE: f64 = 5e-3;

/// Noise of all coordinates, and its effect on every unknown.
pub(crate) struct NoiseModel {
    /// Series of residuals with their noise models, one per coordinate with enough values.
    pub series: Vec<CoordinateSeries>,
    /// `J'VJ` over the common variance of the noise; none for white noise.
    pub score_covariance: Option<DMatrix<f64>>,
    /// Standard deviation of each unknown over that for white noise.
    pub inflation: Vec<f64>,
    /// Degrees of freedom of the variance of each unknown; none where it is known.
    pub degrees_of_freedom: Vec<Option<f64>>,
}

impl NoiseModel {
    /// Estimates the noise from the residuals at an optimum and the weighted `rows` of the Jacobian in units of sigma,
    /// in [`ROUNDS`] of moment matching. A correlated series whose innovations have a p-value below
    /// [`COLORED_INNOVATIONS`] becomes white with the common variance, and the rounds are repeated. The inflation is
    /// the root of the ratio of the variances of an unknown with this noise and with white noise. The list of series is
    /// empty, and the noise counts as white, where the residuals are rounding errors or have no variance. For white
    /// noise the inflation is 1, and there is no score covariance, unless estimated weights have errors.
    pub fn new(fitted: Fitted, rows: &[Vec<f64>], noise: &ResidualNoise) -> Self {
        let Fitted { search, optimum } = fitted;
        let n = search.unknowns.len();
        let mut found = Self {
            series: Vec::new(),
            score_covariance: None,
            inflation: vec![1.0; n],
            degrees_of_freedom: vec![noise.degrees_of_freedom; n],
        };
        if search.is_rounding(optimum) || !noise.variance.is_normal() {
            return found;
        }
        found.series = coordinate_series(fitted, rows, noise);
        let estimated = information_with_estimated_weights(fitted, rows);
        // Most records have white noise and end here: the covariance is then that of Gauss and Newton.
        if found.is_white() && estimated.is_empty() {
            return found;
        }
        let all_rows = DMatrix::from_fn(rows.len(), n, |a, j| rows[a][j]);
        let normal = all_rows.tr_mul(&all_rows);
        let inverse = pseudo_inverse(&normal);
        // Rows in no series, such as those of priors, have the common white noise.
        let in_series = found.series.iter().map(CoordinateSeries::normal_matrix);
        let others = in_series.fold(normal.clone(), |rest, own| rest - own);
        let score_covariance = |series: &[CoordinateSeries]| {
            let zero = DMatrix::zeros(n, n);
            let sum = series.iter().fold(zero, |sum, s| sum + s.score_covariance());
            sum + noise.variance * &others
        };
        loop {
            for _ in 0..ROUNDS {
                let covariance = &inverse * score_covariance(&found.series) * &inverse;
                let own = found.series.iter_mut().filter(|series| series.has_own_noise());
                own.for_each(|series| series.refine(&inverse, &covariance));
            }
            // Unexplained motion is no AR(1) noise: such a series counts as white, and the others are estimated again.
            let rejected = |s: &CoordinateSeries| {
                s.is_correlated && innovation_p_value(&s.innovations()) < COLORED_INNOVATIONS
            };
            let mut rejected = found.series.iter_mut().filter(|s| rejected(s)).peekable();
            if rejected.peek().is_none() {
                break;
            }
            rejected.for_each(|series| series.set_uncorrelated(noise.variance));
        }
        let scores = match found.is_white() {
            true => noise.variance * &normal,
            false => score_covariance(&found.series),
        };
        let covariance = &inverse * &scores * &inverse;
        found.degrees_of_freedom =
            degrees_of_freedom(&found.series, &estimated, &inverse, &covariance, noise);
        // Errors of estimated weights add to the covariance of the gradient.
        let errors = noise.variance * weight_errors(&estimated, &inverse);
        let with_errors = &covariance + &inverse * &errors * &inverse;
        let change = |j: usize| (with_errors[(j, j)] / covariance[(j, j)]).sqrt() - 1.0;
        let are_negligible = !(0..n).any(|j| change(j) > NEGLIGIBLE);
        if found.is_white() && are_negligible {
            return found;
        }
        let [scores, covariance] = match are_negligible {
            true => [scores, covariance],
            false => [scores + errors, with_errors],
        };
        // Inflation of the standard deviation of each unknown.
        for j in (0..n).filter(|j| covariance[(*j, *j)] > 0.0) {
            let white = noise.variance * inverse[(j, j)];
            found.inflation[j] = (covariance[(j, j)] / white).sqrt();
        }
        found.score_covariance = Some(scores / noise.variance);
        found
    }

    /// Whether no series has a noise of its own: all have the common variance, and no correlation.
    fn is_white(&self) -> bool {
        !self.series.iter().any(CoordinateSeries::has_own_noise)
    }

    /// Variance `d'Vd` of the noise along a `direction` `d` of the weighted residuals, one number per row. Rows in a
    /// series with a noise of its own have its variance and AR(1) correlation; all others have the common variance of
    /// `noise`, uncorrelated.
    pub fn variance_along(&self, direction: &[f64], noise: &ResidualNoise) -> f64 {
        let square = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
        let mut variance = noise.variance * square(direction);
        for series in self.series.iter().filter(|s| s.has_own_noise()) {
            // The common noise of the rows of a series is replaced by their own.
            let own: Vec<f64> = series.rows.iter().map(|k| direction[*k]).collect();
            let correlated = series.ar1().apply(&own);
            let product: f64 = own.iter().zip(&correlated).map(|(a, b)| a * b).sum();
            variance += series.variance * product - noise.variance * square(&own);
        }
        variance
    }

    /// The series of coordinate `axis` of measurement number `measurement` (from 0); none where it has too few values
    /// for one.
    pub fn series_of(&self, measurement: usize, axis: &str) -> Option<&CoordinateSeries> {
        self.series.iter().find(|s| s.measurement == measurement && s.axis == axis)
    }

    /// AR(1) correlation of neighboring residuals of coordinate `axis` of measurement number `measurement`; 0 where it
    /// is not significant, or the coordinate has no series.
    pub fn correlation(&self, measurement: usize, axis: &str) -> f64 {
        self.series_of(measurement, axis).map_or(0.0, |s| s.correlation)
    }

    /// Half-width of the 95 % interval of unknown `j` in standard deviations: Student's t with its degrees of freedom,
    /// 1.96 for a known variance.
    pub fn coverage_factor(&self, j: usize) -> f64 {
        quantile95(self.degrees_of_freedom[j])
    }

    /// Distance of the one-sided 95 % limit of unknown `j` in standard deviations: Student's t with its degrees of
    /// freedom, 1.645 for a known variance.
    pub fn one_sided_factor(&self, j: usize) -> f64 {
        one_sided95(self.degrees_of_freedom[j])
    }

    /// The fewest degrees of freedom of any unknown; none where all variances are known.
    pub fn fewest_degrees_of_freedom(&self) -> Option<f64> {
        self.degrees_of_freedom.iter().flatten().copied().reduce(f64::min)
    }
}

/// Degrees of freedom of the variance of each unknown; none where it is known. They are `2/e^2` for the relative error
/// `e` of the variance. Let `s` be the share of a series of `n` values in the variance of the unknown. Its variance
/// adds `2 s^2/n` to `e^2`, unless sigma is stated; its correlation `r` adds `t^2 (1 - r^2)/n`, with the numerical
/// derivative `t` of the relative variance. The common variance adds `2 s^2/nu` for its remaining share and its degrees
/// of freedom `nu`; where measurements have variances of their own (`estimated`), each adds this for its own share.
/// `inverse` is that of the normal matrix, `covariance` that of the unknowns.
fn degrees_of_freedom(
    series: &[CoordinateSeries],
    estimated: &[EstimatedInformation],
    inverse: &DMatrix<f64>,
    covariance: &DMatrix<f64>,
    noise: &ResidualNoise,
) -> Vec<Option<f64>> {
    let n = inverse.nrows();
    // Squared relative error of each variance, and its share that stems from the common noise.
    let (mut error, mut common) = (vec![0.0; n], vec![1.0; n]);
    for s in series.iter().filter(|s| s.has_own_noise()) {
        let count = s.len() as f64;
        let part = inverse * s.score_covariance() * inverse;
        // A backward difference: a larger correlation might reach 1.
        let step = CORRELATION_STEP * (1.0 - s.correlation);
        let nearby =
            (s.correlation > step).then(|| inverse * s.score_covariance_below(step) * inverse);
        for j in (0..n).filter(|j| covariance[(*j, *j)] > 0.0) {
            // Share of this series in the variance of the unknown; the relative error of its own variance is
            // `sqrt(2/n)`.
            let share = part[(j, j)] / covariance[(j, j)];
            common[j] -= share;
            if !s.is_sigma_stated {
                error[j] += share * share * 2.0 / count;
            }
            // The correlation of n values has the variance (1 - r^2)/n.
            if let Some(nearby) = &nearby {
                let slope = (part[(j, j)] - nearby[(j, j)]) / (step * covariance[(j, j)]);
                error[j] += slope * slope * (1.0 - s.correlation.powi(2)) / count;
            }
        }
    }
    for EstimatedInformation { measurement, normal, degrees_of_freedom } in estimated {
        let own = series.iter().filter(|s| s.has_own_noise() && s.measurement == *measurement);
        let rest = own.fold(normal.clone(), |rest, series| rest - series.normal_matrix());
        let part = noise.variance * (inverse * rest * inverse);
        for j in (0..n).filter(|j| covariance[(*j, *j)] > 0.0) {
            error[j] += 2.0 * (part[(j, j)] / covariance[(j, j)]).powi(2) / degrees_of_freedom;
        }
    }
    if !estimated.is_empty() {
        // Stated sigmas and priors have no error.
        common.fill(0.0);
    }
    let freedom = |(error, common): (f64, f64)| {
        let of_common = noise.degrees_of_freedom.map_or(0.0, |own| 2.0 * common.powi(2) / own);
        let error = error + of_common;
        (error > 0.0).then(|| 2.0 / error)
    };
    error.into_iter().zip(common).map(freedom).collect()
}

/// Pseudo-inverse of a normal matrix, whose rows and columns are scaled to a unit diagonal before eigenvalues below
/// [`ZERO_EIGENVALUE`] are left out. Unknowns without effect have zeros.
fn pseudo_inverse(normal: &DMatrix<f64>) -> DMatrix<f64> {
    let n = normal.nrows();
    let scale = normal.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 0.0 });
    let scaled = DMatrix::from_fn(n, n, |a, b| normal[(a, b)] * scale[a] * scale[b]);
    let axes = SymmetricEigen::new(scaled);
    let most = axes.eigenvalues.amax();
    let mut inverse = DMatrix::zeros(n, n);
    for (axis, value) in axes.eigenvectors.column_iter().zip(&axes.eigenvalues) {
        if *value > ZERO_EIGENVALUE * most {
            inverse += axis * axis.transpose() / *value;
        }
    }
    DMatrix::from_fn(n, n, |a, b| inverse[(a, b)] * scale[a] * scale[b])
}

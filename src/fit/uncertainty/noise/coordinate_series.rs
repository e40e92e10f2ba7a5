//! Residuals of one coordinate of a measurement in the order of time (of a shape, arc length), and the AR(1) model of
//! their noise.
//!
//! [`coordinate_series`] splits the residuals of an optimum, in units of sigma and times their leverage weights, into
//! series of at least [`FEWEST`] values: one per coordinate of a measurement. With a robust loss its influence function
//! `psi(r)` replaces them, scaled to a root mean square of 1. Each series is tested for a positive lag-one correlation
//! above [`SIGNIFICANT`] standard deviations of white noise. Without a stated sigma the coordinates of a measurement
//! are tested for different variances (Bartlett's test, level [`UNEQUAL_VARIANCES`]).
//!
//! For noise of the covariance `V` the residuals at an optimum have the covariance `V - HV - VH + HVH`,
//! `H = J (J'J)^-1 J'`: the fit absorbs a part of the noise. [`CoordinateSeries::refine`] matches the variance `v`
//! (unless sigma is stated) and a significant correlation with these expectations, for `V = v R` with an [AR(1)
//! correlation](Ar1Correlation) `R`. The correlation is from 0 to `1 - 2/n` for `n` pairs of neighbors.
//! `autocorrelation` uses the series for the covariance of the estimates, the bootstrap for random blocks of residuals
//! (`block_length`).

use crate::fit::misfit::ar1::{Ar1Correlation, ar1_factor, usual_spacing};
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::noise::residual_noise::ResidualNoise;
use nalgebra::DMatrix;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Fewest values of a series whose correlation is estimated. Fewer have a standard error of the correlation above 0.3.
const FEWEST: usize = 12;
/// Correlation of neighbors, in its standard deviations under white noise, above which it is modeled. Smaller: more
/// white series get wider intervals.
const SIGNIFICANT: f64 = 2.0;
/// Probability of equal variances below which the coordinates of a measurement get a variance each.
const UNEQUAL_VARIANCES: f64 = 1e-2;
/// Largest distance of neighbors, in usual (median) spacings; pairs across a gap are left out.
const MOST_SPACINGS: f64 = 1.5;
/// Largest part of the variance of the noise that the fit is assumed to have absorbed; it bounds the correction of an
/// estimated variance.
const MOST_ABSORBED: f64 = 0.9;

/// Number of bisections of the interval from 0 to 1 for a correlation: to 1e-15.
const BISECTIONS: usize = 50;

/// Residuals and Jacobian of one coordinate of one measurement, with the model of its noise.
#[derive(Clone)]
pub(crate) struct CoordinateSeries {
    /// Index of the measurement among all.
    pub measurement: usize,
    /// Name of the coordinate, such as x.
    pub axis: &'static str,
    /// Correlation of residuals one usual spacing apart; 0 where it is not significant.
    pub correlation: f64,
    /// Rows of the values among all residuals, in the order of time.
    pub rows: Vec<usize>,
    /// Times of the values, s, ascending; of a shape their arc lengths, m.
    times: Vec<f64>,
    /// Median distance of successive times.
    spacing: f64,
    /// Residuals in units of sigma, after the influence function of a robust loss.
    residuals: Vec<f64>,
    /// Weighted rows of the Jacobian of these values, in units of sigma, by all unknowns.
    jacobian: DMatrix<f64>,
    /// Variance of the noise in units of sigma squared.
    pub variance: f64,
    /// Whether the data state sigma, so that the variance is not estimated.
    pub is_sigma_stated: bool,
    /// Whether the coordinates of the measurement have significantly different variances, so that each is estimated by
    /// itself.
    has_own_variance: bool,
    /// Whether the correlation of neighbors is significant, so that it is estimated.
    pub is_correlated: bool,
}

/// A pair of neighboring values of a series.
struct Neighbors {
    /// Index of the first one in the series.
    first: usize,
    /// Distance in usual spacings.
    spacings: f64,
}

/// Neighbors of a series, with the sums over all pairs `a`, `b` of residuals of `a b` and of `(a^2 + b^2)/2`.
struct NeighborSums {
    /// The pairs of neighbors, in the order of time.
    pairs: Vec<Neighbors>,
    /// Sum of `a b`.
    products: f64,
    /// Sum of `(a^2 + b^2)/2`.
    squares: f64,
}

impl CoordinateSeries {
    /// Number of values of the series.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether the noise differs from the common white one, by its variance or by its correlation.
    pub fn has_own_noise(&self) -> bool {
        self.has_own_variance || self.is_correlated
    }

    /// The AR(1) correlation matrix `R` of the noise.
    pub fn ar1(&self) -> Ar1Correlation {
        Ar1Correlation::new(&self.times, self.spacing, self.correlation)
    }

    /// Innovations of the residuals, `R^(-1/2) r`, which are white where the AR(1) model holds.
    pub fn innovations(&self) -> Vec<f64> {
        self.ar1().whiten(&self.residuals)
    }

    /// Models the residuals as white noise of the given `variance`, in units of sigma squared. A series with a variance
    /// of its own stays marked as such.
    pub fn set_uncorrelated(&mut self, variance: f64) {
        (self.is_correlated, self.correlation, self.variance) = (false, 0.0, variance);
    }

    /// Number of values in each block of a block bootstrap (Politis and White 2004): `(1.5 g^2 n)^(1/3)` rounded up, at
    /// most `n`. Here `g = 2 r/(1 - r^2)` for the correlation `r` of the `n` values. None for a correlation of zero.
    pub fn block_length(&self) -> Option<usize> {
        let excess = 2.0 * self.correlation / (1.0 - self.correlation.powi(2));
        let length = (1.5 * excess * excess * self.len() as f64).cbrt().ceil() as usize;
        (self.correlation > 0.0).then(|| length.clamp(1, self.len()))
    }

    /// Pairs of successive values at most [`MOST_SPACINGS`] apart, with the sums of their products `a b` and of their
    /// mean squares `(a^2 + b^2)/2`. The ratio of these sums is the lag-one correlation.
    fn neighbors(&self) -> NeighborSums {
        let mut sums = NeighborSums { pairs: Vec::new(), products: 0.0, squares: 0.0 };
        for (first, times) in self.times.windows(2).enumerate() {
            let spacings = (times[1] - times[0]) / self.spacing;
            // Across a gap the correlation is too small to be estimated.
            if spacings <= MOST_SPACINGS {
                let [a, b] = [self.residuals[first], self.residuals[first + 1]];
                sums.pairs.push(Neighbors { first, spacings });
                sums.products += a * b;
                sums.squares += 0.5 * (a * a + b * b);
            }
        }
        sums
    }

    /// Whether neighbors correlate by more than [`SIGNIFICANT`] standard deviations of white noise, `1/sqrt(n)` for `n`
    /// pairs. False for fewer than [`FEWEST`] values, and for negative correlations.
    fn has_significant_correlation(&self) -> bool {
        let NeighborSums { pairs, products, squares } = self.neighbors();
        let n = pairs.len();
        n + 1 >= FEWEST && products > SIGNIFICANT * squares / (n as f64).sqrt()
    }

    /// The product `R J` of the AR(1) correlation matrix and the rows of the Jacobian of the series.
    fn correlated_jacobian(&self) -> DMatrix<f64> {
        let (ar1, mut product) = (self.ar1(), self.jacobian.clone());
        for mut column in product.column_iter_mut() {
            let correlated = ar1.apply(column.as_slice());
            column.copy_from_slice(&correlated);
        }
        product
    }

    /// `J'J` of the rows of the series by all unknowns, in units of the noise.
    pub fn normal_matrix(&self) -> DMatrix<f64> {
        self.jacobian.tr_mul(&self.jacobian)
    }

    /// `J'VJ` of the rows of the series, `V = v R`: their part of the covariance of the gradient of the misfit by all
    /// unknowns.
    pub fn score_covariance(&self) -> DMatrix<f64> {
        self.variance * self.jacobian.tr_mul(&self.correlated_jacobian())
    }

    /// `J'VJ` for a correlation `r` lower by `step`, for a numerical derivative. An estimated variance `v` changes so
    /// that the variance `v (1 - r^2)` of the innovations stays; a stated one is kept.
    pub fn score_covariance_below(&self, step: f64) -> DMatrix<f64> {
        let correlation = self.correlation - step;
        let ratio = (1.0 - self.correlation.powi(2)) / (1.0 - correlation.powi(2));
        let variance = if self.is_sigma_stated { self.variance } else { self.variance * ratio };
        Self { correlation, variance, ..self.clone() }.score_covariance()
    }

    /// Updates the variance, unless sigma is stated, and the correlation, if it is significant, by one round of moment
    /// matching. The variance becomes the mean square residual over the part of the variance of the noise that the fit
    /// leaves, at least 1 - [`MOST_ABSORBED`]. The correlation becomes the one for which the expected ratio of the sums
    /// of `neighbors` is the observed one, times `1 + 2/n` for `n` pairs against its bias. Arguments are the `inverse`
    /// of the normal matrix, and the `covariance` of the unknowns by the noise of all series. It is clamped to 0 and
    /// [`largest_correlation`].
    pub fn refine(&mut self, inverse: &DMatrix<f64>, covariance: &DMatrix<f64>) {
        // Expectations for the present model, from the hat matrix restricted to the rows of the series.
        let (n, correlated) = (self.len(), self.correlated_jacobian());
        let white = &self.jacobian * inverse;
        let all = &self.jacobian * covariance / self.variance;
        // Elements of (HVH - HV - VH)/v.
        let absorbed = |a: usize, b: usize| {
            all.row(a).dot(&self.jacobian.row(b))
                - white.row(a).dot(&correlated.row(b))
                - white.row(b).dot(&correlated.row(a))
        };
        let diagonal: Vec<f64> = (0..n).map(|k| absorbed(k, k)).collect();
        // A stated sigma is not estimated again.
        if !self.is_sigma_stated {
            let remaining = 1.0 + diagonal.iter().sum::<f64>() / n as f64;
            self.variance = self.mean_square() / remaining.max(1.0 - MOST_ABSORBED);
        }
        if self.is_correlated {
            let NeighborSums { pairs, products, squares } = self.neighbors();
            let count = pairs.len() as f64;
            let (mut expected_squares, mut expected_products) = (count, 0.0);
            for Neighbors { first, .. } in &pairs {
                expected_squares += 0.5 * (diagonal[*first] + diagonal[first + 1]);
                expected_products += absorbed(*first, first + 1);
            }
            // The observed ratio of the sums is the expected one: solved for the mean correlation of the noise.
            let mean = (products / squares * expected_squares - expected_products) / count;
            // The ratio of the sums is biased by -2 r/n (Marriott and Pope 1954).
            let unbiased = correlation_with_mean(&pairs, mean) * (1.0 + 2.0 / count);
            self.correlation = unbiased.clamp(0.0, largest_correlation(count));
        }
    }

    /// Mean square residual, after the influence function of a robust loss, in units of sigma squared.
    fn mean_square(&self) -> f64 {
        self.residuals.iter().map(|r| r * r).sum::<f64>() / self.len() as f64
    }

    /// Whether the correlation is the largest that the estimate can have, by [`largest_correlation`] of the number of
    /// pairs.
    pub fn is_at_cap(&self) -> bool {
        self.correlation > 0.0
            && self.correlation >= largest_correlation(self.neighbors().pairs.len() as f64)
    }
}

/// Largest estimate of a correlation between neighbors that this number of pairs allows: `1 - 2/pairs`.
fn largest_correlation(pairs: f64) -> f64 {
    1.0 - 2.0 / pairs
}

/// Correlation at the usual spacing for which the AR(1) correlations of the pairs have this `mean`, by bisection; 0 for
/// a negative mean, 1 for one above 1.
fn correlation_with_mean(pairs: &[Neighbors], mean: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    // The factors of all pairs grow with the correlation: there is one solution at most.
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        let sum: f64 = pairs.iter().map(|pair| ar1_factor(middle, pair.spacings)).sum();
        let end = if sum > mean * pairs.len() as f64 { &mut high } else { &mut low };
        *end = middle;
    }
    0.5 * (low + high)
}

/// Series of every coordinate of every measurement with at least [`FEWEST`] values, in the order of the measurements.
/// `rows` are those of the weighted Jacobian in units of sigma. Residuals times their leverage weights pass through the
/// influence function of the loss; with a robust loss those of a measurement are scaled to the root mean square 1.
/// Significant correlations are marked. So are unequal variances of the coordinates of a measurement without a stated
/// sigma. All variances are still the common one of `noise`, and all correlations zero.
pub(crate) fn coordinate_series(
    fitted: Fitted,
    rows: &[Vec<f64>],
    noise: &ResidualNoise,
) -> Vec<CoordinateSeries> {
    let unknowns = fitted.search.unknowns.len();
    let mut found: Vec<CoordinateSeries> = Vec::new();
    for own in fitted.measured() {
        let MeasuredResiduals { index, experiment, measurement, residuals, .. } = own;
        let (first, loss) = (own.rows.start, measurement.loss());
        // Robust losses bound the residuals; their root mean square becomes one, the unit of the noise.
        let influence = |(k, r)| loss.influence(fitted.search.leverage_weight(k) * r)[0];
        let mut influences: Vec<f64> = own.rows.zip(residuals).map(influence).collect();
        if loss.is_robust() {
            let square = influences.iter().map(|r| r * r).sum::<f64>() / influences.len() as f64;
            influences.iter_mut().for_each(|r| *r /= square.sqrt().max(f64::MIN_POSITIVE));
        }
        let start = found.len();
        for coordinate in measurement.coordinates(&experiment.problem) {
            let places = coordinate.ascending(residuals.len());
            let times: Vec<f64> = places.iter().map(|(_, t)| *t).collect();
            // Short series have no reliable correlation.
            let Some(spacing) = usual_spacing(&times).filter(|_| times.len() >= FEWEST) else {
                continue;
            };
            let own_rows: Vec<usize> = places.iter().map(|(k, _)| first + k).collect();
            let mut series = CoordinateSeries {
                measurement: index,
                axis: coordinate.axis,
                correlation: 0.0,
                residuals: places.iter().map(|(k, _)| influences[*k]).collect(),
                jacobian: DMatrix::from_fn(times.len(), unknowns, |a, j| rows[own_rows[a]][j]),
                rows: own_rows,
                times,
                spacing,
                variance: noise.variance,
                is_sigma_stated: measurement.sigma().is_some(),
                has_own_variance: false,
                is_correlated: false,
            };
            series.is_correlated = series.has_significant_correlation();
            found.push(series);
        }
        let unequal = measurement.sigma().is_none() && have_unequal_variances(&found[start..]);
        found[start..].iter_mut().for_each(|series| series.has_own_variance = unequal);
    }
    found
}

/// Whether the coordinates of a measurement have different variances, by Bartlett's test (1937) at the level
/// [`UNEQUAL_VARIANCES`]. The number of values `n` of a series counts as `n (1 - r^2)/(1 + r^2)` independent ones, with
/// the correlation `r` of its neighbors. False for a single series.
fn have_unequal_variances(series: &[CoordinateSeries]) -> bool {
    // The squares of autocorrelated noise carry the information of fewer independent ones.
    let count = |s: &CoordinateSeries| {
        let NeighborSums { products, squares, .. } = s.neighbors();
        let correlation = (products / squares.max(f64::MIN_POSITIVE)).powi(2);
        s.len() as f64 * (1.0 - correlation) / (1.0 + correlation)
    };
    let total: f64 = series.iter().map(count).sum();
    let pooled = series.iter().map(|s| count(s) * s.mean_square()).sum::<f64>() / total;
    // Without Bartlett's correction for small samples: a series has FEWEST values or more.
    let statistic: f64 = series.iter().map(|s| count(s) * (pooled / s.mean_square()).ln()).sum();
    let test = ChiSquared::new(series.len() as f64 - 1.0);
    test.is_ok_and(|chi| chi.sf(statistic.max(0.0)) < UNEQUAL_VARIANCES)
}

//! Noise that is not white: autocorrelated noise, and coordinates with a variance of their own.
//!
//! The estimate stays that of least squares, whose errors then have the covariance
//!
//! ```text
//! (J'J)^-1 J'VJ (J'J)^-1,    V = v R in each coordinate of each measurement
//! ```
//!
//! with an [AR(1) correlation](Ar1Correlation) for `R`. Motion of a few frequencies is told by least squares as well as by any weighting
//! (Grenander 1954). What residuals show of the correlation and the variance is less than what the noise had, by what
//! the fit has taken with it: their expectations, `V - HV - VH + HVH` with `H = J (J'J)^-1 J'`, are matched instead
//! of the noise's own. How far an interval reaches follows from how well both are known (Satterthwaite 1946).

use crate::fit::misfit::ar1::{Ar1Correlation, ar1_factor, usual_spacing};
use crate::fit::misfit::residual_tests::newness;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::noise::coverage_factor::{one_sided95, quantile95};
use crate::fit::uncertainty::noise::residual_noise::Noise;
use crate::numerics::total_order;
use nalgebra::{DMatrix, SymmetricEigen};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Fewer values tell nothing of their neighbours.
const FEWEST: usize = 12;
/// Standard deviations by which the correlation of neighbours must exceed that of white noise.
const SEEN: f64 = 2.0;
/// Coordinates of one measurement have variances of their own where chance makes them as unlike less often.
const UNLIKE: f64 = 1e-2;
/// What a memory leaves of a series is not noise where white noise looks so less often.
const NOT_NEW: f64 = 4e-4;
/// Pairs farther apart than this many usual spacings are not asked how they resemble each other.
const NEIGHBOURS: f64 = 1.5;
/// Correlation and variances follow from each other; each round leaves a small part of the error.
const ROUNDS: usize = 8;
/// Directions of the unknowns that the data do not see.
const UNSEEN: f64 = 1e-12;
/// Part of the residuals' squares that a fit may have taken with it.
const TAKEN: f64 = 0.9;

/// The noise as the residuals at an optimum show it.
pub(crate) struct Correlations {
    pub series: Vec<Series>,
    /// Scatter of the gradient of the misfit over the variance of the noise, `J'VJ`; none for white noise.
    pub scatter: Option<DMatrix<f64>>,
    /// By how much it makes the standard deviation of each unknown larger.
    pub inflation: Vec<f64>,
    /// Degrees of freedom of the variance of each unknown; none where it is known.
    pub freedom: Vec<Option<f64>>,
    /// How many standard deviations the 95 % interval of each unknown reaches to each side.
    pub reach: Vec<f64>,
    /// How many it reaches up when it is open downward.
    pub up: Vec<f64>,
}

/// One coordinate of one measurement.
#[derive(Clone)]
pub(crate) struct Series {
    /// Place of the measurement among all.
    pub measurement: usize,
    pub axis: &'static str,
    /// Correlation of neighbours at their usual spacing, 0 where none is seen.
    pub correlation: f64,
    /// The rows of its values among all, in the order of their times.
    pub rows: Vec<usize>,
    times: Vec<f64>,
    spacing: f64,
    /// What the fit felt of each value.
    felt: Vec<f64>,
    /// Its rows of the Jacobian.
    by: DMatrix<f64>,
    pub variance: f64,
    /// Whether the variance is known, not estimated.
    known: bool,
    /// Whether it has a variance of its own, or a correlation.
    pub own: bool,
}

/// Sums over the pairs of neighbours of a series.
struct Pairs {
    /// Spacings between the two, in usual ones.
    apart: Vec<(usize, f64)>,
    products: f64,
    squares: f64,
}

impl Series {
    /// Its correlation matrix.
    pub fn ar1(&self) -> Ar1Correlation {
        Ar1Correlation::new(&self.times, self.spacing, self.correlation)
    }

    /// How many values a block of it should have that is drawn as a whole (Politis and White 2004); none where
    /// neighbours do not resemble each other.
    pub fn block(&self) -> Option<usize> {
        let excess = 2.0 * self.correlation / (1.0 - self.correlation.powi(2));
        let length = (1.5 * excess * excess * self.rows.len() as f64).cbrt().ceil() as usize;
        (self.correlation > 0.0).then(|| length.clamp(1, self.rows.len()))
    }

    fn pairs(&self) -> Pairs {
        let mut pairs = Pairs { apart: Vec::new(), products: 0.0, squares: 0.0 };
        for (k, (times, felt)) in self.times.windows(2).zip(self.felt.windows(2)).enumerate() {
            let apart = (times[1] - times[0]) / self.spacing;
            if apart <= NEIGHBOURS {
                pairs.apart.push((k, apart));
                pairs.products += felt[0] * felt[1];
                pairs.squares += 0.5 * (felt[0] * felt[0] + felt[1] * felt[1]);
            }
        }
        pairs
    }

    /// Whether neighbours resemble each other more than those of white noise.
    fn is_correlated(&self) -> bool {
        let pairs = self.pairs();
        let n = pairs.apart.len();
        n + 1 >= FEWEST && pairs.products > SEEN * pairs.squares / (n as f64).sqrt()
    }

    /// `R J`.
    fn spread(&self) -> DMatrix<f64> {
        let (correlation, mut spread) = (self.ar1(), self.by.clone());
        for mut column in spread.column_iter_mut() {
            let values: Vec<f64> = column.iter().copied().collect();
            column.copy_from_slice(&correlation.apply(&values));
        }
        spread
    }

    /// `J'VJ` of its rows.
    fn scatter(&self) -> DMatrix<f64> {
        self.variance * self.by.tr_mul(&self.spread())
    }

    /// Its own correlation and variance from those of all, by the `inverse` of the normal matrix and the
    /// `covariance` of the unknowns.
    fn refine(&mut self, inverse: &DMatrix<f64>, covariance: &DMatrix<f64>, correlated: bool) {
        let (n, spread) = (self.felt.len(), self.spread());
        let (mine, all) = (&self.by * inverse, &self.by * covariance / self.variance);
        // Of V - HV - VH + HVH over the variance, less R.
        let taken = |a: usize, b: usize| {
            all.row(a).dot(&self.by.row(b))
                - mine.row(a).dot(&spread.row(b))
                - mine.row(b).dot(&spread.row(a))
        };
        let diagonal: Vec<f64> = (0..n).map(|k| taken(k, k)).collect();
        let left = 1.0 + diagonal.iter().sum::<f64>() / n as f64;
        if !self.known {
            let square = self.felt.iter().map(|r| r * r).sum::<f64>() / n as f64;
            self.variance = square / left.max(1.0 - TAKEN);
        }
        if correlated {
            let pairs = self.pairs();
            let count = pairs.apart.len() as f64;
            let (mut squares, mut products) = (count, 0.0);
            for (k, _) in &pairs.apart {
                squares += 0.5 * (diagonal[*k] + diagonal[k + 1]);
                products += taken(*k, k + 1);
            }
            let seen = (pairs.products / pairs.squares * squares - products) / count;
            // What is left of the bias of a ratio (Marriott and Pope 1954).
            let kept = correlation_with(&pairs.apart, seen) * (1.0 + 2.0 / count);
            self.correlation = kept.clamp(0.0, largest_correlation(count));
        }
    }

    /// Whether the correlation is the largest that the estimate can have.
    fn is_at_cap(&self) -> bool {
        self.correlation > 0.0
            && self.correlation >= largest_correlation(self.pairs().apart.len() as f64)
    }
}

/// The largest estimate of a correlation from so many pairs of neighbors.
fn largest_correlation(pairs: f64) -> f64 {
    1.0 - 2.0 / pairs
}

/// The correlation at the usual spacing that makes pairs so far `apart` correlate by `mean` on average.
fn correlation_with(apart: &[(usize, f64)], mean: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        let sum: f64 = apart.iter().map(|(_, spacings)| ar1_factor(middle, *spacings)).sum();
        let end = if sum > mean * apart.len() as f64 { &mut high } else { &mut low };
        *end = middle;
    }
    0.5 * (low + high)
}

impl Correlations {
    /// From the residuals at an optimum, and the `rows` of the Jacobian in units of the noise.
    pub fn of(fitted: Fitted, rows: &[Vec<f64>], noise: &Noise) -> Self {
        let Fitted { search, optimum } = fitted;
        let n = search.unknowns.len();
        let mut found = Self {
            series: Vec::new(),
            scatter: None,
            inflation: vec![1.0; n],
            freedom: vec![noise.freedom; n],
            reach: vec![noise.reach; n],
            up: vec![noise.up; n],
        };
        if search.is_rounding(optimum) || !noise.variance.is_normal() {
            return found;
        }
        found.series = all_series(fitted, rows, noise);
        let mut correlated: Vec<bool> = found.series.iter().map(Series::is_correlated).collect();
        let unlike = unlike(&found.series);
        if !correlated.contains(&true) && !unlike.contains(&true) {
            return found;
        }
        let all_rows = DMatrix::from_fn(rows.len(), n, |a, j| rows[a][j]);
        let normal = all_rows.tr_mul(&all_rows);
        let inverse = pseudo_inverse(&normal);
        let plain = &normal - found.series.iter().map(|s| s.by.tr_mul(&s.by)).sum::<DMatrix<f64>>();
        let all = |series: &[Series]| {
            let sum = series.iter().fold(DMatrix::zeros(n, n), |sum, s| sum + s.scatter());
            sum + noise.variance * &plain
        };
        for (series, unlike) in found.series.iter_mut().zip(&unlike) {
            series.own = *unlike;
        }
        let mut settled = false;
        while !settled {
            for _ in 0..ROUNDS {
                let covariance = &inverse * all(&found.series) * &inverse;
                for (series, correlated) in found.series.iter_mut().zip(&correlated) {
                    if series.own || *correlated {
                        series.refine(&inverse, &covariance, *correlated);
                    }
                }
            }
            settled = true;
            // Motion that is left is no noise, and stays what it was.
            for (series, correlated) in found.series.iter_mut().zip(&mut correlated) {
                if *correlated && newness(&series.ar1().whiten(&series.felt)) < NOT_NEW {
                    (series.correlation, series.variance) = (0.0, noise.variance);
                    (*correlated, settled) = (false, false);
                }
            }
        }
        for (series, correlated) in found.series.iter_mut().zip(&correlated) {
            series.own |= *correlated;
        }
        if found.series.iter().all(|s| !s.own) {
            return found;
        }
        let scatter = all(&found.series);
        let covariance = &inverse * &scatter * &inverse;
        for j in (0..n).filter(|j| covariance[(*j, *j)] > 0.0) {
            let white = noise.variance * inverse[(j, j)];
            found.inflation[j] = (covariance[(j, j)] / white).sqrt();
        }
        found.freedom = freedom(&found.series, (&inverse, &covariance), noise);
        found.reach = found.freedom.iter().map(|f| quantile95(*f)).collect();
        found.up = found.freedom.iter().map(|f| one_sided95(*f)).collect();
        found.scatter = Some(scatter / noise.variance);
        found
    }

    /// The variance of what is left along a `direction` of the weighted residuals, where none of it is along the unknowns'
    /// rows: each coordinate has its own noise, the others the common one.
    pub fn variance_along(&self, direction: &[f64], noise: &Noise) -> f64 {
        let square = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
        let mut variance = noise.variance * square(direction);
        for series in self.series.iter().filter(|s| s.own) {
            let own: Vec<f64> = series.rows.iter().map(|k| direction[*k]).collect();
            let spread = series.ar1().apply(&own);
            let product: f64 = own.iter().zip(&spread).map(|(a, b)| a * b).sum();
            variance += series.variance * product - noise.variance * square(&own);
        }
        variance
    }

    /// The correlation of neighbours in a coordinate of a measurement, 0 where none is seen.
    pub fn correlation(&self, measurement: usize, axis: &str) -> f64 {
        self.of_coordinate(measurement, axis).0
    }

    /// The same, and whether it is the largest that the estimate can have.
    pub fn of_coordinate(&self, measurement: usize, axis: &str) -> (f64, bool) {
        let own = self.series.iter().find(|s| s.measurement == measurement && s.axis == axis);
        own.map_or((0.0, false), |s| (s.correlation, s.is_at_cap()))
    }
}

/// How well the variance of each unknown is known, as degrees of freedom; none where it is known.
fn freedom(
    series: &[Series],
    (inverse, covariance): (&DMatrix<f64>, &DMatrix<f64>),
    noise: &Noise,
) -> Vec<Option<f64>> {
    let n = inverse.nrows();
    // The square of the relative error of the variance, and the share of what has the common noise.
    let (mut error, mut common) = (vec![0.0; n], vec![1.0; n]);
    for s in series.iter().filter(|s| s.own) {
        let count = s.felt.len() as f64;
        let part = inverse * s.scatter() * inverse;
        let step = 1e-3 * (1.0 - s.correlation);
        let near = (s.correlation > step).then(|| {
            let correlation = s.correlation - step;
            // An error of the correlation leaves that of what is new.
            let new = (1.0 - s.correlation.powi(2)) / (1.0 - correlation.powi(2));
            let variance = if s.known { s.variance } else { s.variance * new };
            let near = Series { correlation, variance, ..s.clone() };
            inverse * near.scatter() * inverse
        });
        for j in (0..n).filter(|j| covariance[(*j, *j)] > 0.0) {
            let share = part[(j, j)] / covariance[(j, j)];
            common[j] -= share;
            if !s.known {
                error[j] += share * share * 2.0 / count;
            }
            if let Some(near) = &near {
                let slope = (part[(j, j)] - near[(j, j)]) / (step * covariance[(j, j)]);
                error[j] += slope * slope * (1.0 - s.correlation.powi(2)) / count;
            }
        }
    }
    let freedom = |(error, common): (f64, f64)| {
        let estimated = noise.freedom.map_or(0.0, |freedom| 2.0 * common.powi(2) / freedom);
        let error = error + estimated;
        (error > 0.0).then(|| 2.0 / error)
    };
    error.into_iter().zip(common).map(freedom).collect()
}

/// Every coordinate of every measurement that has enough values in some order.
fn all_series(fitted: Fitted, rows: &[Vec<f64>], noise: &Noise) -> Vec<Series> {
    let mut found = Vec::new();
    for own in fitted.measured() {
        let MeasuredResiduals { index, experiment, measurement, residuals, .. } = own;
        let (first, loss) = (own.rows.start, measurement.loss());
        let influence = |(k, r)| loss.influence(fitted.search.leverage_weight(k) * r)[0];
        let mut felt: Vec<f64> = own.rows.zip(residuals).map(influence).collect();
        if loss.is_robust() {
            let square = felt.iter().map(|r| r * r).sum::<f64>() / felt.len().max(1) as f64;
            felt.iter_mut().for_each(|r| *r /= square.sqrt().max(f64::MIN_POSITIVE));
        }
        for coordinate in measurement.coordinates(&experiment.problem) {
            let seen = coordinate.places.iter().filter(|(k, _)| *k < residuals.len());
            let mut places: Vec<(usize, f64)> = seen.copied().collect();
            places.sort_by_cached_key(|x| total_order(x.1));
            let times: Vec<f64> = places.iter().map(|(_, t)| *t).collect();
            let Some(spacing) = usual_spacing(&times).filter(|_| times.len() >= FEWEST) else {
                continue;
            };
            let rows_of: Vec<usize> = places.iter().map(|(k, _)| first + k).collect();
            let unknowns = fitted.search.unknowns.len();
            let by = DMatrix::from_fn(times.len(), unknowns, |a, j| rows[rows_of[a]][j]);
            found.push(Series {
                measurement: index,
                axis: coordinate.axis,
                correlation: 0.0,
                felt: places.iter().map(|(k, _)| felt[*k]).collect(),
                rows: rows_of,
                times,
                spacing,
                by,
                variance: noise.variance,
                known: measurement.sigma().is_some(),
                own: false,
            });
        }
    }
    found
}

/// Which coordinates have a variance that differs from that of others of their measurement (Bartlett 1937).
fn unlike(series: &[Series]) -> Vec<bool> {
    let square = |s: &Series| s.felt.iter().map(|r| r * r).sum::<f64>();
    let mut unlike = Vec::with_capacity(series.len());
    for own in series.chunk_by(|a, b| a.measurement == b.measurement) {
        // Autocorrelated noise has fewer independent squares.
        let count = |s: &Series| {
            let pairs = s.pairs();
            let alike = (pairs.products / pairs.squares.max(f64::MIN_POSITIVE)).powi(2);
            s.felt.len() as f64 * (1.0 - alike) / (1.0 + alike)
        };
        let mean = |s: &Series| square(s) / s.felt.len() as f64;
        let total: f64 = own.iter().map(count).sum();
        let pooled = own.iter().map(|s| count(s) * mean(s)).sum::<f64>() / total;
        let statistic: f64 = own.iter().map(|s| count(s) * (pooled / mean(s)).ln()).sum();
        let chance = match own.len() {
            1 => 1.0,
            n => ChiSquared::new((n - 1) as f64).map_or(1.0, |chi| chi.sf(statistic.max(0.0))),
        };
        let known = own.iter().any(|s| s.known);
        unlike.extend(std::iter::repeat_n(!known && chance < UNLIKE, own.len()));
    }
    unlike
}

/// The inverse along the directions that the data see.
fn pseudo_inverse(normal: &DMatrix<f64>) -> DMatrix<f64> {
    let n = normal.nrows();
    let scale = |j: usize| match normal[(j, j)] > 0.0 {
        true => normal[(j, j)].sqrt().recip(),
        false => 0.0,
    };
    let scaled = DMatrix::from_fn(n, n, |a, b| normal[(a, b)] * scale(a) * scale(b));
    let axes = SymmetricEigen::new(scaled);
    let most = axes.eigenvalues.amax();
    let mut inverse = DMatrix::zeros(n, n);
    for (axis, value) in axes.eigenvectors.column_iter().zip(&axes.eigenvalues) {
        if *value > UNSEEN * most {
            inverse += axis * axis.transpose() / *value;
        }
    }
    DMatrix::from_fn(n, n, |a, b| inverse[(a, b)] * scale(a) * scale(b))
}

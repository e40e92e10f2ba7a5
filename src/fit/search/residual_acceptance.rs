//! Classification of the residuals at an optimum: rounding errors, noise, or motion that the model does not explain.
//!
//! Input: an optimum with the residuals of all measurements. Each predicate holds if every measurement satisfies its
//! criterion:
//!
//! - `has_acceptable_residuals`: an RMS residual of at most [`UNEXPLAINED`] of the motion or [`ACCEPTABLE_SIGMAS`]
//!   given sigmas, or white noise of at most [`WRONG_MINIMUM`] of the motion with [`ENOUGH`] values per coordinate.
//! - `has_plausible_residuals`: an RMS residual of at most [`WRONG_MINIMUM`] of the motion.
//! - `is_rounding`: at most [`ROUNDING`] of the scale of the values: of positions the rod's length, or a larger motion,
//!   of frequencies and readings their size.
//! - `is_noise`: white noise by the tests of `misfit::residual_tests` on each coordinate, or rounding errors of all
//!   measurements.
//!
//! Measurements of zero size are acceptable and plausible. RMS residuals are in the unit of the measurement, by a
//! median with a robust loss (`spreads`). The search uses these predicates to stop or to continue with other starts.
//! [`residual_tests()`] returns the tests per coordinate (none of frequencies). They and [`are_residuals_noise`] serve
//! the warnings and the grade, also for AR(1) noise. `unexplained_fraction` is the RMS residual of all measurements
//! over the RMS size of their motions, both in sigmas. `significance_level` is that of the tests of one coordinate,
//! corrected for their number.

use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::misfit::initial_sigmas::UNEXPLAINED;
use crate::fit::misfit::residual_tests::{self, ResidualSeries, ResidualTests};
use crate::fit::search::Search;
use crate::fit::search::fitted::MeasuredResiduals;
use crate::fit::search::optimum::Optimum;
use crate::numerics::total_order;

/// Largest RMS residual that is ascribed to rounding errors of exact data, over the scale of the measurement (of
/// positions mostly the length of the rod).
const ROUNDING: f64 = 1e-8;
/// Smallest RMS residual of a wrong minimum, over the RMS of the motion. Below it mesh and step may explain the
/// residuals, above it hardly.
const WRONG_MINIMUM: f64 = 0.5;
/// Largest RMS residual of an acceptable fit, in given sigmas. A smaller number continues the search where the given
/// sigma is too small.
const ACCEPTABLE_SIGMAS: f64 = 3.0;
/// Smallest number of values per coordinate with which the tests detect residuals other than noise.
const ENOUGH: usize = 30;
/// Name of the coordinate along the normal of a center line, for residuals of shapes with fitted arc lengths.
pub(crate) const NORMAL: &str = "normal";

impl Search<'_> {
    /// Whether each measurement satisfies one of three criteria. Its RMS residual is at most [`UNEXPLAINED`] (a tenth)
    /// of its motion or [`ACCEPTABLE_SIGMAS`] (three) given sigmas; it has no motion at all; or its residuals are
    /// [white noise](are_residuals_noise). The RMS residual is that of [`spreads`](Self::spreads).
    pub fn has_acceptable_residuals(&self, optimum: &Optimum) -> bool {
        let spreads = self.spreads(optimum);
        self.measured(optimum).zip(spreads).all(|(own, rms)| {
            let size = own.size();
            // Noise alone may be a large part of a small motion: a stated sigma accepts it.
            let sigma = own.measurement.sigma().unwrap_or(0.0);
            rms <= (UNEXPLAINED * size).max(ACCEPTABLE_SIGMAS * sigma)
                || size == 0.0
                || are_residuals_noise(&own, rms, |_| 0.0, self.significance_level())
        })
    }

    /// Whether the RMS residual ([`spreads`](Self::spreads): by the median with a robust loss) of every measurement
    /// with a motion is at most [`WRONG_MINIMUM`] (half) of that: not a wrong minimum, while mesh and step may still be
    /// too coarse.
    pub fn has_plausible_residuals(&self, optimum: &Optimum) -> bool {
        let spreads = self.spreads(optimum);
        self.measured(optimum).zip(spreads).all(|(own, rms)| {
            let size = own.size();
            rms <= WRONG_MINIMUM * size || size == 0.0
        })
    }

    /// RMS residual over the RMS size of the measured motions, both in sigmas (no unit): `sqrt(2 cost/sum(count
    /// (size/sigma)^2))`. `cost` is the objective, `counts` the number of residuals of each measurement in it, which
    /// may be a part of the record.
    pub fn unexplained_fraction(&self, cost: f64, counts: &[usize]) -> f64 {
        let own = all(self.experiments).zip(&self.sigmas).zip(counts);
        // The size of the motion in sigmas is about the RMS residual of a rod that does not move.
        let square = |(((e, m), sigma), count): (((&Experiment, &Measurement), &f64), &usize)| {
            *count as f64 * (m.size(&e.problem) / sigma).powi(2)
        };
        (2.0 * cost / own.map(square).sum::<f64>()).sqrt()
    }

    /// Whether the RMS residual of every measurement is at most [`ROUNDING`] times its scale: of positions the length
    /// of the rod or a larger motion, of other values their size.
    pub fn is_rounding(&self, optimum: &Optimum) -> bool {
        let spreads = self.spreads(optimum);
        let mut measured = self.measured(optimum).zip(spreads);
        measured.all(|(own, spread)| {
            spread <= ROUNDING * own.measurement.scale(&own.experiment.problem)
        })
    }

    /// Whether the residuals of every coordinate are white noise (no autocorrelation, no trend), or those of all
    /// measurements are [rounding errors](Self::is_rounding). Coordinates without tests, as frequencies, do not count.
    pub fn is_noise(&self, optimum: &Optimum) -> bool {
        let significance = self.significance_level();
        let mut tests =
            self.measured(optimum).flat_map(|own| residual_tests(&own, |_| 0.0, significance));
        self.is_rounding(optimum) || tests.all(|tests| tests.is_noise())
    }

    /// Significance level of the tests of one coordinate, by Bonferroni's correction for the number of measured
    /// coordinates of all measurements: `min(0.001, 0.02/number)`.
    pub fn significance_level(&self) -> f64 {
        let coordinates = all(self.experiments).map(|(e, m)| m.coordinates(&e.problem).len());
        residual_tests::significance_level(coordinates.sum())
    }

    /// Root mean square residual of each measurement, in its unit, by
    /// [`Loss::spread`](crate::fit::measurement::loss::Loss::spread), which hardly depends on outliers with a robust
    /// loss. With leverage weights of growing sensitivities the residuals are weighted, and the result is divided by
    /// the root mean square weight.
    pub fn spreads(&self, optimum: &Optimum) -> Vec<f64> {
        let weights = self.growth_weights();
        let spread = |MeasuredResiduals { measurement, sigma, residuals, rows, .. }| {
            let loss = measurement.loss();
            let own = weights.get(rows).unwrap_or(&[]);
            // A down-weighted value has a weight below one.
            let mean = own.iter().map(|w| w * w).sum::<f64>() / own.len().max(1) as f64;
            match mean > 0.0 && mean < 1.0 {
                true => {
                    let weighted: Vec<f64> =
                        residuals.iter().zip(own).map(|(r, w)| r * w).collect();
                    loss.spread(&weighted) / mean.sqrt() * sigma
                }
                false => loss.spread(residuals) * sigma,
            }
        };
        self.measured(optimum).map(spread).collect()
    }
}

/// Values of one coordinate in ascending order of their abscissas (times, s, or arc lengths, m).
struct SortedValues {
    abscissas: Vec<f64>,
    values: Vec<f64>,
}

impl SortedValues {
    /// Sorts pairs of abscissa and value by the abscissa, ascending.
    fn new(mut pairs: Vec<[f64; 2]>) -> Self {
        pairs.sort_by_cached_key(|pair| total_order(pair[0]));
        let (abscissas, values) = pairs.into_iter().map(|[x, y]| (x, y)).unzip();
        Self { abscissas, values }
    }
}

/// Tests of the residuals of every coordinate of a measurement, in ascending order of time or arc length, at this level
/// of `significance`. `correlation` returns the lag-1 correlation of the noise of an axis (0: white). A shape with
/// fitted arc lengths has one test, of the offsets along the normal of the line. Empty for frequencies, which have no
/// order; coordinates with too few values have none.
pub(crate) fn residual_tests(
    MeasuredResiduals { experiment, measurement, residuals, .. }: &MeasuredResiduals,
    correlation: impl Fn(&str) -> f64,
    significance: f64,
) -> Vec<ResidualTests> {
    // Frequencies of different modes are no series in time.
    if measurement.frequencies().is_some() {
        return Vec::new();
    }
    let test = |axis: &str, pairs: Vec<[f64; 2]>, correlation: f64| {
        let sorted = SortedValues::new(pairs);
        let series = ResidualSeries {
            times: &sorted.abscissas,
            abscissa: measurement.abscissa(),
            residuals: &sorted.values,
            loss: measurement.loss(),
            correlation,
        };
        ResidualTests::new(experiment.label(measurement), axis, series, significance)
    };
    if let Some(shape) = measurement.shape()
        && shape.arc_lengths_fitted
    {
        // The two coordinates of a point are one value: its offset along the normal of the line.
        let offsets = shape.normal_offsets(&experiment.problem, residuals);
        return test(NORMAL, offsets, 0.0).into_iter().collect();
    }
    let tests = measurement.coordinates(&experiment.problem).into_iter().filter_map(|coordinate| {
        let values = coordinate.first_values(residuals.len());
        let pairs = values.map(|value| [value.abscissa, residuals[value.index]]).collect();
        test(coordinate.axis, pairs, correlation(coordinate.axis))
    });
    tests.collect()
}

/// Whether the residuals of the measurement `own` are white or AR(1) noise without a trend at this level of
/// `significance`. Their root mean square `rms`, in its unit, must be at most [`WRONG_MINIMUM`] of the motion, and
/// there must be [`ENOUGH`] residuals for each tested coordinate (for one, without tests). `correlation` returns the
/// lag-1 correlation of the noise of an axis.
pub(crate) fn are_residuals_noise(
    own: &MeasuredResiduals,
    rms: f64,
    correlation: impl Fn(&str) -> f64,
    significance: f64,
) -> bool {
    let tests = residual_tests(own, correlation, significance);
    // Few values pass any test, and residuals of the size of the motion are no noise whatever the tests find.
    rms <= WRONG_MINIMUM * own.size()
        && own.residuals.len() >= ENOUGH * tests.len().max(1)
        && tests.iter().all(ResidualTests::is_noise)
}

//! What an optimum leaves of the measurements: rounding errors, noise, or motion that the model does not
//! explain.

use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::misfit::initial_sigmas::UNEXPLAINED;
use crate::fit::misfit::residual_tests::{self, ResidualTests};
use crate::fit::search::Search;
use crate::fit::search::fitted::MeasuredResiduals;
use crate::fit::search::optimum::Optimum;
use crate::numerics::total_order;

/// Residuals below this part of the rod's length are rounding errors, not noise.
const ROUNDING: f64 = 1e-8;
/// At a wrong minimum more than this part of the motion is left.
const LEFT_IF_WRONG: f64 = 0.5;
/// Values per coordinate from which on tests are trusted to find what is not noise.
const ENOUGH: usize = 30;
/// Name of the coordinate along the normal of a center line.
pub(crate) const NORMAL: &str = "normal";

impl Search<'_> {
    /// Whether every measurement is explained but for a tenth of its motion, three sigma, or noise.
    pub fn has_acceptable_residuals(&self, optimum: &Optimum) -> bool {
        let spreads = self.spreads(optimum);
        self.measured(optimum).zip(spreads).all(|(own, rms)| {
            let size = own.size();
            rms <= (UNEXPLAINED * size).max(3.0 * own.measurement.sigma().unwrap_or(0.0))
                || size == 0.0
                || is_noisy(&own, rms, |_| 0.0, self.significance_level())
        })
    }

    /// Whether at most half of every measurement is left: not a wrong minimum, but mesh and step may leave as much.
    pub fn has_plausible_residuals(&self, optimum: &Optimum) -> bool {
        let spreads = self.spreads(optimum);
        let is_explained = |(own, rms): (MeasuredResiduals, f64)| {
            let size = own.size();
            rms <= LEFT_IF_WRONG * size || size == 0.0
        };
        self.measured(optimum).zip(spreads).all(is_explained)
    }

    /// The part of what was measured that a misfit leaves, as the root of squares, where `counts` values
    /// of each measurement are looked at.
    pub fn unexplained_fraction(&self, cost: f64, counts: &[usize]) -> f64 {
        let own = all(self.experiments).zip(&self.sigmas).zip(counts);
        let square = |(((e, m), sigma), count): (((&Experiment, &Measurement), &f64), &usize)| {
            *count as f64 * (m.size(&e.problem) / sigma).powi(2)
        };
        (2.0 * cost / own.map(square).sum::<f64>()).sqrt()
    }

    /// Whether nothing but rounding errors is left of any measurement.
    pub fn is_rounding(&self, optimum: &Optimum) -> bool {
        let spreads = self.spreads(optimum);
        let mut measured = self.measured(optimum).zip(spreads);
        measured.all(|(own, spread)| {
            spread <= ROUNDING * own.measurement.scale(&own.experiment.problem)
        })
    }

    /// Whether what is left looks like noise, or is rounding errors.
    pub fn is_noise(&self, optimum: &Optimum) -> bool {
        let significance = self.significance_level();
        let mut tests =
            self.measured(optimum).flat_map(|own| residual_tests(&own, |_| 0.0, significance));
        self.is_rounding(optimum) || tests.all(|tests| tests.is_noise())
    }

    /// What is no chance in one of all coordinates that were measured.
    pub fn significance_level(&self) -> f64 {
        let coordinates = all(self.experiments).map(|(e, m)| m.coordinates(&e.problem).len());
        residual_tests::significance_level(coordinates.sum())
    }

    /// Root mean square residual of each measurement, in its unit; whatever outliers do, where the
    /// loss is robust.
    pub fn spreads(&self, optimum: &Optimum) -> Vec<f64> {
        let weights = self.growth_weights();
        let spread = |MeasuredResiduals { measurement, sigma, residuals, rows, .. }| {
            let loss = measurement.loss();
            let own = weights.get(rows).unwrap_or(&[]);
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

/// Tests every coordinate of a measurement, whose residuals these are, for being noise whose neighbours
/// correlate as `correlation` says of its axis; what is less probable than `significance` is no chance.
pub(crate) fn residual_tests(
    MeasuredResiduals { experiment, measurement, residuals, .. }: &MeasuredResiduals,
    correlation: impl Fn(&str) -> f64,
    significance: f64,
) -> Vec<ResidualTests> {
    if measurement.frequencies().is_some() {
        return Vec::new();
    }
    if let Some(shape) = measurement.shape()
        && shape.arc_lengths_fitted
    {
        // Both coordinates of an offset along the normal are one value.
        let mut offsets = shape.normal_offsets(&experiment.problem, residuals);
        offsets.sort_by_cached_key(|x| total_order(x[0]));
        let (places, values): (Vec<f64>, Vec<f64>) =
            offsets.into_iter().map(|[along, offset]| (along, offset)).unzip();
        let label = (experiment.label(measurement), NORMAL);
        let tests =
            ResidualTests::new(label, (&places, &values), measurement.loss(), 0.0, significance);
        return tests.into_iter().collect();
    }
    let tests = measurement.coordinates(&experiment.problem).into_iter().filter_map(|coordinate| {
        let places = coordinate.ascending(residuals.len()).into_iter();
        let (times, values): (Vec<f64>, Vec<f64>) = places.map(|(k, t)| (t, residuals[k])).unzip();
        let (label, axis) = (experiment.label(measurement), coordinate.axis);
        let (loss, correlation) = (measurement.loss(), correlation(axis));
        ResidualTests::new((label, axis), (&times, &values), loss, correlation, significance)
    });
    tests.collect()
}

/// Whether the record is noisy enough, and long enough to tell, that what is left of it, of this root mean square, is
/// noise whose neighbours correlate as said of each axis.
pub(crate) fn is_noisy(
    own: &MeasuredResiduals,
    rms: f64,
    correlation: impl Fn(&str) -> f64,
    significance: f64,
) -> bool {
    let tests = residual_tests(own, correlation, significance);
    rms <= LEFT_IF_WRONG * own.size()
        && own.residuals.len() >= ENOUGH * tests.len().max(1)
        && tests.iter().all(ResidualTests::is_noise)
}

//! What speaks against an optimum: motion that is left over, residuals that are no noise, bounds that
//! were reached, and what was known before.

use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::covariance::Local;
use crate::fit::uncertainty::residual_tests::ResidualTests;
use crate::fit::uncertainty::verdict::{Doubts, Weight, percent};
use crate::fit::unknown::Unknown;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Part of the observed motion that a model may leave unexplained before the search is repeated
/// on a finer grid, and before the report warns, unless it is noise.
pub(crate) const UNEXPLAINED: f64 = 0.1;

/// Residuals this many times the noise are not it, however many there are.
const OFF: f64 = 1.5;
/// Residuals below this part of the rod's length are rounding errors, not noise.
const ROUNDING: f64 = 1e-8;
/// Values per coordinate from which on tests are trusted to find what is not noise.
const ENOUGH: usize = 30;

impl Search<'_> {
    /// Whether every measurement is explained but for a tenth of its motion, three sigma, or noise.
    pub fn explained(&self, optimum: &Optimum) -> bool {
        let spreads = self.spreads(optimum);
        self.measured(optimum).zip(spreads).all(|((experiment, measurement, _, own), rms)| {
            let size = measurement.size(&experiment.problem);
            rms <= (UNEXPLAINED * size).max(3.0 * measurement.sigma().unwrap_or(0.0))
                || size == 0.0
                || is_noisy(experiment, measurement, rms, own)
        })
    }

    /// Whether nothing but rounding errors is left of any measurement.
    pub fn is_rounding(&self, optimum: &Optimum) -> bool {
        let spreads = self.spreads(optimum);
        self.measured(optimum)
            .zip(spreads)
            .all(|((e, m, ..), spread)| spread <= ROUNDING * m.scale(&e.problem))
    }

    /// What keeps an optimum from being one, where the misfit jumps.
    pub fn jumps(&self, optimum: &Optimum, doubts: &mut Doubts) {
        let doubtful = !(optimum.converged && self.is_noise(optimum));
        let words = "time steps were taken in halves, and which ones jumps with the parameters, and the \
                     misfit with it: take a smaller time.step, or scheme = \"average-vector-field\"";
        if optimum.halved && doubtful {
            doubts.add(Weight::Numerics, words);
        }
    }

    /// Whether what is left looks like noise, or is rounding errors.
    pub fn is_noise(&self, optimum: &Optimum) -> bool {
        let tests = self.measured(optimum).flat_map(|(e, m, _, own)| residual_tests(e, m, own));
        self.is_rounding(optimum) || tests.into_iter().all(|tests| tests.is_noise())
    }
}

/// Whether residuals of this root mean square, in units of the noise they should be, are not it: by
/// half for many values, and more for few, which noise makes as large once in a thousand times.
pub(crate) fn is_too_large(rms: f64, values: usize) -> bool {
    let n = values.max(1) as f64;
    let by_chance = ChiSquared::new(n).map_or(0.0, |chi| (chi.inverse_cdf(0.999) / n).sqrt());
    rms > by_chance.max(OFF)
}

/// What of the measurements is left, if it is too much.
pub(crate) fn unexplained(search: &Search, optimum: &Optimum, doubts: &mut Doubts) {
    if search.is_rounding(optimum) {
        return;
    }
    let spreads = search.spreads(optimum);
    for ((experiment, measurement, _, own), rms) in search.measured(optimum).zip(spreads) {
        let (label, unit) = (experiment.label(measurement), measurement.unit());
        let size = measurement.size(&experiment.problem);
        let noise = 3.0 * measurement.sigma().unwrap_or(0.0);
        if rms > (UNEXPLAINED * size).max(noise) && !is_noisy(experiment, measurement, rms, own) {
            let part = rms / size.max(f64::MIN_POSITIVE);
            // Standing still at the mean of what was observed leaves no more.
            let weight = if part >= 1.0 { Weight::Worthless } else { Weight::Unexplained };
            let words = format!(
                "{label}: the model leaves {} of what was observed unexplained ({rms:.3e} {unit} of \
                 {size:.3e} {unit})",
                percent(part)
            );
            doubts.add(weight, words);
        }
        let too_large = |sigma: &f64| is_too_large(rms / sigma, own.len());
        if let Some(sigma) = measurement.sigma().filter(too_large) {
            let words = format!(
                "{label}: the residuals are {} the stated sigma; the intervals are too narrow",
                times(rms / sigma)
            );
            doubts.add(Weight::Misfit, words);
        }
    }
}

/// A factor as a person says it.
pub(crate) fn times(factor: f64) -> String {
    match factor {
        f if f.is_nan() || f > 1000.0 => "more than 1000 times".into(),
        f => format!("{f:.1} times"),
    }
}

/// Recorded motions whose supports move too fast for the steps.
pub(crate) fn steps_too_large(experiments: &[Experiment], doubts: &mut Doubts) {
    for experiment in experiments.iter().filter(|e| e.moves()) {
        for words in experiment.problem.warnings() {
            doubts.add(Weight::Numerics, experiment.key(&words));
        }
    }
}

/// Tests every coordinate of a measurement, whose residuals these are, for being noise.
fn residual_tests(
    experiment: &Experiment,
    measurement: &Measurement,
    residuals: &[f64],
) -> Vec<ResidualTests> {
    if let Measurement::Frequencies(_) = measurement {
        return Vec::new();
    }
    let tests = measurement.coordinates(&experiment.problem).into_iter().filter_map(|coordinate| {
        let seen = coordinate.places.iter().filter(|(k, _)| *k < residuals.len());
        let (times, values): (Vec<f64>, Vec<f64>) = seen.map(|(k, t)| (t, residuals[*k])).unzip();
        let label = experiment.label(measurement);
        ResidualTests::new(label, coordinate.axis, &times, &values, measurement.loss())
    });
    tests.collect()
}

/// Whether the record is noisy enough, and long enough to tell, that what is left of it is
/// noise. At a wrong minimum more than half is left.
fn is_noisy(
    experiment: &Experiment,
    measurement: &Measurement,
    rms: f64,
    residuals: &[f64],
) -> bool {
    let tests = residual_tests(experiment, measurement, residuals);
    rms <= 0.5 * measurement.size(&experiment.problem)
        && residuals.len() >= ENOUGH * tests.len().max(1)
        && tests.iter().all(ResidualTests::is_noise)
}

pub(crate) fn test_residuals(
    search: &Search,
    optimum: &Optimum,
    doubts: &mut Doubts,
) -> Vec<ResidualTests> {
    let mut all = Vec::new();
    for (experiment, measurement, _, own) in search.measured(optimum) {
        for tests in residual_tests(experiment, measurement, own) {
            if !tests.is_noise() {
                let words = format!(
                    "{}, {}: {}: the model misses something, and the intervals are too narrow",
                    tests.observation, tests.axis, tests.verdict
                );
                doubts.add(Weight::Misfit, words);
            } else if !tests.passed {
                let words = format!(
                    "{}, {}: {}: some values may be far off; a robust loss (huber, cauchy) shows which",
                    tests.observation, tests.axis, tests.verdict
                );
                doubts.add(Weight::Note, words);
            }
            all.push(tests);
        }
    }
    all
}

/// Unknowns that a bound keeps from where the data want them.
pub(crate) fn bounds_reached(
    unknowns: &[Unknown],
    optimum: &Optimum,
    local: &Local,
    doubts: &mut Doubts,
) {
    for ((unknown, x), deviation) in unknowns.iter().zip(&optimum.x).zip(&local.deviation) {
        let [low, high] = unknown.scaled_bounds();
        if deviation.is_some() && (*x <= low || *x >= high) {
            let bound = unknown.from_scale(if *x <= low { low } else { high });
            let words = format!(
                "{unknown} ended at its bound {bound}: its interval does not account for that"
            );
            doubts.add(Weight::Contradiction, words);
        }
    }
}

/// Data that contradict what was known before them.
pub(crate) fn surprises(unknowns: &[Unknown], optimum: &Optimum, doubts: &mut Doubts) {
    for (unknown, x) in unknowns.iter().zip(&optimum.x) {
        if let Some(surprise) = unknown.surprise(*x).filter(|s| s.abs() > 3.0) {
            let words = format!(
                "{unknown} ended {:.1} sigma from its prior's mean: data and prior contradict each \
                 other",
                surprise.abs()
            );
            doubts.add(Weight::Contradiction, words);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::is_too_large;

    /// One value is off by two sigma every twentieth time, a hundred never are.
    #[test]
    fn few_values_may_be_off() {
        assert!(!is_too_large(2.0, 1) && is_too_large(3.4, 1));
        assert!(is_too_large(1.6, 100) && !is_too_large(1.4, 100));
    }
}

//! Preparation of a series for the noise estimate of [`noise_scale`](super), and its normalized divided differences.
//!
//! Excluded samples and values that repeat the one before (repeated frames) are removed. Repeats stay in a coarsely
//! quantized series, with fewer distinct values than [`DISTINCT`] of the samples. `mark_outliers` marks samples in the
//! middle of second differences that are peaks above [`OUTLYING`] robust standard deviations (from the median of
//! absolute values), in up to [`ROUNDS`] rounds, and returns their number. [`NoiseSamples::difference`] returns a
//! divided difference of every n-th sample in the unit of the values. Its weights times the relative standard
//! deviations of the samples have the Euclidean norm one, so that white noise keeps its standard deviation. It is
//! `None` across an outlier or a step of time above [`GAP`] median steps, and beyond the end of the series.

use crate::numerics::noise_scale::{HIGHEST_ORDER, NoisySeries};
use crate::numerics::upper_median;

/// A step of the clock this many times the median one is a gap: the signal dominates a difference across it.
const GAP: f64 = 2.5;
/// A difference of this many robust standard deviations belongs to an outlier or a jump; normal noise has one in
/// 150,000.
const OUTLYING: f64 = 4.5;
/// Largest number of rounds of marking outliers, each of which lowers the robust standard deviation.
const ROUNDS: usize = 8;
/// Median of the absolute value of a standard normal deviate.
const MEDIAN_DEVIATION: f64 = 0.674_489_75;
/// Series with fewer distinct values than this fraction of the samples are coarsely quantized: equal neighbors are no
/// repeated frames.
const DISTINCT: f64 = 0.25;

/// Usable samples of a series in the order of their times.
pub(super) struct NoiseSamples {
    /// Times of the samples, ascending.
    times: Vec<f64>,
    /// Values of the samples.
    pub values: Vec<f64>,
    /// Relative standard deviation of each sample.
    factors: Vec<f64>,
    /// Whether each sample is marked as an outlier.
    is_outlier: Vec<bool>,
    /// Time between samples above which there is a gap.
    longest_step: f64,
}

impl NoiseSamples {
    /// The samples of a series without excluded ones and without values that repeat the one before (repeated frames).
    /// Repeated values stay in a series with fewer distinct values than [`DISTINCT`] of the samples, which is coarsely
    /// quantized. A step of time above [`GAP`] median steps is a gap. No sample is marked as an outlier yet.
    pub fn new(series: &NoisySeries) -> Self {
        let total = series.values.len();
        let is_excluded = |k: usize| series.excluded.get(k).copied().unwrap_or(false);
        let mut distinct = series.values.to_vec();
        distinct.sort_by(f64::total_cmp);
        distinct.dedup();
        let is_coarse = (distinct.len() as f64) < DISTINCT * total as f64;
        let mut samples = Self {
            times: Vec::with_capacity(total),
            values: Vec::with_capacity(total),
            factors: Vec::with_capacity(total),
            is_outlier: Vec::new(),
            longest_step: f64::INFINITY,
        };
        for k in (0..total).filter(|k| !is_excluded(*k)) {
            let value = series.values[k];
            if !is_coarse && samples.values.last() == Some(&value) {
                continue;
            }
            samples.times.push(series.times[k]);
            samples.values.push(value);
            samples.factors.push(series.factors.get(k).copied().unwrap_or(1.0));
        }
        samples.is_outlier = vec![false; samples.values.len()];
        // The median step of the clock defines a gap.
        let step = upper_median(samples.times.windows(2).map(|w| w[1] - w[0]));
        samples.longest_step = step.map_or(f64::INFINITY, |step| GAP * step);
        samples
    }

    /// Marks samples as outliers: those in the middle of second differences that exceed [`OUTLYING`] robust standard
    /// deviations and both neighboring differences. Repeats without the differences across marked samples until none is
    /// found, up to [`ROUNDS`] times. Returns the number of outliers.
    pub fn mark_outliers(&mut self) -> usize {
        let mut count = 0;
        for _ in 0..ROUNDS {
            // Robust scale of the second differences, from the median of their absolute values.
            let normalized = |first: usize| Some((first, self.difference(first, 2, 1)?.0));
            let last = self.values.len().saturating_sub(2);
            let found: Vec<(usize, f64)> = (0..last).filter_map(normalized).collect();
            let median = upper_median(found.iter().map(|(_, d)| d.abs()));
            let Some(median) = median.filter(|median| *median > 0.0) else { break };
            let most = OUTLYING * median / MEDIAN_DEVIATION;
            let size = |k: usize| {
                found
                    .binary_search_by_key(&k, |(first, _)| *first)
                    .map_or(0.0, |k| found[k].1.abs())
            };
            // An outlier is in three differences, with twice the weight in the middle one.
            let is_peak = |(first, d): &&(usize, f64)| {
                let before = first.checked_sub(1).map_or(0.0, size);
                d.abs() > most && d.abs() > before && d.abs() >= size(first + 1)
            };
            let peaks: Vec<usize> = found.iter().filter(is_peak).map(|(k, _)| k + 1).collect();
            if peaks.is_empty() {
                break;
            }
            count += peaks.len();
            peaks.into_iter().for_each(|k| self.is_outlier[k] = true);
        }
        count
    }

    /// The divided difference of `order` over every `stride`-th sample from number `first` on, divided by the norm of
    /// its weights times the factors of the samples. Returned with these normalized products of weight and factor, one
    /// per sample in the difference; entries above `order` are zero. `None` if it crosses a gap or an outlier, exceeds
    /// the series, or has no finite weights.
    pub fn difference(
        &self,
        first: usize,
        order: usize,
        stride: usize,
    ) -> Option<(f64, [f64; HIGHEST_ORDER + 1])> {
        let last = first + order * stride;
        if last >= self.values.len() || self.is_outlier[first..=last].contains(&true) {
            return None;
        }
        let is_gap = |w: &[f64]| w[1] - w[0] > self.longest_step;
        if self.times[first..=last].windows(2).any(is_gap) {
            return None;
        }
        let at = |i: usize| self.times[first + i * stride];
        // Times in units of the window keep products near one.
        let length = at(order) - at(0);
        let (mut weights, mut square) = ([0.0; HIGHEST_ORDER + 1], 0.0);
        for i in 0..=order {
            let others = (0..=order).filter(|j| *j != i);
            let product: f64 = others.map(|j| (at(i) - at(j)) / length).product();
            weights[i] = product.recip();
            square += (weights[i] * self.factors[first + i * stride]).powi(2);
        }
        if !square.is_normal() {
            return None;
        }
        // Weights of length one, in units of the standard deviation of each sample.
        let mut value = 0.0;
        for i in 0..=order {
            value += weights[i] / square.sqrt() * self.values[first + i * stride];
            weights[i] *= self.factors[first + i * stride] / square.sqrt();
        }
        Some((value, weights))
    }
}

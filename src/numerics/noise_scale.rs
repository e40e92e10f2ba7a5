//! Standard deviation of white noise on a sampled smooth signal, from differences of the samples.
//!
//! A divided difference of order `m` annihilates polynomials of degree `m - 1`. With weights `c` of Euclidean norm one
//! its square has the expectation `sigma^2` for white noise, at any sampling times, plus the leakage of the signal:
//! `A^2/2 (2 sin(w h/2))^(2m) / binom(2m, m)` for a wave of amplitude `A`, frequency `w` and step `h`. The estimate
//!
//! ```text
//! s^2 = sum (c.x)^2/n,   degrees of freedom tr(A)^2/tr(A^2),   A = sum c c'/n
//! ```
//!
//! over `n` differences is that of the lowest of the orders 2 to 6 that the next one does not significantly lower (von
//! Neumann 1941; Gasser, Sroka and Jennen-Steinmetz 1986). If the highest order still lowers it, the estimate is marked
//! as an upper bound. Autocorrelated noise lowers it: AR(1) of 0.3, 0.8, 0.95 between neighbors to 0.83, 0.35, 0.18 of
//! the truth. A comparison with every second sample reveals strong autocorrelation and smoothing. An effect that the
//! model of a fit lacks has no part in it.
//!
//! [`NoisySeries::noise`] returns the estimate in the unit of the values, for a sample with the factor 1, or the reason
//! why there is none. Reasons are constant values, fewer than [`FEWEST_DIFFERENCES`] differences, a part of outliers
//! above `MOST_OUTLIERS`, or autocorrelation (with a lower bound). Excluded samples, repeated frames and outliers are
//! left out before (`samples`). `quantization_step` returns the step of values that were rounded to multiples of it.
//! Fits use the estimate as the noise of recordings.

mod samples;
#[cfg(test)]
mod tests;

use crate::numerics::noise_scale::samples::NoiseSamples;

/// Orders of differences that are compared. A moving signal leaks little into differences of order two and above;
/// weights of orders above six select the Nyquist frequency instead of an average over the spectrum.
const ORDERS: std::ops::RangeInclusive<usize> = 2..=6;
/// The highest of these orders.
const HIGHEST_ORDER: usize = 6;
/// Fewest differences for an estimate: with fewer its standard deviation exceeds a third of it.
pub const FEWEST_DIFFERENCES: usize = 20;
/// Part of the samples that are outliers above which there is no estimate: the remaining differences are too few and
/// too contaminated. A tenth is accepted; the margin is the error of the count in a hundred samples.
const MOST_OUTLIERS: f64 = 0.12;
/// An order is sufficient if the next one lowers the variance by at most this many standard errors of the difference of
/// the two.
const SIGNIFICANT_DECREASE: f64 = 1.0;
/// Noise is autocorrelated if the estimate from every second sample exceeds that from all by this many standard errors
/// of independent estimates. Both share samples, so that white noise is above it in one of 100 series.
const OVERSAMPLING_LEVEL: f64 = 1.8;
/// A wave that leaks into the estimate from every second sample lowers its variance from one order to the next below
/// this part, for periods above 6.5 samples; AR(1) noise keeps 0.8 and more.
const LEAKAGE_DECREASE: f64 = 0.75;
/// Values are on a lattice where they are whole multiples of their smallest difference to this part of it.
const LATTICE_TOLERANCE: f64 = 1e-3;

/// Smallest difference of values, relative to their range, that is no rounding error of a unit conversion.
const SMALLEST_DIFFERENCE: f64 = 1e-9;

/// Number of differences above which a lattice is no coincidence: two or three distinct values are always on one.
const COINCIDENT_DIFFERENCES: usize = 3;

/// One coordinate of a recording.
#[derive(Clone, Copy)]
pub struct NoisySeries<'a> {
    /// Times of the samples, ascending, s.
    pub times: &'a [f64],
    /// Samples of a signal with noise.
    pub values: &'a [f64],
    /// Standard deviation of each sample over the estimated one; all one where empty.
    pub factors: &'a [f64],
    /// Whether each sample is left out, as those that a fit down-weights; none is where empty.
    pub excluded: &'a [bool],
}

/// An estimated standard deviation of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseEstimate {
    /// Standard deviation of a sample with the factor 1, in the unit of the values.
    pub sigma: f64,
    /// Degrees of freedom of its square.
    pub degrees_of_freedom: f64,
    /// Order of the differences.
    pub order: usize,
    /// Whether the estimate still falls at the highest order: then it is an upper bound.
    pub is_bound: bool,
}

/// Reasons why the noise of a series cannot be estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoEstimate {
    /// All values are the same.
    Constant,
    /// Too few usable differences: their number.
    Few(usize),
    /// Too many outliers: the part of the samples that are.
    Outliers(f64),
    /// The estimate from every second sample is `ratio` times that from all: the noise is autocorrelated or smoothed.
    Oversampled {
        /// Ratio of the two estimates.
        ratio: f64,
        /// Lower bound of the standard deviation: the estimate from all samples.
        lower_bound: f64,
    },
}

/// Estimated variance of the noise from the normalized differences of one order.
struct DifferenceVariance {
    order: usize,
    count: usize,
    variance: f64,
    degrees_of_freedom: f64,
}

impl NoisySeries<'_> {
    /// The standard deviation of white noise on the values, in their unit, from differences of the lowest order that
    /// the signal does not dominate (from 2 to 6). It is that of a sample with the factor 1. Excluded samples, repeated
    /// frames and outliers are left out first. The result is marked as an upper bound if the variance still decreases
    /// at the highest order.
    ///
    /// # Errors
    ///
    /// The reason why it cannot be estimated: constant values, fewer than [`FEWEST_DIFFERENCES`] differences, more than
    /// [`MOST_OUTLIERS`] outliers, or autocorrelated noise, with the estimate as a lower bound.
    pub fn noise(&self) -> Result<NoiseEstimate, NoEstimate> {
        let samples = self.usable()?;
        let by_order = |stride: usize| -> Vec<DifferenceVariance> {
            let tried = ORDERS.map(|order| differences(&samples, order, stride));
            tried.filter(|d| d.count >= FEWEST_DIFFERENCES).collect()
        };
        // The lowest order at which the signal leaks no more than the noise.
        let all = by_order(1);
        let Some(chosen) = sufficient_order(&all) else {
            return Err(NoEstimate::Few(differences(&samples, 2, 1).count));
        };
        // Autocorrelated noise: a lower estimate than from every second sample.
        if let Some(ratio) = oversampling(&all, &by_order(2)) {
            let lower_bound = all[chosen].variance.sqrt();
            return Err(NoEstimate::Oversampled { ratio, lower_bound });
        }
        let found = &all[chosen];
        Ok(NoiseEstimate {
            sigma: found.variance.sqrt(),
            degrees_of_freedom: found.degrees_of_freedom,
            order: found.order,
            is_bound: chosen + 1 == all.len() && found.order == HIGHEST_ORDER,
        })
    }

    /// The samples without excluded ones and repeated frames, with outliers marked. Error: there are no samples, all
    /// have the same value, or the part of outliers is above [`MOST_OUTLIERS`].
    fn usable(&self) -> Result<NoiseSamples, NoEstimate> {
        let mut samples = NoiseSamples::new(self);
        let Some(first) = samples.values.first() else { return Err(NoEstimate::Few(0)) };
        if samples.values.iter().all(|x| x == first) {
            return Err(NoEstimate::Constant);
        }
        let total = samples.values.len();
        let outliers = samples.mark_outliers();
        let share = outliers as f64 / total as f64;
        if share > MOST_OUTLIERS {
            return Err(NoEstimate::Outliers(share));
        }
        Ok(samples)
    }
}

/// The quantization step of the values: their smallest difference, if all differences of neighbors in ascending order
/// are whole multiples of it within `LATTICE_TOLERANCE`. Differences below `SMALLEST_DIFFERENCE` of the range are
/// ignored. `None` for values that are not quantized, or with at most `COINCIDENT_DIFFERENCES` differences.
pub fn quantization_step(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let range = sorted.last()? - sorted.first()?;
    // Smaller differences are rounding errors of a unit conversion.
    let is_step = |step: &f64| *step > SMALLEST_DIFFERENCE * range;
    let steps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).filter(is_step).collect();
    let least = steps.iter().copied().reduce(f64::min)?;
    let is_multiple = |step: &f64| {
        let ratio = step / least;
        (ratio - ratio.round()).abs() < LATTICE_TOLERANCE * ratio.max(1.0)
    };
    // Two or three distinct values are always on a lattice.
    (steps.len() > COINCIDENT_DIFFERENCES && steps.iter().all(is_multiple)).then_some(least)
}

/// Number, mean square and degrees of freedom `tr(A)^2/tr(A^2)` of the normalized differences of an order over every
/// `stride`-th sample. A difference begins at each sample; those across gaps or outliers are not counted.
fn differences(samples: &NoiseSamples, order: usize, stride: usize) -> DifferenceVariance {
    let all: Vec<Option<(f64, [f64; HIGHEST_ORDER + 1])>> =
        (0..samples.values.len()).map(|first| samples.difference(first, order, stride)).collect();
    let (mut count, mut sum, mut square) = (0, 0.0, 0.0);
    for (k, (value, weights)) in all.iter().enumerate().filter_map(|(k, d)| Some((k, d.as_ref()?)))
    {
        count += 1;
        sum += value * value;
        square += 1.0;
        // Twice the square of the covariance with the later differences that share samples.
        for shift in 1..=order {
            let Some(Some((_, other))) = all.get(k + shift * stride) else { continue };
            let product: f64 = (0..=order - shift).map(|i| weights[i + shift] * other[i]).sum();
            square += 2.0 * product * product;
        }
    }
    DifferenceVariance {
        order,
        count,
        variance: sum / count.max(1) as f64,
        degrees_of_freedom: (count * count) as f64 / f64::max(square, 1.0),
    }
}

/// Index in the list, which is in ascending orders, of the first variance that the next one does not significantly
/// lower (by more than [`SIGNIFICANT_DECREASE`] standard errors), else of the last one. `None` for an empty list.
fn sufficient_order(all: &[DifferenceVariance]) -> Option<usize> {
    let falls = |pair: &[DifferenceVariance]| {
        let [this, next] = pair else { return false };
        // The lower order is the more efficient estimate for white noise: the variance of the difference is the
        // difference of the variances (Hausman 1978).
        let error = (2.0 / next.degrees_of_freedom - 2.0 / this.degrees_of_freedom).max(0.0).sqrt();
        next.variance < this.variance * (1.0 - SIGNIFICANT_DECREASE * error)
    };
    let highest = all.len().checked_sub(1)?;
    Some(all.windows(2).position(|pair| !falls(pair)).unwrap_or(highest))
}

/// Ratio of the standard deviation from every second sample (`thinned`) to that from all, at the sufficient order of
/// the thinned differences. `None` if its logarithm is at most [`OVERSAMPLING_LEVEL`] standard errors, or if a list
/// does not have that order. `None` also if the signal leaks: the order is the last one, with a variance below
/// [`LEAKAGE_DECREASE`] of the one before.
fn oversampling(all: &[DifferenceVariance], thinned: &[DifferenceVariance]) -> Option<f64> {
    let chosen = sufficient_order(thinned)?;
    let (thin, full) = (&thinned[chosen], all.get(chosen)?);
    let is_leaking = chosen + 1 == thinned.len()
        && chosen > 0
        && thin.variance < LEAKAGE_DECREASE * thinned[chosen - 1].variance;
    let ratio = (thin.variance / full.variance).sqrt();
    let error = (0.5 / full.degrees_of_freedom + 0.5 / thin.degrees_of_freedom).sqrt();
    (!is_leaking && ratio.ln() > OVERSAMPLING_LEVEL * error).then_some(ratio)
}

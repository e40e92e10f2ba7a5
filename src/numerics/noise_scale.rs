//! Standard deviation of white noise on a sampled smooth signal, from differences of the samples.
//!
//! A divided difference of order `m` annihilates polynomials of degree `m - 1`. With weights `c` of length one its
//! square has the expectation `sigma^2` for white noise, whatever the clock, plus what the signal leaks:
//! `A^2/2 (2 sin(w h/2))^(2m) / binom(2m, m)` for a wave of amplitude `A`, frequency `w` and step `h`. The estimate
//!
//! ```text
//! s^2 = sum (c.x)^2/n,    degrees of freedom tr(A)^2/tr(A^2),    A = sum c c'/n
//! ```
//!
//! falls with the order until the leakage is below the noise (von Neumann 1941; Gasser, Sroka and Jennen-Steinmetz
//! 1986). Autocorrelated noise lowers it: AR(1) of 0.3, 0.8, 0.95 at neighbours to 0.83, 0.35, 0.18 of the truth. A
//! comparison with every second sample reveals strong autocorrelation and smoothing, but not a missing effect.

mod samples;
#[cfg(test)]
mod tests;

use crate::numerics::noise_scale::samples::Samples;

/// Orders that are tried. A second difference is the first that a moving signal leaks little into; weights of orders
/// above six are nearly those of a wave at the Nyquist frequency, which is no average over the spectrum.
const ORDERS: std::ops::RangeInclusive<usize> = 2..=6;
const HIGHEST_ORDER: usize = 6;
/// Differences below which the estimate scatters by more than a third.
pub const FEWEST_DIFFERENCES: usize = 20;
/// Share of outliers above which the remaining differences are too few and too contaminated. A tenth is accepted; the
/// margin is the error of the count in a hundred samples.
const MOST_OUTLIERS: f64 = 0.12;
/// The order is high enough where the next one lowers the variance by less than this many standard errors of the
/// difference of the two.
const STOPS_FALLING: f64 = 1.0;
/// The estimate from every second sample exceeds that from all by this many standard errors of independent estimates
/// where the noise is autocorrelated. Both share samples, so that white noise is above it in one of 100 series.
const OVERSAMPLED: f64 = 1.8;
/// A wave that leaks into the estimate from every second sample lowers its variance from one order to the next below
/// this part, for periods above 6.5 samples; AR(1) noise keeps 0.8 and more.
const LEAKING: f64 = 0.75;
/// Values are on a lattice where they are whole multiples of their smallest difference to this part of it.
const LATTICE: f64 = 1e-3;

/// One coordinate of a recording.
#[derive(Clone, Copy)]
pub struct NoisySeries<'a> {
    /// Ascending, s.
    pub times: &'a [f64],
    /// Samples of a signal with noise.
    pub values: &'a [f64],
    /// Relative standard deviation of each sample; all one where empty.
    pub factors: &'a [f64],
    /// Samples that a fit down-weights; none where empty.
    pub excluded: &'a [bool],
}

/// An estimated standard deviation of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseEstimate {
    /// In the unit of the values.
    pub sigma: f64,
    /// Degrees of freedom of its square.
    pub degrees_of_freedom: f64,
    /// Order of the differences.
    pub order: usize,
    /// Whether the estimate still falls at the highest order: then it is an upper bound.
    pub is_bound: bool,
}

/// Reasons why a series does not show its noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoEstimate {
    /// All values are the same.
    Constant,
    /// So many usable differences.
    Few(usize),
    /// This share of the samples are outliers.
    Outliers(f64),
    /// The estimate from every second sample is `ratio` times that of all: the noise is autocorrelated or smoothed.
    Oversampled {
        ratio: f64,
        /// Lower bound of the standard deviation: the estimate from all samples.
        lower_bound: f64,
    },
}

/// Mean square of the differences of one order.
struct Differences {
    order: usize,
    count: usize,
    variance: f64,
    degrees_of_freedom: f64,
}

impl NoisySeries<'_> {
    /// The standard deviation of white noise on the values.
    ///
    /// # Errors
    ///
    /// The reason why it cannot be estimated.
    pub fn noise(&self) -> Result<NoiseEstimate, NoEstimate> {
        let samples = self.usable()?;
        let by_order = |stride: usize| -> Vec<Differences> {
            let tried = ORDERS.map(|order| differences(&samples, order, stride));
            tried.filter(|d| d.count >= FEWEST_DIFFERENCES).collect()
        };
        let all = by_order(1);
        let Some(chosen) = where_it_stops_falling(&all) else {
            return Err(NoEstimate::Few(differences(&samples, 2, 1).count));
        };
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

    /// Samples whose differences show noise: without excluded ones, repeated frames and outliers.
    fn usable(&self) -> Result<Samples, NoEstimate> {
        let mut samples = Samples::of(self);
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

/// The step of the lattice that all values are on; none where they are on none that shows.
pub fn quantization_step(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let range = sorted.last()? - sorted.first()?;
    // Rounding of a unit conversion is no step.
    let steps: Vec<f64> =
        sorted.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 1e-9 * range).collect();
    let least = steps.iter().copied().reduce(f64::min)?;
    let is_multiple = |step: &f64| {
        let ratio = step / least;
        (ratio - ratio.round()).abs() < LATTICE * ratio.max(1.0)
    };
    // Two or three distinct values are on a lattice whatever they are.
    (steps.len() > 3 && steps.iter().all(is_multiple)).then_some(least)
}

/// The differences of an order over every `stride`-th sample.
fn differences(samples: &Samples, order: usize, stride: usize) -> Differences {
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
    Differences {
        order,
        count,
        variance: sum / count.max(1) as f64,
        degrees_of_freedom: (count * count) as f64 / f64::max(square, 1.0),
    }
}

/// The place of the first order that the next one does not improve on, or of the highest.
fn where_it_stops_falling(all: &[Differences]) -> Option<usize> {
    let falls = |pair: &[Differences]| {
        let [this, next] = pair else { return false };
        let error = (2.0 / next.degrees_of_freedom - 2.0 / this.degrees_of_freedom).max(0.0).sqrt();
        next.variance < this.variance * (1.0 - STOPS_FALLING * error)
    };
    let highest = all.len().checked_sub(1)?;
    Some(all.windows(2).position(|pair| !falls(pair)).unwrap_or(highest))
}

/// How many times larger the standard deviation from every second sample is, where that shows autocorrelation or
/// smoothing.
fn oversampling(all: &[Differences], thinned: &[Differences]) -> Option<f64> {
    let chosen = where_it_stops_falling(thinned)?;
    let (thin, full) = (&thinned[chosen], all.get(chosen)?);
    let is_leaking = chosen + 1 == thinned.len()
        && chosen > 0
        && thin.variance < LEAKING * thinned[chosen - 1].variance;
    let ratio = (thin.variance / full.variance).sqrt();
    let error = (0.5 / full.degrees_of_freedom + 0.5 / thin.degrees_of_freedom).sqrt();
    (!is_leaking && ratio.ln() > OVERSAMPLED * error).then_some(ratio)
}

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

use crate::numerics::order;

/// Orders that are tried. A second difference is the first that a moving signal leaks little into; weights of orders
/// above six are nearly those of a wave at the Nyquist frequency, which is no average over the spectrum.
const ORDERS: std::ops::RangeInclusive<usize> = 2..=6;
const HIGHEST_ORDER: usize = 6;
/// Differences below which the estimate scatters by more than a third.
pub const FEWEST_DIFFERENCES: usize = 20;
/// A step of the clock this many times the median one is a gap: a difference across it sees too much of the signal.
const GAP: f64 = 2.5;
/// A difference this many robust standard deviations off belongs to an outlier or a jump; normal noise has one in
/// 150,000.
const OUTLYING: f64 = 4.5;
/// Rounds of removing outliers, each of which lowers the robust standard deviation.
const ROUNDS: usize = 8;
/// Share of outliers above which the remaining differences are too few and too contaminated. A tenth is accepted; the
/// margin is the error of the count in a hundred samples.
const MOST_OUTLIERS: f64 = 0.12;
/// Median of the absolute value of a standard normal deviate.
const MEDIAN_DEVIATION: f64 = 0.674_489_75;
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
/// Series with fewer distinct values for each sample than this are coarsely quantized: equal neighbors are no
/// repeated frames.
const DISTINCT: f64 = 0.25;

/// One coordinate of a recording.
#[derive(Clone, Copy)]
pub struct Series<'a> {
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
    /// The estimate from every second sample is so many times larger: the noise is autocorrelated or smoothed.
    Oversampled(f64),
}

/// Mean square of the differences of one order.
struct Differences {
    order: usize,
    count: usize,
    variance: f64,
    degrees_of_freedom: f64,
}

impl Series<'_> {
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
            return Err(NoEstimate::Oversampled(ratio));
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
pub fn quantum(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    order::sort(&mut sorted);
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

/// Samples in the order of their times.
struct Samples {
    times: Vec<f64>,
    values: Vec<f64>,
    factors: Vec<f64>,
    is_outlier: Vec<bool>,
    longest_step: f64,
}

impl Samples {
    fn of(series: &Series) -> Self {
        let total = series.values.len();
        let is_excluded = |k: usize| series.excluded.get(k).copied().unwrap_or(false);
        let mut distinct = series.values.to_vec();
        order::sort(&mut distinct);
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
        let mut steps: Vec<f64> = samples.times.windows(2).map(|w| w[1] - w[0]).collect();
        order::sort(&mut steps);
        samples.longest_step = steps.get(steps.len() / 2).map_or(f64::INFINITY, |step| GAP * step);
        samples
    }

    /// Marks the samples in the middle of outlying second differences; the count of outliers.
    fn mark_outliers(&mut self) -> usize {
        let mut count = 0;
        for _ in 0..ROUNDS {
            let normalized = |first: usize| Some((first, self.difference(first, 2, 1)?.0));
            let last = self.values.len().saturating_sub(2);
            let found: Vec<(usize, f64)> = (0..last).filter_map(normalized).collect();
            let mut sizes: Vec<f64> = found.iter().map(|(_, d)| d.abs()).collect();
            order::sort(&mut sizes);
            let Some(median) = sizes.get(sizes.len() / 2).filter(|median| **median > 0.0) else {
                break;
            };
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

    /// The normalized difference of every `stride`-th sample from the `first` one on, with its weights; none where it
    /// crosses a gap or an outlier.
    fn difference(
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
        let mut value = 0.0;
        for i in 0..=order {
            value += weights[i] / square.sqrt() * self.values[first + i * stride];
            weights[i] *= self.factors[first + i * stride] / square.sqrt();
        }
        Some((value, weights))
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal, Uniform};

    fn white(random: &mut ChaCha8Rng, n: usize) -> Vec<f64> {
        (0..n).map(|_| StandardNormal.sample(random)).collect()
    }

    /// AR(1) noise of standard deviation one.
    fn correlated(random: &mut ChaCha8Rng, n: usize, correlation: f64) -> Vec<f64> {
        let mut last: f64 = StandardNormal.sample(random);
        let next = |new: f64| {
            last = correlation * last + (1.0 - correlation * correlation).sqrt() * new;
            last
        };
        white(random, n).into_iter().map(next).collect()
    }

    fn wave(times: &[f64], amplitude: f64, period: f64) -> Vec<f64> {
        times.iter().map(|t| amplitude * (std::f64::consts::TAU * t / period).cos()).collect()
    }

    fn frames(n: usize) -> Vec<f64> {
        (0..n).map(|k| k as f64).collect()
    }

    fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| a + b).collect()
    }

    fn noise(times: &[f64], values: &[f64]) -> Result<NoiseEstimate, NoEstimate> {
        Series { times, values, factors: &[], excluded: &[] }.noise()
    }

    /// Mean and scatter of the estimate over `runs` series, and how many had none.
    fn spread(runs: u64, make: impl Fn(&mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>)) -> [f64; 3] {
        let mut found = Vec::new();
        for seed in 0..runs {
            let (times, values) = make(&mut ChaCha8Rng::seed_from_u64(seed));
            found.extend(noise(&times, &values).ok().map(|e| e.sigma));
        }
        let n = found.len() as f64;
        let mean = found.iter().sum::<f64>() / n;
        let scatter = (found.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / n).sqrt();
        println!("mean {mean:.3}, scatter {scatter:.3}, without {}", runs - n as u64);
        [mean, scatter, (runs as f64 - n) / runs as f64]
    }

    /// Even steps: the degrees of freedom of third differences are n/2.31 = n binom(6, 3)^2/binom(12, 6).
    #[test]
    fn degrees_of_freedom_of_third_differences_follow_the_binomials() {
        let times = frames(2000);
        let series =
            Series { times: &times, values: &wave(&times, 1.0, 7.3), factors: &[], excluded: &[] };
        let found = differences(&Samples::of(&series), 3, 1);
        assert!((found.degrees_of_freedom / found.count as f64 - 400.0 / 924.0).abs() < 1e-3);
    }

    /// A wave of twenty samples a period and seventy times the noise does not change the estimate.
    #[test]
    fn white_noise_on_a_wave_is_recovered() {
        for (n, most) in [(37, 0.27), (100, 0.14), (600, 0.06)] {
            let times = frames(n);
            let [mean, scatter, without] = spread(400, |random| {
                (times.clone(), sum(&wave(&times, 70.0, 20.0), &white(random, n)))
            });
            assert!((mean - 1.0).abs() < 0.05 && scatter < most && without < 0.07, "{n}");
        }
    }

    /// The noise of uneven clocks is found by divided differences.
    #[test]
    fn uneven_clock_does_not_change_the_estimate() {
        let [mean, scatter, _] = spread(300, |random| {
            let jitter = Uniform::new(-0.4, 0.4).unwrap();
            let times: Vec<f64> = (0..200).map(|k| k as f64 + jitter.sample(random)).collect();
            let values = sum(&wave(&times, 30.0, 40.0), &white(random, 200));
            (times, values)
        });
        assert!((mean - 1.0).abs() < 0.05 && scatter < 0.12);
    }

    /// By the spectrum of third differences AR(1) noise appears as .83, .35, .18 of its standard deviation; the strong
    /// ones are recognized by every second sample.
    #[test]
    fn autocorrelated_noise_is_recognized_or_appears_smaller() {
        for (correlation, appears, recognized) in
            [(0.3, 0.83, 0.0), (0.8, 0.35, 0.9), (0.95, 0.18, 0.9)]
        {
            let [mean, _, without] =
                spread(200, |random| (frames(600), correlated(random, 600, correlation)));
            assert!(without >= recognized, "{correlation}: {without}");
            assert!(recognized > 0.0 || (mean - appears).abs() < 0.06, "{correlation}: {mean}");
        }
    }

    #[test]
    fn five_point_smoothing_is_recognized() {
        let [_, _, without] = spread(200, |random| {
            let white = white(random, 604);
            let smooth = white.windows(5).map(|w| w.iter().sum::<f64>() / 5.0).collect();
            (frames(600), smooth)
        });
        assert!(without >= 0.95, "{without}");
    }

    /// A misfit of three times the noise leaks `9/2 (2 sin(pi/8))^12/924` of the variance at eight samples a period,
    /// and as much as the noise itself at five, where every second sample shows it.
    #[test]
    fn few_samples_a_period_give_an_upper_bound_or_none() {
        let times = frames(200);
        for (period, without_at_least) in [(8.0, 0.0), (5.0, 0.9)] {
            let [mean, _, without] = spread(200, |random| {
                (times.clone(), sum(&wave(&times, 3.0, period), &white(random, 200)))
            });
            assert!(without >= without_at_least, "{period}: {without}");
            assert!(without > 0.5 || (0.93..1.1).contains(&mean), "{period}: {mean}");
        }
    }

    #[test]
    fn a_tenth_of_outliers_is_skipped_and_more_are_refused() {
        for (share, refused) in [(0.05, 0.0..0.03), (0.1, 0.0..0.2), (0.15, 0.8..1.1)] {
            let [mean, _, without] = spread(200, |random| {
                let mut values = white(random, 300);
                let place = Uniform::new(0, 300).unwrap();
                let mut left = (300.0 * share) as usize;
                while left > 0 {
                    let k = place.sample(random);
                    if values[k].abs() < 20.0 {
                        values[k] += if left % 2 == 0 { 40.0 } else { -60.0 };
                        left -= 1;
                    }
                }
                (frames(300), values)
            });
            assert!(refused.contains(&without), "{share}: {without}");
            assert!(without > 0.5 || (mean - 1.0).abs() < 0.08, "{share}: {mean}");
        }
    }

    #[test]
    fn short_series_have_no_estimate() {
        for n in [9, 19] {
            let values = white(&mut ChaCha8Rng::seed_from_u64(1), n);
            assert_eq!(noise(&frames(n), &values), Err(NoEstimate::Few(n - 2)));
        }
        assert_eq!(noise(&frames(50), &[2.0; 50]), Err(NoEstimate::Constant));
    }

    /// A jump and a gap cost the differences across them.
    #[test]
    fn jump_and_gap_are_skipped() {
        let [mean, ..] = spread(200, |random| {
            let mut values = white(random, 100);
            values[60..].iter_mut().for_each(|x| *x += 500.0);
            let mut times = frames(100);
            times[30..].iter_mut().for_each(|t| *t += 20.0);
            (times, values)
        });
        assert!((mean - 1.0).abs() < 0.05);
    }

    /// Doubled frames are removed: else half of the differences would vanish.
    #[test]
    fn repeated_frames_are_removed() {
        let [mean, ..] = spread(200, |random| {
            let values = white(random, 100).into_iter().flat_map(|x| [x, x]).collect();
            (frames(200), values)
        });
        assert!((mean - 1.0).abs() < 0.05);
    }

    /// Known relative deviations are divided out.
    #[test]
    fn unequal_deviations_are_normalized() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let factors: Vec<f64> = (0..4000).map(|k| if k % 3 == 0 { 0.1 } else { 2.0 }).collect();
        let values: Vec<f64> =
            white(&mut random, 4000).iter().zip(&factors).map(|(x, f)| 3.0 * x * f).collect();
        let times = frames(4000);
        let series = Series { times: &times, values: &values, factors: &factors, excluded: &[] };
        assert!((series.noise().unwrap().sigma / 3.0 - 1.0).abs() < 0.06);
    }

    #[test]
    fn quantum_of_pixels_is_their_size() {
        let times = frames(100);
        let pixels: Vec<f64> =
            wave(&times, 40.0, 33.0).iter().map(|x| (x.round() - 7.0) * 0.002 + 0.1).collect();
        assert!((quantum(&pixels).unwrap() / 0.002 - 1.0).abs() < 1e-9);
        assert_eq!(quantum(&wave(&times, 40.0, 33.3)), None);
    }
}

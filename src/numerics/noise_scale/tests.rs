//! Tests of the noise estimate from differences: white and autocorrelated (AR(1)) noise on smooth signals, outliers,
//! repeated frames, uneven clocks, quantized values and signals that leak.
//!
//! They compare estimates over many seeded series with the standard deviation of the noise.

use super::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};

/// `n` samples of white Gaussian noise of standard deviation one.
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

/// Wave of an amplitude and a period at these times.
fn wave(times: &[f64], amplitude: f64, period: f64) -> Vec<f64> {
    times.iter().map(|t| amplitude * (std::f64::consts::TAU * t / period).cos()).collect()
}

/// Times 0, 1, 2, .. of `n` samples.
fn frames(n: usize) -> Vec<f64> {
    (0..n).map(|k| k as f64).collect()
}

/// Sum of two series, sample by sample.
fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

/// Noise estimate of a series without factors and excluded samples.
fn noise(times: &[f64], values: &[f64]) -> Result<NoiseEstimate, NoEstimate> {
    NoisySeries { times, values, factors: &[], excluded: &[] }.noise()
}

/// Mean and standard deviation of the estimate over `runs` series of times and values, and the share without an
/// estimate.
fn spread(runs: u64, make: impl Fn(&mut ChaCha8Rng) -> [Vec<f64>; 2]) -> [f64; 3] {
    let mut found = Vec::new();
    for seed in 0..runs {
        let [times, values] = make(&mut ChaCha8Rng::seed_from_u64(seed));
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
        NoisySeries { times: &times, values: &wave(&times, 1.0, 7.3), factors: &[], excluded: &[] };
    let found = differences(&NoiseSamples::new(&series), 3, 1);
    assert!((found.degrees_of_freedom / found.count as f64 - 400.0 / 924.0).abs() < 1e-3);
}

/// A wave of twenty samples a period and seventy times the noise does not change the estimate.
#[test]
fn white_noise_on_a_wave_is_recovered() {
    for (n, most) in [(37, 0.27), (100, 0.14), (600, 0.06)] {
        let times = frames(n);
        let [mean, scatter, without] = spread(400, |random| {
            [times.clone(), sum(&wave(&times, 70.0, 20.0), &white(random, n))]
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
        [times, values]
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
            spread(200, |random| [frames(600), correlated(random, 600, correlation)]);
        assert!(without >= recognized, "{correlation}: {without}");
        assert!(recognized > 0.0 || (mean - appears).abs() < 0.06, "{correlation}: {mean}");
    }
}

#[test]
fn five_point_smoothing_is_recognized() {
    let [_, _, without] = spread(200, |random| {
        let white = white(random, 604);
        let smooth = white.windows(5).map(|w| w.iter().sum::<f64>() / 5.0).collect();
        [frames(600), smooth]
    });
    // At most one of twenty smoothed series may get an estimate.
    assert!(without >= 0.95, "{without}");
}

/// A misfit of three times the noise leaks `9/2 (2 sin(pi/8))^12/924` of the variance at eight samples a period,
/// and as much as the noise itself at five, where every second sample shows it.
#[test]
fn few_samples_a_period_give_an_upper_bound_or_none() {
    let times = frames(200);
    for (period, without_at_least) in [(8.0, 0.0), (5.0, 0.9)] {
        let [mean, _, without] = spread(200, |random| {
            [times.clone(), sum(&wave(&times, 3.0, period), &white(random, 200))]
        });
        assert!(without >= without_at_least, "{period}: {without}");
        assert!(without > 0.5 || (0.93..1.1).contains(&mean), "{period}: {mean}");
    }
}

#[test]
fn a_tenth_of_outliers_is_skipped_and_more_are_refused() {
    // Shares of refused series: none at 5 %, few at 10 %, most at 15 %.
    for (share, refused) in [(0.05, 0.0..0.03), (0.1, 0.0..0.2), (0.15, 0.8..1.1)] {
        let [mean, _, without] = spread(200, |random| {
            let mut values = white(random, 300);
            let place = Uniform::new(0, 300).unwrap();
            let mut left = (300.0 * share) as usize;
            while left > 0 {
                let k = place.sample(random);
                if values[k].abs() < 20.0 {
                    values[k] += if left.is_multiple_of(2) { 40.0 } else { -60.0 };
                    left -= 1;
                }
            }
            [frames(300), values]
        });
        assert!(refused.contains(&without), "{share}: {without}");
        assert!(without > 0.5 || (mean - 1.0).abs() < 0.08, "{share}: {mean}");
    }
}

#[test]
fn short_series_have_no_estimate() {
    // n samples have n - 2 second differences, fewer than an estimate takes.
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
        [times, values]
    });
    assert!((mean - 1.0).abs() < 0.05);
}

/// Doubled frames are removed: else half of the differences would vanish.
#[test]
fn repeated_frames_are_removed() {
    let [mean, ..] = spread(200, |random| {
        let values = white(random, 100).into_iter().flat_map(|x| [x, x]).collect();
        [frames(200), values]
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
    let series = NoisySeries { times: &times, values: &values, factors: &factors, excluded: &[] };
    assert!((series.noise().unwrap().sigma / 3.0 - 1.0).abs() < 0.06);
}

#[test]
fn quantum_of_pixels_is_their_size() {
    let times = frames(100);
    let pixels: Vec<f64> =
        wave(&times, 40.0, 33.0).iter().map(|x| (x.round() - 7.0) * 0.002 + 0.1).collect();
    // Pixels of 0.002; without rounding there is no quantum.
    assert!((quantization_step(&pixels).unwrap() / 0.002 - 1.0).abs() < 1e-9);
    assert_eq!(quantization_step(&wave(&times, 40.0, 33.3)), None);
}

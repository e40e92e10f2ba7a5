//! Whether what a fit leaves over looks like noise.
//!
//! Intervals and standard errors rest on residuals that are independent and normal. A wrong model,
//! or a wrong minimum, leaves motion behind: neighbouring residuals resemble each other, or grow
//! with time.

use crate::fit::measurement::loss::Loss;
use crate::fit::misfit::ar1::{Ar1Correlation, usual_spacing};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, Normal, StudentsT};
use statrs::stats_tests::anderson_darling::anderson_darling;
use std::f64::consts::PI;

/// A finding by chance once in a thousand series is not worth a warning more often.
const DOUBT: f64 = 1e-3;
/// Nor is one among all coordinates of a fit, by the test that is asked, more often than this.
const DOUBT_OF_ALL: f64 = 0.02;
/// Noise whose neighbours resemble each other is told from motion that is left by what is new in each value. White noise
/// looks worse than this in 0.5 of 100 coordinates (two of 366 with the laboratories' own noise), and what little a wrong model leaves beside
/// noise shows.
const NEW: f64 = 5e-3;
/// Waves are looked for among so many, the longest ones.
const MOST_WAVES: usize = 500;
/// Fewer values say nothing about their distribution.
const FEWEST: usize = 12;
/// Correlations are looked for up to this many samples apart.
const LAGS: usize = 10;

/// Tests of the residuals of one coordinate of one observation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ResidualTests {
    /// Name of the file or of the point.
    pub observation: String,
    /// Coordinate: x, y or z; f for frequencies; normal for offsets from a center line.
    pub axis: String,
    /// Number of values.
    #[serde(default)]
    pub values: usize,
    /// p-value of the test for autocorrelation (Ljung and Box 1978, with the tail of few values).
    pub whiteness: f64,
    /// Lag-1 autocorrelation of the residuals at the usual interval; 0 if none is detected.
    #[serde(default)]
    pub autocorrelation: f64,
    /// Equivalent number of independent samples.
    #[serde(default)]
    pub effective_samples: f64,
    /// p-value of the whiteness test of the innovations.
    #[serde(default)]
    pub innovation_whiteness: f64,
    /// p-value of the normality test (Anderson and Darling).
    pub normality: f64,
    /// p-value of a trend over time, of the residuals or of their size, whichever is more
    /// significant.
    pub trend: f64,
    /// Level of significance of the tests: 1e-3, or less with many other coordinates.
    #[serde(default = "usual_doubt")]
    pub significance_level: f64,
    /// Result of the tests, as text.
    pub verdict: String,
    /// Whether all tests passed.
    pub passed: bool,
}

/// What is no chance in one of so many coordinates.
pub(crate) fn significance_level(coordinates: usize) -> f64 {
    DOUBT.min(DOUBT_OF_ALL / coordinates.max(1) as f64)
}

fn usual_doubt() -> f64 {
    DOUBT
}

impl ResidualTests {
    /// Tests residuals, in units of the noise, in the order of their times, whose neighbours correlate as
    /// said; none for too few. What is less probable than `significance` is no chance.
    pub(crate) fn new(
        (observation, axis): (String, &str),
        (times, residuals): (&[f64], &[f64]),
        loss: Loss,
        correlation: f64,
        significance: f64,
    ) -> Option<Self> {
        if residuals.len() < FEWEST {
            return None;
        }
        // What the fit went by: outliers that count less may be where they like.
        let felt: Vec<f64> = residuals.iter().map(|r| loss.influence(*r)[0]).collect();
        let whiteness = whiteness(&felt);
        let spacing = usual_spacing(times);
        let correlation = if spacing.is_some() { correlation } else { 0.0 };
        let memory = |correlation| Ar1Correlation::new(times, spacing.unwrap_or(1.0), correlation);
        let noise = memory(correlation);
        let effective_samples = noise.effective_sample_size();
        let new = noise.whiten(&felt);
        let innovation_whiteness = match correlation > 0.0 {
            true => newness(&new),
            false => whiteness,
        };
        let normality = normality(&noise.whiten(residuals));
        let sizes: Vec<f64> = felt.iter().map(|r| r.abs()).collect();
        // The squares of what resembles each other do so less.
        let alike = memory(correlation * correlation).effective_sample_size();
        // Two chances to find one.
        let values = trend(times, &felt, effective_samples);
        let trend = (2.0 * values.min(trend(times, &sizes, alike))).min(1.0);
        let remembers = correlation > 0.0 && innovation_whiteness >= NEW;
        let mut wrong = Vec::new();
        if whiteness < significance && !remembers {
            wrong.push(format!("the residuals are autocorrelated (p = {whiteness:.0e})"));
        }
        if normality < significance {
            wrong.push(format!("the residuals are not normal (p = {normality:.0e})"));
        }
        if trend < significance {
            wrong.push(format!("the residuals have a trend in time (p = {trend:.0e})"));
        }
        let passed = wrong.is_empty();
        let verdict = match passed {
            true if whiteness < significance => {
                let words = "consistent with autocorrelated noise, lag-1 correlation";
                format!("{words} {correlation:.2}, {effective_samples:.0} effective samples")
            }
            true => "consistent with white noise".to_string(),
            false => wrong.join(", "),
        };
        Some(Self {
            observation,
            axis: axis.into(),
            values: residuals.len(),
            whiteness,
            autocorrelation: correlation,
            effective_samples,
            innovation_whiteness,
            normality,
            trend,
            significance_level: significance,
            verdict,
            passed,
        })
    }

    /// Whether the intervals can be believed: noise that is not normal hurts them little.
    pub fn is_noise(&self) -> bool {
        (self.whiteness >= self.significance_level || self.remembers())
            && self.trend >= self.significance_level
    }

    /// Whether it is noise whose neighbours resemble each other.
    pub(crate) fn remembers(&self) -> bool {
        self.autocorrelation > 0.0 && self.innovation_whiteness >= NEW
    }
}

/// How probable it is that white noise has correlations, or a wave, as large as the news of a memory have: the
/// smaller of the two.
pub(crate) fn newness(news: &[f64]) -> f64 {
    whiteness(news).min(no_wave(news))
}

/// Of the sum of squared autocorrelations, about zero: a fit has no mean of its own to remove.
///
/// Of many values that sum is distributed as chi-squared. Of few its tail is longer, and is that of F with as many
/// degrees of freedom as [`tail`] says: simulated noise of 16 to 400 values lies beyond what is said to be one in a
/// thousand 0.5 to 1.15 times in a thousand, by chi-squared up to 6.
fn whiteness(r: &[f64]) -> f64 {
    let n = r.len();
    let lags = LAGS.min(n / 4);
    let power: f64 = r.iter().map(|r| r * r).sum();
    if power == 0.0 {
        return 1.0;
    }
    let part = |lag: usize| {
        let product: f64 = r.iter().zip(&r[lag..]).map(|(a, b)| a * b).sum();
        (product / power).powi(2) / (n - lag) as f64
    };
    let q = n as f64 * (n as f64 + 2.0) * (1..=lags).map(part).sum::<f64>();
    let (lags, freedom) = (lags as f64, tail(n));
    // The mean of the sum is the number of lags, whatever the number of values.
    let ratio = q / lags * freedom / (freedom - 2.0);
    FisherSnedecor::new(lags, freedom).map_or(1.0, |f| f.sf(ratio))
}

/// Degrees of freedom of the denominator that make the tail of `n` values.
fn tail(n: usize) -> f64 {
    15.0 + 0.4 * n as f64
}

fn normality(r: &[f64]) -> f64 {
    let n = r.len() as f64;
    let mean = r.iter().sum::<f64>() / n;
    let variance = r.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let Ok(normal) = Normal::new(mean, variance.sqrt()) else { return 1.0 };
    match anderson_darling(r, &normal) {
        // The formula for p ends there.
        Ok((statistic, p)) => {
            if statistic < 10.0 {
                p.clamp(0.0, 1.0)
            } else {
                0.0
            }
        }
        Err(_) => 1.0,
    }
}

/// How probable a wave as high as the highest is in white noise (Fisher 1929), among the longest ones.
fn no_wave(r: &[f64]) -> f64 {
    let n = r.len();
    let count = ((n - 1) / 2).min(MOST_WAVES);
    let power = |k: usize| {
        let (sin, cos) = (2.0 * PI * k as f64 / n as f64).sin_cos();
        // The powers of a number on the unit circle, one after the other.
        let ([mut re, mut im], [mut c, mut s]) = ([0.0; 2], [1.0, 0.0]);
        for value in r {
            (re, im) = (re + value * c, im + value * s);
            (c, s) = (c * cos - s * sin, c * sin + s * cos);
        }
        re * re + im * im
    };
    let powers: Vec<f64> = (1..=count).map(power).collect();
    let total: f64 = powers.iter().sum();
    if total == 0.0 {
        return 1.0;
    }
    let share = powers.iter().copied().fold(0.0, f64::max) / total;
    // The first term of Fisher's sum, which bounds it and is all of it where it is small.
    (count as f64 * (1.0 - share).powi(count as i32 - 1)).min(1.0)
}

/// Of the slope over time, where the values tell as much as so many that are independent.
fn trend(times: &[f64], values: &[f64], effective: f64) -> f64 {
    let n = values.len() as f64;
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n;
    let (t0, v0) = (mean(times), mean(values));
    let products = times.iter().zip(values).map(|(t, v)| {
        let (t, v) = (t - t0, v - v0);
        [t * t, t * v, v * v]
    });
    let [tt, tv, vv] = products.fold([0.0; 3], |s, p| std::array::from_fn(|k| s[k] + p[k]));
    if tt * vv == 0.0 {
        return 1.0;
    }
    let correlation = tv / (tt * vv).sqrt();
    let freedom = (effective - 2.0).max(1.0);
    let t = correlation * (freedom / (1.0 - correlation * correlation).max(1e-300)).sqrt();
    StudentsT::new(0.0, 1.0, freedom).map_or(1.0, |d| 2.0 * d.sf(t.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Exp1, StandardNormal};

    fn tests(r: &[f64]) -> ResidualTests {
        let times: Vec<f64> = (0..r.len()).map(|k| k as f64).collect();
        ResidualTests::new(("o".into(), "x"), (&times, r), Loss::Squares, 0.0, DOUBT).unwrap()
    }

    /// Chance is taken for more once in a thousand, for few values too.
    #[test]
    fn the_tail_of_noise_is_known() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        for n in [16, 26, 51, 101, 201] {
            let mut rare = 0;
            for _ in 0..40_000 {
                let r: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut random)).collect();
                rare += usize::from(whiteness(&r) < DOUBT);
            }
            println!("{n} values: {rare} of 40,000 below one in a thousand");
            // 40, and three standard deviations of that are 19.
            assert!((15..=65).contains(&rare), "{n}: {rare}");
        }
    }

    /// Beside many coordinates one of them may look odd.
    #[test]
    fn doubt_is_shared() {
        assert_eq!(significance_level(2), DOUBT);
        assert_eq!(significance_level(200), 1e-4);
    }

    /// For noise every p-value is uniform: a tenth of them below a tenth.
    #[test]
    fn noise_is_noise() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let runs = 3000;
        let mut below = [[0; 2]; 3];
        for _ in 0..runs {
            let r: Vec<f64> = (0..100).map(|_| StandardNormal.sample(&mut random)).collect();
            let t = tests(&r);
            for (count, p) in below.iter_mut().zip([t.whiteness, t.normality, t.trend]) {
                count[0] += usize::from(p < 0.1);
                count[1] += usize::from(p < 0.01);
            }
        }
        for [tenth, hundredth] in below {
            // Three standard deviations of the counts are 50 and 16.
            assert!((240..=360).contains(&tenth) && (10..=60).contains(&hundredth), "{below:?}");
        }
    }

    #[test]
    fn what_is_not_noise_is_found() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
        let wave: Vec<f64> = (0..100).map(|k| 2.0 * (0.3 * k as f64).sin() + noise()).collect();
        assert!(tests(&wave).whiteness < 1e-6);
        let drift: Vec<f64> = (0..100).map(|k| 0.02 * k as f64 + noise()).collect();
        assert!(tests(&drift).trend < 1e-3 && !tests(&drift).is_noise());
        let growing: Vec<f64> = (0..100).map(|k| 0.02 * k as f64 * noise()).collect();
        assert!(tests(&growing).trend < 1e-3);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let skew: Vec<f64> = (0..100).map(|_| Exp1.sample(&mut random)).collect::<Vec<f64>>();
        let skew: Vec<f64> = skew.iter().map(|x| x - 1.0).collect();
        assert!(tests(&skew).normality < 1e-6 && tests(&skew).is_noise());
        let mut outlier: Vec<f64> = wave.iter().map(|_| noise_of(&mut random)).collect();
        outlier[50] = 1e3;
        assert_eq!(tests(&outlier).normality, 0.0);
    }

    fn noise_of(random: &mut ChaCha8Rng) -> f64 {
        StandardNormal.sample(random)
    }

    /// Q of a series worked out by hand, and the tail of F, which two degrees of freedom make a power.
    #[test]
    fn ljung_box_by_hand() {
        let r = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
        // Lags 1 and 2: autocorrelations -7/8 and 6/8; Q = 8*10*((7/8)^2/7 + (6/8)^2/6) = 16.25.
        let d = 15.0 + 0.4 * 8.0;
        let ratio = 16.25 / 2.0 * d / (d - 2.0);
        assert!((whiteness(&r) - f64::powf(1.0 + 2.0 * ratio / d, -0.5 * d)).abs() < 1e-12);
    }
}

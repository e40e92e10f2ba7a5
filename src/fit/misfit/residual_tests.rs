//! Statistical tests of residuals for being noise: whiteness, normality and the absence of a trend.
//!
//! Intervals and standard errors assume independent normal residuals. A wrong model or a wrong minimum leaves residuals
//! that are autocorrelated or grow with time. AR(1) noise is autocorrelated too; its innovations are white. Input: the
//! residuals of one coordinate in order of time (or arc length), in units of the noise, and the correlation of their
//! noise (0: white). With fewer than [`FEWEST_VALUES`] the output is `None`. Tests: Ljung-Box (autocorrelation),
//! Anderson-Darling (normality), Student's t for a slope of the residuals or their size over time (trend), and for
//! innovations also Fisher's test of the periodogram. With a robust loss whiteness and trend are tested with the
//! influences (half the derivatives of the loss) instead of the residuals.
//!
//! Output: [`ResidualTests`] with a p-value each, compared with [`SIGNIFICANCE`], which Bonferroni's correction lowers
//! for many coordinates ([`significance_level`]). Autocorrelated residuals pass as AR(1) noise if the p-value of their
//! innovations ([`innovation_p_value`]) is at least [`LEAST_INNOVATION_P`]. `is_noise` requires white residuals or such
//! innovations, and no trend, but not normality.

use crate::fit::measurement::dataset::Abscissa;
use crate::fit::measurement::loss::Loss;
use crate::fit::misfit::ar1::{Ar1Correlation, usual_spacing};
use crate::summary::quantity::p_value;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, Normal, StudentsT};
use statrs::stats_tests::anderson_darling::anderson_darling;
use std::f64::consts::PI;

/// Significance level of one coordinate: smaller p-values are findings.
const SIGNIFICANCE: f64 = 1e-3;
/// Probability of a false finding among all coordinates of a fit, by one of the tests (Bonferroni's correction).
const FAMILY_SIGNIFICANCE: f64 = 0.02;
/// Smallest p-value of the innovations of AR(1) noise. Innovations of noise have a smaller one in 0.5 of 100
/// coordinates (two of 366 with the laboratories' own noise). Innovations of residual motion have a smaller one even
/// where noise dominates.
const LEAST_INNOVATION_P: f64 = 5e-3;
/// Largest number of frequencies of the periodogram, from the lowest one on. Its cost is proportional to it.
const MOST_FREQUENCIES: usize = 500;
/// Smallest number of values that are tested. With fewer the test of whiteness has less than three lags.
const FEWEST_VALUES: usize = 12;
/// Degrees of freedom of the denominator of F for the whiteness statistic: of no values, and in addition for each
/// value. Fitted to the tail of simulated noise of 16 to 400 values.
const TAIL_FREEDOM: [f64; 2] = [15.0, 0.4];
/// Largest lag of the autocorrelations, in samples; at most a quarter of the number of values. More lags detect slower
/// correlations, and weaken the test of fast ones.
const LARGEST_LAG: usize = 10;
/// Anderson-Darling statistic above which the formula of its p-value does not hold; the p-value is 0 there.
const LARGEST_STATISTIC: f64 = 10.0;

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
    #[serde(default = "default_significance")]
    pub significance_level: f64,
    /// Result of the tests, as text.
    pub verdict: String,
    /// Whether all tests passed.
    pub passed: bool,
}

/// Significance level of each coordinate, for a fit with this number of `coordinates`: [`FAMILY_SIGNIFICANCE`] over the
/// number (Bonferroni's correction), at most [`SIGNIFICANCE`].
pub(crate) fn significance_level(coordinates: usize) -> f64 {
    SIGNIFICANCE.min(FAMILY_SIGNIFICANCE / coordinates.max(1) as f64)
}

/// Significance level of stored reports without one: [`SIGNIFICANCE`].
fn default_significance() -> f64 {
    SIGNIFICANCE
}

/// Residuals of one coordinate in ascending order of their times, as input of the tests.
pub(crate) struct ResidualSeries<'a> {
    /// Times, s, or arc lengths, m.
    pub times: &'a [f64],
    /// Whether these are times, arc lengths or others, for the text.
    pub abscissa: Abscissa,
    /// Plain residuals, in units of the noise.
    pub residuals: &'a [f64],
    /// Loss by which they were fitted.
    pub loss: Loss,
    /// Lag-1 correlation of the noise at the usual interval; 0 of white noise.
    pub correlation: f64,
}

impl ResidualTests {
    /// Tests the residuals of the coordinate `axis` of an `observation`; `None` for fewer than [`FEWEST_VALUES`].
    /// P-values below `significance` are findings. Autocorrelation passes if the series has a positive correlation and
    /// its innovations have a p-value of at least [`LEAST_INNOVATION_P`]. The verdict is a text of the findings.
    /// Whiteness and trend are tests of the influences (half the derivatives of the loss), normality of the whitened
    /// residuals themselves. The p-value of the trend is twice the smaller one of the slopes of values and of sizes,
    /// with the effective sample size of AR(1) noise.
    pub(crate) fn new(
        observation: String,
        axis: &str,
        ResidualSeries { times, abscissa, residuals, loss, correlation }: ResidualSeries,
        significance: f64,
    ) -> Option<Self> {
        if residuals.len() < FEWEST_VALUES {
            return None;
        }
        // Outliers that a robust loss down-weights influence neither the fit nor these tests.
        let influences: Vec<f64> = residuals.iter().map(|r| loss.influence(*r)[0]).collect();
        // With a robust loss the influence of a residual, half the derivative of its loss, is tested instead of the
        // residual.
        let whiteness = whiteness(&influences);
        let spacing = usual_spacing(times);
        let correlation = if spacing.is_some() { correlation } else { 0.0 };
        let ar1 = |correlation| Ar1Correlation::new(times, spacing.unwrap_or(1.0), correlation);
        let noise = ar1(correlation);
        let effective_samples = noise.effective_sample_size();
        let innovation_whiteness = match correlation > 0.0 {
            true => innovation_p_value(&noise.whiten(&influences)),
            false => whiteness,
        };
        let normality = normality(&noise.whiten(residuals));
        let sizes: Vec<f64> = influences.iter().map(|r| r.abs()).collect();
        // Squares of normal values have the square of their correlation.
        let effective_sizes = ar1(correlation * correlation).effective_sample_size();
        // Two tests have twice the probability of a false finding.
        let values = trend(times, &influences, effective_samples);
        let trend = (2.0 * values.min(trend(times, &sizes, effective_sizes))).min(1.0);
        let is_ar1 = correlation > 0.0 && innovation_whiteness >= LEAST_INNOVATION_P;
        let mut wrong = Vec::new();
        if whiteness < significance && !is_ar1 {
            wrong.push(format!("the residuals are autocorrelated ({})", p_value(whiteness)));
        }
        if normality < significance {
            wrong.push(format!("the residuals are not normal ({})", p_value(normality)));
        }
        if trend < significance {
            let order = match abscissa {
                Abscissa::Time => "in time",
                Abscissa::ArcLength => "along the rod",
                Abscissa::Load | Abscissa::Moment => "with the load",
                Abscissa::Mode | Abscissa::Reading => "in their order",
            };
            wrong.push(format!("the residuals have a trend {order} ({})", p_value(trend)));
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

    /// Whether the residuals are white or AR(1) noise without a trend: no finding in whiteness (or white innovations)
    /// and trend. Normality does not count, as intervals depend little on it.
    pub fn is_noise(&self) -> bool {
        let is_ar1 = self.autocorrelation > 0.0 && self.innovation_whiteness >= LEAST_INNOVATION_P;
        (self.whiteness >= self.significance_level || is_ar1)
            && self.trend >= self.significance_level
    }
}

/// p-value of innovations for being white noise: the smaller one of the Ljung-Box test for autocorrelation and Fisher's
/// for periodicity.
pub(crate) fn innovation_p_value(innovations: &[f64]) -> f64 {
    whiteness(innovations).min(periodicity_p_value(innovations))
}

/// p-value of the Ljung-Box statistic of the residuals `r`: the weighted sum of squared autocorrelations up to
/// [`LARGEST_LAG`] (at most a quarter of the values). Autocorrelations are about zero, as a fit has no mean to remove.
/// The p-value is 1 if all residuals are zero.
///
/// The statistic of many values is chi-squared. That of few values has a longer tail, which is close to that of F with
/// [`tail_freedom`] degrees of freedom in the denominator. Simulated noise of 16 to 400 values exceeds the quantile of
/// one in a thousand 0.5 to 1.15 times in a thousand; the quantile of chi-squared up to 6 times.
fn whiteness(r: &[f64]) -> f64 {
    let n = r.len();
    let lags = LARGEST_LAG.min(n / 4);
    let power: f64 = r.iter().map(|r| r * r).sum();
    if power == 0.0 {
        return 1.0;
    }
    let part = |lag: usize| {
        let product: f64 = r.iter().zip(&r[lag..]).map(|(a, b)| a * b).sum();
        (product / power).powi(2) / (n - lag) as f64
    };
    // Ljung-Box: n (n + 2) sum_k r_k^2/(n - k).
    let q = n as f64 * (n as f64 + 2.0) * (1..=lags).map(part).sum::<f64>();
    let (lags, freedom) = (lags as f64, tail_freedom(n));
    // The mean of the statistic is the number of lags, whatever the number of values.
    let ratio = q / lags * freedom / (freedom - 2.0);
    FisherSnedecor::new(lags, freedom).map_or(1.0, |f| f.sf(ratio))
}

/// Degrees of freedom of the denominator of F for the whiteness statistic of `n` values: `15 + 0.4 n` by
/// [`TAIL_FREEDOM`].
fn tail_freedom(n: usize) -> f64 {
    TAIL_FREEDOM[0] + TAIL_FREEDOM[1] * n as f64
}

/// p-value of the Anderson-Darling test of the residuals `r` for a normal distribution with the mean and the variance
/// of the sample. It is 0 for statistics above [`LARGEST_STATISTIC`], and 1 where the test is not possible, as for
/// equal values.
fn normality(r: &[f64]) -> f64 {
    let n = r.len() as f64;
    let mean = r.iter().sum::<f64>() / n;
    let variance = r.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let Ok(normal) = Normal::new(mean, variance.sqrt()) else { return 1.0 };
    match anderson_darling(r, &normal) {
        Ok((statistic, p)) if statistic < LARGEST_STATISTIC => p.clamp(0.0, 1.0),
        Ok(_) => 0.0,
        Err(_) => 1.0,
    }
}

/// p-value of Fisher's test for periodicity (1929) of the values `r`. With the powers of the periodogram at the lowest
/// `m` frequencies (multiples of one cycle per record, at most [`MOST_FREQUENCIES`]), and the fraction `g` of the
/// largest one in their sum, it is `m (1 - g)^(m - 1)`, at most 1; 1 if all powers are zero.
fn periodicity_p_value(r: &[f64]) -> f64 {
    let n = r.len();
    let count = ((n - 1) / 2).min(MOST_FREQUENCIES);
    let power = |k: usize| {
        let (sin, cos) = (2.0 * PI * k as f64 / n as f64).sin_cos();
        // Sine and cosine at multiples of the angle by rotation: one evaluation per frequency.
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
    // The first term of Fisher's sum bounds it, and equals it for small p-values.
    (count as f64 * (1.0 - share).powi(count as i32 - 1)).min(1.0)
}

/// Two-sided p-value of the slope of `values` over `times` (linear regression) by Student's t, `r sqrt(f/(1 - r^2))`
/// with the correlation `r` of both and `f` degrees of freedom. Degrees of freedom are the `effective` number of
/// independent values less 2, at least 1. The p-value is 1 if all values or all times are equal.
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
    // Autocorrelated noise has larger slopes by chance, as that of fewer independent values.
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

    /// Tests of residuals at times 0, 1, 2, .. with squared losses and white noise.
    fn tests(r: &[f64]) -> ResidualTests {
        let times: Vec<f64> = (0..r.len()).map(|k| k as f64).collect();
        let series = ResidualSeries {
            times: &times,
            abscissa: Abscissa::Time,
            residuals: r,
            loss: Loss::Squares,
            correlation: 0.0,
        };
        ResidualTests::new("o".into(), "x", series, SIGNIFICANCE).unwrap()
    }

    /// Residuals of a rod at rest that grow along it have a trend along the rod, not in time.
    #[test]
    fn trend_of_a_shape_is_along_the_rod() {
        let times: Vec<f64> = (0..60).map(f64::from).collect();
        let residuals: Vec<f64> = times.iter().map(|s| 0.1 * s - 3.0 + s.sin()).collect();
        for (abscissa, words) in
            [(Abscissa::Time, "trend in time"), (Abscissa::ArcLength, "trend along the rod")]
        {
            let series = ResidualSeries {
                times: &times,
                abscissa,
                residuals: &residuals,
                loss: Loss::Squares,
                correlation: 0.0,
            };
            let tests = ResidualTests::new("o".into(), "x", series, SIGNIFICANCE).unwrap();
            assert!(tests.verdict.contains(words), "{}", tests.verdict);
        }
    }

    /// A p-value below one in a thousand is found in one of a thousand samples of noise, few values included.
    #[test]
    fn whiteness_of_noise_has_nominal_false_positive_rate() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        for n in [16, 26, 51, 101, 201] {
            let mut rare = 0;
            for _ in 0..40_000 {
                let r: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut random)).collect();
                rare += usize::from(whiteness(&r) < SIGNIFICANCE);
            }
            println!("{n} values: {rare} of 40,000 below one in a thousand");
            // Expected: 40. Three standard deviations of the binomial count are 19.
            assert!((15..=65).contains(&rare), "{n}: {rare}");
        }
    }

    /// Bonferroni: 0.02 shared by 200 coordinates is 1e-4 each.
    #[test]
    fn significance_level_of_many_coordinates_is_bonferroni_corrected() {
        assert_eq!(significance_level(2), SIGNIFICANCE);
        assert_eq!(significance_level(200), 1e-4);
    }

    /// P-values of noise are uniform: a tenth of them is below 0.1.
    #[test]
    fn p_values_of_noise_are_uniform() {
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
            // Expected: 300 and 30. Three standard deviations of the binomial counts are 50 and 16.
            assert!((240..=360).contains(&tenth) && (10..=60).contains(&hundredth), "{below:?}");
        }
    }

    /// A wave is not white, a drift and a growing spread are trends, and exponential values and an outlier are not
    /// normal.
    #[test]
    fn residuals_other_than_noise_are_detected() {
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

    /// Q computed by hand, and the tail of F, which is a power for two degrees of freedom in the numerator.
    #[test]
    fn ljung_box_p_value_equals_hand_calculation() {
        let r = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
        // Lags 1 and 2: autocorrelations -7/8 and 6/8; Q = 8*10*((7/8)^2/7 + (6/8)^2/6) = 16.25.
        let d = 15.0 + 0.4 * 8.0;
        let ratio = 16.25 / 2.0 * d / (d - 2.0);
        assert!((whiteness(&r) - f64::powf(1.0 + 2.0 * ratio / d, -0.5 * d)).abs() < 1e-12);
    }
}

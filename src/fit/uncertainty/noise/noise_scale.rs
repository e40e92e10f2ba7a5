//! Noise scale of one coordinate of a measurement: the standard deviation of its noise without the model, from
//! differences of its samples.
//!
//! [`CoordinateSamples::scale`] takes the estimate from the residuals by [divided
//! differences](crate::numerics::noise_scale), or that from the observed values where it is lower by [`CLEARLY_LOWER`]
//! standard errors. Values that a loss or the leverage down-weights are left out. The resolution `q` of the values sets
//! a lower limit, `q/sqrt(12)`. The p-value compares the root mean square residual, without outliers ([`OUTLYING`]
//! robust standard deviations), with the scale, by chi-squared. The result, a [`NoiseScale`], is part of the
//! report and the basis of `adequacy`. A coordinate without a usable estimate has the reason instead; so have shapes at
//! rest, whose points have no order in time.

use crate::fit::measurement::dataset::Coordinate;
use crate::fit::search::Search;
use crate::fit::search::fitted::MeasuredResiduals;
use crate::numerics::noise_scale::{
    FEWEST_DIFFERENCES, NoEstimate, NoiseEstimate, NoisySeries, quantization_step,
};
use crate::numerics::upper_median;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Degrees of freedom of a noise scale that the resolution sets: quantization errors of a slow motion are strongly
/// autocorrelated, with a few independent values in a record.
const QUANTIZATION_FREEDOM: f64 = 8.0;
/// Size of an outlier, in robust standard deviations of the residuals: one of 150,000 normal residuals is beyond.
const OUTLYING: f64 = 4.5;
/// Median of the absolute value of a standard normal deviate.
const MEDIAN_DEVIATION: f64 = 0.674_489_75;
/// The estimate from the samples replaces that from the residuals where it is lower by this many standard errors.
const CLEARLY_LOWER: f64 = 2.0;

/// The noise of one coordinate of an observation, estimated without the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct NoiseScale {
    /// Name of the file or of the point.
    pub observation: String,
    /// x, y or z, or the component of a sensor.
    pub axis: String,
    /// Standard deviation of the noise from differences of the samples, in `unit`; none where these do not show it.
    pub value: Option<f64>,
    /// Unit of `value` and `residual_rms`.
    pub unit: String,
    /// Degrees of freedom of the squared `value`; null without a value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
    /// Order of the differences; none where the resolution of the values sets the scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference_order: Option<usize>,
    /// Root mean square residual of this coordinate, in `unit`, for the degrees of freedom that the fit leaves.
    pub residual_rms: f64,
    /// Probability of a residual variance as large as this for white noise of this scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// Reason why there is no value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unavailable: Option<String>,
}

/// Samples of one coordinate in the order of time, with their residuals, in the unit of the measurement.
pub(crate) struct CoordinateSamples {
    /// Rows of the values among all residuals.
    pub rows: Vec<usize>,
    /// Times of the values, s, ascending; of a shape their arc lengths, m.
    times: Vec<f64>,
    /// Measured values.
    observed: Vec<f64>,
    /// Simulated less measured values.
    residuals: Vec<f64>,
    /// Standard deviation of each value over sigma of the measurement.
    factors: Vec<f64>,
    /// Whether the loss or the leverage down-weights a value.
    excluded: Vec<bool>,
    /// Part of the degrees of freedom that the fit has not used up.
    freedom_left: f64,
}

impl CoordinateSamples {
    /// Measured values and residuals of a `coordinate` of a measurement, in its unit, with their relative standard
    /// deviations, in the order of time, or of arc length for a shape. `used` is the part of the degrees of freedom
    /// that the fit uses up: unknowns over residuals. Values beyond the scale of a robust loss, or with a leverage
    /// weight below 1, are marked as excluded.
    pub fn new(
        search: &Search,
        MeasuredResiduals { measurement, sigma, residuals, rows, .. }: &MeasuredResiduals,
        coordinate: &Coordinate,
        used: f64,
    ) -> Self {
        let (times, places): (Vec<f64>, Vec<usize>) =
            coordinate.ascending(residuals.len()).into_iter().map(|(k, t)| (t, k)).unzip();
        let rows: Vec<usize> = places.iter().map(|k| rows.start + k).collect();
        let (all_observed, sigmas) = (measurement.values_in_order(), measurement.sigmas(*sigma));
        let pick = |value: &dyn Fn(usize) -> f64| places.iter().map(|k| value(*k)).collect();
        let is_excluded = |(k, row): (&usize, &usize)| {
            residuals[*k].abs() > measurement.loss().scale() || search.leverage_weight(*row) < 1.0
        };
        Self {
            times,
            observed: pick(&|k| all_observed[k]),
            residuals: pick(&|k| residuals[k] * (sigmas[k] / sigma) * sigma),
            factors: pick(&|k| sigmas[k] / sigma),
            excluded: places.iter().zip(&rows).map(is_excluded).collect(),
            rows,
            freedom_left: 1.0 - used,
        }
    }

    /// Noise scale of `values`, one per sample at its time, from their divided differences without excluded values.
    /// Error: the reason why there is none.
    fn noise(&self, values: &[f64]) -> Result<NoiseEstimate, NoEstimate> {
        let Self { times, factors, excluded, .. } = self;
        NoisySeries { times, values, factors, excluded }.noise()
    }

    /// The noise scale from the residuals, or that from the observed values if it is lower by [`CLEARLY_LOWER`]
    /// standard errors: motion that remains in the differences makes either too large. Error: the reason, where the
    /// observed values are constant or oversampled, or the residuals have no estimate.
    fn estimate(&self) -> Result<NoiseEstimate, NoEstimate> {
        let observed = self.noise(&self.observed);
        // Constant or smoothed samples show no independent noise, and neither do their residuals.
        if let Err(reason @ (NoEstimate::Constant | NoEstimate::Oversampled { .. })) = observed {
            return Err(reason);
        }
        // Residuals of a nearly right model leak less motion than the samples.
        let residual = self.noise(&self.residuals)?;
        let Ok(observed) = observed else { return Ok(residual) };
        let freedom = observed.degrees_of_freedom.min(residual.degrees_of_freedom);
        // The logarithm of a standard deviation with n degrees of freedom has the variance 1/(2 n).
        let is_lower =
            (residual.sigma / observed.sigma).ln() > CLEARLY_LOWER * (0.5 / freedom).sqrt();
        Ok(if is_lower { observed } else { residual })
    }

    /// Whether each residual is an outlier: its absolute value is above [`OUTLYING`] robust standard deviations, the
    /// median of the absolute residuals over [`MEDIAN_DEVIATION`]. None is one if that median is zero.
    pub fn outliers(&self) -> Vec<bool> {
        // The median is robust against the outliers themselves.
        let median = upper_median(self.residuals.iter().map(|r| r.abs())).unwrap_or(0.0);
        let limit = OUTLYING * median / MEDIAN_DEVIATION;
        self.residuals.iter().map(|r| median > 0.0 && r.abs() > limit).collect()
    }

    /// Noise scale of the coordinate `axis` of an `observation`, in its `unit`, compared with the root mean square
    /// residual without outliers and excluded values. A scale below that of the resolution, the quantization step over
    /// the root of 12, is replaced by it, with [`QUANTIZATION_FREEDOM`] degrees of freedom. Points of a shape at rest
    /// (not `is_series`) have none: they are not ordered in time. Without an estimate the reason is stored instead.
    pub fn scale(
        &self,
        observation: String,
        axis: &str,
        unit: &str,
        is_series: bool,
    ) -> NoiseScale {
        // Residuals without outliers, and their degrees of freedom.
        let outliers = self.outliers();
        let kept = || (0..self.residuals.len()).filter(|k| !self.excluded[*k] && !outliers[*k]);
        // The unknowns use up degrees of freedom of all coordinates in proportion to their values.
        let count = kept().count() as f64 * self.freedom_left;
        let square: f64 = kept().map(|k| (self.residuals[k] / self.factors[k]).powi(2)).sum();
        let residual_rms = (square / count.max(1.0)).sqrt();
        let mut scale = NoiseScale {
            observation,
            axis: axis.into(),
            value: None,
            unit: unit.into(),
            degrees_of_freedom: None,
            difference_order: None,
            residual_rms,
            p_value: None,
            unavailable: None,
        };
        if !is_series {
            scale.unavailable = Some("points of a shape have no differences in time".into());
            return scale;
        }
        // Rounding to a resolution q has the standard deviation q/sqrt(12).
        let resolution =
            quantization_step(&self.observed).map_or(0.0, |quantum| quantum / 12.0_f64.sqrt());
        let (value, freedom) = match self.estimate() {
            // Errors of coarse pixels are autocorrelated where the motion is slow: differences underestimate them.
            Err(NoEstimate::Oversampled { lower_bound: sigma, .. })
            | Ok(NoiseEstimate { sigma, .. })
                if sigma < resolution =>
            {
                (resolution, QUANTIZATION_FREEDOM)
            }
            Err(reason) => {
                scale.unavailable = Some(description(reason));
                return scale;
            }
            Ok(NoiseEstimate { sigma, degrees_of_freedom, order, .. }) => {
                scale.difference_order = Some(order);
                (sigma, degrees_of_freedom)
            }
        };
        (scale.value, scale.degrees_of_freedom) = (Some(value), Some(freedom));
        scale.p_value = Some(excess_probability(residual_rms / value, freedom, count));
        scale
    }
}

/// Probability that white noise of the scale has a root mean square residual of `ratio` or more times the scale. It is
/// `P(X <= f/ratio^2)` of a chi-squared `X` with `f = 1/(1/freedom - 1/count)` degrees of freedom. Residuals have
/// `count` degrees of freedom, and the scale, from the same samples, has `freedom`. It is 1 for a ratio up to 1, and 0
/// for a larger one if `freedom` is at least `count`, since the scale is then certain.
fn excess_probability(ratio: f64, freedom: f64, count: f64) -> f64 {
    // A scale with as many degrees of freedom as the residuals is certain.
    if ratio <= 1.0 || freedom >= count {
        return if ratio <= 1.0 { 1.0 } else { 0.0 };
    }
    let freedom = 1.0 / (1.0 / freedom - 1.0 / count);
    ChiSquared::new(freedom).map_or(1.0, |chi| chi.cdf(freedom / (ratio * ratio)))
}

/// Text of the reason why there is no noise scale, for the report: equal values, too few differences (with the number
/// needed), too many outliers (in per cent), or a ratio of noise by every second sample above that by all.
fn description(reason: NoEstimate) -> String {
    match reason {
        NoEstimate::Constant => "all values are the same".into(),
        NoEstimate::Few(count) => {
            format!("{count} usable differences, at least {FEWEST_DIFFERENCES} needed")
        }
        NoEstimate::Outliers(share) => {
            format!("{:.0} % of the samples are outliers", 100.0 * share)
        }
        NoEstimate::Oversampled { ratio, .. } => format!(
            "the estimate from every second sample is {ratio:.1} times that from all: the samples are smoothed, the noise \
             is autocorrelated, or there are too few samples per period"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Share of series of white noise whose residual variance is less probable than `level`.
    fn false_alarms(n: usize, runs: u64, level: f64, wave: f64) -> f64 {
        let mut alarms = 0.0;
        for seed in 0..runs {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let residuals: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut random)).collect();
            let signal = |k: usize| wave * (0.3 * k as f64).sin();
            let samples = CoordinateSamples {
                rows: (0..n).collect(),
                times: (0..n).map(|k| k as f64).collect(),
                observed: (0..n).map(|k| signal(k) + residuals[k]).collect(),
                residuals,
                factors: vec![1.0; n],
                excluded: vec![false; n],
                freedom_left: 1.0,
            };
            let p = samples.scale(String::new(), "x", "m", true).p_value;
            alarms += f64::from(p.is_some_and(|p| p < level));
        }
        alarms / runs as f64
    }

    #[test]
    fn white_residuals_exceed_their_scale_as_rarely_as_stated() {
        for n in [37, 75, 150, 600] {
            for wave in [0.0, 50.0] {
                for level in [0.05, 0.005] {
                    let found = false_alarms(n, 4000, level, wave);
                    println!("{n} samples, wave {wave}, level {level}: {found}");
                    // 4000 draws at 0.005 are 20 alarms, whose standard deviation is a fifth.
                    assert!((0.6..1.8).contains(&(found / level)), "{n}, {wave}, {level}: {found}");
                }
            }
        }
    }

    /// Noise scale of samples at unit spacing.
    fn scale_of(observed: Vec<f64>, residuals: Vec<f64>) -> NoiseScale {
        let n = observed.len();
        let samples = CoordinateSamples {
            rows: (0..n).collect(),
            times: (0..n).map(|k| k as f64).collect(),
            observed,
            residuals,
            factors: vec![1.0; n],
            excluded: vec![false; n],
            freedom_left: 1.0,
        };
        samples.scale(String::new(), "x", "m", true)
    }

    /// A motion of 3 mm in 600 frames by pixels of 2 mm hardly changes from frame to frame: the scale is that of the
    /// resolution, 2 mm over the root of 12.
    #[test]
    fn slow_motion_with_coarse_pixels_has_the_scale_of_the_pixels() {
        let truth: Vec<f64> = (0..600).map(|k| 5e-3 * (0.01 * f64::from(k)).sin()).collect();
        let observed: Vec<f64> = truth.iter().map(|x| 2e-3 * (x / 2e-3).round()).collect();
        let residuals = observed.iter().zip(&truth).map(|(o, t)| o - t).collect();
        let scale = scale_of(observed, residuals);
        assert!((scale.value.unwrap() / (2e-3 / 12.0_f64.sqrt()) - 1.0).abs() < 1e-6, "{scale:?}");
        assert!(scale.p_value.unwrap() > 0.05, "{scale:?}");
    }

    /// Pixels of five standard deviations add their variance, 25/12, to that of the noise.
    #[test]
    fn pixels_of_five_sigma_add_their_variance() {
        let mut variances = Vec::new();
        for seed in 0..50 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let truth: Vec<f64> = (0..200).map(|k| 300.0 * (0.21 * f64::from(k)).sin()).collect();
            let normal =
                |x: &f64| -> f64 { x + Distribution::<f64>::sample(&StandardNormal, &mut random) };
            let observed: Vec<f64> =
                truth.iter().map(normal).map(|x| 5.0 * (x / 5.0).round()).collect();
            let residuals = observed.iter().zip(&truth).map(|(o, t)| o - t).collect();
            variances.extend(scale_of(observed, residuals).value.map(|value| value.powi(2)));
        }
        let mean = variances.iter().sum::<f64>() / variances.len() as f64;
        assert!(variances.len() > 45 && (mean / (1.0 + 25.0 / 12.0) - 1.0).abs() < 0.1, "{mean}");
    }
}

//! Adequacy of the model: residuals against a noise scale that does not depend on it.
//!
//! Where no sigma is stated, the residuals alone cannot separate noise from misfit. Differences of the samples can: a
//! missing effect leaves motion of the rod's own frequencies, which they suppress. For white noise the variance `r` of
//! the residuals and the variance `s` from differences have the same expectation. They share their samples, so that
//! `s/r` has the relative variance `2/nu - 2/n`, with `nu` degrees of freedom of `s` and `n` of `r`, and is compared with
//! chi-squared over its `1/(1/nu - 1/n)` degrees of freedom (after von Neumann 1941).
//!
//! A scale below the residuals means autocorrelated noise or a missing effect. It changes the grade and the score
//! tests, never an interval.

use crate::fit::measurement::Measurement;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::correlation::Correlations;
use crate::fit::uncertainty::noise::Noise;
use crate::numerics::noise_scale::{
    FEWEST_DIFFERENCES, NoEstimate, NoiseEstimate, Series, quantum,
};
use crate::numerics::order;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Probability that noise alone makes the residuals of any coordinate of a right model exceed its noise scale.
const FALSE_ALARM: f64 = 0.003;
/// Uncorrected probability below which score tests use the noise scale of a coordinate instead of its residuals.
const DOUBTFUL: f64 = 0.05;
/// Degrees of freedom of quantization errors: those of a slow motion are strongly autocorrelated, with a few
/// independent values in a record.
const QUANTIZATION_FREEDOM: f64 = 8.0;
/// The estimate from the samples replaces that from the residuals where it is lower by this many standard errors.
const CLEARLY_LOWER: f64 = 2.0;

/// The noise of one coordinate of an observation, estimated without the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct NoiseScale {
    /// The file, or the point.
    pub observation: String,
    /// x, y or z.
    pub axis: String,
    /// Standard deviation of the noise from differences of the samples, in `unit`; none where these do not show it.
    pub value: Option<f64>,
    /// Unit of `value` and `residual_rms`.
    pub unit: String,
    /// Degrees of freedom of the square of `value`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
    /// Order of the differences; none where the resolution of the values sets the scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference_order: Option<usize>,
    /// Root mean square residual of this coordinate, for the degrees of freedom that the fit leaves.
    pub residual_rms: f64,
    /// Probability of a residual variance as large as this for white noise of this scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// Reason why there is no value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unavailable: Option<String>,
}

/// A noise scale, with the rows of the residuals that it is of.
pub(crate) struct CoordinateNoise {
    pub scale: NoiseScale,
    /// Place of the measurement among all.
    pub measurement: usize,
    pub axis: &'static str,
    rows: Vec<usize>,
    /// Standard deviation that residuals are in units of.
    nominal: f64,
    pub stated_sigma: Option<f64>,
    /// Correlation of neighboring residuals, 0 where none is significant.
    pub correlation: f64,
    /// Whether that correlation is the largest that the estimate can have.
    pub is_at_cap: bool,
}

/// Noise scales of all coordinates of all recorded motions.
pub(crate) struct Adequacy {
    pub coordinates: Vec<CoordinateNoise>,
}

impl CoordinateNoise {
    /// Whether the residuals exceed the noise scale, beside so many other coordinates.
    pub fn is_exceeded(&self, coordinates: usize) -> bool {
        self.scale.p_value.is_some_and(|p| p < FALSE_ALARM / coordinates.max(1) as f64)
    }
}

impl Adequacy {
    /// Of the residuals at an optimum.
    pub fn of(search: &Search, optimum: &Optimum, correlations: &Correlations) -> Self {
        let mut coordinates = Vec::new();
        if search.is_rounding(optimum) {
            return Self { coordinates };
        }
        let share = search.unknowns.len() as f64 / optimum.residuals.len() as f64;
        let mut first = 0;
        for (place, (experiment, measurement, nominal, own)) in search.measured(optimum).enumerate()
        {
            if let Measurement::Motion(observation) = measurement {
                let observed: Vec<f64> =
                    observation.samples.iter().flat_map(|s| s.position).flatten().collect();
                let factors: Vec<f64> =
                    measurement.sigmas(nominal).iter().map(|sigma| sigma / nominal).collect();
                for coordinate in measurement.coordinates(&experiment.problem) {
                    let mut places: Vec<(usize, f64)> =
                        coordinate.places.iter().filter(|(k, _)| *k < own.len()).copied().collect();
                    order::sort_by(&mut places, |x| x.1);
                    let pick = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
                        places.iter().map(|(k, _)| of(*k)).collect()
                    };
                    let loss = measurement.loss();
                    let is_excluded = |(k, _): &(usize, f64)| {
                        let leverage = search.trust.get(first + k).copied().unwrap_or(1.0);
                        own[*k].abs() > loss.scale() || leverage < 1.0
                    };
                    let samples = Samples {
                        times: places.iter().map(|(_, t)| *t).collect(),
                        observed: pick(&|k| observed[k]),
                        residuals: pick(&|k| own[k] * factors[k] * nominal),
                        factors: pick(&|k| factors[k]),
                        excluded: places.iter().map(is_excluded).collect(),
                        freedom_left: 1.0 - share,
                    };
                    let axis = coordinate.axis;
                    let (correlation, is_at_cap) = correlations.of_coordinate(place, axis);
                    coordinates.push(CoordinateNoise {
                        scale: samples.scale(experiment.label(measurement), axis),
                        measurement: place,
                        axis,
                        rows: places.iter().map(|(k, _)| first + k).collect(),
                        nominal,
                        stated_sigma: measurement.sigma(),
                        correlation,
                        is_at_cap,
                    });
                }
            }
            first += own.len();
        }
        Self { coordinates }
    }

    /// Whether the residuals of a coordinate exceed its noise scale.
    pub fn is_exceeded(&self, measurement: usize, axis: &str) -> bool {
        let own = |c: &&CoordinateNoise| c.measurement == measurement && c.axis == axis;
        self.coordinates.iter().find(own).is_some_and(|c| c.is_exceeded(self.coordinates.len()))
    }

    /// Variance of the noise along a `direction` of the weighted residuals, and its degrees of freedom. Coordinates whose
    /// sigma is not stated have white noise: of their noise scale where the residuals are doubtful, else, or where it is
    /// not available, of their own variance. Beside a stated sigma autocorrelation is that of the noise.
    pub fn variance_along(
        &self,
        direction: &[f64],
        noise: &Noise,
        correlations: &Correlations,
    ) -> VarianceAlong {
        let common = correlations.freedom.iter().flatten().copied().reduce(f64::min);
        let mut rest = direction.to_vec();
        let (mut variance, mut error) = (0.0, 0.0);
        for c in &self.coordinates {
            let is_doubtful = c.correlation > 0.0 || c.scale.p_value.is_some_and(|p| p < DOUBTFUL);
            if c.stated_sigma.is_some() || !is_doubtful {
                continue;
            }
            let (value, freedom) = match c.scale.value.zip(c.scale.degrees_of_freedom) {
                Some(scale) => scale,
                None => (c.scale.residual_rms, c.rows.len() as f64),
            };
            let square: f64 = c.rows.iter().map(|k| direction[*k].powi(2)).sum();
            let own = (value / c.nominal).powi(2) * square;
            variance += own;
            error += own * own / freedom;
            c.rows.iter().for_each(|k| rest[*k] = 0.0);
        }
        let others = correlations.variance_along(&rest, noise);
        if let Some(freedom) = common {
            error += others * others / freedom;
        }
        variance += others;
        let degrees_of_freedom = (error > 0.0).then(|| variance * variance / error);
        VarianceAlong { variance, degrees_of_freedom }
    }
}

/// Variance of the residuals along a direction.
pub(crate) struct VarianceAlong {
    pub variance: f64,
    /// None where the variance is known.
    pub degrees_of_freedom: Option<f64>,
}

/// One coordinate in the order of its times, in its unit.
struct Samples {
    times: Vec<f64>,
    observed: Vec<f64>,
    residuals: Vec<f64>,
    factors: Vec<f64>,
    excluded: Vec<bool>,
    /// Part of the degrees of freedom that the fit has not used.
    freedom_left: f64,
}

impl Samples {
    fn noise(&self, values: &[f64]) -> Result<NoiseEstimate, NoEstimate> {
        let Self { times, factors, excluded, .. } = self;
        Series { times, values, factors, excluded }.noise()
    }

    /// The lower of the estimates from residuals and from samples: each has the noise and what it leaks.
    fn estimate(&self) -> Result<NoiseEstimate, NoEstimate> {
        let observed = self.noise(&self.observed);
        if let Err(reason @ (NoEstimate::Constant | NoEstimate::Oversampled(_))) = observed {
            return Err(reason);
        }
        let residual = self.noise(&self.residuals)?;
        let Ok(observed) = observed else { return Ok(residual) };
        let freedom = observed.degrees_of_freedom.min(residual.degrees_of_freedom);
        let is_lower =
            (residual.sigma / observed.sigma).ln() > CLEARLY_LOWER * (0.5 / freedom).sqrt();
        Ok(if is_lower { observed } else { residual })
    }

    fn scale(&self, observation: String, axis: &str) -> NoiseScale {
        let kept = || (0..self.residuals.len()).filter(|k| !self.excluded[*k]);
        let count = kept().count() as f64 * self.freedom_left;
        let square: f64 = kept().map(|k| (self.residuals[k] / self.factors[k]).powi(2)).sum();
        let residual_rms = (square / count.max(1.0)).sqrt();
        let mut scale = NoiseScale {
            observation,
            axis: axis.into(),
            value: None,
            unit: "m".into(),
            degrees_of_freedom: None,
            difference_order: None,
            residual_rms,
            p_value: None,
            unavailable: None,
        };
        let resolution = quantum(&self.observed).map_or(0.0, |quantum| quantum / 12.0_f64.sqrt());
        match self.estimate() {
            Err(reason) => scale.unavailable = Some(words(reason)),
            Ok(NoiseEstimate { sigma, .. }) if sigma < resolution => {
                scale.value = Some(resolution);
                scale.degrees_of_freedom = Some(QUANTIZATION_FREEDOM);
            }
            Ok(NoiseEstimate { sigma, degrees_of_freedom, order, .. }) => {
                scale.value = Some(sigma);
                scale.degrees_of_freedom = Some(degrees_of_freedom);
                scale.difference_order = Some(order);
            }
        }
        if let (Some(value), Some(freedom)) = (scale.value, scale.degrees_of_freedom) {
            scale.p_value = Some(excess_probability(residual_rms / value, freedom, count));
        }
        scale
    }
}

/// Probability that white noise has residuals so many times its scale, which has this many degrees of freedom, as the
/// residuals have `count`.
fn excess_probability(ratio: f64, freedom: f64, count: f64) -> f64 {
    if ratio <= 1.0 || freedom >= count {
        return if ratio <= 1.0 { 1.0 } else { 0.0 };
    }
    let freedom = 1.0 / (1.0 / freedom - 1.0 / count);
    ChiSquared::new(freedom).map_or(1.0, |chi| chi.cdf(freedom / (ratio * ratio)))
}

fn words(reason: NoEstimate) -> String {
    match reason {
        NoEstimate::Constant => "all values are the same".into(),
        NoEstimate::Few(count) => {
            format!("{count} usable differences, at least {FEWEST_DIFFERENCES} needed")
        }
        NoEstimate::Outliers(share) => {
            format!("{:.0} % of the samples are outliers", 100.0 * share)
        }
        NoEstimate::Oversampled(ratio) => format!(
            "every second sample shows {ratio:.1} times the noise: the samples are smoothed or the noise is \
             autocorrelated"
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
            let samples = Samples {
                times: (0..n).map(|k| k as f64).collect(),
                observed: (0..n).map(|k| signal(k) + residuals[k]).collect(),
                residuals,
                factors: vec![1.0; n],
                excluded: vec![false; n],
                freedom_left: 1.0,
            };
            let p = samples.scale(String::new(), "x").p_value;
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
                    assert!((0.6..1.8).contains(&(found / level)), "{n}, {wave}, {level}: {found}");
                }
            }
        }
    }
}

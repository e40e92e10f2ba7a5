//! Adequacy of the model: residuals against a noise scale that does not depend on the model.
//!
//! Without a stated sigma the residuals alone cannot separate noise from misfit. Differences of neighboring samples
//! can: a missing effect leaves motion of the frequencies of the rod in the residuals, which differences suppress. For
//! white noise the variance `r` of the residuals and the variance `s` from differences have the same expectation. They
//! share their samples: with `nu` degrees of freedom of `s` and `n` of `r`, `s/r` has the relative variance
//! `2/nu - 2/n`. The ratio is compared with chi-squared over its `1/(1/nu - 1/n)` degrees of freedom (after von Neumann
//! 1941).
//!
//! [`Adequacy::new`] makes one [`CoordinateNoise`] per coordinate of motions and of readings over time, and of shapes
//! with neither a stated sigma nor unknown arc lengths; none where the residuals are rounding errors. The residuals of
//! a coordinate exceed its scale at a p-value below [`FALSE_ALARM`] over the number of coordinates (`is_exceeded`):
//! autocorrelated noise or a missing effect.
//!
//! `variance_along` returns the variance of the noise along a direction of the weighted residuals, for score tests. It
//! takes white noise of the scale (without a scale: of the root mean square residual) for coordinates with doubtful
//! residuals: correlated, with a p-value below [`DOUBTFUL`], or with a wrong sigma. It does not where sigma is stated
//! and agrees with the scale, or where there are outliers. Warnings, grade and score tests use the results.

use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::noise::autocorrelation::NoiseModel;
use crate::fit::uncertainty::noise::noise_scale::{CoordinateSamples, NoiseScale};
use crate::fit::uncertainty::noise::residual_noise::ResidualNoise;
use nalgebra::DVector;

/// Probability that noise alone makes the residuals of any coordinate of a right model exceed its noise scale. Larger:
/// smaller missing effects are found, with more false alarms.
const FALSE_ALARM: f64 = 0.003;
/// Ratio of a stated sigma and the scatter of the data, either way, above which the sigma is reported as doubtful. The
/// scale of 20 differences has a relative error of a third, so that a ratio of three is significant.
const WRONG_SIGMA: f64 = 2.5;
/// Uncorrected probability below which score tests use the noise scale of a coordinate instead of its residuals.
const DOUBTFUL: f64 = 0.05;

/// Noise of one coordinate: its scale from the samples, and its autocorrelation from the residuals.
pub(crate) struct CoordinateNoise {
    /// Noise scale of the samples, compared with the residuals.
    pub scale: NoiseScale,
    /// Index of the measurement among all.
    pub measurement: usize,
    /// Rows of the values among all residuals.
    rows: Vec<usize>,
    /// Standard deviation by which the residuals of the fit are divided, in the unit of the measurement.
    nominal: f64,
    /// The stated sigma of the measurement, in its unit.
    pub stated_sigma: Option<f64>,
    /// AR(1) correlation of neighboring residuals; 0 where it is not significant.
    pub correlation: f64,
    /// Whether that correlation is the largest that the estimate can have.
    pub is_at_cap: bool,
    /// Whether any residual is an outlier.
    pub has_outliers: bool,
}

/// Noise of all coordinates of all recorded motions and readings over time, and of shapes with neither a stated sigma
/// nor unknown arc lengths, as evidence on the adequacy of the model.
pub(crate) struct Adequacy {
    /// The coordinates in the order of the measurements; empty where all residuals are rounding errors.
    pub coordinates: Vec<CoordinateNoise>,
}

/// Variance of the noise of the weighted residuals along a direction.
pub(crate) struct VarianceAlong {
    /// `d'Vd` for the direction `d` and the covariance `V` of the noise, in squared units of the residuals.
    pub variance: f64,
    /// Degrees of freedom of the variance; none where it is known.
    pub degrees_of_freedom: Option<f64>,
}

impl VarianceAlong {
    /// The variance by the residuals that an effect leaves, where white residuals themselves are its estimate: else a
    /// large effect would be noise in its own test. The effect changes them by a multiple of `direction`, `u`, with
    /// `product` as `|u.r|`. Of the `nu` degrees of freedom it uses one: the test statistic is then Student's t of a
    /// regression with the effect. Otherwise unchanged.
    pub fn without_effect(
        self,
        direction: &DVector<f64>,
        residuals: &DVector<f64>,
        product: f64,
        noise: &ResidualNoise,
    ) -> Self {
        let square = direction.norm_squared();
        let white = noise.variance * square;
        let is_white = (self.variance - white).abs() <= 1e-9 * white;
        let freedom = noise.degrees_of_freedom.filter(|freedom| is_white && *freedom >= 2.0);
        let Some(freedom) = freedom else { return self };
        let share = product * product / square / residuals.norm_squared();
        let left = (1.0 - share).max(f64::EPSILON) * freedom / (freedom - 1.0);
        Self { variance: self.variance * left, degrees_of_freedom: Some(freedom - 1.0) }
    }
}

/// Whether a stated `sigma` differs from the `scatter` of the data, in the same unit, by more than a factor of
/// [`WRONG_SIGMA`].
pub(crate) fn is_sigma_doubtful(sigma: f64, scatter: f64) -> bool {
    !(1.0 / WRONG_SIGMA..=WRONG_SIGMA).contains(&(sigma / scatter))
}

impl CoordinateNoise {
    /// Whether a stated sigma is far from the noise scale, by [`is_sigma_doubtful`]; false without a stated sigma or
    /// without a scale.
    fn is_sigma_wrong(&self) -> bool {
        let both = self.stated_sigma.zip(self.scale.value);
        both.is_some_and(|(sigma, value)| is_sigma_doubtful(sigma, value))
    }

    /// Whether the residuals are white noise of the noise scale: neither an excess nor a significant correlation. False
    /// without a scale. `coordinates` is the number of all coordinates, as in `is_exceeded`.
    pub fn is_explained(&self, coordinates: usize) -> bool {
        self.scale.p_value.is_some() && !self.is_exceeded(coordinates) && self.correlation == 0.0
    }

    /// Whether the residuals exceed the noise scale: a p-value below [`FALSE_ALARM`] over the number of all
    /// `coordinates` (Bonferroni's correction). False without a scale.
    pub fn is_exceeded(&self, coordinates: usize) -> bool {
        self.scale.p_value.is_some_and(|p| p < FALSE_ALARM / coordinates.max(1) as f64)
    }

    /// Whether the residuals may be no measure of the noise: a significant correlation, a wrong sigma, or an excess
    /// over the scale with a p-value below [`DOUBTFUL`]. Score tests then use the noise scale.
    fn is_doubtful(&self) -> bool {
        self.correlation > 0.0
            || self.is_sigma_wrong()
            || self.scale.p_value.is_some_and(|p| p < DOUBTFUL)
    }
}

impl Adequacy {
    /// Compares the residuals at an optimum with the samples of each coordinate, in the order of the measurements.
    /// Included are motions, readings over time, and shapes without a stated sigma and without unknown arc lengths.
    /// Empty where the residuals are rounding errors.
    pub fn new(fitted: Fitted, correlations: &NoiseModel) -> Self {
        let Fitted { search, optimum } = fitted;
        let mut coordinates = Vec::new();
        if search.is_rounding(optimum) {
            return Self { coordinates };
        }
        // Part of the degrees of freedom that the unknowns use up.
        let used = search.unknowns.len() as f64 / optimum.residuals.len() as f64;
        for own in fitted.measured() {
            let MeasuredResiduals { index, experiment, measurement, .. } = own;
            let is_series = measurement.motion().is_some()
                || measurement.data.readings().first().is_some_and(|first| first.time.is_some());
            // Offsets from a line of unknown arc lengths have no scale of their own in the samples.
            let is_shape = measurement.shape().is_some() && measurement.fitted_nuisances() == 0;
            if !is_series && (!is_shape || measurement.sigma().is_some()) {
                continue;
            }
            for coordinate in measurement.coordinates(&experiment.problem) {
                let samples = CoordinateSamples::new(search, &own, &coordinate, used);
                // The autocorrelation of the residuals accompanies the scale.
                let series = correlations.series_of(index, coordinate.axis);
                coordinates.push(CoordinateNoise {
                    has_outliers: samples.outliers().contains(&true),
                    scale: samples.scale(
                        experiment.label(measurement),
                        coordinate.axis,
                        measurement.unit(),
                        is_series,
                    ),
                    measurement: index,
                    rows: samples.rows,
                    nominal: own.sigma,
                    stated_sigma: measurement.sigma(),
                    correlation: correlations.correlation(index, coordinate.axis),
                    is_at_cap: series.is_some_and(|series| series.is_at_cap()),
                });
            }
        }
        Self { coordinates }
    }

    /// Whether the residuals of measurement number `measurement` are white noise of the noise scale in all its
    /// coordinates. False for a measurement without any coordinate here.
    pub fn is_explained(&self, measurement: usize) -> bool {
        let count = self.coordinates.len();
        let mut own = self.coordinates.iter().filter(|c| c.measurement == measurement).peekable();
        own.peek().is_some() && own.all(|c| c.is_explained(count))
    }

    /// Variance of the noise along a `direction` of the weighted residuals (one number per row), and its degrees of
    /// freedom.
    ///
    /// The residuals of a coordinate are doubtful if they correlate, exceed the noise scale, or contradict a stated
    /// sigma. Its noise is then white, with the noise scale as standard deviation, or without a scale with the RMS of
    /// its residuals. This does not apply to coordinates with outliers, or with a stated sigma that agrees with the
    /// scale. All other rows have the noise of the residuals with its autocorrelation. The degrees of freedom are those
    /// of Welch and Satterthwaite; none where the variance is known.
    pub fn variance_along(
        &self,
        direction: &[f64],
        noise: &ResidualNoise,
        correlations: &NoiseModel,
    ) -> VarianceAlong {
        let mut others = direction.to_vec();
        let (mut variance, mut error) = (0.0, 0.0);
        for c in self.coordinates.iter().filter(|c| c.is_doubtful()) {
            let is_stated = c.stated_sigma.is_some() && !c.is_sigma_wrong();
            // Outliers are part of the noise, and of the variance of the residuals only.
            if is_stated || c.has_outliers {
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
            // These rows have no part in the variance by the residuals below.
            c.rows.iter().for_each(|k| others[*k] = 0.0);
        }
        // All other rows have the noise of the residuals.
        let of_others = correlations.variance_along(&others, noise);
        if let Some(freedom) = correlations.fewest_degrees_of_freedom() {
            error += of_others * of_others / freedom;
        }
        variance += of_others;
        // Welch and Satterthwaite.
        let degrees_of_freedom = (error > 0.0).then(|| variance * variance / error);
        VarianceAlong { variance, degrees_of_freedom }
    }
}

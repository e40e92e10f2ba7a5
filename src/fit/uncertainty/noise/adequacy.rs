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

use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::noise::autocorrelation::Correlations;
use crate::fit::uncertainty::noise::noise_scale::{CoordinateSamples, NoiseScale};
use crate::fit::uncertainty::noise::residual_noise::Noise;

/// Probability that noise alone makes the residuals of any coordinate of a right model exceed its noise scale.
const FALSE_ALARM: f64 = 0.003;
/// Factor between a stated sigma and the scatter of the data from which on the sigma is reported as doubtful. The scale of
/// 20 differences scatters by a third, so that a factor of three is no chance.
pub(crate) const WRONG_SIGMA: f64 = 2.5;
/// Uncorrected probability below which score tests use the noise scale of a coordinate instead of its residuals.
const DOUBTFUL: f64 = 0.05;

/// A noise scale, with the rows of the residuals that it is of.
pub(crate) struct CoordinateNoise {
    pub scale: NoiseScale,
    /// Place of the measurement among all.
    pub measurement: usize,
    rows: Vec<usize>,
    /// Standard deviation that residuals are in units of.
    nominal: f64,
    pub stated_sigma: Option<f64>,
    /// Correlation of neighboring residuals, 0 where none is significant.
    pub correlation: f64,
    /// Whether that correlation is the largest that the estimate can have.
    pub is_at_cap: bool,
    /// Whether any residual is an outlier.
    pub has_outliers: bool,
}

/// Noise scales of all coordinates of all recorded motions.
pub(crate) struct Adequacy {
    pub coordinates: Vec<CoordinateNoise>,
}

impl CoordinateNoise {
    /// Whether the stated sigma is far from the noise scale.
    fn is_sigma_wrong(&self) -> bool {
        let ratio = self.stated_sigma.zip(self.scale.value).map(|(sigma, value)| sigma / value);
        ratio.is_some_and(|ratio| !(1.0 / WRONG_SIGMA..=WRONG_SIGMA).contains(&ratio))
    }

    /// Whether the residuals are noise of the size that the samples show.
    pub fn is_explained(&self, coordinates: usize) -> bool {
        self.scale.p_value.is_some() && !self.is_exceeded(coordinates) && self.correlation == 0.0
    }

    /// Whether the residuals exceed the noise scale, beside so many other coordinates.
    pub fn is_exceeded(&self, coordinates: usize) -> bool {
        self.scale.p_value.is_some_and(|p| p < FALSE_ALARM / coordinates.max(1) as f64)
    }
}

impl Adequacy {
    /// Of the residuals at an optimum.
    pub fn of(fitted: Fitted, correlations: &Correlations) -> Self {
        let Fitted { search, optimum } = fitted;
        let mut coordinates = Vec::new();
        if search.is_rounding(optimum) {
            return Self { coordinates };
        }
        let share = search.unknowns.len() as f64 / optimum.residuals.len() as f64;
        for own in fitted.measured() {
            let MeasuredResiduals { index, experiment, measurement, .. } = own;
            // Offsets from a line of unknown arc lengths have no scale of their own in the samples.
            let is_shape = measurement.shape().is_some() && measurement.fitted_arc_lengths() == 0;
            let is_motion = measurement.motion().is_some();
            let all = measurement.coordinates(&experiment.problem);
            let wanted = is_motion || is_shape && measurement.sigma().is_none();
            for coordinate in all.into_iter().filter(|_| wanted) {
                let samples = CoordinateSamples::of(search, &own, &coordinate, share);
                let axis = coordinate.axis;
                let label = experiment.label(measurement);
                let (correlation, is_at_cap) = correlations.of_coordinate(index, axis);
                let has_outliers = samples.outliers().contains(&true);
                coordinates.push(CoordinateNoise {
                    has_outliers,
                    scale: match is_motion {
                        true => samples.scale(label, axis),
                        false => samples.scale_of_shape(label, axis),
                    },
                    measurement: index,
                    rows: samples.rows,
                    nominal: own.sigma,
                    stated_sigma: measurement.sigma(),
                    correlation,
                    is_at_cap,
                });
            }
        }
        Self { coordinates }
    }

    /// Whether the residuals of a measurement are noise of the size that its samples show, in all coordinates.
    pub fn is_explained(&self, measurement: usize) -> bool {
        let count = self.coordinates.len();
        let mut own = self.coordinates.iter().filter(|c| c.measurement == measurement).peekable();
        own.peek().is_some() && own.all(|c| c.is_explained(count))
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
            let is_doubtful = c.correlation > 0.0
                || c.is_sigma_wrong()
                || c.scale.p_value.is_some_and(|p| p < DOUBTFUL);
            let is_stated = c.stated_sigma.is_some() && !c.is_sigma_wrong();
            // Outliers have a variance of their own, which is in that of the residuals.
            if is_stated || !is_doubtful || c.has_outliers {
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

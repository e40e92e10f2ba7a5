//! Noise of the data, estimated from residuals and samples: variance, autocorrelation, noise scale and coverage factors.

pub(crate) mod adequacy;
pub(crate) mod autocorrelation;
pub(crate) mod coordinate_series;
pub(crate) mod coverage_factor;
pub(crate) mod noise_scale;
pub(crate) mod outlying_experiments;
pub(crate) mod residual_noise;

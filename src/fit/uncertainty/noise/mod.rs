//! Noise of the data as the residuals and the samples show it: variance, autocorrelation, scale, and coverage factors.

pub(crate) mod adequacy;
pub(crate) mod autocorrelation;
pub(crate) mod coverage_factor;
pub(crate) mod noise_scale;
pub(crate) mod outlying_experiments;
pub(crate) mod residual_noise;

//! Noise of the data, estimated from residuals and samples.
//!
//! `residual_noise` computes the variance of the residuals and the weights of their rows. `coordinate_series` and
//! `autocorrelation` estimate their AR(1) correlation and its effect on the standard errors. `noise_scale` estimates
//! the noise from differences of the samples, without the model; `adequacy` compares it with the residuals.
//! `estimated_weights` are the errors of the weights of several measurements without stated sigmas. `coverage_factor`
//! has the quantiles of intervals. `outlying_experiments` finds experiments whose residuals are large
//! beside those of the others. The covariance, the intervals and the warnings of a fit use the results.

pub(crate) mod adequacy;
pub(crate) mod autocorrelation;
pub(crate) mod coordinate_series;
pub(crate) mod coverage_factor;
pub(crate) mod estimated_weights;
pub(crate) mod noise_scale;
pub(crate) mod outlying_experiments;
pub(crate) mod residual_noise;

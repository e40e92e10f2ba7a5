//! Uncertainty of an optimum: from the residuals and the Jacobian of a fit to estimates with intervals, warnings and a grade.
//!
//! [`assessment`] runs all analyses in their order. `noise` is the variance and autocorrelation of the residuals.
//! `covariance` is the Gauss-Newton covariance, with identifiability, one-sided bounds and profiles. `budget` propagates
//! inputs with an uncertainty (GUM). `resampling` has bootstrap and jackknife, `discretization` the errors of mesh and step.
//! `discrepancy` tests omitted effects and validation data. `warnings` are summarized by [`grade`] in a grade and a verdict.

pub(crate) mod analysis;
pub(crate) mod assessment;
pub(crate) mod budget;
pub(crate) mod covariance;
pub(crate) mod discrepancy;
pub(crate) mod discretization;
pub(crate) mod estimate;
pub(crate) mod grade;
pub(crate) mod noise;
pub(crate) mod resampling;
pub(crate) mod warning_list;
pub(crate) mod warnings;

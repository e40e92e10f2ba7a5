//! Uncertainty of an optimum: from the residuals and the Jacobian of a fit to estimates with intervals, warnings and a
//! grade.
//!
//! `assessment` runs all analyses in their order, for a fit or for a planned experiment. `noise` estimates variance and
//! autocorrelation of the residuals. `covariance` computes the Gauss-Newton covariance, unidentifiable directions,
//! one-sided bounds and profiles. `budget` propagates standard uncertainties of inputs (GUM). `resampling` refits
//! simulated data (bootstrap, Monte Carlo) and compares experiments (jackknife). `posterior` samples the posterior
//! distribution (NUTS). `discretization` estimates the errors by mesh and time step. `discrepancy` tests for omitted
//! effects and predicts validation data. `warnings` checks data, residuals and parameters. All findings are added to a
//! `warning_list`, from which [`grade`] derives grade, status and verdict. `estimate` has the result for each
//! parameter, `method_intervals` its intervals by all methods, `analysis` the options of a fit.

pub(crate) mod analysis;
pub(crate) mod assessment;
pub(crate) mod budget;
pub(crate) mod covariance;
pub(crate) mod discrepancy;
pub(crate) mod discretization;
pub(crate) mod estimate;
pub(crate) mod grade;
pub(crate) mod method_intervals;
pub(crate) mod noise;
pub(crate) mod posterior;
pub(crate) mod resampling;
pub(crate) mod warning_list;
pub(crate) mod warnings;

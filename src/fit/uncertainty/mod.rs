//! Uncertainty of an optimum: covariance, noise, budget, model discrepancy, discretization error, warnings and the grade.

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

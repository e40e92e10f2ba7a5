//! Covariance of the estimates at an optimum, identifiability, one-sided bounds, profile likelihood and observed information.

pub(crate) mod combinations;
pub(crate) mod determined_groups;
pub(crate) mod gauss_newton;
pub(crate) mod identifiability;
pub(crate) mod local_analysis;
pub(crate) mod observed_information;
pub(crate) mod one_sided_bound;
pub(crate) mod profile_likelihood;
pub(crate) mod zero_bound;

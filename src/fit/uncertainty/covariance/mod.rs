//! Covariance of the estimates at an optimum, and which parameters the data determine.
//!
//! `local_analysis` combines the noise with the Gauss-Newton covariance (`gauss_newton`), whose singular directions are the
//! unidentifiable ones (`identifiability`, `combinations`, `determined_groups`). `zero_bound` and `one_sided_bound` bound
//! parameters near zero or without a limit. `profile_likelihood` and `observed_information` are intervals on request.

pub(crate) mod combinations;
pub(crate) mod determined_groups;
pub(crate) mod gauss_newton;
pub(crate) mod identifiability;
pub(crate) mod local_analysis;
pub(crate) mod observed_information;
pub(crate) mod one_sided_bound;
pub(crate) mod profile_likelihood;
pub(crate) mod zero_bound;

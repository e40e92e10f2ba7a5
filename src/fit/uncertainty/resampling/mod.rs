//! Uncertainty by resampling the data of a fit.
//!
//! `bootstrap` fits simulated data with random noise again, on request: a bootstrap, or a Monte Carlo with random
//! inputs that verifies the uncertainty budget. Its results are standard deviations and 2.5 and 97.5 percentiles of the
//! estimates, in their units. `cluster_jackknife` leaves out one experiment after the other, by the linear model and
//! without further fits, for five experiments or more. It adds standard errors and 95 % intervals from the differences
//! between experiments to the estimates, and replaces those by the residuals where it is wider.

pub(crate) mod bootstrap;
pub(crate) mod cluster_jackknife;

//! Uncertainty by resampling the data of a fit.
//!
//! `bootstrap` fits simulated data with random noise again, on request: a bootstrap, or a Monte Carlo with random inputs that
//! verifies the uncertainty budget. Its results are standard deviations and percentiles of the estimates. `cluster_jackknife`
//! leaves out one experiment after the other, by the linear model and without further fits. It adds intervals from the
//! differences between experiments.

pub(crate) mod bootstrap;
pub(crate) mod cluster_jackknife;

//! Uncertainty by resampling: bootstrap, Monte Carlo, and the jackknife over experiments.

pub(crate) mod bootstrap;
pub(crate) mod cluster_jackknife;

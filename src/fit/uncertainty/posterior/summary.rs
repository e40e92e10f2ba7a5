//! Posterior distribution of one parameter: location, spread, interval and quality of the sample.
//!
//! [`Posterior`] is a result in the report of a fit. All values are in the unit of the parameter.

use serde::{Deserialize, Serialize};

/// Posterior distribution of a parameter, from the draws of several chains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Posterior {
    /// Mean, in the parameter's unit.
    pub mean: f64,
    /// Median, in the parameter's unit.
    pub median: f64,
    /// Standard deviation, in the parameter's unit.
    pub std_dev: f64,
    /// 2.5 and 97.5 percentiles, in the parameter's unit.
    pub interval95: [f64; 2],
    /// Rank-normalized split R-hat: 1 for chains of one distribution, at most 1.01 for a usable
    /// sample.
    pub r_hat: f64,
    /// Effective number of independent draws, for the bulk of the distribution.
    pub effective_draws: f64,
    /// Monte Carlo standard error of the mean, in the parameter's unit.
    pub mc_error: f64,
    /// Number of divergent draws of all chains after their warm-up: trajectories that could not be
    /// simulated, or on which the energy changed.
    pub divergences: usize,
    /// Number of draws of all chains.
    pub draws: usize,
}

//! Options of a fit for computations in addition to the estimate: the table `[analysis]` of a fit file, or
//! `Fit::analyse`.
//!
//! [`Analysis`] turns on profile likelihood, bootstrap (number of replicates, and of the first one of a shared
//! bootstrap), the posterior distribution (numbers of draws and chains), observed information, Monte Carlo (number of
//! fits) and the sensitivity analysis (inputs, score tests, undetected bias). It selects the method of the
//! discretization error ([`Refinement`]: linearized, refitted or none). It has plausible sizes of omitted effects by
//! parameter name, in their units, and the seed of the random numbers. The convergence criterion of the search is the
//! largest parameter step in standard errors ([`TOLERANCE`] by default). By default only the linearized discretization
//! error is on, and the sensitivity analysis where it is cheap. Unknown keys are errors; values are checked elsewhere.

use crate::fit::uncertainty::posterior::settings::PosteriorSettings;
use serde::Deserialize;
use std::collections::BTreeMap;

/// `[analysis]`: computations in addition to the estimate.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Analysis {
    /// Whether to compute 95 % intervals from the profile likelihood, for strongly nonlinear
    /// models.
    pub profile: bool,
    /// Number of parametric bootstrap replicates; 0: none.
    pub bootstrap: usize,
    /// Number of the first replicate, where several fits share a bootstrap; the result of each
    /// replicate is then stored.
    pub bootstrap_first: Option<usize>,
    /// Numbers of draws and chains of the posterior distribution; none: no posterior.
    pub posterior: Option<PosteriorSettings>,
    /// Seed of the random numbers of bootstrap, posterior and Monte Carlo.
    pub seed: u64,
    /// Whether to compute standard errors from the exact Hessian of the misfit too.
    pub observed_information: bool,
    /// Method of estimating the discretization error.
    pub discretization_error: Refinement,
    /// Number of fits with random inputs and noise that verify the uncertainty budget; 0: none.
    pub monte_carlo: usize,
    /// Whether to compute input sensitivities, score tests for omitted effects and undetected bias;
    /// default: where they cost little compared with the search.
    #[serde(alias = "what_if")] // old name
    pub sensitivity_analysis: Option<bool>,
    /// Plausible sizes of omitted effects by parameter name, in their units; default: sizes common
    /// in laboratories.
    pub plausible: BTreeMap<String, f64>,
    /// Convergence criterion: largest parameter step in standard errors, 0 to 0.1.
    pub tolerance: f64,
}

/// Default convergence criterion: largest parameter step at the optimum, in standard errors. A thousandth does not
/// change a reported digit.
pub(crate) const TOLERANCE: f64 = 1e-3;

impl Default for Analysis {
    /// Only the linearized discretization error, and sensitivities where they are cheap. The seed is 0, the convergence
    /// criterion 1e-3 standard errors, and no plausible size is given.
    fn default() -> Self {
        Self {
            profile: false,
            bootstrap: 0,
            bootstrap_first: None,
            posterior: None,
            seed: 0,
            observed_information: false,
            discretization_error: Refinement::default(),
            monte_carlo: 0,
            sensitivity_analysis: None,
            plausible: BTreeMap::new(),
            tolerance: TOLERANCE,
        }
    }
}

/// Method of estimating the discretization error of the parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Refinement {
    /// From the change of the simulated motion, propagated linearly to the parameters.
    #[default]
    Linearized,
    /// From fits on a finer mesh and with a finer step.
    Refitted,
    /// No estimate.
    None,
}

//! What a fit does beyond finding the parameters.

use serde::Deserialize;
use std::collections::BTreeMap;

/// Work on request, `[analysis]` in the fit file. By default only the discretisation error, which
/// costs two coarser simulations, the sensitivities to inputs, which cost a run with derivatives by them, and tests for
/// omitted effects, which cost a run of a coarse model.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Analysis {
    /// Whether 95 % intervals are computed from the profile of the likelihood too, which are right
    /// for strongly nonlinear models.
    pub profile: bool,
    /// Number of replicates of a parametric bootstrap; none when 0.
    pub bootstrap: usize,
    /// The number of its first replicate, where several fits share out a bootstrap: each says what every replicate
    /// found, and together they are one of as many replicates as all of theirs.
    pub bootstrap_first: Option<usize>,
    /// Seed of the random numbers of bootstrap and Monte Carlo.
    pub seed: u64,
    /// Whether standard errors are computed from the exact Hessian of the misfit too.
    pub observed_information: bool,
    /// How the discretisation error is found.
    pub discretization_error: Refinement,
    /// Number of fits with other known numbers and other noise, which check the budget; none when 0.
    pub monte_carlo: usize,
    /// Whether the report lists the sensitivities to inputs that are neither identified nor known with an error, effects
    /// that the scene may lack, and undetected bias; by default where these cost little beside the search.
    pub what_if: Option<bool>,
    /// How large what could hide may well be, by the place of its number in the scene, in its unit; what is not named has
    /// the size that laboratories usually have.
    pub plausible: BTreeMap<String, f64>,
    /// The search ends where another step would move no parameter by more than this part of its standard error; 0 to
    /// 0.1. Smaller ones are for comparisons with other solvers: the data tell no more.
    pub tolerance: f64,
}

/// A thousandth of a standard error is nothing that anybody sees.
pub(crate) const TOLERANCE: f64 = 1e-3;

impl Default for Analysis {
    fn default() -> Self {
        Self {
            profile: false,
            bootstrap: 0,
            bootstrap_first: None,
            seed: 0,
            observed_information: false,
            discretization_error: Refinement::default(),
            monte_carlo: 0,
            what_if: None,
            plausible: BTreeMap::new(),
            tolerance: TOLERANCE,
        }
    }
}

/// How the error of mesh and step is found in the parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Refinement {
    /// From the change of the simulated motion, carried over to the parameters linearly.
    #[default]
    Linearized,
    /// From fits with the finer mesh and the finer step.
    Refitted,
    /// The discretisation error is not estimated.
    None,
}

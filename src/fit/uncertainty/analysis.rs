//! What a fit does beyond finding the parameters.

use serde::Deserialize;

/// Work on request, `[analysis]` in the fit file. By default only the discretisation error, which
/// costs two coarser simulations.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Analysis {
    /// Whether 95 % intervals are computed from the profile of the likelihood too, which are right
    /// for strongly nonlinear models.
    pub profile: bool,
    /// Number of replicates of a parametric bootstrap; none when 0.
    pub bootstrap: usize,
    /// Seed of the bootstrap's random numbers.
    pub seed: u64,
    /// Whether standard errors are computed from the exact Hessian of the misfit too.
    pub observed_information: bool,
    /// How the discretisation error is found.
    pub discretization_error: Refinement,
}

/// How the error of mesh and step is found in the parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
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

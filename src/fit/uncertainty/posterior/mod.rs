//! Posterior distribution of the unknowns of a fit, sampled by the No-U-Turn Sampler (NUTS; Hoffman and Gelman 2014).
//!
//! `settings` are the keys of `[analysis] posterior`. `density` is the log posterior density of the unknowns on their
//! scales, by the misfit of the fit, with its exact gradient. `standardization` maps unknowns with bounds to unbounded
//! numbers and scales these by the Gauss-Newton matrix at the optimum, so that the target is nearly a standard normal
//! distribution. `sampler` draws one chain from any such target. `diagnostics` computes R-hat, effective sample size
//! and Monte Carlo error of chains. `summary` is the result for one parameter, `draws` are all draws with their table
//! as CSV, and `sampled` runs the chains for an optimum in parallel and returns both.

#[cfg(feature = "posterior")]
mod density;
#[cfg(feature = "posterior")]
mod diagnostics;
pub(crate) mod draws;
#[cfg(feature = "posterior")]
pub(crate) mod sampled;
#[cfg(feature = "posterior")]
mod sampler;
pub(crate) mod settings;
#[cfg(feature = "posterior")]
mod standardization;
pub(crate) mod summary;

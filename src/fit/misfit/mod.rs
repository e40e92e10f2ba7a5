//! The misfit between measurements and simulations, as a function of the unknowns of a fit.
//!
//! `residuals` assembles the residuals of all experiments and priors, `(simulated - measured)/sigma`, with exact
//! Jacobian (dual numbers, forward sensitivities), gradient (`adjoint_gradient`) and Hessian (`hessian`).
//! `observed_experiment` simulates one experiment, with `structure_experiment` for structures. `camera`,
//! `observation_row` and `foot_point` map simulated positions to recorded values. `residual_tests` and `ar1` test
//! residuals for white or autocorrelated noise. `initial_sigmas` (weights before the first fit) and `work` (counter
//! of the cost) serve the search.

mod adjoint_gradient;
pub(crate) mod ar1;
pub(crate) mod camera;
pub(crate) mod foot_point;
pub(crate) mod hessian;
pub(crate) mod initial_sigmas;
pub(crate) mod observation_row;
pub(crate) mod observed_experiment;
pub(crate) mod residual_tests;
pub(crate) mod residuals;
mod structure_experiment;
pub(crate) mod work;

//! The misfit between measurements and simulations, as a function of the unknowns of a fit.
//!
//! `residuals` assembles the residuals of all experiments and priors, `(simulated - measured)/sigma`. They are plain,
//! or transformed by robust loss and leverage weight, so that half their sum of squares is the misfit. Their Jacobian
//! is exact (dual numbers, forward sensitivities), as are the gradient (`adjoint_gradient`, or by the Jacobian) and
//! the Hessian (`hessian`). A simulation that fails is an error.
//!
//! `observed_experiment` simulates one experiment, with `structure_experiment` for structures. `camera` and
//! `observation_row` map simulated positions to recorded coordinates. `foot_point` returns the offset of an observed
//! point of unknown arc length from the simulated rod. `residual_tests` tests whether residuals are noise: white,
//! normal and without a trend. `ar1` is the model of autocorrelated noise, which makes white innovations of it. The
//! search uses `initial_sigmas`, the standard deviations before the first fit, and `work`, the counter of the cost.

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

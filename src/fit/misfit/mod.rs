//! The misfit between measurements and simulations: residuals, their Jacobian, gradient and Hessian, and the tests of
//! residuals.

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
pub(crate) mod work;

//! Discretization error of the parameters by mesh and time step.
//!
//! `limit` estimates the bias of the unknowns from runs on another mesh and with another step. `bias` has the correction of
//! the estimates, where the program chose mesh or step, and the error that remains. `errors` converts both to fractions of
//! the estimates for the report, and warns where given mesh or step are too coarse. `refined_residuals` has the residuals
//! extrapolated to zero element and step size, for tests.

pub(crate) mod bias;
pub(crate) mod errors;
pub(crate) mod limit;
pub(crate) mod refined_residuals;

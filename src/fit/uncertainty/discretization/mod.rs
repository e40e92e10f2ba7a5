//! Discretization error of the parameters by mesh and time step.
//!
//! Input: an optimum with its local analysis. `limit` estimates the bias of the unknowns, on their scales, from runs on
//! another mesh and with another step. `bias` has the correction of the estimates, where the program chose mesh or step
//! for all experiments, and the error that remains. `errors` converts it to fractions of the estimates for the report:
//! the whole bias by given numerics, the remaining error by chosen ones. It warns where given mesh or step are too
//! coarse. `refined_residuals` has the residuals extrapolated to zero element and step size, for tests.

pub(crate) mod bias;
pub(crate) mod errors;
pub(crate) mod limit;
pub(crate) mod refined_residuals;

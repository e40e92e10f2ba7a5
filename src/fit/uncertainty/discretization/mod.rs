//! Discretization error of the parameters by mesh and time step.
//!
//! Input: an optimum with its local analysis. `limit` estimates the bias of the unknowns, on their scales, from runs on
//! another mesh and with another step. `bias` has the correction of the estimates, where the program chose mesh or step
//! for all experiments, and the error that remains. `errors` converts it to fractions of the estimates for the report:
//! the whole bias by a given mesh or step, the remaining error by a chosen one. It warns where a given mesh or step is
//! too coarse. `refined_residuals` extrapolates the residuals to zero element and step size; the assessment of a fit
//! tests these instead where the residuals of the optimum are no noise.

pub(crate) mod bias;
pub(crate) mod errors;
pub(crate) mod limit;
pub(crate) mod refined_residuals;

//! Discretization error of the parameters by mesh and step.
//!
//! `limit` estimates the bias from runs with other numerics, `bias` has the correction and the remaining error. `errors` are
//! those of the report, with their warnings. `refined_residuals` has the residuals on finer numerics.

pub(crate) mod bias;
pub(crate) mod errors;
pub(crate) mod limit;
pub(crate) mod refined_residuals;

//! Discretization error of the parameters: bias by mesh and step, its correction, and residuals on finer numerics.

pub(crate) mod bias;
pub(crate) mod errors;
pub(crate) mod limit;
pub(crate) mod refined_residuals;

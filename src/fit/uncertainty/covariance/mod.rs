//! Covariance of the estimates at an optimum, and which parameters the data determine.
//!
//! `local_analysis` computes noise, covariance and bounds from the residuals and the Jacobian at an optimum.
//! `gauss_newton` is the covariance by the linear model, without the directions that the data do not determine.
//! `identifiability` describes these directions, `combinations` finds products of powers of two parameters that are
//! still determined, and `determined_groups` lists them with ratios to the density. `zero_bound` computes upper bounds
//! of dampings near zero, `one_sided_bound` bounds of parameters that the data limit on one side only.
//! `profile_likelihood` (95 % intervals) and `observed_information` (standard errors from the exact Hessian) run on
//! request.

pub(crate) mod combinations;
pub(crate) mod determined_groups;
pub(crate) mod gauss_newton;
pub(crate) mod identifiability;
pub(crate) mod local_analysis;
pub(crate) mod observed_information;
pub(crate) mod one_sided_bound;
pub(crate) mod profile_likelihood;
pub(crate) mod zero_bound;

//! The misfit between what was measured and what a scene does, and its derivatives.

mod backward;
pub(crate) mod camera;
pub(crate) mod comparison;
pub(crate) mod foot_point;
pub(crate) mod hessian;
pub(crate) mod memory;
pub(crate) mod noise;
pub(crate) mod residual_tests;
pub(crate) mod residuals;
pub(crate) mod seen;
pub(crate) mod work;

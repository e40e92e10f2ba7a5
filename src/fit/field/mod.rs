//! Identification of distributed parameters: lists of hundreds of values along a rod, such as the natural curvature of
//! every joint.
//!
//! Input is a [`FieldFit`]: a scene with given mesh, step and scheme, recorded motions with a stated noise, lists, and
//! optionally single parameters with a normal prior. The data do not determine hundreds of values without further
//! assumptions. So each list has a [prior](prior::SmoothPrior): a standard deviation about the values of the scene, and
//! a correlation length. The fit minimizes the negative logarithm of the posterior probability,
//!
//! ```text
//! 1/2 sum ((simulated - measured)/sigma)^2 + 1/2 sum z^2,    values = means + C z
//! ```
//!
//! where the means are the values of the scene for lists, and those of the priors for single parameters. It is
//! minimized by the Levenberg-Marquardt method without a Jacobian. Only products with the Jacobian are needed, each at
//! the cost of less than a run: with a vector by [forward derivatives](crate::dynamics::AdjointRun::along), transposed
//! by the [adjoint](crate::dynamics::AdjointRun::gradient). [Lanczos's method](crate::numerics::lanczos) finds with
//! them the few directions that the data determine. A step of any damping is solved in these directions without another
//! product. At the optimum they reduce the prior variance of every value to that of its standard error
//! (Bui-Thanh, Ghattas, Martin and Stadler 2013). Output is a [`FieldReport`].
//!
//! The search starts from these means and finds the minimum in their basin; there is no global search.

mod file;
mod plan;
mod prior;
mod report;
mod search;
mod space;

pub use plan::FieldFit;
pub use report::{FieldEstimate, FieldReport, SingleEstimate};
pub use space::Field;

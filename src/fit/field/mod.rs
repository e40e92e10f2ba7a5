//! Identification of what changes along a rod: hundreds of numbers, such as the natural curvature of every joint.
//!
//! No data say hundreds of numbers by themselves. Each list of numbers has a [prior](prior::Smooth): how far they may be from
//! what the scene says, and over which length they change. What is sought is the most probable of all,
//!
//! ```text
//! 1/2 sum ((simulated - measured)/sigma)^2 + 1/2 sum z^2,    numbers = scene + C z
//! ```
//!
//! by Levenberg-Marquardt without a Jacobian. Of it only products are needed, each at the cost of less than a run: with a
//! direction by [forward derivatives](Reversible::along), transposed by [derivatives that go
//! back](Reversible::gradient). [Lanczos's method](crate::numerics::lanczos) finds with them the few directions that the data
//! see, in which a step of any damping is solved without another product. At the optimum the same directions say how
//! far the data narrow the prior down, and with it the standard error of every number (Bui-Thanh, Ghattas, Martin and
//! Stadler 2013).
//!
//! The search starts from the scene, and finds the minimum that leads down to: no others are looked for.

mod file;
mod plan;
mod prior;
mod report;
mod search;
mod space;

pub use plan::FieldFit;
pub use report::{FieldEstimate, FieldReport, SingleEstimate};
pub use space::Field;

//! Small vibrations about a state (the equilibrium or the rest shape), `K x = omega^2 M x` with the tangent `K` and the
//! masses `M`.
//!
//! Output: the lowest modes with frequencies, shapes and kinds, and all unstable ones ([`Modes`]); natural frequencies
//! with derivatives with respect to parameters, about the equilibrium ([`NaturalFrequency`]). A mode is selected by
//! number and filter ([`ModeName`]). Frequencies are angular, in rad/s; tables also have Hz. If its name requests it,
//! the frequency of a bending mode is reduced by shear and rotary inertia of thick rods (`timoshenko`), which the model
//! omits. The reductions also serve a check of fits (`thickness`). `critical_load` has the load at which the lowest
//! mode loses its stiffness, `follower_modes` frequencies and growth rates under loads without a potential.

mod critical_load;
mod follower_modes;
mod frequencies;
mod mode;
mod modes;
mod name;
mod thickness;
mod timoshenko;

pub use critical_load::CriticalLoad;
pub use frequencies::NaturalFrequency;
pub use mode::{LinearizationPoint, Mode, ModeKind, ModePlane, Modes};
pub use name::{ModeFilter, ModeName};
pub(crate) use thickness::thickness_effects;
pub(crate) use timoshenko::LARGEST_FACTOR;

#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to LinearizationPoint")]
pub use mode::LinearizationPoint as About;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to ModeKind")]
pub use mode::ModeKind as Kind;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to ModePlane")]
pub use mode::ModePlane as Plane;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to ModeFilter")]
pub use name::ModeFilter as Among;

//! Small vibrations about a state, `K x = omega^2 M x` with the tangent `K` and the masses `M`.
//!
//! Computed are the lowest modes with their kinds ([`Modes`]), and natural frequencies with derivatives by parameters
//! ([`NaturalFrequency`]). A mode is selected by number and filter ([`ModeName`]). Corrections for shear and rotary
//! inertia of thick rods are estimated. Frequencies are in rad/s.

mod frequencies;
mod modes;
mod name;
mod thickness;

pub use frequencies::NaturalFrequency;
pub use modes::{LinearizationPoint, Mode, ModeKind, ModePlane, Modes};
pub use name::{ModeFilter, ModeName};
pub(crate) use thickness::thickness_effects;

#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to LinearizationPoint")]
pub use modes::LinearizationPoint as About;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to ModeKind")]
pub use modes::ModeKind as Kind;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to ModePlane")]
pub use modes::ModePlane as Plane;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to ModeFilter")]
pub use name::ModeFilter as Among;

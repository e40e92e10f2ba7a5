//! Where a rod comes to rest, how it lies between hands when a recording begins, whether it stays there, and what its supports exert on it.

pub(crate) mod descent;
pub(crate) mod edge_coordinates;
mod equilibrium;
mod pencil;
mod reaction;
mod recorded_start;
mod rest;
mod shear_deflection;
mod stability;
mod standing;

pub(crate) use descent::Descent;
pub use descent::EquilibriumState;
pub use equilibrium::Equilibrium;
pub(crate) use equilibrium::nodes_over;
pub(crate) use pencil::{OutOfPlaneTangent, Pencil, spatial_motion};
pub use reaction::{Reaction, Reactions};
pub(crate) use rest::CheckedEquilibrium;
pub(crate) use stability::{MAX_UNCERTAIN, Stability, UNCERTAIN_LEVELS, linear_combination};

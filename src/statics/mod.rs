//! Statics of a rod: its equilibria with their derivatives and stability, reactions of its supports, and the shape between
//! recorded ends at the start of a recording.

pub(crate) mod descent;
pub(crate) mod edge_coordinates;
mod equilibrium;
mod equilibrium_derivatives;
mod find_equilibrium;
mod lowest_eigenvalues;
mod neutral_equilibrium;
mod pencil;
mod reaction;
mod recorded_start;
mod reference_stiffness;
mod shear_deflection;
mod stability;
mod standing;

pub use descent::EquilibriumState;
pub(crate) use descent::{Descent, DescentSettings};
pub use equilibrium::Equilibrium;
pub(crate) use equilibrium_derivatives::CheckedEquilibrium;
pub(crate) use lowest_eigenvalues::PencilMode;
pub(crate) use pencil::{OutOfPlaneTangent, Pencil, spatial_motion};
pub(crate) use reaction::MotionResistances;
pub use reaction::{Reaction, Reactions};
pub(crate) use recorded_start::RecordedStart;
pub(crate) use shear_deflection::{free_part, internal_forces};
pub(crate) use stability::{MAX_UNCERTAIN, Stability, UNCERTAIN_LEVELS, linear_combination};

#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to EquilibriumState")]
pub use descent::EquilibriumState as Rest;

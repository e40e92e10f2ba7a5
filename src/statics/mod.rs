//! Statics of a rod: equilibria under the loads, `dE/dq = 0`, with derivatives by parameters, stability, and
//! reactions.
//!
//! Input: a discretized problem. Output: unknowns and frames at equilibrium, found by pseudo-transient continuation
//! (`descent`) in stages (`find_equilibrium`), for limp rods with load steps (`standing`); `equilibrium` is the
//! result for users. Long rods use `edge_coordinates`. `equilibrium_derivatives` differentiates by the implicit
//! function theorem, `neutral_equilibrium` finds motions without resistance.
//!
//! `stability` counts unstable motions by the inertia of the tangent (`pencil`), near zero by the second variation;
//! `reference_stiffness` has the thresholds. `lowest_eigenvalues` of stiffness and mass serve it and modes.
//! `reaction` has forces and moments of the supports, at rest and in motion, and `shear_deflection` the displacements
//! by shear, which the model omits. `recorded_start` has the shapes of least energy at the first two frames of a
//! recording.

pub(crate) mod descent;
pub(crate) mod edge_coordinates;
mod equilibrium;
mod equilibrium_derivatives;
mod find_equilibrium;
mod lowest_eigenvalues;
mod mesh_error;
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
pub(crate) use equilibrium_derivatives::{
    CheckedEquilibrium, EquilibriumOutputs, EquilibriumRequest,
};
pub(crate) use lowest_eigenvalues::PencilMode;
pub use mesh_error::MeshError;
pub(crate) use pencil::{OutOfPlaneTangent, Pencil, spatial_motion};
pub(crate) use reaction::ReactionModel;
pub use reaction::{Reaction, Reactions};
pub(crate) use recorded_start::{AXIAL_FACTOR, RecordedStart, marker_spring};
pub(crate) use shear_deflection::{free_part, internal_forces};
pub(crate) use stability::{MAX_UNCERTAIN, Stability, UNCERTAIN_LEVELS, linear_combination};

#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to EquilibriumState")]
pub use descent::EquilibriumState as Rest;

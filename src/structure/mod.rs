//! Structures: several rods in a plane or in space with rigid bodies and joints; their equilibria, modes and
//! simulations.
//!
//! A [`Structure`] is a [scene](crate::StructureScene) with its [assembly](crate::rod::assembly). Joints are rigid,
//! hinged (`ball` and `hinge` are the same in a plane), or have rotational springs. `definition` builds it: `plan`
//! makes the discrete choices, `placement` places the rods, `inertia` and `spatial_inertia` make the bodies,
//! `held_nodes` attaches the ends of rods, `rod_surfaces` evaluates their contacts, and `blueprint` assembles them over
//! any number type. `recorded_ends` moves ends along recorded markers; `recorded_start`, with `recorded_pose` and
//! `marker_place`, is the initial state by a recording.
//!
//! Output: [`StructureEquilibrium`] with stability (`equilibrium`), [`StructureModes`] (`modes`, rad/s), and
//! [`StructureMotion`] with its [`StructureReport`] (`structure_motion`, `structure_report`, `structure_film`,
//! `momentum`). `spring_rotation` rejects springs in space near half a turn, `structure_warnings` are warnings of
//! recordings, units and strains. Positions are a [`StructureShape`] (m); `observed_nodes` has points as weighted sums
//! of nodes. Equilibria, simulations and, in a plane, natural frequencies over dual numbers have derivatives along any
//! number of the scene. Invalid scenes are errors with file and key.

mod blueprint;
mod definition;
mod equilibrium;
mod held_nodes;
mod inertia;
mod marker_place;
mod modes;
mod momentum;
mod observed_nodes;
mod placement;
mod plan;
mod recorded_ends;
mod recorded_pose;
mod recorded_start;
mod rod_surfaces;
mod spatial_inertia;
mod spring_rotation;
mod structure_film;
mod structure_motion;
mod structure_report;
mod structure_shape;
mod structure_warnings;

pub use blueprint::AssemblyAtRest;
pub use definition::Structure;
pub use equilibrium::StructureEquilibrium;
pub use modes::{StructureMode, StructureModes};
pub use observed_nodes::{NodeMotion, StructureNodes};
pub use structure_film::StructureFilm;
pub use structure_motion::StructureMotion;
pub use structure_report::StructureReport;
pub use structure_shape::{BodyPose, RodNodes, StructureShape};

//! Structures: several rods in a plane or in space with rigid bodies and joints; their equilibria, modes and simulations.
//!
//! A [`Structure`] is a [scene](crate::StructureScene) with its [assembly](crate::rod::assembly). Joints are rigid, hinged
//! (`ball` and `hinge` are the same in a plane), or have rotational springs. Output: [`StructureEquilibrium`] with stability,
//! [`StructureModes`], and [`StructureMotion`] with its [`StructureReport`]. Derivatives along any number of the scene are
//! those of the same functions over dual numbers.

mod blueprint;
mod definition;
mod equilibrium;
mod held_nodes;
mod inertia;
mod modes;
mod momentum;
mod observed_nodes;
mod placement;
mod plan;
mod spatial_inertia;
mod structure_film;
mod structure_motion;
mod structure_shape;

pub use blueprint::AssemblyAtRest;
pub use definition::Structure;
pub use equilibrium::StructureEquilibrium;
pub use modes::{StructureMode, StructureModes};
pub use observed_nodes::{NodeMotion, StructureNodes};
pub use structure_film::StructureFilm;
pub use structure_motion::{StructureMotion, StructureReport};
pub use structure_shape::{BodyPose, RodNodes, StructureShape};

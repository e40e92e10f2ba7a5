//! Public interface of the library, names and import directions of its modules.

#[path = "../common/mod.rs"]
mod common;

mod calls;
mod direction;
mod energies;
mod files;
mod hostile_bytes;
mod measurements;
mod names;
mod own_energy;
mod point_poses;
mod point_sensors;
mod point_strains;
mod reactions;
mod runs;
mod sensor_models;
mod sensors;

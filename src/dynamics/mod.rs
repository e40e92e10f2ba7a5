//! The rod in motion: schemes, their steps, the derivatives of what they compute, and what is recorded
//! of it.

mod largest_step;
mod output;
pub mod scheme;
pub(crate) mod second_order;
pub mod sensitivity;
mod simulation;
mod start;
mod step_control;
pub mod stepper;
pub(crate) mod trajectory;

pub use output::{NodeTable, SimulationReport, shape_csv};
pub use simulation::{Simulation, StageForces, Work};
pub use trajectory::{Snapshot, Trajectory};

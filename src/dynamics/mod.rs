//! The rod in motion: schemes, their steps, the derivatives of what they compute, and what is recorded
//! of it.

pub mod adjoint;
pub mod coefficients;
mod energy_balance;
mod film;
mod follower;
mod largest_step;
mod linearization;
mod output;
pub(crate) mod record;
mod run;
pub mod sensitivity;
mod simulation;
mod start;
mod step;
mod step_control;
pub mod stepper;
mod trajectory;
mod unstable_state;
pub(crate) mod viscosity;

pub use adjoint::{Reversible, Slopes};
pub use film::{Film, Frame, Sample};
pub use linearization::{Linearization, StageForces};
pub use output::{NodeTable, SimulationReport, shape_csv};
pub use run::Snapshot;
pub use simulation::Simulation;
pub use step::Work;
pub use trajectory::Trajectory;

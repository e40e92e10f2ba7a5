//! Motion of a rod: time integration schemes, simulations and their step control, derivatives of trajectories by
//! parameters (forward and adjoint), and recorded trajectories.

pub mod adjoint;
mod bisection;
pub mod coefficients;
mod director_axes;
mod energy_balance;
mod film;
mod largest_step;
mod linearization;
mod output;
pub(crate) mod record;
mod run;
pub mod sensitivity;
mod sensitivity_carrier;
mod sensitivity_pipeline;
mod simulation;
mod start;
mod step;
mod step_control;
mod step_map;
pub mod stepper;
mod trajectory;
mod unstable_state;
pub(crate) mod viscosity;

pub use adjoint::{Reversible, TrajectorySlopes};
pub(crate) use bisection::{BisectedSteps, advance};
pub(crate) use energy_balance::warning as energy_warning;
pub use film::{Film, FilmSample, Frame};
pub use linearization::{Linearization, StageForces, StartForces};
pub use output::{NodeTable, SimulationReport, shape_csv};
pub use run::Snapshot;
pub use simulation::Simulation;
pub use step::{StepperSettings, Work};
pub(crate) use step_control::StepControl;
pub use trajectory::Trajectory;

#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to TrajectorySlopes")]
pub use adjoint::TrajectorySlopes as Slopes;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to FilmSample")]
pub use film::FilmSample as Sample;

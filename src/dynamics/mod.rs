//! Motion of a rod: time integration of `M q'' + c M q' + dE/dq = F(t)`, and derivatives of the motion by parameters.
//!
//! A prepared problem gives the initial state ([`Simulation`], made in `start`); a stepper of the scheme
//! (`stepper`, with the equations of `coefficients`) advances it. Step control (`step_control`) rejects steps that
//! gain energy or rotate edges too far, and they are bisected (`bisection`). `run` is the main loop; its `record`
//! becomes a [`Trajectory`] (positions, m, and velocities, m/s, of selected nodes). Derivatives by parameters are
//! forward sensitivities (`sensitivity`, by the linear map of a step in `step_map`), or, for the gradient of a
//! misfit, those of the adjoint ([`AdjointRun`]). [`SimulationReport`], [`NodeTable`] and [`Film`] are the output
//! for files and pages, with warnings by `energy_balance` and `unstable_state`. `largest_step` is the stability
//! limit of explicit schemes.

pub mod adjoint;
mod bisection;
pub mod coefficients;
mod director_axes;
mod energy_balance;
mod film;
mod largest_step;
mod linearization;
mod mean_stretch;
mod output;
pub(crate) mod record;
mod recorded_reactions;
mod run;
pub mod sensitivity;
mod sensitivity_carrier;
mod sensitivity_pipeline;
mod simulation;
mod start;
mod step;
mod step_control;
mod step_error;
mod step_map;
pub mod stepper;
mod trajectory;
mod unstable_state;
pub(crate) mod viscosity;

pub use adjoint::{AdjointRun, TrajectorySlopes};
pub(crate) use bisection::{BisectedSteps, advance};
pub(crate) use energy_balance::warning as energy_warning;
pub use film::{Film, FilmSample, Frame};
pub use linearization::{Linearization, StageForces, StartForces};
pub(crate) use mean_stretch::{MeanStretch, warning as mean_stretch_warning};
pub use output::{ContactForces, NodeTable, ReactionSample, SimulationReport, shape_csv};
pub use run::Snapshot;
pub use simulation::Simulation;
pub use step::{StepperSettings, Work};
pub(crate) use step_control::StepControl;
pub(crate) use step_error::StepError;
pub use trajectory::Trajectory;

#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to AdjointRun")]
pub use adjoint::AdjointRun as Reversible;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to TrajectorySlopes")]
pub use adjoint::TrajectorySlopes as Slopes;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to FilmSample")]
pub use film::FilmSample as Sample;

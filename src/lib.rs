//! rodfit
pub mod banded;
pub mod check;
pub mod energy;
mod error;
pub mod fit;
pub mod newmark;
pub mod output;
pub mod parameter;
pub mod planar_rod;
mod problem;
pub mod rod;
pub mod scalar;
pub mod scene;
pub mod sensitivity;
pub mod simulation;
pub mod state;
pub mod table;
pub mod trajectory;

pub use energy::{Analytic, Derivatives, Energy};
pub use error::Error;
pub use fit::{Fit, FitReport, Observation, Unknown};
pub use parameter::Parameter;
pub use problem::{PlanarSimulation, Problem};
pub use scalar::Scalar;
pub use scene::Scene;
pub use trajectory::{Point, Trajectory};

//! Small vibrations about a state: modes, their names, and how their frequencies change with the
//! parameters.

mod frequencies;
mod lowest;
mod modes;
mod name;
mod thickness;

pub use frequencies::NaturalFrequency;
pub use modes::{About, Kind, Mode, Modes, Plane};
pub use name::{Among, ModeName};
pub(crate) use thickness::thickness_effects;

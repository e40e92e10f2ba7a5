//! Small vibrations about a state: modes, their names, and how their frequencies change with the
//! parameters.

mod frequencies;
mod lowest;
mod modes;
mod name;
mod thickness;

pub use frequencies::NaturalFrequency;
pub use modes::{LinearizationPoint, Mode, ModeKind, ModePlane, Modes};
pub use name::{ModeFilter, ModeName};
pub(crate) use thickness::thickness_effects;

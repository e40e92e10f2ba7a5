//! Expected uncertainty of planned experiments, and optimal design of their recordings.
//!
//! With a given noise the standard errors depend on the Jacobian only, not on the residuals. So the measurements of a plan
//! get the values of a simulation at the given parameters, and are assessed as an optimum (`plan`). The simulation also has
//! the rows of the Jacobian of candidate designs: other markers, durations and frame rates of a recording
//! (`candidate_designs`). `contributions` compares the measurements, `usable_rows` leaves out chaotic parts of a motion,
//! `report` and `display` are the result.

pub(crate) mod candidate_designs;
pub(crate) mod contributions;
mod display;
pub(crate) mod plan;
pub(crate) mod report;
mod usable_rows;

//! Expected uncertainty of planned experiments, and optimal design of their recordings.
//!
//! Input: experiments with times and stated noise, but no values, and the parameters. With a given noise the standard
//! errors depend on the Jacobian only, not on the residuals. So the measurements of a plan get the values of a
//! simulation at the start values, or else those of the scenes, and are assessed as an optimum (`plan`). The
//! simulation also has the rows of the Jacobian of candidate designs: other markers, durations and frame rates of a
//! recording (`candidate_designs`). `contributions` computes the standard errors by each measurement alone and
//! without it. `usable_rows` leaves out later rows of motions with exponentially growing sensitivities. The result is
//! a `Design` (`report`), and `display` is its summary for a terminal. Measurements without stated noise and
//! structures are errors.

pub(crate) mod candidate_designs;
pub(crate) mod contributions;
mod display;
pub(crate) mod plan;
pub(crate) mod report;
mod usable_rows;

//! What an experiment would tell that is only planned.
//!
//! Data without noise that fit exactly have derivatives as any others, and with a known noise these give standard
//! errors, budgets and what could hide. So a plan is filled with what the scene does at the values that are given,
//! and assessed as an optimum is. The same simulation, with its derivatives, has the rows of the Jacobian of the
//! choices: other markers, lengths and rates of a recording are other rows.

pub(crate) mod candidate_designs;
pub(crate) mod contributions;
mod display;
pub(crate) mod plan;
pub(crate) mod report;
mod usable_rows;

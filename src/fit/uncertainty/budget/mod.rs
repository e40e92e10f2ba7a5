//! Uncertainty budget (GUM): input uncertainties, sensitivities to inputs, and the combined uncertainty.
//!
//! Inputs are numbers of the scenes that the fit does not identify, such as a length. `input_changes` lists them with
//! the change of each: one stated standard uncertainty, or 1 %. `input_directions` and `input_sensitivities` compute
//! the linear response of a fit to these changes, by derivatives. `input_errors` returns the variance of the estimates
//! by stated uncertainties, and the residuals without their most probable errors. `combined` adds the budget to every
//! estimate, and `entries` are its lines in the report.

pub(crate) mod combined;
pub(crate) mod entries;
pub(crate) mod input_changes;
pub(crate) mod input_directions;
pub(crate) mod input_errors;
pub(crate) mod input_sensitivities;

//! Uncertainty budget (GUM): input uncertainties, sensitivities to inputs, and the combined uncertainty.
//!
//! `input_changes` lists the inputs, `input_directions` and `input_sensitivities` compute the linear response of a fit to
//! them. `input_errors` propagates stated uncertainties, `combined` composes the budget, and `entries` are its lines in the
//! report.

pub(crate) mod combined;
pub(crate) mod entries;
pub(crate) mod input_changes;
pub(crate) mod input_directions;
pub(crate) mod input_errors;
pub(crate) mod input_sensitivities;

//! Uncertainty budget (GUM): input uncertainties, sensitivities to inputs, and the combined uncertainty.

pub(crate) mod combined;
pub(crate) mod entries;
pub(crate) mod input_changes;
pub(crate) mod input_directions;
pub(crate) mod input_errors;
pub(crate) mod input_sensitivities;

//! Model discrepancy: omitted effects, undetected bias, validity of the model, and predictions of data.

pub(crate) mod findings;
pub(crate) mod fit_statistics;
pub(crate) mod free_run;
pub(crate) mod mode_numbers;
pub(crate) mod omitted_effects;
pub(crate) mod prediction;
pub(crate) mod ranking;
pub(crate) mod rod_sizes;
pub(crate) mod scene_notes;
pub(crate) mod score_tests;
pub(crate) mod slenderness;
pub(crate) mod tested_effects;
pub(crate) mod undetected_bias;

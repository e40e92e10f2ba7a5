//! Model discrepancy: effects that the model omits, their bias of the estimates, the validity of the model, and predictions.
//!
//! `score_tests` tests the residuals for 20 `omitted_effects` and ranks them (`ranking`); `undetected_bias` bounds those that
//! the data do not exclude. `slenderness`, `mode_numbers` and `scene_notes` check the assumptions of the model. `prediction`
//! and `free_run` compare the fit with validation data and recordings. `findings` has the results in the report.

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

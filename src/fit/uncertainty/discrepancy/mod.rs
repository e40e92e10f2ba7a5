//! Model discrepancy: effects that the model omits, their bias of the estimates, the validity of the model, and
//! predictions.
//!
//! Input: the optimum of a fit with its local analysis and estimates. `score_tests` tests whether omitted effects
//! explain the residuals: the `omitted_effects` of one rod, the `structure_effects` of a structure of rods, the
//! `load_cell_effects` of measured moments, the `sensor_gain_effects` of sensors, the `gravity_effects`, or the
//! `dial_gauge_effects` of load-deflection curves. `experiment_effect` is the interface of all but the first.
//! `tested_effects` has their plausible sizes, from `rod_sizes`. `ranking` keeps the tests of the first three ranks.
//! `undetected_bias` estimates the bias of the parameters by effects that the data do not exclude; tests and biases use
//! `fit_statistics`. `slenderness` checks for shear deformation and rotary inertia, `mode_numbers` whether other
//! numbers of the measured modes fit as well, and `scene_notes` for implausible units, missing gravity and large
//! strains. `prediction` compares the fit with validation data, and `free_run` with recordings whose ends drive the
//! rod. `findings` has the tests and biases as the report lists them. Tests and checks add warnings or notes to the
//! assessment of a fit.

pub(crate) mod dial_gauge_effects;
mod experiment_effect;
pub(crate) mod findings;
pub(crate) mod fit_statistics;
pub(crate) mod free_run;
mod gravity_effects;
pub(crate) mod load_cell_effects;
pub(crate) mod mode_numbers;
pub(crate) mod omitted_effects;
pub(crate) mod prediction;
pub(crate) mod ranking;
pub(crate) mod rod_sizes;
pub(crate) mod scene_notes;
pub(crate) mod score_tests;
mod sensor_gain_effects;
pub(crate) mod slenderness;
pub(crate) mod structure_effects;
pub(crate) mod tested_effects;
pub(crate) mod undetected_bias;

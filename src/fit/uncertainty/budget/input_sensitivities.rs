//! Sensitivities of the estimates to inputs: numbers of the scenes that the fit does not identify.
//!
//! The uncertainty budget and the sensitivities to +1 % are one computation. It is the derivative of a refit, by the
//! implicit function theorem with the Gauss-Newton Hessian,
//!
//! ```text
//! dx/dk = -(J'WJ)^-1 J'W dr/dk
//! ```
//!
//! for unknowns `x` on their scales, residuals `r` with the Jacobian `J` and the squared weights `W`, and an input `k`.
//! [`InputSensitivities::new`] computes the responses of an optimum to one standard uncertainty of each known input, in
//! one run with derivatives. On request it includes those to +1 % of every other input. A run that fails is an error;
//! unknowns that are not identified have no response. The responses to known inputs are a part of the budget. `add_to`
//! adds those to +1 % to the estimates, unless they are [`NEGLIGIBLE`], and `responses_to_density` returns the
//! derivatives by the logarithm of the density. [`are_unstated_wanted`] returns whether inputs without a stated
//! uncertainty are included: as the options of the fit request, or without a request if the run is cheap compared with
//! the search ([`MAX_RELATIVE_COST`]).

use crate::error::Error;
use crate::fit::known::Known;
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::budget::entries::InputSensitivity;
use crate::fit::uncertainty::budget::input_changes::{InputChange, unstated_inputs};
use crate::fit::uncertainty::budget::input_directions::InputDirections;
use crate::fit::uncertainty::covariance::gauss_newton::LinearFit;
use crate::fit::uncertainty::estimate::Estimate;
use crate::numerics::total_order;
use nalgebra::DMatrix;
use std::cmp::Reverse;

/// Instructions of a derivative by one parameter over those of the run that it belongs to (measured on the shipped
/// cantilever, 200 elements).
const COST_OF_DERIVATIVE: f64 = 0.25;
/// Cost of the sensitivities to unstated inputs, over the simulations of the search, above which they are skipped
/// unless requested. A search with derivatives costs about twice its count of simulations.
const MAX_RELATIVE_COST: f64 = 1.5;
/// Change of an estimate, over 1 % of it (of its size, where it may be negative), below which a sensitivity is not
/// listed.
const NEGLIGIBLE: f64 = 1e-3;

/// Responses of the unknowns, on their scales, to changes of the inputs.
pub(crate) struct InputSensitivities {
    /// One standard uncertainty of every known input.
    pub known: Vec<InputChange>,
    /// One per cent of every other input.
    unstated: Vec<InputChange>,
    /// Responses of every unknown, on its scale, to each change, to the known inputs first; none for unidentified
    /// unknowns.
    pub responses: Vec<Vec<Option<f64>>>,
    /// The part of each change of the weighted residuals that the unknowns cannot follow, a column each.
    pub orthogonal: DMatrix<f64>,
}

impl InputSensitivities {
    /// Computes the responses by one run of the full model with derivatives by the unknowns and the inputs: first all
    /// `knowns`, then unstated inputs if `with_unstated`. Without any input there is no run, and there are no
    /// responses. The linear `fit` has the identified unknowns and the weights. Error: the simulation fails.
    pub fn new(
        fitted: Fitted,
        fit: &LinearFit,
        knowns: &[Known],
        with_unstated: bool,
    ) -> Result<Self, Error> {
        let Fitted { search, optimum } = fitted;
        let experiments = search.experiments;
        let known: Vec<InputChange> =
            knowns.iter().map(|known| InputChange::of_known(experiments, known)).collect();
        let unstated = if with_unstated { unstated_inputs(search, knowns) } else { Vec::new() };
        let changes: Vec<&InputChange> = known.iter().chain(&unstated).collect();
        // Without inputs no run is needed.
        let (responses, orthogonal) = match changes.is_empty() {
            true => (Vec::new(), DMatrix::zeros(optimum.residuals.len(), 0)),
            false => {
                let directions = InputDirections::new(fitted, experiments, fit, &changes)?;
                (directions.responses(), directions.orthogonal_changes())
            }
        };
        Ok(Self { known, unstated, responses, orthogonal })
    }

    /// Derivatives of the unknowns, on their scales (logarithms of positive parameters), by the logarithm of the
    /// density of all experiments, one entry per unknown (`None` if it is not identified). `None` for all where the
    /// density of some experiment is identified or its sensitivity was not computed, or where no input changes the
    /// density of all experiments by the same fraction.
    pub fn responses_to_density(&self, search: &Search) -> Option<Vec<Option<f64>>> {
        // The density may be a known input or an unstated one.
        let mut changes = self.known.iter().chain(&self.unstated).zip(&self.responses);
        let (change, responses) = changes.find_map(|(change, responses)| {
            Some((change.relative_density_change(search.experiments)?, responses))
        })?;
        // A response over the relative change that causes it is the logarithmic derivative.
        Some(responses.iter().map(|response| Some((*response)? / change)).collect())
    }

    /// Sets the sensitivities to +1 % of each unstated input in the estimates with a standard error, the largest
    /// absolute change first. Changes up to [`NEGLIGIBLE`] of 1 % of the estimate of a positive parameter, or of the
    /// absolute value of that of another one, are left out.
    pub fn add_to(&self, search: &Search, estimates: &mut [Estimate]) {
        for (j, (unknown, estimate)) in search.unknowns.iter().zip(estimates).enumerate() {
            let Some(value) = estimate.value.filter(|_| estimate.std_error.is_some()) else {
                continue;
            };
            // A parameter that may be negative may be near zero: its change is then no fraction of it.
            let is_positive = unknown.parameter.is_positive();
            let size = if is_positive { 0.01 * value } else { value.abs() };
            let responses = &self.responses[self.known.len()..];
            let sensitivity = |(input, responses): (&InputChange, &Vec<Option<f64>>)| {
                let (source, response) = (input.source.clone(), responses[j]?);
                let change = response * unknown.slope(value);
                let relative = is_positive.then_some(response);
                (change.abs() > NEGLIGIBLE * size).then_some(InputSensitivity {
                    source,
                    value: input.value(),
                    unit: input.unit().into(),
                    change,
                    relative,
                })
            };
            let mut all: Vec<InputSensitivity> =
                self.unstated.iter().zip(responses).filter_map(sensitivity).collect();
            all.sort_by_cached_key(|x| Reverse(total_order(x.change.abs())));
            estimate.input_sensitivities = all;
        }
    }
}

/// Whether the sensitivities to unstated inputs are computed: as the analysis requests, or without a request if their
/// cost in simulations is at most [`MAX_RELATIVE_COST`] times `spent`, the cost of the search. The cost is 1 for the
/// run, and [`COST_OF_DERIVATIVE`] for each unknown and input. False after an interruption.
pub(crate) fn are_unstated_wanted(
    search: &Search,
    analysis: &Analysis,
    knowns: &[Known],
    spent: f64,
) -> bool {
    let derivatives = search.unknowns.len() + unstated_inputs(search, knowns).len() + knowns.len();
    // One run, and a part of a run for each derivative.
    let cost = 1.0 + COST_OF_DERIVATIVE * derivatives as f64;
    let is_cheap = cost <= MAX_RELATIVE_COST * spent;
    !search.is_stopped() && analysis.sensitivity_analysis.unwrap_or(is_cheap)
}

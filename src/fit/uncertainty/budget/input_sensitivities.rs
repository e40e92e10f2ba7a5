//! Sensitivities of the estimates to inputs: numbers of the scenes that the fit does not identify.
//!
//! The budget of uncertainty and the lines "1 % of" are one computation, so an input has one sensitivity. It is the
//! derivative of a refit, by the implicit function theorem with the Gauss-Newton Hessian,
//!
//! ```text
//! dp/dk = -(J'WJ)^-1 J'W dr/dk
//! ```
//!
//! at the optimum, with the weights, mesh and step of the fit. A coarse mesh will not do: where a long record has fixed
//! the phase of a vibration, the errors of coarse derivatives are as large as the sensitivities themselves.

use crate::error::Error;
use crate::fit::known::Known;
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::budget::input_changes::{
    Change, InputDirections, per_cents, unstated_inputs,
};
use crate::fit::uncertainty::covariance::gauss_newton::LinearFit;
use crate::fit::uncertainty::estimate::Estimate;
use nalgebra::DMatrix;

/// Instructions of a derivative by one parameter over those of the run that it belongs to (measured on the shipped
/// cantilever, 200 elements).
const COST_OF_DERIVATIVE: f64 = 0.25;
/// The sensitivities to unstated inputs are skipped where they would cost more than so many times the simulations of
/// the search, unless the fit asks for them. A search with derivatives costs about twice its count of simulations.
const MAX_RELATIVE_COST: f64 = 1.5;

/// Responses of the unknowns, on their scales, to changes of the inputs.
pub(crate) struct InputSensitivities {
    /// One standard uncertainty of every known input.
    known: Vec<Change>,
    /// One per cent of every other input.
    unstated: Vec<Change>,
    /// Responses to all of them, the known ones first.
    responses: Vec<Vec<Option<f64>>>,
    /// The part of each change of the weighted residuals that the unknowns cannot follow.
    unfollowed: DMatrix<f64>,
}

impl InputSensitivities {
    /// By one run of the full model with derivatives by the unknowns, the known inputs, and the unstated ones
    /// if `with_unstated`.
    pub fn new(
        fitted: Fitted,
        fit: &LinearFit,
        knowns: &[Known],
        with_unstated: bool,
    ) -> Result<Self, Error> {
        let Fitted { search, optimum } = fitted;
        let experiments = search.experiments;
        let known: Vec<Change> =
            knowns.iter().map(|known| Change::of_known(experiments, known)).collect();
        let unstated = if with_unstated { unstated_inputs(search, knowns) } else { Vec::new() };
        let changes: Vec<&Change> = known.iter().chain(&unstated).collect();
        if changes.is_empty() {
            let unfollowed = DMatrix::zeros(optimum.residuals.len(), 0);
            return Ok(Self { known, unstated, responses: Vec::new(), unfollowed });
        }
        let directions = InputDirections::of(fitted, experiments, fit, &changes)?;
        let [_, unfollowed] = directions.unfollowed();
        let responses = directions.answers();
        Ok(Self { known, unstated, responses, unfollowed })
    }

    /// Of the known inputs: the value that the experiments of each share, if they do.
    pub fn known_values(&self) -> Vec<Option<f64>> {
        self.known.iter().map(Change::value).collect()
    }

    /// Responses of every unknown to one standard uncertainty of every known input.
    pub fn known_responses(&self) -> &[Vec<Option<f64>>] {
        &self.responses[..self.known.len()]
    }

    /// The change of the weighted residuals by one standard uncertainty of every known input that the unknowns
    /// cannot follow.
    pub fn known_unfollowed(&self) -> DMatrix<f64> {
        self.unfollowed.columns(0, self.known.len()).into_owned()
    }

    /// Logarithmic derivatives of the unknowns, on their scales, by the density of all experiments; none where that is
    /// no input, or its sensitivities were not computed.
    pub fn responses_to_density(&self, search: &Search) -> Option<Vec<Option<f64>>> {
        let mut changes = self.known.iter().chain(&self.unstated).zip(&self.responses);
        let (change, responses) = changes.find_map(|(change, responses)| {
            Some((change.of_density(search.experiments)?, responses))
        })?;
        Some(responses.iter().map(|response| Some((*response)? / change)).collect())
    }

    /// Every estimate takes its sensitivities to the unstated inputs, the largest first.
    pub fn give_per_cents(&self, search: &Search, estimates: &mut [Estimate]) {
        let responses = &self.responses[self.known.len()..];
        let all = per_cents(search, estimates, (&self.unstated, responses));
        estimates.iter_mut().zip(all).for_each(|(e, per_cents)| e.input_sensitivities = per_cents);
    }
}

/// Whether the sensitivities to unstated inputs are computed, after a search of so many simulations.
pub(crate) fn are_unstated_wanted(
    search: &Search,
    analysis: &Analysis,
    knowns: &[Known],
    spent: f64,
) -> bool {
    let derivatives = search.unknowns.len() + unstated_inputs(search, knowns).len() + knowns.len();
    let cost = 1.0 + COST_OF_DERIVATIVE * derivatives as f64;
    match analysis.sensitivity_analysis {
        _ if search.is_stopped() => false,
        Some(asked) => asked,
        None => cost <= MAX_RELATIVE_COST * spent,
    }
}

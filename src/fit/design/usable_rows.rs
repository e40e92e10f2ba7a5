//! Rows of a plan whose linear error is usable: those before sensitivities grow exponentially.

use crate::code::Code;
use crate::fit::design::candidate_designs::CandidateDesigns;
use crate::fit::design::report::{Advice, DesignVariable};
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::sensitivity_growth::{SensitivityGrowth, growths, leverage_weights};
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::fit::unknown::Unknown;

/// The growth of the sensitivities in a plan, and the rows that it spoils.
pub(crate) struct UsableRows {
    growths: Vec<Option<SensitivityGrowth>>,
    /// 1 of a usable row and 0 of another; empty where all are usable.
    weights: Vec<f64>,
}

impl UsableRows {
    /// Of experiments that have all choices beside what is planned, with the residuals and their derivatives.
    pub fn new(
        mut experiments: Vec<Experiment>,
        (unknowns, sigmas): (&[Unknown], &[f64]),
        residuals: &[f64],
        rows: &[Vec<f64>],
    ) -> Self {
        // The recorded positions become those of the simulation, whose speeds count.
        let mut rest = residuals.iter();
        let mut sigma = sigmas.iter();
        for measurement in experiments.iter_mut().flat_map(|e| &mut e.measurements) {
            let of_values = measurement.sigmas(sigma.next().copied().unwrap_or(1.0));
            let errors = rest.by_ref().take(measurement.values()).zip(of_values);
            let values = measurement.data.values_mut();
            values.into_iter().zip(errors).for_each(|(value, (r, s))| *value += r * s);
        }
        let growths = growths(&experiments, unknowns, sigmas, rows);
        let mut weights = leverage_weights(&experiments, &growths);
        weights.iter_mut().for_each(|w| *w = if *w < 1.0 { 0.0 } else { 1.0 });
        if !weights.is_empty() {
            // Priors are usable.
            weights.resize(rows.len(), 1.0);
        }
        Self { growths, weights }
    }

    /// Leaves out the rows that are not usable: without derivatives they constrain nothing.
    pub fn leave_out_others(&self, rows: &mut [Vec<f64>]) {
        for (row, weight) in rows.iter_mut().zip(&self.weights) {
            row.iter_mut().for_each(|d| *d *= weight);
        }
    }

    /// The weights of the planned rows; empty where all are 1.
    pub fn weights(&self, choices: &CandidateDesigns) -> Vec<f64> {
        if self.weights.is_empty() { Vec::new() } else { choices.planned(&self.weights) }
    }

    /// Warns of the rows that are left out.
    pub fn warn(&self, warnings: &mut Warnings) {
        for growth in self.growths.iter().flatten() {
            let words = growth.describe(
                "later values are left out, and no choice with them is marked as the best",
            );
            warnings.add(Severity::Numerics, Code::GrowingSensitivity, words);
        }
    }

    /// No choice is the best one whose record goes on after the usable time: rows that are left out would make a longer
    /// record as good as a shorter one.
    pub fn withdraw_marks(&self, planned: &[Experiment], advice: &mut [Advice]) {
        for (experiment, growth) in planned.iter().zip(&self.growths) {
            let Some(onset) = growth.as_ref().map(|growth| growth.onset) else { continue };
            let plan_is_usable = experiment.duration() <= onset;
            let own = advice.iter_mut().filter(|a| {
                let mut labels = experiment.measurements.iter().map(|m| experiment.label(m));
                a.observation == experiment.name || labels.any(|label| label == a.observation)
            });
            for advice in own {
                let is_length = advice.variable == DesignVariable::Duration;
                for choice in &mut advice.choices {
                    choice.best &= plan_is_usable && !(is_length && choice.value > onset);
                }
            }
        }
    }
}

//! Rows of a plan for which the linear error model holds: those before sensitivities grow exponentially.
//!
//! In a chaotic motion the derivatives by the parameters grow exponentially, and with them the errors of the model.
//! [`UsableRows::new`] finds the onset of the growth in each experiment from the rows of the Jacobian and the simulated
//! speeds. Rows of its motions after the onset (growth weight below 1) are not usable; all others and those of priors
//! are. `remove_others` sets the former to zero, `weights` returns 0 and 1, and `warn` adds a warning of the severity
//! `Numerics` per such experiment. `withdraw_marks` withdraws recommendations of durations after the onset, and all of
//! an experiment whose planned duration is longer. The assessment of a plan uses them.

use crate::code::Code;
use crate::fit::design::candidate_designs::CandidateDesigns;
use crate::fit::design::report::{Advice, DesignVariable};
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::sensitivity_growth::{SensitivityGrowth, growth_weights, growths};
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::fit::unknown::Unknown;

/// The growth of the sensitivities in a plan, and the usable rows.
pub(crate) struct UsableRows {
    /// One per experiment; none without growth.
    growths: Vec<Option<SensitivityGrowth>>,
    /// 1 of a usable row and 0 of another; empty where all are usable.
    weights: Vec<f64>,
}

/// Adds the `residuals`, in units of the `sigmas` of the measurements, to the values of all measurements of
/// `experiments`, in their order, in place. Residuals of priors at the end are left out.
pub(crate) fn add_residuals(experiments: &mut [Experiment], sigmas: &[f64], residuals: &[f64]) {
    let mut rest = residuals;
    let measurements = experiments.iter_mut().flat_map(|e| &mut e.measurements);
    for (measurement, sigma) in measurements.zip(sigmas) {
        let (own, others) = rest.split_at(measurement.values());
        measurement.add_residuals(own, *sigma);
        rest = others;
    }
}

impl UsableRows {
    /// The usable rows of experiments with all candidate recordings, from the growth of their sensitivities. `sigmas`
    /// has the standard deviation of each measurement in its unit. `residuals` and `rows` are the unweighted residuals
    /// of the simulation, in sigmas, and their Jacobian. Rows whose growth weight is below 1, those after the onset,
    /// are not usable; all others and those of priors are.
    pub fn new(
        mut experiments: Vec<Experiment>,
        unknowns: &[Unknown],
        sigmas: &[f64],
        residuals: &[f64],
        rows: &[Vec<f64>],
    ) -> Self {
        // The growth is compared with the speeds of the simulation.
        add_residuals(&mut experiments, sigmas, residuals);
        let growths = growths(&experiments, unknowns, sigmas, rows);
        let mut weights = growth_weights(&experiments, &growths);
        // A plan has no fit that could down-weight rows gradually: rows are usable or not.
        weights.iter_mut().for_each(|w| *w = if *w < 1.0 { 0.0 } else { 1.0 });
        if !weights.is_empty() {
            // The rows of the priors follow.
            weights.resize(rows.len(), 1.0);
        }
        Self { growths, weights }
    }

    /// Sets the `rows` of the Jacobian that are not usable to zero, so that they do not constrain any unknown.
    pub fn remove_others(&self, rows: &mut [Vec<f64>]) {
        for (row, weight) in rows.iter_mut().zip(&self.weights) {
            row.iter_mut().for_each(|d| *d *= weight);
        }
    }

    /// The weights of the planned rows and of the priors, 0 or 1; empty where all are 1.
    pub fn weights(&self, designs: &CandidateDesigns) -> Vec<f64> {
        if self.weights.is_empty() { Vec::new() } else { designs.planned(&self.weights) }
    }

    /// Adds a warning of the severity `Numerics` for each experiment whose sensitivities grow exponentially: later
    /// values are left out.
    pub fn warn(&self, warnings: &mut Warnings) {
        for growth in self.growths.iter().flatten() {
            let words = growth.describe(
                "later values are left out, and no choice that needs them is recommended",
            );
            warnings.add(Severity::Numerics, Code::GrowingSensitivity, words);
        }
    }

    /// Removes the mark `best` of durations after the onset of the growth in their experiment. If the plan itself is
    /// longer than the onset, it removes all marks of its recordings: with removed rows a longer record is as good as a
    /// shorter one.
    pub fn withdraw_marks(&self, planned: &[Experiment], advice: &mut [Advice]) {
        for (experiment, growth) in planned.iter().zip(&self.growths) {
            let Some(onset) = growth.as_ref().map(|growth| growth.onset) else { continue };
            let plan_is_usable = experiment.duration() <= onset;
            let own = advice.iter_mut().filter(|a| {
                let mut labels = experiment.measurements.iter().map(|m| experiment.label(m));
                a.observation == experiment.name || labels.any(|label| label == a.observation)
            });
            for advice in own {
                // Durations up to the onset stay recommended where the plan itself ends before it.
                let is_length = advice.variable == DesignVariable::Duration;
                for choice in &mut advice.choices {
                    choice.best &= plan_is_usable && !(is_length && choice.value > onset);
                }
            }
        }
    }
}

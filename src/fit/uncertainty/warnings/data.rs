//! Warnings about the data and the time steps of a fit: defects of recordings, values with a high leverage, and
//! unsuitable steps.
//!
//! Each function receives a result of an earlier stage, or the experiments, and adds its warnings to the list, as
//! *finding. consequence. action.* with a code. Halved steps (unless the fit converged to residuals of noise) and too
//! large steps have the severity `Numerics`, repeated frames `Misfit`, angles without a unit `Ambiguous`; these lower
//! the grade. All others are notes: constant coordinates, defects of recordings that move supports and of samples of
//! signals, exponentially growing sensitivities, and leverage weights below 1 (unless growing sensitivities are their
//! cause).

use crate::code::Code;
use crate::fit::measurement::constant_axes::ConstantAxis;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::measurement::repeated_frames::RepeatedFrames;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use std::path::Path;

/// Adds a warning of the severity `Numerics` of an optimum that is inexact because the integrator halved time steps
/// there, which makes the misfit discontinuous. Nothing is added where the fit converged and its residuals are noise.
pub(crate) fn halved_steps(Fitted { search, optimum }: Fitted, warnings: &mut Warnings) {
    let is_reached = optimum.converged && search.is_noise(optimum);
    // At a converged optimum with residuals of noise the jumps did no harm.
    if optimum.halved && !is_reached {
        // The scenes of all experiments must support the advised scheme.
        let advice =
            search.experiments.iter().map(|e| e.problem.scene().or_energy_conserving_scheme());
        let text = format!(
            "the integrator halved some time steps, and which ones depends on the parameters. The misfit has jumps, \
             and the optimum is inexact. Use a smaller time.step{}",
            advice.min_by_key(|advice| advice.len()).unwrap_or_default()
        );
        warnings.add(Severity::Numerics, Code::HalvedSteps, text);
    }
}

/// Adds warnings of the severity `Numerics` for every experiment with a measured motion: for each motion of a support
/// and each signal that its time step resolves poorly, and for a step longer than the simulation.
pub(crate) fn steps_too_large(experiments: &[Experiment], warnings: &mut Warnings) {
    for experiment in experiments.iter().filter(|e| e.moves()) {
        for (code, text) in experiment.problem.step_warnings() {
            let text = experiment.key(&text);
            warnings.add_for(&experiment.name, Severity::Numerics, code, text);
        }
    }
}

/// Adds a note for each coordinate with one value only, which is left out of the fit.
pub(crate) fn constant_axes(axes: &[ConstantAxis], warnings: &mut Warnings) {
    for ConstantAxis { observation, axis, value, samples } in axes {
        let text = format!(
            "{observation}, {axis}: all {samples} values are {value} m. The coordinate is left out of the fit and \
             of the noise estimate. Leave the column out of the file"
        );
        warnings.add_for("", Severity::Note, Code::ConstantAxis, text);
    }
}

/// Adds a warning of the severity `Ambiguous` for each file whose angles have no unit and were read as rad: small
/// angles in degrees cannot be distinguished from rad, and change the estimates by orders of magnitude.
pub(crate) fn assumed_units(experiments: &[Experiment], warnings: &mut Warnings) {
    let mut files: Vec<&Path> = Vec::new();
    for (experiment, measurement) in all(experiments).filter(|(_, own)| !own.planned()) {
        let (Some(column), Some(file)) =
            (&measurement.header.assumed_unit, &measurement.header.source)
        else {
            continue;
        };
        if files.contains(&&**file) {
            continue;
        }
        files.push(file);
        let text = format!(
            "{}: the column {column} has no unit and was read as rad. If it is in degrees, the estimates are wrong by \
             orders of magnitude. State {column}[rad] or {column}[deg] in the header",
            experiment.label(measurement)
        );
        warnings.add_for(&experiment.name, Severity::Ambiguous, Code::AssumedUnit, text);
    }
}

/// Adds a warning of a misfit for each observation whose frames repeat the one before. That happens in a video that was
/// converted to a higher frame rate.
pub(crate) fn repeated_frames(found: &[RepeatedFrames], warnings: &mut Warnings) {
    for RepeatedFrames { observation, repeated, frames } in found {
        let text = format!(
            "{observation}: {repeated} of {frames} frames repeat the one before, as in a video that was converted to a higher \
             frame rate. Repeated positions belong to earlier times and bias the estimates. Keep one frame of each"
        );
        warnings.add_for("", Severity::Misfit, Code::RepeatedFrames, text);
    }
}

/// Adds notes on defects of the recordings that move supports, and of the samples of signals. Lost frames, jumps and
/// exchanged labels of several experiments may be summarized in the report.
pub(crate) fn recording_defects(experiments: &[Experiment], warnings: &mut Warnings) {
    for experiment in experiments {
        for (code, text) in experiment.problem.recording_warnings() {
            match code {
                // Defects that many recordings share are summarized.
                Code::LostFrames | Code::Glitches | Code::SwappedLabels => {
                    warnings.add_for(&experiment.name, Severity::Note, code, text);
                }
                _ => warnings.add(Severity::Note, code, text),
            }
        }
    }
}

/// Adds a note for each experiment whose derivatives by the parameters grow exponentially (chaotic motion), with the
/// number of later positions that are down-weighted. Nothing is added where the search has no such weights.
pub(crate) fn growing_sensitivities(Fitted { search, optimum }: Fitted, warnings: &mut Warnings) {
    if search.growth_weights().is_empty() {
        return;
    }
    for growth in search.growths(optimum).into_iter().flatten() {
        let (later, values) = (growth.later, growth.values);
        let consequence = format!("the {later} of {values} later positions are down-weighted");
        warnings.add(Severity::Note, Code::GrowingSensitivity, growth.describe(&consequence));
    }
}

/// Adds one note on the number of values with a leverage weight below 1, in total and by experiment: values that change
/// with the parameters much more than is usual are down-weighted. Nothing is added without any. Nothing is added either
/// where exponentially growing sensitivities are the reason, which have a note of their own.
pub(crate) fn high_leverage(fitted: Fitted, warnings: &mut Warnings) {
    let search = fitted.search;
    let count_in = |experiment: &Experiment| {
        let own = fitted.measured().filter(|own| std::ptr::eq(own.experiment, experiment));
        let rows = own.flat_map(|MeasuredResiduals { rows, .. }| rows);
        rows.filter(|row| search.leverage_weight(*row) < 1.0).count()
    };
    // The number of down-weighted values of each experiment, and of all.
    let counts: Vec<usize> = search.experiments.iter().map(count_in).collect();
    let total: usize = counts.iter().sum();
    // Weights of growing sensitivities have a note of their own.
    if total == 0 || !search.growth_weights().is_empty() {
        return;
    }
    let named = counts.iter().zip(search.experiments);
    let named = named.filter(|(count, experiment)| **count > 0 && !experiment.name.is_empty());
    let named: Vec<String> = named.map(|(count, e)| format!("{count} of {}", e.name)).collect();
    let places = if named.is_empty() { String::new() } else { format!(" ({})", named.join(", ")) };
    let text = format!(
        "{total} of {} values{places} have a high leverage: they change with the parameters more than 10 times as \
         much as is usual. They are down-weighted by that factor. Check them: the model is least accurate where the rod moves fastest",
        search.leverage_weights.len()
    );
    warnings.add(Severity::Note, Code::HighLeverage, text);
}

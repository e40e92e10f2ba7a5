//! What an optimum is worth: everything that is computed about it.

use crate::code::Code;
use crate::error::Error;
use crate::fit::known::Known;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::residual_tests::ResidualTests;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::budget::combined::{BudgetInputs, budgeted};
use crate::fit::uncertainty::budget::input_errors::InputErrors;
use crate::fit::uncertainty::budget::input_sensitivities::{
    InputSensitivities, are_unstated_wanted,
};
use crate::fit::uncertainty::covariance::determined_groups::{
    DeterminedGroup, determined_combinations, determined_groups,
};
use crate::fit::uncertainty::covariance::gauss_newton::{Covariance, LinearFit};
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::covariance::observed_information;
use crate::fit::uncertainty::covariance::profile_likelihood::{self, Profile};
use crate::fit::uncertainty::discrepancy::free_run::RecordingErrors;
use crate::fit::uncertainty::discrepancy::mode_numbers::check_mode_numbers;
use crate::fit::uncertainty::discrepancy::prediction::{Prediction, predictions};
use crate::fit::uncertainty::discrepancy::scene_notes::scene_notes;
use crate::fit::uncertainty::discrepancy::score_tests::{
    FitStatistics, ModelDiscrepancy, assess_model_discrepancy, warn_of_omitted_effects,
};
use crate::fit::uncertainty::discrepancy::slenderness::check_slenderness;
use crate::fit::uncertainty::discretization::{DiscretizationError, errors_of, shifts};
use crate::fit::uncertainty::estimate::{Estimate, estimates};
use crate::fit::uncertainty::finer::Finer;
use crate::fit::uncertainty::grade::{Severity, Warnings};
use crate::fit::uncertainty::noise::noise_scale::NoiseScale;
use crate::fit::uncertainty::noise::residual_noise::{LossEffect, Noise, losses, residual_rms};
use crate::fit::uncertainty::resampling::bootstrap::{self, Draws, Replicates};
use crate::fit::uncertainty::resampling::cluster_jackknife::{
    cluster_jackknife, compares_experiments,
};
use crate::fit::uncertainty::shifts::Shifts;
use crate::fit::uncertainty::warnings::{
    against_noise_scale, against_priors, bounded_from_one_side, bounds_reached, faulty_recordings,
    growing_sensitivities, high_leverage, is_noise, jumps, stated_sigmas, steps_too_large,
    test_residuals, unexplained,
};

/// What is known of the parameters, and what speaks against it.
#[derive(Default)]
pub(crate) struct Assessment {
    pub estimates: Vec<Estimate>,
    /// None without an optimum.
    pub covariance: Option<Covariance>,
    pub residual_rms: f64,
    /// The noise of each measurement, in its unit.
    pub sigma: Vec<f64>,
    pub losses: Vec<LossEffect>,
    pub discretization: Vec<DiscretizationError>,
    pub residual_tests: Vec<ResidualTests>,
    pub noise_scale: Vec<NoiseScale>,
    pub predictions: Vec<Prediction>,
    pub discrepancy: ModelDiscrepancy,
    pub determined_groups: Vec<DeterminedGroup>,
    pub recordings: Option<RecordingErrors>,
    pub profiles: Vec<Profile>,
    pub warnings: Warnings,
}

/// How far the unknowns of an optimum are from those of the continuum, where it is looked for; what keeps that
/// from being known is a warning.
pub(crate) fn shifts_of(
    fitted: Fitted,
    local: &LocalAnalysis,
    analysis: &Analysis,
    warnings: &mut Warnings,
) -> Result<Option<Shifts>, Error> {
    let Fitted { search, optimum } = fitted;
    // Rounding errors are neither noise nor made by another mesh; as few values as unknowns leave
    // nothing else.
    if optimum.residuals.len() != search.unknowns.len() && search.is_rounding(optimum) {
        return Ok(None);
    }
    let around = (&local.covariance, &local.noise.weights[..]);
    match shifts(fitted, around, analysis.discretization_error) {
        Err(Error::Interrupted) => Err(Error::Interrupted),
        Err(error) => {
            let words = format!(
                "the discretization error is unknown: a run on another mesh failed ({error}). The \
                         intervals do not include it. Leave rod.segments and time.step out of the scene"
            );
            warnings.add(Severity::Numerics, Code::NumericsUnknown, words);
            Ok(None)
        }
        shifts => shifts,
    }
}

/// Results of the stages before an assessment.
pub(crate) struct AssessmentInputs<'a> {
    pub local: LocalAnalysis,
    /// Shifts by a mesh and a step that the program chose.
    pub shifts: Option<Shifts>,
    pub warnings: Warnings,
    /// Suspicions of the check before the search.
    pub suspicions: &'a [(Code, String)],
    /// All experiments, those of the validation data included.
    pub experiments: &'a [Experiment],
}

/// Assesses an optimum.
pub(crate) fn assess(
    fitted: Fitted,
    AssessmentInputs { local, shifts: chosen, mut warnings, suspicions, experiments }: AssessmentInputs,
    analysis: &Analysis,
    knowns: &[Known],
) -> Result<Assessment, Error> {
    let search = fitted.search;
    let unknowns = search.unknowns;
    let corrected = chosen.clone().unwrap_or_default();
    let spent = search.simulations();
    let linear_fit = local.linear_fit();
    let inputs = || {
        let converged = fitted.optimum.converged;
        let wanted = converged && are_unstated_wanted(search, analysis, knowns, spent);
        sensitivities(fitted, &linear_fit, knowns, wanted)
    };
    // One run has the sensitivities to all inputs. Without known ones it need not come before the tests.
    let early = (!knowns.is_empty()).then(inputs);
    let known = match &early {
        Some((found, found_warnings)) => {
            warnings.append(found_warnings.clone());
            found.as_ref().and_then(|found| InputErrors::of(knowns, found).ok())
        }
        None => linear_fit.identified.contains(&true).then(InputErrors::none),
    };
    let finer = Finer::new(fitted, &local, &corrected);
    let apart_from_known = |optimum: &Optimum, warnings: &mut Warnings| {
        let here = Fitted { search, optimum };
        known.as_ref()?.without_explained(here, &Noise::at(here), warnings)
    };
    let on_finer = |warnings: &mut Warnings| {
        let residuals = finer.residuals()?;
        let finest = Optimum { residuals, ..fitted.optimum.clone() };
        Some(apart_from_known(&finest, warnings).unwrap_or(finest))
    };
    let before = warnings.clone();
    // From here on residuals are what known numbers do not explain,
    let mut explained = apart_from_known(fitted.optimum, &mut warnings);
    let mut local = match &explained {
        Some(explained) => {
            LocalAnalysis::new(Fitted { search, optimum: explained }, Some(&local.bounds))?
        }
        None => local,
    };
    // and what numerics do not leave, where they are no noise.
    let optimum = explained.as_ref().unwrap_or(fitted.optimum);
    let is_noise = is_noise(Fitted { search, optimum }, &local);
    let mut warnings_there = before;
    let finest = if is_noise { None } else { on_finer(&mut warnings_there) };
    let is_finest = finest.is_some();
    if let Some(finest) = finest {
        warnings = warnings_there;
        local = LocalAnalysis::new(Fitted { search, optimum: &finest }, Some(&local.bounds))?;
        explained = Some(finest);
    }
    let optimum = explained.as_ref().unwrap_or(fitted.optimum);
    let explained = Fitted { search, optimum };
    let finest = || (!is_finest).then(|| on_finer(&mut Warnings::default())).flatten();
    let LocalAnalysis { noise, correlations, adequacy, covariance, .. } = &local;
    let estimates = estimates(explained, &local, &corrected);
    let estimates = cluster_jackknife(estimates, fitted, &corrected);
    let sigma = search.estimated_sigmas(optimum);
    let (sigma_narrow, test_narrow) = match compares_experiments(&estimates) {
        true => ("", ""),
        false => (". The intervals are too narrow", ". The intervals are too narrow"),
    };

    bounded_from_one_side(search.unknowns, &estimates, &mut warnings);
    bounds_reached(unknowns, optimum, covariance, &mut warnings);
    unexplained(explained, &local, sigma_narrow, &mut warnings);
    growing_sensitivities(explained, &mut warnings);
    high_leverage(explained, &mut warnings);
    faulty_recordings(experiments, &mut warnings);
    against_priors(unknowns, optimum, &mut warnings);
    steps_too_large(search.experiments, &mut warnings);
    if !search.has_acceptable_residuals(optimum) {
        suspicions.iter().for_each(|(code, words)| warnings.add(Severity::Suspicion, *code, words));
    }
    let (mut residual_tests, mut discretization) = (Vec::new(), Vec::new());
    // Rounding errors are neither noise nor made by another mesh; as few values as unknowns leave
    // nothing else.
    let is_tested = optimum.residuals.len() == unknowns.len() || !search.is_rounding(optimum);
    let shifts = || {
        let mut said = Warnings::default();
        let shifts = match chosen {
            _ if !is_tested => None,
            Some(chosen) => Some(chosen),
            None if search.experiments.iter().any(|e| e.problem.scene().chosen().any()) => None,
            None => shifts_of(explained, &local, analysis, &mut said)?,
        };
        Ok::<_, Error>((shifts, said))
    };
    let statistics = FitStatistics { fitted: explained, estimates: &estimates, local: &local };
    let discrepancy = || assess_model_discrepancy(statistics, &finest, analysis, knowns, spent);
    // Runs on other meshes, one with the derivatives by the inputs, and one of a coarse model: none waits for another.
    let late = || if early.is_none() { Some(inputs()) } else { None };
    let (shifts, (late, (discrepancy, not_tested))) =
        rayon::join(shifts, || rayon::join(late, discrepancy));
    let (shifts, not_known) = shifts?;
    if is_tested {
        residual_tests = test_residuals(explained, correlations, test_narrow, &mut warnings);
        against_noise_scale(search, adequacy, &mut warnings);
        stated_sigmas(search, adequacy, &mut warnings);
        jumps(explained, &mut warnings);
        warnings.append(not_known);
        if let Some(shifts) = &shifts {
            discretization = errors_of(&estimates, explained, shifts, noise, &mut warnings);
            if shifts.are_to_blame() {
                warnings.downgrade_misfit(
                    Code::NumericsBelowData,
                    "most of the residuals are discretization errors: the data are more accurate than the 1e-4 of \
                     a value for which mesh and step are chosen. The noise tests are not valid. Give a finer \
                     rod.segments and time.step",
                );
            }
        }
    }
    let (estimates, profiles) = match optimum.converged && covariance.findings.is_empty() {
        true => with_requested_intervals(
            estimates,
            explained,
            &local,
            (analysis, &sigma),
            &mut warnings,
        ),
        false => (estimates, Vec::new()),
    };
    let given = BudgetInputs {
        known: known.as_ref(),
        analysis,
        discretization: &discretization,
        sigma: &sigma,
        correlations,
    };
    let mut estimates = budgeted(estimates, explained, given, &mut warnings);
    let inputs = early.iter().chain(&late).find_map(|(found, _)| found.as_ref());
    let mut groups = determined_combinations(explained, &local, &corrected);
    if let Some(inputs) = inputs {
        inputs.give_per_cents(search, &mut estimates);
        groups.extend(determined_groups(search, &estimates, inputs));
    }
    late.into_iter().for_each(|(_, found_warnings)| warnings.append(found_warnings));
    scene_notes(fitted, &mut warnings);
    check_mode_numbers(explained, &estimates, &mut warnings);
    check_slenderness(explained, &local, &estimates, &mut warnings);
    warnings.append(not_tested);
    warn_of_omitted_effects(&discrepancy.score_tests, &mut warnings);
    if is_tested && shifts.as_ref().is_some_and(Shifts::leave_traces) {
        warnings.downgrade_ambiguity(
            Code::NumericsBelowData,
            "a part of the residuals is discretization error: the data are more accurate than the 1e-4 of a value \
             for which mesh and step are chosen. A small missing effect cannot be separated from it. Give a finer \
             rod.segments and time.step",
        );
    }
    let predictions = predictions(experiments, explained, covariance, &sigma, &mut warnings);
    let losses = losses(explained, noise);
    let noise_scale = adequacy.coordinates.iter().map(|c| c.scale.clone()).collect();
    Ok(Assessment {
        estimates,
        residual_rms: residual_rms(fitted),
        losses,
        covariance: Some(local.covariance),
        sigma,
        discretization,
        residual_tests,
        noise_scale,
        predictions,
        discrepancy,
        determined_groups: groups,
        recordings: RecordingErrors::of(experiments, explained),
        profiles,
        warnings,
    })
}

/// The sensitivities to the known inputs, and to the unstated ones if `with_unstated`; a run that fails is a warning.
fn sensitivities(
    fitted: Fitted,
    fit: &LinearFit,
    knowns: &[Known],
    with_unstated: bool,
) -> (Option<InputSensitivities>, Warnings) {
    let mut warnings = Warnings::default();
    if fitted.search.is_stopped() || !fit.identified.contains(&true) {
        return (None, warnings);
    }
    let sensitivities_to = |unstated: bool| InputSensitivities::new(fitted, fit, knowns, unstated);
    let mut found = sensitivities_to(with_unstated);
    if let Err(error) = &found
        && with_unstated
    {
        let words = format!(
            "the sensitivities to inputs are unknown: the run with their derivatives failed ({error}). Estimates \
             and intervals are not affected"
        );
        warnings.add(Severity::Note, Code::NoSensitivityAnalysis, words);
        found = sensitivities_to(false);
    }
    if let Err(error) = &found {
        let words = format!(
            "the uncertainty budget is missing: its simulation failed ({error}). The interval is \
                             statistical only. Check the stated inputs"
        );
        warnings.add(Severity::Note, Code::NoBudget, words);
    }
    (found.ok(), warnings)
}

/// What data without noise at an optimum would be worth with theirs: what another mesh would say is not asked.
pub(crate) fn expected(
    fitted: Fitted,
    analysis: &Analysis,
    knowns: &[Known],
) -> Result<Assessment, Error> {
    let search = fitted.search;
    let local = LocalAnalysis::new(fitted, None)?;
    let mut warnings = Warnings::default();
    let with_unstated = analysis.sensitivity_analysis != Some(false);
    let (inputs, not_found) = sensitivities(fitted, &local.linear_fit(), knowns, with_unstated);
    warnings.append(not_found);
    let known = inputs.as_ref().and_then(|found| InputErrors::of(knowns, found).ok());
    let estimates = estimates(fitted, &local, &Shifts::default());
    bounded_from_one_side(search.unknowns, &estimates, &mut warnings);
    steps_too_large(search.experiments, &mut warnings);
    let sensitivity_analysis = Some(with_unstated);
    let analysis = &Analysis { monte_carlo: 0, sensitivity_analysis, ..analysis.clone() };
    let given = BudgetInputs {
        known: known.as_ref(),
        analysis,
        discretization: &[],
        sigma: &search.sigmas,
        correlations: &local.correlations,
    };
    let mut estimates = budgeted(estimates, fitted, given, &mut warnings);
    let statistics = FitStatistics { fitted, estimates: &estimates, local: &local };
    let (discrepancy, not_tested) =
        assess_model_discrepancy(statistics, &|| None, analysis, knowns, search.simulations());
    if let Some(inputs) = &inputs {
        inputs.give_per_cents(search, &mut estimates);
    }
    warnings.append(not_tested);
    let covariance = Some(local.covariance);
    Ok(Assessment { estimates, covariance, discrepancy, warnings, ..Assessment::default() })
}

/// The estimates with the requested intervals of other methods, and the profiles.
fn with_requested_intervals(
    mut estimates: Vec<Estimate>,
    fitted: Fitted,
    local: &LocalAnalysis,
    (analysis, sigma): (&Analysis, &[f64]),
    warnings: &mut Warnings,
) -> (Vec<Estimate>, Vec<Profile>) {
    let (unknowns, correlations) = (fitted.search.unknowns, &local.correlations);
    if analysis.observed_information {
        let found = observed_information::std_errors(fitted, local, &estimates, warnings);
        estimates.iter_mut().zip(found).for_each(|(e, error)| e.observed_std_error = error);
    }
    let mut profiles = Vec::new();
    if analysis.profile {
        let intervals =
            profile_likelihood::intervals(fitted, local, warnings).into_iter().zip(unknowns);
        for (i, (interval, unknown)) in intervals.enumerate() {
            let Some(interval) = interval else { continue };
            profiles.push(interval.profile(unknown, correlations.reach[i]));
            estimates[i].profile95 = Some(interval.values(unknown));
        }
    }
    if analysis.bootstrap > 0 {
        let first = analysis.bootstrap_first.unwrap_or(0);
        let numbers = first..first + analysis.bootstrap;
        let kept = analysis.bootstrap_first.is_some();
        let replicates = Replicates { what: "bootstrap", numbers, seed: analysis.seed, kept };
        let draws = Draws { sigma, knowns: &[], correlations, blocks: true };
        let spreads = bootstrap::spreads(fitted, draws, replicates, warnings);
        estimates.iter_mut().zip(spreads).for_each(|(e, spread)| e.bootstrap = spread);
    }
    (estimates, profiles)
}

//! Assessment of an optimum: all analyses of a fit in their order, with their warnings.
//!
//! [`assess`] receives an optimum (unknowns, residuals, Jacobian; converged or not) with its local analysis, and
//! returns a [`FitAssessment`] for the report of a fit. Further inputs are the bias by mesh and step, warnings and
//! suspicions of earlier stages, the experiments with validation data, the options of the fit and the known inputs
//! (with a standard uncertainty). The order of the analyses:
//!
//! - sensitivities to known inputs;
//! - residuals without the most probable errors of known inputs, and, unless they are then noise, without the
//!   discretization errors of a chosen mesh or step;
//! - estimates and intervals;
//! - discretization error, score tests and other input sensitivities in parallel;
//! - tests of the residuals, requested intervals, and uncertainty budgets;
//! - validity of the model, and predictions of validation data.
//!
//! An analysis that is not possible or fails has an empty result. Errors are a failed local analysis of the corrected
//! residuals, and a stop during it or during the estimate of the discretization error. [`expected`] is the shorter
//! assessment of a planned experiment, which has no data.

use crate::code::Code;
use crate::error::Error;
use crate::fit::known::Known;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::residual_tests::ResidualTests;
use crate::fit::search::data_precheck::Suspicion;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::budget::combined::{BudgetInputs, add_budgets};
use crate::fit::uncertainty::budget::input_errors::InputErrors;
use crate::fit::uncertainty::budget::input_sensitivities::{
    InputSensitivities, are_unstated_wanted,
};
use crate::fit::uncertainty::covariance::determined_groups::{
    DeterminedGroup, determined_combinations, determined_groups,
};
use crate::fit::uncertainty::covariance::gauss_newton::{Covariance, LinearFit};
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::covariance::observed_information::std_errors;
use crate::fit::uncertainty::covariance::profile_likelihood::{Profile, profile_intervals};
use crate::fit::uncertainty::discrepancy::fit_statistics::FitStatistics;
use crate::fit::uncertainty::discrepancy::free_run::RecordingErrors;
use crate::fit::uncertainty::discrepancy::mode_numbers::check_mode_numbers;
use crate::fit::uncertainty::discrepancy::prediction::{Prediction, predictions};
use crate::fit::uncertainty::discrepancy::scene_notes::scene_notes;
use crate::fit::uncertainty::discrepancy::score_tests::{
    ModelDiscrepancy, ScoreTestInputs, warn_of_omitted_effects,
};
use crate::fit::uncertainty::discrepancy::slenderness::check_slenderness;
use crate::fit::uncertainty::discretization::bias::DiscretizationBias;
use crate::fit::uncertainty::discretization::errors::{DiscretizationError, discretization_errors};
use crate::fit::uncertainty::discretization::limit::estimate_bias;
use crate::fit::uncertainty::discretization::refined_residuals::RefinedResiduals;
use crate::fit::uncertainty::estimate::{Estimate, local_estimates};
use crate::fit::uncertainty::noise::noise_scale::NoiseScale;
use crate::fit::uncertainty::noise::residual_noise::{
    LossEffect, ResidualNoise, loss_effects, residual_rms,
};
use crate::fit::uncertainty::posterior::draws::PosteriorDraws;
#[cfg(feature = "posterior")]
use crate::fit::uncertainty::posterior::sampled::{SampledPosterior, sampled_posterior};
use crate::fit::uncertainty::resampling::bootstrap::{Resampling, spreads};
use crate::fit::uncertainty::resampling::cluster_jackknife::{
    add_cluster_jackknife, compares_experiments,
};
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::fit::uncertainty::warnings::data::{
    assumed_units, growing_sensitivities, halved_steps, high_leverage, recording_defects,
    steps_too_large,
};
use crate::fit::uncertainty::warnings::noise_comparison::{near_copies, unequal_noise};
use crate::fit::uncertainty::warnings::parameters::{
    bounds_reached, one_sided_bounds, prior_conflicts,
};
use crate::fit::uncertainty::warnings::residuals::{
    doubtful_sigmas, excess_over_noise_scale, is_noise, test_residuals, unexplained_motion,
};

/// Result of an assessment: estimates with their uncertainty, and all findings about an optimum. Lists are empty where
/// an analysis was not requested, not possible or failed.
#[derive(Default)]
pub(crate) struct FitAssessment {
    /// One per unknown, in their order.
    pub estimates: Vec<Estimate>,
    /// Gauss-Newton covariance; none without an optimum.
    pub covariance: Option<Covariance>,
    /// Root mean square residual in m, without positions in rad/s, else in the unit of the first measurement.
    pub residual_rms: f64,
    /// Standard deviation of the noise of each measurement, in its unit.
    pub sigma: Vec<f64>,
    /// Effects of robust losses, per measurement with one.
    pub losses: Vec<LossEffect>,
    /// Discretization error of each parameter.
    pub discretization: Vec<DiscretizationError>,
    /// Tests of the residuals of each coordinate for being noise.
    pub residual_tests: Vec<ResidualTests>,
    /// Noise of each coordinate, estimated from differences of the samples.
    pub noise_scale: Vec<NoiseScale>,
    /// Errors of predicted validation data.
    pub predictions: Vec<Prediction>,
    /// Score tests of omitted effects, and undetected biases.
    pub discrepancy: ModelDiscrepancy,
    /// Combinations of parameters that the data determine.
    pub determined_groups: Vec<DeterminedGroup>,
    /// Free-run errors of recordings that drive the ends; none without such recordings.
    pub recordings: Option<RecordingErrors>,
    /// Profile likelihoods, where requested.
    pub profiles: Vec<Profile>,
    /// Draws from the posterior distribution, where requested.
    pub posterior_draws: Option<PosteriorDraws>,
    pub warnings: Warnings,
}

/// Results of the stages before an assessment.
pub(crate) struct AssessmentInputs<'a> {
    /// Noise, covariance and bounds at the optimum.
    pub local: LocalAnalysis,
    /// Bias by a mesh and a step that the program chose; none where it is not computed yet.
    pub bias: Option<DiscretizationBias>,
    /// Warnings of the earlier stages, which the assessment continues.
    pub warnings: Warnings,
    /// Findings of the check before the search.
    pub suspicions: &'a [Suspicion],
    /// All experiments, those of the validation data included.
    pub experiments: &'a [Experiment],
}

/// Assesses an optimum: estimates with intervals and budgets, tests of residuals and model, and all warnings. `chosen`
/// is the bias by a mesh and a step that the program chose; without one it is computed here for given mesh and step.
/// `knowns` are the inputs with a standard uncertainty. The most probable errors of these inputs are removed from the
/// residuals that are tested; unless they are then noise, discretization errors are removed too. If discretization
/// errors explain a misfit, its warnings become one note. Profiles, bootstrap, posterior and observed information need
/// convergence and no unidentifiable direction. A failed analysis is left out. Errors: failure of the local analysis,
/// and a stop during it or the estimate of the discretization error.
pub(crate) fn assess(
    fitted: Fitted,
    AssessmentInputs { local, bias: chosen, warnings, suspicions, experiments }: AssessmentInputs,
    analysis: &Analysis,
    knowns: &[Known],
) -> Result<FitAssessment, Error> {
    let search = fitted.search;
    let unknowns = search.unknowns;
    let correction = chosen.clone().unwrap_or_default();
    // Cost of the search alone: later analyses run unrequested only where they are cheap compared with it.
    let spent = search.simulations();

    // Sensitivities to inputs: one run. Without known inputs the tests of the residuals do not need them, and it runs
    // later, in parallel with others.
    let linear_fit = local.linear_fit();
    let sensitivities = || {
        let converged = fitted.optimum.converged;
        let wanted = converged && are_unstated_wanted(search, analysis, knowns, spent);
        sensitivities(fitted, &linear_fit, knowns, wanted)
    };
    let mut input_warnings = warnings;
    let early = (!knowns.is_empty()).then(sensitivities);
    let known = match &early {
        Some((found, own_warnings)) => {
            input_warnings.append(own_warnings.clone());
            found.as_ref().and_then(|found| InputErrors::new(knowns, found).ok())
        }
        None => linear_fit.identified.contains(&true).then(InputErrors::default),
    };

    // An error of a known input, or of a coarse mesh, is no fault of the model. So residuals are tested without the
    // most probable errors of known inputs; and, if they are no noise, without discretization errors.
    let refined = RefinedResiduals::new(fitted, &local, &correction);
    let without_input_errors = |optimum: &Optimum, warnings: &mut Warnings| {
        let fitted = Fitted { search, optimum };
        known.as_ref()?.without_explained(fitted, &ResidualNoise::new(fitted), warnings)
    };
    let on_finer_numerics = |warnings: &mut Warnings| {
        let residuals = refined.residuals()?;
        let finer = Optimum { residuals, ..fitted.optimum.clone() };
        Some(without_input_errors(&finer, warnings).unwrap_or(finer))
    };
    let mut warnings = input_warnings.clone();
    let mut corrected = without_input_errors(fitted.optimum, &mut warnings);
    let mut local = match &corrected {
        Some(optimum) => LocalAnalysis::new(Fitted { search, optimum }, Some(&local.bounds))?,
        None => local,
    };
    let optimum = corrected.as_ref().unwrap_or(fitted.optimum);
    let is_noise = is_noise(Fitted { search, optimum }, &local);
    let finer = if is_noise { None } else { on_finer_numerics(&mut input_warnings) };
    let is_finer = finer.is_some();
    if let Some(optimum) = finer {
        warnings = input_warnings;
        let finer = Fitted { search, optimum: &optimum };
        local = LocalAnalysis::new(finer, Some(&local.bounds))?;
        corrected = Some(optimum);
    }
    let optimum = corrected.as_ref().unwrap_or(fitted.optimum);
    let explained = Fitted { search, optimum };
    let LocalAnalysis { noise, correlations, adequacy, covariance, .. } = &local;

    // Estimates with the intervals of the local analysis and of the jackknife over experiments.
    // The Gauss-Newton covariance at the optimum, then the differences between experiments where
    // there are five or more.
    let mut estimates = local_estimates(explained, &local, &correction);
    add_cluster_jackknife(&mut estimates, fitted, &correction);
    // Warnings about the optimum itself, which need no further simulation.
    let sigma = search.estimated_sigmas(optimum);
    let narrow = match compares_experiments(&estimates) {
        true => "",
        false => ". The intervals are too narrow",
    };
    one_sided_bounds(unknowns, &estimates, &mut warnings);
    bounds_reached(unknowns, optimum, covariance, &mut warnings);
    unexplained_motion(explained, &local, narrow, &mut warnings);
    growing_sensitivities(explained, &mut warnings);
    high_leverage(explained, &mut warnings);
    recording_defects(experiments, &mut warnings);
    prior_conflicts(unknowns, optimum, &mut warnings);
    steps_too_large(search.experiments, &mut warnings);
    if !search.has_acceptable_residuals(optimum) {
        suspicions.iter().for_each(|s| warnings.add(Severity::Suspicion, s.code, &s.text));
    }

    // Runs on other meshes, one with the derivatives by the inputs, and one of a coarse model, in parallel. Rounding
    // errors are not tested; with as many values as unknowns the residuals of any fit are rounding errors.
    let is_tested = optimum.residuals.len() == unknowns.len() || !search.is_rounding(optimum);
    let bias = || {
        let mut own_warnings = Warnings::default();
        let is_any_chosen = search.experiments.iter().any(|e| e.problem.scene().chosen().any());
        let bias = match chosen {
            _ if !is_tested => None,
            None if !is_any_chosen => {
                estimate_bias(explained, &local, analysis, &mut own_warnings)?
            }
            chosen => chosen,
        };
        Ok::<_, Error>((bias, own_warnings))
    };
    let finer = || (!is_finer).then(|| on_finer_numerics(&mut Warnings::default())).flatten();
    let statistics = FitStatistics { fitted: explained, estimates: &estimates, local: &local };
    let tests = ScoreTestInputs { statistics, finer: &finer, analysis, knowns };
    let late = || if early.is_none() { Some(sensitivities()) } else { None };
    // Three independent computations, each of one or a few runs.
    let (bias, (late, (discrepancy, test_warnings))) =
        rayon::join(bias, || rayon::join(late, || tests.assess(spent)));
    let (bias, bias_warnings) = bias?;

    // Residuals against noise, and discretization errors.
    let (mut residual_tests, mut discretization) = (Vec::new(), Vec::new());
    if is_tested {
        residual_tests = test_residuals(explained, correlations, narrow, &mut warnings);
        excess_over_noise_scale(search, adequacy, &mut warnings);
        doubtful_sigmas(search, adequacy, &mut warnings);
        halved_steps(explained, &mut warnings);
        warnings.append(bias_warnings);
        if let Some(bias) = &bias {
            discretization =
                discretization_errors(&estimates, explained, bias, noise, &mut warnings);
            if bias.explains_residuals() {
                warnings.downgrade_misfit(
                    Code::NumericsBelowData,
                    "most of the residuals are discretization errors: the data are more accurate than the 1e-4 of \
                     a value for which mesh and step are chosen. The noise tests are not valid. Give a finer \
                     rod.segments and time.step",
                );
            }
        }
    }

    // Intervals of other methods, budgets, and sensitivities to inputs.
    let (mut profiles, mut posterior_draws) = (Vec::new(), None);
    // Other intervals are expensive, and meaningless where a direction is not determined.
    if optimum.converged && covariance.findings.is_empty() {
        profiles = add_requested_intervals(
            &mut estimates,
            explained,
            &local,
            analysis,
            &sigma,
            &mut warnings,
        );
        posterior_draws =
            add_posterior(&mut estimates, explained, &local, &correction, analysis, &mut warnings);
    } else if analysis.posterior.is_some() {
        let text =
            "no posterior distribution: the fit did not converge, or a direction is not determined";
        warnings.add(Severity::Note, Code::NoPosterior, text);
    }
    // GUM: contributions of noise, inputs and discretization to each estimate.
    let inputs = BudgetInputs {
        known: known.as_ref(),
        analysis,
        discretization: &discretization,
        sigma: &sigma,
        correlations,
    };
    add_budgets(&mut estimates, explained, inputs, &mut warnings);
    let mut groups = determined_combinations(explained, &local, &correction);
    let found = early.iter().chain(&late).find_map(|(found, _)| found.as_ref());
    if let Some(sensitivities) = found {
        sensitivities.add_to(search, &mut estimates);
        groups.extend(determined_groups(search, &estimates, sensitivities));
    }
    late.into_iter().for_each(|(_, own_warnings)| warnings.append(own_warnings));

    // Validity of the model and omitted effects.
    scene_notes(fitted, &mut warnings);
    check_mode_numbers(explained, &estimates, &mut warnings);
    check_slenderness(explained, &local, &estimates, &mut warnings);
    warnings.append(test_warnings);
    warn_of_omitted_effects(&discrepancy.score_tests, &mut warnings);
    if is_tested && bias.as_ref().is_some_and(DiscretizationBias::is_visible) {
        warnings.downgrade_ambiguity(
            Code::NumericsBelowData,
            "a part of the residuals is discretization error: the data are more accurate than the 1e-4 of a value \
             for which mesh and step are chosen. A small missing effect cannot be separated from it. Give a finer \
             rod.segments and time.step",
        );
    }
    assumed_units(search.experiments, &mut warnings);
    if is_tested {
        near_copies(explained, &mut warnings);
        unequal_noise(explained, &sigma, adequacy, &mut warnings);
    }
    // Experiments of the validation data are predicted with the final estimates.
    let predictions = predictions(experiments, explained, covariance, &sigma, &mut warnings);
    Ok(FitAssessment {
        estimates,
        residual_rms: residual_rms(fitted),
        losses: loss_effects(explained, noise),
        noise_scale: adequacy.coordinates.iter().map(|c| c.scale.clone()).collect(),
        covariance: Some(local.covariance),
        sigma,
        discretization,
        residual_tests,
        predictions,
        discrepancy,
        determined_groups: groups,
        recordings: RecordingErrors::new(experiments, explained),
        profiles,
        posterior_draws,
        warnings,
    })
}

/// Responses of the unknowns to one standard uncertainty of each of the `knowns`, from one run with derivatives. With
/// `with_unstated` they include those to +1 % of every other input. If that run fails, a note is added and it is
/// repeated for the `knowns` alone. If a run for the `knowns` alone fails, another note is added. `None` after a
/// failure, after an interruption, or where `fit` has no identified unknown. Also returns the notes.
fn sensitivities(
    fitted: Fitted,
    fit: &LinearFit,
    knowns: &[Known],
    with_unstated: bool,
) -> (Option<InputSensitivities>, Warnings) {
    let mut warnings = Warnings::default();
    // No more runs after an interruption, and none where nothing is identified.
    if fitted.search.is_stopped() || !fit.identified.contains(&true) {
        return (None, warnings);
    }
    let sensitivities_to = |unstated: bool| InputSensitivities::new(fitted, fit, knowns, unstated);
    let mut found = sensitivities_to(with_unstated);
    if let Err(error) = &found
        // The unstated inputs may have failed: the known ones alone are tried.
        && with_unstated
    {
        let text = format!(
            "the sensitivities to inputs are unknown: the run with their derivatives failed ({error}). Estimates \
             and intervals are not affected"
        );
        warnings.add(Severity::Note, Code::NoSensitivityAnalysis, text);
        found = sensitivities_to(false);
    }
    if let Err(error) = &found {
        let text = format!(
            "the uncertainty budget is missing: its simulation failed ({error}). The interval is \
                             statistical only. Check the stated inputs"
        );
        warnings.add(Severity::Note, Code::NoBudget, text);
    }
    (found.ok(), warnings)
}

/// Expected assessment of planned data, at an optimum without residuals: estimates, covariance, budget, sensitivities,
/// score tests with undetected biases, and warnings. Sensitivities to unstated inputs are computed unless the analysis
/// excludes them. Monte Carlo, requested intervals, tests of the residuals and discretization errors are omitted. Other
/// fields of the result keep their defaults. Error: failure of the local analysis.
pub(crate) fn expected(
    fitted: Fitted,
    analysis: &Analysis,
    knowns: &[Known],
) -> Result<FitAssessment, Error> {
    let search = fitted.search;
    let local = LocalAnalysis::new(fitted, None)?;
    let with_unstated = analysis.sensitivity_analysis != Some(false);
    let (inputs, mut warnings) = sensitivities(fitted, &local.linear_fit(), knowns, with_unstated);
    let known = inputs.as_ref().and_then(|found| InputErrors::new(knowns, found).ok());
    // Planned data have no residuals: covariance, budget and score tests remain.
    let mut estimates = local_estimates(fitted, &local, &DiscretizationBias::default());
    one_sided_bounds(search.unknowns, &estimates, &mut warnings);
    steps_too_large(search.experiments, &mut warnings);
    let sensitivity_analysis = Some(with_unstated);
    // Random fits of the plan would be fits of data that do not exist.
    let analysis = &Analysis { monte_carlo: 0, sensitivity_analysis, ..analysis.clone() };
    let budget = BudgetInputs {
        known: known.as_ref(),
        analysis,
        discretization: &[],
        sigma: &search.sigmas,
        correlations: &local.correlations,
    };
    add_budgets(&mut estimates, fitted, budget, &mut warnings);
    let statistics = FitStatistics { fitted, estimates: &estimates, local: &local };
    let tests = ScoreTestInputs { statistics, finer: &|| None, analysis, knowns };
    let (discrepancy, test_warnings) = tests.assess(search.simulations());
    if let Some(inputs) = &inputs {
        inputs.add_to(search, &mut estimates);
    }
    warnings.append(test_warnings);
    let covariance = Some(local.covariance);
    Ok(FitAssessment { estimates, covariance, discrepancy, warnings, ..FitAssessment::default() })
}

/// Sets the results of other methods in the `estimates`, each only if the analysis requests it: standard errors by the
/// observed information (`observed_std_error`), intervals of the profile likelihood (`profile95`) and the bootstrap
/// with resampled residuals (`bootstrap`). `sigma` is the noise of each measurement, in its unit. Failures add
/// warnings. Returns the profiles of the unknowns that have one; empty unless requested.
fn add_requested_intervals(
    estimates: &mut [Estimate],
    fitted: Fitted,
    local: &LocalAnalysis,
    analysis: &Analysis,
    sigma: &[f64],
    warnings: &mut Warnings,
) -> Vec<Profile> {
    let correlations = &local.correlations;
    // Exact Hessian of the misfit instead of its Gauss-Newton approximation.
    if analysis.observed_information {
        let found = std_errors(fitted, local, estimates, warnings);
        estimates.iter_mut().zip(found).for_each(|(e, error)| e.observed_std_error = error);
    }
    let mut profiles = Vec::new();
    // Profile likelihood: the misfit minimized over all other unknowns along each one.
    if analysis.profile {
        let intervals = profile_intervals(fitted, local, warnings).into_iter();
        for (i, (interval, unknown)) in intervals.zip(fitted.search.unknowns).enumerate() {
            let Some(interval) = interval else { continue };
            estimates[i].profile95 = Some(interval.values(unknown));
            profiles.push(interval.profile(unknown, correlations.coverage_factor(i)));
        }
    }
    // Parametric bootstrap: fits of simulated data with resampled residuals.
    if analysis.bootstrap > 0 {
        let first = analysis.bootstrap_first.unwrap_or(0);
        let resampling = Resampling {
            name: "bootstrap",
            numbers: first..first + analysis.bootstrap,
            seed: analysis.seed,
            stores_estimates: analysis.bootstrap_first.is_some(),
            sigma,
            knowns: &[],
            correlations,
            draws_blocks: true,
        };
        let spreads = spreads(fitted, &resampling, warnings);
        estimates.iter_mut().zip(spreads).for_each(|(e, spread)| e.bootstrap = spread);
    }
    profiles
}

/// Sets the posterior distributions in the `estimates`, if the analysis requests them, and returns all draws. `bias`
/// corrects the draws for mesh and step. Findings are added to the warnings. None if not requested or after a failure.
#[cfg(feature = "posterior")]
fn add_posterior(
    estimates: &mut [Estimate],
    fitted: Fitted,
    local: &LocalAnalysis,
    bias: &DiscretizationBias,
    analysis: &Analysis,
    warnings: &mut Warnings,
) -> Option<PosteriorDraws> {
    let settings = analysis.posterior?;
    let SampledPosterior { summaries, draws } =
        sampled_posterior(fitted, local, bias, settings, analysis.seed, warnings)?;
    estimates.iter_mut().zip(summaries).for_each(|(e, own)| e.posterior = Some(own));
    Some(draws)
}

/// No draws: this build has no sampler, and the check of the fit rejects a requested posterior.
#[cfg(not(feature = "posterior"))]
fn add_posterior(
    _: &mut [Estimate],
    _: Fitted,
    _: &LocalAnalysis,
    _: &DiscretizationBias,
    _: &Analysis,
    _: &mut Warnings,
) -> Option<PosteriorDraws> {
    None
}

//! What an optimum is worth: everything that is computed about it.

use crate::code::Code;
use crate::error::Error;
use crate::fit::known::Known;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::residual_tests::ResidualTests;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::across::{are_across, cluster_jackknife};
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::bootstrap::{self, Draws, Replicates};
use crate::fit::uncertainty::budget::{Given, budgeted};
use crate::fit::uncertainty::correlation::Correlations;
use crate::fit::uncertainty::covariance::Covariance;
use crate::fit::uncertainty::determined_groups::{DeterminedGroup, determined_groups};
use crate::fit::uncertainty::discretization::{DiscretizationError, errors_of, shifts};
use crate::fit::uncertainty::estimate::{Estimate, estimates};
use crate::fit::uncertainty::finer::Finer;
use crate::fit::uncertainty::input_sensitivities::{
    InputSensitivities, LinearFit, are_unstated_wanted,
};
use crate::fit::uncertainty::known_errors::KnownErrors;
use crate::fit::uncertainty::local_analysis::{self, Local, local_with};
use crate::fit::uncertainty::mode_numbers::other_numberings;
use crate::fit::uncertainty::noise::{LossEffect, Noise, losses, residual_rms};
use crate::fit::uncertainty::noise_scale::NoiseScale;
use crate::fit::uncertainty::observed;
use crate::fit::uncertainty::prediction::{Prediction, predictions};
use crate::fit::uncertainty::profile::{self, Profile};
use crate::fit::uncertainty::recordings::RecordingErrors;
use crate::fit::uncertainty::scene_notes::scene_notes;
use crate::fit::uncertainty::score::{Found, Statistics, Unsaid, explained_by, unsaid};
use crate::fit::uncertainty::shifts::Shifts;
use crate::fit::uncertainty::slenderness::too_thick;
use crate::fit::uncertainty::verdict::{Warnings, Weight};
use crate::fit::uncertainty::warnings::{
    against_noise_scale, against_priors, bounded_from_one_side, bounds_reached, faulty_recordings,
    growing_sensitivities, is_noise, jumps, runaways, stated_sigmas, steps_too_large,
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
    pub unsaid: Unsaid,
    pub determined_groups: Vec<DeterminedGroup>,
    pub recordings: Option<RecordingErrors>,
    pub profiles: Vec<Profile>,
    pub warnings: Warnings,
}

/// How far the unknowns of an optimum are from those of the continuum, where it is looked for; what keeps that
/// from being known is a warning.
pub(crate) fn shifts_of(
    (search, optimum): (&Search, &Optimum),
    local: &Local,
    analysis: &Analysis,
    warnings: &mut Warnings,
) -> Result<Option<Shifts>, Error> {
    // Rounding errors are neither noise nor made by another mesh; as few values as unknowns leave
    // nothing else.
    if optimum.residuals.len() != search.unknowns.len() && search.is_rounding(optimum) {
        return Ok(None);
    }
    let around = (&local.covariance, &local.noise.weights[..]);
    match shifts((search, optimum), around, analysis.discretization_error) {
        Err(Error::Interrupted) => Err(Error::Interrupted),
        Err(error) => {
            let words = format!(
                "the discretization error is unknown: a run on another mesh failed ({error}). The \
                         intervals do not include it. Leave rod.segments and time.step out of the scene"
            );
            warnings.add(Weight::Numerics, Code::NumericsUnknown, words);
            Ok(None)
        }
        shifts => shifts,
    }
}

/// Assesses an optimum; `experiments` have what was held out too, and `suspicions` are what looked wrong
/// before the search. Numerics that the program chose have been looked at before.
pub(crate) fn assess(
    (search, optimum): (&Search, &Optimum),
    (local, chosen, mut warnings): (Local, Option<Shifts>, Warnings),
    (analysis, knowns): (&Analysis, &[Known]),
    experiments: &[Experiment],
    suspicions: &[(Code, String)],
) -> Result<Assessment, Error> {
    let unknowns = search.unknowns;
    let corrected = chosen.clone().unwrap_or_default();
    let fitted = optimum;
    let spent = search.simulations();
    let linear_fit = local.linear_fit();
    let inputs = || {
        let wanted = fitted.converged && are_unstated_wanted(search, analysis, knowns, spent);
        sensitivities((search, fitted), &linear_fit, knowns, wanted)
    };
    // One run has the sensitivities to all inputs. Without known ones it need not come before the tests.
    let early = (!knowns.is_empty()).then(inputs);
    let known = match &early {
        Some((found, found_warnings)) => {
            warnings.append(found_warnings.clone());
            found.as_ref().and_then(|found| KnownErrors::of(knowns, found).ok())
        }
        None => linear_fit.identified.contains(&true).then(KnownErrors::none),
    };
    let finer = Finer::new((search, fitted), (&local.covariance, &local.noise.weights), &corrected);
    let apart_from_known = |optimum: &Optimum, warnings: &mut Warnings| {
        let noise = Noise::at(search, optimum);
        known.as_ref().and_then(|known| known.explained((search, optimum), &noise, warnings))
    };
    let on_finer = |warnings: &mut Warnings| {
        let residuals = finer.residuals()?;
        let finest = Optimum { residuals, ..fitted.clone() };
        Some(apart_from_known(&finest, warnings).unwrap_or(finest))
    };
    let before = warnings.clone();
    // From here on residuals are what known numbers do not explain,
    let mut explained = apart_from_known(fitted, &mut warnings);
    let mut local = match &explained {
        Some(explained) => local_with((search, explained), Some(&local.bounds))?,
        None => local,
    };
    // and what numerics do not leave, where they are no noise.
    let is_noise = is_noise(search, explained.as_ref().unwrap_or(fitted), &local);
    let mut warnings_there = before;
    let finest = if is_noise { None } else { on_finer(&mut warnings_there) };
    let is_finest = finest.is_some();
    if let Some(finest) = finest {
        warnings = warnings_there;
        local = local_with((search, &finest), Some(&local.bounds))?;
        explained = Some(finest);
    }
    let optimum = explained.as_ref().unwrap_or(fitted);
    let finest = || (!is_finest).then(|| on_finer(&mut Warnings::default())).flatten();
    let Local { noise, correlations, adequacy, covariance, bounds } = &local;
    let reach = (&correlations.reach[..], &corrected);
    let estimates = estimates(unknowns, optimum, (covariance, bounds), reach);
    let estimates = cluster_jackknife(estimates, (search, fitted), &corrected);
    let sigma = search.estimated_sigmas(optimum);
    let (sigma_narrow, test_narrow) = match are_across(&estimates) {
        true => ("", ""),
        false => (". The intervals are too narrow", ". The intervals are too narrow"),
    };

    bounded_from_one_side(search.unknowns, &estimates, &mut warnings);
    bounds_reached(unknowns, optimum, covariance, &mut warnings);
    unexplained(search, optimum, &local, sigma_narrow, &mut warnings);
    growing_sensitivities(search, optimum, &mut warnings);
    runaways(search, optimum, &mut warnings);
    faulty_recordings(experiments, &mut warnings);
    against_priors(unknowns, optimum, &mut warnings);
    steps_too_large(search.experiments, &mut warnings);
    if !search.explained(optimum) {
        suspicions.iter().for_each(|(code, words)| warnings.add(Weight::Suspicion, *code, words));
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
            None => shifts_of((search, optimum), &local, analysis, &mut said)?,
        };
        Ok::<_, Error>((shifts, said))
    };
    let asked = (analysis, knowns);
    let found: Found = (search, optimum, &finest);
    let statistics = Statistics { estimates: &estimates, noise, correlations, adequacy };
    // Runs on other meshes, one with the derivatives by the inputs, and one of a coarse model: none waits for another.
    let late = || if early.is_none() { Some(inputs()) } else { None };
    let (shifts, (late, (unsaid, not_looked))) =
        rayon::join(shifts, || rayon::join(late, || unsaid_of(found, statistics, asked, spent)));
    let (shifts, not_known) = shifts?;
    if is_tested {
        residual_tests =
            test_residuals((search, optimum), correlations, test_narrow, &mut warnings);
        against_noise_scale(search, adequacy, &mut warnings);
        stated_sigmas(search, adequacy, &mut warnings);
        jumps(search, optimum, &mut warnings);
        warnings.append(not_known);
        if let Some(shifts) = &shifts {
            let about = (search, optimum);
            discretization = errors_of(&estimates, about, shifts, noise, &mut warnings);
            if shifts.are_to_blame() {
                warnings.excuse_misfit(
                    Code::NumericsBelowData,
                    "most of the residuals are discretization errors: the data are more accurate than the 1e-4 of \
                     a value for which mesh and step are chosen. The noise tests are not valid. Give a finer \
                     rod.segments and time.step",
                );
            }
        }
    }
    let (estimates, profiles) = match optimum.converged && covariance.findings.is_empty() {
        true => {
            let around = (covariance, noise, correlations);
            analysed(estimates, (search, optimum), around, (analysis, &sigma), &mut warnings)
        }
        false => (estimates, Vec::new()),
    };
    let given = Given {
        known: known.as_ref(),
        analysis,
        discretization: &discretization,
        sigma: &sigma,
        correlations,
    };
    let mut estimates = budgeted(estimates, (search, optimum), given, &mut warnings);
    let inputs = early.iter().chain(&late).find_map(|(found, _)| found.as_ref());
    let mut groups = Vec::new();
    if let Some(inputs) = inputs {
        inputs.give_per_cents(search, &mut estimates);
        groups = determined_groups(search, &estimates, inputs);
    }
    late.into_iter().for_each(|(_, found_warnings)| warnings.append(found_warnings));
    scene_notes(search, fitted, &mut warnings);
    other_numberings(search, optimum, &estimates, &mut warnings);
    too_thick((search, optimum), covariance, noise, &estimates, &mut warnings);
    warnings.append(not_looked);
    explained_by(&unsaid.score_tests, &mut warnings);
    if is_tested && shifts.as_ref().is_some_and(Shifts::leave_traces) {
        warnings.excuse_ambiguity(
            Code::NumericsBelowData,
            "a part of the residuals is discretization error: the data are more accurate than the 1e-4 of a value \
             for which mesh and step are chosen. A small missing effect cannot be separated from it. Give a finer \
             rod.segments and time.step",
        );
    }
    let about = (covariance, &sigma[..]);
    let predictions = predictions(experiments, (search, optimum), about, &mut warnings);
    let losses = losses(search, optimum, noise);
    let noise_scale = adequacy.coordinates.iter().map(|c| c.scale.clone()).collect();
    Ok(Assessment {
        estimates,
        residual_rms: residual_rms(search, fitted),
        losses,
        covariance: Some(local.covariance),
        sigma,
        discretization,
        residual_tests,
        noise_scale,
        predictions,
        unsaid,
        determined_groups: groups,
        recordings: RecordingErrors::of(experiments, (search, optimum)),
        profiles,
        warnings,
    })
}

/// The sensitivities to the known inputs, and to the unstated ones if `with_unstated`; a run that fails is a warning.
fn sensitivities(
    (search, optimum): (&Search, &Optimum),
    fit: &LinearFit,
    knowns: &[Known],
    with_unstated: bool,
) -> (Option<InputSensitivities>, Warnings) {
    let mut warnings = Warnings::default();
    if search.is_stopped() || !fit.identified.contains(&true) {
        return (None, warnings);
    }
    let sensitivities_to =
        |unstated: bool| InputSensitivities::new(search, optimum, fit, knowns, unstated);
    let mut found = sensitivities_to(with_unstated);
    if let Err(error) = &found
        && with_unstated
    {
        let words = format!(
            "the sensitivities to inputs are unknown: the run with their derivatives failed ({error}). Estimates \
             and intervals are not affected"
        );
        warnings.add(Weight::Note, Code::NoSensitivityAnalysis, words);
        found = sensitivities_to(false);
    }
    if let Err(error) = &found {
        let words = format!(
            "the uncertainty budget is missing: its simulation failed ({error}). The interval is \
                             statistical only. Check the stated inputs"
        );
        warnings.add(Weight::Note, Code::NoBudget, words);
    }
    (found.ok(), warnings)
}

/// What data without noise at an optimum would be worth with theirs: what another mesh would say is not asked.
pub(crate) fn expected(
    (search, optimum): (&Search, &Optimum),
    (analysis, knowns): (&Analysis, &[Known]),
) -> Result<Assessment, Error> {
    let local = local_analysis::local(search, optimum)?;
    let mut warnings = Warnings::default();
    let with_unstated = analysis.sensitivity_analysis != Some(false);
    let (inputs, not_found) =
        sensitivities((search, optimum), &local.linear_fit(), knowns, with_unstated);
    warnings.append(not_found);
    let known = inputs.as_ref().and_then(|found| KnownErrors::of(knowns, found).ok());
    let Local { noise, correlations, adequacy, covariance, bounds } = &local;
    let reach = (&correlations.reach[..], &Shifts::default());
    let estimates = estimates(search.unknowns, optimum, (covariance, bounds), reach);
    bounded_from_one_side(search.unknowns, &estimates, &mut warnings);
    steps_too_large(search.experiments, &mut warnings);
    let sensitivity_analysis = Some(with_unstated);
    let analysis = &Analysis { monte_carlo: 0, sensitivity_analysis, ..analysis.clone() };
    let given = Given {
        known: known.as_ref(),
        analysis,
        discretization: &[],
        sigma: &search.sigmas,
        correlations,
    };
    let mut estimates = budgeted(estimates, (search, optimum), given, &mut warnings);
    let asked = (analysis, knowns);
    let found: Found = (search, optimum, &|| None);
    let statistics = Statistics { estimates: &estimates, noise, correlations, adequacy };
    let (unsaid, not_looked) = unsaid_of(found, statistics, asked, search.simulations());
    if let Some(inputs) = &inputs {
        inputs.give_per_cents(search, &mut estimates);
    }
    warnings.append(not_looked);
    let covariance = Some(covariance.clone());
    Ok(Assessment { estimates, covariance, unsaid, warnings, ..Assessment::default() })
}

/// What the scene may lack and what could hide, after a search of so many simulations.
fn unsaid_of(
    found: Found,
    statistics: Statistics,
    asked: (&Analysis, &[Known]),
    spent: f64,
) -> (Unsaid, Warnings) {
    let mut warnings = Warnings::default();
    let unsaid = match statistics.estimates.iter().all(|e| e.std_error.is_none()) {
        true => Unsaid::default(),
        false => unsaid(found, statistics, (asked, spent), &mut warnings),
    };
    (unsaid, warnings)
}

/// The estimates with what was asked for beyond them, and the profiles.
fn analysed(
    estimates: Vec<Estimate>,
    (search, optimum): (&Search, &Optimum),
    (covariance, noise, correlations): (&Covariance, &Noise, &Correlations),
    (analysis, sigma): (&Analysis, &[f64]),
    warnings: &mut Warnings,
) -> (Vec<Estimate>, Vec<Profile>) {
    let n = estimates.len();
    let observed = match analysis.observed_information {
        true => observed::std_errors(search, optimum, (noise, correlations), &estimates, warnings),
        false => vec![None; n],
    };
    let intervals = match analysis.profile {
        true => profile::intervals(search, optimum, (covariance, noise, correlations), warnings),
        false => vec![None; n],
    };
    let bootstrap = match analysis.bootstrap {
        0 => vec![None; n],
        count => {
            let (first, seed) = (analysis.bootstrap_first.unwrap_or(0), analysis.seed);
            let (numbers, kept) = (first..first + count, analysis.bootstrap_first.is_some());
            let replicates = Replicates { what: "bootstrap", numbers, seed, kept };
            let draws = Draws { sigma, knowns: &[], correlations, blocks: true };
            bootstrap::spreads((search, optimum), draws, replicates, warnings)
        }
    };
    let unknowns = search.unknowns;
    let profile = |(i, interval): (usize, &Option<profile::Interval>)| {
        Some(interval.as_ref()?.profile(&unknowns[i], correlations.reach[i]))
    };
    let profiles = intervals.iter().enumerate().filter_map(profile).collect();
    let all = estimates.into_iter().zip(observed).zip(intervals).zip(bootstrap).zip(unknowns);
    let with = |((((estimate, observed_std_error), interval), bootstrap), unknown): (
        (((Estimate, _), Option<profile::Interval>), _),
        _,
    )| Estimate {
        observed_std_error,
        profile95: interval.map(|interval| interval.values(unknown)),
        bootstrap,
        ..estimate
    };
    (all.map(with).collect(), profiles)
}

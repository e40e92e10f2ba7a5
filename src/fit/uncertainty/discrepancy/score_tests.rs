//! Score tests of omitted effects, and the undetected biases by effects that the data do not exclude.
//!
//! A number `k` of the scene with an error `dk` changes the weighted residuals by `d dk`, `d = dr/dk`. The unknowns of
//! the fit respond, so that only the part `u = d - P d` remains, with the projection `P` onto the columns of the
//! Jacobian. The score test compares `u` with the residuals `r`:
//!
//! ```text
//! z = -u.r/sqrt(u'Vu)    k = -u.r/|u|^2
//! ```
//!
//! with the covariance `V` of the [noise](crate::fit::uncertainty::noise::autocorrelation); `k` is the estimated size.
//! Where white residuals are the estimate of `V`, it is that without the effect.
//! It requires the derivative, and no fit. Where `|u|` is small the data cannot detect the effect, and a plausible size
//! of it biases the parameters. One run has all derivatives. It is one of the full model where the search cost at least
//! [`COST_OF_DERIVATIVES`] simulations or on request, else one of a coarse model. A corrected p-value on the coarse
//! model below [`SUSPICIOUS`] requires a run of the full model after all.
//!
//! P-values are those of the normal distribution or Student's t, one-sided for numbers that cannot be smaller. They are
//! multiplied by the number of tested effects plus [`RESIDUAL_TESTS`] (Bonferroni). If the best is significant on the
//! full model, all tests are repeated with residuals without discretization errors, where these can be computed. The
//! result of `assess`, a [`ModelDiscrepancy`], has the tests of the first three ranks and the biases. It is empty after
//! an interruption, without standard errors, where the options exclude the tests or their cost is too high, and with a
//! warning (`Ambiguous`) where a run fails. [`warn_of_omitted_effects`] adds the warning of the best rank.

use crate::code::Code;
use crate::error::Error;
use crate::fit::known::Known;
use crate::fit::measurement::experiment::{Experiment, full_work};
use crate::fit::search::coarse::ScanModel;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::budget::input_changes::InputChange;
use crate::fit::uncertainty::budget::input_directions::InputDirections;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::discrepancy::findings::{
    ScoreTest, UndetectedBias, likely_omitted_effects,
};
use crate::fit::uncertainty::discrepancy::fit_statistics::{FitStatistics, StandardizedBias};
use crate::fit::uncertainty::discrepancy::ranking::{ScoredEffect, ranked};
use crate::fit::uncertainty::discrepancy::tested_effects::{ExtendedExperiments, TestedEffect};
use crate::fit::uncertainty::discrepancy::undetected_bias::{
    EffectPosterior, MOST_RELINEARIZED, undetected_biases,
};
use crate::fit::uncertainty::noise::adequacy::VarianceAlong;
use crate::fit::uncertainty::noise::residual_noise::weighted_residuals;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::numerics::total_order;
use crate::scene::Parameter;
use crate::scene::number::Quantity;
use nalgebra::DVector;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use std::cmp::Reverse;

/// Steps of the coarse model in the first period. Larger: more accurate derivatives at a higher cost.
const COARSE_STEPS: f64 = 48.0;
/// Norm of the part `u` of the change by an effect that the unknowns cannot follow, over the norm of the change, above
/// which the effect is tested; below it are rounding errors.
const LEAST_ORTHOGONAL: f64 = 1e-3;
/// An effect whose plausible size changes all residuals together (norm) by at most this part of the standard deviation
/// of the noise has no effect, for example by symmetry: its derivative is a rounding error.
const NO_EFFECT: f64 = 1e-3;
/// Cost of a run with derivatives by some thirty numbers, in simulations without derivatives.
const COST_OF_DERIVATIVES: f64 = 6.0;
/// Largest cost of the tests on a coarse model, over that of the search. Above it they are skipped, unless requested.
const CHEAP: f64 = 0.3;
/// Tests of the residuals beside the score tests: independence, distribution, noise scale. Each is corrected for its
/// own coordinates, and counts as one among the tests of a report.
const RESIDUAL_TESTS: f64 = 3.0;
/// Corrected p-value below which the warning of an effect has the severity `Misfit`, that of an inadequate model.
const CERTAIN: f64 = 1e-3;
/// Bias of an estimate, in its standard errors, below which an omitted effect hardly matters: the 95 % interval then
/// still contains the truth in more than 83 % of all cases.
const SMALL_BIAS: f64 = 1.0;
/// Corrected p-value from which on the evidence for an omitted effect is called weak.
const STRONG_EVIDENCE: f64 = 0.01;
/// Estimated angle, rad, from which on the linearization of its effect has no meaning.
const LARGEST_ANGLE: f64 = 1.0;
/// Largest change of gravity over its size: a wrong sign, with a margin for the linearization.
const LARGEST_GRAVITY: f64 = 2.5;
/// Corrected p-value on a coarse model below which the full model is tested.
const SUSPICIOUS: f64 = 0.2;

/// Model discrepancy: effects that the scene lacks, or may lack.
#[derive(Default)]
pub(crate) struct ModelDiscrepancy {
    /// Tests of the first three ranks, the best first.
    pub score_tests: Vec<ScoreTest>,
    /// Undetected biases, the largest over its standard error first.
    pub undetected_bias: Vec<UndetectedBias>,
}

/// Computes the optimum with the residuals of a finer discretization; none where it is not needed or cannot be
/// computed.
pub(crate) type FinerOptimum<'a> = &'a (dyn Fn() -> Option<Optimum> + Sync);

/// Inputs of all score tests of a fit.
#[derive(Clone, Copy)]
pub(crate) struct ScoreTestInputs<'a> {
    /// The optimum with its analysis and estimates.
    pub statistics: FitStatistics<'a>,
    /// Computes the optimum with residuals without discretization errors; called where an effect is significant.
    pub finer: FinerOptimum<'a>,
    /// Options of the fit.
    pub analysis: &'a Analysis,
    /// Inputs with a stated uncertainty, which are no omitted effects.
    pub knowns: &'a [Known],
}

/// Probability that noise alone yields a statistic of `sigmas` standard deviations or more: larger than it if
/// `is_one_sided`, else larger in absolute value. The distribution is Student's t with `freedom` degrees of freedom, or
/// normal without them.
fn p_value(sigmas: f64, is_one_sided: bool, freedom: Option<f64>) -> f64 {
    let upper_tail = |z: f64| match freedom.and_then(|n| StudentsT::new(0.0, 1.0, n).ok()) {
        Some(t) => t.sf(z),
        None => Normal::standard().sf(z),
    };
    if is_one_sided { upper_tail(sigmas) } else { 2.0 * upper_tail(sigmas.abs()) }
}

/// Whether the estimated change of the number of a tested effect is possible. An angle must change by less than
/// [`LARGEST_ANGLE`], gravity by at most [`LARGEST_GRAVITY`] times its largest component. A positive number must remain
/// above zero in every scene of `experiments` that has it.
fn is_possible(test: &ScoreTest, experiments: &[Experiment]) -> bool {
    if test.unit == "rad" && test.estimate.abs() >= LARGEST_ANGLE {
        return false;
    }
    if test.source.starts_with("loads.gravity.") {
        let gravity = experiments.iter().flat_map(|e| e.problem.scene().loads.gravity);
        let largest = gravity.map(f64::abs).fold(0.0, f64::max);
        return test.estimate.abs() <= LARGEST_GRAVITY * largest;
    }
    let Ok(parameter) = test.source.parse::<Parameter>() else { return true };
    let Quantity { is_positive, may_vanish, .. } = parameter.quantity();
    let values = experiments.iter().filter_map(|e| parameter.of(e.problem.scene()));
    !is_positive || may_vanish || values.into_iter().all(|value| value + test.estimate > 0.0)
}

/// Adds one warning of the effects of the best rank of `tests`. Nothing is added unless its best test is significant,
/// or where discretization errors are suspected (a warning of the severity `Mesh`). The severity is `Misfit` if the
/// p-value, and the one with the autocorrelation as noise, are below [`CERTAIN`], else `Ambiguous`. The warning is
/// minor if all effects of the rank change all estimates by less than [`SMALL_BIAS`] standard errors.
pub(crate) fn warn_of_omitted_effects(tests: &[ScoreTest], warnings: &mut Warnings) {
    let is_mesh_suspected = warnings.first(Severity::Mesh).is_some();
    let Some(best) = tests.first().filter(|best| best.is_significant() && !is_mesh_suspected)
    else {
        return;
    };
    let Some(effects) = likely_omitted_effects(tests).into_iter().next() else { return };
    let is_certain = best.p_value.max(best.p_value_if_correlated.unwrap_or(0.0)) < CERTAIN;
    let severity = if is_certain { Severity::Misfit } else { Severity::Ambiguous };
    let evidence = if best.p_value < STRONG_EVIDENCE { "" } else { "weak evidence: " };
    let text = format!("{evidence}the residuals are best explained by {effects}");
    // Effects of one rank cannot be separated: any of them may be the cause.
    let same = tests.iter().take_while(|test| test.rank == best.rank);
    match same.max_by(|a, b| a.bias_std_errors.total_cmp(&b.bias_std_errors)) {
        Some(ScoreTest { bias_std_errors: bias, biased_parameter: parameter, .. })
            if *bias < SMALL_BIAS && !parameter.is_empty() =>
        {
            let consequence = format!("It changes {parameter} by {bias:.1} standard errors");
            let action = "Add it to the scene, or fit it (--extend)";
            let text = format!("{text}. {consequence}. {action}");
            warnings.add_minor(severity, Code::OmittedEffect, text);
        }
        _ => warnings.add(severity, Code::OmittedEffect, text),
    }
}

impl ScoreTestInputs<'_> {
    /// Returns score tests and undetected biases, and their warnings, after a search that cost `spent` simulations.
    /// Empty after an interruption, where the analysis excludes them, and without any standard error. Unless the
    /// analysis requests them, they are empty too where even a coarse model is too expensive. A run that fails leaves
    /// them empty, with a warning that lowers the grade.
    pub fn assess(self, spent: f64) -> (ModelDiscrepancy, Warnings) {
        let mut warnings = Warnings::default();
        let FitStatistics { fitted, estimates, .. } = self.statistics;
        if fitted.search.is_stopped()
            || self.analysis.sensitivity_analysis == Some(false)
            || estimates.iter().all(|e| e.std_error.is_none())
        {
            return (ModelDiscrepancy::default(), warnings);
        }
        let found = self.run_on_cheapest_model(spent).unwrap_or_else(|error| {
            if matches!(error, Error::Interrupted) {
                return ModelDiscrepancy::default();
            }
            let text = format!(
                "omitted effects were not tested: the run of the model with these effects failed ({error}). A missing \
                 effect may bias the estimates. Check the scene"
            );
            warnings.add(Severity::Ambiguous, Code::NoSensitivityAnalysis, text);
            ModelDiscrepancy::default()
        });
        (found, warnings)
    }

    /// Score tests and undetected biases by omitted effects: on the full model if the search cost at least
    /// [`COST_OF_DERIVATIVES`] simulations (`spent`), or on request; else on a coarse one. If the best p-value there is
    /// below [`SUSPICIOUS`], the full model is used after all. Empty where the coarse model costs more than [`CHEAP`]
    /// times `spent` and the tests were not requested. Error: a run fails.
    fn run_on_cheapest_model(self, spent: f64) -> Result<ModelDiscrepancy, Error> {
        let search = self.statistics.fitted.search;
        let full = || self.run(search.experiments.to_vec(), false);
        // The derivatives of a coarse model have errors that hide small effects.
        if COST_OF_DERIVATIVES <= spent || self.analysis.sensitivity_analysis == Some(true) {
            return full();
        }
        let coarse = ScanModel::new(search, &search.first_periods(1.0), COARSE_STEPS)?;
        let coarse = coarse.search(search).experiments.to_vec();
        // Rods between recorded ends keep their meshes, so that a coarse model may be no cheaper.
        let cost = COST_OF_DERIVATIVES * full_work(&coarse)? / search.full_work;
        if self.analysis.sensitivity_analysis.is_none() && cost > CHEAP * spent {
            return Ok(ModelDiscrepancy::default());
        }
        let found = Self { finer: &|| None, ..self }.run(coarse, true)?;
        match found.score_tests.first() {
            Some(best) if best.p_value < SUSPICIOUS => full(),
            _ => Ok(found),
        }
    }

    /// Score tests and biases by one run of these `experiments` with derivatives: the full model or a coarse one
    /// (`is_coarse`). If the best test is significant, all are repeated with the residuals of `finer`, if it returns
    /// any. P-values are multiplied by the number of tested effects plus [`RESIDUAL_TESTS`]. Effects that the unknowns
    /// follow but for [`LEAST_ORTHOGONAL`] of their change, or below [`NO_EFFECT`] of the noise, are not tested; their
    /// bias follows from the plausible size alone. Of the full model, up to [`MOST_RELINEARIZED`] large effects are
    /// linearized again, by a run each. If the residuals are rounding errors, there are no score tests. Error: the run
    /// fails, or the fit is stopped.
    fn run(self, experiments: Vec<Experiment>, is_coarse: bool) -> Result<ModelDiscrepancy, Error> {
        let Self { statistics, finer, analysis, knowns } = self;
        let FitStatistics { fitted, estimates, local } = statistics;
        let (search, noise) = (fitted.search, &local.noise);
        let ExtendedExperiments { experiments, effects } =
            ExtendedExperiments::new(fitted, analysis, knowns, experiments)?;
        let changes: Vec<&InputChange> = effects.iter().map(|tested| &tested.change).collect();
        let directions = InputDirections::new(fitted, &experiments, &local.linear_fit(), &changes)?;
        search.report("omitted effects");
        let responses = directions.responses();
        let orthogonal = directions.orthogonal_changes();
        // Effects that the parameters follow entirely leave rounding errors.
        let direction = |k: usize| {
            let direction = orthogonal.column(k).into_owned();
            let size = directions.changes.column(k).norm();
            let has_effect = size > NO_EFFECT * noise.variance.sqrt();
            (has_effect && direction.norm() > LEAST_ORTHOGONAL * size).then_some(direction)
        };

        // Score tests. Rounding errors are no noise, and are not tested.
        let is_tested = !search.is_rounding(fitted.optimum);
        let tests = |residuals: &DVector<f64>| {
            let tested = effects.iter().enumerate().filter(|_| is_tested);
            let mut scored: Vec<ScoredEffect> = tested
                .filter_map(|(k, e)| {
                    Some(e.scored(direction(k)?, residuals, statistics, &responses[k]))
                })
                .collect();
            // Bonferroni over all tests of the report that can lower its grade.
            let count = scored.len() as f64 + RESIDUAL_TESTS;
            let corrected = |p: f64| (count * p).min(1.0);
            for ScoredEffect { test, .. } in &mut scored {
                test.p_value = corrected(test.p_value);
                test.p_value_if_correlated = test.p_value_if_correlated.map(corrected);
            }
            // Impossible numbers, as negative densities and large angles, are no causes.
            scored.retain(|ScoredEffect { test, .. }| is_possible(test, &experiments));
            ranked(scored, residuals, |along| statistics.variance_along(along).variance)
        };
        let mut residuals = weighted_residuals(fitted, noise);
        let mut score_tests = tests(&residuals);
        // Before an effect is reported, discretization errors are removed from the residuals.
        if score_tests.first().is_some_and(ScoreTest::is_significant)
            && let Some(finer) = finer()
        {
            residuals = weighted_residuals(Fitted { search, optimum: &finer }, noise);
            score_tests = tests(&residuals);
        }

        // Undetected biases. Without noise nothing measures an effect that the data exclude.
        let mut posteriors = Vec::new();
        for (k, tested) in effects.iter().enumerate() {
            let likelihood = direction(k).map(|along| statistics.likelihood(&along, &residuals));
            if likelihood.is_none_or(|l| l.std_error.is_normal()) {
                posteriors.push(EffectPosterior::new(tested, likelihood, responses[k].clone()));
            }
        }
        // The largest ones are linearized again, on the full model only, whose residuals these are.
        let mut order: Vec<usize> =
            (0..posteriors.len()).filter(|k| !is_coarse && posteriors[*k].is_large()).collect();
        order.sort_by_cached_key(|k| Reverse(total_order(posteriors[*k].largest_change())));
        for k in order.into_iter().take(MOST_RELINEARIZED) {
            let change = &posteriors[k].tested.change;
            let slope = posteriors[k].response.slope.clone();
            let again = |mode: f64| statistics.relinearize(&experiments, change, &slope, mode);
            // An effect of that size may not be possible to simulate: the first linearization stays.
            if let Err(Error::Interrupted) = posteriors[k].relinearize(again) {
                return Err(Error::Interrupted);
            }
        }
        let undetected_bias = undetected_biases(&posteriors, search.unknowns, estimates);
        Ok(ModelDiscrepancy { score_tests, undetected_bias })
    }
}

impl TestedEffect {
    /// The score test of the effect by the weighted `residuals`, with uncorrected p-values and without a rank. The
    /// plausible size changes them by `direction`, which is orthogonal to the Jacobian, and the unknowns on their
    /// scales by `responses`. The explained part is `|u.r|/|u|`, 0 for an effect of the wrong sign.
    /// `p_value_if_correlated` is set only if autocorrelated noise has the larger variance along the direction.
    fn scored(
        &self,
        direction: DVector<f64>,
        residuals: &DVector<f64>,
        statistics: FitStatistics,
        responses: &[Option<f64>],
    ) -> ScoredEffect {
        let LocalAnalysis { noise, correlations, .. } = statistics.local;
        // Residuals are simulated less measured values: an effect that the scene lacks leaves the opposite of its
        // change.
        let (product, is_one_sided) = (-direction.dot(residuals), self.effect.is_one_sided());
        let explained = if is_one_sided { product.max(0.0) } else { product.abs() };
        let VarianceAlong { variance, degrees_of_freedom } = statistics
            .variance_along(&direction)
            .without_effect(&direction, residuals, product, noise);
        // A second p-value, if the autocorrelation of the residuals is that of the noise and not of the effect.
        let correlated = correlations.variance_along(direction.as_slice(), noise);
        let fewest = correlations.fewest_degrees_of_freedom();
        let p = |variance: f64, freedom| p_value(product / variance.sqrt(), is_one_sided, freedom);
        // The estimated size of the effect, in plausible sizes, biases the parameters.
        let sizes = product / direction.norm_squared();
        let StandardizedBias { std_errors, parameter, relative } =
            statistics.largest_bias(responses, sizes);
        let test = ScoreTest {
            source: self.effect.path.to_string(),
            effect: self.name.clone(),
            rank: 0,
            estimate: sizes * self.plausible_size,
            unit: self.effect.parameter().unit().to_string(),
            z_score: product / variance.sqrt(),
            p_value: p(variance, degrees_of_freedom),
            p_value_if_correlated: (correlated > variance).then(|| p(correlated, fewest)),
            bias_std_errors: std_errors,
            biased_parameter: parameter,
            relative_bias: relative.filter(|relative| relative.is_finite()),
        };
        ScoredEffect { test, explained: explained / direction.norm(), sizes, direction }
    }
}

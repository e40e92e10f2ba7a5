//! What the scene may lack: tests of what is left for everything that could explain it, and what could be off
//! without leaving anything.
//!
//! A number `k` of the scene that is off by `dk` leaves `d dk` in the residuals, `d = dr/dk`, of which the fit
//! takes `P d` with it. The score test asks whether the rest of the direction, `u = d - P d`, is in the residuals `r`
//! by more than chance:
//!
//! ```text
//! z = -u.r/sqrt(u'Vu)    k = -u.r/|u|^2
//! ```
//!
//! with the covariance `V` of the [noise](crate::fit::uncertainty::noise::autocorrelation), whose neighbours may resemble each other. It
//! needs a derivative, and no fit. Where `|u|` is small the data cannot tell; what a plausible size then does to the
//! parameters is what could hide, and where a plausible size would be seen, the largest that would not. One run of a coarse
//! model has all derivatives; where that finds something, one of the full model.

use crate::code::Code;
use crate::error::Error;
use crate::fit::known::Known;
use crate::fit::measurement::experiment::{Experiment, full_work};
use crate::fit::search::coarse::Coarse;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::budget::input_changes::{Change, InputDirections};
use crate::fit::uncertainty::covariance::gauss_newton::LinearFit;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::discrepancy::findings::{
    ScoreTest, UndetectedBias, likely_omitted_effects,
};
use crate::fit::uncertainty::discrepancy::omitted_terms::{EXTENSIONS, Extension, Sizes};
use crate::fit::uncertainty::discrepancy::ranking::{Scored, ranked};
use crate::fit::uncertainty::discrepancy::undetected_bias::{
    Answer, Effect, Likelihood, MOST_RELINEARIZED, Posterior, Weighed, biases,
};
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::{Severity, Warnings};
use crate::fit::uncertainty::noise::adequacy::VarianceAlong;
use crate::fit::uncertainty::noise::residual_noise::weighted_residuals;
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::scene::Parameter;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use std::cmp::Reverse;

/// Steps of the coarse model in the first period.
const COARSE_STEPS: f64 = 48.0;
/// Part of a direction that the unknowns must leave, to be looked for in the residuals.
const LEFT: f64 = 1e-3;
/// An effect of plausible size that changes all residuals together by less than this part of the noise has none: by
/// symmetry, for example, with rounding errors for a derivative.
const NO_EFFECT: f64 = 1e-3;
/// A run with derivatives by some thirty numbers costs so many without, and may cost this part of a fit.
const BY_DERIVATIVES: f64 = 6.0;
const CHEAP: f64 = 0.3;
/// Tests of the residuals beside the score tests: independence, distribution, noise scale. Each is corrected for its own
/// coordinates, and counts as one among the tests of a report.
const RESIDUAL_TESTS: f64 = 3.0;
/// What chance makes less often than this speaks against the result.
const SURE: f64 = 1e-3;
/// Bias of an estimate, in its standard errors, below which an omitted effect hardly matters: the 95 % interval then still
/// contains the truth in more than 83 % of all cases.
const SMALL_BIAS: f64 = 1.0;
/// What chance makes less often than this by a coarse model is looked at by the full one.
const SUSPICIOUS: f64 = 0.2;

/// Model discrepancy: effects that the scene lacks, or may lack.
#[derive(Default)]
pub(crate) struct ModelDiscrepancy {
    /// Those of the first three places, the best first.
    pub score_tests: Vec<ScoreTest>,
    /// The largest effect over its standard error first.
    pub undetected_bias: Vec<UndetectedBias>,
}

/// An optimum with the residuals of a finer discretization, where it is needed and can be computed.
pub(crate) type FinerOptimum<'a> = &'a (dyn Fn() -> Option<Optimum> + Sync);

/// Statistics of an optimum that score tests use.
#[derive(Clone, Copy)]
pub(crate) struct FitStatistics<'a> {
    pub fitted: Fitted<'a>,
    pub estimates: &'a [Estimate],
    pub local: &'a LocalAnalysis,
}

impl FitStatistics<'_> {
    fn variance_along(&self, direction: &DVector<f64>) -> VarianceAlong {
        let LocalAnalysis { noise, correlations, adequacy, .. } = self.local;
        adequacy.variance_along(direction.as_slice(), noise, correlations)
    }

    /// What the residuals `left` determine of the size of an effect along `direction`.
    fn likelihood(&self, direction: &DVector<f64>, left: &DVector<f64>) -> Likelihood {
        let square = direction.norm_squared();
        let deviation = self.variance_along(direction).variance.sqrt();
        Likelihood { estimate: -direction.dot(left) / square, std_error: deviation / square }
    }

    /// The largest change of an estimate by an effect of so many plausible sizes, in its standard errors, with its name.
    fn largest_bias(&self, answers: &[Option<f64>], sizes: f64) -> (f64, String) {
        let unknowns = self.fitted.search.unknowns;
        let bias = |((e, answer), unknown): ((&Estimate, &Option<f64>), &Unknown)| {
            let change = sizes * (*answer)? * unknown.slope(e.value?);
            Some(((change / e.std_error?).abs(), e.label()))
        };
        let all = self.estimates.iter().zip(answers).zip(unknowns).filter_map(bias);
        all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default()
    }

    fn linear_fit(&self) -> LinearFit {
        self.local.linear_fit()
    }
}

/// A term that a scene may lack.
struct Term {
    extension: &'static Extension,
    words: String,
    /// Its plausible size.
    size: f64,
    /// The change of the scenes by that size.
    change: Change,
}

/// The experiments with every term added that they can have, and the terms with their plausible sizes.
fn extended(
    fitted: Fitted,
    analysis: &Analysis,
    knowns: &[Known],
    mut experiments: Vec<Experiment>,
) -> Result<(Vec<Experiment>, Vec<Term>), Error> {
    let search = fitted.search;
    let mut found = Vec::new();
    let sizes = |experiment: &Experiment| {
        Ok::<_, Error>(Sizes::of(experiment, &fitted.problem(experiment)?))
    };
    let sizes: Vec<Sizes> = search.experiments.iter().map(sizes).collect::<Result<_, _>>()?;
    for extension in &EXTENSIONS {
        let parameter = extension.parameter();
        let said = search.unknowns.iter().any(|u| u.parameter == parameter)
            || knowns.iter().any(|k| k.parameter == parameter);
        let stated = analysis.plausible.get(extension.place).copied();
        let usual = |sizes: &Sizes| (extension.plausible)(sizes);
        let plausible = sizes.iter().find_map(|sizes| Some(stated.unwrap_or(usual(sizes)?)));
        let Some(size) = plausible.filter(|size| !said && size.is_finite() && *size > 0.0) else {
            continue;
        };
        let mut names = Vec::new();
        for (experiment, sizes) in experiments.iter_mut().zip(&sizes) {
            if let Some(problem) = extension.added(&experiment.problem, sizes) {
                experiment.problem = problem;
                names.push(experiment.name.clone());
            }
        }
        if !names.is_empty() {
            let scenes = experiments.iter().map(|e| e.problem.scene());
            let words = scenes.filter_map(|scene| extension.words_in(scene)).next();
            let words = words.unwrap_or_else(|| extension.words.into());
            let number = Unknown { experiments: names, ..Unknown::new(parameter) };
            found.push((extension, words, size, number));
        }
    }
    let term = |(extension, words, size, number): (&'static Extension, String, f64, Unknown)| {
        let place = extension.place;
        let change = match extension.beside {
            None => Change::by(&experiments, place, &number, size),
            Some(beside) => {
                let other = Unknown { parameter: Parameter::at(beside.place), ..number.clone() };
                let own = Change::by(&experiments, place, &number, beside.own * size);
                own.and(Change::by(&experiments, place, &other, beside.other * size))
            }
        };
        Term { extension, words, size, change }
    };
    let terms = found.into_iter().map(term).collect();
    Ok((experiments, terms))
}

/// How often noise alone is as many standard deviations off.
fn chance(sigmas: f64, one_sided: bool, freedom: Option<f64>) -> f64 {
    let above = |z: f64| match freedom.and_then(|freedom| StudentsT::new(0.0, 1.0, freedom).ok()) {
        Some(t) => t.sf(z),
        None => Normal::standard().sf(z),
    };
    if one_sided { above(sigmas) } else { 2.0 * above(sigmas.abs()) }
}

/// Score tests of omitted effects and undetected biases, after a search that `spent` so many simulations; a run that fails
/// is a warning.
pub(crate) fn assess_model_discrepancy(
    statistics: FitStatistics,
    finer: FinerOptimum,
    analysis: &Analysis,
    knowns: &[Known],
    spent: f64,
) -> (ModelDiscrepancy, Warnings) {
    let mut warnings = Warnings::default();
    let is_stopped = statistics.fitted.search.is_stopped();
    if is_stopped
        || analysis.sensitivity_analysis == Some(false)
        || statistics.estimates.iter().all(|e| e.std_error.is_none())
    {
        return (ModelDiscrepancy::default(), warnings);
    }
    let inputs = TestInputs { statistics, finer, analysis, knowns };
    let found = inputs.run_on_cheapest_model(spent).unwrap_or_else(|error| {
        let words = format!(
            "omitted effects were not tested: the run of a coarse model failed ({error}). A missing effect may \
             bias the estimates. Check the scene"
        );
        warnings.add(Severity::Note, Code::NoSensitivityAnalysis, words);
        ModelDiscrepancy::default()
    });
    (found, warnings)
}

/// Warns of effects that the score tests find missing. A right model with autocorrelated noise has none below
/// [`SURE`] if that correlation is allowed for; what is significant for white noise only, or less sure, may be noise.
pub(crate) fn warn_of_omitted_effects(tests: &[ScoreTest], warnings: &mut Warnings) {
    let blames_the_mesh = warnings.first(Severity::Mesh).is_some();
    let Some(best) = tests.first().filter(|best| best.is_significant() && !blames_the_mesh) else {
        return;
    };
    let Some(words) = likely_omitted_effects(tests).into_iter().next() else { return };
    let is_sure = best.p_value.max(best.p_value_if_correlated.unwrap_or(0.0)) < SURE;
    let severity = if is_sure { Severity::Misfit } else { Severity::Ambiguous };
    let words = format!("the residuals are best explained by {words}");
    // Effects of one rank are not distinguishable: any of them may be the cause.
    let same = tests.iter().take_while(|test| test.rank == best.rank);
    match same.max_by(|a, b| a.bias_std_errors.total_cmp(&b.bias_std_errors)) {
        Some(ScoreTest { bias_std_errors: bias, biased_parameter: parameter, .. })
            if *bias < SMALL_BIAS && !parameter.is_empty() =>
        {
            let consequence = format!("It changes {parameter} by {bias:.1} standard errors");
            let action = "Add it to the scene, or fit it (--extend)";
            let words = format!("{words}. {consequence}. {action}");
            warnings.add_minor(severity, Code::OmittedEffect, words);
        }
        _ => warnings.add(severity, Code::OmittedEffect, words),
    }
}

/// Inputs of all score tests of a fit.
#[derive(Clone, Copy)]
struct TestInputs<'a> {
    statistics: FitStatistics<'a>,
    finer: FinerOptimum<'a>,
    analysis: &'a Analysis,
    knowns: &'a [Known],
}

impl TestInputs<'_> {
    /// Tests on a coarse model; where an effect may be missing, on the full model.
    fn run_on_cheapest_model(self, spent: f64) -> Result<ModelDiscrepancy, Error> {
        let search = self.statistics.fitted.search;
        let full = Model { experiments: search.experiments.to_vec(), is_coarse: false };
        // The derivatives of a coarse model have errors that hide small effects.
        if BY_DERIVATIVES <= spent || self.analysis.sensitivity_analysis == Some(true) {
            return self.run(full);
        }
        let coarse = Coarse::new(search, &search.first_periods(1.0), COARSE_STEPS)?;
        let coarse = coarse.task(search).experiments.to_vec();
        // Rods between recorded ends keep their meshes.
        let cost = BY_DERIVATIVES * full_work(&coarse)? / search.full_work;
        if self.analysis.sensitivity_analysis.is_none() && cost > CHEAP * spent {
            return Ok(ModelDiscrepancy::default());
        }
        let model = Model { experiments: coarse, is_coarse: true };
        let found = Self { finer: &|| None, ..self }.run(model)?;
        match found.score_tests.first() {
            Some(best) if best.p_value < SUSPICIOUS => self.run(full),
            _ => Ok(found),
        }
    }

    /// Score tests and biases by the derivatives of a model.
    fn run(self, Model { experiments, is_coarse }: Model) -> Result<ModelDiscrepancy, Error> {
        let Self { statistics, finer, analysis, knowns } = self;
        let FitStatistics { fitted, estimates, local: LocalAnalysis { noise, .. } } = statistics;
        let search = fitted.search;
        let (experiments, terms) = extended(fitted, analysis, knowns, experiments)?;
        let changes: Vec<&Change> = terms.iter().map(|term| &term.change).collect();
        let directions =
            InputDirections::of(fitted, &experiments, &statistics.linear_fit(), &changes)?;
        search.report("omitted effects");
        let answers = directions.answers();
        let [whole, unfollowed] = directions.unfollowed();
        // Effects that the parameters follow entirely leave rounding errors.
        let direction = |k: usize| {
            let along = unfollowed.column(k).into_owned();
            let size = whole.column(k).norm();
            let is_seen = size > NO_EFFECT * noise.variance.sqrt();
            (is_seen && along.norm() > LEFT * size).then_some(along)
        };
        // Rounding errors are no noise.
        let tested = !search.is_rounding(fitted.optimum);
        let tests = |left: &DVector<f64>| {
            let mut scored = Vec::new();
            for (k, term) in terms.iter().enumerate().filter(|_| tested) {
                if let Some(along) = direction(k) {
                    scored.push(term.scored(along, left, statistics, &answers[k]));
                }
            }
            // Bonferroni over all tests of the report that can lower its grade.
            let count = scored.len() as f64 + RESIDUAL_TESTS;
            let corrected = |p: f64| (count * p).min(1.0);
            for Scored { test, .. } in &mut scored {
                test.p_value = corrected(test.p_value);
                test.p_value_if_correlated = test.p_value_if_correlated.map(corrected);
            }
            ranked(scored, left, |along| statistics.variance_along(along).variance)
        };
        let mut residuals = weighted_residuals(fitted, noise);
        let mut score_tests = tests(&residuals);
        if score_tests.first().is_some_and(ScoreTest::is_significant)
            && let Some(finer) = finer()
        {
            residuals = weighted_residuals(Fitted { search, optimum: &finer }, noise);
            score_tests = tests(&residuals);
        }
        let mut weighed = Vec::new();
        for (k, term) in terms.iter().enumerate() {
            let likelihood = direction(k).map(|along| statistics.likelihood(&along, &residuals));
            // Without noise there is no scale for what the data exclude.
            if likelihood.is_some_and(|l| !l.std_error.is_normal()) {
                continue;
            }
            let effect = term.effect();
            let posterior = Posterior::new(likelihood, effect.is_one_sided);
            let slope = answers[k].clone();
            let answer = Answer { about: 0.0, moved: vec![Some(0.0); slope.len()], slope };
            weighed.push(Weighed { term: k, effect, likelihood, posterior, answer });
        }
        // The largest of them again, where they are: on the full model only, whose residuals these are.
        if !is_coarse {
            let mut order: Vec<usize> =
                (0..weighed.len()).filter(|k| weighed[*k].is_large()).collect();
            order.sort_by_cached_key(|x| Reverse(total_order(weighed[*x].largest_change())));
            for k in order.into_iter().take(MOST_RELINEARIZED) {
                let change = changes[weighed[k].term];
                let slope = weighed[k].answer.slope.clone();
                let again =
                    |mode: f64| relinearized(statistics, &experiments, change, &slope, mode);
                // An effect of that size may not be possible to simulate: the first linearization stays.
                if let Err(Error::Interrupted) = weighed[k].relinearized(again) {
                    return Err(Error::Interrupted);
                }
            }
        }
        let undetected_bias = biases(&weighed, search.unknowns, estimates);
        Ok(ModelDiscrepancy { score_tests, undetected_bias })
    }
}

/// Experiments whose derivatives score tests take.
struct Model {
    experiments: Vec<Experiment>,
    is_coarse: bool,
}

/// Likelihood of an effect, and the answer of the unknowns to it, linearized at `mode` plausible sizes.
fn relinearized(
    statistics: FitStatistics,
    experiments: &[Experiment],
    change: &Change,
    slope: &[Option<f64>],
    mode: f64,
) -> Result<(Likelihood, Answer), Error> {
    let Fitted { search, optimum } = statistics.fitted;
    let mut there = optimum.clone();
    for ((x, by), unknown) in there.x.iter_mut().zip(slope).zip(search.unknowns) {
        let [low, high] = unknown.scaled_bounds();
        *x = (*x + mode * by.unwrap_or(0.0)).clamp(low, high);
    }
    let shifted = Fitted { search, optimum: &there };
    let fit = statistics.linear_fit();
    let directions = InputDirections::of(shifted, experiments, &fit, &[&change.about(mode)])?;
    there.residuals = directions.residuals.clone();
    let shifted = Fitted { search, optimum: &there };
    let residuals = weighted_residuals(shifted, &statistics.local.noise);
    // One Gauss-Newton step from there, with the effect held.
    let steps = directions.answers_to(&DMatrix::from_column_slice(
        residuals.len(),
        1,
        residuals.as_slice(),
    ));
    let [_, unfollowed] = directions.unfollowed();
    let mut likelihood = statistics.likelihood(&unfollowed.column(0).into_owned(), &residuals);
    likelihood.estimate += mode;
    let moved = |j: usize| Some(there.x[j] - optimum.x[j] + steps[0][j]?);
    let moved = (0..there.x.len()).map(moved).collect();
    let slope = directions.answers().remove(0);
    Ok((likelihood, Answer { about: mode, moved, slope }))
}

impl Term {
    /// The effect without its data.
    fn effect(&self) -> Effect<'_> {
        Effect {
            source: self.extension.place,
            name: &self.words,
            plausible_size: self.size,
            unit: self.extension.parameter().unit(),
            test: self.extension.test,
            is_one_sided: self.extension.is_one_sided(),
        }
    }

    /// Its score test along what the unknowns cannot follow, by the residuals `left`.
    fn scored(
        &self,
        along: DVector<f64>,
        left: &DVector<f64>,
        statistics: FitStatistics,
        answers: &[Option<f64>],
    ) -> Scored {
        let LocalAnalysis { noise, correlations, .. } = statistics.local;
        let Self { extension, words, size, .. } = self;
        let (product, one_sided) = (-along.dot(left), extension.is_one_sided());
        let takes = if one_sided { product.max(0.0) } else { product.abs() } / along.norm();
        let VarianceAlong { variance, degrees_of_freedom } = statistics.variance_along(&along);
        let correlated = correlations.variance_along(along.as_slice(), noise);
        let fewest = correlations.freedom.iter().flatten().copied().reduce(f64::min);
        let p_of = |variance: f64, freedom| chance(product / variance.sqrt(), one_sided, freedom);
        let sizes = product / along.norm_squared();
        let (bias_std_errors, biased_parameter) = statistics.largest_bias(answers, sizes);
        let test = ScoreTest {
            source: extension.place.to_string(),
            effect: words.clone(),
            rank: 0,
            estimate: sizes * size,
            unit: extension.parameter().unit().to_string(),
            z_score: product / variance.sqrt(),
            p_value: p_of(variance, degrees_of_freedom),
            p_value_if_correlated: (correlated > variance).then(|| p_of(correlated, fewest)),
            bias_std_errors,
            biased_parameter,
        };
        Scored { test, takes, along }
    }
}

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
//! with the covariance `V` of the [noise](crate::fit::uncertainty::correlation), whose neighbours may resemble each other. It
//! needs a derivative, and no fit. Where `|u|` is small the data cannot tell; what a plausible size then does to the
//! parameters is what could hide, and where a plausible size would be seen, the largest that would not. One run of a coarse
//! model has all derivatives; where that finds something, one of the full model.

use crate::code::Code;
use crate::error::Error;
use crate::fit::known::Known;
use crate::fit::measurement::experiment::{Experiment, full_work};
use crate::fit::search::Search;
use crate::fit::search::coarse::Coarse;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::adequacy::{Adequacy, VarianceAlong};
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::correlation::Correlations;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::extensions::{EXTENSIONS, Extension, Sizes};
use crate::fit::uncertainty::inputs::{Change, Directions};
use crate::fit::uncertainty::noise::{Noise, left};
use crate::fit::uncertainty::ranking::{Scored, ranked};
use crate::fit::uncertainty::sources::{ScoreTest, UndetectedBias, looks_like};
use crate::fit::uncertainty::undetected_bias::{
    Answer, Effect, Likelihood, MOST_RELINEARIZED, Posterior, Weighed, biases,
};
use crate::fit::uncertainty::verdict::{Warnings, Weight};
use crate::fit::unknown::Unknown;
use crate::numerics::order;
use crate::scene::Parameter;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

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
/// What chance makes less often than this by a coarse model is looked at by the full one.
const SUSPICIOUS: f64 = 0.2;

/// What a coarse model says of numbers that the fit leaves alone.
#[derive(Default)]
pub(crate) struct Unsaid {
    /// Those of the first three places, the best first.
    pub score_tests: Vec<ScoreTest>,
    /// The largest effect over its standard error first.
    pub undetected_bias: Vec<UndetectedBias>,
}

/// An optimum, and how to have it with the residuals of finer numerics, where it has not and they can tell.
pub(crate) type Found<'a> = (&'a Search<'a>, &'a Optimum, &'a (dyn Fn() -> Option<Optimum> + Sync));
/// Statistics of an optimum that score tests rest on.
#[derive(Clone, Copy)]
pub(crate) struct Statistics<'a> {
    pub estimates: &'a [Estimate],
    pub noise: &'a Noise,
    pub correlations: &'a Correlations,
    pub adequacy: &'a Adequacy,
}

impl Statistics<'_> {
    fn variance_along(&self, direction: &DVector<f64>) -> VarianceAlong {
        self.adequacy.variance_along(direction.as_slice(), self.noise, self.correlations)
    }

    /// What the residuals `left` determine of the size of an effect along `direction`.
    fn likelihood(&self, direction: &DVector<f64>, left: &DVector<f64>) -> Likelihood {
        let square = direction.norm_squared();
        let deviation = self.variance_along(direction).variance.sqrt();
        Likelihood { estimate: -direction.dot(left) / square, std_error: deviation / square }
    }
}

/// A term that a scene may lack.
struct Term {
    extension: &'static Extension,
    words: String,
    /// Its plausible size.
    size: f64,
}

/// Terms, with what they change.
type Terms = Vec<(Term, Change)>;

/// The experiments with every term added that they can have, and the terms with their plausible sizes.
fn extended(
    search: &Search,
    optimum: &Optimum,
    (analysis, knowns): (&Analysis, &[Known]),
    mut experiments: Vec<Experiment>,
) -> Result<(Vec<Experiment>, Terms), Error> {
    let mut found = Vec::new();
    let sizes = |experiment: &Experiment| {
        let own = search.unknowns.iter().zip(&optimum.x).filter(|(u, _)| u.is_of(experiment));
        let values = own.map(|(u, x)| (u.parameter, u.from_scale(*x)));
        let problem = experiment.problem.varied(values)?;
        Ok::<_, Error>(Sizes::of(experiment, &problem))
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
            found.push((Term { extension, words, size }, number));
        }
    }
    let change = |(term, number): (Term, Unknown)| {
        let place = term.extension.place;
        let change = match term.extension.beside {
            None => Change::by(&experiments, place, &number, term.size),
            Some(beside) => {
                let other = Unknown { parameter: Parameter::at(beside.place), ..number.clone() };
                let own = Change::by(&experiments, place, &number, beside.own * term.size);
                own.and(Change::by(&experiments, place, &other, beside.other * term.size))
            }
        };
        (term, change)
    };
    let found = found.into_iter().map(change).collect();
    Ok((experiments, found))
}

/// How often noise alone is as many standard deviations off.
fn chance(sigmas: f64, one_sided: bool, freedom: Option<f64>) -> f64 {
    let above = |z: f64| match freedom.and_then(|freedom| StudentsT::new(0.0, 1.0, freedom).ok()) {
        Some(t) => t.sf(z),
        None => Normal::standard().sf(z),
    };
    if one_sided { above(sigmas) } else { 2.0 * above(sigmas.abs()) }
}

/// Looks for all of it, after a search that `spent` so many simulations.
pub(crate) fn unsaid(
    found: Found,
    statistics: Statistics,
    (asked, spent): ((&Analysis, &[Known]), f64),
    warnings: &mut Warnings,
) -> Unsaid {
    let (analysis, _) = asked;
    if found.0.is_stopped() || analysis.sensitivity_analysis == Some(false) {
        return Unsaid::default();
    }
    looked_for(found, statistics, (asked, spent)).unwrap_or_else(|error| {
        let words = format!(
            "omitted effects were not tested: the run of a coarse model failed ({error}). A missing effect may \
             bias the estimates. Check the scene"
        );
        warnings.add(Weight::Note, Code::NoSensitivityAnalysis, words);
        Unsaid::default()
    })
}

/// Warns of effects that the score tests find missing. A right model with autocorrelated noise has none below
/// [`SURE`] if that correlation is allowed for; what is significant for white noise only, or less sure, may be noise.
pub(crate) fn explained_by(tests: &[ScoreTest], warnings: &mut Warnings) {
    let blames_the_mesh = warnings.first(Weight::Mesh).is_some();
    let Some(best) = tests.first().filter(|best| best.is_significant() && !blames_the_mesh) else {
        return;
    };
    let Some(words) = looks_like(tests).into_iter().next() else { return };
    let is_sure = best.p_value.max(best.p_value_if_correlated.unwrap_or(0.0)) < SURE;
    let weight = if is_sure { Weight::Misfit } else { Weight::Ambiguous };
    warnings.add(
        weight,
        Code::OmittedEffect,
        format!("the residuals are best explained by {words}"),
    );
}

/// By a coarse model; where that finds that something may be missing, the full model decides.
fn looked_for(
    (search, optimum, finer): Found,
    statistics: Statistics,
    (asked, spent): ((&Analysis, &[Known]), f64),
) -> Result<Unsaid, Error> {
    let full = Model { experiments: search.experiments.to_vec(), is_coarse: false };
    let is_asked = asked.0.sensitivity_analysis == Some(true);
    // The derivatives of a coarse model have errors that hide small effects.
    if BY_DERIVATIVES <= spent || is_asked {
        return looked_for_by(full, (search, optimum, finer), statistics, asked);
    }
    let coarse = Coarse::new(search, &search.first_periods(1.0), COARSE_STEPS)?;
    let coarse = coarse.task(search).experiments.to_vec();
    // Rods between recorded ends keep their meshes.
    let cost = BY_DERIVATIVES * full_work(&coarse)? / search.full_work;
    if asked.0.sensitivity_analysis.is_none() && cost > CHEAP * spent {
        return Ok(Unsaid::default());
    }
    let model = Model { experiments: coarse, is_coarse: true };
    let found = looked_for_by(model, (search, optimum, &|| None), statistics, asked)?;
    match found.score_tests.first() {
        Some(best) if best.p_value < SUSPICIOUS => {
            looked_for_by(full, (search, optimum, finer), statistics, asked)
        }
        _ => Ok(found),
    }
}

/// Experiments whose derivatives score tests take.
struct Model {
    experiments: Vec<Experiment>,
    is_coarse: bool,
}

/// Score tests and biases by the derivatives of a model.
fn looked_for_by(
    Model { experiments, is_coarse }: Model,
    (search, optimum, finer): Found,
    statistics: Statistics,
    (analysis, knowns): (&Analysis, &[Known]),
) -> Result<Unsaid, Error> {
    let Statistics { estimates, noise, .. } = statistics;
    let asked = (analysis, knowns);
    let (experiments, extensions) = extended(search, optimum, asked, experiments)?;
    let (terms, changes): (Vec<Term>, Vec<Change>) = extensions.into_iter().unzip();
    let run = (search, optimum, &experiments[..]);
    let identified: Vec<bool> = estimates.iter().map(|e| e.identifiable).collect();
    let around = (&identified[..], &noise.weights[..]);
    let directions = Directions::of(run, around, &changes.iter().collect::<Vec<_>>())?;
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
    let tested = !search.is_rounding(optimum);
    let tests = |optimum: &Optimum| {
        let left = left(search, optimum, noise);
        let mut scored = Vec::new();
        for (k, term) in terms.iter().enumerate().filter(|_| tested) {
            if let Some(along) = direction(k) {
                scored.push(term.scored(along, &left, statistics));
            }
        }
        // Bonferroni over all tests of the report that can lower its grade.
        let count = scored.len() as f64 + RESIDUAL_TESTS;
        let corrected = |p: f64| (count * p).min(1.0);
        for Scored { test, .. } in &mut scored {
            test.p_value = corrected(test.p_value);
            test.p_value_if_correlated = test.p_value_if_correlated.map(corrected);
        }
        ranked(scored, &left, |along| statistics.variance_along(along).variance)
    };
    let mut score_tests = tests(optimum);
    let mut residuals = left(search, optimum, noise);
    if score_tests.first().is_some_and(ScoreTest::is_significant)
        && let Some(finer) = finer()
    {
        score_tests = tests(&finer);
        residuals = left(search, &finer, noise);
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
        let mut order: Vec<usize> = (0..weighed.len()).filter(|k| weighed[*k].is_large()).collect();
        order::sort_down_by(&mut order, |k| weighed[*k].largest_change());
        for k in order.into_iter().take(MOST_RELINEARIZED) {
            let change = &changes[weighed[k].term];
            let slope = weighed[k].answer.slope.clone();
            let again = |mode: f64| relinearized(run, statistics, (change, &slope), mode);
            // An effect of that size may not be possible to simulate: the first linearization stays.
            if let Err(Error::Interrupted) = weighed[k].relinearized(again) {
                return Err(Error::Interrupted);
            }
        }
    }
    let undetected_bias = biases(&weighed, search.unknowns, estimates);
    Ok(Unsaid { score_tests, undetected_bias })
}

/// Likelihood of an effect, and the answer of the unknowns to it, linearized at `mode` plausible sizes.
fn relinearized(
    (search, optimum, experiments): (&Search, &Optimum, &[Experiment]),
    statistics: Statistics,
    (change, slope): (&Change, &[Option<f64>]),
    mode: f64,
) -> Result<(Likelihood, Answer), Error> {
    let Statistics { estimates, noise, .. } = statistics;
    let identified: Vec<bool> = estimates.iter().map(|e| e.identifiable).collect();
    let mut there = optimum.clone();
    for ((x, by), unknown) in there.x.iter_mut().zip(slope).zip(search.unknowns) {
        let [low, high] = unknown.scaled_bounds();
        *x = (*x + mode * by.unwrap_or(0.0)).clamp(low, high);
    }
    let run = (search, &there, experiments);
    let around = (&identified[..], &noise.weights[..]);
    let directions = Directions::of(run, around, &[&change.about(mode)])?;
    there.residuals = directions.residuals.clone();
    let residuals = left(search, &there, noise);
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
    fn scored(&self, along: DVector<f64>, left: &DVector<f64>, statistics: Statistics) -> Scored {
        let Statistics { noise, correlations, .. } = statistics;
        let Self { extension, words, size } = self;
        let (product, one_sided) = (-along.dot(left), extension.is_one_sided());
        let takes = if one_sided { product.max(0.0) } else { product.abs() } / along.norm();
        let VarianceAlong { variance, degrees_of_freedom } = statistics.variance_along(&along);
        let correlated = correlations.variance_along(along.as_slice(), noise);
        let fewest = correlations.freedom.iter().flatten().copied().reduce(f64::min);
        let p_of = |variance: f64, freedom| chance(product / variance.sqrt(), one_sided, freedom);
        let test = ScoreTest {
            source: extension.place.to_string(),
            effect: words.clone(),
            rank: 0,
            estimate: product / along.norm_squared() * size,
            unit: extension.parameter().unit().to_string(),
            z_score: product / variance.sqrt(),
            p_value: p_of(variance, degrees_of_freedom),
            p_value_if_correlated: (correlated > variance).then(|| p_of(correlated, fewest)),
        };
        Scored { test, takes, along }
    }
}

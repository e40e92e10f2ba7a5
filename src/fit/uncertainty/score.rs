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
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::correlation::Correlations;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::extensions::{EXTENSIONS, Extension, Sizes};
use crate::fit::uncertainty::inputs::{Change, Directions, effect, one_per_cent, per_cents};
use crate::fit::uncertainty::noise::{Noise, left};
use crate::fit::uncertainty::ranking::{Scored, ranked};
use crate::fit::uncertainty::sources::{CouldHide, PerCent, ScoreTest, looks_like};
use crate::fit::uncertainty::verdict::{Warnings, Weight};
use crate::fit::unknown::Unknown;
use crate::numerics::order;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Steps of the coarse model in the first period.
const COARSE_STEPS: f64 = 48.0;
/// Part of a direction that the unknowns must leave, to be looked for in the residuals.
const LEFT: f64 = 1e-3;
/// What would be seen at so many sigma cannot hide; what is so much smaller that it is not, can.
const SEEN: f64 = 3.0;
/// A run with derivatives by some thirty numbers costs so many without, and may cost this part of a fit.
const BY_DERIVATIVES: f64 = 6.0;
const CHEAP: f64 = 0.3;
/// What chance makes less often than this speaks against the result.
const SURE: f64 = 1e-3;
/// What chance makes less often than this by a coarse model is looked at by the full one.
const SUSPICIOUS: f64 = 0.2;

/// What a coarse model says of numbers that the fit leaves alone.
#[derive(Default)]
pub(crate) struct Unsaid {
    /// Of every estimate.
    pub per_cents: Vec<Vec<PerCent>>,
    /// Those of the first three places, the best first.
    pub score_tests: Vec<ScoreTest>,
    /// The largest effect over its standard error first.
    pub could_hide: Vec<CouldHide>,
}

impl Unsaid {
    /// Every estimate takes what one per cent of other numbers would change.
    pub fn give_per_cents(&mut self, estimates: &mut [Estimate]) {
        let per_cents = std::mem::take(&mut self.per_cents).into_iter();
        estimates.iter_mut().zip(per_cents).for_each(|(e, per_cents)| e.one_per_cent = per_cents);
    }
}

/// An optimum, and how to have it with the residuals of finer numerics, where it has not and they can tell.
pub(crate) type Found<'a> = (&'a Search<'a>, &'a Optimum, &'a (dyn Fn() -> Option<Optimum> + Sync));
/// What is known about it.
type Around<'a> = (&'a [Estimate], &'a Noise, &'a Correlations);

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
        let change = Change::by(&experiments, term.extension.place, &number, term.size);
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
    around: Around,
    (asked, spent): ((&Analysis, &[Known]), f64),
    warnings: &mut Warnings,
) -> Unsaid {
    let (analysis, _) = asked;
    if found.0.is_stopped() || analysis.what_if == Some(false) {
        return Unsaid::default();
    }
    looked_for(found, around, (asked, spent)).unwrap_or_else(|error| {
        let words = format!(
            "what other numbers would change, and what the scene may lack, is unknown: the run of a coarse \
             model failed ({error})"
        );
        warnings.add(Weight::Note, Code::NoWhatIf, words);
        Unsaid::default()
    })
}

/// Warns of what is left where chance hardly explains it and a term does.
pub(crate) fn explained_by(tests: &[ScoreTest], warnings: &mut Warnings) {
    let blames_the_mesh = warnings.first(Weight::Mesh).is_some();
    let sure = tests.first().is_some_and(|best| best.p_value < SURE);
    if let Some(best) = looks_like(tests).first().filter(|_| sure && !blames_the_mesh) {
        let words = format!("what is left looks like {best}");
        warnings.add(Weight::Misfit, Code::LooksLike, words);
    }
}

/// By a coarse model; where that finds that something may be missing, the full model decides.
fn looked_for(
    (search, optimum, finer): Found,
    around: Around,
    (asked, spent): ((&Analysis, &[Known]), f64),
) -> Result<Unsaid, Error> {
    let coarse = Coarse::new(search, &search.first_periods(1.0), COARSE_STEPS)?;
    let coarse = coarse.task(search).experiments.to_vec();
    // Rods between recorded ends keep their meshes.
    let cost = BY_DERIVATIVES * full_work(&coarse)? / search.full_work;
    if asked.0.what_if.is_none() && cost > CHEAP * spent {
        return Ok(Unsaid::default());
    }
    let found = looked_for_by(coarse, (search, optimum, &|| None), around, asked)?;
    match found.score_tests.first() {
        Some(best) if best.p_value < SUSPICIOUS => {
            looked_for_by(search.experiments.to_vec(), (search, optimum, finer), around, asked)
        }
        _ => Ok(found),
    }
}

/// By these experiments.
fn looked_for_by(
    experiments: Vec<Experiment>,
    (search, optimum, finer): Found,
    (estimates, noise, correlations): Around,
    (analysis, knowns): (&Analysis, &[Known]),
) -> Result<Unsaid, Error> {
    let asked = (analysis, knowns);
    let (experiments, extensions) = extended(search, optimum, asked, experiments)?;
    let mut changes = one_per_cent(search, knowns);
    let inputs = changes.len();
    let mut terms = Vec::new();
    for (term, change) in extensions {
        changes.push(change);
        terms.push(term);
    }
    let run = (search, optimum, &experiments[..]);
    let identified: Vec<bool> = estimates.iter().map(|e| e.identifiable).collect();
    let directions = Directions::of(run, (&identified, &noise.weights), &changes)?;
    search.report("what is not said");
    let answers = directions.answers();
    let inputs_only = (&changes[..inputs], &answers[..inputs]);
    let [whole, unfollowed] = directions.unfollowed();
    // As few as the noise of any unknown is known by.
    let freedom = correlations.freedom.iter().flatten().copied().reduce(f64::min);
    // Rounding errors are no noise.
    let tested = !search.is_rounding(optimum);
    let tests = |optimum: &Optimum| {
        let left = left(search, optimum, noise);
        let mut scored = Vec::new();
        for (k, Term { extension, words, size }) in terms.iter().enumerate().filter(|_| tested) {
            let along = unfollowed.column(inputs + k).into_owned();
            let norm = along.norm();
            if norm <= LEFT * whole.column(inputs + k).norm() {
                continue;
            }
            let deviation = correlations.variance_along(along.as_slice(), noise).sqrt();
            let (product, one_sided) = (-along.dot(&left), extension.is_one_sided());
            let takes = if one_sided { product.max(0.0) } else { product.abs() } / norm;
            let test = ScoreTest {
                source: extension.place.to_string(),
                words: words.clone(),
                place: 0,
                estimate: product / norm.powi(2) * size,
                unit: extension.parameter().unit().to_string(),
                sigmas: product / deviation,
                p_value: chance(product / deviation, one_sided, freedom),
            };
            scored.push(Scored { test, takes, along });
        }
        // By chance any of them would be as significant so many times as often.
        let looked = scored.len() as f64;
        scored.iter_mut().for_each(|s| s.test.p_value = (looked * s.test.p_value).min(1.0));
        ranked(scored, &left, |along| correlations.variance_along(along.as_slice(), noise))
    };
    let mut score_tests = tests(optimum);
    if score_tests.first().is_some_and(ScoreTest::is_significant)
        && let Some(finer) = finer()
    {
        score_tests = tests(&finer);
    }
    let mut could_hide = Vec::new();
    for (k, Term { extension, words, size }) in terms.iter().enumerate() {
        let along = unfollowed.column(inputs + k);
        let deviation = correlations.variance_along(along.as_slice(), noise).sqrt();
        let visible = if deviation > 0.0 { along.norm_squared() / deviation } else { 0.0 };
        let part = if visible > SEEN { SEEN / visible } else { 1.0 };
        if part < 1.0 && !tested {
            continue;
        }
        for (j, estimate) in estimates.iter().enumerate() {
            let (Some(value), Some(std_error)) = (estimate.value, estimate.std_error) else {
                continue;
            };
            // What makes the residuals change is what the fit makes up for: with the other sign.
            let moved = answers[inputs + k][j].map(|moved| -moved);
            let Some((change, relative)) = effect(&search.unknowns[j], value, moved) else {
                continue;
            };
            could_hide.push(CouldHide {
                source: extension.place.to_string(),
                words: words.clone(),
                size: part * size,
                unit: extension.parameter().unit().to_string(),
                parameter: estimate.label(),
                change: part * change,
                relative: relative.map(|relative| part * relative),
                std_errors: part * change.abs() / std_error,
                visible: part * visible,
                tell: extension.tell.into(),
            });
        }
    }
    order::sort_down_by(&mut could_hide, |x| x.std_errors);
    Ok(Unsaid { per_cents: per_cents(search, estimates, inputs_only), score_tests, could_hide })
}

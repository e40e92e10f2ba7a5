//! The posterior distribution at an optimum: chains in parallel, results of the parameters, and warnings.
//!
//! Input are the optimum with its local analysis, the settings and the seed. Each chain has residuals, a target and a
//! random stream of its own, so that results do not depend on the number of threads. Draws are corrected for the bias
//! by mesh and step as the estimates are, but reflected at bounds, and converted to the units of the parameters. The
//! residuals are those of the simulation: parts that errors of inputs or of the mesh explain stay in them. Output is a
//! [`SampledPosterior`]: one summary per unknown, and all draws. R-hat above [`LARGEST_R_HAT`], fewer than
//! [`FEWEST_EFFECTIVE`] effective draws and divergences are a warning. Autocorrelated noise is another one, as the
//! likelihood is that of white noise. There is no posterior, with a note, where it cannot be normalized: with an
//! unknown without bounds and prior whose logarithm the data do not determine, and with a measurement without sigma
//! that has no more values than there are unknowns. A note also has the reason where a chain cannot start or move.

use crate::code::Code;
use crate::error::Error;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::discretization::bias::DiscretizationBias;
use crate::fit::uncertainty::posterior::density::PosteriorDensity;
use crate::fit::uncertainty::posterior::diagnostics::Diagnostics;
use crate::fit::uncertainty::posterior::draws::{PosteriorDraw, PosteriorDraws};
use crate::fit::uncertainty::posterior::sampler::{SampledChain, sample_chain};
use crate::fit::uncertainty::posterior::settings::PosteriorSettings;
use crate::fit::uncertainty::posterior::standardization::StandardizedDensity;
use crate::fit::uncertainty::posterior::summary::Posterior;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::fit::unknown::Unknown;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Largest R-hat of a usable sample (Vehtari et al. 2021).
const LARGEST_R_HAT: f64 = 1.01;
/// Fewest effective draws of a usable sample, 100 for each of four chains (Vehtari et al. 2021).
const FEWEST_EFFECTIVE: f64 = 400.0;
/// Largest standard deviation of the logarithm of an unknown without bounds and prior. At zero the density is then
/// `e^-18` of the largest one, less than one draw of any sample.
const LARGEST_DEVIATION: f64 = 1.0 / 6.0;
/// Number of draws, of all chains, between two reports of progress.
const REPORTED_DRAWS: usize = 100;
/// Standard error with autocorrelated noise over that without, above which the posterior is too narrow.
const LARGEST_INFLATION: f64 = 1.1;

/// Posterior distribution of all unknowns.
pub(crate) struct SampledPosterior {
    /// One per unknown, in their order.
    pub summaries: Vec<Posterior>,
    pub draws: PosteriorDraws,
}

/// A chain in the units of the parameters.
struct ParameterChain {
    draws: Vec<PosteriorDraw>,
    divergences: usize,
}

/// Samples the posterior distribution of a fit at its optimum. `bias` corrects the draws for mesh and step. Adds
/// warnings about the quality of the sample. None, with a note, if the posterior cannot be normalized or no chain can
/// start; none after a stop.
pub(crate) fn sampled_posterior(
    fitted: Fitted,
    local: &LocalAnalysis,
    bias: &DiscretizationBias,
    settings: PosteriorSettings,
    seed: u64,
    warnings: &mut Warnings,
) -> Option<SampledPosterior> {
    let search = fitted.search;
    let mut missing = |reason: &str| {
        let text = format!("no posterior distribution: {reason}");
        warnings.add(Severity::Note, Code::NoPosterior, text);
    };
    if let Some(unknown) = improper(fitted, local) {
        missing(&format!(
            "the data do not exclude that {unknown} is many times smaller or larger, and a prior that is flat in its \
             logarithm has no finite integral. Give bounds or a prior"
        ));
        return None;
    }
    let count = search.unknowns.len();
    let has_few = |own: &MeasuredResiduals| {
        let is_integrated =
            own.measurement.sigma().is_none() && !own.measurement.loss().is_robust();
        is_integrated && own.rows.len() <= count + own.measurement.fitted_nuisances()
    };
    if let Some(own) = fitted.measured().find(has_few) {
        missing(&format!(
            "a measurement has {} values, which {count} parameters can fit without an error, so that its noise has no \
             lower limit. State sigma",
            own.rows.len()
        ));
        return None;
    }
    let done = AtomicUsize::new(0);
    let chains: Vec<Result<ParameterChain, String>> = (0..settings.chains)
        .into_par_iter()
        .map(|number| parameter_chain(fitted, local, bias, settings, seed, number, &done))
        .collect();
    if search.is_stopped() {
        return None;
    }
    let chains = match chains.into_iter().collect::<Result<Vec<ParameterChain>, String>>() {
        Ok(chains) => chains,
        Err(reason) => {
            missing(&reason);
            return None;
        }
    };
    let divergences: usize = chains.iter().map(|chain| chain.divergences).sum();
    let names = search.unknowns.iter().map(Unknown::to_string).collect();
    let chains = chains.into_iter().map(|chain| chain.draws).collect();
    let draws = PosteriorDraws { names, chains };
    let all = 0..search.unknowns.len();
    let Some(summaries) = all.map(|i| summary(&draws, i, divergences)).collect::<Option<Vec<_>>>()
    else {
        missing(&match divergences {
            0 => "the chains did not move. Give bounds".to_string(),
            _ => format!(
                "the chains did not move, because {divergences} of {} draws diverged. Give bounds within which the \
                 motion can be simulated",
                settings.chains * settings.draws
            ),
        });
        return None;
    };
    warn_of_quality(&draws.names, &summaries, warnings);
    // Errors of estimated weights inflate too, and are no correlation.
    let is_correlated = local.correlations.series.iter().any(|series| series.is_correlated);
    let inflation = local.correlations.inflation.iter().copied().fold(1.0, f64::max);
    if is_correlated && inflation > LARGEST_INFLATION {
        let text = "the posterior distribution is too narrow: its likelihood is that of white noise, and the \
                    residuals are autocorrelated. Use the standard errors, which include the correlation";
        warnings.add(Severity::Note, Code::PosteriorTooNarrow, text);
    }
    Some(SampledPosterior { summaries, draws })
}

/// An unknown whose posterior has no finite integral, or a tail that a sample reaches: it has neither two bounds nor a
/// prior, and the data bound it from one side only or determine its logarithm to more than [`LARGEST_DEVIATION`].
fn improper<'a>(fitted: Fitted<'a>, local: &LocalAnalysis) -> Option<&'a Unknown> {
    // The limits of a parameter itself are far from any value that the data may have.
    let is_open = |unknown: &Unknown| {
        let has_limits = unknown.scaled_bounds().into_iter().all(f64::is_finite);
        unknown.prior.is_none() && (unknown.bounds.is_none() || !has_limits)
    };
    let is_wide = |j: usize| local.covariance.deviation[j].is_none_or(|sd| sd > LARGEST_DEVIATION);
    let mut pairs = fitted.search.unknowns.iter().zip(&local.bounds).enumerate();
    let found = pairs.find(|(j, (unknown, bound))| {
        let is_one_sided = bound.is_some_and(|bound| bound.is_one_sided());
        is_open(unknown) && (is_one_sided || unknown.is_logarithm() && is_wide(*j))
    });
    found.map(|(_, (unknown, _))| unknown)
}

/// Chain `number` in the units of the parameters. `done` counts the draws of all chains, for reports of progress. An
/// error with the reason, for a message, if it cannot start, or after a stop.
fn parameter_chain(
    fitted: Fitted,
    local: &LocalAnalysis,
    bias: &DiscretizationBias,
    settings: PosteriorSettings,
    seed: u64,
    number: usize,
    done: &AtomicUsize,
) -> Result<ParameterChain, String> {
    let Fitted { search, optimum } = fitted;
    let failed = |error: Error| format!("the simulation at the optimum fails: {error}");
    let density = PosteriorDensity::new(fitted, &local.noise).map_err(failed)?;
    let bounds: Vec<[f64; 2]> = search.unknowns.iter().map(Unknown::scaled_bounds).collect();
    let is_stopped = || search.is_stopped();
    let target = StandardizedDensity::new(density, &optimum.x, &bounds, is_stopped)
        .map_err(failed)?
        .ok_or("at the optimum the residuals do not depend on all parameters. Give a prior")?;
    let after = || {
        let count = done.fetch_add(1, Ordering::Relaxed) + 1;
        if count.is_multiple_of(REPORTED_DRAWS) {
            search.report(&format!("posterior, {count} of {}", settings.total()));
        }
    };
    let SampledChain { draws, log_densities, divergences } =
        sample_chain(&target, settings, seed, number, after).ok_or_else(|| {
            format!(
                "chain {number} has no start near the optimum with a finite density. Give bounds"
            )
        })?;
    let draw = |(u, log_density): (&Vec<f64>, f64)| {
        let (x, log_slope) = target.unknowns(u);
        let pairs = search.unknowns.iter().zip(x).enumerate();
        let value = |(i, (u, x)): (usize, (&Unknown, f64))| {
            u.from_scale(corrected_draw(x, bias.correction(i), bounds[i]))
        };
        let values = pairs.map(value).collect();
        PosteriorDraw { values, log_density: log_density - log_slope }
    };
    let draws = draws.iter().zip(log_densities).map(draw).collect();
    Ok(ParameterChain { draws, divergences })
}

/// An unknown `x` of a draw plus its correction for mesh and step, on its scale, reflected at its bounds. Draws that
/// are clamped to a bound would have a probability there.
fn corrected_draw(x: f64, correction: f64, [low, high]: [f64; 2]) -> f64 {
    let moved = x + correction;
    let width = high - low;
    if moved >= low && moved <= high {
        return moved;
    }
    if width.is_infinite() {
        return if moved > high { 2.0 * high - moved } else { 2.0 * low - moved };
    }
    if width <= 0.0 {
        return low;
    }
    // Several reflections where the correction exceeds the range.
    let phase = (moved - low).rem_euclid(2.0 * width);
    low + phase.min(2.0 * width - phase)
}

/// The result for parameter `i` from all draws; none if they do not differ.
fn summary(draws: &PosteriorDraws, i: usize, divergences: usize) -> Option<Posterior> {
    let of = |chain: &Vec<PosteriorDraw>| chain.iter().map(|draw| draw.values[i]).collect();
    let chains: Vec<Vec<f64>> = draws.chains.iter().map(of).collect();
    let Diagnostics { r_hat, effective_draws, mc_error } = Diagnostics::new(&chains)?;
    let mut sorted = chains.concat();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len();
    let mean = sorted.iter().sum::<f64>() / count as f64;
    let square: f64 = sorted.iter().map(|x| (x - mean).powi(2)).sum();
    // Linear interpolation of the sorted draws.
    let percentile = |p: f64| {
        let place = p * (count - 1) as f64;
        let (below, fraction) = (place.floor() as usize, place.fract());
        sorted[below] * (1.0 - fraction) + sorted[(below + 1).min(count - 1)] * fraction
    };
    Some(Posterior {
        mean,
        median: percentile(0.5),
        std_dev: (square / (count - 1) as f64).sqrt(),
        interval95: [percentile(0.025), percentile(0.975)],
        r_hat,
        effective_draws,
        mc_error,
        divergences,
        draws: count,
    })
}

/// A warning if chains have not converged to one distribution, are too short, or have divergences, with the worst
/// parameter (by its name in `names`).
fn warn_of_quality(names: &[String], summaries: &[Posterior], warnings: &mut Warnings) {
    let worst = |quality: fn(&Posterior) -> f64| {
        let all = summaries.iter().map(quality).zip(names);
        all.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut findings = Vec::new();
    if let Some((r_hat, name)) = worst(|s| s.r_hat).filter(|(r_hat, _)| *r_hat > LARGEST_R_HAT) {
        findings.push(format!("R-hat of {name} is {r_hat:.3} (at most {LARGEST_R_HAT})"));
    }
    if let Some((negative, name)) = worst(|s| -s.effective_draws)
        && -negative < FEWEST_EFFECTIVE
    {
        let least = FEWEST_EFFECTIVE;
        findings.push(format!("{name} has {:.0} effective draws (at least {least})", -negative));
    }
    if let Some(Posterior { divergences: 1.., draws, .. }) = summaries.first() {
        let count = summaries[0].divergences;
        findings.push(format!("{count} of {draws} draws diverged"));
    }
    if !findings.is_empty() {
        let text = format!(
            "the sample of the posterior distribution is not reliable: {}. Its intervals may be wrong. Increase \
             draws and warmup, or give bounds",
            findings.join(", ")
        );
        warnings.add(Severity::Note, Code::PosteriorNotConverged, text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws near a bound stay different, at their distance from it before the correction less the correction.
    #[test]
    fn corrected_draws_are_reflected_at_bounds() {
        let bounds = [1.0, 3.0];
        let corrected = |x, correction| corrected_draw(x, correction, bounds);
        assert_eq!([corrected(2.875, 0.25), corrected(2.75, 0.5)], [2.875, 2.75]);
        assert_eq!([corrected(1.125, -0.25), corrected(1.5, 0.25)], [1.125, 1.75]);
        assert_eq!([corrected(1.5, 0.0), corrected(1.5, 9.0)], [1.5, 2.5]);
        assert_eq!(corrected_draw(2.0, 1.0, [f64::NEG_INFINITY, f64::INFINITY]), 3.0);
    }
}

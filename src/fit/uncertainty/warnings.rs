//! What speaks against an optimum: motion that is left over, residuals that are no noise, bounds that
//! were reached, and what was known before.

use crate::code::Code;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::constant_axes::ConstantAxis;
use crate::fit::measurement::experiment::{Experiment, all as all_measurements_of};
use crate::fit::measurement::repeated_frames::RepeatedFrames;
use crate::fit::misfit::initial_sigmas::UNEXPLAINED;
use crate::fit::misfit::residual_tests::ResidualTests;
use crate::fit::search::Search;
use crate::fit::search::damping::is_damping;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::search::optimum::Optimum;
use crate::fit::search::residual_acceptance::{is_noisy, residual_tests};
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::{Severity, Warnings, percent};
use crate::fit::uncertainty::noise::adequacy::{Adequacy, CoordinateNoise, WRONG_SIGMA};
use crate::fit::uncertainty::noise::autocorrelation::Correlations;
use crate::fit::uncertainty::noise::outlying_experiments::UnexplainedParts;
use crate::fit::unknown::Unknown;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Residuals this many times the noise are not it, however many there are.
const OFF: f64 = 1.5;
/// Part of the values that must be left as independent ones, before the report speaks of it.
const WORTH_A_WORD: f64 = 0.7;
/// Independent values for each unknown from which on intervals are certain themselves.
const ENOUGH_EACH: f64 = 15.0;

/// Correlation of neighboring residuals above which noise of white sampling is implausible: of 141 right fits with white
/// noise three exceed 0.3 and none 0.56.
const STRONG_CORRELATION: f64 = 0.5;

/// Whether residuals of this root mean square, in units of the noise they should be, are not it: by
/// half for many values, and more for few, which noise makes as large once in a thousand times.
pub(crate) fn is_too_large(rms: f64, values: usize) -> bool {
    let n = values.max(1) as f64;
    let by_chance = ChiSquared::new(n).map_or(0.0, |chi| (chi.inverse_cdf(0.999) / n).sqrt());
    rms > by_chance.max(OFF)
}

/// What of the measurements is left, if it is too much and no noise; `narrow` is what that makes of the intervals.
pub(crate) fn unexplained(
    fitted: Fitted,
    LocalAnalysis { correlations, adequacy, .. }: &LocalAnalysis,
    narrow: &str,
    warnings: &mut Warnings,
) {
    let Fitted { search, optimum } = fitted;
    if search.is_rounding(optimum) {
        return;
    }
    let spreads = search.spreads(optimum);
    let mut parts = UnexplainedParts::default();
    let mut unexplained = Vec::with_capacity(spreads.len());
    for (own, rms) in fitted.measured().zip(&spreads) {
        let size = own.size();
        let noise = 3.0 * own.measurement.sigma().unwrap_or(0.0);
        let correlation = |axis: &str| correlations.correlation(own.index, axis);
        let is_unexplained = *rms > (UNEXPLAINED * size).max(noise)
            && !adequacy.is_explained(own.index)
            && !is_noisy(&own, *rms, correlation, search.significance_level());
        let relative = rms / size.max(f64::MIN_POSITIVE);
        parts.add(&own.experiment.name, relative, own.residuals.len(), is_unexplained);
        unexplained.push(is_unexplained);
    }
    for ((own, rms), is_unexplained) in fitted.measured().zip(spreads).zip(unexplained) {
        let MeasuredResiduals { experiment, measurement, residuals, .. } = own;
        let label = experiment.label(measurement);
        let size = own.size();
        let relative = rms / size.max(f64::MIN_POSITIVE);
        let unit = measurement.data_unit();
        let (shown_rms, shown_size, unit) = (rms / unit.size, size / unit.size, unit.name);
        let outlying = parts.outlying(&experiment.name);
        if let Some(part) = outlying.filter(|_| is_unexplained) {
            let words = format!(
                "{label}: the residuals are {} of the observed motion ({shown_rms:.3e} {unit} of {shown_size:.3e} \
                 {unit}), and {} in the whole experiment; the median of {} experiments is {}. This recording is \
                 an outlier, and a fault of the common set-up is not the reason. Inspect it, or use it as \
                 validation data (held_out = true)",
                percent(relative),
                percent(part),
                parts.count(),
                percent(parts.median())
            );
            warnings.add_alike(Severity::Misfit, Code::OutlyingExperiment, &experiment.name, words);
        } else if is_unexplained {
            // Standing still at the mean of what was observed leaves no more.
            let weight = if relative >= 1.0 { Severity::Worthless } else { Severity::Unexplained };
            let words = format!(
                "{label}: the residuals are {} of the observed motion ({shown_rms:.3e} {unit} of {shown_size:.3e} \
                 {unit}). The estimates may be wrong. Check the set-up: release time, scale, origin, tracked \
                 point, dimensions",
                percent(relative)
            );
            warnings.add_alike(weight, Code::LargeResiduals, &experiment.name, words);
        }
        let too_large = |sigma: &f64| is_too_large(rms / sigma, residuals.len());
        if let Some(sigma) = measurement.sigma().filter(too_large) {
            let words = format!(
                "{label}: the residuals are {} the stated sigma{narrow}. Correct sigma, or add the missing effect \
                 to the scene",
                times(rms / sigma)
            );
            warnings.add_alike(Severity::Misfit, Code::BeyondSigma, &experiment.name, words);
        }
    }
}

/// All measurements of a search, in the order of the residuals.
fn all_measurements<'a>(
    search: &'a Search,
) -> impl Iterator<Item = (&'a Experiment, &'a Measurement)> {
    all_measurements_of(search.experiments)
}

/// A factor as a person says it.
pub(crate) fn times(factor: f64) -> String {
    match factor {
        f if f.is_nan() || f > 1000.0 => "more than 1000 times".into(),
        f => format!("{f:.1} times"),
    }
}

/// What keeps an optimum from being one, where the misfit jumps.
pub(crate) fn jumps(Fitted { search, optimum }: Fitted, warnings: &mut Warnings) {
    let open = !(optimum.converged && search.is_noise(optimum));
    let words = "the integrator halved some time steps, and which ones depends on the parameters. The misfit has \
                 jumps, and the optimum is inexact. Use a smaller time.step, or scheme = \"average-vector-field\"";
    if optimum.halved && open {
        warnings.add(Severity::Numerics, Code::HalvedSteps, words);
    }
}

/// Recorded motions whose supports move too fast for the steps.
pub(crate) fn steps_too_large(experiments: &[Experiment], warnings: &mut Warnings) {
    for experiment in experiments.iter().filter(|e| e.moves()) {
        for (code, words) in experiment.problem.step_warnings() {
            let words = experiment.key(&words);
            warnings.add_alike(Severity::Numerics, code, &experiment.name, words);
        }
    }
}

/// Whether what is left is noise; `narrow` is what it makes of the intervals if it is not.
pub(crate) fn test_residuals(
    fitted: Fitted,
    correlations: &Correlations,
    narrow: &str,
    warnings: &mut Warnings,
) -> Vec<ResidualTests> {
    let (mut all, significance) = (Vec::new(), fitted.search.significance_level());
    for own in fitted.measured() {
        let correlation = |axis: &str| correlations.correlation(own.index, axis);
        let experiment = own.experiment;
        for tests in residual_tests(&own, correlation, significance) {
            if !tests.is_noise() {
                let words = format!(
                    "{}, {}: {}. The model lacks an effect, or the noise is correlated{narrow}. Read the likely \
                     omitted effects, or try --extend",
                    tests.observation, tests.axis, tests.verdict
                );
                warnings.add_alike(
                    Severity::Misfit,
                    Code::ResidualsNotWhite,
                    &experiment.name,
                    words,
                );
            } else if !tests.passed {
                let words = format!(
                    "{}, {}: {}. Outliers may bias the estimates. Use a robust loss (huber, cauchy), which \
                     down-weights them",
                    tests.observation, tests.axis, tests.verdict
                );
                warnings.add_alike(Severity::Note, Code::Outliers, &experiment.name, words);
            }
            all.push(tests);
        }
    }
    warn_of_autocorrelation(&all, fitted.search.unknowns.len(), warnings);
    all
}

/// Whether what an optimum leaves of every measurement is noise, and no more of it than noise may be.
pub(crate) fn is_noise(fitted: Fitted, local: &LocalAnalysis) -> bool {
    let mut warnings = Warnings::default();
    unexplained(fitted, local, "", &mut warnings);
    test_residuals(fitted, &local.correlations, "", &mut warnings);
    against_noise_scale(fitted.search, &local.adequacy, &mut warnings);
    !warnings.has_misfit()
}

/// Warns of residuals that autocorrelated noise or a missing effect would leave: those beyond the noise scale of the
/// samples, and strongly autocorrelated ones without any scale.
pub(crate) fn against_noise_scale(search: &Search, adequacy: &Adequacy, warnings: &mut Warnings) {
    let all = &adequacy.coordinates;
    for coordinate in all {
        let CoordinateNoise { scale, measurement, stated_sigma, correlation, is_at_cap, .. } =
            coordinate;
        let experiment = all_measurements(search).nth(*measurement).map_or("", |(e, _)| &e.name);
        let (observation, axis, rms) = (&scale.observation, &scale.axis, scale.residual_rms);
        let exceeded = scale.p_value.filter(|_| coordinate.is_exceeded(all.len()));
        if exceeded.is_some() && coordinate.has_outliers && stated_sigma.is_none() {
            let words = format!(
                "{observation}, {axis}: the residuals (RMS {rms:.2e} m) exceed the noise scale of the samples, and some \
                 are outliers, which bias the estimates. Use a robust loss (huber, cauchy)"
            );
            warnings.add_alike(Severity::Ambiguous, Code::Outliers, experiment, words);
        } else if let (Some(p), Some(value), None) = (exceeded, scale.value, stated_sigma) {
            let words = format!(
                "{observation}, {axis}: the residuals (RMS {rms:.2e} m) exceed the noise scale of the \
                 samples ({value:.2e} m, p = {p:.0e}). The noise is autocorrelated or the model lacks an effect. \
                 Record the rod at rest and state its scatter as sigma"
            );
            warnings.add_alike(Severity::Ambiguous, Code::ExceedsNoiseScale, experiment, words);
        } else if *is_at_cap
            || *correlation > STRONG_CORRELATION && scale.value.is_none() && stated_sigma.is_none()
        {
            let reason = scale.unavailable.as_ref().map_or(String::new(), |r| format!(" ({r})"));
            let words = format!(
                "{observation}, {axis}: neighboring residuals correlate by {correlation:.2}, and no independent \
                 noise scale is available{reason}. Autocorrelated noise and a missing effect cannot be separated. \
                 State sigma"
            );
            warnings.add_alike(Severity::Ambiguous, Code::UnresolvedCorrelation, experiment, words);
        }
    }
}

/// Notes the coordinates that are left out of the fit.
pub(crate) fn constant_axes(axes: &[ConstantAxis], warnings: &mut Warnings) {
    for ConstantAxis { observation, axis, value, samples } in axes {
        let words = format!(
            "{observation}, {axis}: all {samples} values are {value} m. The coordinate is left out of the fit and \
             of the noise estimate. Leave the column out of the file"
        );
        warnings.add_alike(Severity::Note, Code::ConstantAxis, "", words);
    }
}

/// Warns of videos that were converted to a higher frame rate.
pub(crate) fn repeated_frames(found: &[RepeatedFrames], warnings: &mut Warnings) {
    for RepeatedFrames { observation, repeated, frames } in found {
        let words = format!(
            "{observation}: {repeated} of {frames} frames repeat the one before, as in a video that was converted to a higher \
             frame rate. Repeated positions belong to earlier times and bias the estimates. Keep one frame of each"
        );
        warnings.add_alike(Severity::Misfit, Code::RepeatedFrames, "", words);
    }
}

/// Warns of stated sigmas that differ from the scatter of the data by a factor of three or more.
pub(crate) fn stated_sigmas(search: &Search, adequacy: &Adequacy, warnings: &mut Warnings) {
    for (place, (experiment, measurement)) in all_measurements(search).enumerate() {
        let Some(sigma) = measurement.sigma() else { continue };
        let own = adequacy.coordinates.iter().filter(|c| c.measurement == place);
        let shown = own.map(|c| match c.scale.value {
            Some(value) => (value, "differences of the samples"),
            None => (c.scale.residual_rms, "the residuals"),
        });
        // A stated sigma holds for all coordinates: the largest scatter is compared.
        let Some((scatter, source)) = shown.reduce(|a, b| if b.0 > a.0 { b } else { a }) else {
            continue;
        };
        if scatter > 0.0 && !(1.0 / WRONG_SIGMA..=WRONG_SIGMA).contains(&(sigma / scatter)) {
            let label = experiment.label(measurement);
            let consequence = match sigma > scatter {
                true => "Intervals are too wide, and a misfit of that size is not detected",
                false => "Intervals are too narrow",
            };
            let words = format!(
                "{label}: the stated sigma ({sigma:.1e} m) differs from the scatter that {source} show \
                 ({scatter:.1e} m). {consequence}. Check its unit, or leave sigma out to have it estimated"
            );
            warnings.add_alike(Severity::Note, Code::SigmaDoubtful, &experiment.name, words);
        }
    }
}

/// Says how few independent values there are, where neighbours resemble each other.
fn warn_of_autocorrelation(tests: &[ResidualTests], unknowns: usize, warnings: &mut Warnings) {
    let values: f64 = tests.iter().map(|t| t.values as f64).sum();
    let effective: f64 = tests.iter().map(|t| t.effective_samples).sum();
    let strongest = tests.iter().max_by(|a, b| a.autocorrelation.total_cmp(&b.autocorrelation));
    let Some(strongest) = strongest.filter(|_| effective < WORTH_A_WORD * values) else { return };
    let mut words = format!(
        "{}, {}: neighboring residuals correlate by {:.2}, so that {values:.0} samples carry the information of \
         {effective:.0} independent ones. The intervals allow for it",
        strongest.observation, strongest.axis, strongest.autocorrelation
    );
    if effective < ENOUGH_EACH * unknowns as f64 {
        words += ", but are uncertain themselves. Record longer; more frames a second do not help";
    }
    warnings.add(Severity::Note, Code::CorrelatedNoise, words);
}

/// What is wrong in the recordings that lead ends.
pub(crate) fn faulty_recordings(experiments: &[Experiment], warnings: &mut Warnings) {
    for experiment in experiments {
        for (code, words) in experiment.problem.recording_warnings() {
            match code {
                Code::LostFrames | Code::Glitches | Code::SwappedLabels => {
                    warnings.add_alike(Severity::Note, code, &experiment.name, words);
                }
                _ => warnings.add(Severity::Note, code, words),
            }
        }
    }
}

/// Warns of sensitivities that grow exponentially.
pub(crate) fn growing_sensitivities(Fitted { search, optimum }: Fitted, warnings: &mut Warnings) {
    if search.growth_weights().is_empty() {
        return;
    }
    for growth in search.growths(optimum).into_iter().flatten() {
        let (later, values) = (growth.later, growth.values);
        let consequence = format!("the {later} of {values} later positions are down-weighted");
        let words = growth.describe(&consequence);
        warnings.add(Severity::Note, Code::GrowingSensitivity, words);
    }
}

/// Values whose derivatives run away.
pub(crate) fn high_leverage(fitted: Fitted, warnings: &mut Warnings) {
    let search = fitted.search;
    if !search.growth_weights().is_empty() {
        return;
    }
    let mut counts = Vec::<(&str, usize)>::new();
    for MeasuredResiduals { experiment, rows, .. } in fitted.measured() {
        let count = rows.filter(|row| search.leverage_weight(*row) < 1.0).count();
        match counts.last_mut() {
            Some((name, sum)) if *name == experiment.name => *sum += count,
            _ => counts.push((&experiment.name, count)),
        }
    }
    let total: usize = counts.iter().map(|(_, count)| count).sum();
    if total == 0 {
        return;
    }
    let named = counts.iter().filter(|(name, count)| *count > 0 && !name.is_empty());
    let named: Vec<String> = named.map(|(name, count)| format!("{count} of {name}")).collect();
    let places = if named.is_empty() { String::new() } else { format!(" ({})", named.join(", ")) };
    let words = format!(
        "{total} of {} values{places} have a high leverage: they change with the parameters more than 10 times as \
         much as is usual. They are down-weighted by that factor. Check them, as where a rod whips the model is \
         least accurate",
        search.leverage_weights.len()
    );
    warnings.add(Severity::Note, Code::HighLeverage, words);
}

/// Parameters that the data bound from one side only.
pub(crate) fn bounded_from_one_side(
    unknowns: &[Unknown],
    estimates: &[Estimate],
    warnings: &mut Warnings,
) {
    for (unknown, estimate) in unknowns.iter().zip(estimates) {
        let (label, unit) = (estimate.label(), estimate.name.unit());
        match (estimate.lower95, estimate.upper95) {
            (None, Some(upper)) if is_damping(unknown) => {
                let words = format!(
                    "{label} is not distinguishable from zero: at most {upper:.3e} {unit} (one-sided 95 %). The \
                     upper bound is the result. Record a longer motion to determine it"
                );
                warnings.add(Severity::Note, Code::MayBeZero, words);
            }
            (Some(bound), _) | (_, Some(bound)) => {
                let [side, open] = match estimate.lower95 {
                    Some(_) => ["at least", "larger"],
                    None => ["at most", "smaller"],
                };
                let words = format!(
                    "{label} is bounded from one side only: {side} {bound:.3e} {unit} (one-sided 95 %). The data fit \
                     any {open} value as well. Record a motion that depends on it, or keep it fixed"
                );
                warnings.add(Severity::Note, Code::OneSided, words);
            }
            _ => {}
        }
    }
}

/// Unknowns that a bound keeps from where the data want them.
pub(crate) fn bounds_reached(
    unknowns: &[Unknown],
    optimum: &Optimum,
    covariance: &Covariance,
    warnings: &mut Warnings,
) {
    for ((unknown, x), deviation) in unknowns.iter().zip(&optimum.x).zip(&covariance.deviation) {
        let [low, high] = unknown.scaled_bounds();
        if deviation.is_some() && (*x <= low || *x >= high) {
            let bound = unknown.from_scale(if *x <= low { low } else { high });
            let words = format!(
                "{unknown} is at its bound {bound}. The interval does not account for the bound. Widen the bound, \
                 or check the model"
            );
            warnings.add(Severity::Contradiction, Code::AtBound, words);
        }
    }
}

/// Data that contradict what was known before them.
pub(crate) fn against_priors(unknowns: &[Unknown], optimum: &Optimum, warnings: &mut Warnings) {
    for (unknown, x) in unknowns.iter().zip(&optimum.x) {
        if let Some(off) = unknown.prior_residual(*x).filter(|s| s.abs() > 3.0) {
            let words = format!(
                "{unknown} is {:.1} sigma from the mean of its prior. Data and prior contradict each other. Check \
                 the prior and the set-up",
                off.abs()
            );
            warnings.add(Severity::Contradiction, Code::PriorConflict, words);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::is_too_large;

    /// One value is off by two sigma every twentieth time, a hundred never are.
    #[test]
    fn few_values_may_be_off() {
        assert!(!is_too_large(2.0, 1) && is_too_large(3.4, 1));
        assert!(is_too_large(1.6, 100) && !is_too_large(1.4, 100));
    }
}

//! Warnings about residuals that are no noise, or noise of another size than stated.
//!
//! Input: the optimum and its local analysis; each function adds its warnings to those of the fit, whose severity
//! determines the grade.
//!
//! [`unexplained_motion`] warns of each measurement whose root mean square residual exceeds the part `UNEXPLAINED` of
//! the observed motion: `Worthless`, `Unexplained`, or `Misfit` for an outlying experiment. Residuals that are noise by
//! tests or by the scale of the samples, or within [`EXPLAINED_SIGMAS`] stated sigmas, are excepted. Independently it
//! adds a `Misfit` for residuals too large for a stated sigma ([`is_too_large`]).
//!
//! [`test_residuals`] adds a `Misfit` for each coordinate that is neither white nor AR(1) noise, or has a trend, and
//! notes on outliers and autocorrelation. [`excess_over_noise_scale`] adds an `Ambiguous` warning for each coordinate
//! whose residuals exceed the noise scale from differences of the samples, or without a scale correlate by more than
//! [`STRONG_CORRELATION`]. A correlation at its limit counts in any case, and with a stated sigma only that.
//! [`doubtful_sigmas`] notes a stated sigma of a recorded motion that differs from the scatter of the data by more than
//! a factor of 2.5. [`is_noise`] returns whether the first three find nothing of the severity `Worthless`,
//! `Unexplained`, `Misfit` or `Ambiguous`.

use crate::code::Code;
use crate::fit::measurement::experiment::all;
use crate::fit::misfit::initial_sigmas::UNEXPLAINED;
use crate::fit::misfit::residual_tests::ResidualTests;
use crate::fit::search::Search;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::search::residual_acceptance::{are_residuals_noise, residual_tests};
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::noise::adequacy::{Adequacy, CoordinateNoise, is_sigma_doubtful};
use crate::fit::uncertainty::noise::autocorrelation::NoiseModel;
use crate::fit::uncertainty::noise::noise_scale::NoiseScale;
use crate::fit::uncertainty::noise::outlying_experiments::UnexplainedParts;
use crate::fit::uncertainty::warning_list::{Severity, Warnings, percent};
use crate::numerics::total_order;
use crate::summary::quantity::p_value;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Ratio of root mean square residual and noise above which the residuals are too large, for many values; for few
/// values chance alone exceeds it. Smaller: weak misfits are warned of too.
const TOO_LARGE: f64 = 1.5;
/// Probability with which noise alone is below the limit of that ratio (chi-squared), which exceeds [`TOO_LARGE`] for
/// few values.
const TOO_LARGE_QUANTILE: f64 = 0.999;
/// Root mean square residual, in stated sigmas, up to which residuals are never unexplained, however small the motion.
const EXPLAINED_SIGMAS: f64 = 3.0;
/// Effective sample size over the number of samples below which autocorrelation is noted. Larger: weaker correlations
/// are noted.
const NOTED_INFORMATION: f64 = 0.7;
/// Number of independent values per unknown from which on intervals are accurate; below it the note calls them
/// uncertain.
const ENOUGH_EACH: f64 = 15.0;
/// Correlation of neighboring residuals above which white noise is implausible: of 141 right fits with white noise
/// three exceed 0.3 and none 0.56.
const STRONG_CORRELATION: f64 = 0.5;

/// Whether residuals of the root mean square `rms`, in units of their noise, are too large for so many `values`: above
/// [`TOO_LARGE`] and above the root of the chi-squared quantile at [`TOO_LARGE_QUANTILE`] over their number.
pub(crate) fn is_too_large(rms: f64, values: usize) -> bool {
    let n = values.max(1) as f64;
    let quantile = ChiSquared::new(n).map_or(0.0, |chi| chi.inverse_cdf(TOO_LARGE_QUANTILE));
    rms > (quantile / n).sqrt().max(TOO_LARGE)
}

/// Adds a warning for each measurement with unexplained residuals. Their root mean square exceeds the part
/// `UNEXPLAINED` of the observed motion, and [`EXPLAINED_SIGMAS`] stated sigmas. They are neither noise of the scale of
/// the samples ([`Adequacy::is_explained`]) nor white or AR(1) noise by all tests ([`are_residuals_noise`]). The
/// severity is `Misfit` for an outlying experiment ([`UnexplainedParts::outlying`]), `Worthless` if the residuals are
/// as large as the motion, else `Unexplained`. Independently, residuals too large for a stated sigma ([`is_too_large`])
/// add a `Misfit`. `narrow` is the consequence for the intervals, as a sentence. Nothing is added where all residuals
/// are rounding errors.
pub(crate) fn unexplained_motion(
    fitted: Fitted,
    LocalAnalysis { correlations, adequacy, .. }: &LocalAnalysis,
    narrow: &str,
    warnings: &mut Warnings,
) {
    let Fitted { search, optimum } = fitted;
    if search.is_rounding(optimum) {
        return;
    }
    // All experiments first: outliers are relative to the median.
    let spreads = search.spreads(optimum);
    let mut parts = UnexplainedParts::default();
    let mut are_unexplained = Vec::with_capacity(spreads.len());
    for (own, rms) in fitted.measured().zip(&spreads) {
        let size = own.size();
        let noise = EXPLAINED_SIGMAS * own.measurement.sigma().unwrap_or(0.0);
        let correlation = |axis: &str| correlations.correlation(own.index, axis);
        // Large residuals may still be large noise: of the scale of the samples, or white.
        let is_unexplained = *rms > (UNEXPLAINED * size).max(noise)
            && !adequacy.is_explained(own.index)
            && !are_residuals_noise(&own, *rms, correlation, search.significance_level());
        let relative = rms / size.max(f64::MIN_POSITIVE);
        parts.add(&own.experiment.name, relative, own.residuals.len(), is_unexplained);
        are_unexplained.push(is_unexplained);
    }
    for ((own, rms), is_unexplained) in fitted.measured().zip(spreads).zip(are_unexplained) {
        let MeasuredResiduals { experiment, measurement, residuals, .. } = own;
        let (name, size) = (&experiment.name, own.size());
        let relative = rms / size.max(f64::MIN_POSITIVE);
        let unit = measurement.data_unit();
        let is_sensor = !measurement.data.readings().is_empty();
        let observed = if is_sensor { "variation of the readings" } else { "observed motion" };
        let finding = format!(
            "{}: the residuals are {} of the {observed} ({} of {})",
            experiment.label(measurement),
            percent(relative),
            format!("{:.3e} {}", rms / unit.size, unit.name).trim_end(),
            format!("{:.3e} {}", size / unit.size, unit.name).trim_end(),
        );
        let outlying = parts.outlying(name);
        if let Some(part) = outlying.filter(|_| is_unexplained) {
            let text = format!(
                "{finding}, and {} in the whole experiment; the median of {} experiments is {}. This recording is \
                 an outlier, and a fault of the common setup is not the reason. Inspect it, or use it as \
                 validation data (held_out = true)",
                percent(part),
                parts.count(),
                percent(parts.median())
            );
            warnings.add_for(name, Severity::Misfit, Code::OutlyingExperiment, text);
        } else if is_unexplained {
            // The mean of the observed motion has residuals of its size.
            let is_worthless = relative >= 1.0;
            let severity = if is_worthless { Severity::Worthless } else { Severity::Unexplained };
            let setup = match is_sensor {
                true => {
                    "start of the motion, axes, sign and unit of the sensor, its place, dimensions"
                }
                false => "release time, scale, origin, tracked point, dimensions",
            };
            let text = format!("{finding}. The estimates may be wrong. Check the setup: {setup}");
            warnings.add_for(name, severity, Code::LargeResiduals, text);
        }
        // A stated sigma is a second scale, independent of the size of the motion.
        let is_beyond = |sigma: &f64| is_too_large(rms / sigma, residuals.len());
        if let Some(sigma) = measurement.sigma().filter(is_beyond) {
            let text = format!(
                "{}: the residuals are {} the stated sigma{narrow}. Correct sigma, or add the missing effect \
                 to the scene",
                experiment.label(measurement),
                factor_text(rms / sigma)
            );
            warnings.add_for(name, Severity::Misfit, Code::BeyondSigma, text);
        }
    }
}

/// Text of a factor with one decimal, such as `2.4 times`; `more than 1000 times` for larger ones and NaN.
pub(crate) fn factor_text(factor: f64) -> String {
    match factor {
        f if f.is_nan() || f > 1000.0 => "more than 1000 times".into(),
        f => format!("{f:.1} times"),
    }
}

/// Name of a coordinate in messages: the `observation` and the `axis`, which is left out if the observation is named
/// after it already, as a component of a sensor.
fn coordinate_name(observation: &str, axis: &str) -> String {
    match observation.rsplit(' ').next() == Some(axis) {
        true => observation.into(),
        false => format!("{observation}, {axis}"),
    }
}

/// Tests the residuals of every coordinate of every measurement for whiteness, normality and trend. A coordinate that
/// is neither white nor AR(1) noise, or has a trend, adds a warning (`Misfit`), the most significant first. One that
/// fails another test adds a note on outliers. Strong autocorrelation of all coordinates together adds one note.
/// `correlations` are the AR(1) correlations of the noise, `narrow` is the consequence for the intervals, as a
/// sentence. Returns all tests, in the order of the coordinates.
pub(crate) fn test_residuals(
    fitted: Fitted,
    correlations: &NoiseModel,
    narrow: &str,
    warnings: &mut Warnings,
) -> Vec<ResidualTests> {
    let (mut all, significance) = (Vec::new(), fitted.search.significance_level());
    let mut found = Vec::new();
    // Each coordinate of each measurement is tested by itself, at a level that allows for their number.
    for own in fitted.measured() {
        let correlation = |axis: &str| correlations.correlation(own.index, axis);
        for tests in residual_tests(&own, correlation, significance) {
            let name = coordinate_name(&tests.observation, &tests.axis);
            let finding = format!("{name}: {}", tests.verdict);
            if !tests.is_noise() {
                let text = format!(
                    "{finding}. The model lacks an effect, or the noise is correlated{narrow}. Look at \
                     the residuals of this coordinate (--report DIR), or try --extend"
                );
                found.push((tests.whiteness.min(tests.trend), own.experiment.name.clone(), text));
            } else if !tests.passed {
                let text = format!(
                    "{finding}. Outliers may bias the estimates, unless a robust loss (huber, \
                     cauchy) down-weights them"
                );
                warnings.add_for(&own.experiment.name, Severity::Note, Code::Outliers, text);
            }
            all.push(tests);
        }
    }
    // The most significant finding comes first: a summary of many names it.
    found.sort_by_cached_key(|(p, ..)| total_order(*p));
    for (_, experiment, text) in found {
        warnings.add_for(&experiment, Severity::Misfit, Code::ResidualsNotWhite, text);
    }
    note_autocorrelation(&all, fitted.search.unknowns.len(), warnings);
    all
}

/// Whether the residuals of every measurement are noise: [`unexplained_motion`], [`test_residuals`] and
/// [`excess_over_noise_scale`] find nothing of the severity `Worthless`, `Unexplained`, `Misfit` or `Ambiguous`. No
/// warnings are added.
pub(crate) fn is_noise(fitted: Fitted, local: &LocalAnalysis) -> bool {
    let mut warnings = Warnings::default();
    unexplained_motion(fitted, local, "", &mut warnings);
    test_residuals(fitted, &local.correlations, "", &mut warnings);
    excess_over_noise_scale(fitted.search, &local.adequacy, &mut warnings);
    !warnings.has_misfit()
}

/// Adds a warning of the severity `Ambiguous` for each coordinate whose residuals may be autocorrelated noise or a
/// missing effect. One cause is an excess over the noise scale of the samples, with or without outliers. Others are an
/// AR(1) correlation above [`STRONG_CORRELATION`] without any scale, and one at the upper limit of its estimate. With a
/// stated sigma only the last one counts. A coordinate with several causes has one warning, in this order: outliers,
/// excess, correlation.
pub(crate) fn excess_over_noise_scale(
    search: &Search,
    adequacy: &Adequacy,
    warnings: &mut Warnings,
) {
    let coordinates = &adequacy.coordinates;
    for coordinate in coordinates {
        let CoordinateNoise { scale, measurement, stated_sigma, correlation, is_at_cap, .. } =
            coordinate;
        let experiment = all(search.experiments).nth(*measurement).map_or("", |(e, _)| &e.name);
        let (observation, axis, unit) = (&scale.observation, &scale.axis, &scale.unit);
        let rms = with_unit(format!("{:.2e}", scale.residual_rms), unit);
        // Outliers first, as they enlarge the residuals; then the excess; then correlation without a scale.
        let is_exceeded = coordinate.is_exceeded(coordinates.len());
        let is_unresolved = *correlation > STRONG_CORRELATION && scale.value.is_none();
        let is_stated = stated_sigma.is_some();
        let (code, text) = match (scale.p_value, scale.value) {
            // With a stated sigma an excess is a warning on sigma, not an ambiguity.
            _ if is_exceeded && coordinate.has_outliers && !is_stated => (
                Code::Outliers,
                format!(
                    "the residuals (RMS {rms}) exceed the noise scale of the samples, and some \
                     are outliers, which bias the estimates. Use a robust loss (huber, cauchy)"
                ),
            ),
            (Some(p), Some(value)) if is_exceeded && !is_stated => (
                Code::ExceedsNoiseScale,
                format!(
                    "the residuals (RMS {rms}) exceed the noise scale of the samples ({}, {}). The noise is autocorrelated or the model lacks an effect. \
                     Record the rod at rest and state its scatter as sigma",
                    with_unit(format!("{value:.2e}"), unit),
                    p_value(p)
                ),
            ),
            // Residuals without an independent scale: strong correlation only.
            _ if *is_at_cap || is_unresolved && !is_stated => {
                (Code::UnresolvedCorrelation, correlation_text(scale, *correlation, is_stated))
            }
            _ => continue,
        };
        let text = format!("{}: {text}", coordinate_name(observation, axis));
        warnings.add_for(experiment, Severity::Ambiguous, code, text);
    }
}

/// Text of the warning of an unresolved AR(1) `correlation` of the residuals of a coordinate. Without a noise `scale`
/// and a stated sigma their absence is the reason, and the action is to state sigma. Else the correlation is the
/// largest that its estimate can have, and a longer record is needed.
fn correlation_text(scale: &NoiseScale, correlation: f64, is_stated: bool) -> String {
    let finding = format!("neighboring residuals correlate by {correlation:.2}");
    let consequence = "Autocorrelated noise and a missing effect cannot be separated";
    if is_stated || scale.value.is_some() {
        return format!(
            "{finding}, the largest value that can be estimated. {consequence}. Record a longer motion, or try \
             --extend"
        );
    }
    let reason = scale.unavailable.as_ref().map(|reason| format!(" ({reason})"));
    let reason = reason.unwrap_or_default();
    format!(
        "{finding}, and no independent noise scale is available{reason}. {consequence}. State sigma"
    )
}

/// A number as text with its unit behind it; the number alone without a unit, as of a strain.
fn with_unit(number: String, unit: &str) -> String {
    match unit {
        "" => number,
        _ => format!("{number} {unit}"),
    }
}

/// Adds a note for each stated sigma of a recorded motion or of readings over time that differs from the scatter of the
/// data by more than a factor of 2.5, either way. The scatter is the largest of the noise scales of its coordinates, or
/// of their root mean square residuals where there is no scale.
pub(crate) fn doubtful_sigmas(search: &Search, adequacy: &Adequacy, warnings: &mut Warnings) {
    for (index, (experiment, measurement)) in all(search.experiments).enumerate() {
        let Some(sigma) = measurement.sigma() else { continue };
        let own = adequacy.coordinates.iter().filter(|c| c.measurement == index);
        let scatters = own.map(|c| match c.scale.value {
            Some(value) => (value, "differences of the samples"),
            None => (c.scale.residual_rms, "the residuals"),
        });
        // A stated sigma holds for all coordinates: the largest scatter is compared.
        let largest = scatters.reduce(|a, b| if b.0 > a.0 { b } else { a });
        // Exact data have a scatter of zero, which is no noise to compare with.
        if let Some((scatter, source)) = largest
            && scatter > 0.0
            && is_sigma_doubtful(sigma, scatter)
        {
            let consequence = match sigma > scatter {
                true => "Intervals are too wide, and a misfit of that size is not detected",
                false => "Intervals are too narrow",
            };
            let unit = measurement.unit();
            let text = format!(
                "{}: the stated sigma ({}) differs from the scatter that {source} show ({}). {consequence}. Check its unit, or leave sigma out to have it estimated",
                experiment.label(measurement),
                with_unit(format!("{sigma:.1e}"), unit),
                with_unit(format!("{scatter:.1e}"), unit),
            );
            warnings.add_for(&experiment.name, Severity::Note, Code::SigmaDoubtful, text);
        }
    }
}

/// Adds one note, with the coordinate of the strongest autocorrelation, if the effective sample size of all coordinates
/// is below [`NOTED_INFORMATION`] of the number of samples. `unknowns` is their number; with fewer than [`ENOUGH_EACH`]
/// independent values each, the note calls the intervals uncertain.
fn note_autocorrelation(tests: &[ResidualTests], unknowns: usize, warnings: &mut Warnings) {
    let values: f64 = tests.iter().map(|t| t.values as f64).sum();
    let effective: f64 = tests.iter().map(|t| t.effective_samples).sum();
    let strongest = tests.iter().max_by(|a, b| a.autocorrelation.total_cmp(&b.autocorrelation));
    let is_noted = effective < NOTED_INFORMATION * values;
    let Some(strongest) = strongest.filter(|_| is_noted) else { return };
    // The interval widens with the correlation, and becomes uncertain with few independent values.
    let mut text = format!(
        "{}: neighboring residuals correlate by {:.2}, the highest value of all coordinates. The {values:.0} samples of all \
         coordinates carry the information of {effective:.0} independent ones. The intervals allow for such noise, \
         not for a missing effect",
        coordinate_name(&strongest.observation, &strongest.axis),
        strongest.autocorrelation
    );
    if effective < ENOUGH_EACH * unknowns as f64 {
        text += ". They are uncertain themselves: record longer; more frames a second do not help";
    }
    warnings.add(Severity::Note, Code::CorrelatedNoise, text);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A component of a sensor, after which the observation is named, is not repeated; a coordinate of a motion is
    /// added.
    #[test]
    fn coordinate_of_a_sensor_is_named_once() {
        assert_eq!(coordinate_name("f4.csv fy", "fy"), "f4.csv fy");
        assert_eq!(coordinate_name("fy", "fy"), "fy");
        assert_eq!(coordinate_name("tip.csv", "y"), "tip.csv, y");
    }

    /// Chi-squared: the root of its 99.9 % quantile is 3.29 for one value, and below 1.5 for a hundred.
    #[test]
    fn few_values_have_a_larger_limit_than_many() {
        assert!(!is_too_large(2.0, 1) && is_too_large(3.4, 1));
        assert!(is_too_large(1.6, 100) && !is_too_large(1.4, 100));
    }

    /// The missing scale is the reason, and sigma the action, only where there is neither a scale nor a stated sigma.
    #[test]
    fn text_of_a_correlation_asks_for_sigma_only_without_any_scale() {
        let text = |value: Option<f64>, is_stated: bool| {
            let scale = NoiseScale {
                observation: "tip.csv".into(),
                axis: "x".into(),
                value,
                unit: "m".into(),
                degrees_of_freedom: value.map(|_| 20.0),
                difference_order: None,
                residual_rms: 1e-3,
                p_value: None,
                unavailable: None,
            };
            correlation_text(&scale, 0.97, is_stated)
        };
        for (value, is_stated) in [(None, false), (None, true), (Some(1e-4), false)] {
            let text = text(value, is_stated);
            let has_none = value.is_none() && !is_stated;
            assert_eq!(text.contains("no independent noise scale"), has_none, "{text}");
            assert_eq!(text.contains("State sigma"), has_none, "{text}");
            assert_eq!(text.contains("Record a longer motion"), !has_none, "{text}");
        }
    }
}

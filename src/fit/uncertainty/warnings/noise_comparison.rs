//! Warnings that compare the noise of two measurements of one fit.
//!
//! [`near_copies`] warns of two measured shapes that differ by much less than their noise at all common points: copies
//! of one recording, or errors that both share. Exact copies are rejected before the fit (`duplicates`).
//! [`unequal_noise`] warns of two recordings of motions, or two shapes, whose estimated noises differ by more than a
//! factor of [`UNEQUAL`].

use crate::code::Code;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::noise::adequacy::Adequacy;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::numerics::noise_scale::quantization_step;
use crate::numerics::upper_median;

/// Largest difference of near copies over the noise. A difference of independent values is smaller with a probability
/// of 11 %.
const NEAR: f64 = 0.2;
/// Smallest number of common values of near copies: independent values are as near by chance in 2 of 1e6 cases.
const FEWEST_COMMON: usize = 6;
/// Largest difference of the arc lengths of a common point, over the median distance of points. It allows for the
/// approximation of unknown arc lengths.
const SAME_POINT: f64 = 0.05;
/// Ratio of two estimated noises above which they are compared with each other in a warning.
const UNEQUAL: f64 = 5.0;
/// Smallest number of values of each measurement for that.
const FEWEST_VALUES: usize = 8;

/// Adds a warning for each pair of fitted shapes with at least [`FEWEST_COMMON`] common values, all of which differ by
/// less than [`NEAR`] times the noise. The noise is the smaller one of both shapes, and for each the smaller of sigma
/// and its root mean square residual. Nothing is added where the residuals are rounding errors, or where the resolution
/// of the values exceeds the noise, so that independent values are often equal.
pub(crate) fn near_copies(fitted: Fitted, warnings: &mut Warnings) {
    if fitted.search.is_rounding(fitted.optimum) {
        return;
    }
    let shapes: Vec<MeasuredResiduals> =
        fitted.measured().filter(|own| own.measurement.shape().is_some()).collect();
    for (k, later) in shapes.iter().enumerate() {
        for earlier in &shapes[..k] {
            let noise = noise_of(earlier).min(noise_of(later));
            let differences = common_differences(earlier, later);
            let largest = differences.iter().copied().fold(0.0, f64::max);
            if differences.len() < FEWEST_COMMON || largest >= NEAR * noise {
                continue;
            }
            let is_coarse = |own: &MeasuredResiduals| {
                quantization_step(&own.measurement.values_in_order()).is_some_and(|q| q > noise)
            };
            if is_coarse(earlier) || is_coarse(later) {
                continue;
            }
            let text = format!(
                "{} and {}: all {} common values differ by at most {largest:.1e} m, independent ones of this noise by \
                 {:.1e} m. They count as two measurements although their errors are the same, and the intervals are \
                 too narrow. Remove one of them, or measure the shape anew",
                earlier.experiment.label(earlier.measurement),
                later.experiment.label(later.measurement),
                differences.len(),
                2.0_f64.sqrt() * noise,
            );
            warnings.add(Severity::Ambiguous, Code::NearCopy, text);
        }
    }
}

/// The noise of a measurement, in its unit: sigma, or its root mean square residual if that is smaller.
fn noise_of(own: &MeasuredResiduals) -> f64 {
    let square: f64 = own.residuals.iter().map(|r| r * r).sum();
    own.sigma * (square / own.residuals.len().max(1) as f64).sqrt().min(1.0)
}

/// The absolute difference of every coordinate of two shapes at every common point of the same rod, m. A point of the
/// later shape is common if one of the earlier shape has the same arc length within [`SAME_POINT`].
fn common_differences(earlier: &MeasuredResiduals, later: &MeasuredResiduals) -> Vec<f64> {
    let of_rod = |own: &MeasuredResiduals| own.measurement.shape().and_then(|s| s.rod.clone());
    if of_rod(earlier) != of_rod(later) {
        return Vec::new();
    }
    let series = |own: &MeasuredResiduals| {
        let values = own.measurement.values_in_order();
        let coordinates = own.measurement.coordinates(&own.experiment.problem);
        let of_axis = coordinates.into_iter().map(move |coordinate| {
            let ascending = coordinate.ascending(values.len()).into_iter();
            let points = ascending.map(|(index, abscissa)| [abscissa, values[index]]);
            (coordinate.axis, points.collect::<Vec<_>>())
        });
        of_axis.collect::<Vec<_>>()
    };
    let (one, other) = (series(earlier), series(later));
    let mut differences = Vec::new();
    for (axis, points) in &other {
        let Some((_, before)) = one.iter().find(|(own, _)| own == axis) else { continue };
        let intervals = points.windows(2).map(|pair| pair[1][0] - pair[0][0]);
        let same = SAME_POINT * upper_median(intervals).unwrap_or(0.0);
        for [s, value] in points {
            // Markers beside one point have the same arc length: the nearest value counts.
            let here = before.iter().filter(|[other, _]| (other - s).abs() <= same);
            let nearest = here.map(|[_, other]| (other - value).abs()).min_by(f64::total_cmp);
            differences.extend(nearest);
        }
    }
    differences
}

/// Adds a note on the two recordings of motions, and on the two shapes, with the largest and the smallest noise, if
/// these differ by more than [`UNEQUAL`]. `sigma` is the noise of every measurement, in its unit. Measurements with a
/// stated sigma or fewer than [`FEWEST_VALUES`] values do not count. Nothing is added if the larger noise is that of
/// the samples without the model, so that the recordings differ and not the model, and where all residuals are rounding
/// errors.
pub(crate) fn unequal_noise(
    fitted: Fitted,
    sigma: &[f64],
    adequacy: &Adequacy,
    warnings: &mut Warnings,
) {
    if fitted.search.is_rounding(fitted.optimum) {
        return;
    }
    for table in ["observation", "shape"] {
        let is_compared = |own: &MeasuredResiduals| {
            let measurement = own.measurement;
            (measurement.motion().is_some() || measurement.shape().is_some())
                && measurement.table() == table
                && measurement.sigma().is_none()
                && own.residuals.len() >= FEWEST_VALUES
        };
        let by_noise = |a: &MeasuredResiduals, b: &MeasuredResiduals| {
            sigma[a.index].total_cmp(&sigma[b.index])
        };
        let largest = fitted.measured().filter(is_compared).max_by(by_noise);
        let smallest = fitted.measured().filter(is_compared).min_by(by_noise);
        let Some((most, least)) = largest.zip(smallest) else { continue };
        let [large, small] = [&most, &least].map(|own| sigma[own.index]);
        if large <= UNEQUAL * small || adequacy.is_explained(most.index) {
            continue;
        }
        let [noisy, quiet] = [&most, &least].map(|own| own.experiment.label(own.measurement));
        let text = format!(
            "the estimated noise of {noisy} ({large:.1e} m) is {:.0} times that of {quiet} ({small:.1e} m). The model \
             is probably wrong for the former: a body, a load or a support is missing, or the place on the rod is another \
             one. Look at its residuals, or state sigma of both",
            large / small
        );
        warnings.add(Severity::Note, Code::UnequalNoise, text);
    }
}

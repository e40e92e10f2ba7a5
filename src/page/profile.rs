//! The section "Likelihood profiles" of a page of a fit: the rise of twice the misfit, over the noise variance, along
//! one parameter, all others at their optimum.
//!
//! Input: the profiles that the fit computed, if any. The ends of the profile interval are where the rise crosses the
//! 95 % level (the squared coverage factor). Between the fits with a fixed parameter the signed square root of the rise
//! is interpolated linearly; its sign is that of the distance from the estimate. Output: a figure for each profile as
//! HTML, empty without profiles.

use crate::fit::{FitReport, Profile};
use crate::page::chart::{ChartAxis, PageChart, Points};
use crate::page::figure::{MODEL, figure, row};
use crate::page::number::Scale;

/// Segments of a profile's curve between two fits.
const CURVE_STEPS: usize = 16;

/// The figures of all profiles, side by side, as HTML; empty without profiles.
pub(super) fn profiles(report: &FitReport, profiles: &[Profile]) -> String {
    row(&profiles.iter().map(|profile| profile_figure(report, profile)).collect::<String>())
}

/// The figure of a profile as HTML: fits as dots, the interpolated curve, and as dashed lines the 95 % level and the
/// ends of the interval, where they exist.
fn profile_figure(report: &FitReport, profile: &Profile) -> String {
    let estimate = report.parameters.iter().find(|e| e.label() == profile.label);
    let scale = Scale::for_values(profile.values.iter().copied(), profile.name.unit());
    let best = estimate.and_then(|e| e.value);
    // The signed root of the rise is nearly straight, so that its chords between a few fits give a smooth curve.
    let side = |x: f64| best.map_or(1.0, |best| (x - best).signum());
    let root = |(x, rise): (&f64, &f64)| [*x, side(*x) * rise.max(0.0).sqrt()];
    let roots: Points = profile.values.iter().zip(&profile.rise).map(root).collect();
    let curve = roots.windows(2).flat_map(|ends| {
        let [[x0, y0], [x1, y1]] = [ends[0], ends[1]];
        (0..=CURVE_STEPS).map(move |k| {
            let u = k as f64 / CURVE_STEPS as f64;
            [x0 + u * (x1 - x0), (y0 + u * (y1 - y0)).powi(2)]
        })
    });
    let fits = roots.iter().map(|[x, root]| [*x, root * root]);
    let axis = ChartAxis::new(&profile.label, &scale);
    let mut chart = PageChart::new(axis, "rise of 2 \u{d7} misfit / noise\u{b2}", [520.0, 280.0])
        .level(profile.level)
        .line("", curve, MODEL)
        .dots("fits with this parameter fixed", fits, MODEL, 3.5);
    for end in estimate.and_then(|e| e.profile95).into_iter().flatten().flatten() {
        chart = chart.mark(end);
    }
    figure(
        &profile.label,
        &format!("likelihood profile of {}", profile.label),
        &chart,
        "dashed: the 95 % level, and the ends of the interval",
    )
}

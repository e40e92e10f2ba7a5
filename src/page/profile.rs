//! Likelihood profiles.

use crate::fit::{FitReport, Profile};
use crate::page::chart::{Chart, labeled};
use crate::page::figure::{MODEL, figure, row};
use crate::page::html::escaped;
use crate::page::number::Scale;

/// Points of the curve of a profile between two fits.
const BETWEEN: usize = 16;

/// The profiles of all parameters.
pub(super) fn profiles(report: &FitReport, profiles: &[Profile]) -> String {
    row(&profiles.iter().map(|profile| one_profile(report, profile)).collect::<String>())
}

/// The rise of twice the misfit. Its root is nearly straight, so that a few fits give a smooth curve.
fn one_profile(report: &FitReport, profile: &Profile) -> String {
    let estimate = report.parameters.iter().find(|e| e.label() == profile.label);
    let scale = Scale::fitting(profile.values.iter().copied(), profile.name.unit());
    let best = estimate.and_then(|e| e.value);
    let side = |x: f64| best.map_or(1.0, |best| (x - best).signum());
    let points: Vec<(f64, f64)> = profile
        .values
        .iter()
        .zip(&profile.rise)
        .map(|(x, rise)| (*x / scale.factor, side(*x) * rise.max(0.0).sqrt()))
        .collect();
    let between = points.windows(2).flat_map(|pair| {
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
        (0..=BETWEEN).map(move |k| {
            let u = k as f64 / BETWEEN as f64;
            (x0 + u * (x1 - x0), (y0 + u * (y1 - y0)).powi(2))
        })
    });
    let fits = points.iter().map(|(x, root)| (*x, root * root));
    let mut chart =
        Chart::new(labeled(&profile.label, &scale.unit), "rise of 2 \u{d7} misfit / noise\u{b2}")
            .size(520.0, 280.0)
            .level(profile.level)
            .line("", between, MODEL)
            .dots("fits with this parameter fixed", fits, MODEL, 3.5);
    for end in estimate.and_then(|e| e.profile95).into_iter().flatten().flatten() {
        chart = chart.mark(end / scale.factor);
    }
    figure(
        &escaped(&profile.label),
        &format!("likelihood profile of {}", profile.label),
        &chart,
        "dashed: the 95 % level, and the ends of the interval",
    )
}

//! What was simulated and measured, experiment by experiment.

use crate::fit::{FitReport, Measured, PlotData, Recording, SimulationSettings, Vertical};
use crate::page::number::{quantity, short};
use crate::page::table::of_keys;

/// Keys with plain text.
type Rows = Vec<(&'static str, String)>;

/// The settings of all experiments.
pub(super) fn settings(all: &[SimulationSettings]) -> String {
    of_keys(&rows(all))
}

/// Settings and cost of a fit.
pub(super) fn of_fit(report: &FitReport, plots: Option<&PlotData>) -> String {
    let mut rows = rows(plots.map_or(&[][..], |e| &e.settings));
    rows.push(("cost", format!("{:.1} simulations", report.simulations)));
    rows.push(("wall-clock time", quantity(report.wall_seconds, "s")));
    of_keys(&rows)
}

fn rows(all: &[SimulationSettings]) -> Rows {
    let mut rows = Rows::new();
    for settings in all {
        if !settings.experiment.is_empty() {
            rows.push(("experiment", settings.experiment.clone()));
        }
        rows.extend(settings.scene.iter().map(|scene| ("scene", scene.clone())));
        rows.extend(settings.measurements.iter().map(|own| ("measured", measured(own))));
        rows.push(("model", settings.model.clone()));
        rows.extend(settings.scheme.iter().map(|scheme| ("scheme", scheme.clone())));
        if let (Some(step), Some(end)) = (settings.step, settings.end) {
            rows.push((
                "time step",
                format!("{} up to {}", quantity(step, "s"), quantity(end, "s")),
            ));
        }
        let edge = settings.length / settings.segments.max(1) as f64;
        let mesh = format!(
            "{} segments of about {} on {}",
            settings.segments,
            quantity(edge, "m"),
            quantity(settings.length, "m"),
        );
        rows.push(("mesh", mesh));
    }
    rows
}

/// The size of a measurement, and how its file was read.
fn measured(measured: &Measured) -> String {
    let Measured { label, points, values, recording } = measured;
    let mut parts = vec![format!("{label}: {points} points, {values} values")];
    if let Some(recording) = recording {
        let Recording { format, marker, likelihood, axes, fps, scale, origin, y, time_zero, sigma } =
            recording;
        parts.extend(sigma.as_ref().map(|_| "standard deviation of each row given".to_string()));
        parts.extend(format.map(|format| format!("file of {}", format.program())));
        parts.extend(marker.as_ref().map(|marker| format!("marker {marker}")));
        parts.extend(likelihood.map(|least| format!("likelihood {} or more", short(least))));
        parts.extend(axes.map(|axes| format!("axes {}", Vec::from(axes).join(", "))));
        parts.extend(fps.map(|fps| format!("{fps} frames per second")));
        parts.extend(scale.map(|scale| format!("{} per pixel", quantity(scale, "m"))));
        parts.extend(origin.map(|[x, y, z]| format!("origin at ({x}, {y}, {z})")));
        parts.extend(y.map(|y| match y {
            Vertical::Up => "y up".to_string(),
            Vertical::Down => "y down".to_string(),
        }));
        parts.extend(
            time_zero.map(|t| format!("motion from {t} on the clock of the file, in its unit")),
        );
    }
    parts.join("; ")
}

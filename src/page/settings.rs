//! The section "Settings" of pages of fits and predictions: model, scheme, time step and mesh of each experiment, and
//! the keys with which its files were read.
//!
//! Input are the settings of all experiments. [`settings`] returns one table of keys and texts, experiment after
//! experiment. Rows are name, scene, measurements (numbers of points and values, stated keys), model, scheme, time step
//! and end, number and mean length of segments. Rows without a value, such as the time step of an equilibrium, are left
//! out. Pages add rows of their own and render the table as HTML.

use crate::fit::{Measured, Recording, SimulationSettings, Vertical};
use crate::page::number::{quantity, three_digits};
use crate::page::table::KeyTable;

/// The rows of all experiments, one experiment after the other, as keys with texts: experiment, scene, each
/// measurement, model, scheme, time step, and mesh. Rows without a value are left out; a motion has both step and end.
pub(super) fn settings(all: &[SimulationSettings]) -> KeyTable {
    let mut table = KeyTable::default();
    for settings in all {
        let experiment = Some(&settings.experiment).filter(|name| !name.is_empty());
        table =
            table.row_if_any("experiment", experiment).row_if_any("scene", settings.scene.as_ref());
        table =
            settings.measurements.iter().fold(table, |table, m| table.row("measured", measured(m)));
        // Equilibria and modes have neither a step nor an end.
        let steps = settings.step.zip(settings.end);
        let edge = settings.length / settings.segments.max(1) as f64;
        let [edge, length] = [edge, settings.length].map(|x| quantity(x, "m"));
        table = table
            .row("model", &settings.model)
            .row_if_any("scheme", settings.scheme.as_ref())
            .row_if_any("time step", steps.map(|(step, end)| time_steps(step, end)))
            .row("mesh", format!("{} segments of about {edge} on {length}", settings.segments));
    }
    table
}

/// A time step and the end of a simulation, s, as text with units.
pub(super) fn time_steps(step: f64, end: f64) -> String {
    format!("{} up to {}", quantity(step, "s"), quantity(end, "s"))
}

/// The number of points and values of a measurement, and the stated keys with which its file was read (format, marker,
/// axes, frame rate, scale and others), as text.
fn measured(measured: &Measured) -> String {
    let Measured { label, points, values, recording } = measured;
    let mut parts = vec![format!("{label}: {points} points, {values} values")];
    if let Some(recording) = recording {
        let Recording { format, columns, marker, likelihood, axes, .. } = recording;
        let Recording { fps, scale, origin, y, time_zero, sigma, .. } = recording;
        let keys = [
            sigma.as_ref().map(|_| "standard deviation of each row given".to_string()),
            format.map(|format| format!("file of {}", format.program())),
            columns.as_ref().map(|columns| format!("columns {columns}")),
            marker.as_ref().map(|marker| format!("marker {marker}")),
            likelihood.map(|least| format!("likelihood {} or more", three_digits(least))),
            axes.map(|axes| format!("axes {}", Vec::from(axes).join(", "))),
            fps.map(|fps| format!("{fps} frames per second")),
            scale.map(|scale| format!("{} per pixel", quantity(scale, "m"))),
            origin.map(|[x, y, z]| format!("origin at ({x}, {y}, {z})")),
            y.map(|y| if y == Vertical::Up { "y up" } else { "y down" }.to_string()),
            time_zero.map(|t| format!("motion from {t} on the clock of the file, in its unit")),
        ];
        parts.extend(keys.into_iter().flatten());
    }
    parts.join("; ")
}

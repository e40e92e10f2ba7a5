//! Display of a work-precision study as text for a terminal.
//!
//! Input: a [`Study`]. Output: a [`Summary`] whose status has the number of runs and the estimated error of the
//! reference. A table lists the fastest run for each error of the tip, in per cent of the length, with scheme, step,
//! edges and wall time. An error that no run reaches has `finer than all runs`. The details have a table of all runs
//! with step, mesh, error (total, by step, by mesh, over the length), time and energy drift. A run that stopped has
//! `failed` as its error. `rodfit study` prints the summary.

use crate::study::{Study, scheme_name};
use crate::summary::quantity::{number, quantity};
use crate::summary::{ItemTable, Summary, Tone};
use std::fmt::{self, Display, Formatter};

/// Significant digits of steps and times in the table of the fastest runs.
const DIGITS: usize = 3;
/// Significant digits in the table of all runs, whose columns must fit into 80.
const FEW_DIGITS: usize = 2;

impl Display for Study {
    /// Writes the [summary](Self::summary) of the study.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

impl Study {
    /// The study as text for a terminal: status with the estimated error of the reference, and a table of the fastest
    /// run for each error. The details have a table of all runs with their step and mesh errors. Errors that no run
    /// reaches have `finer than all runs`.
    pub fn summary(&self) -> Summary {
        let status = format!(
            "{} runs; estimated error of the reference {} of the length",
            self.rows.len(),
            percent(self.reference_error)
        );
        let advice = self.advice.iter();
        let advice = advice.map(|advice| (advice, advice.row.map(|i| &self.rows[i])));
        // For each error the cheapest settings that reach it.
        let fastest = ItemTable::new(advice)
            .left("tip error", |(advice, _)| format!("{} of the length", percent(advice.error)))
            .left("scheme", |(_, row)| row.map_or("finer than all runs".into(), scheme_name))
            .right("step", |(_, row)| row.map(|row| quantity(row.step, "s", DIGITS)))
            .right("segments", |(_, row)| row.map(|row| row.segments.to_string()))
            .right("time", |(_, row)| row.map(|row| quantity(row.wall_seconds, "s", DIGITS)));
        let size = |x: Option<f64>| x.map_or("failed".into(), |x| format!("{x:.1e}"));
        // All runs, with the parts of their errors.
        let runs = ItemTable::new(&self.rows)
            .left("scheme", |row| scheme_name(row))
            .right("step", |row| quantity(row.step, "s", FEW_DIGITS))
            .right("mesh", |row| row.segments.to_string())
            .right("error", |row| size(row.error))
            .right("(step)", |row| size(row.step_error))
            .right("(mesh)", |row| size(Some(row.mesh_error)))
            .right("time", |row| quantity(row.wall_seconds, "s", FEW_DIGITS))
            .right("energy", |row| format!("{:.1e}", row.energy_drift));
        let title = "All runs: step, segments, error of the tip over the length (total, by the step, by the mesh), \
                     computing time, change of the energy over the largest kinetic energy";
        Summary::new(status, Tone::Neutral)
            .table("Fastest run for a tip error", fastest)
            .details()
            .table(title, runs)
    }
}

/// A fraction as text in per cent, rounded to two significant digits: `0.080 %` for 8e-4.
fn percent(fraction: f64) -> String {
    format!("{} %", number(100.0 * fraction, 2))
}

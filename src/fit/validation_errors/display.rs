//! The report of validation errors as text for a terminal.
//!
//! Input: a [`ValidationReport`]. Output: a [`Summary`]. Its status is the number of experiments that could not be
//! simulated, with their reasons as first notes, or else that nothing was fitted. For each unit with several
//! measurements a note has the mean, median and largest of their mean errors. A table has a row per measurement with
//! mean, median, largest and RMS error in the unit of the data. Its last column has the RMS over the stated sigma and
//! in per cent of the measured change, where available. The number of compared values, warnings, the errors of
//! recordings with prescribed ends, and the wall time follow.

use crate::fit::validation_errors::report::{MeasurementError, ValidationReport};
use crate::summary::quantity::{duration, quantity};
use crate::summary::{ItemTable, Summary, SummaryTable, Tone};
use std::fmt::{self, Formatter};

/// Significant digits of displayed errors.
const DIGITS: usize = 3;

impl fmt::Display for ValidationReport {
    /// Writes [`ValidationReport::to_summary`] as text.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.to_summary().fmt(f)
    }
}

impl ValidationReport {
    /// The result as text for a terminal. First are the experiments that could not be simulated, with reasons. The
    /// mean, median and largest mean error of each unit with several measurements, the table of measurements, and the
    /// number of compared values come next. Warnings, errors of recordings with prescribed ends, and the wall time
    /// follow.
    pub fn to_summary(&self) -> Summary {
        // Failures come first: the errors below do not contain them.
        let mut summary = match self.failed.len() {
            0 => Summary::new(self.headline(), Tone::Neutral),
            1 => Summary::new("one experiment could not be simulated", Tone::Bad),
            n => Summary::new(format!("{n} experiments could not be simulated"), Tone::Bad),
        };
        for failed in &self.failed {
            let of = if failed.experiment.is_empty() { "the scene" } else { &failed.experiment };
            summary = summary.note(format!("not simulated: {of} ({})", failed.reason));
        }
        // A single measurement has no summary beside its row in the table.
        for s in self.summary.iter().filter(|s| s.measurements > 1) {
            let shown = |x: f64| quantity(x, &s.unit, DIGITS);
            summary = summary.note(format!(
                "{} measurements: mean error {}, median {}, worst {} ({})",
                s.measurements,
                shown(s.mean),
                shown(s.median),
                shown(s.worst),
                s.worst_observation
            ));
        }
        summary = summary.table("", self.error_table());
        // The kind of values explains the units of the table.
        let values: usize = self.errors.iter().map(|e| e.values).sum();
        summary = summary.note(format!(
            "absolute differences of {values} values: coordinates of points, frequencies or readings"
        ));
        summary = summary.warnings(&self.warnings);
        if let Some(recordings) = &self.recordings {
            summary = recordings.add_to(summary);
        }
        summary.fact("Cost", duration(self.wall_seconds))
    }

    /// The status: values of the scene were used, and the RMS error of a single measurement, or the mean of the mean
    /// errors of several with one unit.
    fn headline(&self) -> String {
        let error = match (&self.errors[..], &self.summary[..]) {
            ([one], _) => {
                let part = one
                    .relative
                    .map(|part| format!(", {:.2} % of the measured change", 100.0 * part));
                let part = part.unwrap_or_default();
                format!(": RMS error {}{part}", quantity(one.rms, &one.unit, DIGITS))
            }
            (_, [all]) => format!(": mean error {}", quantity(all.mean, &all.unit, DIGITS)),
            _ => String::new(),
        };
        format!("prediction with the values of the scene, without a fit{error}")
    }

    /// The table of all simulated measurements, a row each, in their order. Columns: name, mean, median, largest and
    /// RMS absolute error with unit, and the [`remarks`](MeasurementError::remarks) with the RMS over noise and
    /// measured change.
    fn error_table(&self) -> SummaryTable {
        let shown = |e: &MeasurementError, x: f64| quantity(x, &e.unit, DIGITS);
        ItemTable::new(&self.errors)
            .wrapped("measurement", |e| e.observation.clone())
            .right("mean", |e| shown(e, e.mean))
            .right("median", |e| shown(e, e.median))
            .right("worst", |e| shown(e, e.worst))
            .right("RMS", |e| shown(e, e.rms))
            .wrapped("relative RMS", |e| e.remarks())
            .into()
    }
}

impl MeasurementError {
    /// The RMS error over the given noise, as `1.20 sigma`, and in per cent of the measured change, separated by a
    /// comma; empty if neither is available.
    pub fn remarks(&self) -> String {
        let noise = self.sigma.map(|sigma| format!("{:.2} sigma", self.rms / sigma));
        let motion =
            self.relative.map(|part| format!("{:.2} % of the measured change", 100.0 * part));
        noise.into_iter().chain(motion).collect::<Vec<_>>().join(", ")
    }
}

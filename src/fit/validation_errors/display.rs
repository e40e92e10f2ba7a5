//! The prediction errors on the terminal.

use crate::fit::validation_errors::report::{MeasurementError, ValidationReport};
use std::fmt::{self, Formatter};

impl fmt::Display for ValidationReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "prediction with the values of the scenes; no parameter was fitted")?;
        for s in &self.summary {
            if s.measurements > 1 {
                writeln!(
                    f,
                    "{} measurements in {}: mean error {:.2e}, median {:.2e}, worst {:.2e} ({})",
                    s.measurements, s.unit, s.mean, s.median, s.worst, s.worst_observation
                )?;
            }
        }
        writeln!(f)?;
        self.write_table(f)?;
        if let Some(recordings) = &self.recordings {
            writeln!(f)?;
            write!(f, "{recordings}")?;
        }
        for failed in &self.failed {
            let of = if failed.experiment.is_empty() { "the scene" } else { &failed.experiment };
            writeln!(f, "not simulated: {of} ({})", failed.reason)?;
        }
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        write!(f, "\n  {:.3} s", self.wall_seconds)
    }
}

impl ValidationReport {
    fn write_table(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let width = self.errors.iter().map(|e| e.observation.len()).fold(11, usize::max);
        writeln!(
            f,
            "  {:<width$}  {:<9}  {:<9}  {:<9}  {:<9}  {:<6}  remarks",
            "measurement", "mean", "median", "worst", "RMS", "unit"
        )?;
        for e in &self.errors {
            let row = format!(
                "  {:<width$}  {:<9.2e}  {:<9.2e}  {:<9.2e}  {:<9.2e}  {:<6}  {}",
                e.observation,
                e.mean,
                e.median,
                e.worst,
                e.rms,
                e.unit,
                e.remarks()
            );
            writeln!(f, "{}", row.trim_end())?;
        }
        writeln!(f, "  absolute differences of {}", self.values_in_words())
    }

    fn values_in_words(&self) -> String {
        let values: usize = self.errors.iter().map(|e| e.values).sum();
        format!("{values} values: coordinates of points, frequencies or readings")
    }
}

impl MeasurementError {
    /// The RMS error over the given noise, and over the motion.
    pub fn remarks(&self) -> String {
        let noise = self.sigma.map(|sigma| format!("{:.2} sigma", self.rms / sigma));
        let motion =
            self.relative.map(|part| format!("{:.2} % of the measured change", 100.0 * part));
        noise.into_iter().chain(motion).collect::<Vec<_>>().join(", ")
    }
}

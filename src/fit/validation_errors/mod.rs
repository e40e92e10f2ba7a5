//! Errors of predictions on recordings, without a fit: the scenes are simulated with their own values and compared with
//! measurements.

mod compute;
mod display;

use crate::code::Code;
use crate::error::Error;
use crate::fit::Fit;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::report::plot_data::PlotData;
use crate::fit::uncertainty::recordings::RecordingErrors;
use crate::fit::validate::{check_predicted, recorded};
use crate::fit::validation_errors::compute::compared;
use crate::scene::Resolution;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Error of the prediction of one measurement. The free markers of one recording are one measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct MeasurementError {
    /// Name of the experiment; empty where there is only one.
    pub experiment: String,
    /// File or kind of the measurement.
    pub observation: String,
    /// Unit of `mean`, `median`, `worst`, `rms` and `sigma`.
    pub unit: String,
    /// Number of compared values: coordinates of points, frequencies or readings.
    pub values: usize,
    /// Mean absolute difference between simulated and measured values.
    pub mean: f64,
    /// Median absolute difference between simulated and measured values.
    pub median: f64,
    /// Largest absolute difference between simulated and measured values.
    pub worst: f64,
    /// Root mean square difference between simulated and measured values.
    pub rms: f64,
    /// Given standard deviation of the measurement noise; absent where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
    /// `rms` over the root mean square change of the measured values about their mean (motions), about the unloaded rod
    /// (shapes) or over the mean value (frequencies): 0 is exact, 1 is no better than no motion. Absent where nothing changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
}

/// Summary of the prediction errors of all measurements in one unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ValidationSummary {
    /// Unit of the errors.
    pub unit: String,
    /// Number of measurements.
    pub measurements: usize,
    /// Mean of the mean absolute differences of all measurements.
    pub mean: f64,
    /// Median of the mean absolute differences of all measurements.
    pub median: f64,
    /// Largest of the mean absolute differences of all measurements.
    pub worst: f64,
    /// Measurement with the largest mean absolute difference.
    pub worst_observation: String,
}

/// An experiment that could not be simulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FailedPrediction {
    /// Name of the experiment; empty where there is only one.
    pub experiment: String,
    /// Reason of the failure.
    pub reason: String,
}

/// Errors of the predictions of all measurements. Serializes to the JSON of `rodfit predict --json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ValidationReport {
    /// Errors summarized over the measurements, one entry for each unit.
    pub summary: Vec<ValidationSummary>,
    /// Error of each measurement.
    pub errors: Vec<MeasurementError>,
    /// Errors of all markers, held markers included, of the rods with prescribed ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recordings: Option<RecordingErrors>,
    /// Experiments that could not be simulated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failed: Vec<FailedPrediction>,
    /// Mesh, step and scheme that the program chose, in the order of the experiments; null where a scene gives all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resolution: Vec<Option<Resolution>>,
    /// Warnings, each with its code in brackets.
    pub warnings: Vec<String>,
    /// Codes of the warnings, in the same order.
    pub warning_codes: Vec<Code>,
    /// Wall time, s.
    pub wall_seconds: f64,
    /// Measured and simulated series, if they were to be [kept](Fit::keep_plot_data).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plot_data: Option<PlotData>,
}

impl ValidationReport {
    /// Whether every experiment could be simulated.
    pub fn is_complete(&self) -> bool {
        self.failed.is_empty()
    }

    /// The summaries in one line.
    pub fn in_a_line(&self) -> String {
        let one = |s: &ValidationSummary| format!("mean error {:.3e} {}", s.mean, s.unit);
        self.summary.iter().map(one).collect::<Vec<_>>().join("; ")
    }
}

impl Fit {
    /// Whether every measurement is validation data, so that no parameter can be fitted.
    pub fn is_validation_only(&self) -> bool {
        is_validation_only(&self.experiments)
    }

    /// Compares the scenes, with their own values, with all measurements. No parameter is fitted.
    ///
    /// # Errors
    ///
    /// Measurements that cannot be compared with their scenes, an interruption, or no experiment that can be simulated.
    pub fn predict(&self) -> Result<ValidationReport, Error> {
        let since = Instant::now();
        check_predicted(&self.experiments)?;
        recorded(&self.experiments)?;
        let mut report = compared(&self.experiments, self.keep_plot_data)?;
        if !self.unknowns.is_empty() {
            let mut names: Vec<String> =
                self.unknowns.iter().map(|u| u.parameter.to_string()).collect();
            names.dedup();
            let words = format!(
                "all data are validation data: {} not fitted. The predictions use the values of the scenes. Remove \
                 held_out from a measurement to fit",
                match &names[..] {
                    [one] => format!("{one} is"),
                    several => format!("{} are", several.join(", ")),
                }
            );
            report.warnings.insert(0, Code::NotFitted.behind(words));
            report.warning_codes.insert(0, Code::NotFitted);
        }
        report.wall_seconds = since.elapsed().as_secs_f64();
        Ok(report)
    }
}

/// Whether there are measurements, and all of them are validation data.
pub(crate) fn is_validation_only(experiments: &[Experiment]) -> bool {
    let mut measurements = all(experiments).map(|(_, m)| m).peekable();
    measurements.peek().is_some() && measurements.all(Measurement::held_out)
}

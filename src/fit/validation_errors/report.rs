//! The report of validation errors: data types and their JSON.
//!
//! [`ValidationReport`] has the errors of each measurement ([`MeasurementError`]: mean, median, largest and RMS
//! absolute difference in the unit of the data). The RMS is also given as a fraction of the size of the measured
//! effect. That is the spread of a motion about its mean, the deflection of a shape from the unloaded rod, or the mean
//! of frequencies. Of other data it is the RMS of displacements, the critical load, or the spread of readings. The
//! fraction is absent where the size is zero. [`ValidationSummary`] has mean, median and largest of the mean errors of
//! all measurements in one unit. The report also has the errors of recordings with prescribed ends, and the experiments
//! that could not be simulated ([`FailedPrediction`]). It has the mesh, step and scheme that the program chose per
//! experiment, warnings with codes, the wall time in s, and optional data of plots. `Fit::predict` computes it.

use crate::code::Code;
use crate::fit::report::plot_data::PlotData;
use crate::fit::uncertainty::discrepancy::free_run::RecordingErrors;
use crate::scene::Resolution;
use serde::{Deserialize, Serialize};

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
    /// (shapes) or over the mean value (frequencies): 0 is exact, 1 is no better than no motion. Absent where nothing
    /// changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
}

impl MeasurementError {
    /// The warning of a prediction that is worse than no motion at all, or else of an error above [`NOISE_LIMIT`] times
    /// the stated noise; `None` of others.
    pub(super) fn warning(&self) -> Option<(Code, String)> {
        let sigmas = self.sigma.map(|sigma| self.rms / sigma);
        if sigmas.is_some_and(|sigmas| sigmas <= NOISE_LIMIT) {
            return None;
        }
        let (code, finding) = match (self.relative, sigmas) {
            (Some(relative), _) if relative > 1.0 => (
                Code::LargePredictionError,
                format!(
                    "the error is {:.0} % of the measured change, more than that of no change at all. Check the \
                     observed point, time_zero, scale, axes, origin and units before the model",
                    100.0 * relative
                ),
            ),
            (_, Some(sigmas)) => (
                Code::BeyondSigma,
                format!(
                    "the RMS error is {sigmas:.1} times the stated sigma. The scene does not have the values or \
                     the effects of this recording, or sigma is too small"
                ),
            ),
            _ => return None,
        };
        let experiment = match &self.experiment[..] {
            "" => String::new(),
            name => format!("{name}: "),
        };
        Some((code, format!("{experiment}{}: {finding}", self.observation)))
    }
}

/// RMS error over the stated noise up to which a prediction agrees with the data, whatever their change.
const NOISE_LIMIT: f64 = 3.0;

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
    /// Measured and simulated series, if they were to be [kept](crate::fit::Fit::keep_plot_data).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plot_data: Option<PlotData>,
}

impl ValidationReport {
    /// Whether every experiment could be simulated.
    pub fn is_complete(&self) -> bool {
        self.failed.is_empty()
    }

    /// The mean errors in all units, as one line of text, such as `mean error 1.234e-3 m`, separated by semicolons;
    /// empty without errors.
    pub fn in_a_line(&self) -> String {
        let one = |s: &ValidationSummary| format!("mean error {:.3e} {}", s.mean, s.unit);
        self.summary.iter().map(one).collect::<Vec<_>>().join("; ")
    }
}

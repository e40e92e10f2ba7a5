//! Validation errors without a fit: the scenes are simulated with their own values and compared with all measurements
//! (`rodfit predict`).
//!
//! [`Fit::predict`] checks the data and compares every experiment with its measurements (`compute`), fitted or held out
//! alike. If the fit has parameters, the first warning is that they are not fitted. Output: a [`ValidationReport`]
//! (`report`) with the errors of each measurement, whose text for a terminal is in `display`. Experiments that cannot
//! be simulated are listed. It is an error if none can, after an interruption, if an experiment has no measurement, if
//! names of experiments are equal, or if measurements do not fit their scenes or have no data.
//! [`Fit::is_validation_only`] returns whether there are measurements and all are validation data.

mod compute;
mod display;
pub(crate) mod report;

use crate::code::Code;
use crate::error::Error;
use crate::fit::Fit;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::validate::{check_predicted, check_recorded};
use crate::fit::validation_errors::compute::compare_all;
use crate::fit::validation_errors::report::{MeasurementError, ValidationReport};
use crate::numerics::stopwatch::Stopwatch;
use crate::summary::distinct;

impl Fit {
    /// Whether there are measurements, and every one is validation data, so that no parameter can be fitted.
    pub fn is_validation_only(&self) -> bool {
        is_validation_only(&self.experiments)
    }

    /// Compares the scenes, with their own values, with all measurements. No parameter is fitted; parameters of the fit
    /// are a warning, which comes first. Fitted and held-out measurements are treated alike. Experiments that cannot be
    /// simulated are listed in the report.
    ///
    /// # Errors
    ///
    /// Experiments without measurements or with equal names, measurements that cannot be compared with their scenes,
    /// planned measurements without data, an interruption, or no experiment that can be simulated.
    pub fn predict(&self) -> Result<ValidationReport, Error> {
        let since = Stopwatch::start();
        check_predicted(&self.experiments)?;
        check_recorded(&self.experiments)?;
        let mut report = compare_all(&self.experiments, self.keep_plot_data)?;
        let warnings: Vec<(Code, String)> =
            report.errors.iter().filter_map(MeasurementError::warning).collect();
        for (code, words) in warnings {
            report.warnings.push(code.behind(words));
            report.warning_codes.push(code);
        }
        if !self.unknowns.is_empty() {
            let names = distinct(self.unknowns.iter().map(|u| u.parameter.to_string()));
            let not_fitted = match &names[..] {
                [one] => format!("{one} is not fitted"),
                several => format!("{} are not fitted", several.join(", ")),
            };
            let words = match self.is_validation_only() {
                true => format!(
                    "all data are validation data: {not_fitted}. The predictions use the values of the scenes. \
                     Remove held_out from a measurement to fit"
                ),
                false => format!("{not_fitted}: the predictions use the values of the scenes"),
            };
            // This warning comes first, as it concerns all predictions.
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
    measurements.peek().is_some() && measurements.all(|m| m.held_out())
}

//! Predictions of validation data by a fit, with the errors that noise and parameters explain.
//!
//! Measurements marked as held out are not fitted. Each is simulated at the optimum, and the root mean square
//! difference is compared with the expected one, `sqrt(s^2 + mean(j C j'))`, both in the unit of the measurement. Here
//! `j` are the rows of the Jacobian of the measured values, and `C` is the covariance of the unknowns of the fit that
//! have a standard deviation. The noise `s` is the stated sigma, else the largest noise of the fitted measurements with
//! the same unit, else 0. It is the root mean square over the values where these have sigmas of their own. The same two
//! numbers with every difference divided by the factor of its sigma are compared: a ratio that is too large for the
//! number of values (chi-squared test) adds a warning of the severity `Contradiction`. So does a simulation that fails;
//! its experiment has no prediction.
//! [`predictions`] returns one [`Prediction`] per held-out measurement for the report, in the order of the experiments;
//! all markers of a recording share one.

use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::experiment::all;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::fit::uncertainty::warnings::residuals::{factor_text, is_too_large};
use crate::fit::unknown::Unknown;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Error of the prediction of a validation measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Prediction {
    /// Name of the measurement.
    pub observation: String,
    /// Unit of `rms` and `expected`.
    pub unit: String,
    /// Root mean square difference between prediction and measurement, in `unit`.
    pub rms: f64,
    /// Expected `rms` from the noise and from the parameter errors, in `unit`. The noise is the given sigma (root mean
    /// square of those of the values), else the largest one of the fitted measurements with this unit, else 0.
    pub expected: f64,
    /// Number of predicted values.
    pub values: usize,
}

impl Prediction {
    /// Adds the values of another measurement of the same recording: `rms` and `expected` become root mean squares over
    /// both, weighted by their numbers of values.
    fn merge(&mut self, other: &Self) {
        let [own, others] = [self.values as f64, other.values as f64];
        let mean = |a: f64, b: f64| ((own * a * a + others * b * b) / (own + others)).sqrt();
        self.rms = mean(self.rms, other.rms);
        self.expected = mean(self.expected, other.expected);
        self.values += other.values;
    }
}

/// A prediction with its weighted errors, for the test of their ratio.
struct TestedPrediction {
    prediction: Prediction,
    /// The same prediction with every difference over the factor of its sigma, so that all have the same noise.
    weighted: Prediction,
}

/// Predictions of the held-out measurements of all `experiments`, in their order; experiments are simulated in parallel
/// at the optimum. `sigma` is the noise of each fitted measurement, in its unit. An experiment whose simulation fails
/// has none and adds a warning. A ratio of `rms` to `expected`, with every difference over the factor of its sigma,
/// that is too large by [`is_too_large`] adds one too. The warnings have the severity `Contradiction`. Empty without
/// validation data.
pub(crate) fn predictions(
    experiments: &[Experiment],
    fitted: Fitted,
    covariance: &Covariance,
    sigma: &[f64],
    warnings: &mut Warnings,
) -> Vec<Prediction> {
    let held_out: Vec<Experiment> = experiments.iter().map(|e| e.only(|m| m.held_out())).collect();
    if all(&held_out).next().is_none() {
        return Vec::new();
    }
    let measured: Vec<&Experiment> =
        held_out.iter().filter(|e| !e.measurements.is_empty()).collect();
    let predict = |e: &&Experiment| predict(e, fitted, covariance, sigma);
    let found: Vec<_> = measured.par_iter().map(predict).collect();
    let severity = Severity::Contradiction;
    let mut tested: Vec<TestedPrediction> = Vec::new();
    // An experiment that cannot be simulated does not affect the others.
    for (experiment, found) in measured.iter().zip(found) {
        let name = &experiment.name;
        match found {
            Ok(found) => tested.extend(found),
            Err(error) => {
                let text = experiment.with_name(format!(
                    "the validation data could not be predicted: the simulation failed ({error}). The fit \
                     is not validated by them. Check the scene of these data"
                ));
                warnings.add_for(name, severity, Code::PredictionFailed, text);
            }
        }
    }
    // Errors beyond noise and parameters: the model does not hold for these data.
    for TestedPrediction { weighted, .. } in &tested {
        let ratio = weighted.rms / weighted.expected.max(f64::MIN_POSITIVE);
        if is_too_large(ratio, weighted.values) {
            let text = format!(
                "{}: the error of the prediction is {} the one that noise and parameter errors explain. The model \
                 does not generalize to these validation data. Look for a missing effect or a difference in the \
                 setup",
                weighted.observation,
                factor_text(ratio)
            );
            warnings.add_for("", severity, Code::LargePredictionError, text);
        }
    }
    tested.into_iter().map(|tested| tested.prediction).collect()
}

/// Predictions of all measurements of an experiment, from one run with derivatives at the optimum. Consecutive markers
/// of one recording share one prediction. The noise is the stated sigma of the measurement. Else it is the largest
/// `noise` of the fitted measurements with the same unit, or 0 without any. `noise` has one value per fitted
/// measurement. Error: the simulation fails.
fn predict(
    experiment: &Experiment,
    Fitted { search, optimum }: Fitted,
    covariance: &Covariance,
    noise: &[f64],
) -> Result<Vec<TestedPrediction>, Error> {
    // Residuals in the units of the measurements over the factors of their sigmas, and without priors.
    let unknowns: Vec<_> =
        search.unknowns.iter().map(|u| Unknown { prior: None, ..u.clone() }).collect();
    let ones = vec![1.0; experiment.measurements.len()];
    let experiments = std::slice::from_ref(experiment);
    let residuals = Residuals::new(experiments, &ones, &unknowns, &[f64::MAX], search.full_work)?
        .with_work_counter(search.work.clone());
    // The run of the Jacobian yields the residuals too.
    let rows = residuals.plain_jacobian(&optimum.x)?;
    let differences = residuals.plain_residuals(&optimum.x)?;
    // Without a stated sigma the noise is the largest of the fitted measurements with the same unit.
    let fitted_noise = |unit: &str| {
        let fitted = all(search.experiments).zip(noise);
        fitted.filter(|((_, m), _)| m.unit() == unit).map(|(_, s)| *s).fold(0.0, f64::max)
    };
    let mut first = 0;
    let mut found: Vec<TestedPrediction> = Vec::new();
    // Mean square of the differences, and its expectation by noise and by the errors of the parameters.
    for (measurement, count) in experiment.measurements.iter().zip(residuals.counts()) {
        let own = first..first + count;
        first += count;
        let sigma = measurement.sigma().unwrap_or_else(|| fitted_noise(measurement.unit()));
        let variances: Vec<f64> =
            rows[own.clone()].iter().map(|row| covariance.variance_along(row)).collect();
        // With a factor on every value: 1, or that of its sigma.
        let with_factors = |factors: &[f64]| {
            let mean = |sum: f64| sum / count.max(1) as f64;
            let square = |(d, f): (&f64, &f64)| (d * f).powi(2);
            let rms = mean(differences[own.clone()].iter().zip(factors).map(square).sum()).sqrt();
            let variance = |(model, f): (&f64, &f64)| (sigma * sigma + model) * f * f;
            Prediction {
                observation: experiment.group(measurement),
                unit: measurement.unit().into(),
                rms,
                expected: mean(variances.iter().zip(factors).map(variance).sum()).sqrt(),
                values: count,
            }
        };
        let weighted = with_factors(&vec![1.0; count]);
        let prediction = with_factors(&measurement.sigmas(1.0));
        match found.last_mut() {
            Some(last)
                if measurement.marker().is_some()
                    && last.prediction.observation == prediction.observation =>
            {
                last.prediction.merge(&prediction);
                last.weighted.merge(&weighted);
            }
            _ => found.push(TestedPrediction { prediction, weighted }),
        }
    }
    Ok(found)
}

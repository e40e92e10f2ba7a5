//! What was held out of a fit, as the fit predicts it.

use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::experiment::all;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::uncertainty::grade::{Severity, Warnings};
use crate::fit::uncertainty::warnings::{is_too_large, times};
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
    /// Expected `rms` from the noise, where sigma is given, and from the parameter errors, in
    /// `unit`.
    pub expected: f64,
    /// Number of predicted values.
    pub values: usize,
}

impl Prediction {
    /// Takes another one of the same group in.
    fn join(&mut self, other: &Self) {
        let [own, others] = [self.values as f64, other.values as f64];
        let mean = |a: f64, b: f64| ((own * a * a + others * b * b) / (own + others)).sqrt();
        self.rms = mean(self.rms, other.rms);
        self.expected = mean(self.expected, other.expected);
        self.values += other.values;
    }
}

/// Predictions of what `experiments` held out, with warnings where they fail. `sigma` is the noise of what
/// was fitted.
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
    // One that cannot be simulated leaves the others.
    let of = |e: &Experiment| predicted(std::slice::from_ref(e), fitted, covariance, sigma);
    let measured: Vec<&Experiment> =
        held_out.iter().filter(|e| !e.measurements.is_empty()).collect();
    let found: Vec<_> = measured.par_iter().map(|e| of(e)).collect();
    let mut predictions = Vec::new();
    for (experiment, found) in measured.iter().zip(found) {
        match found {
            Ok(found) => predictions.extend(found),
            Err(error) => {
                let whose = match experiment.name.is_empty() {
                    true => String::new(),
                    false => format!("{}: ", experiment.name),
                };
                let words = format!(
                    "{whose}the validation data could not be predicted: the simulation failed ({error}). The fit \
                     is not validated by them. Check the scene of these data"
                );
                warnings.add_alike(
                    Severity::Contradiction,
                    Code::PredictionFailed,
                    &experiment.name,
                    words,
                );
            }
        }
    }
    for p in &predictions {
        let ratio = p.rms / p.expected.max(f64::MIN_POSITIVE);
        if is_too_large(ratio, p.values) {
            let words = format!(
                "{}: the error of the prediction is {} the one that noise and parameter errors explain. The model \
                 does not generalize to these validation data. Look for a missing effect or a difference in the \
                 set-up",
                p.observation,
                times(ratio)
            );
            warnings.add_alike(Severity::Contradiction, Code::LargePredictionError, "", words);
        }
    }
    predictions
}

fn predicted(
    held_out: &[Experiment],
    Fitted { search, optimum }: Fitted,
    covariance: &Covariance,
    noise: &[f64],
) -> Result<Vec<Prediction>, Error> {
    // In plain units, and without priors.
    let unknowns: Vec<_> =
        search.unknowns.iter().map(|u| Unknown { prior: None, ..u.clone() }).collect();
    let ones = vec![1.0; all(held_out).count()];
    let horizons = vec![f64::MAX; held_out.len()];
    let residuals = Residuals::new(held_out, &ones, &unknowns, &horizons, search.full_work)?
        .counting(search.work.clone());
    // The Jacobian first: its run yields the residuals too.
    let rows = residuals.plain_jacobian(&optimum.x)?;
    let differences = residuals.plain(&optimum.x)?;
    // Where nothing is said of the noise, that of what was fitted.
    let like = |unit: &str| {
        let fitted = all(search.experiments).zip(noise);
        let same: Vec<f64> =
            fitted.filter(|((_, m), _)| m.unit() == unit).map(|(_, s)| *s).collect();
        same.iter().copied().fold(0.0, f64::max)
    };
    let mut first = 0;
    let mut found: Vec<Prediction> = Vec::new();
    for ((experiment, measurement), count) in all(held_out).zip(residuals.counts()) {
        let own = first..first + count;
        first += count;
        let sigma = measurement.sigma().unwrap_or_else(|| like(measurement.unit()));
        let n = count.max(1) as f64;
        let square = differences[own.clone()].iter().map(|d| d * d).sum::<f64>() / n;
        let model = rows[own].iter().map(|row| covariance.variance_along(row)).sum::<f64>() / n;
        let prediction = Prediction {
            observation: experiment.group(measurement),
            unit: measurement.unit().into(),
            rms: square.sqrt(),
            expected: (sigma * sigma + model).sqrt(),
            values: count,
        };
        let same = |last: &&mut Prediction| {
            measurement.marker().is_some() && last.observation == prediction.observation
        };
        match found.last_mut().filter(same) {
            Some(last) => last.join(&prediction),
            None => found.push(prediction),
        }
    }
    Ok(found)
}

//! What was held out of a fit, as the fit predicts it.

use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::experiment::all;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::report::FitReport;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::covariance::Local;
use crate::fit::uncertainty::verdict::{Doubts, Weight};
use crate::fit::uncertainty::warnings::{is_too_large, times};
use crate::fit::unknown::Unknown;
use serde::{Deserialize, Serialize};

/// How well a measurement that was held out is predicted.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Prediction {
    /// The file, or what was measured.
    pub observation: String,
    /// Unit of the following.
    pub unit: String,
    /// Root mean square difference between what was predicted and what was measured.
    pub rms: f64,
    /// What the noise, where its sigma is given, and the parameters' errors let one expect.
    pub expected: f64,
    /// Number of values.
    pub values: usize,
}

/// Adds predictions of what `experiments` held out, and warnings where they fail.
pub(crate) fn add(
    experiments: &[Experiment],
    fitted: (&Search, &Optimum),
    local: &Local,
    report: &mut FitReport,
    doubts: &mut Doubts,
) {
    let held_out: Vec<Experiment> = experiments.iter().map(|e| e.only(|m| m.held_out())).collect();
    if all(&held_out).next().is_none() {
        return;
    }
    match predictions(&held_out, fitted, local, &report.sigma) {
        Ok(predictions) => {
            for p in &predictions {
                if is_too_large(p.rms / p.expected.max(f64::MIN_POSITIVE), p.values) {
                    let words = format!(
                        "{}, held out, is {} as far from its prediction as noise and the \
                         parameters' errors explain",
                        p.observation,
                        times(p.rms / p.expected.max(f64::MIN_POSITIVE))
                    );
                    doubts.add(Weight::Contradiction, words);
                }
            }
            report.predictions = predictions;
        }
        Err(error) => doubts.add(
            Weight::Contradiction,
            format!("what was held out could not be predicted: its run failed ({error})"),
        ),
    }
}

fn predictions(
    held_out: &[Experiment],
    (search, optimum): (&Search, &Optimum),
    local: &Local,
    noise: &[f64],
) -> Result<Vec<Prediction>, Error> {
    // In plain units, and without priors.
    let unknowns: Vec<_> =
        search.unknowns.iter().map(|u| Unknown { prior: None, ..u.clone() }).collect();
    let ones = vec![1.0; all(held_out).count()];
    let horizons = vec![f64::MAX; held_out.len()];
    let residuals = Residuals::new(held_out, &ones, &unknowns, &horizons, search.full_work)?
        .counting(search.work.clone());
    let differences = residuals.straight(&optimum.x)?;
    let rows = residuals.straight_jacobian(&optimum.x)?;
    // Where nothing is said of the noise, that of what was fitted.
    let like = |unit: &str| {
        let fitted = all(search.experiments).zip(noise);
        let same: Vec<f64> =
            fitted.filter(|((_, m), _)| m.unit() == unit).map(|(_, s)| *s).collect();
        same.iter().copied().fold(0.0, f64::max)
    };
    let mut first = 0;
    let mut found = Vec::new();
    for ((experiment, measurement), count) in all(held_out).zip(residuals.counts()) {
        let own = first..first + count;
        first += count;
        let sigma = measurement.sigma().unwrap_or_else(|| like(measurement.unit()));
        let n = count.max(1) as f64;
        let square = differences[own.clone()].iter().map(|d| d * d).sum::<f64>() / n;
        let model = rows[own].iter().map(|row| local.variance_along(row)).sum::<f64>() / n;
        found.push(Prediction {
            observation: experiment.label(measurement),
            unit: measurement.unit().into(),
            rms: square.sqrt(),
            expected: (sigma * sigma + model).sqrt(),
            values: count,
        });
    }
    Ok(found)
}

//! Errors of a model on takes that its fit had not, by cross-validation.
//!
//! The error of a set of takes is the mean over the markers of the mean over the takes of the distance between measured
//! and predicted marker, m. In a division into [`PARTS`] random parts, each take is held out once; [`validate`] returns
//! the error over all held-out takes of each of several divisions.

use crate::tentacle::{Model, Take, fit, predict};
use rodfit::fit::{Estimate, FitReport};
use std::error::Error;

/// Number of parts of a division of the takes, each held out once.
const PARTS: usize = 3;

/// Mean of some lengths, m.
fn mean(lengths: &[f64]) -> f64 {
    lengths.iter().sum::<f64>() / lengths.len() as f64
}

/// Distances, m, between the measured markers of some takes and those of a model with the estimates of `report`.
fn distances(
    model: &Model,
    takes: &[Take],
    report: &FitReport,
) -> Result<Vec<f64>, Box<dyn Error>> {
    let value = |estimate: &Estimate| {
        estimate.value.ok_or_else(|| format!("{} is not determined", estimate.name))
    };
    let values = report.parameters.iter().map(value).collect::<Result<Vec<f64>, _>>()?;
    let predicted = predict(model, takes, &values)?.into_iter().flatten();
    let measured = takes.iter().flat_map(|take| &take.markers);
    let distance = |(a, b): ([f64; 3], &[f64; 3])| {
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    Ok(predicted.zip(measured).map(distance).collect())
}

/// The error of a model with the estimates of `report` on some takes, m.
pub fn mean_distance(
    model: &Model,
    takes: &[Take],
    report: &FitReport,
) -> Result<f64, Box<dyn Error>> {
    // All takes have the same markers: the order of the two means does not matter.
    Ok(mean(&distances(model, takes, report)?))
}

/// The errors of a model on held-out takes, m, by each of `count` random divisions of the takes, which are the same for
/// all models.
pub fn validate(model: &Model, takes: &[Take], count: usize) -> Result<Vec<f64>, Box<dyn Error>> {
    // A linear congruential generator (Knuth's MMIX), whose upper bits are random enough for a shuffle.
    let mut state = 46_u64;
    let mut below = |n: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % n
    };
    let mut errors = Vec::new();
    for _ in 0..count {
        let mut order: Vec<usize> = (0..takes.len()).collect();
        for i in (1..takes.len()).rev() {
            order.swap(i, below(i + 1));
        }
        let mut all = Vec::new();
        for part in 0..PARTS {
            let [own, others] = [false, true].map(|is_held| -> Vec<Take> {
                let chosen =
                    order.iter().enumerate().filter(|(k, _)| (k % PARTS == part) == is_held);
                chosen.map(|(_, i)| takes[*i].clone()).collect()
            });
            all.extend(distances(model, &others, &fit(model, &own, false)?)?);
        }
        errors.push(mean(&all));
    }
    Ok(errors)
}

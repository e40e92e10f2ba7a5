//! Errors of a model on takes that its fit had not: each take left out alone, or random splits.
//!
//! The error of a set of takes is the mean over the markers of the mean over the takes of the distance between measured
//! and predicted marker, m.

use crate::tentacle::{Model, Take, fit, predict};
use rodfit::fit::{Estimate, FitReport};
use std::error::Error;

/// Number of random splits.
const SPLITS: usize = 20;
/// Fraction of the takes that a random split fits.
const FITTED: f64 = 9.0 / 14.0;

/// The ways to divide takes into fitted and held-out ones.
#[derive(Clone, Copy, PartialEq)]
pub enum Splits {
    /// Every take is held out once, alone.
    LeaveOneOut,
    /// [`SPLITS`] random splits, the same for all models.
    Random,
}

/// Error on held-out takes, m: mean over all splits, smallest and largest.
pub struct HeldOutError {
    pub mean: f64,
    pub range: [f64; 2],
}

/// The error of a model with the estimates of `report` on some takes, m.
pub fn mean_distance(
    model: &Model,
    takes: &[Take],
    report: &FitReport,
) -> Result<f64, Box<dyn Error>> {
    let value = |estimate: &Estimate| {
        estimate.value.ok_or_else(|| format!("{} is not determined", estimate.name))
    };
    let values = report.parameters.iter().map(value).collect::<Result<Vec<f64>, _>>()?;
    let predicted = predict(model, takes, &values)?.into_iter().flatten();
    let measured = takes.iter().flat_map(|take| &take.markers);
    let distance = |(a, b): ([f64; 3], &[f64; 3])| {
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    // All takes have the same markers: the order of the two means does not matter.
    let all: Vec<f64> = predicted.zip(measured).map(distance).collect();
    Ok(all.iter().sum::<f64>() / all.len() as f64)
}

/// The error of a model on takes that its fits had not.
pub fn validate(
    model: &Model,
    takes: &[Take],
    splits: Splits,
) -> Result<HeldOutError, Box<dyn Error>> {
    let mut errors = Vec::new();
    for held in held_out(takes.len(), splits) {
        let [own, others] = [false, true].map(|is_held| -> Vec<Take> {
            let chosen = (0..takes.len()).filter(|i| held.contains(i) == is_held);
            chosen.map(|i| takes[i].clone()).collect()
        });
        let report = fit(model, &own, false)?;
        errors.push(mean_distance(model, &others, &report)?);
    }
    let range = errors.iter().fold([f64::MAX, 0.0], |[low, high], e| [e.min(low), e.max(high)]);
    Ok(HeldOutError { mean: errors.iter().sum::<f64>() / errors.len() as f64, range })
}

/// The indices of the held-out takes of every split of `count` takes.
fn held_out(count: usize, splits: Splits) -> Vec<Vec<usize>> {
    if splits == Splits::LeaveOneOut {
        return (0..count).map(|i| vec![i]).collect();
    }
    let fitted = (FITTED * count as f64).round() as usize;
    // A linear congruential generator (Knuth's MMIX), whose upper bits are random enough for a shuffle.
    let mut state = 46_u64;
    let mut below = |n: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % n
    };
    let shuffled = |_| {
        let mut order: Vec<usize> = (0..count).collect();
        for i in (1..count).rev() {
            order.swap(i, below(i + 1));
        }
        order.split_off(fitted)
    };
    (0..SPLITS).map(shuffled).collect()
}

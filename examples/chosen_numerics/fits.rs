//! Fits with chosen numerics, where discretization error and noise are of similar size: how often does the 95 % interval of E
//! contain the truth? Each fit uses the tip of a random scene, with noise of [`NOISE`] of the length.

use crate::scenes::{KINDS, scene};
use crate::{read, simulate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;
use rodfit::fit::Sample;
use rodfit::{Error, Fit, Observation, Parameter, Point, Unknown};
use std::ops::Range;

/// Requested error of the simulated truth, over the length; scenes that do not reach it are left out.
const TRUTH: f64 = 2e-4;
/// Standard deviation of the noise over the length.
const NOISE: f64 = 2e-3;
/// Observed positions of the tip.
const SAMPLES: usize = 60;

/// A fit to the tip of a scene, whose numerics are chosen.
enum Outcome {
    /// The simulated truth has a larger error than [`TRUTH`].
    LeftOut,
    Failed(String),
    Fitted {
        is_covered: bool,
        is_unreserved: bool,
        simulations: f64,
        words: String,
    },
}

/// Fits E to the noisy tip of the scene with a seed, whose truth is simulated with the accuracy [`TRUTH`].
fn fitted(seed: u64) -> Result<Outcome, Error> {
    let text = scene(seed);
    let (problem, run) = simulate(&read(&text, &format!("accuracy = {TRUTH}"), "", "")?)?;
    if problem.resolution().is_none_or(|resolution| resolution.bound.is_some()) {
        return Ok(Outcome::LeftOut);
    }
    let (length, end) = (problem.length(), problem.time()?.end);
    let noise = Normal::new(0.0, NOISE * length).map_err(|error| Error::Fit(error.to_string()))?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut sample = |k: usize| -> Result<Sample, Error> {
        let time = end * k as f64 / SAMPLES as f64;
        let (place, _) = run.at(Point::Tip, time)?;
        let place = place.map(|x| Some(x + noise.sample(&mut random)));
        Ok(Sample { time, position: place })
    };
    let samples = (1..=SAMPLES).map(&mut sample).collect::<Result<_, _>>()?;
    // The fit chooses its own numerics, with a larger error than that of the truth.
    let open = read(&text, "", "", "")?.problem_for(rodfit::accuracy::Calculation::Guess)?;
    let fit = Fit::new(&open)
        .observe(Observation::new(samples))
        .identify(Unknown::new(Parameter::YoungsModulus));
    let report = fit.solve()?;
    let truth = problem.scene().material.youngs_modulus;
    let estimate = &report.parameters[0];
    // A fit without a two-sided interval counts as covered.
    let interval = estimate.interval95.unwrap_or([0.0, f64::INFINITY]);
    Ok(Outcome::Fitted {
        is_covered: (interval[0]..=interval[1]).contains(&truth),
        is_unreserved: report.grade == rodfit::fit::Grade::Trustworthy,
        simulations: report.simulations,
        words: format!(
            "{:.4} of the truth, [{:.4}, {:.4}], {:?}",
            estimate.value.unwrap_or(f64::NAN) / truth,
            interval[0] / truth,
            interval[1] / truth,
            report.grade
        ),
    })
}

/// Fits scenes with these seeds, and prints how many intervals contain the truth, with failures and costs.
pub fn cover(seeds: Range<u64>) {
    let outcomes: Vec<(u64, Outcome)> = seeds
        .into_par_iter()
        .map(|seed| (seed, fitted(seed).unwrap_or_else(|error| Outcome::Failed(error.to_string()))))
        .collect();
    let (mut fits, mut covered, mut unreserved, mut failed, mut left_out) = (0, 0, 0, 0, 0);
    let mut costs = Vec::new();
    for (seed, outcome) in outcomes {
        let kind = KINDS[(seed % KINDS.len() as u64) as usize];
        match outcome {
            Outcome::LeftOut => left_out += 1,
            Outcome::Failed(error) => {
                failed += 1;
                println!("{seed} {kind}: {error}");
            }
            Outcome::Fitted { is_covered, is_unreserved, simulations, words } => {
                fits += 1;
                covered += usize::from(is_covered);
                unreserved += usize::from(is_unreserved);
                costs.push(simulations);
                println!("{seed} {kind}: {words}{}", if is_covered { "" } else { ", MISSED" });
            }
        }
    }
    println!(
        "E inside its 95 % interval in {covered} of {fits} fits, {:.1} %; {unreserved} without reservation; {failed} failed; \
         {left_out} scenes left out, whose simulated truth is not accurate enough; median {:.1} simulations",
        100.0 * covered as f64 / f64::from(fits.max(1)),
        crate::median(costs)
    );
}

//! How do grades and undetected biases hold when the model is wrong? Fits of recordings of a true rod that differs from
//! the fitted scene by one effect: taper, tip mass, compliant clamp, length, density, stiffer grip, drag, rest shape,
//! clamp angle. The data come from an [independent solver](cantilever), not from the library. Right models are fitted
//! beside them. No start value and no noise are stated.
//!
//! The columns, per camera and kind:
//!
//! - `unreserved`: fits graded `trustworthy`;
//! - `silent`: those of them whose 95 % interval of E misses the truth;
//! - `named`: fits with the true cause in the first two places of the significant score tests;
//! - `>= 0.8`: fits whose listed undetected bias of E by the true cause is at least 0.8 of `|E_fit - E_true|`;
//! - `median ratio`: of listed over true bias, where an effect that is not listed counts as 0;
//! - `listed` and `ratio`, of right models: medians over all effects of the listed change of E, and of listed over
//!   plausible size.
//!
//! `cargo run --release --example model_errors -- [SEEDS] [FILTER]`, by default one seed. With a filter only kinds whose
//! names contain it are fitted, each with its details; the empty filter `""` prints the details of all.

mod cantilever;
mod checks;
mod grid;
mod kinds;
mod laboratory;
mod outcome;
mod rod;
mod summary;
mod tally;

use cantilever::{Equations, FINE};
use kinds::{Kind, right_models, wrong_models};
use laboratory::{CAMERAS, Camera, fit};
use outcome::{Outcome, details};
use rayon::prelude::*;
use rodfit::{Error, FitReport};

/// Ratio of the number of fits of a right model to that of a wrong one.
const RIGHT_REPEATS: u64 = 2;

/// A fit to be made.
struct Task<'a> {
    kind: &'a Kind,
    positions: &'a [[f64; 2]],
    camera: &'a Camera,
    /// Number of the repetition, and the seed of its noise.
    repeat: u64,
    seed: u64,
}

/// A fit with its comparison to the truth.
struct Fitted<'a> {
    task: &'a Task<'a>,
    outcome: Outcome,
    report: Result<FitReport, Error>,
}

impl<'a> Fitted<'a> {
    /// Records, fits and compares; a fit that fails has an empty comparison.
    fn new(task: &'a Task<'a>) -> Self {
        let report = fit(task.camera.record(task.positions, Some(task.seed)), task.kind.end);
        let outcome = match &report {
            Ok(report) => Outcome::new(task.kind, report),
            Err(_) => Outcome::default(),
        };
        Self { task, outcome, report }
    }

    /// Prints grade, cause, estimates and tests of the fit.
    fn print_details(&self) {
        let Self { task, outcome, report } = self;
        print!("{}, {} camera, seed {}: ", task.kind.name, task.camera.name, task.repeat);
        match report {
            Ok(report) => {
                let silent = if outcome.is_silent() { ", SILENT" } else { "" };
                let named = if outcome.named { ", cause named" } else { "" };
                let ratio = outcome.bias_ratio;
                println!("{}{silent}{named}, bias ratio {ratio:.2}", report.grade.code().name());
                print!("{}", details(task.kind, report));
            }
            Err(error) => println!("failed: {error}"),
        }
    }
}

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(1);
    let filter = arguments.next();
    let wanted = |kind: &Kind| filter.as_ref().is_none_or(|word| kind.name.contains(word.as_str()));

    // The solver is checked first: its errors must be far below the effects.
    let mut all: Vec<Kind> = wrong_models();
    all.extend(right_models());
    checks::check_solver(&all)?;
    let trajectory = |kind: &Kind| match wanted(kind) {
        true => Equations::new(&kind.rod, FINE).tip_positions(kind.end),
        false => Vec::new(),
    };
    let trajectories: Vec<Vec<[f64; 2]>> = all.par_iter().map(trajectory).collect();

    let mut tasks = Vec::new();
    // Seeds depend on the position in the whole list: a filter does not change them.
    let mut stream = 0;
    for (kind, positions) in all.iter().zip(&trajectories) {
        let repeats = if kind.cause.is_some() { seeds } else { RIGHT_REPEATS * seeds };
        for camera in &CAMERAS {
            stream += 1;
            let task = |repeat| {
                let seed = (stream << 32) | repeat;
                Task { kind, positions, camera, repeat, seed }
            };
            tasks.extend((0..repeats).filter(|_| wanted(kind)).map(task));
        }
    }
    let fits: Vec<Fitted> = tasks.par_iter().map(Fitted::new).collect();
    if filter.is_some() {
        fits.iter().for_each(Fitted::print_details);
    }
    let kinds: Vec<&Kind> = all.iter().filter(|kind| wanted(kind)).collect();
    for camera in &CAMERAS {
        println!("\n{} camera: {} 1/s, {} m", camera.name, camera.rate, camera.noise);
        summary::print_wrong(camera, &kinds, &fits);
        summary::print_right(camera, &kinds, &fits);
    }
    summary::print_ratio(&fits);
    Ok(())
}

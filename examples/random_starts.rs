//! Reliability of the search: does every fit from a start up to a hundred times too large or small reach the global minimum, or
//! report that it did not? Random rods, planar and helical, whose modulus spans three decades and whose length is
//! 0.1 to 2 m, recorded at 240 Hz for 1 or 5 s with noise of 0.03 % of the length.
//!
//! `cargo run --release --example random_starts` for 6 rods, `-- 500` for the campaign.

use indicatif::{ParallelProgressIterator, ProgressBar};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;
use rodfit::fit::{Analysis, Refinement, Sample};
use rodfit::scene::{Handedness, Material, Section, Shape, Time};
use rodfit::{Error, Fit, Observation, Parameter, Point, Scene, Unknown};

/// Frames per second of the data.
const FPS: f64 = 240.0;
/// Standard deviation of the noise over the length.
const NOISE: f64 = 3e-4;

/// A random rod; every odd seed is a helix.
fn rod(seed: u64, random: &mut ChaCha8Rng) -> Scene {
    let log = |random: &mut ChaCha8Rng, low: f64, high: f64| -> f64 {
        low * (high / low).powf(random.random_range(0.0..1.0))
    };
    let length = log(random, 0.1, 2.0);
    let modulus = log(random, 1e7, 1e10);
    let helix = seed % 2 == 1;
    let (shape, segments) = match helix {
        false => (Shape::Straight { length, direction: [1.0, 0.0, 0.0] }, 20),
        true => {
            let handedness = Handedness::Left;
            let (radius, pitch, axis) = (0.08 * length, 0.25 * length, [0.0, 0.0, -1.0]);
            (Shape::Helix { length, radius, pitch, axis, handedness }, 30)
        }
    };
    let radius = 0.01 * length;
    let material = Material { poisson_ratio: Some(0.4), ..Material::new(1200.0, modulus) };
    let mut scene = Scene::new(segments, shape, Section::Circle { radius }, material);
    scene.loads.gravity = if helix { [0.0, 0.0, -9.8] } else { [0.0, -9.8, 0.0] };
    scene.loads.damping.mass = random.random_range(0.0..0.5);
    let end = if random.random_bool(0.5) { 1.0 } else { 5.0 };
    // 40 steps in the first period of a straight rod.
    let first = 3.516 * (modulus * radius * radius / (4.0 * 1200.0)).sqrt() / (length * length);
    scene.time = Some(Time::new(end, (std::f64::consts::TAU / first / 40.0).min(4e-3)));
    scene
}

/// The result of a fit: description, whether it reached the global minimum, whether it warned, and its cost.
struct Outcome {
    words: String,
    reached: bool,
    warned: bool,
    simulations: f64,
}

/// Simulates a random rod, fits E from a random start, and compares the estimate with the truth.
fn outcome(seed: u64) -> Result<Outcome, Error> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut scene = rod(seed, &mut random);
    let truth = scene.material.youngs_modulus;
    let factor = 100f64.powf(random.random_range(-1.0..1.0));
    // A fast motion may need smaller steps than the first period suggests: the step is halved until the run succeeds.
    let (problem, run) = loop {
        let problem = scene.problem()?;
        match (problem.simulate(), &mut scene.time) {
            (Ok(run), _) => break (problem, run),
            (Err(_), Some(time)) if time.step_size() > 1e-5 => {
                time.step = time.step.map(|step| 0.5 * step)
            }
            (Err(error), _) => return Err(error),
        }
    };
    let (length, end) = (problem.length(), problem.time()?.end);
    let noise = Normal::new(0.0, NOISE * length).map_err(|e| Error::Fit(e.to_string()))?;
    let mut sample = |k: usize| -> Result<Sample, Error> {
        let time = k as f64 / FPS;
        let (x, _) = run.at(Point::Tip, time)?;
        Ok(Sample { time, position: x.map(|x| Some(x + noise.sample(&mut random))) })
    };
    let frames = (end * FPS) as usize;
    let data = Observation::new((1..=frames).map(&mut sample).collect::<Result<_, _>>()?);
    // Data and model have the same mesh and step.
    let quick = Analysis { discretization_error: Refinement::None, ..Analysis::default() };
    let unknown = Unknown::new(Parameter::YoungsModulus).start(factor * truth);
    let fit = Fit::new(&problem).observe(data).identify(unknown).analyse(quick);
    let what = format!("seed {seed}: {length:.2} m, {truth:.1e} Pa, {end} s, start {factor:.2} x");
    let report = match fit.solve() {
        Ok(report) => report,
        Err(error) => {
            let words = format!("{what}: {error}");
            return Ok(Outcome { words, reached: false, warned: true, simulations: f64::NAN });
        }
    };
    let estimate = &report.parameters[0];
    let off = |value: f64| (value / truth - 1.0).abs();
    // The global minimum is a few standard deviations from the truth.
    let near = |value, sd: f64| off(value) < 6.0 * sd / truth;
    let reached = estimate.value.zip(estimate.std_error).is_some_and(|(value, sd)| near(value, sd));
    Ok(Outcome {
        words: format!("{what}: {:.3e} off, {}", estimate.value.map_or(1.0, off), report.verdict),
        reached,
        warned: !report.is_success() || !report.warnings.is_empty(),
        simulations: report.simulations,
    })
}

fn main() -> Result<(), Error> {
    let count: u64 = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(6);
    let mut outcomes: Vec<Outcome> = (0..count)
        .into_par_iter()
        .progress_with(ProgressBar::new(count))
        .map(outcome)
        .collect::<Result<_, _>>()?;
    let missed = outcomes.iter().filter(|o| !o.reached);
    for o in missed.clone() {
        println!("{}: {}", if o.warned { "says so" } else { "SILENT" }, o.words);
    }
    let silent = missed.clone().filter(|o| !o.warned).count();
    println!("{} of {count} reach the global minimum", count as usize - missed.clone().count());
    println!("{} say that they did not, {silent} do not", missed.count() - silent);
    outcomes.sort_by(|a, b| a.simulations.total_cmp(&b.simulations));
    for part in [0.5, 0.9, 1.0] {
        let o = &outcomes[((count - 1) as f64 * part) as usize];
        println!("{:.0} % take at most {:.1} full simulations", 100.0 * part, o.simulations);
    }
    Ok(())
}

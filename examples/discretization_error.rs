//! Coverage of the reported discretization error: random scenes are fitted to data without noise, which were simulated on a
//! mesh four times finer with a tenth of the step. Prints the share of scenes whose bias is below the reported error.
//!
//! `cargo run --release --example discretization_error` for 8 scenes, `-- 100` for the campaign.

use indicatif::{ParallelProgressIterator, ProgressBar};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use rodfit::fit::{DiscretizationError, Estimate, Sample};
use rodfit::scene::{Clamp, Material, Section, Shape, Time};
use rodfit::{Error, Fit, Observation, Parameter, Point, Scene};

/// A random cantilever, straight or curved, of 8 to 60 edges.
fn scene(random: &mut ChaCha8Rng) -> Scene {
    let shape = match random.random_range(0..3) {
        0 => Shape::Arc { length: 0.5, angle: random.random_range(0.3..1.5) },
        _ => Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] },
    };
    let modulus = 10f64.powf(random.random_range(7.5..9.0));
    let section = Section::Circle { radius: 0.005 };
    let segments = random.random_range(8..=60);
    let mut scene = Scene::new(segments, shape, section, Material::new(1273.52, modulus));
    scene.loads.gravity = [0.0, -9.8, 0.0];
    if random.random_bool(0.5) {
        scene.loads.damping.mass = random.random_range(0.3..2.0);
    }
    if random.random_bool(0.3) {
        scene.supports.clamp = Clamp::Nodes;
    }
    let (end, step) = (random.random_range(0.3..1.0), random.random_range(1e-3..5e-3));
    let beta = if random.random_bool(0.2) { random.random_range(0.52..0.7) } else { 0.5 };
    scene.time = Some(Time { beta, ..Time::new(end, step) });
    scene
}

/// The largest ratio of actual bias to reported error among the parameters of a scene, with a description; none if the fit
/// gives no numbers.
fn bias_over_stated(seed: u64) -> Result<Option<(String, f64)>, Error> {
    let coarse = scene(&mut ChaCha8Rng::seed_from_u64(seed));
    let mut fine = coarse.clone();
    fine.rod.segments = fine.rod.segments.map(|n| 4 * n);
    let mut end = 0.0;
    if let Some(time) = &mut fine.time {
        time.step = time.step.map(|step| 0.1 * step);
        end = time.end;
    }
    // Without noise all bias comes from the discretization.
    let run = fine.problem()?.simulate()?;
    let sample = |k: u32| -> Result<Sample, Error> {
        let time = end * f64::from(k) / 60.0;
        let ([x, y, _], _) = run.at(Point::Tip, time)?;
        Ok(Sample { time, position: [Some(x), Some(y), None] })
    };
    let data = Observation::new((1..=60).map(sample).collect::<Result<_, _>>()?);
    let mut fit = Fit::new(&coarse.problem()?).observe(data).identify(Parameter::YoungsModulus);
    if coarse.loads.damping.mass > 0.0 {
        fit = fit.identify(Parameter::DampingMass);
    }
    let report = fit.solve()?;
    if !report.is_success() {
        return Ok(None);
    }
    let ratio = |(estimate, error): (&Estimate, &DiscretizationError)| {
        let truth = estimate.name.of(&coarse)?;
        let bias = (estimate.value? / truth - 1.0).abs();
        let stated = error.relative?;
        let words = format!("{}: bias {bias:.1e}, stated {stated:.1e}", estimate.name);
        Some((words, bias / stated))
    };
    let ratios = report.parameters.iter().zip(&report.discretization_error).filter_map(ratio);
    Ok(ratios.max_by(|a, b| a.1.total_cmp(&b.1)))
}

fn main() -> Result<(), Error> {
    let count: u64 = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(8);
    let results: Vec<Option<(String, f64)>> = (0..count)
        .into_par_iter()
        .progress_with(ProgressBar::new(count))
        .map(bias_over_stated)
        .collect::<Result<_, _>>()?;
    let mut found: Vec<(String, f64)> = results.into_iter().flatten().collect();
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    let covered = found.iter().filter(|(_, ratio)| *ratio <= 1.0).count();
    println!("the stated error covers the bias in {covered} of {} scenes", found.len());
    println!("the fit gave no numbers in {} of {count}", count as usize - found.len());
    for part in [0.5, 0.9] {
        let (words, ratio) = &found[((found.len() - 1) as f64 * part) as usize];
        println!("bias over stated error, {:.0} %: {ratio:.2} ({words})", 100.0 * part);
    }
    for (words, ratio) in found.iter().filter(|(_, ratio)| *ratio > 1.0) {
        println!("  not covered, {ratio:.2}: {words}");
    }
    Ok(())
}

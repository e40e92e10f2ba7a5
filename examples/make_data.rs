//! Generates the measured trajectories in `data/`: simulations on a finer mesh or with smaller steps than those of the fits,
//! with seeded Gaussian noise.
//!
//! `cargo run --release --example make_data`

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::vibration::LinearizationPoint;
use rodfit::{Observation, Parameter, Point, Scene, Trajectory};
use std::f64::consts::TAU;
use std::fmt::Write;

/// Simulates `scene` and writes its tip at 100 samples a second, with noise of standard deviation `sigma`, m, to `file`.
fn record(
    scene: &Scene,
    seed: u64,
    sigma: f64,
    file: &str,
) -> Result<(), Box<dyn std::error::Error>> {
    let trajectory = scene.problem()?.simulate()?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, sigma)?;
    let planar = scene.problem()?.planar().is_some();
    let mut text = String::from(if planar { "t[s],x[m],y[m]\n" } else { "t[s],x[m],y[m],z[m]\n" });
    let end = trajectory.times()[trajectory.times().len() - 1];
    for k in 0..=(end * 100.0).round() as usize {
        let time = k as f64 / 100.0;
        let (x, _) = trajectory.at(Point::Tip, time)?;
        write!(text, "{time}")?;
        for x in &x[..if planar { 2 } else { 3 }] {
            write!(text, ",{:.6}", x + noise.sample(&mut random))?;
        }
        writeln!(text)?;
    }
    put(file, &text)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data");

    // E: the paper's cantilever, finer in space (200 edges) and time (0.1 ms).
    let mut scene = Scene::load(format!("{folder}/cantilever.toml"))?;
    scene.rod.segments = Some(200);
    if let Some(time) = &mut scene.time {
        time.step = Some(1e-4);
    }
    record(&scene, 1, 1e-3, &format!("{folder}/cantilever-tip.csv"))?;

    // Beta: numerical dissipation depends on the step, which therefore is that of the fit; the mesh is finer.
    let mut scene = Scene::load(format!("{folder}/cantilever-coarse-steps.toml"))?;
    scene.rod.segments = Some(200);
    Parameter::Beta.set(&mut scene, 0.75)?;
    record(&scene, 2, 1e-3, &format!("{folder}/cantilever-beta-tip.csv"))?;

    // The helix in finer steps, on the mesh of its scene: a finer polygon is a softer helix.
    let mut scene = Scene::load(format!("{folder}/helix.toml"))?;
    if let Some(time) = &mut scene.time {
        time.step = Some(1e-4);
    }
    record(&scene, 3, 2e-4, &format!("{folder}/helix-tip.csv"))?;

    // E and density: the shape of a rod at rest under a known force, and its natural frequencies without the force.
    let mut scene = Scene::load(format!("{folder}/droop.toml"))?;
    scene.rod.segments = Some(200);
    (scene.material.youngs_modulus, scene.material.density) = (1.2e8, 1100.0);
    droop(&scene, 4, 3e-4, &format!("{folder}/droop.csv"))?;
    scene.loads.point.clear();
    let natural_frequencies =
        scene.problem()?.modes(2, LinearizationPoint::Equilibrium)?.frequencies_rad_s;
    println!(
        "droop-fit.toml: {:.2?} Hz",
        natural_frequencies.iter().map(|w| w / TAU).collect::<Vec<_>>()
    );

    // A camera with a late clock, lost frames and outliers.
    spoil(&format!("{folder}/cantilever-tip.csv"), 5, &format!("{folder}/outliers-tip.csv"))
}

/// Writes the positions of 20 points of `scene` at rest, mm, with noise of standard deviation `sigma`, m.
fn droop(
    scene: &Scene,
    seed: u64,
    sigma: f64,
    file: &str,
) -> Result<(), Box<dyn std::error::Error>> {
    let problem = scene.problem()?;
    let nodes: Vec<usize> = (0..problem.nodes()).collect();
    let rest = Trajectory::at_rest(&problem, &nodes, &[])?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, sigma)?;
    let mut text = String::from("s[mm],x[mm],y[mm]\n");
    for k in 1..=20 {
        let s = problem.length() * f64::from(k) / 20.0;
        let ([x, y, _], _) = rest.at(Point::ArcLength(s), 0.0)?;
        let [x, y] = [x, y].map(|x| 1e3 * (x + noise.sample(&mut random)));
        writeln!(text, "{},{x:.2},{y:.2}", 1e3 * s)?;
    }
    put(file, &text)
}

/// Writes a recording with its clock 30 ms late, a fifth of its frames missing and a twentieth of its coordinates wrong by
/// 50 mm.
fn spoil(from: &str, seed: u64, file: &str) -> Result<(), Box<dyn std::error::Error>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut text = String::from("t[s],x[m],y[m]\n");
    for sample in Observation::read(from)?.data.samples {
        let time = sample.time - 0.03;
        if time < -1e-9 || random.random_bool(0.2) {
            continue;
        }
        write!(text, "{:.2}", time.max(0.0))?;
        for x in sample.position.into_iter().flatten() {
            let off = match random.random_bool(0.05) {
                true => 0.05 * if random.random_bool(0.5) { 1.0 } else { -1.0 },
                false => 0.0,
            };
            write!(text, ",{:.6}", x + off)?;
        }
        writeln!(text)?;
    }
    put(file, &text)
}

/// Writes a file unless it already has this text, so that files derived from it stay current.
fn put(file: &str, text: &str) -> Result<(), Box<dyn std::error::Error>> {
    if !std::fs::read_to_string(file).is_ok_and(|there| there == text) {
        std::fs::write(file, text)?;
    }
    println!("{file}");
    Ok(())
}

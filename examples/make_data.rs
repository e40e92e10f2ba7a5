//! Remakes the target trajectories in `data/`: simulated with a finer mesh or step than they are
//! fitted with, with seeded Gaussian noise.
//!
//! `cargo run --release --example make_data`

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::{Parameter, Point, Scene};
use std::fmt::Write;

/// Simulates `scene` and writes its tip with noise of `sigma` m a coordinate, 100 samples a second,
/// to `file`.
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
    std::fs::write(file, text)?;
    println!("{file}");
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data");

    // E: the paper's cantilever, finer in space (200 edges) and time (0.1 ms).
    let mut scene = Scene::load(format!("{folder}/cantilever.toml"))?;
    scene.rod.segments = Some(200);
    if let Some(time) = &mut scene.time {
        time.step = 1e-4;
    }
    record(&scene, 1, 1e-3, &format!("{folder}/cantilever-tip.csv"))?;

    // Beta: its dissipation goes with the step, which therefore stays; finer in space.
    let mut scene = Scene::load(format!("{folder}/cantilever-coarse-steps.toml"))?;
    scene.rod.segments = Some(200);
    Parameter::Beta.set(&mut scene, 0.75)?;
    record(&scene, 2, 1e-3, &format!("{folder}/cantilever-beta-tip.csv"))?;

    // The helix in finer steps, on the mesh of its scene: a finer polygon is a softer helix.
    let mut scene = Scene::load(format!("{folder}/helix.toml"))?;
    if let Some(time) = &mut scene.time {
        time.step = 1e-4;
    }
    record(&scene, 3, 2e-4, &format!("{folder}/helix-tip.csv"))
}

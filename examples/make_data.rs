//! Remakes the target trajectories in `data/`: simulated on a mesh four times finer, with seeded
//! Gaussian noise of one millimetre.
//!
//! `cargo run --release --example make_data`

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::{Parameter, Point, Scene};
use std::fmt::Write;

/// Standard deviation of the noise per coordinate, m.
const SIGMA: f64 = 1e-3;

/// Simulates `scene` and writes its noisy tip, 100 samples a second, to `file`.
fn record(scene: &Scene, seed: u64, file: &str) -> Result<(), Box<dyn std::error::Error>> {
    let trajectory = scene.problem()?.simulate()?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, SIGMA)?;
    let mut text = String::from("t[s],x[m],y[m]\n");
    let end = trajectory.times()[trajectory.times().len() - 1];
    for k in 0..=(end * 100.0).round() as usize {
        let time = k as f64 / 100.0;
        let ([x, y, _], _) = trajectory.at(Point::Tip, time)?;
        let [x, y] = [x, y].map(|x| x + noise.sample(&mut random));
        writeln!(text, "{time},{x:.6},{y:.6}")?;
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
    record(&scene, 1, &format!("{folder}/cantilever-tip.csv"))?;

    // Beta: its dissipation goes with the step, which therefore stays; finer in space.
    let mut scene = Scene::load(format!("{folder}/cantilever-coarse-steps.toml"))?;
    scene.rod.segments = Some(200);
    Parameter::Beta.set(&mut scene, 0.75)?;
    record(&scene, 2, &format!("{folder}/cantilever-beta-tip.csv"))
}

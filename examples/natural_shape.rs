//! The natural curvature of every joint of a rod, identified from the motion of twelve points. Prints the cost of derivatives
//! by hundreds of parameters (adjoint method) in time and memory, and the error of the fitted curvatures.
//!
//! `cargo run --release --example natural_shape`, or with other numbers of joints and
//! seconds: `-- 200 4`.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{Field, FieldFit, Sample};
use rodfit::scene::{
    Dimension, InitialState, Material, PointForce, Scene, Scheme, Section, Shape, Time,
};
use rodfit::{AdjointRun, Error, Observation, Parameter, Point, Problem};
use std::time::Instant;

/// Standard deviation of every coordinate, m.
const NOISE: f64 = 2e-4;

fn main() -> Result<(), Error> {
    let mut asked = std::env::args().skip(1);
    let joints: usize = asked.next().and_then(|count| count.parse().ok()).unwrap_or(500);
    let end: f64 = asked.next().and_then(|end| end.parse().ok()).unwrap_or(1.0);
    for dimension in [Dimension::Planar, Dimension::Spatial] {
        costs(&arc(joints, dimension, end).problem()?)?;
    }
    found(&arc(joints, Dimension::Planar, end.min(1.0)), joints)
}

/// An arc, clamped at a wall, that swings when a force at its tip is removed, with `joints` joints of one natural curvature
/// each.
fn arc(joints: usize, dimension: Dimension, end: f64) -> Scene {
    let shape = Shape::Arc { length: 0.5, angle: 2.0 };
    let section = Section::Circle { radius: 0.004 };
    let material = Material { poisson_ratio: Some(0.4), ..Material::new(1200.0, 1e7) };
    let mut scene = Scene::new(joints + 1, shape, section, material);
    scene.rod.dimension = dimension;
    scene.rod.natural_curvature = vec![1.0; joints].into();
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene.loads.damping.mass = 2.0;
    scene.initial.state = InitialState::Equilibrium;
    let force = [0.0, 0.03, 0.0];
    scene.initial.point = vec![PointForce { force, ..PointForce::default() }];
    scene.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(end, 4e-3) });
    scene
}

/// The shortest of three durations, s.
fn least(mut run: impl FnMut() -> Result<(), Error>) -> Result<f64, Error> {
    let mut times = Vec::new();
    for _ in 0..3 {
        let since = Instant::now();
        run()?;
        times.push(since.elapsed().as_secs_f64());
    }
    Ok(times.into_iter().fold(f64::INFINITY, f64::min))
}

/// Largest memory of the process so far, MB; 0 if the system does not report it.
fn most_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1024.0
}

/// Prints the time of a run, and the time and memory of a run with the derivatives of a misfit.
fn costs(problem: &Problem) -> Result<(), Error> {
    let (tip, steps) = (problem.nodes() - 1, problem.time()?.steps());
    let parameters = Parameter::list(problem.scene(), "natural_curvature")?;
    let plain = least(|| {
        let mut run = rodfit::Trajectory::new(problem, &[tip], &[])?;
        run.run(problem, steps, |_| {})
    })?;
    let mut memory = vec![most_memory()];
    // The adjoint method stores the run within a limit of memory, and recomputes parts that do not fit.
    let back = |bytes: usize| -> Result<f64, Error> {
        least(|| {
            let run = AdjointRun::run_within(problem, &[tip], steps, bytes)?;
            let mut slopes = run.slopes();
            for k in 0..=steps {
                slopes.add_motion(tip, k, [[1.0, 1.0, 0.0], [0.0; 3]])?;
            }
            run.gradient(&parameters, &slopes).map(drop)
        })
    };
    let little = back(8 << 20)? / plain;
    memory.push(most_memory());
    let all = back(56 << 20)? / plain;
    memory.push(most_memory());
    let (count, name) = (parameters.len(), problem.model().0);
    println!("{name}, {} edges, {steps} steps: a run takes {plain:.3} s", problem.segments());
    println!(
        "  with the derivatives of a misfit by {count} numbers {all:.2} runs, within 8 MB {little:.2}"
    );
    let [run, little, all] = memory[..] else { unreachable!("three were noted") };
    println!(
        "  most memory so far: {run:.0} MB, within 8 MB {little:.0} MB, within 56 MB {all:.0} MB"
    );
    Ok(())
}

/// Identifies the natural curvatures of an arc whose true curvature varies along it.
fn found(scene: &Scene, joints: usize) -> Result<(), Error> {
    let truth = |s: f64| 1.0 + 0.3 * (12.0 * s).sin() - 0.4 * s;
    let mut bent = scene.clone();
    let at = |k: usize| truth((k as f64 + 0.5) * 0.5 / joints as f64);
    bent.rod.natural_curvature = (0..joints).map(at).collect::<Vec<f64>>().into();
    let run = bent.problem()?.simulate()?;
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let noise = Normal::new(0.0, NOISE).expect("a positive deviation");
    let mut fit = FieldFit::new(&scene.problem()?);
    for node in (1..=12).map(|k| k * joints / 12) {
        let seen = |(k, time): (usize, &f64)| {
            let [x, y, _] = run.node(node, k);
            let mut off = |x: f64| Some(x + noise.sample(&mut random));
            Sample { time: *time, position: [off(x), off(y), None] }
        };
        let samples = run.times().iter().enumerate().map(seen).collect();
        let point = Point::Node(node);
        fit = fit.observe(Observation::new(samples).at(point).sigma(NOISE));
    }
    // A Gaussian-process prior along the rod: standard deviation 0.4 1/m, correlation length 0.05 m.
    let name = "natural_curvature".into();
    let report = fit.along(Field { name, sigma: 0.4, length: 0.05 }).solve()?;
    let found = &report.fields[0];
    let off = (0..joints).map(|k| (found.values[k] - truth(found.arc_lengths[k])).powi(2));
    let error = (off.sum::<f64>() / joints as f64).sqrt();
    let claimed = found.standard_errors.iter().map(|e| e * e).sum::<f64>() / joints as f64;
    println!(
        "a fit of {joints} curvatures: {}, {:.0} runs and products, {:.1} s; off by {error:.4}, claimed {:.4}, \
         prior 0.4; {:.1} combinations determined",
        if report.converged { "converged" } else { "not converged" },
        report.simulations,
        report.wall_seconds,
        claimed.sqrt(),
        report.effective_parameters
    );
    Ok(())
}

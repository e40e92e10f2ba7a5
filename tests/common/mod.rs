//! Scenes, fits and recordings that the test programs share. Every program includes the whole module,
//! and uses a part.
#![allow(dead_code)]

pub mod differences;
pub mod fits;
pub mod formats;
pub mod poses;
pub mod recordings;

use rodfit::rod::Energies;
use rodfit::scene::{Clamp, Handedness, Material, PointForce, Scene, Section, Shape, Time};
use rodfit::{Equilibrium, PlanarProblem, Problem, Trajectory};
use std::f64::consts::PI;

/// The paper's cantilever, 50 edges, for 1 s in steps of 1 ms.
pub fn cantilever() -> Scene {
    let mut scene = straight_rod(50, [0.5, 0.005], Material::new(1273.52, 1e8));
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene.time = Some(Time::new(1.0, 1e-3));
    scene
}

/// The cantilever with other times and walls.
pub fn cantilever_with(beta: f64, step: f64, end: f64, clamp: Clamp) -> Scene {
    let mut scene = cantilever();
    scene.time = Some(Time { beta, ..Time::new(end, step) });
    scene.supports.clamp = clamp;
    scene
}

/// The cantilever with fewer edges and other times.
pub fn coarse(segments: usize, step: f64, end: f64) -> Scene {
    let mut scene = cantilever_with(0.5, step, end, Clamp::MidEdge);
    scene.rod.segments = Some(segments);
    scene
}

/// The paper's helix, 50 edges, with the given times and walls.
pub fn helix_with(beta: f64, step: f64, end: f64, clamp: Clamp) -> Scene {
    let shape = Shape::Helix {
        length: 0.5,
        radius: 0.02,
        pitch: 0.05,
        axis: [0.0, 0.0, -1.0],
        handedness: Handedness::Left,
    };
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(1273.52, 1e7) };
    let mut scene = Scene::new(50, shape, Section::Circle { radius: 0.005 }, material);
    scene.loads.gravity = [0.0, 0.0, -9.8];
    scene.supports.clamp = clamp;
    scene.time = Some(Time { beta, ..Time::new(end, step) });
    scene
}

/// A straight round rod along x of this length and radius, m, clamped at x = 0, without weight.
pub fn straight_rod(segments: usize, [length, radius]: [f64; 2], material: Material) -> Scene {
    let shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
    Scene::new(segments, shape, Section::Circle { radius }, material)
}

/// A straight rod of unit length and bending stiffness without weight, clamped at x = 0.
pub fn unit_rod(segments: usize, slenderness: f64) -> Scene {
    let modulus = 4.0 / (PI * slenderness.powi(4));
    straight_rod(segments, [1.0, slenderness], Material::new(1.0, modulus))
}

/// A force on the tip, for `loads.point` and `initial.point`.
pub fn at_tip(force: [f64; 3]) -> Vec<PointForce> {
    vec![PointForce { force, ..PointForce::default() }]
}

/// The problem with its planar model.
pub fn planar(problem: &Problem) -> PlanarProblem<'_> {
    problem.planar().expect("the scene lies in a plane")
}

pub fn simulate(scene: &Scene) -> Trajectory {
    scene.problem().unwrap().simulate().unwrap()
}

pub fn rest(scene: &Scene) -> Equilibrium {
    scene.problem().unwrap().equilibrium().unwrap()
}

/// Distance of two points, m.
pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// The tip at the end of a run, m.
pub fn last_tip(scene: &Scene) -> [f64; 3] {
    let run = simulate(scene);
    run.tip(run.times().len() - 1)
}

/// The order of convergence from the places of the tip with a step, its half and its quarter.
pub fn observed_order(tips: [[f64; 3]; 3]) -> f64 {
    let errors = [distance(tips[0], tips[1]), distance(tips[1], tips[2])];
    println!("errors {errors:?}");
    (errors[0] / errors[1]).log2()
}

/// The largest change of the total energy in a run over the largest of a `part` of it, and the latter, J.
pub fn energy_change(scene: &Scene, part: impl Fn(&Energies) -> f64) -> [f64; 2] {
    let problem = scene.problem().unwrap();
    let mut run = Trajectory::new(&problem, &[], &[]).unwrap().keep_energies();
    run.run(&problem, problem.time().unwrap().steps(), |_| {}).unwrap();
    let total: Vec<f64> = run.energies().iter().map(|e| e.total()).collect();
    let most = run.energies().iter().map(part).fold(0.0, f64::max);
    [total.iter().map(|e| (e - total[0]).abs()).fold(0.0, f64::max) / most, most]
}

/// Sag of the tip over the length at every step.
pub fn sag(trajectory: &Trajectory) -> Vec<f64> {
    (0..trajectory.times().len()).map(|k| -trajectory.tip(k)[1] / 0.5).collect()
}

/// Extremum of samples in a window of times by the parabola through the outermost one and its
/// neighbors; `sign` 1 for the maximum, -1 for the minimum.
pub fn extremum(times: &[f64], values: &[f64], window: [f64; 2], sign: f64) -> f64 {
    let inside = (1..values.len() - 1).filter(|k| times[*k] >= window[0] && times[*k] <= window[1]);
    let k = inside.max_by(|a, b| (sign * values[*a]).total_cmp(&(sign * values[*b]))).unwrap();
    let [a, b, c] = [values[k - 1], values[k], values[k + 1]];
    b + (a - c) * (a - c) / (8.0 * (2.0 * b - a - c))
}

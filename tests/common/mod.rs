//! Scenes the tests share.
#![allow(dead_code)]

use rodfit::scene::{Clamp, Material, Scene, Section, Shape, Time};
use rodfit::{PlanarProblem, Point, Problem, Trajectory};

/// The paper's cantilever, 50 edges, for 1 s in steps of 1 ms.
pub fn cantilever() -> Scene {
    let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
    let mut scene =
        Scene::new(50, shape, Section::Circle { radius: 0.005 }, Material::new(1273.52, 1e8));
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

/// The problem with its planar model.
pub fn planar(problem: &Problem) -> PlanarProblem<'_> {
    problem.planar().expect("the scene lies in a plane")
}

/// Sag of the tip over the length at every step.
pub fn sag(trajectory: &Trajectory) -> Vec<f64> {
    (0..trajectory.times().len()).map(|k| -trajectory.tip(k)[1] / 0.5).collect()
}

/// Extremum of samples in a window of times by the parabola through the outermost one and its
/// neighbours; `sign` 1 for the maximum, -1 for the minimum.
pub fn extremum(times: &[f64], values: &[f64], window: [f64; 2], sign: f64) -> f64 {
    let inside = (1..values.len() - 1).filter(|k| times[*k] >= window[0] && times[*k] <= window[1]);
    let k = inside.max_by(|a, b| (sign * values[*a]).total_cmp(&(sign * values[*b]))).unwrap();
    let [a, b, c] = [values[k - 1], values[k], values[k + 1]];
    b + (a - c) * (a - c) / (8.0 * (2.0 * b - a - c))
}

/// The tip's positions at `count` times evenly spread to the end, as a noise-free observation.
pub fn record(trajectory: &Trajectory, count: usize) -> rodfit::Observation {
    let end = trajectory.times()[trajectory.times().len() - 1];
    let samples = (1..=count).map(|k| {
        let time = end * k as f64 / count as f64;
        let ([x, y, _], _) = trajectory.at(Point::Tip, time).unwrap();
        rodfit::fit::Sample { time, position: [Some(x), Some(y), None] }
    });
    rodfit::Observation::new(samples.collect())
}

/// The paper's helix, 50 edges, with the given times and walls.
pub fn helix_with(beta: f64, step: f64, end: f64, clamp: Clamp) -> Scene {
    let shape = Shape::Helix {
        length: 0.5,
        radius: 0.02,
        pitch: 0.05,
        axis: [0.0, 0.0, -1.0],
        handedness: rodfit::scene::Handedness::Left,
    };
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(1273.52, 1e7) };
    let mut scene = Scene::new(50, shape, Section::Circle { radius: 0.005 }, material);
    scene.loads.gravity = [0.0, 0.0, -9.8];
    scene.supports.clamp = clamp;
    scene.time = Some(Time { beta, ..Time::new(end, step) });
    scene
}

//! Seeded scenes of a rod that falls on a floor and up to three other obstacles, and the measures of their runs.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::scene::{
    Contact, Dimension, Handedness, Material, ObstacleMotion, Scheme, Section, Shape, Support, Time,
};
use rodfit::{Error, Scene, Trajectory};
use std::f64::consts::TAU;

/// Points per edge at which the overlap is measured.
const POINTS: usize = 16;

/// Measures of a run.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Whether an obstacle moves.
    pub moved: bool,
    /// Largest rise of the energy above its lowest value before, over the largest kinetic energy.
    pub rise: f64,
    /// Largest overlap with an obstacle over the radius of the rod; from 1 on the axis of the rod is inside.
    pub overlap: f64,
    /// Number of accepted steps, also of halved ones.
    pub steps: usize,
}

/// A random number of the seed, between two positive limits, uniform in its logarithm.
fn log(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.random_range(0.0..1.0))
}

/// A free rod: straight, curved or helical, planar for even seeds.
fn rod(seed: u64, random: &mut ChaCha8Rng) -> Scene {
    let length = random.random_range(0.1..0.5);
    let (tilt, turn) = (random.random_range(-0.5..0.5_f64), random.random_range(0.0..TAU));
    let planar = seed.is_multiple_of(2);
    let z = if planar { 0.0 } else { 0.5 * turn.sin() };
    let shape = match (seed / 2 % 3, planar) {
        (0, _) => Shape::Straight { length, direction: [1.0, tilt, z] },
        (1, _) | (_, true) => Shape::Arc { length, angle: 4.0 * tilt + 1e-3 },
        _ => {
            let (radius, pitch, axis) = (0.1 * length, 0.2 * length, [1.0, tilt, z]);
            Shape::Helix { length, radius, pitch, axis, handedness: Handedness::Left }
        }
    };
    let material = Material {
        poisson_ratio: Some(0.4),
        ..Material::new(log(random, 900.0, 3000.0), log(random, 1e6, 1e9))
    };
    let radius = length * log(random, 0.005, 0.02);
    let segments = random.random_range(12..30);
    let mut scene = Scene::new(segments, shape, Section::Circle { radius }, material);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    scene.supports.start = Support::Free;
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.loads.damping.stiffness = [0.0, 1e-4, 1e-3][random.random_range(0..3)];
    let speed = random.random_range(-0.5..0.5);
    scene.initial.velocity = [speed, -random.random_range(0.0..0.5), speed * z];
    let scheme = Scheme::GeneralisedAlpha;
    scene.time = Some(Time { scheme, ..Time::new(0.3, 2e-4) });
    scene
}

/// The scene of a seed: the obstacles are below the lowest point of the rod, every third floor is a belt, and every third
/// obstacle oscillates.
pub fn scene(seed: u64) -> Result<Scene, Error> {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut scene = rod(seed, random);
    let problem = scene.problem()?;
    let nodes: Vec<usize> = (0..problem.nodes()).collect();
    let mut start = Trajectory::new(&problem, &nodes, &[])?;
    start.run(&problem, 0, |_| {})?;
    let nodes = nodes.iter().map(|i| start.node(*i, 0));
    let range = |c: usize| {
        let values = nodes.clone().map(|x| x[c]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    };
    let ([left, right], [lowest, _], [near, far]) = (range(0), range(1), range(2));
    let Section::Circle { radius } = scene.rod.section else { unreachable!() };
    let (planar, drop) = (problem.planar().is_some(), random.random_range(0.01..0.08));
    let losses = |random: &mut ChaCha8Rng| {
        let damping = [None, Some(0.5), Some(5.0)][random.random_range(0..3)];
        (damping, [None, Some(0.2), Some(0.8)][random.random_range(0..3)])
    };
    let (damping, friction) = losses(random);
    let velocity = [random.random_range(-0.5..0.5), 0.0, 0.0];
    let belt = vec![ObstacleMotion { velocity, ..ObstacleMotion::default() }];
    let floor = Contact::plane([0.0, lowest - radius - drop, 0.0], [0.0, 1.0, 0.0]);
    let motion = if seed.is_multiple_of(3) { belt } else { Vec::new() };
    scene.contacts.push(floor.damping(damping).friction(friction).motion(motion));
    for _ in 0..random.random_range(0..4) {
        let size = log(random, 2.0 * radius, 8.0 * radius);
        let place = |random: &mut ChaCha8Rng, low: f64, high: f64| {
            low + (high - low) * random.random_range(0.0..1.0)
        };
        let y = lowest - radius - 1.4 * size - random.random_range(0.1..0.5) * drop;
        let z = if planar { near } else { place(random, near, far) };
        let center = [place(random, left, right), y, z];
        let (damping, friction) = losses(random);
        let oscillation = ObstacleMotion {
            displacement: [0.3 * size, 0.3 * size, 0.0],
            frequency: Some(random.random_range(2.0..6.0)),
            ..ObstacleMotion::default()
        };
        let motion = if random.random_range(0..3) == 0 { vec![oscillation] } else { Vec::new() };
        let axis = if planar { [0.0, 0.0, 1.0] } else { [0.5, 0.0, 1.0] };
        let ends = [-2.0, 2.0].map(|s| [0, 1, 2].map(|c| center[c] + s * size * axis[c]));
        let obstacle = match random.random_range(0..3) {
            0 => Contact::sphere(center, size),
            1 => Contact::cylinder(center, axis, size),
            _ => Contact::capsule(ends, size),
        };
        scene.contacts.push(obstacle.damping(damping).friction(friction).motion(motion));
    }
    scene.validate()?;
    Ok(scene)
}

/// Displacement of an obstacle at a time, s, by velocity and frequency, m.
fn displacement(motion: &[ObstacleMotion], time: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for own in motion {
        let wave = own.frequency.map_or(0.0, |frequency| (TAU * frequency * time).sin());
        for c in 0..3 {
            sum[c] += own.velocity[c] * time + own.displacement[c] * wave;
        }
    }
    sum
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| a[c] * b[c]).sum()
}

/// Length, m, of the part of `way` across `axis`, where the part along it is at most the given multiples of the axis.
fn across(way: [f64; 3], axis: [f64; 3], [least, most]: [f64; 2]) -> f64 {
    let along = (dot(way, axis) / dot(axis, axis)).clamp(least, most);
    let across = [0, 1, 2].map(|c| way[c] - along * axis[c]);
    dot(across, across).sqrt()
}

/// Distance, m, of a point from the surface of an obstacle at a time, s; negative inside.
fn distance(contact: &Contact, x: [f64; 3], time: f64) -> f64 {
    let from = |point: &[f64; 3], motion: &[ObstacleMotion]| {
        let moved = displacement(motion, time);
        [0, 1, 2].map(|c| x[c] - point[c] - moved[c])
    };
    match contact {
        Contact::Plane { point, normal, motion, .. } => {
            dot(from(point, motion), *normal) / dot(*normal, *normal).sqrt()
        }
        Contact::Sphere { center, radius, motion, .. } => {
            let way = from(center, motion);
            dot(way, way).sqrt() - radius
        }
        Contact::Cylinder { point, axis, radius, motion, .. } => {
            across(from(point, motion), *axis, [f64::NEG_INFINITY, f64::INFINITY]) - radius
        }
        Contact::Capsule { from: first, to, radius, motion, .. } => {
            let axis = [0, 1, 2].map(|c| to[c] - first[c]);
            across(from(first, motion), axis, [0.0, 1.0]) - radius
        }
    }
}

/// Runs a scene and measures energy and overlaps after every step.
pub fn run(scene: &Scene) -> Result<Outcome, Error> {
    let problem = scene.problem()?;
    let nodes: Vec<usize> = (0..problem.nodes()).collect();
    let mut run = Trajectory::new(&problem, &nodes, &[])?.keep_energies();
    run.run(&problem, problem.time()?.steps(), |_| {})?;
    let Section::Circle { radius } = scene.rod.section else { unreachable!() };
    let (mut lowest, mut rise, mut kinetic) = (f64::INFINITY, 0.0_f64, 0.0_f64);
    for energies in run.energies() {
        lowest = lowest.min(energies.total());
        rise = rise.max(energies.total() - lowest);
        kinetic = kinetic.max(energies.kinetic);
    }
    let mut closest = f64::INFINITY;
    for (k, time) in run.times().iter().enumerate() {
        for i in 1..nodes.len() {
            let (a, b) = (run.node(i - 1, k), run.node(i, k));
            for p in 0..=POINTS {
                let part = p as f64 / POINTS as f64;
                let x = [0, 1, 2].map(|c| a[c] + part * (b[c] - a[c]));
                for contact in &scene.contacts {
                    closest = closest.min(distance(contact, x, *time));
                }
            }
        }
    }
    let overlap = (1.0 - closest / radius).max(0.0);
    let moves = |contact: &Contact| match contact {
        Contact::Plane { motion, .. }
        | Contact::Sphere { motion, .. }
        | Contact::Cylinder { motion, .. }
        | Contact::Capsule { motion, .. } => !motion.is_empty(),
    };
    let moved = scene.contacts.iter().any(moves);
    Ok(Outcome { moved, rise: rise / kinetic, overlap, steps: run.work().steps })
}

//! Contact without friction: deflections by obstacles and lifted lengths against beam theory, free fall, order of the steps.

use rodfit::scene::*;
use rodfit::Trajectory;
use std::f64::consts::PI;

use crate::common::{at_tip, rest};

const RADIUS: f64 = 0.002;
const LENGTH: f64 = 0.5;
const DENSITY: f64 = 1200.0;
const MODULUS: f64 = 5e7;

/// A straight rod along x, clamped at its start, without weight.
fn straight(segments: usize) -> Scene {
    let shape = Shape::Straight { length: LENGTH, direction: [1.0, 0.0, 0.0] };
    let mut material = Material::new(DENSITY, MODULUS);
    material.poisson_ratio = Some(0.4);
    Scene::new(segments, shape, Section::Circle { radius: RADIUS }, material)
}

fn bending_stiffness() -> f64 {
    MODULUS * PI / 4.0 * RADIUS.powi(4)
}

fn weight_per_length() -> f64 {
    DENSITY * PI * RADIUS.powi(2) * 9.81
}

/// A floor at this height.
fn floor(height: f64, stiffness: Option<f64>) -> Contact {
    let (point, normal) = ([0.0, height, 0.0], [0.0, 1.0, 0.0]);
    Contact::Plane { point, normal, stiffness, contact_radius: None }
}

/// A heavy rod on a floor, whose end is lifted by the force F. The lifted length is a = 2 F/q, and the height of the end
/// d = q a^4/(24 EI).
#[test]
fn lifted_end_of_a_heavy_rod_on_a_floor_has_the_lifted_length_of_beam_theory() {
    let q = weight_per_length();
    for stiffness in [None, Some(1e10), Some(1e13), Some(1e16)] {
        for segments in [100, 200, 400] {
            let mut scene = straight(segments);
            scene.loads.gravity = [0.0, -9.81, 0.0];
            scene.contacts = vec![floor(-RADIUS, stiffness)];
            let lifted = 0.25;
            scene.loads.point = at_tip([0.0, 0.5 * q * lifted, 0.0]);
            let found = rest(&scene);
            let height = found.tip[1];
            let length = (24.0 * bending_stiffness() * height / q).powf(0.25);
            println!(
                "{stiffness:?} {segments}: d = {height:.6e}, a {:.5} of theory, {} steps, {:?}",
                length / lifted,
                found.newton_iterations,
                found.warnings
            );
        }
    }
}

/// A rod without weight, clamped at its start, is lowered onto an obstacle. It bends by h at the distance a, so that its tip is
/// higher by h (3 L/a - 1)/2 than the clamp.
#[test]
fn rod_lowered_onto_an_obstacle_deflects_as_a_cantilever() {
    let (below, depth, at) = (0.011, 0.004, 0.3);
    let radius = 0.01;
    let center = [at, -below - RADIUS - radius + 0.008, 0.0];
    let (stiffness, contact_radius) = (None, None);
    let across = [0.0, 0.0, 1.0];
    let ends = [-0.02, 0.02].map(|z| [center[0], center[1], z]);
    let obstacles = [
        Contact::Sphere { center, radius, stiffness, contact_radius },
        Contact::Cylinder { point: center, axis: across, radius, stiffness, contact_radius },
        Contact::Capsule { from: ends[0], to: ends[1], radius, stiffness, contact_radius },
    ];
    for obstacle in obstacles {
        for dimension in [Dimension::Auto, Dimension::Spatial] {
            let mut scene = straight(100);
            scene.rod.dimension = dimension;
            scene.contacts = vec![obstacle.clone()];
            let displacement = [0.0, -0.003 - depth, 0.0];
            scene.supports.motion =
                vec![Motion { end: End::Start, displacement, ..Motion::default() }];
            let found = rest(&scene);
            println!(
                "{:?} {dimension:?}: tip {:?} {:.5}",
                obstacle,
                found.tip,
                (found.tip[1] + 0.003 + depth) / (depth * (3.0 * LENGTH / at - 1.0) / 2.0)
            );
        }
    }
}

/// A free rod above a floor.
fn falling(scheme: Scheme, step: f64, end: f64) -> Scene {
    let mut scene = straight(20);
    scene.supports.start = Support::Free;
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.contacts = vec![floor(-RADIUS - 0.002, None)];
    scene.time = Some(Time { scheme, ..Time::new(end, step) });
    scene
}

#[test]
fn rod_that_falls_on_a_floor_gains_no_energy() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField] {
        for step in [1e-4, 2e-4, 5e-4] {
            for direction in [[1.0, 0.0, 0.0], [1.0, 0.02, 0.0]] {
                let mut scene = falling(scheme, step, 0.2);
                scene.rod.shape = Shape::Straight { length: LENGTH, direction };
                let problem = scene.problem().unwrap();
                let mut energies = Vec::new();
                let mut run = Trajectory::new(&problem, &[], &[]).unwrap();
                let steps = (0.2 / step) as usize;
                let end = run.run(&problem, steps, |now| energies.push(now.energies().total()));
                println!("{:?} {:?}", end, run.work());
                let gain = energies.iter().map(|e| e - energies[0]).fold(0.0, f64::max);
                println!(
                    "{scheme:?} {step} gain {gain:e} of {:e}",
                    weight_per_length() * LENGTH * 0.002
                );
            }
        }
    }
}

#[test]
fn debug_flat() {
    let scene = falling(Scheme::NewmarkBeta, 1e-4, 0.2);
    let problem = scene.problem().unwrap();
    let mut run = Trajectory::new(&problem, &[], &[]).unwrap();
    let mut k = 0;
    let end = run.run(&problem, 2000, |now| {
        k += 1;
        if k > 198 {
            let y: Vec<f64> = (0..problem.nodes()).map(|i| (now.position(i)[1] + 0.002) * 1e6).collect();
            let e = now.energies();
            println!("{:.6} {y:.3?} {e:?}", now.time());
        }
    });
    println!("{end:?}");
}

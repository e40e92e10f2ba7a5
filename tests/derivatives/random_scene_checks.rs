//! The check of derivatives on random scenes: correct formulas are never reported as wrong.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::Problem;
use rodfit::accuracy::Calculation;
use rodfit::check::{Tolerance, check_problem};
use rodfit::scene::*;

use crate::common::at_tip;
use crate::parameters;

/// Scenes over wide ranges of lengths, stiffnesses and shapes.
const WIDE_SCENES: u64 = 400;
/// Scenes with every kind of table, of ordinary sizes: half of them planar.
const TABLE_SCENES: u64 = 100;

/// Directions: along axes, with exact and with rounded components, and of any size.
const DIRECTIONS: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [0.0, -1.0, 0.0],
    [3.0, 4.0, 0.0],
    [1.0, 1.0, 0.0],
    [-5e-3, 12e-3, 0.0],
    [0.1, 0.7, 0.0],
];

fn wide_scene(seed: u64) -> Scene {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut decades = |from: f64, to: f64| 10f64.powf(random.random_range(from..to));
    let length = decades(-3.0, 1.0);
    let radius = length * decades(-4.0, -1.0);
    let (density, modulus) = (decades(2.0, 4.0), decades(4.0, 11.5));
    let angle = decades(-9.0, 0.6);
    let spatial = seed.is_multiple_of(4);
    let mut direction = DIRECTIONS[random.random_range(0..DIRECTIONS.len())];
    if spatial {
        direction[2] = random.random_range(-1.0..1.0);
    }
    let straight = Shape::Straight { length, direction };
    let shape = match random.random_range(0..3) {
        0 => straight,
        1 if spatial => Shape::Helix {
            length,
            radius: 0.1 * length,
            pitch: 0.2 * length,
            axis: direction,
            handedness: Handedness::Left,
        },
        _ => Shape::Arc { length, angle },
    };
    let section = if random.random_bool(0.7) {
        Section::Circle { radius }
    } else {
        Section::Rectangle { width: 8.0 * radius, height: radius, up: [0.0, 0.0, 1.0] }
    };
    let segments = random.random_range(3..8);
    let mut scene = Scene::new(segments, shape, section, Material::new(density, modulus));
    scene.material.poisson_ratio = Some(0.3);
    if spatial {
        scene.rod.dimension = Dimension::Spatial;
        scene.rod.natural_twist = random.random_range(-3.0..3.0).into();
    }
    if random.random_bool(0.5) {
        scene.loads.gravity = [0.0, -9.8, 0.0];
    }
    if random.random_bool(0.3) {
        let size = 1e-3 * modulus * radius * radius;
        scene.loads.point = at_tip([0.0, random.random_range(-size..size), 0.0]);
    }
    if random.random_bool(0.3) {
        scene.initial.angular_velocity = [0.0, 0.0, 1.0];
    }
    let step = 10f64.powf(random.random_range(-7.0..-3.0));
    scene.time = Some(Time::new(4.0 * step, step));
    scene
}

fn problem(seed: u64) -> Problem {
    let scene = match seed.checked_sub(WIDE_SCENES) {
        None => wide_scene(seed),
        Some(seed) => parameters::scene(seed / 2, seed.is_multiple_of(2)),
    };
    scene.problem_for(Calculation::Guess).unwrap_or_else(|error| panic!("scene {seed}: {error}"))
}

/// Of the 400 scenes of wide ranges 160 were reported as wrong when a derivative was compared with the plain sum of its
/// absolute terms. The largest errors now are 6e-15 of a gradient and 8e-15 of a Hessian.
#[test]
fn correct_derivatives_of_500_random_scenes_are_not_reported() {
    let mut worst = [0.0_f64; 3];
    let mut reported = Vec::new();
    for seed in 0..WIDE_SCENES + TABLE_SCENES {
        let report = check_problem(&problem(seed), Tolerance::default()).unwrap();
        let errors = report.max_relative_error;
        let all = [errors.gradient, errors.hessian, errors.finite_difference];
        worst = std::array::from_fn(|k| worst[k].max(all[k]));
        if !report.passed() {
            reported.push((seed, report));
        }
    }
    println!("largest errors: gradient, Hessian, differences {worst:?}");
    let count = reported.len();
    assert!(count == 0, "{count} scenes; the first is {}\n{}", reported[0].0, reported[0].1);
}

//! Warnings of shapes that are nearly equal, and of noises that differ by much.

use crate::common::fits::{noisy, observe};
use crate::common::{cantilever, coarse};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::code::Code;
use rodfit::fit::{Experiment, RestShape, ShapePoint};
use rodfit::scene::PointMass;
use rodfit::{Fit, FitReport, Parameter, Point, Problem, Scene};

/// Noise of a photograph, m.
const NOISE: f64 = 3e-4;

fn has(report: &FitReport, code: Code) -> bool {
    report.warning_codes.contains(&code)
}

/// A cantilever at rest on few edges.
fn rested() -> Problem {
    let mut scene = cantilever();
    (scene.rod.segments, scene.time) = (Some(20), None);
    scene.problem().unwrap()
}

/// Positions of points along the rod at rest, with noise of a standard deviation, m.
fn shape(problem: &Problem, sigma: f64, seed: u64) -> Vec<ShapePoint> {
    let rest = problem.equilibrium().unwrap();
    let (mut random, noise) = (ChaCha8Rng::seed_from_u64(seed), Normal::new(0.0, sigma).unwrap());
    let point = |k: usize| {
        let own = Point::ArcLength(0.025 * k as f64);
        let stencil = problem.stencil(own).unwrap();
        let mut coordinate = |c: usize| {
            let exact: f64 = stencil.nodes.iter().map(|(i, w)| w * rest.nodes[*i][c]).sum();
            Some(exact + noise.sample(&mut random))
        };
        ShapePoint::new(own, [coordinate(0), coordinate(1), None])
    };
    (1..=20).map(point).collect()
}

/// A shape with noise in addition, m.
fn shifted(mut shape: Vec<ShapePoint>, sigma: f64) -> Vec<ShapePoint> {
    let (mut random, noise) = (ChaCha8Rng::seed_from_u64(99), Normal::new(0.0, sigma).unwrap());
    for x in shape.iter_mut().flat_map(|own| &mut own.position).flatten() {
        *x += noise.sample(&mut random);
    }
    shape
}

/// The fit of Young's modulus to shapes, with a stated sigma or without.
fn fit(problem: &Problem, shapes: [Vec<ShapePoint>; 2], sigma: Option<f64>) -> FitReport {
    let fit = Fit::new(problem).identify(Parameter::YoungsModulus);
    let measured = |own: Vec<ShapePoint>| match sigma {
        Some(sigma) => RestShape::new(own).sigma(sigma),
        None => RestShape::new(own),
    };
    shapes.into_iter().fold(fit, |fit, own| fit.observe(measured(own))).solve().unwrap()
}

#[test]
fn near_copies_of_shapes_are_warned_of() {
    let problem = rested();
    let first = shape(&problem, NOISE, 1);
    for sigma in [None, Some(NOISE)] {
        let copy = fit(&problem, [first.clone(), shifted(first.clone(), 5e-6)], sigma);
        assert!(has(&copy, Code::NearCopy), "{copy}");
        assert!(copy.warnings[0].contains("all 40 common values"), "{copy}");
        let repeated = fit(&problem, [first.clone(), shape(&problem, NOISE, 2)], sigma);
        assert!(!has(&repeated, Code::NearCopy), "{repeated}");
        // A difference of the size of the noise is that of another recording.
        let other = fit(&problem, [first.clone(), shifted(first.clone(), 0.5 * NOISE)], sigma);
        assert!(!has(&other, Code::NearCopy), "{other}");
    }
}

/// Points without arc lengths, whose approximations differ a little.
#[test]
fn near_copies_of_center_lines_are_warned_of() {
    let problem = rested();
    let first = shape(&problem, NOISE, 1);
    let line = |points: &[ShapePoint]| {
        RestShape::center_line(&points.iter().map(|own| own.position).collect::<Vec<_>>())
    };
    let solve = |second: Vec<ShapePoint>| {
        let fit = Fit::new(&problem).observe(line(&first)).observe(line(&second));
        fit.identify(Parameter::YoungsModulus).solve().unwrap()
    };
    let copy = solve(shifted(first.clone(), 5e-6));
    assert!(has(&copy, Code::NearCopy), "{copy}");
    let repeated = solve(shape(&problem, NOISE, 2));
    assert!(!has(&repeated, Code::NearCopy), "{repeated}");
}

/// The motion of a rod with this mass at its tip, kg, as an experiment with the scene without it.
fn experiment(name: &str, mass: f64, seed: u64) -> Experiment {
    let scene: Scene = coarse(8, 4e-3, 0.4);
    let mut loaded = scene.clone();
    if mass > 0.0 {
        loaded.rod.mass = vec![PointMass::new(Point::Tip, mass)];
    }
    let data = noisy(&observe(&loaded, 60), 1e-3, seed);
    Experiment::new(name, &scene.problem().unwrap()).observe(data)
}

#[test]
fn noise_of_a_wrong_model_is_compared_with_that_of_a_right_one() {
    let solve = |mass: f64| {
        let both = [experiment("bare", 0.0, 1), experiment("loaded", mass, 2)];
        Fit::of(both).identify(Parameter::YoungsModulus).solve().unwrap()
    };
    let wrong = solve(0.01);
    assert!(has(&wrong, Code::UnequalNoise), "{wrong}");
    let text = wrong.warnings.iter().find(|text| text.contains("[unequal-noise]")).unwrap();
    assert!(text.contains("noise of loaded") && text.contains("that of bare"), "{text}");
    assert!(!has(&solve(0.0), Code::UnequalNoise));
}

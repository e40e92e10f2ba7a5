//! Critical loads of columns against Euler's, and their derivatives.

use rodfit::Parameter;
use rodfit::scene::{Material, Scene, Support};
use std::f64::consts::PI;

use crate::common::{at_tip, straight_rod};

const LENGTH: f64 = 0.5;
const RADIUS: f64 = 2e-3;
const MODULUS: f64 = 2e9;

/// A weightless column along x of 100 edges, with a force at its end.
fn column([start, end]: [Support; 2]) -> Scene {
    let material = Material::new(1200.0, MODULUS);
    let mut scene = straight_rod(100, [LENGTH, RADIUS], material);
    (scene.supports.start, scene.supports.end) = (start, end);
    scene.loads.gravity = [0.0; 3];
    scene.loads.point = at_tip([-0.5, 0.0, 0.0]);
    scene
}

fn load() -> Parameter {
    "loads.point.0.force.x".parse().unwrap()
}

/// Euler's load of a column of this effective length, N.
fn euler(length: f64) -> f64 {
    PI * PI * MODULUS * PI * RADIUS.powi(4) / (4.0 * length * length)
}

#[test]
fn columns_buckle_under_eulers_load() {
    use Support::{Clamped, Free, Pinned, Roller};
    for (supports, effective) in [([Clamped, Free], 2.0), ([Pinned, Roller], 1.0)] {
        let problem = column(supports).problem().unwrap();
        let expected = -euler(effective * LENGTH);
        // Whatever the expected load: it only has the sign.
        for guess in [0.1, 1.0, 5.0] {
            let found = problem.critical_load(load(), guess * expected, &[]).unwrap();
            let off = found.value / expected - 1.0;
            assert!(off.abs() < 1e-4, "{supports:?}: {off:e}");
        }
    }
}

/// `P = pi^2 E I/(4 L^2)`: exponents 1, 4 and -2 of modulus, radius and length, and none of the density.
#[test]
fn derivatives_follow_the_power_law() {
    let problem = column([Support::Clamped, Support::Free]).problem().unwrap();
    let parameters = [
        (Parameter::YoungsModulus, MODULUS, 1.0),
        (Parameter::Radius, RADIUS, 4.0),
        ("rod.shape.length".parse().unwrap(), LENGTH, -2.0),
        (Parameter::Density, 1200.0, 0.0),
    ];
    let names = parameters.map(|(name, ..)| name);
    let found = problem.critical_load(load(), -1.0, &names).unwrap();
    for ((name, value, exponent), derivative) in parameters.into_iter().zip(&found.derivatives) {
        let off = derivative * value / found.value - exponent;
        // The load is exactly proportional to the modulus, on every mesh.
        let bound = if name == Parameter::YoungsModulus { 1e-8 } else { 1e-4 };
        assert!(off.abs() < bound, "{name}: {off:e}");
    }
}

/// Under its own weight along the column the critical load at the tip is lower, by about 0.3 of the weight.
#[test]
fn weight_along_the_column_lowers_the_critical_load() {
    let mut scene = column([Support::Clamped, Support::Free]);
    scene.loads.gravity = [-9.81, 0.0, 0.0];
    let weight = 9.81 * 1200.0 * PI * RADIUS * RADIUS * LENGTH;
    let parameters = [Parameter::Density, Parameter::YoungsModulus];
    let problem = scene.problem().unwrap();
    let found = problem.critical_load(load(), -1.0, &parameters).unwrap();
    let share = (found.value + euler(2.0 * LENGTH)) / weight;
    assert!((0.25..0.35).contains(&share), "{share}");
    for (parameter, derivative) in parameters.into_iter().zip(found.derivatives) {
        let value = parameter.of(&scene).unwrap();
        let at = |by: f64| {
            let moved = problem.with([(parameter, value * (1.0 + by))]).unwrap();
            moved.critical_load(load(), -1.0, &[]).unwrap().value
        };
        let expected = (at(1e-3) - at(-1e-3)) / (2e-3 * value);
        assert!((derivative / expected - 1.0).abs() < 1e-3, "{parameter}: {derivative} {expected}");
    }
}

#[test]
fn tension_has_no_critical_load() {
    let problem = column([Support::Clamped, Support::Free]).problem().unwrap();
    let error = problem.critical_load(load(), 1.0, &[]).unwrap_err().to_string();
    assert!(error.contains("loads.point.0.force.x") && error.contains("stable"), "{error}");
}

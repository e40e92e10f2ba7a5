//! Derivatives of rods with several Maxwell branches by every number of damping, in the plane and in space: forward ones
//! against the whole run in dual numbers and against differences, adjoint ones against forward ones.

use rodfit::Parameter;
use rodfit::scene::*;

use crate::adjoint::{EXACT, worst};
use crate::common::at_tip;
use crate::common::differences::difference;
use crate::parameters::{STEPS, apart, derivative, end, in_duals, largest};

/// Of the largest derivative, against the run in dual numbers.
const AGAINST_DUALS: f64 = 1e-9;
/// The same against differences.
const AGAINST_DIFFERENCES: f64 = 1e-6;

/// A curved rod of 8 edges with three branches, whose times lie below, in and above the duration of the run.
fn scene(planar: bool, scheme: Scheme, is_damped: bool) -> Scene {
    let across = if planar { 0.0 } else { 0.4 };
    let shape = Shape::Arc { length: 0.3, angle: 1.1 };
    let material = Material { poisson_ratio: Some(0.4), ..Material::new(1100.0, 5e6) };
    let mut scene = Scene::new(8, shape, Section::Circle { radius: 0.005 }, material);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    scene.loads.gravity = [0.0, -9.8, across];
    scene.loads.point = at_tip([0.3, 0.8, across]);
    scene.loads.damping.maxwell = vec![
        Maxwell { stiffness: 0.3, time: 7e-4 },
        Maxwell { stiffness: 0.9, time: 5e-3 },
        Maxwell { stiffness: 0.5, time: 0.08 },
    ]
    .into();
    if is_damped {
        let damping = &mut scene.loads.damping;
        (damping.mass, damping.stiffness) = (0.7, 1e-3);
        (damping.bending, damping.stretching) = (5e-4, 2e-4);
    }
    let mut time = Time { scheme, ..Time::new(STEPS as f64 * 1e-3, 1e-3) };
    (time.beta, time.rho_inf, time.tolerance) = (0.6, 0.4, StepTolerance::Rounding);
    scene.time = Some(time);
    scene
}

#[test]
fn forward_derivatives_equal_dual_runs_and_differences() {
    let (mut duals, mut differences, mut checked) = (0.0_f64, 0.0_f64, 0);
    for planar in [true, false] {
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            for is_damped in [false, true] {
                let scene = scene(planar, scheme, is_damped);
                let problem = scene.problem().unwrap();
                assert_eq!(problem.planar().is_some(), planar);
                let mut parameters = Parameter::all(&scene);
                parameters.retain(|parameter| {
                    let is_of_damping = parameter.path().contains("damping");
                    let has_effect = !planar || parameter.path() != "loads.damping.twisting";
                    is_of_damping && has_effect || parameter.path() == "material.youngs_modulus"
                });
                for parameter in parameters {
                    let found = derivative(&problem, parameter);
                    let dual = in_duals(&problem, parameter);
                    let size = largest(&dual);
                    let off = apart(&found, &dual) / size;
                    assert!(off < AGAINST_DUALS, "{planar} {scheme:?} {parameter} {off:e}");
                    duals = duals.max(off);
                    checked += 1;
                    let value = parameter.of(&scene).unwrap();
                    if value == 0.0 {
                        continue;
                    }
                    let exact = difference(&problem, parameter, 2e-3 * value.abs(), end);
                    let off = apart(&found, &exact) / size;
                    assert!(off < AGAINST_DIFFERENCES, "{planar} {scheme:?} {parameter} {off:e}");
                    differences = differences.max(off);
                }
            }
        }
    }
    println!("{checked} derivatives: {duals:.1e} of duals, {differences:.1e} of differences");
    assert!(checked >= 88, "{checked}");
}

#[test]
fn adjoint_gradient_equals_forward_derivatives() {
    let mut seed = 0;
    for planar in [true, false] {
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            for is_damped in [false, true] {
                seed += 1;
                let problem = scene(planar, scheme, is_damped).problem().unwrap();
                let (off, parameters) = worst(&problem, seed);
                let names: Vec<_> = parameters.iter().map(|parameter| parameter.path()).collect();
                assert!(names.contains(&"loads.damping.maxwell.2.time"), "{names:?}");
                assert!(off < EXACT, "{planar} {scheme:?} {is_damped}: {off:e}");
            }
        }
    }
}

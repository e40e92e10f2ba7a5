//! Derivatives of rods with several Maxwell branches by every number of damping, in the plane and in space: forward
//! ones against the whole run in dual numbers and against differences, adjoint ones against forward ones.

use rodfit::Parameter;
use rodfit::scene::*;

use crate::laws::{check_adjoint, check_forward, loaded_rod};

/// A curved rod of 8 edges with three branches, whose times lie below, in and above the duration of the run.
fn scene(planar: bool, scheme: Scheme, is_damped: bool) -> Scene {
    let shape = Shape::Arc { length: 0.3, angle: 1.1 };
    let material = Material { poisson_ratio: Some(0.4), ..Material::new(1100.0, 5e6) };
    let section = Section::Circle { radius: 0.005 };
    let mut scene = loaded_rod((shape, section, material), [0.3, 0.8], planar, scheme);
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
    scene
}

#[test]
fn forward_derivatives_equal_dual_runs_and_differences() {
    let mut checked = 0;
    for planar in [true, false] {
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            for is_damped in [false, true] {
                println!("{planar} {scheme:?} {is_damped}");
                let scene = scene(planar, scheme, is_damped);
                let problem = scene.problem().unwrap();
                assert_eq!(problem.planar().is_some(), planar);
                let mut parameters = Parameter::all(&scene);
                parameters.retain(|parameter| {
                    let is_of_damping = parameter.path().contains("damping");
                    let has_effect = !planar || parameter.path() != "loads.damping.twisting";
                    is_of_damping && has_effect || parameter.path() == "material.youngs_modulus"
                });
                checked += check_forward(&problem, &parameters, [true, true]);
            }
        }
    }
    assert!(checked >= 88, "{checked}");
}

/// The branches of a power law, beside one of the list.
#[test]
fn derivatives_by_numbers_of_a_power_law_are_exact() {
    let mut seed = 10;
    for planar in [true, false] {
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            let mut scene = scene(planar, scheme, planar);
            scene.loads.damping.maxwell = vec![Maxwell { stiffness: 0.3, time: 7e-4 }].into();
            scene.loads.damping.power_law =
                Some(PowerLaw { stiffness: 0.6, exponent: 0.3, from: 1e-3, to: 0.1 });
            let mut parameters = Parameter::all(&scene);
            parameters.retain(|parameter| parameter.path().contains("power_law"));
            assert_eq!(parameters.len(), 2);
            check_forward(&scene.problem().unwrap(), &parameters, [true, true]);
            seed += 1;
            check_adjoint(&scene, seed, "loads.damping.power_law.exponent");
        }
    }
}

#[test]
fn adjoint_gradient_equals_forward_derivatives() {
    let mut seed = 0;
    for planar in [true, false] {
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            for is_damped in [false, true] {
                seed += 1;
                let scene = scene(planar, scheme, is_damped);
                check_adjoint(&scene, seed, "loads.damping.maxwell.2.time");
            }
        }
    }
}

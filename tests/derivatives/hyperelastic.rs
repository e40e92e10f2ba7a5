//! Derivatives of rods with a neo-Hookean or Mooney-Rivlin stretch, in the plane and in space: forward ones against the whole run in dual
//! numbers and against differences of problems built anew, adjoint ones against forward ones, and those of rods at rest.

use rodfit::scene::*;

use crate::laws::{check_adjoint, check_equilibrium, check_forward, loaded_rod, parameters};
use crate::parameters::end;

/// A rubber rod of 8 edges under a force along and across it that stretches it by more than a tenth within the run.
fn rubber(law: StretchLaw, planar: bool, scheme: Scheme, damping: f64) -> Scene {
    let shape = Shape::Straight { length: 0.3, direction: [1.0, 0.0, 0.0] };
    let mut material = Material::new(1100.0, 2e5);
    (material.poisson_ratio, material.stretch_law) = (Some(0.5), law);
    material.mooney_rivlin_ratio = (law == StretchLaw::MooneyRivlin).then_some(0.3);
    let section = Section::Circle { radius: 0.005 };
    let mut scene = loaded_rod((shape, section, material), [10.0, 0.5], planar, scheme);
    scene.loads.damping.stiffness = damping;
    if damping > 0.0 {
        scene.loads.damping.mass = 1.5;
        if scheme.traits().takes_friction {
            scene.loads.damping.maxwell = Maxwell { stiffness: 0.3, time: 4e-3 }.into();
        }
    }
    scene
}

const LAWS: [StretchLaw; 2] = [StretchLaw::NeoHookean, StretchLaw::MooneyRivlin];

/// The numbers of a scene that are checked.
const NUMBERS: [&str; 7] = [
    "material.mooney_rivlin_ratio",
    "material.youngs_modulus",
    "material.density",
    "rod.section.radius",
    "rod.shape.length",
    "loads.point.0.force.x",
    "loads.damping.stiffness",
];

#[test]
fn forward_derivatives_equal_dual_runs_and_differences() {
    let schemes = [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField];
    let mut checked = 0;
    for (law, planar) in LAWS.into_iter().flat_map(|law| [(law, true), (law, false)]) {
        for scheme in schemes {
            for damping in [0.0, 3e-3] {
                println!("{law:?} {planar} {scheme:?} {damping}");
                let scene = rubber(law, planar, scheme, damping);
                let problem = scene.problem().unwrap();
                assert_eq!(problem.planar().is_some(), planar);
                let places = end(&problem);
                let tip = places.last_chunk::<3>().unwrap();
                assert!(tip[0] > 1.1 * 0.3, "{tip:?}");
                // Newton's method of the dual run stops with its real parts: here its derivatives are then off by
                // 1e-3, while differences confirm the forward ones to 1e-9.
                let is_oracle = law == StretchLaw::NeoHookean
                    || scheme != Scheme::AverageVectorField
                    || damping > 0.0;
                checked +=
                    check_forward(&problem, &parameters(&scene, &NUMBERS), [is_oracle, true]);
            }
        }
    }
    assert!(checked >= 60, "{checked}");
}

#[test]
fn adjoint_gradient_equals_forward_derivatives() {
    let mut seed = 0;
    for (law, planar) in LAWS.into_iter().flat_map(|law| [(law, true), (law, false)]) {
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            for damping in [0.0, 3e-3] {
                seed += 1;
                let scene = rubber(law, planar, scheme, damping);
                check_adjoint(&scene, seed, "material.youngs_modulus");
            }
        }
    }
}

#[test]
fn equilibrium_derivatives_equal_differences() {
    for (law, planar) in LAWS.into_iter().flat_map(|law| [(law, true), (law, false)]) {
        check_equilibrium(rubber(law, planar, Scheme::NewmarkBeta, 0.0), &NUMBERS, 1e-9);
    }
}

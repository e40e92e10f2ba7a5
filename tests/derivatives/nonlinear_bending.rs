//! Derivatives of rods with nonlinear bending, in the plane and in space: forward ones against the whole run in dual
//! numbers and against differences, adjoint ones against forward ones, and those of rods at rest.

use rodfit::scene::*;

use crate::laws::{check_adjoint, check_equilibrium, check_forward, loaded_rod, parameters};

/// The two laws with their parameters. Curvatures of the scene reach the last interval of the table.
fn laws() -> [(BendingLaw, &'static [&'static str]); 2] {
    let table = BendingLaw::Table { curvature: vec![1.0, 2.5, 6.0], factor: vec![1.1, 1.5, 1.3] };
    [
        (BendingLaw::Cubic { coefficient: 0.03 }, &["material.bending_law.coefficient"]),
        (table, &["material.bending_law.factor.0", "material.bending_law.factor.1"]),
    ]
}

/// A curved rod of 8 edges whose moment is larger by the law of bending.
fn scene(law: &BendingLaw, planar: bool, scheme: Scheme, damping: f64) -> Scene {
    let shape = Shape::Arc { length: 0.3, angle: 1.1 };
    let mut material = Material { poisson_ratio: Some(0.4), ..Material::new(1100.0, 5e6) };
    material.bending_law = Some(law.clone());
    let section = match planar {
        true => Section::Circle { radius: 0.005 },
        false => Section::Rectangle { width: 0.012, height: 0.008, up: [0.0, 0.3, 1.0] },
    };
    let mut scene = loaded_rod((shape, section, material), [0.3, 0.8], planar, scheme);
    if damping > 0.0 {
        scene.loads.damping = Damping { mass: 0.7, stiffness: damping, ..Damping::default() };
        if scheme.traits().takes_friction {
            scene.loads.damping.maxwell = Maxwell { stiffness: 0.3, time: 4e-3 }.into();
        }
    }
    scene
}

/// The numbers of a scene that are checked besides those of the law.
const NUMBERS: [&str; 6] = [
    "material.youngs_modulus",
    "material.density",
    "rod.natural_curvature",
    "rod.shape.length",
    "loads.point.0.force.y",
    "loads.damping.stiffness",
];

#[test]
fn forward_derivatives_equal_dual_runs_and_differences() {
    let mut checked = 0;
    for (law, own) in laws() {
        for planar in [true, false] {
            for scheme in
                [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField]
            {
                for damping in [0.0, 3e-3] {
                    println!("{law:?} {planar} {scheme:?} {damping}");
                    let mut scene = scene(&law, planar, scheme, damping);
                    if damping > 0.0 && scheme.traits().takes_friction {
                        let springs = Friction { stiffness: 0.4, curvature: 0.5 };
                        scene.loads.damping.friction = Some(springs);
                    }
                    let problem = scene.problem().unwrap();
                    assert_eq!(problem.planar().is_some(), planar);
                    // Differences across the onset of slip have no limit.
                    let is_smooth = scene.loads.damping.friction.is_none();
                    let numbers = parameters(&scene, &[own, &NUMBERS].concat());
                    checked += check_forward(&problem, &numbers, [true, is_smooth]);
                }
            }
        }
    }
    assert!(checked >= 160, "{checked}");
}

#[test]
fn adjoint_gradient_equals_forward_derivatives() {
    let mut seed = 0;
    for (law, own) in laws() {
        for planar in [true, false] {
            for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
                for damping in [0.0, 3e-3] {
                    seed += 1;
                    check_adjoint(&scene(&law, planar, scheme, damping), seed, own[0]);
                }
            }
        }
    }
}

#[test]
fn equilibrium_derivatives_equal_differences() {
    for (law, own) in laws() {
        for planar in [true, false] {
            let scene = scene(&law, planar, Scheme::NewmarkBeta, 0.0);
            check_equilibrium(scene, &[own, &NUMBERS].concat(), 0.0);
        }
    }
}

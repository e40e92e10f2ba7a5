//! Derivatives of rods with nonlinear bending, in the plane and in space: forward ones against the whole run in dual
//! numbers and against differences, adjoint ones against forward ones, and those of rods at rest.

use rodfit::Parameter;
use rodfit::scene::*;

use crate::adjoint::{EXACT, worst};
use crate::common::at_tip;
use crate::common::differences::{at_rest, difference};
use crate::parameters::{STEPS, apart, derivative, end, in_duals, largest};

/// Of the largest derivative, against the run in dual numbers.
const AGAINST_DUALS: f64 = 1e-9;
/// The same against differences.
const AGAINST_DIFFERENCES: f64 = 1e-6;

/// A curved rod of 8 edges whose moment is larger by the law of bending.
fn scene(planar: bool, scheme: Scheme, damping: f64) -> Scene {
    let across = if planar { 0.0 } else { 0.4 };
    let shape = Shape::Arc { length: 0.3, angle: 1.1 };
    let mut material = Material { poisson_ratio: Some(0.4), ..Material::new(1100.0, 5e6) };
    material.bending_law = Some(BendingLaw::Cubic { coefficient: 0.03 });
    let section = match planar {
        true => Section::Circle { radius: 0.005 },
        false => Section::Rectangle { width: 0.012, height: 0.008, up: [0.0, 0.3, 1.0] },
    };
    let mut scene = Scene::new(8, shape, section, material);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    scene.loads.gravity = [0.0, -9.8, across];
    scene.loads.point = at_tip([0.3, 0.8, across]);
    if damping > 0.0 {
        scene.loads.damping = Damping { mass: 0.7, stiffness: damping, ..Damping::default() };
        if scheme.traits().takes_friction {
            scene.loads.damping.maxwell = Maxwell { stiffness: 0.3, time: 4e-3 }.into();
        }
    }
    let mut time = Time { scheme, ..Time::new(STEPS as f64 * 1e-3, 1e-3) };
    (time.beta, time.rho_inf, time.tolerance) = (0.6, 0.4, StepTolerance::Rounding);
    scene.time = Some(time);
    scene
}

/// The numbers of a scene that are checked.
const NUMBERS: [&str; 7] = [
    "material.bending_law.coefficient",
    "material.youngs_modulus",
    "material.density",
    "rod.natural_curvature",
    "rod.shape.length",
    "loads.point.0.force.y",
    "loads.damping.stiffness",
];

/// The parameters with these paths that a scene has.
fn parameters(scene: &Scene) -> Vec<Parameter> {
    let all = Parameter::all(scene).into_iter();
    all.filter(|parameter| NUMBERS.contains(&parameter.path())).collect()
}

#[test]
fn forward_derivatives_equal_dual_runs_and_differences() {
    let (mut duals, mut differences, mut checked) = (0.0_f64, 0.0_f64, 0);
    for planar in [true, false] {
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField] {
            for damping in [0.0, 3e-3] {
                let mut scene = scene(planar, scheme, damping);
                if damping > 0.0 && scheme.traits().takes_friction {
                    let springs = Friction { stiffness: 0.4, curvature: 0.5 };
                    scene.loads.damping.friction = Some(springs);
                }
                let problem = scene.problem().unwrap();
                assert_eq!(problem.planar().is_some(), planar);
                for parameter in parameters(&scene) {
                    let found = derivative(&problem, parameter);
                    let dual = in_duals(&problem, parameter);
                    let size = largest(&dual);
                    let off = apart(&found, &dual) / size;
                    assert!(off < AGAINST_DUALS, "{planar} {scheme:?} {parameter} {off:e}");
                    duals = duals.max(off);
                    checked += 1;
                    let value = parameter.of(&scene).unwrap();
                    // Differences across the onset of slip have no limit.
                    if value == 0.0 || scene.loads.damping.friction.is_some() {
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
    assert!(checked >= 80, "{checked}");
}

#[test]
fn adjoint_gradient_equals_forward_derivatives() {
    let mut seed = 0;
    for planar in [true, false] {
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            for damping in [0.0, 3e-3] {
                seed += 1;
                let problem = scene(planar, scheme, damping).problem().unwrap();
                let (off, parameters) = worst(&problem, seed);
                let names: Vec<_> = parameters.iter().map(|parameter| parameter.path()).collect();
                assert!(names.contains(&"material.bending_law.coefficient"), "{names:?}");
                assert!(off < EXACT, "{planar} {scheme:?} {damping}: {off:e}");
            }
        }
    }
}

#[test]
fn equilibrium_derivatives_equal_differences() {
    for planar in [true, false] {
        let mut scene = scene(planar, Scheme::NewmarkBeta, 0.0);
        scene.time = None;
        let problem = scene.problem().unwrap();
        let nodes = problem.nodes();
        let places = |problem: &rodfit::Problem| -> Vec<f64> {
            let rest = at_rest(problem, &[]);
            (0..nodes).flat_map(|i| rest.node(i, 0)).collect()
        };
        for parameter in parameters(&scene) {
            let value = parameter.of(&scene).unwrap();
            if value == 0.0 {
                continue;
            }
            let (_, _, derivatives) = at_rest(&problem, &[parameter]).into_parts();
            let found: Vec<f64> = derivatives[0].iter().flat_map(|[place, _]| *place).collect();
            let exact = difference(&problem, parameter, 2e-3 * value.abs(), places);
            let (off, size) = (apart(&found, &exact), largest(&exact));
            println!("{planar} {parameter}: {:.1e} of differences", off / size);
            assert!(off <= AGAINST_DIFFERENCES * size, "{parameter} {off:e}");
        }
    }
}

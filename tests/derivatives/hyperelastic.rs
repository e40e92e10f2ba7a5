//! Derivatives of rods with a neo-Hookean or Mooney-Rivlin stretch, in the plane and in space: forward ones against the whole run in dual
//! numbers and against differences of problems built anew, adjoint ones against forward ones, and those of rods at rest.

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

/// A rubber rod of 8 edges under a force along and across it that stretches it by more than a tenth within the run.
fn rubber(law: StretchLaw, planar: bool, scheme: Scheme, damping: f64) -> Scene {
    let across = if planar { 0.0 } else { 0.4 };
    let shape = Shape::Straight { length: 0.3, direction: [1.0, 0.0, 0.0] };
    let mut material = Material::new(1100.0, 2e5);
    (material.poisson_ratio, material.stretch_law) = (Some(0.5), law);
    material.mooney_rivlin_ratio = (law == StretchLaw::MooneyRivlin).then_some(0.3);
    let mut scene = Scene::new(8, shape, Section::Circle { radius: 0.005 }, material);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    scene.loads.gravity = [0.0, -9.8, across];
    scene.loads.point = at_tip([10.0, 0.5, across]);
    scene.loads.damping.stiffness = damping;
    if damping > 0.0 {
        scene.loads.damping.mass = 1.5;
        if scheme.traits().takes_friction {
            scene.loads.damping.maxwell = Maxwell { stiffness: 0.3, time: 4e-3 }.into();
        }
    }
    let step = 1e-3;
    let mut time = Time { scheme, ..Time::new(STEPS as f64 * step, step) };
    (time.beta, time.rho_inf, time.tolerance) = (0.6, 0.4, StepTolerance::Rounding);
    scene.time = Some(time);
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

/// The parameters with these paths that a scene has.
fn parameters(scene: &Scene) -> Vec<Parameter> {
    let all = Parameter::all(scene).into_iter();
    all.filter(|parameter| NUMBERS.contains(&parameter.path())).collect()
}

#[test]
fn forward_derivatives_equal_dual_runs_and_differences() {
    let schemes = [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField];
    let (mut duals, mut differences, mut checked) = (0.0_f64, 0.0_f64, 0);
    for (law, planar) in LAWS.into_iter().flat_map(|law| [(law, true), (law, false)]) {
        for scheme in schemes {
            for damping in [0.0, 3e-3] {
                let scene = rubber(law, planar, scheme, damping);
                let problem = scene.problem().unwrap();
                assert_eq!(problem.planar().is_some(), planar);
                let places = end(&problem);
                let tip = places.last_chunk::<3>().unwrap();
                assert!(tip[0] > 1.1 * 0.3, "{tip:?}");
                for parameter in parameters(&scene) {
                    let found = derivative(&problem, parameter);
                    let dual = in_duals(&problem, parameter);
                    let size = largest(&dual);
                    let value = parameter.of(&scene).unwrap();
                    let off = apart(&found, &dual) / size;
                    println!("{planar} {scheme:?} {damping} {parameter}: {off:.1e} of duals");
                    // Newton's method of the dual run stops with its real parts: here its derivatives are then off by
                    // 1e-3, while differences confirm the forward ones to 1e-9.
                    let is_oracle = law == StretchLaw::NeoHookean
                        || scheme != Scheme::AverageVectorField
                        || damping > 0.0;
                    let off = if is_oracle { off } else { 0.0 };
                    assert!(
                        off < AGAINST_DUALS,
                        "{planar} {scheme:?} {damping} {parameter} {off:e}"
                    );
                    duals = duals.max(off);
                    checked += 1;
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
    assert!(checked >= 60, "{checked}");
}

#[test]
fn adjoint_gradient_equals_forward_derivatives() {
    let mut seed = 0;
    for (law, planar) in LAWS.into_iter().flat_map(|law| [(law, true), (law, false)]) {
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            for damping in [0.0, 3e-3] {
                seed += 1;
                let problem = rubber(law, planar, scheme, damping).problem().unwrap();
                let (off, parameters) = worst(&problem, seed);
                let names: Vec<_> = parameters.iter().map(|parameter| parameter.path()).collect();
                assert!(names.contains(&"material.youngs_modulus"), "{names:?}");
                assert!(off < EXACT, "{planar} {scheme:?} {damping}: {off:e}");
            }
        }
    }
}

#[test]
fn equilibrium_derivatives_equal_differences() {
    for (law, planar) in LAWS.into_iter().flat_map(|law| [(law, true), (law, false)]) {
        let mut scene = rubber(law, planar, Scheme::NewmarkBeta, 0.0);
        scene.time = None;
        let problem = scene.problem().unwrap();
        let nodes = problem.nodes();
        let places = |problem: &rodfit::Problem| -> Vec<f64> {
            let rest = at_rest(problem, &[]);
            (0..nodes).flat_map(|i| rest.node(i, 0)).collect()
        };
        for parameter in parameters(&scene) {
            let value = parameter.of(&scene).unwrap();
            if value == 0.0 || parameter.path() == "loads.damping.stiffness" {
                continue;
            }
            let (_, _, derivatives) = at_rest(&problem, &[parameter]).into_parts();
            let found: Vec<f64> = derivatives[0].iter().flat_map(|[place, _]| *place).collect();
            let exact = difference(&problem, parameter, 2e-3 * value.abs(), places);
            let (off, size) = (apart(&found, &exact), largest(&exact));
            println!("{planar} {parameter}: {:.1e} of differences", off / size.max(1e-9));
            assert!(
                off <= AGAINST_DIFFERENCES * size.max(1e-9 / value.abs()),
                "{parameter} {off:e}"
            );
        }
    }
}

//! Checks of derivatives of short runs and equilibria of rods with nonlinear and viscous laws.

use rodfit::scene::{Dimension, Material, Scene, Scheme, Section, Shape, StepTolerance, Time};
use rodfit::{Parameter, Problem};

use crate::adjoint::{EXACT, worst};
use crate::common::at_tip;
use crate::common::differences::{apart, difference, largest, mismatch_at_rest};
use crate::parameters::{STEPS, derivative, end, in_duals};

/// Of the largest derivative, against the run in dual numbers.
const AGAINST_DUALS: f64 = 1e-9;
/// The same against differences.
const AGAINST_DIFFERENCES: f64 = 1e-6;

/// A rod of 8 edges with weight and a `force` at its tip, for a run of [`STEPS`] steps. In space, both have the component
/// 0.4 across the plane.
pub fn loaded_rod(
    (shape, section, material): (Shape, Section, Material),
    force: [f64; 2],
    planar: bool,
    scheme: Scheme,
) -> Scene {
    let across = if planar { 0.0 } else { 0.4 };
    let mut scene = Scene::new(8, shape, section, material);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    scene.loads.gravity = [0.0, -9.8, across];
    scene.loads.point = at_tip([force[0], force[1], across]);
    let mut time = Time { scheme, ..Time::new(STEPS as f64 * 1e-3, 1e-3) };
    (time.beta, time.rho_inf, time.tolerance) = (0.6, 0.4, StepTolerance::Rounding);
    scene.time = Some(time);
    scene
}

/// The parameters of a scene with one of these `paths`.
pub fn parameters(scene: &Scene, paths: &[&str]) -> Vec<Parameter> {
    let all = Parameter::all(scene).into_iter();
    all.filter(|parameter| paths.contains(&parameter.path())).collect()
}

/// Compares forward derivatives of the end of a run with the run in dual numbers and, of parameters that are not zero, with
/// differences. `oracles`: whether each of both is exact. Returns the number of derivatives.
pub fn check_forward(
    problem: &Problem,
    parameters: &[Parameter],
    [duals_are_exact, has_differences]: [bool; 2],
) -> usize {
    for parameter in parameters {
        let found = derivative(problem, *parameter);
        let dual = in_duals(problem, *parameter);
        let size = largest(&dual);
        let off = apart(&found, &dual) / size;
        println!("{parameter}: {off:.1e} of duals");
        assert!(off < AGAINST_DUALS || !duals_are_exact, "{parameter} {off:e}");
        let value = parameter.of(problem.scene()).unwrap();
        if value == 0.0 || !has_differences {
            continue;
        }
        let exact = difference(problem, *parameter, 2e-3 * value.abs(), end);
        let off = apart(&found, &exact) / size;
        assert!(off < AGAINST_DIFFERENCES, "{parameter} {off:e}");
    }
    parameters.len()
}

/// Compares the adjoint gradient with forward derivatives, with weights of `seed`; the parameter `name` is one of those
/// compared.
pub fn check_adjoint(scene: &Scene, seed: u64, name: &str) {
    let (off, parameters) = worst(&scene.problem().unwrap(), seed);
    let names: Vec<_> = parameters.iter().map(|parameter| parameter.path()).collect();
    assert!(names.contains(&name), "{names:?}");
    assert!(off < EXACT, "{off:e}");
}

/// Compares derivatives of the equilibrium of a scene by the parameters with these `paths` that are not zero with
/// differences. Positions have rounding errors of the size `rounding`, m.
pub fn check_equilibrium(mut scene: Scene, paths: &[&str], rounding: f64) {
    scene.time = None;
    let problem = scene.problem().unwrap();
    for parameter in parameters(&scene, paths) {
        let value = parameter.of(&scene).unwrap();
        if value == 0.0 {
            continue;
        }
        let [off, size] = mismatch_at_rest(&problem, parameter, 2e-3 * value.abs());
        println!("{parameter}: {off:.1e} of {size:.1e}");
        assert!(
            off <= AGAINST_DIFFERENCES * size.max(rounding / value.abs()),
            "{parameter} {off:e}"
        );
    }
}

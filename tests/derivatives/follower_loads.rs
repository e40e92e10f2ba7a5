//! Derivatives of equilibria and motions under follower loads and moments in space, compared with runs in dual numbers and
//! differences.

use rodfit::scene::*;
use rodfit::{Parameter, Problem};

use crate::all_schemes::{check_equilibria, check_motions};

/// A curved rod with weight, follower loads at a point and along a part, and in space a moment about fixed axes.
fn scene(planar: bool, scheme: Scheme, timed: bool) -> Scene {
    let shape = Shape::Arc { length: 0.5, angle: 0.8 };
    let mut material = Material::new(1200.0, 2e7);
    material.poisson_ratio = Some(0.35);
    let mut scene = Scene::new(7, shape, Section::Circle { radius: 0.005 }, material);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    let z = if planar { 0.0 } else { 1.0 };
    scene.loads.gravity = [0.0, -9.8, 0.5 * z];
    let signal = timed.then(|| "s".to_string());
    let point = |node, force, moment, follower| PointForce {
        node,
        force,
        moment,
        follower,
        signal: signal.clone(),
    };
    let (force, moment) = ([-0.3, 0.4, 0.2 * z], [0.004 * z, -0.003 * z, 0.006]);
    scene.loads.point = vec![
        point(Point::ArcLength(0.437), force, moment, true),
        point(Point::Tip, [0.1, 0.2, 0.1 * z], [0.005 * z, 0.004 * z, -0.006], false),
    ];
    let force = [0.5, -0.8, 0.6 * z];
    scene.loads.line =
        vec![LineForce { from: 0.113, to: Some(0.38), force, follower: true, signal: None }];
    if timed {
        scene.signals = vec![Signal {
            kind: Some(SignalKind::Sine),
            frequency: Some(30.0),
            phase: Some(0.7),
            delay: 3.7e-4,
            gain: 1.3,
            ..Signal::new("s")
        }];
    }
    let step = match scheme {
        Scheme::Verlet => 2e-5,
        // Below the stability limit of 9e-4 s on this mesh.
        Scheme::Pefrl => 5e-4,
        _ => 1e-3,
    };
    scene.time = Some(Time { scheme, beta: 0.6, rho_inf: 0.4, ..Time::new(12.0 * step, step) });
    scene
}

fn own(problem: &Problem) -> Vec<Parameter> {
    let places = ["loads.point.", "loads.line.", "rod."];
    let is_own = |p: &Parameter| places.iter().any(|place| p.path().starts_with(place));
    let all = Parameter::all(problem.scene()).into_iter().filter(is_own);
    all.filter(|p| problem.check_parameter(*p).is_ok()).collect()
}

#[test]
fn derivatives_of_motions_equal_those_in_dual_numbers_and_differences() {
    check_motions(scene);
}

#[test]
fn derivatives_of_equilibria_equal_differences() {
    check_equilibria(scene, own);
}

/// A moment in space is a parameter only if there is one: scenes without it keep symmetric tangents and the adjoint.
#[test]
fn moment_of_zero_in_space_is_no_parameter() {
    let count = |scene: &Scene| {
        let problem = scene.problem().unwrap();
        own(&problem).iter().filter(|p| p.path().contains(".moment.")).count()
    };
    let mut scene = scene(false, Scheme::NewmarkBeta, false);
    assert_eq!(count(&scene), 6);
    scene.loads.point = vec![PointForce { force: [0.0, 0.1, 0.2], ..PointForce::default() }];
    scene.loads.line.clear();
    assert_eq!(count(&scene), 0);
}

/// The adjoint does not take loads without a potential; the error has their key.
#[test]
fn adjoint_rejects_loads_without_a_potential() {
    let mut scene = scene(false, Scheme::NewmarkBeta, false);
    let message =
        |scene: &Scene| scene.problem().unwrap().check_reversible().unwrap_err().to_string();
    assert!(message(&scene).contains("loads.point[0].follower"), "{}", message(&scene));
    scene.loads.point.remove(0);
    assert!(message(&scene).contains("loads.point[0].moment"), "{}", message(&scene));
    scene.loads.point[0].moment = [0.0; 3];
    assert!(message(&scene).contains("loads.line[0].follower"), "{}", message(&scene));
}

//! Checks of derivatives of motions and equilibria, for scenes in the plane and in space with any scheme.

use rodfit::scene::{Dimension, Material, Scene, Scheme, Section, Shape, Signal, SignalKind, Time};
use rodfit::{Parameter, Problem};

use crate::common::differences::mismatch_at_rest;
use crate::recorded::check;

/// A curved rod of 7 edges with weight, in the plane or in space.
pub fn curved_rod(planar: bool) -> Scene {
    let shape = Shape::Arc { length: 0.5, angle: 0.8 };
    let material = Material { poisson_ratio: Some(0.35), ..Material::new(1200.0, 2e7) };
    let mut scene = Scene::new(7, shape, Section::Circle { radius: 0.005 }, material);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    scene.loads.gravity = [0.0, -9.8, if planar { 0.0 } else { 0.5 }];
    scene
}

/// Twelve steps of a scheme on the mesh of [`curved_rod`].
pub fn steps(scheme: Scheme) -> Option<Time> {
    let step = match scheme {
        Scheme::Verlet => 2e-5,
        // Below the stability limit of 9e-4 s on this mesh.
        Scheme::Pefrl => 5e-4,
        _ => 1e-3,
    };
    Some(Time { scheme, beta: 0.6, rho_inf: 0.4, ..Time::new(12.0 * step, step) })
}

/// A sine of time that has begun before the run.
pub fn sine(name: &str, gain: f64) -> Signal {
    Signal {
        kind: Some(SignalKind::Sine),
        frequency: Some(30.0),
        phase: Some(0.7),
        delay: 3.7e-4,
        gain,
        ..Signal::new(name)
    }
}

/// The parameters of a problem with paths that begin with one of the `places`.
pub fn parameters_at(problem: &Problem, places: &[&str]) -> Vec<Parameter> {
    let is_own = |p: &Parameter| places.iter().any(|place| p.path().starts_with(place));
    let all = Parameter::all(problem.scene()).into_iter().filter(is_own);
    all.filter(|p| problem.check_parameter(*p).is_ok()).collect()
}

/// Compares derivatives of motions by at least eight parameters with runs in dual numbers and differences: of `scene(planar,
/// scheme, timed)` in the plane and in space, with every scheme, and with a signal where the scheme takes one.
pub fn check_motions(scene: impl Fn(bool, Scheme, bool) -> Scene) {
    for timed in [false, true] {
        for scheme in Scheme::all() {
            if timed && !scheme.traits().takes_timed_actuation {
                continue;
            }
            for planar in [true, false] {
                let problem = scene(planar, scheme, timed).problem().unwrap();
                println!("{scheme:?}, planar: {planar}, timed: {timed}");
                assert_eq!(problem.planar().is_some(), planar, "{:?}", problem.model());
                assert!(check(&problem, true) >= 8);
            }
        }
    }
}

/// Compares derivatives of equilibria by the parameters at the `places` with differences, of `scene` in the plane and in space.
pub fn check_equilibria(scene: impl Fn(bool, Scheme, bool) -> Scene, places: &[&str]) {
    for planar in [true, false] {
        let mut scene = scene(planar, Scheme::NewmarkBeta, false);
        scene.time = None;
        let problem = scene.problem().unwrap();
        let own = parameters_at(&problem, places);
        assert!(own.len() >= if planar { 10 } else { 14 }, "{own:?}");
        for parameter in own {
            let value = parameter.of(problem.scene()).unwrap();
            let h = 1e-3 * if value == 0.0 { 1e-3 } else { value.abs() };
            let [off, size] = mismatch_at_rest(&problem, parameter, h);
            println!("{parameter}: {size:.1e}, differences {:.1e}", off / size);
            assert!(off < 1e-6 * size || size < 1e-9, "{parameter}: {off:e} {size:e}");
        }
    }
}

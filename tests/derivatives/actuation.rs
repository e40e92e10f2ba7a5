//! Derivatives of equilibria and motions by the numbers of actuators: gain, ends, tension, route and signal. They are
//! compared with runs in dual numbers and differences, and the adjoint with forward derivatives.

use rodfit::scene::*;

use crate::adjoint::{EXACT, worst};
use crate::all_schemes::{check_equilibria, check_motions, curved_rod, sine, steps};

/// A curved rod with weight, an actuated curvature and a tendon, both following the sine `s` if `timed`.
fn scene(planar: bool, scheme: Scheme, timed: bool) -> Scene {
    let (mut scene, z) = (curved_rod(planar), if planar { 0.0 } else { 1.0 });
    let signal = timed.then(|| "s".to_string());
    let component = if planar { ActuatedStrain::D1 } else { ActuatedStrain::D2 };
    let part = Actuation::Curvature { component, from: 0.113, to: Some(0.38), signal, gain: 1.7 };
    let route = vec![
        RoutePoint { at: 0.02, offset: [0.004, 0.001 * z] },
        RoutePoint { at: 0.29, offset: [0.003, -0.002 * z] },
        RoutePoint { at: 0.48, offset: [-0.002, 0.003 * z] },
    ];
    let tension = match timed {
        true => Tension::Signal("pull".into()),
        false => Tension::Constant(1.3),
    };
    scene.actuation = vec![part, Actuation::Tendon { tension, route }];
    if !planar {
        let (component, signal) = (ActuatedStrain::Twist, None);
        scene.actuation.push(Actuation::Curvature {
            component,
            from: 0.013,
            to: None,
            signal,
            gain: 2.0,
        });
    }
    if timed {
        scene.signals = vec![sine("s", 1.3), sine("pull", 1.1)];
    }
    scene.time = steps(scheme);
    scene
}

#[test]
fn derivatives_of_motions_equal_those_in_dual_numbers_and_differences() {
    check_motions(scene);
}

#[test]
fn derivatives_of_equilibria_equal_differences() {
    check_equilibria(scene, &["actuation", "sig"]);
}

#[test]
fn adjoint_gradient_by_constant_gains_equals_forward_derivatives() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for planar in [true, false] {
            let mut scene = scene(planar, scheme, false);
            scene.actuation.remove(1);
            scene.loads.damping.stiffness = 1e-3;
            let (worst, parameters) = worst(&scene.problem().unwrap(), 3);
            assert!(parameters.iter().any(|p| p.path() == "actuation.0.gain"));
            assert!(worst < EXACT, "{worst:e}");
        }
    }
}

/// The adjoint does not take tendons and actuators that follow signals; the error has their key.
#[test]
fn adjoint_rejects_tendons_and_signals_of_actuators() {
    for (timed, key) in [(false, "actuation[1].kind"), (true, "actuation[0].signal")] {
        let problem = scene(true, Scheme::NewmarkBeta, timed).problem().unwrap();
        let message = problem.check_reversible().unwrap_err().to_string();
        assert!(message.contains(key), "{message}");
    }
}

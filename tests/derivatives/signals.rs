//! Derivatives of motions under loads in time by gain, delay and the other numbers of signals: against the run in dual
//! numbers and differences, and the adjoint against forward derivatives.

use rodfit::scene::*;

use crate::adjoint::{EXACT, worst};
use crate::all_schemes::curved_rod;
use crate::common::at_tip;
use crate::recorded::check;

/// A curved rod with two loads in time and weight; `signal` has the name `s`.
fn scene(planar: bool, scheme: Scheme, signal: &Signal) -> Scene {
    let (mut scene, z) = (curved_rod(planar), if planar { 0.0 } else { 1.0 });
    let name = Some("s".to_string());
    let force = [0.03, -0.04, 0.02 * z];
    scene.loads.point = at_tip([0.01, 0.02, 0.03 * z]);
    scene.loads.point.push(PointForce {
        node: Point::ArcLength(0.31),
        force,
        moment: [0.0, 0.0, 2e-3 * (1.0 - z)],
        signal: name.clone(),
        follower: false,
    });
    let force = [0.0, 0.1, 0.2 * z];
    scene.loads.line =
        vec![LineForce { from: 0.11, to: Some(0.4), force, follower: false, signal: name }];
    scene.signals = vec![signal.clone()];
    let step = if scheme == Scheme::Verlet || scheme == Scheme::Pefrl { 2e-5 } else { 1e-3 };
    scene.time = Some(Time { scheme, beta: 0.6, rho_inf: 0.4, ..Time::new(12.0 * step, step) });
    scene
}

/// One signal of every kind, with knots beside the ends of the steps of `scene`, of the size `step`, s.
fn signals(step: f64) -> Vec<Signal> {
    let of = |kind| Signal { kind: Some(kind), gain: 1.3, delay: 0.37 * step, ..Signal::new("s") };
    let mut signals = vec![
        Signal {
            amplitude: Some(0.8),
            frequency: Some(0.03 / step),
            phase: Some(0.3),
            ..of(SignalKind::Sine)
        },
        Signal { start: Some(1.1 * step), duration: Some(5.2 * step), ..of(SignalKind::Ramp) },
        Signal {
            start: Some(1.1 * step),
            duration: Some(8.3 * step),
            rise: Some(2.1 * step),
            ..of(SignalKind::Pulse)
        },
        Signal {
            times: vec![0.2 * step, 3.4 * step],
            values: vec![0.7, -1.2],
            ..of(SignalKind::Steps)
        },
    ];
    let folder = tempfile::tempdir().unwrap();
    for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
        let line = |k: u32| {
            let t = 1.1 * step * f64::from(k);
            format!("{t:e},{}\n", (0.4 * f64::from(k)).sin())
        };
        let file = folder.path().join("signal.csv");
        std::fs::write(&file, format!("t,value\n{}", (0..15).map(line).collect::<String>()))
            .unwrap();
        let mut signal =
            Signal { file, interpolation, gain: 1.3, delay: 0.37 * step, ..Signal::new("s") };
        // Read here, before the folder is removed.
        let mut read = scene(true, Scheme::NewmarkBeta, &signal);
        read.time = Some(Time::new(12.0 * step, step));
        signal = read.problem().unwrap().scene().signals[0].clone();
        signals.push(signal);
    }
    signals
}

#[test]
fn derivatives_by_signals_equal_those_in_dual_numbers_and_differences() {
    for scheme in Scheme::all() {
        let step = scene(true, scheme, &Signal::new("s")).time.unwrap().step_size();
        for signal in signals(step) {
            if !signal.is_smooth() && !scheme.traits().takes_rough_signals {
                continue;
            }
            for planar in [true, false] {
                let scene = scene(planar, scheme, &signal);
                println!("{scheme:?}, planar: {planar}, {:?}", signal.kind);
                let problem = scene.problem().unwrap();
                assert_eq!(problem.planar().is_some(), planar);
                assert!(check(&problem, true) >= 8);
            }
        }
    }
}

#[test]
fn adjoint_gradient_by_signals_equals_forward_derivatives() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for (k, signal) in signals(1e-3).iter().enumerate() {
            for planar in [true, false] {
                let mut scene = scene(planar, scheme, signal);
                if k % 2 == 0 {
                    scene.initial.state = InitialState::Equilibrium;
                    scene.loads.damping.stiffness = 1e-3;
                }
                let (worst, parameters) = worst(&scene.problem().unwrap(), k as u64);
                let own = parameters.iter().filter(|p| p.path().starts_with("signals.s."));
                assert!(own.count() >= 2);
                println!("{scheme:?}, planar: {planar}, {:?}: off by {worst:.1e}", signal.kind);
                assert!(worst < EXACT, "{worst:e}");
            }
        }
    }
}

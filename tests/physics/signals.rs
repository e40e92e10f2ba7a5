//! Loads in time: a sine at the tip against modal sums, the order of every scheme, and the balance of energy with the
//! work of the loads.

use rodfit::scene::{
    InitialState, Interpolation, LineForce, Material, Point, PointForce, Scene, Scheme, Signal,
    SignalKind, Time,
};
use rodfit::vibration::LinearizationPoint;
use std::f64::consts::TAU;

use crate::common::{
    at_tip, cantilever, distance, energy_change, last_tip, observed_order, rest, simulate,
    straight_rod,
};

/// A signal `s` from a formula.
fn formula(kind: SignalKind) -> Signal {
    Signal { kind: Some(kind), ..Signal::new("s") }
}

/// A force on the tip, N, with the signal `s`.
fn load(force: [f64; 3]) -> Vec<PointForce> {
    let signal = Some("s".to_string());
    at_tip(force).into_iter().map(|load| PointForce { signal: signal.clone(), ..load }).collect()
}

/// The signal `s` from a file with 401 samples of a function from 0 to `end`, s.
fn samples(
    folder: &tempfile::TempDir,
    end: f64,
    interpolation: Interpolation,
    f: impl Fn(f64) -> f64,
) -> Signal {
    let line = |k: u32| {
        let t = end * f64::from(k) / 400.0;
        format!("{t:.17e},{:.17e}\n", f(t))
    };
    let file = folder.path().join("signal.csv");
    let lines: String = (0..=400).map(line).collect();
    std::fs::write(&file, format!("t[s],value\n{lines}")).unwrap();
    Signal { file, interpolation, ..Signal::new("s") }
}

/// Amplitude and phase of the steady vibration of a damped cantilever under a sine at its tip are those of the sum over
/// the modes of a beam, `sum 4/(rho A L)/(w_n^2 - w^2 + i c w)` times the force.
#[test]
fn sine_at_the_tip_equals_modal_sums() {
    let (frequency, damping, force) = (2.5, 6.0, 1e-4);
    let mut scene = cantilever();
    scene.rod.segments = Some(100);
    scene.loads.gravity = [0.0; 3];
    scene.loads.damping.mass = damping;
    scene.loads.point = load([0.0, force, 0.0]);
    scene.signals = vec![Signal { frequency: Some(frequency), ..formula(SignalKind::Sine) }];
    let (area, stiffness) = (TAU / 2.0 * 2.5e-5, 1e8 * TAU / 8.0 * 0.005_f64.powi(4));
    let (length, w): (f64, f64) = (0.5, TAU * frequency);
    let line_mass = 1273.52 * area;
    let (mut real, mut imaginary) = (0.0, 0.0);
    for n in 1..=200 {
        // Roots of cos x cosh x = -1 by Newton's method on cos x + 1/cosh x.
        let mut x = TAU / 2.0 * (f64::from(n) - 0.5);
        for _ in 0..20 {
            x -= (x.cos() + 1.0 / x.cosh()) / (-x.sin() - x.tanh() / x.cosh());
        }
        let own = x.powi(4) * stiffness / (line_mass * length.powi(4));
        let (a, b) = (own - w * w, damping * w);
        let share = 4.0 / (line_mass * length) / (a * a + b * b);
        (real, imaginary) = (real + share * a, imaginary - share * b);
    }
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField] {
        scene.time = Some(Time { scheme, ..Time::new(6.0, 1e-3) });
        let run = simulate(&scene);
        // Fourier sums over the last five periods, 2 s.
        let (mut sine, mut cosine) = (0.0, 0.0);
        for k in 4000..6000 {
            let (y, t) = (run.tip(k)[1], run.times()[k]);
            (sine, cosine) = (sine + y * (w * t).sin() / 1e3, cosine + y * (w * t).cos() / 1e3);
        }
        let amplitude = f64::hypot(sine, cosine) / (force * f64::hypot(real, imaginary));
        let phase = cosine.atan2(sine) - imaginary.atan2(real);
        println!("{scheme:?}: amplitude over theory {amplitude:.6}, phase off by {phase:.1e} rad");
        // Mesh and step of 100 edges and 1 ms.
        assert!((amplitude - 1.0).abs() < 1e-3 && phase.abs() < 1e-3, "{amplitude} {phase}");
    }
}

/// A short rod of six edges without weight, with a force at the tip and along a part.
fn short(scheme: Scheme, end: f64, step: f64, signal: &Signal) -> Scene {
    let mut scene = straight_rod(6, [0.5, 0.005], Material::new(1273.52, 1e8));
    scene.loads.point = load([0.0, 2.0, 0.0]);
    scene.loads.point[0].moment = [0.0, 0.0, 0.3];
    let (force, signal_name) = ([0.0, -4.0, 0.0], Some("s".to_string()));
    scene.loads.line =
        vec![LineForce { from: 0.1, to: Some(0.3), force, follower: false, signal: signal_name }];
    scene.signals = vec![signal.clone()];
    scene.time = Some(Time { scheme, ..Time::new(end, step) });
    scene
}

/// The order in the step with a smooth signal from a file is that of the scheme: 2, and 4 of rodas4 and PEFRL.
#[test]
fn order_of_every_scheme_with_a_signal_is_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let end = 0.0136;
    let bump = |t: f64| (TAU / 2.0 * t / 0.02).sin().powi(6);
    let mut signal = samples(&folder, end, Interpolation::Cubic, bump);
    (signal.gain, signal.delay) = (1.3, 1e-3);
    for scheme in Scheme::all() {
        let tip = |step: f64| last_tip(&short(scheme, end, step, &signal));
        let tips = [2e-4, 1e-4, 5e-5].map(tip);
        let (order, expected) = (observed_order(tips), f64::from(scheme.traits().order));
        println!("{scheme:?}: order {order:.2}");
        // The leading error dominates. That of rodas4 is small here beside the next one: its order appears higher.
        let [below, above] = if expected > 2.0 { [0.2, 1.0] } else { [0.1, 0.1] };
        assert!(order > expected - below && order < expected + above, "{scheme:?}: {order}");
    }
}

/// A jump within a step enters by its exact impulse, so that the error falls as the square of the step.
#[test]
fn jump_within_a_step_keeps_second_order() {
    let steps = Signal {
        times: vec![1e-4 * (12.0 + 2.0 / 7.0), 1e-4 * (56.0 + 3.0 / 7.0)],
        values: vec![1.0, -0.4],
        ..formula(SignalKind::Steps)
    };
    for scheme in Scheme::all().filter(|scheme| scheme.traits().order == 2) {
        let tip = |step: f64| last_tip(&short(scheme, 0.01, step, &steps));
        let exact = tip(1e-4 / 64.0);
        let errors = [1e-4, 1e-4 / 8.0].map(|step| distance(tip(step), exact));
        println!("{scheme:?}: errors {errors:?}");
        // 64 for second order, 8 for first. Both steps have the jumps at the same fraction, on which the constant
        // depends.
        assert!(errors[0] > 40.0 * errors[1], "{scheme:?}: {errors:?}");
    }
}

/// Energy less the work of the loads: constant to rounding with the average vector field; with other schemes the defect
/// falls fourfold or more with half the step.
#[test]
fn energy_balance_includes_the_work_of_loads_in_time() {
    let folder = tempfile::tempdir().unwrap();
    let bump = |t: f64| (TAU * t / 0.02).sin().powi(3);
    let cubic = samples(&folder, 0.02, Interpolation::Cubic, bump);
    let pulse = Signal {
        start: Some(1e-3),
        duration: Some(6e-3),
        rise: Some(1.5e-3),
        ..formula(SignalKind::Pulse)
    };
    for signal in [&cubic, &pulse] {
        for scheme in Scheme::all() {
            if !signal.is_smooth() && !scheme.traits().takes_rough_signals {
                continue;
            }
            let defect = |step: f64| {
                let scene = short(scheme, 0.02, step, signal);
                let [defect, work] = energy_change(&scene, |e| e.potential.abs());
                assert!(work > 1e-3, "{work}");
                defect
            };
            let [coarse, fine] = [1e-4, 5e-5].map(defect);
            println!("{scheme:?}, {:?}: defect over work {coarse:.1e}, {fine:.1e}", signal.kind);
            match scheme {
                Scheme::AverageVectorField => assert!(coarse < 1e-9, "{coarse:e}"),
                // 4 for second order.
                _ => assert!(fine < coarse / 3.4, "{scheme:?}: {coarse:e} {fine:e}"),
            }
        }
    }
}

/// An equilibrium and an initial equilibrium have the value of the signal at their time.
#[test]
fn equilibrium_takes_signals_at_their_time() {
    let ramp = Signal { duration: Some(2.0), gain: 3.0, ..formula(SignalKind::Ramp) };
    let mut scene = short(Scheme::NewmarkBeta, 0.02, 1e-4, &ramp);
    scene.loads.at_time = 0.5;
    let mut constant = scene.clone();
    constant.loads.point = at_tip([0.0, 1.5, 0.0]);
    constant.loads.point[0].moment = [0.0, 0.0, 0.225];
    constant.loads.line[0].signal = None;
    constant.signals.clear();
    constant.loads.line[0].force = [0.0, -3.0, 0.0];
    // 3 times a quarter of the ramp.
    assert!(distance(rest(&scene).tip, rest(&constant).tip) < 1e-13);
    assert!(rest(&scene).tip[1].abs() > 1e-3);
    // Held by the constant load until t = 0: at the delay of -0.5 s the ramp has its value at 0.5 s.
    scene.initial.state = InitialState::Equilibrium;
    scene.signals[0].delay = -0.5;
    scene.loads.at_time = 7.0;
    assert!(distance(simulate(&scene).tip(0), rest(&constant).tip) < 1e-13);
}

/// Equilibria and modes at a time at which the loads are zero say so; not at another time, nor with constant loads.
#[test]
fn loads_that_are_zero_at_rest_are_reported() {
    let ramp = Signal { duration: Some(2.0), ..formula(SignalKind::Ramp) };
    let mut scene = short(Scheme::NewmarkBeta, 0.02, 1e-4, &ramp);
    let found = |scene: &Scene| {
        let problem = scene.problem().unwrap();
        let at_rest = problem.equilibrium().unwrap().warnings;
        let modes = problem.modes(1, LinearizationPoint::Equilibrium).unwrap().warnings;
        [at_rest, modes].map(|list| {
            list.into_iter().filter(|text| text.contains("[no-load-at-time]")).collect::<Vec<_>>()
        })
    };
    for list in found(&scene) {
        assert!(list.len() == 1 && list[0].contains("loads.point[0], loads.line[0]"), "{list:?}");
    }
    scene.loads.at_time = 0.5;
    assert_eq!(found(&scene), [Vec::<String>::new(), Vec::new()]);
    scene.loads.at_time = 0.0;
    scene.loads.point[0].signal = None;
    scene.loads.line.clear();
    scene.signals.clear();
    assert_eq!(found(&scene), [Vec::<String>::new(), Vec::new()]);
}

/// Signals that do not fit the scene are rejected with key, found and allowed value.
#[test]
fn unsuitable_signals_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let sine = Signal { frequency: Some(2e3), ..formula(SignalKind::Sine) };
    let linear = samples(&folder, 0.01, Interpolation::Linear, |t| t);
    let refused = |change: &dyn Fn(&mut Scene)| {
        let mut scene = short(Scheme::NewmarkBeta, 0.02, 1e-3, &linear);
        change(&mut scene);
        let problem = scene.problem();
        problem.and_then(|problem| problem.simulate().map(|_| ())).unwrap_err().to_string()
    };
    /// A change of the scene that makes its signals unsuitable.
    type Change<'a> = &'a dyn Fn(&mut Scene);
    let ramp = Signal { duration: Some(1.0), ..formula(SignalKind::Ramp) };
    let cases: [(Change, &str); 7] = [
        (
            &|scene| {
                let unused = Signal { name: "unused".into(), ..ramp.clone() };
                scene.signals = vec![ramp.clone(), unused];
            },
            "signals[1].name",
        ),
        (&|_| {}, "time.end"),
        (&|scene| scene.signals = vec![sine.clone()], "signals.s.frequency"),
        (&|scene| scene.signals.clear(), "loads.point[0].signal"),
        (&|scene| scene.signals[0].kind = Some(SignalKind::Ramp), "signals[0].kind"),
        (&|scene| scene.signals = vec![formula(SignalKind::Ramp)], "signals[0].duration"),
        (
            &|scene| {
                scene.time = Some(Time { scheme: Scheme::Rodas4, ..Time::new(0.01, 1e-4) });
            },
            "signals.s",
        ),
    ];
    for (change, key) in cases {
        let message = refused(change);
        println!("{message}");
        assert!(message.contains(&format!("{key}: found")), "{key}: {message}");
        assert!(message.contains("allowed"), "{message}");
    }
    let mut scene = short(Scheme::NewmarkBeta, 0.009, 1e-4, &linear);
    scene.loads.point[0].node = Point::ArcLength(0.5);
    assert!(scene.problem().is_ok());
}

/// A delayed signal lasts by its delay longer than its samples, of 10 ms; beyond its end a simulation is rejected.
#[test]
fn samples_of_a_delayed_signal_end_later_by_its_delay() {
    let folder = tempfile::tempdir().unwrap();
    let linear = samples(&folder, 0.01, Interpolation::Linear, |t| t);
    for (delay, end, is_valid) in
        [(0.005, 0.0145, true), (0.005, 0.0165, false), (0.0, 0.0145, false)]
    {
        let mut scene = short(Scheme::NewmarkBeta, end, 5e-4, &linear);
        scene.signals[0].delay = delay;
        match scene.problem() {
            Ok(_) => assert!(is_valid, "{delay} {end}"),
            Err(error) => assert!(!is_valid && error.to_string().contains("time.end"), "{error}"),
        }
    }
}

//! Unstable states in which symmetry keeps a simulated rod are reported; stable states and ordinary motions are not.

use rodfit::dynamics::SimulationReport;
use rodfit::scene::{
    End, Initial, InitialState, Material, Motion, Point, PointForce, Scene, Section, Shape, Signal,
    SignalKind, Support, Time,
};
use rodfit::{Code, Trajectory};
use std::f64::consts::PI;

use crate::common::{at_tip, cantilever, helix_with};
use crate::energy::finish;

/// Runs a scene with a check of the stability of its states; returns its report.
fn run(scene: &Scene) -> SimulationReport {
    let problem = scene.problem().unwrap();
    let run = Trajectory::new(&problem, &[], &[]).unwrap().check_stability();
    let (report, outcome) = finish(&problem, run);
    outcome.unwrap();
    report
}

/// Whether the run has the warning of an unstable state.
fn is_reported(scene: &Scene) -> bool {
    run(scene).warning_codes.contains(&Code::UnstableState)
}

const LENGTH: f64 = 0.3;
const SHORTENING: f64 = 0.01;
/// E I of a steel strip of 20 x 0.5 mm, N m^2.
const BENDING: f64 = 2e11 * 0.02 * 0.0005 * 0.0005 * 0.0005 / 12.0;

/// A steel strip between clamps of which one moves towards the other.
fn strip(displacement: f64) -> Scene {
    let shape = Shape::Straight { length: LENGTH, direction: [1.0, 0.0, 0.0] };
    let section = Section::Rectangle { width: 0.02, height: 0.0005, up: [0.0, 1.0, 0.0] };
    let mut scene = Scene::new(40, shape, section, Material::new(7850.0, 2e11));
    scene.supports.end = Support::Clamped;
    scene.supports.motion = vec![Motion {
        end: End::End,
        displacement: [displacement, 0.0, 0.0],
        ramp: Some(0.5),
        ..Motion::default()
    }];
    scene.loads.damping.mass = 5.0;
    scene.time =
        Some(Time { scheme: rodfit::scene::Scheme::GeneralisedAlpha, ..Time::new(2.0, 1e-3) });
    scene
}

#[test]
fn compressed_straight_strip_is_reported() {
    let report = run(&strip(-SHORTENING));
    assert!(report.warning_codes.contains(&Code::UnstableState), "{:?}", report.warnings);
    assert!(report.warnings.iter().any(|words| words.contains("initial.perturbation")));
    assert!(report.work.stability_checks <= 9, "{:?}", report.work);
    // The clamped Euler load 4 pi^2 E I/L^2 shortens the strip by 2.7e-7 of its length. Less is stable, and so is tension.
    let critical = 4.0 * PI.powi(2) * BENDING / (2e11 * 1e-5 * LENGTH.powi(2));
    assert!(!is_reported(&strip(-0.9 * critical * LENGTH)));
    assert!(!is_reported(&strip(SHORTENING)));
}

/// Buckled, the strip carries little more than the Euler load, and its energy is that times the shortening, 0.183 J in place
/// of the 333 J of compression.
#[test]
fn perturbed_strip_buckles() {
    let mut scene = strip(-SHORTENING);
    scene.initial.perturbation = 1e-4;
    let report = run(&scene);
    assert!(!report.warning_codes.contains(&Code::UnstableState), "{:?}", report.warnings);
    let exact = 4.0 * PI.powi(2) * BENDING / LENGTH.powi(2) * SHORTENING;
    // Euler load of a clamped strip, 4 pi^2 EI/L^2, times the shortening; second-order terms are below 3 %.
    assert!((report.end_energy / exact - 1.0).abs() < 0.03, "{} {exact}", report.end_energy);
}

/// A column of soft rubber above Greenhill's load, `rho A g L^3 = 7.84 E I`, stays upright in a simulation and is reported as
/// unstable, also out of the plane. A column below the load is stable.
#[test]
fn standing_column_is_reported_above_greenhills_load() {
    for (weight, expected) in [(0.8, false), (1.5, true)] {
        let (length, radius, density): (f64, f64, f64) = (0.4, 2e-3, 1200.0);
        let modulus = density * 9.81 * length.powi(3) * 4.0 / (7.837 * weight * radius.powi(2));
        let shape = Shape::Straight { length, direction: [0.0, 0.0, 1.0] };
        let material = Material { poisson_ratio: Some(0.45), ..Material::new(density, modulus) };
        let mut scene = Scene::new(30, shape, Section::Circle { radius }, material);
        scene.loads.gravity = [0.0, 0.0, -9.81];
        scene.loads.damping.mass = 2.0;
        scene.time = Some(Time::new(5.0, 5e-3));
        assert_eq!(is_reported(&scene), expected, "{weight}");
    }
}

/// Motions through states that are not equilibria pass unstable ones all the time, and nothing holds them there.
#[test]
fn ordinary_motion_is_not_reported() {
    let with_torsion = |mut scene: Scene| {
        scene.material.poisson_ratio = Some(0.4);
        scene
    };
    let released = with_torsion(cantilever());
    let mut plucked = released.clone();
    let force = [0.0, 0.3, 0.0];
    plucked.initial =
        Initial { state: InitialState::Equilibrium, point: at_tip(force), ..Initial::default() };
    let mut upright = released.clone();
    upright.rod.shape = Shape::Straight { length: 0.5, direction: [0.1, 1.0, 0.0] };
    upright.material.youngs_modulus = 1e7;
    let mut pendulum = released.clone();
    pendulum.supports.start = Support::Pinned;
    pendulum.time = Some(Time::new(2.0, 1e-3));
    let mut falling = released.clone();
    falling.supports.start = Support::Free;
    let mut damped = released.clone();
    damped.loads.damping.mass = 5.0;
    damped.time = Some(Time::new(4.0, 2e-3));
    let mut shaken = released.clone();
    shaken.supports.motion = vec![Motion {
        end: End::Start,
        displacement: [0.0, 0.02, 0.0],
        frequency: Some(3.0),
        ..Motion::default()
    }];
    let helix = helix_with(0.5, 1e-3, 1.0, rodfit::scene::Clamp::MidEdge);
    let all = [released, plucked, upright, pendulum, falling, damped, shaken, helix];
    for (k, scene) in all.iter().enumerate() {
        let report = run(scene);
        assert!(!report.warning_codes.contains(&Code::UnstableState), "{k}: {:?}", report.warnings);
    }
}

/// The stability of a state is that under the loads of its time. A ramp takes the load of a column from half the Euler load
/// to twice it. Without the ramp in the simulated time the column is stable, also if equilibria have the load after it.
#[test]
fn loads_in_time_count_with_their_values_at_the_examined_state() {
    let euler = PI.powi(2) * BENDING / (4.0 * LENGTH.powi(2));
    let column = |start: f64, at_time: f64| {
        let mut scene = strip(0.0);
        scene.supports.end = Support::Free;
        scene.supports.motion.clear();
        let load = |size: f64, signal: Option<String>| PointForce {
            node: Point::Tip,
            force: [-size * euler, 0.0, 0.0],
            signal,
            ..PointForce::default()
        };
        scene.loads.point = vec![load(0.5, None), load(1.5, Some("s".into()))];
        scene.loads.at_time = at_time;
        let kind = Some(SignalKind::Ramp);
        let (start, duration) = (Some(start), Some(0.5));
        scene.signals = vec![Signal { kind, start, duration, ..Signal::new("s") }];
        scene
    };
    assert!(is_reported(&column(0.5, 0.0)));
    assert!(!is_reported(&column(10.0, 20.0)));
}

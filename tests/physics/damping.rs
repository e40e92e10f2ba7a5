//! Kelvin-Voigt damping of each kind of strain, Maxwell branches and internal friction, against closed forms.

use rodfit::scene::{
    Clamp, Damping, Dimension, Friction, Initial, InitialState, Material, Maxwell, Scene, Scheme,
    Section, Shape, StepTolerance, Time,
};
use rodfit::{Point, Problem};
use std::f64::consts::{PI, TAU};

use crate::common::{at_tip, cantilever, cantilever_with, helix_with};
use crate::energy::energy_balance;
use crate::prony::oscillator;

/// Vibrations of a clamped rod.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Bending,
    Twisting,
    Stretching,
}

const LENGTH: f64 = 0.5;

/// A straight rod in space.
fn straight() -> Scene {
    let mut scene = cantilever();
    scene.rod.dimension = Dimension::Spatial;
    scene.rod.segments = Some(30);
    scene.material.poisson_ratio = Some(0.5);
    scene.loads.gravity = [0.0; 3];
    scene
}

/// The lowest frequency, rad/s.
fn frequency(kind: Kind) -> f64 {
    let wave = (1e8_f64 / 1273.52).sqrt();
    match kind {
        Kind::Bending => 1.875104068711961_f64.powi(2) * wave * 0.0025 / LENGTH.powi(2),
        Kind::Twisting => 0.5 * PI * wave / 3.0_f64.sqrt() / LENGTH,
        Kind::Stretching => 0.5 * PI * wave / LENGTH,
    }
}

/// The rate at which small vibrations of the lowest mode lose energy, 1/s.
fn decay(scene: &Scene, kind: Kind) -> f64 {
    let period = TAU / frequency(kind);
    let mut scene = scene.clone();
    let Time { scheme, rho_inf, .. } = scene.time.clone().unwrap();
    scene.time = Some(Time { scheme, rho_inf, ..Time::new(2.5 * period, period / 200.0) });
    let problem: Problem = scene.problem().unwrap();
    let spatial = problem.spatial().unwrap();
    let mut simulation = spatial.simulation().unwrap();
    let rest = spatial.rest();
    let speed = 1e-3;
    let v: Vec<f64> = (0..rest.len())
        .map(|i| {
            let (node, axis) = (i / 4, i % 4);
            let x = rest[4 * node].max(0.0) / LENGTH;
            let middle = (x + 0.5 / 29.5).max(0.0);
            match (kind, axis) {
                (Kind::Bending, 1) => speed * crate::energy::first_mode(x),
                (Kind::Twisting, 3) => speed * (0.5 * PI * middle).sin(),
                (Kind::Stretching, 0) => speed * (0.5 * PI * x).sin(),
                _ => 0.0,
            }
        })
        .collect();
    simulation.set_velocity(&v);
    let energies: Vec<f64> = (1..=500)
        .map(|k| {
            simulation.step_to(f64::from(k) * period / 200.0).unwrap();
            simulation.energies().total()
        })
        .collect();
    (energies[99] / energies[499]).ln() / (2.0 * period)
}

/// Vibrations of bending, twisting and stretching decay as exp(-eta w^2 t/2) with the time of their
/// kind and that of all strains, and feel no other.
#[test]
fn kelvin_voigt_time_of_each_strain_damps_that_strain() {
    let kinds = [Kind::Bending, Kind::Twisting, Kind::Stretching];
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField] {
        for kind in kinds {
            let w = frequency(kind);
            let eta = 0.03 / w;
            let with = |of: &dyn Fn(Kind) -> f64, stiffness: f64| {
                let mut scene = straight();
                let [bending, twisting, stretching] = kinds.map(of);
                scene.loads.damping =
                    Damping { stiffness, bending, twisting, stretching, ..Damping::default() };
                scene.time = Some(Time { scheme, rho_inf: 0.95, ..Time::new(1.0, 1.0) });
                decay(&scene, kind) / (eta * w * w)
            };
            let own = with(&|k| if k == kind { eta } else { 0.0 }, 0.0);
            let others = with(&|k| if k == kind { 0.0 } else { eta }, 0.0);
            let both = with(&|k| if k == kind { 0.4 * eta } else { 0.0 }, 0.6 * eta);
            println!("{scheme:?} {kind:?}: own {own:.4}, others {others:.1e}, both {both:.4}");
            // Unity is the theory, `exp(-eta w^2 t/2)`; the rate is measured over few periods.
            assert!((own - 1.0).abs() < 1e-2 && (both - 1.0).abs() < 1e-2, "{own} {both}");
            // Damping of the other strains has no effect on this one.
            assert!(others.abs() < 1e-3, "{others}");
        }
    }
}

/// A rod with a Maxwell branch vibrates as the standard linear solid does, whose loss factor is
/// `g w tau/(1 + (1 + g) w^2 tau^2)`, at second order in the step; where the branch relaxes at once there is
/// nothing of it, and where it never does the rod is stiffer by `1 + g`.
#[test]
fn maxwell_branch_equals_the_standard_linear_solid() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for tau in [0.2, 1.0, 5.0] {
            let branch = Maxwell { stiffness: 0.8, time: tau };
            let errors = [400, 800, 1600].map(|steps| {
                let [found, exact] = oscillator(&[branch], scheme, 0.0, 9.0, steps);
                found - exact
            });
            let orders = [errors[0] / errors[1], errors[1] / errors[2]].map(|r| r.abs().log2());
            println!("{scheme:?}, w tau = {tau}: errors {errors:?}, orders {orders:.2?}");
            // Second order in the step, against the closed form of the standard linear solid.
            assert!(errors[2].abs() < 1e-4 && orders.iter().all(|p| (p - 2.0).abs() < 0.15));
        }
        for (tau, frequency) in [(1e-9, 1.0), (1e9, 1.8_f64.sqrt())] {
            let branch = Maxwell { stiffness: 0.8, time: tau };
            let [found, _] = oscillator(&[branch], scheme, 0.0, 9.0, 4000);
            let exact = (9.0 * frequency).sin() / frequency;
            println!("{scheme:?}, w tau = {tau:e}: {found:.6}, exactly {exact:.6}");
            // Limits: frequency 1 without the branch, sqrt(1 + g) with an elastic one (g = 0.8).
            assert!((found - exact).abs() < 2e-5, "{found} {exact}");
        }
    }
}

/// A rod that relaxes loses the same energy at every step, to second order, and never gains any.
#[test]
fn relaxation_dissipates_energy() {
    for (name, mut scene) in
        [("plane", cantilever()), ("space", helix_with(0.5, 1e-3, 0.3, Clamp::MidEdge))]
    {
        scene.rod.segments = Some(16);
        scene.loads.gravity = [0.0; 3];
        let force = if name == "plane" { [0.0, -0.05, 0.0] } else { [0.0, 0.0, -0.02] };
        scene.initial = Initial { state: InitialState::Equilibrium, ..Initial::default() };
        scene.initial.point = at_tip(force);
        let mut lost = |scheme, step| {
            scene.loads.damping.maxwell = Maxwell { stiffness: 0.5, time: 0.05 }.into();
            scene.time = Some(Time { scheme, rho_inf: 0.9, ..Time::new(0.3, step) });
            let [_, rise, lost] = energy_balance(&scene);
            // Energy may rise by the error of the scheme only.
            assert!(rise < 2e-3 * lost, "{name} {scheme:?} {step}: {rise:e} of {lost:e}");
            lost
        };
        let exact = lost(Scheme::NewmarkBeta, 1.25e-4);
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            let errors = [1e-3, 5e-4].map(|step| lost(scheme, step) / exact - 1.0);
            println!("{name}, {scheme:?}: {errors:?} of {exact:.3e} J");
            // Second order: half the step reduces the error to a quarter.
            assert!(exact > 0.0 && errors[1].abs() < 5e-3 && errors[0].abs() < 2e-2);
        }
    }
}

/// Internal friction with springs that slip and stick: the default tolerance of Newton's method gives the motion of the
/// solution to rounding errors within 1e-10 m, with at least a tenth fewer tangents.
#[test]
fn residual_curvature_of_slipping_springs_equals_theory() {
    let scenes = [
        ("cantilever", cantilever_with(0.5, 2e-3, 0.5, Clamp::MidEdge), Scheme::NewmarkBeta),
        ("cantilever", cantilever_with(0.5, 5e-3, 0.5, Clamp::MidEdge), Scheme::GeneralisedAlpha),
        ("helix", helix_with(0.5, 2e-3, 0.5, Clamp::MidEdge), Scheme::NewmarkBeta),
        ("helix", helix_with(0.5, 5e-3, 0.5, Clamp::MidEdge), Scheme::GeneralisedAlpha),
    ];
    for (name, mut scene, scheme) in scenes {
        scene.rod.segments = Some(16);
        scene.time.as_mut().unwrap().scheme = scheme;
        scene.loads.damping.friction = Some(Friction { stiffness: 0.8, curvature: 0.3 });
        let [exact, usual] = [StepTolerance::Rounding, StepTolerance::default()].map(|tolerance| {
            scene.time.as_mut().unwrap().tolerance = tolerance;
            scene.problem().unwrap().simulate().unwrap()
        });
        let apart = |k: usize| {
            let (a, b) = (exact.tip(k), usual.tip(k));
            (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
        };
        let off = (0..exact.times().len()).map(apart).fold(0.0, f64::max);
        let [most, least] = [&exact, &usual].map(|run| run.work().tangents);
        println!("{name}, {scheme:?}: off by {off:.1e} m, {least} tangents of {most}");
        // The error of the looser tolerance is far below others, at a tenth less work at least.
        assert!(off < 1e-10 && 10 * least < 9 * most, "{off:e} {least} {most}");
    }
}

/// In the plane springs slip when they do in space, though the section resists bending more one way than the other.
#[test]
fn friction_of_a_flat_rod_is_equal_in_both_models() {
    for up in [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
        let section = Section::Rectangle { width: 0.012, height: 0.006, up };
        let material = Material { poisson_ratio: Some(0.4), ..Material::new(1200.0, 1e7) };
        let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
        let mut scene = Scene::new(10, shape, section, material);
        scene.loads.gravity = [0.0, -9.8, 0.0];
        scene.loads.damping.friction = Some(Friction { stiffness: 0.8, curvature: 0.5 });
        scene.time = Some(Time { tolerance: StepTolerance::Rounding, ..Time::new(0.2, 2e-3) });
        let tip = |dimension: Dimension, friction: bool| {
            let mut scene = scene.clone();
            scene.rod.dimension = dimension;
            if !friction {
                scene.loads.damping.friction = None;
            }
            let run = scene.problem().unwrap().simulate().unwrap();
            run.at(Point::Tip, 0.2).unwrap().0
        };
        let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).sum::<f64>();
        let plane = tip(Dimension::Planar, true);
        let off = apart(plane, tip(Dimension::Spatial, true));
        // Both models have the same slip: rounding errors along the run.
        assert!(off < 1e-9, "{up:?}: {off:e}");
        // The comparison is without effect unless friction matters.
        assert!(apart(plane, tip(Dimension::Planar, false)) > 1e-3, "nothing slips");
    }
}

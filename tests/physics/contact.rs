//! Contact without friction: deflections by obstacles and lifted lengths against beam theory, free fall, order of the steps.

use rodfit::Trajectory;
use rodfit::code::Code;
use rodfit::dynamics::SimulationReport;
use rodfit::scene::*;
use rodfit::vibration::{LinearizationPoint, Mode, ModePlane};
use std::f64::consts::PI;

use crate::common::{at_tip, rest};

const RADIUS: f64 = 0.002;
const LENGTH: f64 = 0.5;
const DENSITY: f64 = 1200.0;
const MODULUS: f64 = 5e7;
/// Young's modulus of a rod whose slopes are small under its weight, Pa.
const STIFF: f64 = 1e9;
/// Height from which rods fall, m.
const DROP: f64 = 0.002;

/// A straight rod along x, clamped at its start, without weight.
fn straight(segments: usize) -> Scene {
    let shape = Shape::Straight { length: LENGTH, direction: [1.0, 0.0, 0.0] };
    let mut material = Material::new(DENSITY, MODULUS);
    material.poisson_ratio = Some(0.4);
    Scene::new(segments, shape, Section::Circle { radius: RADIUS }, material)
}

fn bending_stiffness(modulus: f64) -> f64 {
    modulus * PI / 4.0 * RADIUS.powi(4)
}

fn weight_per_length() -> f64 {
    DENSITY * PI * RADIUS.powi(2) * 9.81
}

/// A floor at this height.
fn floor(height: f64, stiffness: Option<f64>) -> Contact {
    Contact::plane([0.0, height, 0.0], [0.0, 1.0, 0.0]).stiffness(stiffness)
}

/// A heavy rod on a floor, whose end is lifted by the force F. The lifted length is a = 2 F/q, and the height of the end
/// d = q a^4/(24 EI); a lifted length by the height is (24 EI d/q)^(1/4).
#[test]
fn lifted_end_of_a_heavy_rod_on_a_floor_has_the_lifted_length_of_beam_theory() {
    let (q, lifted) = (weight_per_length(), 0.25);
    for (stiffness, segments) in [(None, 100), (Some(1e11), 100), (Some(1e11), 200)] {
        let mut scene = straight(segments);
        scene.material.youngs_modulus = STIFF;
        scene.loads.gravity = [0.0, -9.81, 0.0];
        scene.contacts = vec![floor(-RADIUS, stiffness)];
        scene.loads.point = at_tip([0.0, 0.5 * q * lifted, 0.0]);
        let found = rest(&scene);
        let height = found.tip[1];
        let length = (24.0 * bending_stiffness(STIFF) * height / q).powf(0.25);
        println!(
            "{stiffness:?} {segments}: d = {height:.6e} m, a {:.5} of theory, {} iterations",
            length / lifted,
            found.newton_iterations
        );
        assert!((length / lifted - 1.0).abs() < 5e-3, "{length}");
        assert!(height < 2e-3 && found.warnings.is_empty(), "{:?}", found.warnings);
    }
}

/// A rod at rest on a floor overlaps it by at most half a per cent of its radius with the default stiffness.
#[test]
fn rod_at_rest_overlaps_a_floor_by_less_than_the_default_allows() {
    let mut scene = straight(40);
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.contacts = vec![floor(-RADIUS, None)];
    let overlap = -rest(&scene).nodes[20][1] / RADIUS;
    // The weight and EI/L^3 at 0.5 %.
    let bending = bending_stiffness(MODULUS) / LENGTH.powi(3);
    let expected = 0.005 * (weight_per_length() / (weight_per_length() + bending)).sqrt();
    println!("overlap {overlap:.6} of the radius, expected {expected:.6}");
    assert!((overlap / expected - 1.0).abs() < 1e-6, "{overlap}");
}

/// Round obstacles below the rod around `center`, across the plane.
fn round_obstacles(center: [f64; 3], radius: f64) -> [Contact; 3] {
    let ends = [-0.02, 0.02].map(|z| [center[0], center[1], z]);
    let obstacles = [
        Contact::sphere(center, radius),
        Contact::cylinder(center, [0.0, 0.0, 1.0], radius),
        Contact::capsule(ends, radius),
    ];
    obstacles.map(|obstacle| obstacle.stiffness(1e12))
}

/// A rod whose clamp is lowered, so that an obstacle at the distance `at` bends it by `depth`.
fn lowered(obstacle: &Contact, dimension: Dimension, gap: f64, depth: f64) -> Scene {
    let mut scene = straight(100);
    scene.rod.dimension = dimension;
    scene.contacts = vec![obstacle.clone()];
    let displacement = [0.0, -gap - depth, 0.0];
    scene.supports.motion = vec![Motion { end: End::Start, displacement, ..Motion::default() }];
    scene
}

/// A rod without weight, clamped at its start, is lowered onto an obstacle. It bends by h at the distance a, so that its tip is
/// higher by h (3 L/a - 1)/2 than the clamp.
#[test]
fn rod_lowered_onto_an_obstacle_deflects_as_a_cantilever() {
    let (gap, depth, at, radius) = (0.003, 0.004, 0.3, 0.01);
    let center = [at, -gap - RADIUS - radius, 0.0];
    for obstacle in round_obstacles(center, radius) {
        for dimension in [Dimension::Auto, Dimension::Spatial] {
            let problem = lowered(&obstacle, dimension, gap, depth).problem().unwrap();
            assert_eq!(problem.planar().is_some(), dimension == Dimension::Auto);
            let found = problem.equilibrium().unwrap();
            let risen = found.tip[1] + gap + depth;
            let ratio = risen / (depth * (3.0 * LENGTH / at - 1.0) / 2.0);
            println!("{dimension:?}: {ratio:.5} of theory");
            assert!((ratio - 1.0).abs() < 5e-3, "{obstacle:?}: {ratio}");
        }
    }
}

/// A stiff rod whose end rests on an obstacle by its weight vibrates as a beam that is clamped and pinned, with the lowest
/// frequency (3.9266/L)^2 sqrt(EI/(rho A)).
#[test]
fn modes_in_contact_are_those_of_a_supported_beam() {
    let (modulus, radius) = (1e10, 0.01);
    let center = [LENGTH, -RADIUS - radius - 1e-4, 0.0];
    for obstacle in round_obstacles(center, radius) {
        let mut scene = straight(100);
        scene.material.youngs_modulus = modulus;
        scene.loads.gravity = [0.0, -9.81, 0.0];
        scene.contacts = vec![obstacle];
        let problem = scene.problem().unwrap();
        let modes = problem.modes(3, LinearizationPoint::Equilibrium).unwrap();
        let wave = (bending_stiffness(modulus) / (DENSITY * PI * RADIUS.powi(2))).sqrt();
        // Out of the plane nothing holds the end.
        let in_plane = |mode: &&Mode| mode.plane == Some(ModePlane::In);
        let lowest = modes.modes.iter().find(in_plane).unwrap().frequency_rad_s;
        let ratio = lowest / ((3.926_602 / LENGTH).powi(2) * wave);
        println!("lowest frequency {ratio:.5} of theory");
        assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
    }
}

/// A free rod above a floor, inclined by this slope.
fn falling(scheme: Scheme, slope: f64, step: f64, end: f64) -> Scene {
    let mut scene = straight(20);
    let direction = [1.0, slope, 0.0];
    scene.rod.shape = Shape::Straight { length: LENGTH, direction };
    scene.supports.start = Support::Free;
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.contacts = vec![floor(-RADIUS - DROP, None)];
    scene.time = Some(Time { scheme, ..Time::new(end, step) });
    scene
}

/// A rod falls on a floor, flat or inclined. It bounces, and its energy stays below that at the start.
#[test]
fn rod_that_falls_on_a_floor_gains_no_energy() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField] {
        for (slope, step) in [(0.0, 1e-4), (0.0, 4e-4), (0.02, 1e-4), (0.02, 4e-4)] {
            let problem = falling(scheme, slope, step, 0.12).problem().unwrap();
            let (mut energies, mut heights) = (Vec::new(), Vec::new());
            let mut run = Trajectory::new(&problem, &[], &[]).unwrap();
            run.run(&problem, (0.12 / step) as usize, |now| {
                energies.push(now.energies().total());
                heights.push(now.position(10)[1]);
            })
            .unwrap();
            let fallen = weight_per_length() * LENGTH * DROP;
            let gain = energies.iter().map(|e| e - energies[0]).fold(0.0, f64::max) / fallen;
            let lowest = heights.iter().map(|y| y - heights[0]).fold(0.0, f64::min);
            println!(
                "{scheme:?}, {step} s, slope {slope}: gain {gain:.1e}, lowest {:.4} m, {} steps",
                lowest,
                run.work().steps
            );
            assert!(gain < 2e-2, "{gain}");
            // It neither hangs in the air nor sinks into the floor.
            assert!(lowest < -DROP && lowest > -DROP - 0.25 * slope - 0.2 * RADIUS, "{lowest}");
        }
    }
}

/// The tip of a clamped rod that is thrown onto a floor and an obstacle, after 20 ms.
fn thrown(scheme: Scheme, step: f64) -> [f64; 3] {
    let mut scene = straight(8);
    scene.initial.velocity = [0.0, -0.5, 0.0];
    let center = [0.3, -RADIUS - 0.0005 - 0.01, 0.0];
    scene.contacts =
        vec![floor(-RADIUS - 0.0005, Some(1e7)), Contact::sphere(center, 0.01).stiffness(1e7)];
    let end = 0.02;
    scene.time = Some(Time { scheme, rho_inf: 0.5, ..Time::new(end, step) });
    let trajectory = scene.problem().unwrap().simulate().unwrap();
    trajectory.tip((end / step).round() as usize)
}

/// The force of a contact is smooth enough for the order of the schemes.
#[test]
fn order_in_the_step_is_kept_in_contact() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField] {
        let step = 4e-5;
        let exact = thrown(scheme, step / 64.0);
        let error = |h: f64| {
            let tip = thrown(scheme, h);
            (tip[0] - exact[0]).hypot(tip[1] - exact[1])
        };
        let errors = [step, step / 2.0, step / 4.0, step / 8.0].map(error);
        let order = (errors[0] / errors[3]).log2() / 3.0;
        println!("{scheme:?}: errors {errors:?}, order {order:.3}");
        assert!((order - 2.0).abs() < 0.2, "{scheme:?}: {order}");
    }
}

/// An overlap above a tenth of the radius is reported with its code, in motions and equilibria.
#[test]
fn deep_overlap_is_reported() {
    let mut scene = straight(20);
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.contacts = vec![floor(-RADIUS, Some(1e6))];
    let found = rest(&scene);
    assert!(found.warning_codes.contains(&Code::DeepContact), "{:?}", found.warnings);
    assert!(found.warnings.iter().any(|w| w.contains("contacts[0]")), "{:?}", found.warnings);
    scene.time = Some(Time::new(0.1, 1e-3));
    let problem = scene.problem().unwrap();
    let mut report = SimulationReport::new(&problem);
    let mut run = Trajectory::new(&problem, &[], &[]).unwrap();
    let outcome = run.run(&problem, 100, |now| report.push(&problem, now));
    report.finish(&run, &outcome);
    assert!(report.warning_codes.contains(&Code::DeepContact), "{:?}", report.warnings);
}

/// Contacts that do not fit the scene are rejected with key, found and allowed value.
#[test]
fn unsuitable_contacts_are_rejected() {
    type Change = fn(&mut Scene);
    let cases: [(Change, &str); 7] = [
        (|scene| scene.contacts = vec![floor(-0.5 * RADIUS, None)], "contacts[0]"),
        (
            |scene| {
                scene.contacts = vec![Contact::plane([0.0; 3], [0.0; 3])];
            },
            "contacts[0].normal",
        ),
        (
            |scene| {
                scene.contacts = vec![Contact::capsule([[0.0, -1.0, 0.0]; 2], 0.1)];
            },
            "contacts[0].to",
        ),
        (|scene| scene.contacts = vec![floor(-1.0, Some(-1.0))], "contacts[0].stiffness"),
        (
            |scene| {
                let up = [0.0, 1.0, 0.0];
                scene.rod.section = Section::Rectangle { width: 0.01, height: 0.002, up };
            },
            "contacts[0].contact_radius",
        ),
        (
            |scene| scene.time = Some(Time { scheme: Scheme::Verlet, ..Time::new(0.1, 1e-5) }),
            "contacts",
        ),
        // The rotation of the rod by this angle takes its end into the floor.
        (
            |scene| (scene.contacts, scene.supports.angle) = (vec![floor(-0.1, None)], -0.3),
            "contacts[0]",
        ),
    ];
    for (change, key) in cases {
        let mut scene = straight(20);
        scene.contacts = vec![floor(-1.0, None)];
        change(&mut scene);
        let message = scene.problem().unwrap_err().to_string();
        println!("{message}");
        assert!(message.contains(&format!("{key}: found")), "{key}: {message}");
        assert!(message.contains("allowed"), "{message}");
    }
}

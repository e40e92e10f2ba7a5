//! Damping and friction of contacts: sticking, sliding and rolling on an incline, rebounds, and a strip dragged over a floor.

use rodfit::Trajectory;
use rodfit::code::Code;
use rodfit::scene::*;
use rodfit::vibration::LinearizationPoint;
use std::f64::consts::PI;

use crate::common::at_tip;

const RADIUS: f64 = 0.002;
const LENGTH: f64 = 0.2;
const DENSITY: f64 = 1200.0;
const GRAVITY: f64 = 9.81;
const SLIP_VELOCITY: f64 = 1e-3;

/// A stiff free rod along a direction, on a plane through the origin with this normal, which it touches.
fn lying(direction: [f64; 3], normal: [f64; 3], damping: f64, friction: f64) -> Scene {
    let shape = Shape::Straight { length: LENGTH, direction };
    let mut material = Material::new(DENSITY, 1e9);
    material.poisson_ratio = Some(0.4);
    let mut scene = Scene::new(10, shape, Section::Circle { radius: RADIUS }, material);
    scene.supports.start = Support::Free;
    let plane = Contact::plane(normal.map(|c| -RADIUS * c), normal).stiffness(1e9);
    scene.contacts = vec![plane.damping(damping).friction(friction)];
    scene
}

/// Velocities of the middle node after the shares of the time, m/s.
fn velocities(scene: &Scene, shares: [f64; 2]) -> [[f64; 3]; 2] {
    let time = scene.time.as_ref().unwrap();
    let steps = (time.end / time.step_size()).round();
    let run = scene.problem().unwrap().simulate().unwrap();
    shares.map(|share| run.velocity(5, (share * steps).round() as usize))
}

/// A rod along the fall line of an incline. It slides with g (sin - mu cos), or creeps below the slip velocity `s` at the
/// speed y s with 2 y - y^2 = tan/mu.
#[test]
fn stiff_rod_on_an_incline_sticks_below_the_friction_angle_and_slides_above() {
    let angle: f64 = 0.4;
    let (sin, cos) = angle.sin_cos();
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for (friction, slides) in [(0.2, true), (0.4, true), (0.45, false), (0.7, false)] {
            let mut scene = lying([cos, -sin, 0.0], [sin, cos, 0.0], 20.0, friction);
            scene.loads.gravity = [0.0, -GRAVITY, 0.0];
            scene.time = Some(Time { scheme, beta: 0.55, ..Time::new(0.2, 2e-4) });
            let [half, end] = velocities(&scene, [0.5, 1.0]).map(|[x, y, _]| x * cos - y * sin);
            println!("{scheme:?}, mu {friction}: {half:.6} and {end:.6} m/s");
            if slides {
                let ratio = (end - half) / 0.1 / (GRAVITY * (sin - friction * cos));
                println!("acceleration {ratio:.5} of theory");
                assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
            } else {
                let creep = SLIP_VELOCITY * (1.0 - (1.0 - angle.tan() / friction).sqrt());
                assert!((end / creep - 1.0).abs() < 1e-2, "{end} {creep}");
                assert!(end < SLIP_VELOCITY);
            }
        }
    }
}

/// A rod across the fall line rolls: two thirds of the acceleration without friction, at a surface that does not slip.
#[test]
fn rod_across_an_incline_rolls() {
    let angle: f64 = 0.2;
    let (sin, cos) = angle.sin_cos();
    let mut scene = lying([0.0, 0.0, 1.0], [sin, cos, 0.0], 20.0, 0.5);
    scene.loads.gravity = [0.0, -GRAVITY, 0.0];
    scene.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(0.2, 2e-4) });
    let [half, end] = velocities(&scene, [0.5, 1.0]).map(|[x, y, _]| x * cos - y * sin);
    let ratio = (end - half) / 0.1 / (GRAVITY * sin * 2.0 / 3.0);
    println!("acceleration {ratio:.5} of theory");
    assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
}

/// A force drags a strip over a floor: the acceleration is that of the force less the friction of the weight.
#[test]
fn strip_dragged_over_a_floor_has_the_acceleration_of_coulomb() {
    let friction = 0.3;
    let mass = DENSITY * PI * RADIUS.powi(2) * LENGTH;
    let mut scene = lying([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 20.0, friction);
    scene.loads.gravity = [0.0, -GRAVITY, 0.0];
    scene.loads.point = at_tip([2.0 * friction * mass * GRAVITY, 0.0, 0.0]);
    scene.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(0.2, 2e-4) });
    let [half, end] = velocities(&scene, [0.5, 1.0]).map(|v| v[0]);
    let ratio = (end - half) / 0.1 / (friction * GRAVITY);
    println!("acceleration {ratio:.5} of theory");
    assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
}

/// The velocity v after a rebound with damping c does not depend on mass and stiffness: c v + ln(1 - c v) is that of minus the
/// velocity before.
#[test]
fn rebound_of_a_damped_contact_is_that_of_hunt_and_crossley() {
    let speed = 0.2;
    for product in [0.0_f64, 0.1, 1.0, 5.0] {
        let mut scene = lying([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], product / speed, 0.0);
        scene.initial.velocity = [0.0, -speed, 0.0];
        let scheme = Scheme::GeneralisedAlpha;
        scene.time = Some(Time { scheme, ..Time::new(6e-3, 1e-5) });
        let [_, [_, rebound, _]] = velocities(&scene, [0.0, 1.0]);
        let loss = |x: f64| x - x.ln_1p();
        // Bisection of the loss on the way out.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if loss(-middle) < loss(product) { low = middle } else { high = middle }
        }
        let expected = if product == 0.0 { speed } else { low * speed / product };
        println!("c v = {product}: rebound {:.5} of theory", rebound / expected);
        assert!((rebound / expected - 1.0).abs() < 2e-3, "{product}: {rebound} {expected}");
    }
}

/// Schemes without velocities at the end of a step reject losses of contacts with the key.
#[test]
fn losses_with_an_averaging_scheme_are_rejected() {
    let mut scene = lying([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 1.0, 0.2);
    scene.time = Some(Time { scheme: Scheme::AverageVectorField, ..Time::new(0.1, 1e-3) });
    let message = scene.problem().unwrap_err().to_string();
    println!("{message}");
    assert!(message.contains("contacts[0].friction: found"), "{message}");
    assert!(message.contains("generalised-alpha"), "{message}");
}

/// The force of the floor on a sliding rod balances its weight and has the friction along the floor.
#[test]
fn force_of_an_obstacle_is_weight_and_friction() {
    let friction = 0.3;
    let weight = DENSITY * PI * RADIUS.powi(2) * LENGTH * GRAVITY;
    let mut scene = lying([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 20.0, friction);
    scene.loads.gravity = [0.0, -GRAVITY, 0.0];
    scene.initial.velocity = [1.0, 0.0, 0.0];
    scene.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(0.1, 2e-4) });
    let problem = scene.problem().unwrap();
    let mut forces = Vec::new();
    let mut run = Trajectory::new(&problem, &[], &[]).unwrap().keep_reactions();
    run.run(&problem, 500, |now| forces = now.contact_forces()).unwrap();
    let [x, y, z] = forces[0];
    println!("force over weight: {:.6} {:.6}", x / weight, y / weight);
    assert!((y / weight - 1.0).abs() < 1e-3 && (x / y + friction).abs() < 1e-6, "{x} {y}");
    assert_eq!((forces.len(), z), (1, 0.0));
}

/// Equilibria and modes of a scene with friction have a warning.
#[test]
fn equilibria_and_modes_warn_that_they_are_without_friction() {
    let mut scene = lying([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 1.0, 0.2);
    scene.supports.start = Support::Clamped;
    scene.loads.gravity = [0.0, -GRAVITY, 0.0];
    let problem = scene.problem().unwrap();
    let rest = problem.equilibrium().unwrap();
    let modes = problem.modes(1, LinearizationPoint::Equilibrium).unwrap();
    assert!(rest.warning_codes.contains(&Code::Frictionless), "{:?}", rest.warnings);
    assert!(modes.warning_codes.contains(&Code::Frictionless), "{:?}", modes.warnings);
    scene.contacts = vec![];
    let rest = scene.problem().unwrap().equilibrium().unwrap();
    assert!(!rest.warning_codes.contains(&Code::Frictionless), "{:?}", rest.warnings);
}

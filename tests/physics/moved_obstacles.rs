//! Moved obstacles: lifts, belts, pegs and pistons against closed forms, Galilean invariance and the balance of energy.

use rodfit::Trajectory;
use rodfit::scene::*;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use crate::common::distance;

const RADIUS: f64 = 0.002;
const LENGTH: f64 = 0.2;
const DENSITY: f64 = 1200.0;
const GRAVITY: f64 = 9.81;

fn mass() -> f64 {
    DENSITY * PI * RADIUS.powi(2) * LENGTH
}

/// A motion with a constant velocity, m/s.
fn at_speed(velocity: [f64; 3]) -> ObstacleMotion {
    ObstacleMotion { velocity, ..ObstacleMotion::default() }
}

/// A floor that a horizontal rod touches, with this motion.
fn floor(damping: f64, friction: f64, motion: ObstacleMotion) -> Contact {
    let [damping, friction] = [damping, friction].map(|own| Some(own).filter(|own| *own > 0.0));
    let floor = Contact::plane([0.0, -RADIUS, 0.0], [0.0, 1.0, 0.0]).stiffness(1e9);
    floor.damping(damping).friction(friction).motion(vec![motion])
}

/// A free rod along x with this modulus, under gravity, simulated by generalised-alpha until `end` in steps, s.
fn rod(modulus: f64, contact: Contact, [end, step]: [f64; 2]) -> Scene {
    let shape = Shape::Straight { length: LENGTH, direction: [1.0, 0.0, 0.0] };
    let mut material = Material::new(DENSITY, modulus);
    material.poisson_ratio = Some(0.4);
    let mut scene = Scene::new(10, shape, Section::Circle { radius: RADIUS }, material);
    scene.supports.start = Support::Free;
    scene.loads.gravity = [0.0, -GRAVITY, 0.0];
    scene.contacts = vec![contact];
    let scheme = Scheme::GeneralisedAlpha;
    scene.time = Some(Time { scheme, ..Time::new(end, step) });
    scene
}

/// Runs a scene with its energies, and returns the forces of all obstacles after every step.
fn run(scene: &Scene) -> (Trajectory, Vec<Vec<[f64; 3]>>) {
    let problem = scene.problem().unwrap();
    let nodes: Vec<usize> = (0..problem.nodes()).collect();
    let run = Trajectory::new(&problem, &nodes, &[]).unwrap();
    let (mut run, mut forces) = (run.keep_energies().keep_reactions(), Vec::new());
    let steps = problem.time().unwrap().steps();
    run.run(&problem, steps, |now| forces.push(now.contact_forces())).unwrap();
    (run, forces)
}

/// A lift at constant speed carries a rod: it weighs as much as at rest, and its motion in the lift is that of one at rest.
#[test]
fn rod_on_a_rising_floor_weighs_as_much_as_at_rest() {
    let speed = [0.0, 0.3, 0.0];
    let mut scene = rod(1e9, floor(20.0, 0.0, at_speed(speed)), [0.1, 2e-4]);
    scene.initial.velocity = speed;
    let (run, forces) = run(&scene);
    let [x, y, _] = forces.last().unwrap()[0];
    let weight = mass() * GRAVITY;
    println!("force over weight {:.8}, along the floor {x:e}", y / weight);
    assert!((y / weight - 1.0).abs() < 1e-3 && x.abs() < 1e-12 * weight);
    // The overlap at rest is the one that carries the weight.
    let overlap = 0.3 * 0.1 - run.node(5, 500)[1];
    let expected = (weight / LENGTH / 1e9).sqrt();
    assert!((overlap / expected - 1.0).abs() < 1e-3, "{overlap:e} {expected:e}");
}

/// A belt drags a rod with mu N until it moves with the belt; its work is twice the kinetic energy, half of it is dissipated.
#[test]
fn belt_drags_a_rod_with_coulombs_friction_until_it_moves_along() {
    let (speed, friction) = (0.5, 0.3);
    let scene = rod(1e9, floor(20.0, friction, at_speed([speed, 0.0, 0.0])), [0.3, 2e-4]);
    let (run, forces) = run(&scene);
    let v = |t: f64| run.velocity(5, (t / 2e-4).round() as usize)[0];
    let acceleration = (v(0.12) - v(0.06)) / 0.06 / (friction * GRAVITY);
    println!("acceleration {acceleration:.6} of mu g, at last {:.6} of the belt", v(0.3) / speed);
    assert!((acceleration - 1.0).abs() < 1e-3);
    let [x, y, _] = forces[500][0];
    assert!((x / y / friction - 1.0).abs() < 1e-6, "{x} {y}");
    // Without a force along the belt nothing creeps at last: the difference decays.
    assert!((v(0.3) / speed - 1.0).abs() < 1e-4, "{}", v(0.3));
    let energies = run.energies().last().unwrap();
    let work = -energies.potential / (mass() * speed * speed);
    println!("work over m v^2 {work:.5}");
    assert!((work - 1.0).abs() < 5e-3, "{work}");
}

/// Obstacles, rod and start at one constant velocity: the motion is that at rest, carried along.
#[test]
fn constant_velocity_of_a_whole_scene_does_not_change_the_relative_motion() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for dimension in [Dimension::Auto, Dimension::Spatial] {
            let z = if dimension == Dimension::Auto { 0.0 } else { 0.3 };
            let carried = [0.7, -0.4, z];
            let contacts = |motion: Vec<ObstacleMotion>| {
                let plane = Contact::plane([0.0, -0.03, 0.0], [0.0, 1.0, 0.0]);
                let plane = plane.damping(5.0).friction(0.4).motion(motion.clone());
                let ball = Contact::sphere([0.15, -0.016, 0.0], 0.01);
                let ball = ball.damping(1.0).friction(0.2).motion(motion);
                vec![plane.stiffness(1e9), ball.stiffness(1e9)]
            };
            let mut still = rod(1e7, floor(0.0, 0.0, ObstacleMotion::default()), [0.1, 2e-4]);
            still.contacts = contacts(Vec::new());
            still.rod.dimension = dimension;
            still.loads.damping.stiffness = 1e-3;
            let time = still.time.as_mut().unwrap();
            (time.scheme, time.beta, time.tolerance) = (scheme, 0.6, StepTolerance::Rounding);
            let mut moved = still.clone();
            moved.contacts = contacts(vec![at_speed(carried)]);
            moved.initial.velocity = carried;
            let ((still, at_rest), (moved, carried_forces)) = (run(&still), run(&moved));
            let (mut off, mut touching) = (0.0_f64, [0; 2]);
            for k in 0..=500 {
                let t = still.times()[k];
                for i in 0..11 {
                    let x: [f64; 3] = std::array::from_fn(|c| moved.node(i, k)[c] - carried[c] * t);
                    off = off.max(distance(x, still.node(i, k)));
                }
                for j in 0..2 {
                    let [a, b] = [at_rest[k][j], carried_forces[k][j]];
                    touching[j] += usize::from(a[1] != 0.0);
                    assert!(distance(a, b) < 1e-6 * (a[1].abs() + 1e-2), "{k}: {a:?} {b:?}");
                }
            }
            println!("{scheme:?}, {dimension:?}: {off:.1e} m, steps in contact {touching:?}");
            assert!(off < 1e-9 * LENGTH && touching.iter().all(|count| *count > 20));
            // The balance of energy closes as in the fixed frame: kinetic energies differ by momentum and work.
            let change = |run: &Trajectory| {
                let [first, last] = [0, 500].map(|k| run.energies()[k].total());
                last - first
            };
            println!("changes of energy: {:.4e} and {:.4e} J", change(&still), change(&moved));
            let scale = still.energies().iter().map(|e| e.kinetic).fold(0.0, f64::max);
            assert!((change(&still) - change(&moved)).abs() < 0.02 * scale, "{scale:e}");
        }
    }
}

/// A piston without losses throws a rod: the energy of the rod less the work of the piston is constant, to second order.
#[test]
fn work_of_an_obstacle_without_losses_closes_the_balance_to_second_order() {
    let motion = ObstacleMotion {
        displacement: [0.0, 0.004, 0.0],
        frequency: Some(8.0),
        ..ObstacleMotion::default()
    };
    let mut found = Vec::new();
    for step in [4e-5, 2e-5, 1e-5] {
        let mut scene = rod(1e9, floor(0.0, 0.0, motion.clone()), [0.12, step]);
        scene.time.as_mut().unwrap().rho_inf = 1.0;
        let (run, _) = run(&scene);
        let totals: Vec<f64> = run.energies().iter().map(|e| e.total()).collect();
        let kinetic = run.energies().iter().map(|e| e.kinetic).fold(0.0, f64::max);
        let off = totals.iter().map(|e| (e - totals[0]).abs()).fold(0.0, f64::max) / kinetic;
        println!("{step:e} s: balance within {off:.2e} of the kinetic energy, {kinetic:.2e} J");
        found.push(off);
    }
    assert!(found[2] < 1e-3, "{found:?}");
    assert!(found[0] / found[2] > 8.0, "{found:?}");
}

/// A recording of a constant velocity moves the obstacle as that velocity does, and a sine as its frequency.
#[test]
fn recorded_motion_of_an_obstacle_equals_the_formula() {
    let times: Vec<f64> = (0..=400).map(|k| k as f64 * 5e-4).collect();
    let track = |x: &dyn Fn(f64) -> [f64; 3]| {
        let seen = times.iter().map(|t| Some(x(*t))).collect();
        Some(Arc::new(Track::new(times.clone(), vec![("m".into(), seen)]).unwrap()))
    };
    let (speed, amplitude) = (0.2, 0.002);
    let line = track(&|t| [0.3 + speed * t, 1.0, 0.0]);
    let sine = track(&|t| [0.0, amplitude * (TAU * 4.0 * t).sin(), 0.0]);
    let cases = [
        (line, at_speed([speed, 0.0, 0.0]), 1e-10),
        (
            sine,
            ObstacleMotion {
                displacement: [0.0, amplitude, 0.0],
                frequency: Some(4.0),
                ..ObstacleMotion::default()
            },
            1e-5,
        ),
    ];
    for (track, formula, bound) in cases {
        let recorded = ObstacleMotion { track, ..ObstacleMotion::default() };
        let [a, b] = [recorded, formula].map(|motion| {
            let (run, _) = run(&rod(1e9, floor(20.0, 0.3, motion), [0.15, 2e-4]));
            run.node(5, 750)
        });
        println!("{a:?} {b:?}");
        assert!(distance(a, b) < bound, "{}", distance(a, b));
        assert!(distance(a, [LENGTH / 2.0, 0.0, 0.0]) > 1e-3);
    }
}

/// A floor that rises slowly against a clamped rod: support and floor carry the weight, in the middle and at the end.
#[test]
fn support_and_moved_floor_carry_the_weight() {
    let motion = ObstacleMotion {
        displacement: [0.0, 0.008, 0.0],
        ramp: Some(1.0),
        ..ObstacleMotion::default()
    };
    let mut scene = rod(1e8, floor(20.0, 0.0, motion), [1.2, 1e-3]);
    if let Contact::Plane { point, .. } = &mut scene.contacts[0] {
        // The rod sags by 23 mm without a floor.
        point[1] = -0.02 - RADIUS;
    }
    scene.supports.start = Support::Clamped;
    scene.initial.state = InitialState::Equilibrium;
    scene.loads.damping = Damping { stiffness: 5e-3, ..Damping::default() };
    let (run, forces) = run(&scene);
    let weight = mass() * GRAVITY;
    let mut before = 0.0;
    for k in [0, 600, 1200] {
        let [support, floor] = [run.reactions()[k].start.force[1], forces[k][0][1]];
        println!("support {support:.5}, floor {floor:.5}, weight {weight:.5} N");
        assert!(((support + floor) / weight - 1.0).abs() < 1e-3, "{k}");
        assert!(floor > 1.1 * before && floor > 0.01 * weight, "{k}");
        before = floor;
    }
}

/// Equilibria and modes have the obstacles of t = 0.
#[test]
fn equilibrium_has_the_obstacles_of_the_start() {
    let tips = [at_speed([0.0, 0.3, 0.0]), ObstacleMotion::default()].map(|motion| {
        let mut scene = rod(1e7, floor(0.0, 0.0, motion), [0.1, 2e-4]);
        scene.supports.start = Support::Clamped;
        scene.loads.at_time = 0.05;
        scene.problem().unwrap().equilibrium().unwrap().tip
    });
    assert_eq!(tips[0], tips[1]);
}

/// Schemes whose stages are within a step, displacements from the start on and double formulas are rejected with the key.
#[test]
fn unsupported_motions_of_obstacles_are_rejected() {
    let shifted = ObstacleMotion { displacement: [0.0, 0.1, 0.0], ..ObstacleMotion::default() };
    let both = ObstacleMotion { ramp: Some(0.1), frequency: Some(1.0), ..shifted.clone() };
    let fast = ObstacleMotion { frequency: Some(4000.0), ..shifted.clone() };
    let moving = at_speed([0.0, 0.1, 0.0]);
    let average = Scheme::AverageVectorField;
    let cases = [
        (moving, average, "contacts[0].motion: found"),
        (shifted, Scheme::GeneralisedAlpha, "contacts[0].motion[0].displacement: found"),
        (both, Scheme::GeneralisedAlpha, "contacts[0].motion[0].frequency: found"),
        (fast, Scheme::GeneralisedAlpha, "contacts[0].motion[0].frequency: found"),
    ];
    for (motion, scheme, part) in cases {
        let mut scene = rod(1e9, floor(0.0, 0.0, motion), [0.1, 2e-4]);
        scene.time.as_mut().unwrap().scheme = scheme;
        let message =
            scene.problem().and_then(|problem| problem.simulate()).unwrap_err().to_string();
        println!("{message}");
        assert!(message.contains(part), "{message}");
    }
}

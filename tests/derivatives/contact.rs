//! Derivatives of motions and equilibria in contact by every number of the scene: against dual numbers and differences.

use rodfit::check::{Tolerance, check_problem};
use rodfit::scene::*;
use rodfit::{Parameter, Problem};

use crate::common::differences::{at_rest, difference};
use crate::recorded::check;

/// Rounding error of positions, m.
const ROUNDING: f64 = 4e-15;
/// Step of the motions, s, in which no step is halved.
const STEP: f64 = 2.5e-4;

/// A clamped rod with weight above an inclined floor and two round obstacles, which it reaches in the motion, or at rest.
fn scene(planar: bool, scheme: Scheme) -> Scene {
    let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
    let mut material = Material::new(1200.0, 2e6);
    material.poisson_ratio = Some(0.35);
    let radius = 0.005;
    let mut scene = Scene::new(7, shape, Section::Circle { radius }, material);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    let z = if planar { 0.0 } else { 1.0 };
    scene.loads.gravity = [0.0, -9.8, 0.5 * z];
    scene.loads.damping.stiffness = 1e-3;
    scene.initial.velocity = [0.0, -1.0, 0.1 * z];
    let stiffness = 3e8;
    let round = match planar {
        true => Contact::cylinder([0.2, -0.0265, 0.03], [0.0, 0.0, 2.0], 0.02),
        // The rod lies beside its cylinder and its first end.
        false => Contact::capsule([[0.17, -0.0265, -0.01], [0.27, -0.028, 0.05]], 0.02),
    };
    scene.contacts = vec![
        Contact::plane([0.1, -0.0075, 0.0], [0.02, 1.3, 0.1 * z]),
        Contact::sphere([0.34, -0.036, 0.01 * z], 0.03).stiffness(stiffness).contact_radius(0.0045),
        round.stiffness(stiffness),
    ];
    scene.time = Some(Time { scheme, beta: 0.6, rho_inf: 0.4, ..Time::new(6e-3, STEP) });
    scene
}

/// Adds damping and friction to all contacts.
fn with_losses(mut scene: Scene) -> Scene {
    let with_losses = |(i, contact): (usize, Contact)| {
        let number = 1.0 + 0.2 * i as f64;
        contact.damping(0.4 * number).friction(0.3 * number).slip_velocity(0.05 * number)
    };
    scene.contacts = scene.contacts.into_iter().enumerate().map(with_losses).collect();
    scene
}

/// The parameters of contacts, and the modulus.
fn own(problem: &Problem) -> Vec<Parameter> {
    let is_own = |p: &Parameter| p.path().starts_with("contacts") || p.path().contains("modulus");
    let all = Parameter::all(problem.scene()).into_iter().filter(is_own);
    all.filter(|p| problem.check_parameter(*p).is_ok()).collect()
}

/// Compares `exact(k)`, the derivatives of positions by parameter `k`, with differences in steps of the part `little` of its
/// value.
fn compare(
    problem: &Problem,
    parameters: &[Parameter],
    little: f64,
    exact: impl Fn(usize) -> Vec<f64>,
    positions: impl Fn(&Problem) -> Vec<f64> + Copy,
) {
    let mut moved = 0;
    for (k, parameter) in parameters.iter().enumerate() {
        let value = parameter.of(problem.scene()).unwrap().abs();
        let h = little * if value == 0.0 { 1e-2 } else { value };
        let numbers = difference(problem, *parameter, h, positions);
        let exact = exact(k);
        let size = exact.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let pairs = exact.iter().zip(&numbers);
        let off = pairs.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
        println!("{parameter}: {size:.1e}, differences {:.1e}", off / size);
        // Positions have rounding errors, which differences divide by the step.
        let rounding = ROUNDING / h;
        moved += usize::from(1e-6 * size > rounding);
        assert!(off < 1e-6 * size + rounding, "{parameter}: {off:e} {size:e}");
    }
    assert!(moved >= 5, "{moved}");
}

#[test]
fn derivatives_of_motions_in_contact_equal_those_in_dual_numbers_and_differences() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField] {
        for planar in [true, false] {
            let problem = scene(planar, scheme).problem().unwrap();
            println!("{scheme:?}, planar: {planar}");
            assert_eq!(problem.planar().is_some(), planar, "{:?}", problem.model());
            // In steps of the differences of all numbers the rod touches an obstacle earlier or later.
            let checked = check(&problem, false);
            assert!(checked >= 20, "{checked}");
            let own = own(&problem);
            let run = problem.simulate_with(&own).unwrap();
            // Runs in dual numbers do not halve steps.
            assert_eq!(run.work().steps, 24);
            let end = problem.scene().time.as_ref().unwrap().end;
            let exact = |k: usize| -> Vec<f64> {
                let rates = |i| run.at(Point::Node(i), end).unwrap().1[k];
                (0..problem.nodes()).flat_map(rates).collect()
            };
            let positions = |problem: &Problem| {
                let run = problem.simulate_with(&[]).unwrap();
                let place = |i| run.at(Point::Node(i), end).unwrap().0;
                (0..problem.nodes()).flat_map(place).collect::<Vec<f64>>()
            };
            compare(&problem, &own, 1e-5, exact, positions);
        }
    }
}

#[test]
fn derivatives_of_equilibria_in_contact_equal_differences() {
    for planar in [true, false] {
        let mut scene = scene(planar, Scheme::NewmarkBeta);
        (scene.time, scene.initial) = (None, Initial::default());
        let problem = scene.problem().unwrap();
        let own = own(&problem);
        assert!(own.len() >= 10, "{own:?}");
        let run = at_rest(&problem, &own);
        let exact = |k: usize| -> Vec<f64> {
            let rates = |i| run.at(Point::Node(i), 0.0).unwrap().1[k];
            (0..problem.nodes()).flat_map(rates).collect()
        };
        let positions = |problem: &Problem| {
            let run = at_rest(problem, &[]);
            (0..problem.nodes()).flat_map(|i| run.node(i, 0)).collect::<Vec<f64>>()
        };
        compare(&problem, &own, 1e-4, exact, positions);
    }
}

/// With damping and friction the steps are made in dual numbers.
#[test]
fn derivatives_of_motions_with_damping_and_friction_equal_differences() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for planar in [true, false] {
            let mut scene = with_losses(scene(planar, scheme));
            // Differences need solutions to rounding.
            scene.time.as_mut().unwrap().tolerance = StepTolerance::Rounding;
            let problem = scene.problem().unwrap();
            println!("{scheme:?}, planar: {planar}");
            let own = own(&problem);
            let losses = ["damping", "friction", "slip_velocity"];
            let count = own.iter().filter(|p| losses.iter().any(|name| p.path().ends_with(name)));
            assert_eq!(count.count(), 9);
            compare_final_positions(&problem, &own);
        }
    }
}

/// Compares the derivatives of all final positions by the parameters `own` with differences. The forces have kinks, at the
/// slip velocity and where they would pull: the error of a difference across one is proportional to its step.
fn compare_final_positions(problem: &Problem, own: &[Parameter]) {
    let run = problem.simulate_with(own).unwrap();
    let end = problem.scene().time.as_ref().unwrap().end;
    let exact = |k: usize| -> Vec<f64> {
        let rates = |i| run.at(Point::Node(i), end).unwrap().1[k];
        (0..problem.nodes()).flat_map(rates).collect()
    };
    let positions = |problem: &Problem| {
        let run = problem.simulate_with(&[]).unwrap();
        let place = |i| run.at(Point::Node(i), end).unwrap().0;
        (0..problem.nodes()).flat_map(place).collect::<Vec<f64>>()
    };
    println!("{} steps", run.work().steps);
    compare(problem, own, 3e-6, exact, positions);
}

/// The same obstacles, each with a motion.
fn with_motions(mut scene: Scene, planar: bool) -> Scene {
    let z = if planar { 0.0 } else { 0.02 };
    for (i, contact) in scene.contacts.iter_mut().enumerate() {
        let number = 1.0 + 0.2 * i as f64;
        let (ramp, frequency) = if i == 1 { (None, Some(20.0)) } else { (Some(0.02), None) };
        let own = ObstacleMotion {
            velocity: [0.3, 0.05 * number, z],
            displacement: [0.002 * number, 0.001, 0.5 * z],
            ramp,
            frequency,
            ..ObstacleMotion::default()
        };
        match contact {
            Contact::Plane { motion, .. }
            | Contact::Sphere { motion, .. }
            | Contact::Cylinder { motion, .. }
            | Contact::Capsule { motion, .. } => *motion = vec![own],
        }
    }
    scene
}

/// With moved obstacles the steps are made in dual numbers; velocity, displacement, ramp and frequency are parameters.
#[test]
fn derivatives_of_motions_with_moved_obstacles_equal_differences() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for (planar, losses) in [(true, true), (false, true), (true, false)] {
            let mut scene = with_motions(scene(planar, scheme), planar);
            if losses {
                scene = with_losses(scene);
            }
            scene.time.as_mut().unwrap().tolerance = StepTolerance::Rounding;
            let problem = scene.problem().unwrap();
            println!("{scheme:?}, planar: {planar}, losses: {losses}");
            let own = own(&problem);
            let moving = own.iter().filter(|p| p.path().contains(".motion."));
            assert_eq!(moving.count(), if planar { 15 } else { 21 });
            compare_final_positions(&problem, &own);
        }
    }
}

/// `rodfit check` compares all elements but contacts, in states of the motion in contact.
#[test]
fn check_of_a_scene_with_contacts_agrees() {
    for planar in [true, false] {
        let problem = scene(planar, Scheme::NewmarkBeta).problem().unwrap();
        let report = check_problem(&problem, Tolerance::default()).unwrap();
        assert!(report.passed(), "{report}");
    }
}

/// The adjoint does not take contacts; the error has their key.
#[test]
fn adjoint_rejects_contacts() {
    let problem = scene(true, Scheme::NewmarkBeta).problem().unwrap();
    let message = problem.check_reversible().unwrap_err().to_string();
    assert!(message.contains("contacts: found"), "{message}");
}

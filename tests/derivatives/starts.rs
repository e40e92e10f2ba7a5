//! Sensitivities to how the motion starts: from an equilibrium, or with a velocity.

use nalgebra::Vector3;
use rodfit::scene::{Clamp, InitialState, Scene, Scheme, Shape, Support, Time};
use rodfit::{Derivatives, Fit, Parameter, Point};

use crate::common::fits::observe;
use crate::common::{at_tip, cantilever_with, coarse, helix_with};
use crate::motion::{LARGEST, difference, mismatch, rich_scene};

/// Plucked and released: the start depends on the parameters too.
#[test]
fn derivatives_from_an_equilibrium_equal_differences() {
    let pluck = |mut scene: Scene, force: [f64; 3]| {
        scene.initial.state = InitialState::Equilibrium;
        scene.initial.point = at_tip(force);
        scene
    };
    let mut damped = rich_scene();
    damped.loads.point.clear();
    let scenes = [
        ("cantilever", pluck(cantilever_with(0.6, 2e-3, 0.3, Clamp::MidEdge), [0.0, 0.8, 0.0])),
        ("damped arc", pluck(damped, [0.1, -0.2, 0.0])),
        ("helix", pluck(helix_with(0.5, 2e-3, 0.2, Clamp::MidEdge), [0.1, 0.0, -0.1])),
    ];
    for (name, scene) in scenes {
        for parameter in [Parameter::YoungsModulus, Parameter::Density, Parameter::Radius] {
            let error = mismatch(&scene, parameter, Derivatives::Hand);
            println!("{name}, {parameter}: {error:.1e}");
            assert!(error < LARGEST, "{name}, {parameter}: {error:e}");
        }
        // And the start itself, against a difference of two equilibria.
        let problem = scene.problem().unwrap();
        let run = problem.simulate_with(&[Parameter::YoungsModulus]).unwrap();
        let e = scene.material.youngs_modulus;
        let tip = |factor: f64| {
            let other = problem.with([(Parameter::YoungsModulus, e * factor)]).unwrap();
            Vector3::from(other.simulate().unwrap().at(Point::Tip, 0.0).unwrap().0)
        };
        let difference = (tip(1.0 + 1e-4) - tip(1.0 - 1e-4)) / (2e-4 * e);
        let exact = Vector3::from(run.at(Point::Tip, 0.0).unwrap().1[0]);
        assert!((difference - exact).norm() < 1e-5 * exact.norm(), "{name}: {difference} {exact}");
    }
}

/// Where every node of a free rod is follows its velocity at t = 0 as t, and the angular velocity as
/// t times the arm from the centre of mass, exactly at zero.
#[test]
fn derivatives_of_thrown_rods_follow_rigid_motion() {
    let planar = |direction: [f64; 3]| {
        let mut scene = coarse(12, 1e-3, 0.2);
        scene.rod.shape = Shape::Straight { length: 0.5, direction };
        scene
    };
    let mut helix = helix_with(0.5, 1e-3, 0.2, Clamp::MidEdge);
    helix.rod.segments = Some(16);
    let velocities =
        [Parameter::InitialVelocityX, Parameter::InitialVelocityY, Parameter::InitialVelocityZ];
    let spins = [
        Parameter::InitialAngularVelocityX,
        Parameter::InitialAngularVelocityY,
        Parameter::InitialAngularVelocityZ,
    ];
    for (mut scene, velocities, spins) in [
        (planar([0.6, 0.8, 0.0]), &velocities[..2], &spins[2..]),
        (helix, &velocities[..], &spins[..]),
    ] {
        scene.supports.start = Support::Free;
        let problem = scene.problem().unwrap();
        let all: Vec<Parameter> = velocities.iter().chain(spins).copied().collect();
        let run = problem.simulate_with(&all).unwrap();
        let last = run.times().len() - 1;
        let (n, t) = (problem.nodes(), run.times()[last]);
        let place = |i: usize| Vector3::from(run.node(i, 0));
        // Masses of the outer nodes are half.
        let ends = (place(0) + place(n - 1)) * 0.5;
        let centre = ((1..n - 1).map(place).sum::<Vector3<f64>>() + ends) / (n - 1) as f64;
        for node in [0, 5, n - 1] {
            let (_, by) = run.at(Point::Node(node), t).unwrap();
            for (parameter, found) in all.iter().zip(by) {
                let axis = |of: &[Parameter]| of.iter().position(|p| p == parameter);
                let exact = match (axis(velocities), axis(spins)) {
                    (Some(c), _) => Vector3::ith(c, t),
                    (_, Some(c)) => {
                        // About the plane's normal, which is the only one left, or about x, y, z.
                        let c = if spins.len() == 1 { 2 } else { c };
                        Vector3::ith(c, t).cross(&(place(node) - centre))
                    }
                    _ => unreachable!(),
                };
                let off = (Vector3::from(found) - exact).norm();
                assert!(off < 1e-9 * t, "{parameter}, node {node}: {found:?} {exact}");
            }
        }
    }
}

/// Velocities at t = 0 of held and damped rods, from rest and in motion, by every kind of scheme;
/// against simulations in dual numbers, and against differences.
#[test]
fn derivatives_by_initial_velocities_equal_dual_numbers_and_differences() {
    let mut arc = rich_scene();
    arc.rod.segments = Some(16);
    arc.time = Some(Time { beta: 0.6, ..Time::new(0.1, 2e-3) });
    let mut moving = arc.clone();
    moving.initial.velocity = [0.3, -0.4, 0.0];
    moving.initial.angular_velocity = [0.0, 0.0, 2.0];
    moving.supports.start = Support::Pinned;
    let mut turned = moving.clone();
    turned.loads.point.clear();
    let mut helix = helix_with(0.6, 2e-3, 0.1, Clamp::MidEdge);
    helix.rod.segments = Some(16);
    helix.loads.damping = arc.loads.damping.clone();
    let mut spinning = helix.clone();
    spinning.initial.state = InitialState::Equilibrium;
    spinning.initial.angular_velocity = [1.0, -2.0, 3.0];
    let scheme = |mut scene: Scene, scheme: Scheme, step: f64| {
        scene.loads.damping.stiffness = 0.0;
        scene.time = Some(Time { scheme, ..Time::new(0.1, step) });
        scene
    };
    let plane = [
        Parameter::InitialVelocityX,
        Parameter::InitialVelocityY,
        Parameter::InitialAngularVelocityZ,
    ];
    let mut averaged = moving.clone();
    averaged.time.as_mut().unwrap().scheme = Scheme::AverageVectorField;
    let scenes = [
        ("arc", arc.clone(), plane.to_vec()),
        (
            "moving arc",
            moving.clone(),
            [&plane[..], &[Parameter::YoungsModulus, Parameter::DampingMass]].concat(),
        ),
        ("turned arc", turned, vec![Parameter::ClampAngle, Parameter::InitialVelocityX]),
        ("averaged", averaged, plane.to_vec()),
        ("helix", helix, vec![Parameter::InitialVelocityZ, Parameter::InitialAngularVelocityX]),
        (
            "spinning helix",
            spinning,
            vec![
                Parameter::InitialVelocityX,
                Parameter::InitialAngularVelocityZ,
                Parameter::YoungsModulus,
                Parameter::DampingStiffness,
            ],
        ),
        ("verlet", scheme(arc.clone(), Scheme::Verlet, 1e-4), plane.to_vec()),
        ("rodas4", scheme(moving, Scheme::Rodas4, 1e-3), plane.to_vec()),
    ];
    for (name, scene, parameters) in scenes {
        for parameter in parameters {
            let dual = mismatch(&scene, parameter, Derivatives::Hand);
            let difference = difference(&scene, parameter);
            println!("{name}, {parameter}: {dual:.1e}, {difference:.1e}");
            assert!(dual < LARGEST, "{name}, {parameter}: {dual:e}");
            assert!(difference < 1e-7, "{name}, {parameter}: {difference:e}");
        }
    }
}

/// A planar model has no velocities out of its plane; it says so, and a spatial one has them.
#[test]
fn velocity_out_of_the_plane_makes_the_model_spatial() {
    let mut scene = cantilever_with(0.5, 1e-3, 0.01, Clamp::MidEdge);
    scene.material.poisson_ratio = Some(0.3);
    let problem = scene.problem().unwrap();
    for parameter in [
        Parameter::InitialVelocityZ,
        Parameter::InitialAngularVelocityX,
        Parameter::InitialAngularVelocityY,
    ] {
        let refused = problem.simulate_with(&[parameter]).unwrap_err().to_string();
        assert!(refused.contains("rod.dimension"), "{refused}");
        // With such a velocity it is another scene, which moves in space.
        assert!(problem.with([(parameter, 0.1)]).unwrap().planar().is_none());
    }
    let moved = problem.with([(Parameter::InitialVelocityY, 0.1)]).unwrap();
    assert!(
        moved
            .simulate_with(&[Parameter::InitialVelocityY, Parameter::InitialAngularVelocityZ])
            .is_ok()
    );
    scene.rod.dimension = rodfit::scene::Dimension::Spatial;
    let spatial = scene.problem().unwrap();
    assert!(
        spatial
            .simulate_with(&[Parameter::InitialVelocityZ, Parameter::InitialAngularVelocityX])
            .is_ok()
    );
    assert!(
        spatial.simulate_with(&[Parameter::ClampAngle]).is_err(),
        "a spatial rod is not turned"
    );
    scene.time = None;
    assert!(Parameter::InitialVelocityX.of(&scene).is_none());
}

/// A fit finds how fast a rod began to move, from a scene in which it does not.
#[test]
fn fit_recovers_the_initial_velocity() {
    let mut scene = coarse(20, 2e-3, 0.3);
    let still = scene.problem().unwrap();
    scene.initial.velocity = [0.0, 0.7, 0.0];
    scene.initial.angular_velocity = [0.0, 0.0, -2.0];
    let fit = Fit::new(&still).observe(observe(&scene, 60));
    let fit = fit
        .identify(Parameter::InitialVelocityY)
        .identify(Parameter::InitialAngularVelocityZ)
        .solve()
        .unwrap();
    for ((parameter, found), truth) in fit.parameters().iter().zip([0.7, -2.0]) {
        println!("{parameter}: {found}");
        assert!((found - truth).abs() < 1e-6, "{parameter}: {found}");
    }
}

/// A rod that nothing holds, or a pin without weight, rests wherever it begins: at rest, and in a motion that begins there.
#[test]
fn derivatives_of_rods_without_restraint_follow_the_initial_shape() {
    let shapes = [
        ("arc", Shape::Arc { length: 0.5, angle: 1.0 }),
        ("straight", Shape::Straight { length: 0.5, direction: [1.0, 0.3, 0.0] }),
    ];
    for ((name, shape), support) in shapes
        .iter()
        .flat_map(|shape| [Support::Free, Support::Pinned].map(|support| (shape, support)))
    {
        let mut scene = coarse(10, 1e-3, 0.1);
        scene.rod.shape = shape.clone();
        scene.supports.start = support;
        scene.loads.gravity = [0.0; 3];
        scene.initial.state = InitialState::Equilibrium;
        scene.initial.velocity = [0.1, 0.2, 0.0];
        let problem = scene.problem().unwrap();
        let turned: Parameter = "supports.angle".parse().unwrap();
        let length: Parameter = "rod.shape.length".parse().unwrap();
        for parameter in [turned, length] {
            let of = |run: &rodfit::Trajectory| {
                let places = [Point::Node(2), Point::Tip]
                    .map(|point| run.at(point, run.times()[run.times().len() - 1]));
                places.map(|place| place.unwrap())
            };
            let all: Vec<usize> = (0..problem.nodes()).collect();
            let motion = of(&problem.simulate_with(&[parameter]).unwrap());
            let rest = of(&rodfit::Trajectory::at_rest(&problem, &all, &[parameter]).unwrap());
            let far =
                crate::common::differences::difference(&problem, parameter, 1e-3, |problem| {
                    let moved = of(&problem.simulate().unwrap());
                    let rest = of(&rodfit::Trajectory::at_rest(problem, &all, &[]).unwrap());
                    moved.into_iter().chain(rest).flat_map(|(place, _)| place).collect()
                });
            let exact = motion.into_iter().chain(rest).flat_map(|(_, by)| by[0]);
            for (exact, far) in exact.zip(far) {
                println!("{name}, {support:?}, {parameter}: {exact:.7} {far:.7}");
                assert!(
                    (exact - far).abs() < 3e-6,
                    "{name}, {support:?}, {parameter}: {exact} {far}"
                );
            }
        }
    }
}

//! Rods whose ends go as markers were seen to go: their starts and their motion by every number.

use rodfit::scene::{
    Damping, Drag, End, Friction, Initial, InitialState, Material, Maxwell, Motion, Recorded,
    Scene, Scheme, Section, Shape, StepTolerance, Support, Supports, Time, Track,
};
use rodfit::{Parameter, Problem};

use crate::common::differences::{apart, difference, largest, mismatch_at_rest};
use crate::parameters::{derivative, end, in_duals};

/// Markers of a hanging line between two hands that move, in steps of 10 ms; in the plane z stays 0.
fn track(markers: usize, planar: bool, noise: f64) -> Track {
    let times: Vec<f64> = (0..30).map(|k| 0.01 * f64::from(k)).collect();
    let place = |j: usize, t: f64| {
        let u = j as f64 / (markers - 1) as f64;
        let beside = if planar { 0.0 } else { 0.04 * (3.0 * t + u).sin() };
        let seen = noise * ((j * 7919) as f64 + 311.0 * t).sin();
        let hand = 0.05 * (9.0 * t).sin() * (1.0 - u);
        [0.42 * u + hand, 0.5 * u * (u - 1.0) + 0.03 * (7.0 * t).cos() + seen, beside]
    };
    let seen = (0..markers)
        .map(|j| (format!("{j}"), times.iter().map(|t| Some(place(j, *t))).collect()))
        .collect();
    Track::new(times, seen).unwrap()
}

/// A slightly curved cable of 7 markers, two edges between any two in space.
pub fn scene(planar: bool, scheme: Scheme) -> Scene {
    let points: Vec<[f64; 3]> = (0..7)
        .map(|i| {
            let s = 0.085 * f64::from(i);
            [s, 0.3 * s * s, if planar { 0.0 } else { 0.5 * s * s * s }]
        })
        .collect();
    let shape = Shape::points(points);
    let material = Material { poisson_ratio: Some(0.4), ..Material::new(1100.0, 4e7) };
    let segments = if planar { 6 } else { 12 };
    let mut scene = Scene::new(segments, shape, Section::Circle { radius: 2e-3 }, material);
    scene.rod.natural_curvature = 0.7.into();
    scene.loads.gravity = [0.0, -9.8, if planar { 0.0 } else { 1.0 }];
    scene.loads.damping.mass = 0.4;
    scene.loads.damping.stiffness = 5e-3;
    scene.supports.start = Support::Recorded;
    scene.supports.end = if planar { Support::Free } else { Support::Recorded };
    scene.supports.path = Some(Recorded::of(track(7, planar, 2e-4)));
    scene.initial.state = InitialState::Recorded;
    let rho_inf = if scheme == Scheme::GeneralisedAlpha { 0.4 } else { 0.5 };
    let beta = if scheme == Scheme::NewmarkBeta { 0.7 } else { 0.5 };
    let tolerance = match scheme.traits().parameter {
        Some(_) => StepTolerance::Rounding,
        None => StepTolerance::default(),
    };
    scene.time = Some(Time { scheme, rho_inf, beta, tolerance, ..Time::new(0.06, 5e-3) });
    scene
}

/// What rounding errors leave of a place on half a metre of rod, m.
const ROUNDING: f64 = 2e-14;
/// What they leave of a place by what damps the stretching of edges, m/s: EA = 500 N times the rate of strain that a last
/// digit makes of an edge of 4 cm in a step of 5 ms moves half a gram by this much in the step.
const ROUNDING_OF_RATES: f64 = 1.1e-11;

/// A fluid so fast that no node changes its direction in it, where second derivatives jump.
pub fn stream(planar: bool) -> Drag {
    Drag {
        linear_normal: 0.02,
        linear_tangential: 0.01,
        quadratic_normal: 0.03,
        quadratic_tangential: 0.01,
        fluid_velocity: [6.0, -5.0, if planar { 0.0 } else { 3.0 }],
        fluid_density: 300.0,
        added_mass: 0.003,
    }
}

/// `smooth`: whether a step of a parameter keeps the solution of a step in time that was found.
pub fn check(problem: &Problem, smooth: bool) -> usize {
    let mut checked = 0;
    for parameter in Parameter::all(problem.scene()) {
        if parameter.is_of_the_recording() || problem.check_parameter(parameter).is_err() {
            continue;
        }
        let (exact, dual) = (derivative(problem, parameter), in_duals(problem, parameter));
        let value = parameter.of(problem.scene()).unwrap().abs();
        let size = largest(&dual);
        if size * if value == 0.0 { 1.0 } else { value } < 1e-9 {
            continue;
        }
        let off = apart(&exact, &dual) / size;
        // A rod that hardly stretches is bent much by little of its length, and little by what bends one end of it.
        let little = match parameter.to_string() {
            name if name == "rod.shape.scale" => 2e-5,
            name if name.starts_with("rod.natural_bending") => 2e-3,
            _ => 2e-4,
        };
        let h = little * if value == 0.0 { 1.0 } else { value };
        // Dampings that are not there cannot be less.
        let difference = match parameter.is_positive() && value == 0.0 {
            true => 0.0,
            false => apart(&exact, &difference(problem, parameter, h, end)) / size,
        };
        // Nodes are where they are to rounding.
        let seen = 1e-6_f64.max(ROUNDING / (h * size));
        let tolerance = match parameter.to_string() == "loads.damping.stretching" {
            true => ROUNDING_OF_RATES / size,
            false => ROUNDING / (size * if value == 0.0 { 1.0 } else { value }),
        };
        let tolerance = tolerance.max(1e-9);
        println!("{parameter}: {size:.1e}, off by {off:.1e}, differences {difference:.1e}");
        assert!(
            off < tolerance && (difference < seen || !smooth),
            "{parameter}: {off:e} {difference:e}"
        );
        checked += 1;
    }
    checked
}

#[test]
fn derivatives_with_recorded_ends_equal_differences() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta, Scheme::AverageVectorField] {
        for planar in [true, false] {
            let problem = scene(planar, scheme).problem().unwrap();
            assert_eq!(problem.planar().is_some(), planar, "{}", problem.model().1);
            println!("{scheme:?}, planar: {planar}");
            // Averaged over a step, forces of what is far too fast for it have many roots.
            let smooth = planar || scheme != Scheme::AverageVectorField;
            assert!(check(&problem, smooth) >= 6);
        }
    }
}

/// Hands that hold the rod turned about itself, beyond how it lies between the first markers.
#[test]
fn derivatives_with_twisted_ends_equal_differences() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta] {
        let mut scene = scene(false, scheme);
        let motion = |end, twist| Motion { end, twist, ..Motion::default() };
        scene.supports.motion = vec![motion(End::Start, 0.0), motion(End::End, 0.4)];
        let problem = scene.problem().unwrap();
        assert!(check(&problem, true) >= 8);
        for k in 0..2 {
            let turn = format!("supports.motion.{k}.twist").parse().unwrap();
            assert!(largest(&in_duals(&problem, turn)) > 1e-4);
        }
    }
}

/// The same at rest, and in a run that starts from there.
#[test]
fn derivatives_with_twisted_ends_at_rest_equal_differences() {
    let mut scene = scene(false, Scheme::GeneralisedAlpha);
    let motion = |end, twist| Motion { end, twist, ..Motion::default() };
    scene.supports.motion = vec![motion(End::Start, 0.0), motion(End::End, 0.4)];
    scene.initial.state = InitialState::Equilibrium;
    let problem = scene.problem().unwrap();
    assert!(check(&problem, true) >= 8);
    for k in 0..2 {
        let turn: Parameter = format!("supports.motion.{k}.twist").parse().unwrap();
        assert!(largest(&in_duals(&problem, turn)) > 1e-4);
        let [off, size] = mismatch_at_rest(&problem, turn, 1e-3);
        println!("{turn} at rest: off by {off:.1e} of {size:.1e}");
        assert!(size > 1e-4 && off < 1e-6 * size, "{turn}: {off:e}");
    }
}

/// With springs that slip, and with springs that stick; derivatives by differences where they stick.
#[test]
fn derivatives_with_internal_friction_equal_differences() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta] {
        for planar in [true, false] {
            for (curvature, stiffness) in [(0.05, 0.0), (0.3, 5e-3), (50.0, 5e-3)] {
                let mut scene = scene(planar, scheme);
                scene.loads.damping.stiffness = stiffness;
                if !planar {
                    scene.rod.natural_bending = vec![[0.2, 0.3], [-0.1, 0.5], [-0.4, 0.0]];
                }
                scene.loads.damping.friction = Some(Friction { stiffness: 1.6, curvature });
                if scheme == Scheme::NewmarkBeta {
                    // In steps of 5 ms one of these has two solutions so near each other that rounding decides
                    // which of them a run in dual numbers finds.
                    let time = scene.time.unwrap();
                    scene.time = Some(Time { end: 0.048, step: Some(4e-3), ..time });
                }
                println!("{scheme:?}, planar: {planar}, {curvature} 1/m");
                assert!(check(&scene.problem().unwrap(), curvature > 1.0) >= 6);
            }
        }
    }
}

/// Kelvin-Voigt damping of each kind of strain, from nothing too, and relaxation.
#[test]
fn derivatives_with_viscous_damping_equal_differences() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta, Scheme::AverageVectorField] {
        for planar in [true, false] {
            for (k, [stiffness, bending, twisting, stretching]) in
                [[2e-3, 0.0, 0.0, 0.0], [0.0, 4e-3, 0.0, 2e-3], [2e-3, 1e-3, 2e-3, 3e-3]]
                    .into_iter()
                    .enumerate()
            {
                let mut scene = scene(planar, scheme);
                let damping = &mut scene.loads.damping;
                *damping = Damping { stiffness, bending, twisting, stretching, ..damping.clone() };
                if scheme.traits().takes_friction && k > 0 {
                    damping.maxwell = Maxwell { stiffness: 0.7, time: 0.02 }.into();
                }
                println!("{scheme:?}, planar: {planar}, {k}");
                let smooth = k == 2 && (planar || scheme != Scheme::AverageVectorField);
                assert!(check(&scene.problem().unwrap(), smooth) >= 8);
            }
        }
    }
}

/// A fluid that moves around the rod.
#[test]
fn derivatives_with_drag_equal_differences() {
    for scheme in [Scheme::GeneralisedAlpha, Scheme::NewmarkBeta] {
        for planar in [true, false] {
            for viscous in [true, false] {
                let mut scene = scene(planar, scheme);
                if !viscous {
                    scene.loads.damping = Damping { mass: 0.4, ..Damping::default() };
                    // Without damping of its strains a rod is thrown less.
                    scene.supports = Supports::default();
                    scene.initial = Initial { velocity: [0.0, 0.6, 0.0], ..Initial::default() };
                }
                scene.loads.drag = Some(stream(planar));
                println!("{scheme:?}, planar: {planar}, viscous: {viscous}");
                assert!(check(&scene.problem().unwrap(), true) >= 12);
            }
        }
    }
}

/// Recorded ends hold a rod at rest turned about itself as its section lies where it begins.
#[test]
fn held_edges_rotate_with_the_section_at_rest() {
    let mut scene = scene(false, Scheme::GeneralisedAlpha);
    scene.rod.section = Section::Rectangle { width: 6e-3, height: 4e-3, up: [0.3, -0.4, 0.9] };
    let problem = scene.problem().unwrap();
    for axis in ["x", "y", "z"] {
        let parameter: Parameter = format!("rod.section.up.{axis}").parse().unwrap();
        let [off, size] = mismatch_at_rest(&problem, parameter, 1e-3);
        println!("{axis}: off by {off:.1e} of {size:.1e}");
        assert!(size > 1e-5 && off < 1e-5 * size, "{axis}: {off:e}");
    }
}

/// Held nodes are where the markers are, at every step, also between the frames; and a marker that is
/// followed exactly starts with the velocity it was seen with.
#[test]
fn held_nodes_follow_the_markers() {
    let scene = scene(false, Scheme::GeneralisedAlpha);
    let problem = scene.problem().unwrap();
    let run = problem.simulate().unwrap();
    let track = track(7, false, 2e-4);
    for (k, t) in run.times().iter().enumerate() {
        for (node, marker) in [(0, 0), (2, 1), (10, 5), (12, 6)] {
            let (found, seen) = (run.node(node, k), track.markers()[marker].at(*t));
            assert!((0..3).all(|c| (found[c] - seen[c]).abs() < 1e-15), "{k} {node}");
        }
        let (found, seen) = (run.node(1, k), [0, 1].map(|m| track.markers()[m].at(*t)));
        assert!((0..3).all(|c| (found[c] - 0.5 * (seen[0][c] + seen[1][c])).abs() < 1e-15));
    }
    // Free markers begin near where they were seen, nearer than the rod's length differs.
    for (node, marker) in [(4, 2), (6, 3), (8, 4)] {
        let (found, seen) = (run.node(node, 0), track.markers()[marker].at(0.0));
        let away = (0..3).map(|c| (found[c] - seen[c]).powi(2)).sum::<f64>().sqrt();
        println!("marker {marker} begins {:.2} mm off", 1e3 * away);
        assert!(away < 0.02);
    }
}

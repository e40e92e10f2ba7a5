//! Compliant clamps: deflections and frequencies against beam theory, in the plane and in space.

use rodfit::fit::{Frequencies, Sample};
use rodfit::scene::{Clamp, Dimension, Handedness, InitialState, Material, Scene, Shape};
use rodfit::scene::{Compliance, PointForce, Support, Time};
use rodfit::vibration::{LinearizationPoint, ModeKind};
use rodfit::{Fit, Observation, Parameter, Point, Unknown};
use std::f64::consts::PI;

use crate::common::differences::at_rest;
use crate::common::{at_tip, rest, simulate, straight_rod};

const LENGTH: f64 = 0.5;
const RADIUS: f64 = 5e-3;
const MODULUS: f64 = 1e9;
const DENSITY: f64 = 1000.0;
/// EI, N m^2.
const BENDING: f64 = MODULUS * PI * RADIUS * RADIUS * RADIUS * RADIUS / 4.0;
const BOTH: [Dimension; 2] = [Dimension::Planar, Dimension::Spatial];

/// A weightless rod. The compliance of its clamp is a `part` of the rotation of the rod's tip under a moment.
fn rod(segments: usize, dimension: Dimension, part: f64) -> Scene {
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(DENSITY, MODULUS) };
    let mut scene = straight_rod(segments, [LENGTH, RADIUS], material);
    scene.rod.dimension = dimension;
    scene.supports.start_compliance.rotation = part * LENGTH / BENDING;
    scene
}

fn rotation() -> Parameter {
    "supports.start_compliance.rotation".parse().unwrap()
}

fn named(name: &str) -> Parameter {
    name.parse().unwrap()
}

/// Deflection by a small force at the tip, over that of a rigidly clamped rod.
fn sag(scene: &Scene) -> f64 {
    let force = 1e-5 * BENDING / (LENGTH * LENGTH);
    let mut loaded = scene.clone();
    loaded.loads.point = at_tip([0.0, -force, 0.0]);
    -rest(&loaded).tip[1] / (force * LENGTH.powi(3) / (3.0 * BENDING))
}

/// `P L^3/(3 EI) + c P L^2`: the clamp's part at second order of the mesh, however soft it is.
#[test]
fn compliant_clamp_adds_its_rotation_to_the_tip_deflection() {
    for (dimension, part) in BOTH.into_iter().flat_map(|d| [0.01, 0.1, 1.0].map(|p| (d, p))) {
        let errors = [25, 50, 100].map(|segments| {
            let [soft, rigid] = [part, 0.0].map(|part| sag(&rod(segments, dimension, part)));
            (soft - rigid) / (3.0 * part) - 1.0
        });
        println!("{dimension:?}, {part}: {errors:?}");
        // A joint half an edge from the wall would leave 2 % at 50. Nothing is left: the joint is at the wall.
        // What the rod without the clamp has, with its wall at mid-edge, is of second order.
        let second = [25.0_f64, 50.0, 100.0].map(|n| 0.3 / (part * n * n));
        assert!((0..3).all(|k| errors[k].abs() < second[k] + 1e-6), "{errors:?}");
    }
}

/// The same for a clamp at the other end, for two clamps, and with walls at nodes.
#[test]
fn compliant_clamps_at_both_ends_are_symmetric() {
    let start = rod(40, Dimension::Planar, 0.3);
    let mut end = start.clone();
    end.rod.shape = Shape::Straight { length: LENGTH, direction: [-1.0, 0.0, 0.0] };
    (end.supports.start, end.supports.end) = (Support::Free, Support::Clamped);
    end.supports.end_compliance = std::mem::take(&mut end.supports.start_compliance);
    let force = 1e-4 * BENDING / (LENGTH * LENGTH);
    let moved = |mut scene: Scene, node: Point| {
        scene.loads.point =
            vec![PointForce { node, force: [0.0, -force, 0.0], ..Default::default() }];
        let problem = scene.problem().unwrap();
        let run = at_rest(&problem, &[]);
        run.at(node, 0.0).unwrap().0[1]
    };
    let (a, b) = (moved(start.clone(), Point::Tip), moved(end, Point::Node(0)));
    // Mirror images: rounding errors.
    assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    // A force in the middle of a beam whose clamps give: w = P L^3/192 EI (1 + 8 k)/(1 + 2 k).
    let middle = Point::ArcLength(0.5 * LENGTH);
    let mut both = start;
    both.supports.end = Support::Clamped;
    both.supports.end_compliance = both.supports.start_compliance;
    let found = moved(both.clone(), middle);
    let mut rigid = both;
    rigid.supports.start_compliance = Compliance::default();
    rigid.supports.end_compliance = Compliance::default();
    let factor = found / moved(rigid, middle);
    let k = 0.3;
    let expected = (1.0 + 8.0 * k) / (1.0 + 2.0 * k);
    // Beam on two rotational springs of compliance 0.3 L/EI: `(1 + 8 k)/(1 + 2 k)`, with the error of the mesh.
    assert!((factor / expected - 1.0).abs() < 0.02, "{factor}, expected {expected}");
}

/// Roots of 1 + cos b cosh b = k b (sin b cosh b - cos b sinh b).
#[test]
fn compliant_clamp_frequencies_are_those_of_a_beam_on_a_rotational_spring() {
    let unit = (BENDING / (DENSITY * PI * RADIUS * RADIUS)).sqrt() / (LENGTH * LENGTH);
    for (dimension, k) in BOTH.into_iter().flat_map(|d| [0.02, 0.2, 2.0].map(|k| (d, k))) {
        let equation = |b: f64| {
            let (sin, cos, sinh, cosh) = (b.sin(), b.cos(), b.sinh(), b.cosh());
            1.0 + cos * cosh - k * b * (sin * cosh - cos * sinh)
        };
        let root = |mut low: f64, mut high: f64| {
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if (equation(middle) > 0.0) == (equation(low) > 0.0) {
                    low = middle
                } else {
                    high = middle
                }
            }
            low
        };
        // Between a hinge and a wall.
        for (mode, exact) in [root(0.1, 1.8751), root(3.9266, 4.6941)].into_iter().enumerate() {
            let errors = [25, 50, 100].map(|segments| {
                let scene = rod(segments, dimension, k);
                let found =
                    scene.problem().unwrap().modes(6, LinearizationPoint::Equilibrium).unwrap();
                let bending = found.modes.iter().filter(|m| m.kind == ModeKind::Bending);
                let mut all: Vec<f64> = bending.map(|m| m.frequency_rad_s).collect();
                all.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-6);
                all[mode] / (exact * exact * unit) - 1.0
            });
            println!("{dimension:?}, {k}, mode {mode}: {errors:?}");
            // Second order in the mesh, against the frequency equation.
            assert!(errors[2].abs() < 1e-3 && errors[1].abs() < 4e-3, "{errors:?}");
        }
    }
}

/// A rigid clamp has a derivative by its compliance, from one side.
#[test]
fn rigid_clamp_has_a_one_sided_derivative_by_compliance() {
    for dimension in BOTH {
        let force = 1e-4 * BENDING / (LENGTH * LENGTH);
        let mut scene = rod(100, dimension, 0.0);
        scene.loads.point = at_tip([force, -force, 0.0]);
        let problem = scene.problem().unwrap();
        let parameters = [rotation(), named("supports.start_compliance.axial")];
        let run = at_rest(&problem, &parameters);
        let by = run.at(Point::Tip, 0.0).unwrap().1;
        let (turning, along) = (-by[0][1] / (force * LENGTH * LENGTH), by[1][0] / force);
        // Half an edge from the wall: a lever and a moment shorter by a part of 1/200 each.
        assert!((turning - 0.99).abs() < 1e-3, "{dimension:?}: {turning}");
        assert!((along - 1.0).abs() < 1e-6, "{dimension:?}: {along}");
        // The axial compliance adds its own displacement.
        let mut soft = scene.clone();
        soft.supports.start_compliance.axial = 1e-6;
        let moved = (rest(&soft).tip[0] - rest(&scene).tip[0]) / (1e-6 * force);
        assert!((moved - 1.0).abs() < 1e-4, "{dimension:?}: {moved}");
    }
}

/// The displacement that a compliant clamp adds to a helix does not depend on the mesh.
#[test]
fn compliant_clamp_of_a_helix_does_not_depend_on_the_mesh() {
    let drop = |segments: usize, part: f64| {
        let (axis, handedness) = ([0.0, 0.0, -1.0], Handedness::Left);
        let shape = Shape::Helix { length: LENGTH, radius: 0.02, pitch: 0.05, axis, handedness };
        let mut scene = rod(segments, Dimension::Spatial, part);
        scene.rod.shape = shape;
        scene.loads.point = at_tip([0.0, 0.0, -1e-4]);
        rest(&scene).tip[2]
    };
    let added = [50, 100, 400].map(|n| drop(n, 0.1) - drop(n, 0.0));
    println!("{added:?}");
    // Converging with the mesh: the displacement on 400 segments is the reference.
    assert!((added[0] / added[2] - 1.0).abs() < 0.03 && (added[1] / added[2] - 1.0).abs() < 0.01);
}

/// A released rod with a compliant clamp swings at its own frequency.
#[test]
fn released_rod_with_compliant_clamp_swings_at_its_own_frequency() {
    for dimension in BOTH {
        let period = |part: f64| {
            let mut scene = rod(20, dimension, part);
            let first = scene.problem().unwrap().modes(1, LinearizationPoint::Equilibrium).unwrap();
            let first = first.frequencies_rad_s[0];
            scene.initial.state = InitialState::Equilibrium;
            scene.initial.point = at_tip([0.0, -1e-3 * BENDING / (LENGTH * LENGTH), 0.0]);
            scene.time = Some(Time::new(1.0 / first * PI, 2e-3 / first * PI));
            let run = simulate(&scene);
            let sag = |k: usize| run.at(Point::Tip, run.times()[k]).unwrap().0[1];
            let k = (0..run.times().len()).find(|k| sag(*k) > 0.0).unwrap();
            run.times()[k] * first
        };
        let [rigid, soft] = [0.0, 0.5].map(period);
        // Quarter period of the first mode, pi/2 in phase, up to higher modes.
        assert!((rigid / (0.5 * PI) - 1.0).abs() < 0.02, "{rigid}");
        assert!((soft / (0.5 * PI) - 1.0).abs() < 0.02, "{soft}");
    }
}

/// Frequencies distinguish a compliant clamp from another modulus.
#[test]
fn clamp_compliance_and_modulus_are_identified_from_frequencies() {
    let mut scene = rod(40, Dimension::Planar, 0.05);
    let truth = scene.supports.start_compliance.rotation;
    let modes = scene.problem().unwrap().modes(20, LinearizationPoint::Equilibrium).unwrap();
    let mut found: Vec<f64> = modes.frequencies_rad_s;
    found.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-6);
    let measured = Frequencies::new(&found[..3], 1e-3);
    scene.supports.start_compliance.rotation = 0.0;
    let fit = Fit::new(&scene.problem().unwrap()).observe(measured);
    let report = fit.identify(Parameter::YoungsModulus).identify(rotation()).solve().unwrap();
    println!("{report}");
    let value = |k: usize| report.parameters[k].value.unwrap();
    // Exact frequencies: within the tolerance of the search.
    assert!(
        (value(0) / MODULUS - 1.0).abs() < 1e-5 && (value(1) / truth - 1.0).abs() < 1e-4,
        "{report}"
    );
}

#[test]
fn compliance_without_a_clamp_is_rejected() {
    let message = |change: &dyn Fn(&mut Scene)| {
        let mut scene = rod(10, Dimension::Planar, 0.1);
        change(&mut scene);
        scene.problem().map(|_| ()).unwrap_err().to_string()
    };
    let free = message(&|scene| scene.supports.end_compliance.axial = 1e-6);
    assert!(free.contains("supports.end_compliance.axial") && free.contains("no clamp"), "{free}");
    let negative = message(&|scene| scene.supports.start_compliance.rotation = -1.0);
    assert!(negative.contains("supports.start_compliance.rotation"), "{negative}");
    let problem = rod(10, Dimension::Planar, 0.1).problem().unwrap();
    let refused = problem.check_parameter(named("supports.end_compliance.rotation"));
    assert!(refused.unwrap_err().to_string().contains("of an end without a clamp"));
    let mut nodes = rod(50, Dimension::Planar, 0.1);
    nodes.supports.clamp = Clamp::Nodes;
    nodes.problem().unwrap();
}

/// A rod with a compliant clamp has other edges than a rigidly clamped one. Node indices of a scene with a compliance refer
/// to its own mesh; those of a scene that only identifies it refer to the mesh without it.
#[test]
fn node_indices_refer_to_the_nodes_of_the_scene() {
    for (dimension, part) in BOTH.into_iter().flat_map(|d| [0.0, 0.1].map(|p| (d, p))) {
        let mut scene = rod(10, dimension, part);
        scene.loads.point = at_tip([0.0, -1e-2 * BENDING / (LENGTH * LENGTH), 0.0]);
        let problem = scene.problem().unwrap();
        let (nodes, places) = (rest(&scene).nodes, problem.arc_lengths());
        for (i, (node, s)) in nodes.iter().zip(places).enumerate() {
            // A nearly straight rod: the position of a node is its arc length.
            assert!((node[0] - s).abs() < 1e-4 * LENGTH, "{i}: {node:?} at {s}");
            assert_eq!(problem.arc_length(Point::Node(i)).unwrap(), *s);
        }
        let mut moving = scene.clone();
        moving.time = Some(Time::new(0.02, 1e-3));
        let run = simulate(&moving);
        // Node 3 at 10 ms is recorded step 10.
        assert_eq!(run.at(Point::Node(3), 0.01).unwrap().0, run.node(3, 10));
        let table = rodfit::dynamics::shape_csv(&problem, &nodes).unwrap();
        let last: Vec<f64> =
            table.lines().nth(4).unwrap().split(',').map(|x| x.parse().unwrap()).collect();
        assert_eq!(last[3], places[3]);
    }
}

/// A node of the scene keeps its arc length, whatever value of the compliance is identified.
#[test]
fn fit_of_the_clamp_keeps_the_arc_length_of_nodes() {
    let mut scene = rod(10, Dimension::Planar, 0.0);
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.time = Some(Time::new(0.2, 1e-3));
    let problem = scene.problem().unwrap();
    let place = Point::ArcLength(problem.arc_length(Point::Node(3)).unwrap());
    let mut true_one = scene.clone();
    true_one.supports.start_compliance.rotation = 0.05 * LENGTH / BENDING;
    let run = simulate(&true_one);
    let samples: Vec<Sample> = (1..=40)
        .map(|k| {
            let time = 5e-3 * f64::from(k);
            let (x, _) = run.at(place, time).unwrap();
            Sample { time, position: x.map(Some) }
        })
        .collect();
    let found = [Point::Node(3), place].map(|point| {
        let observation = Observation::new(samples.clone()).at(point).sigma(1e-6);
        let unknown = Unknown::new(rotation()).start(0.02 * LENGTH / BENDING);
        Fit::new(&problem).observe(observation).identify(unknown).solve().unwrap().parameters()[0].1
    });
    let truth = 0.05 * LENGTH / BENDING;
    println!("{found:?} {truth}");
    // The compliance of the simulation.
    assert!(found.iter().all(|found| (found / truth - 1.0).abs() < 1e-4), "{found:?} {truth}");
    // Both definitions of the point give one result.
    assert!((found[0] / found[1] - 1.0).abs() < 1e-9, "{found:?}");
}

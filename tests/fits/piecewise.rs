//! Natural curvature and twist by pieces of the rod: equal pieces are the whole rod, derivatives equal differences, and pieces
//! are identified.

use nalgebra::Vector3;
use rodfit::fit::Sample;
use rodfit::scene::{Clamp, Scene, Shape, StepTolerance};
use rodfit::{Fit, Observation, Parameter, Point, Problem};

use crate::common::differences::{at_rest, difference};
use crate::common::{coarse, helix_with, simulate};

fn curvature_of(piece: usize) -> Parameter {
    format!("natural_curvature.{piece}").parse().unwrap()
}

fn twist_of(piece: usize) -> Parameter {
    format!("natural_twist.{piece}").parse().unwrap()
}

fn arc() -> Scene {
    let mut scene = coarse(21, 2e-3, 0.1);
    scene.rod.shape = Shape::Arc { length: 0.5, angle: 1.5 };
    scene
}

fn helix() -> Scene {
    let mut scene = helix_with(0.5, 2e-3, 0.1, Clamp::MidEdge);
    scene.rod.segments = Some(24);
    scene.rod.natural_twist = 2.0.into();
    scene
}

/// A rod of equal pieces equals the whole rod, and the derivatives by its pieces add up to that by the whole.
#[test]
fn equal_pieces_equal_the_whole_rod() {
    for scene in [arc(), helix()] {
        let mut parts = scene.clone();
        let [curvature, twist] =
            [Parameter::NaturalCurvature, Parameter::NaturalTwist].map(|p| p.of(&scene).unwrap());
        parts.rod.natural_curvature = vec![curvature; 3].into();
        parts.rod.natural_twist = vec![twist; 2].into();
        let spatial = twist != 0.0;
        let (mut whole, mut each) = (vec![Parameter::NaturalCurvature], vec![]);
        each.extend([1, 2, 3].map(curvature_of));
        if spatial {
            whole.push(Parameter::NaturalTwist);
            each.extend([1, 2].map(twist_of));
        }
        let [one, all] = [(&scene, &whole), (&parts, &each)]
            .map(|(scene, by)| scene.problem().unwrap().simulate_with(by).unwrap());
        assert_eq!(one, all);
        let [one, all] = [one, all].map(|run| run.at(Point::Tip, 0.1).unwrap().1);
        let sum = |of: &[[f64; 3]]| of.iter().map(|x| Vector3::from(*x)).sum::<Vector3<f64>>();
        for (one, all) in one.iter().zip([&all[..3], &all[3..]]) {
            let one = Vector3::from(*one);
            // Chain rule: derivatives by the pieces add up; rounding errors.
            assert!((one - sum(all)).norm() < 1e-9 * one.norm(), "{one} {all:?}");
        }
    }
}

/// Without loads every joint has the turning angle of the mean natural curvature over its length.
#[test]
fn joints_have_the_values_of_their_pieces() {
    let mut scene = arc();
    scene.loads.gravity = [0.0; 3];
    scene.rod.natural_curvature = vec![0.5, 1.5, -1.0].into();
    let problem = scene.problem().unwrap();
    let found = problem.equilibrium().unwrap();
    let edge = |i: usize| {
        let [a, b] = [i, i + 1].map(|i| Vector3::from(found.nodes[i]));
        b - a
    };
    let length = 0.5 / 20.5;
    let turn = 1.5 * length / 0.5;
    for i in 0..20 {
        let (e, f) = (edge(i), edge(i + 1));
        let k = 2.0 * (0.5 * e.cross(&f).z.atan2(e.dot(&f))).tan();
        // The joint extends to the middles of its edges, in lengths of pieces; each piece has a part of it.
        let [from, to] = [i, i + 1].map(|k| 3.0 * k as f64 * length / 0.5);
        let part = |k: usize| (to.min(k as f64 + 1.0) - from.max(k as f64)).max(0.0) / (to - from);
        let factor: f64 = [0.5, 1.5, -1.0].iter().enumerate().map(|(k, x)| x * part(k)).sum();
        let exact = factor * 2.0 * (0.5 * turn).tan();
        // Discrete curvature `2 tan(phi/2)` of the piece's factor times the turning angle of the shape.
        assert!((k - exact).abs() < 1e-10, "joint {i}: {k} {exact}");
    }
    // A stress-free shape has no bending energy.
    assert!(found.energies.bend < 1e-18, "{found:?}");
}

/// Derivatives of shapes at rest and in motion against seven-point differences.
#[test]
fn piecewise_derivatives_equal_differences() {
    let mut bent = arc();
    bent.rod.natural_curvature = vec![1.0, 0.8, 1.2].into();
    let mut twisted = helix();
    // At a second factor of 0.7 the motion in these steps jumps by 0.5 mm within the differences, in halves of them it does not.
    twisted.rod.natural_curvature = vec![1.1, 0.75].into();
    twisted.rod.natural_twist = vec![0.0, 3.0, -1.0, 2.0].into();
    for (mut scene, parameters) in [
        (bent, [1, 2, 3].map(curvature_of).to_vec()),
        (twisted, vec![curvature_of(1), curvature_of(2), twist_of(1), twist_of(3)]),
    ] {
        // What a tolerance leaves of a step is no smooth function of the parameters.
        scene.time.as_mut().unwrap().tolerance = StepTolerance::Rounding;
        let problem = scene.problem().unwrap();
        for parameter in parameters {
            let tips = |problem: &Problem| {
                [at_rest(problem, &[]).tip(0), problem.simulate().unwrap().tip(50)].concat()
            };
            let exact = [
                at_rest(&problem, &[parameter]).at(Point::Tip, 0.0).unwrap().1[0],
                problem.simulate_with(&[parameter]).unwrap().at(Point::Tip, 0.1).unwrap().1[0],
            ];
            // What the released curvature sets off along the rod turns through many radians.
            let slopes = difference(&problem, parameter, 1e-4, tips);
            for (j, exact) in exact.iter().enumerate() {
                let slope = Vector3::from_column_slice(&slopes[3 * j..3 * j + 3]);
                let off = (slope - Vector3::from(*exact)).norm() / slope.norm();
                println!("{parameter}, {}: {off:.1e}", ["at rest", "in motion"][j]);
                // Seven-point differences in steps of 1e-4: rounding errors.
                assert!(off < 1e-8, "{parameter}: {slope:?} {exact:?}");
            }
        }
    }
}

#[test]
fn piecewise_scenes_have_numbers_or_lists() {
    let mut scene = arc();
    // A single number is a parameter; entries of a list are others.
    assert_eq!(Parameter::NaturalCurvature.of(&scene), Some(1.0));
    assert_eq!(curvature_of(1).of(&scene), None);
    assert!(!scene.to_toml().unwrap().contains("natural_twist"));
    scene.rod.natural_curvature = vec![1.0, 0.8].into();
    let text = scene.to_toml().unwrap();
    assert!(text.contains("natural_curvature = [\n    1.0,\n    0.8,\n]"), "{text}");
    let read = Scene::from_toml(&text, ".").unwrap();
    assert_eq!(read.rod.natural_curvature, scene.rod.natural_curvature);
    assert_eq!(Parameter::NaturalCurvature.of(&scene), None);
    // The second factor of the list.
    assert_eq!(curvature_of(2).of(&scene), Some(0.8));
    for piece in [3, 255] {
        assert_eq!(curvature_of(piece).of(&scene), None);
        assert!(scene.problem().unwrap().with([(curvature_of(piece), 1.0)]).is_err());
    }
    for wrong in [vec![], vec![1.0, f64::NAN]] {
        scene.rod.natural_curvature = wrong.into();
        let error = scene.problem().unwrap_err().to_string();
        assert!(
            error.contains("rod.natural_curvature") && error.contains("one finite number or more"),
            "{error}"
        );
    }
    let wrong = text.replace("    0.8,\n", "    \"0.8\",\n");
    let error = Scene::from_toml(&wrong, ".").unwrap_err();
    assert!(error.to_string().contains("a list with one number for each part"), "{error}");
}

#[test]
fn piecewise_parameters_are_written_by_name() {
    let all = Parameter::all(&helix());
    // A guard against an empty list.
    assert!(all.len() > 25, "{all:?}");
    for parameter in &all {
        let text = serde_json::to_string(parameter).unwrap();
        assert_eq!(text, format!("\"{}\"", parameter.name()));
        assert_eq!(serde_json::from_str::<Parameter>(&text).unwrap(), *parameter);
        assert_eq!(all.iter().filter(|p| p.name() == parameter.name()).count(), 1);
    }
    let found = serde_json::from_str::<Parameter>("\"natural_curvature.16\"").unwrap();
    assert_eq!(found, curvature_of(16));
    assert_eq!(found.path(), "rod.natural_curvature.15");
    for wrong in ["natural_curvature.0", "of no part", "youngs_mod"] {
        let error = serde_json::from_str::<Parameter>(&format!("\"{wrong}\"")).unwrap_err();
        assert!(error.to_string().contains("such as"), "{error}");
    }
}

/// The curvature of every piece is identified from the positions of all nodes, from equal starts.
#[test]
fn piecewise_moduli_are_identified() {
    let truth = [1.0, 0.8, 1.2];
    let mut scene = arc();
    scene.rod.natural_curvature = truth.to_vec().into();
    let run = simulate(&scene);
    scene.rod.natural_curvature = vec![1.0; 3].into();
    let mut fit = Fit::new(&scene.problem().unwrap());
    for node in [8, 15, 21] {
        let sample = |k: usize| {
            let [x, y, _] = run.node(node, 5 * k).map(Some);
            Sample { time: run.times()[5 * k], position: [x, y, None] }
        };
        let samples = (1..=10).map(sample).collect();
        fit = fit.observe(Observation::new(samples).at(Point::Node(node)));
    }
    let fit = [1, 2, 3].map(curvature_of).into_iter().fold(fit, Fit::identify);
    for ((parameter, found), truth) in fit.solve().unwrap().parameters().iter().zip(truth) {
        println!("{parameter}: {found}");
        // Exact data: the values of the simulation.
        assert!((found - truth).abs() < 1e-6, "{parameter}: {found} {truth}");
    }
}

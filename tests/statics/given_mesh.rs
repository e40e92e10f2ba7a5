//! Estimated errors of given meshes of equilibria and modes, against fine meshes, and the warning of coarse ones.

use crate::common::distance;
use rodfit::code::Code;
use rodfit::statics::Equilibrium;
use rodfit::vibration::{LinearizationPoint, Mode, ModeKind, Modes};
use rodfit::{Problem, Scene, scene::Point};

/// Meshes that are examined, and the number of edges that stands for the exact solution.
const MESHES: [usize; 7] = [4, 5, 7, 10, 15, 20, 40];
const FINE: usize = 400;
/// Number of frequencies that are compared, and largest error without a warning.
const COUNT: usize = 4;
const LIMIT: f64 = 0.02;
/// Largest ratio of an estimated and a true error.
const FACTOR: f64 = 3.0;

const STRAIGHT: &str = r#"rod.shape = { kind = "straight", length = 0.5, direction = [1, 0, 0] }"#;
const ARC: &str = r#"rod.shape = { kind = "arc", length = 0.5, angle = 1.5 }"#;
const PINNED: &str = r#"supports = { start = "pinned", end = "pinned" }"#;
const ROLLER: &str = r#"supports = { start = "pinned", end = "roller" }"#;
const GRAVITY: &str = "loads.gravity = [0, -9.8, 0]";
const TIP_MASS: &str = "[[rod.mass]]\nnode = \"tip\"\nmass = 0.05";

/// Scenes: name, modulus (Pa), and the lines that differ.
const SCENES: [(&str, f64, &[&str]); 9] = [
    ("cantilever", 1e9, &[STRAIGHT, GRAVITY]),
    ("limp cantilever", 2e7, &[STRAIGHT, GRAVITY]),
    ("pinned", 1e9, &[STRAIGHT, ROLLER, GRAVITY]),
    ("pinned at both ends", 1e9, &[STRAIGHT, PINNED, GRAVITY]),
    ("curved", 1e9, &[ARC, GRAVITY]),
    ("curved between pins", 1e9, &[ARC, PINNED, GRAVITY]),
    ("clamped at nodes", 1e9, &[STRAIGHT, GRAVITY, "supports.clamp = \"nodes\""]),
    (
        "curved in space",
        1e9,
        &[ARC, "material.poisson_ratio = 0.3", "loads.gravity = [0, 0, -9.8]"],
    ),
    ("tip mass", 1e9, &[STRAIGHT, GRAVITY, TIP_MASS]),
];

/// The problem of a scene on a mesh.
fn problem((_, modulus, lines): (&str, f64, &[&str]), segments: usize) -> Problem {
    let text = format!(
        "rod.segments = {segments}\nrod.section = {{ kind = \"circle\", radius = 0.005 }}\n\
         material.density = 1300\nmaterial.youngs_modulus = {modulus:e}\n{}\n",
        lines.join("\n")
    );
    Scene::from_toml(&text, ".").unwrap().problem().unwrap()
}

/// The number of segments that a warning recommends.
fn recommended(warnings: &[String]) -> usize {
    let (_, words) = warnings[0].split_once("Use rod.segments = ").unwrap();
    words.split(' ').next().unwrap().parse().unwrap()
}

fn modes(problem: &Problem) -> Modes {
    let mut found = problem.modes(COUNT, LinearizationPoint::Equilibrium).unwrap();
    problem.add_mesh_errors(COUNT, &mut found);
    found
}

fn rest(problem: &Problem) -> Equilibrium {
    let mut found = problem.equilibrium().unwrap();
    problem.add_mesh_error(&mut found);
    found
}

/// Asserts that an estimate is within [`FACTOR`] of the true error, or both are below `small`.
fn assert_near(estimate: f64, truth: f64, small: f64, name: &str) {
    let ratio = (estimate / truth).abs();
    let near = ratio < FACTOR && ratio > FACTOR.recip();
    assert!(near || estimate.abs().max(truth.abs()) < small, "{name}: {estimate:e}, {truth:e}");
}

#[test]
fn frequency_errors_of_given_meshes_are_estimated() {
    for scene in SCENES {
        let exact = problem(scene, FINE).modes(5 * COUNT, LinearizationPoint::Equilibrium).unwrap();
        for segments in MESHES {
            let found = modes(&problem(scene, segments));
            let errors: Vec<f64> = found.modes.iter().map(|m| m.mesh_error.unwrap()).collect();
            for (k, own) in found.modes.iter().enumerate() {
                let is_similar = |other: &&Mode| other.plane == own.plane && other.kind == own.kind;
                let before = found.modes[..k].iter().filter(is_similar).count();
                // Axial modes are above bending modes that coarse meshes do not have.
                if own.kind == ModeKind::Axial {
                    continue;
                }
                let exact = exact.modes.iter().filter(is_similar).nth(before).unwrap();
                let name = format!("{} on {segments}, mode {k}", scene.0);
                let truth = own.frequency_rad_s / exact.frequency_rad_s - 1.0;
                // The second frequency of the limp rod is exact by chance on five edges.
                let small = if scene.0.starts_with("limp") { 0.2 * LIMIT } else { 2e-4 };
                assert_near(errors[k], truth, small, &name);
            }
            let is_large = errors.iter().any(|error| error.abs() > LIMIT);
            let warned = found.warning_codes.contains(&Code::CoarseMesh);
            assert_eq!(warned, is_large, "{} on {segments}: {errors:?}", scene.0);
            if warned {
                let finer = recommended(&found.warnings);
                println!("{} on {segments}: {}", scene.0, found.warnings[0]);
                let codes = modes(&problem(scene, finer)).warning_codes;
                assert!(!codes.contains(&Code::CoarseMesh), "{} on {finer}", scene.0);
            }
        }
    }
}

#[test]
fn displacement_errors_of_given_meshes_are_estimated() {
    for scene in SCENES {
        let fine = problem(scene, FINE);
        let exact = fine.equilibrium().unwrap();
        let places = |problem: &Problem, nodes: &[[f64; 3]], s: f64| {
            let stencil = problem.stencil(Point::ArcLength(s)).unwrap();
            let at = |i: usize, c: usize| nodes[i][c];
            [0, 1, 2].map(|c| stencil.nodes.iter().map(|(i, w)| w * at(*i, c)).sum::<f64>())
        };
        // Displacements from the same scene without loads.
        let unloaded = (scene.0, scene.1, scene.2);
        let still = |segments: usize| {
            let mut scene = problem(unloaded, segments).scene().clone();
            scene.loads.gravity = [0.0; 3];
            scene.rod.mass.clear();
            let problem = scene.problem().unwrap();
            problem.equilibrium().unwrap().nodes
        };
        let fine_still = still(FINE);
        for segments in MESHES {
            let own = problem(scene, segments);
            let (found, own_still) = (rest(&own), still(segments));
            let (mut truth, mut extent): (f64, f64) = (0.0, 0.0);
            for s in own.arc_lengths().iter().filter(|s| (0.0..=own.length()).contains(*s)) {
                let moved = |problem: &Problem, nodes: &[[f64; 3]], still: &[[f64; 3]]| {
                    let (to, from) = (places(problem, nodes, *s), places(problem, still, *s));
                    [0, 1, 2].map(|c| to[c] - from[c])
                };
                let here = moved(&own, &found.nodes, &own_still);
                truth = truth.max(distance(here, moved(&fine, &exact.nodes, &fine_still)));
                extent = extent.max(distance(here, [0.0; 3]));
            }
            let error = found.mesh_error.unwrap();
            let name = format!("{} on {segments}", scene.0);
            assert_near(error.displacement, truth, 1e-3 * extent, &name);
            let relative = error.relative.unwrap();
            assert!((relative * extent / error.displacement - 1.0).abs() < 1e-6, "{name}");
            // Positions have errors near that of displacements here, which are larger than half of the length.
            let warned = found.warning_codes.contains(&Code::CoarseMesh);
            let of_length = found.warnings.iter().any(|text| text.contains("% of the length"));
            assert_eq!(warned, relative > LIMIT || of_length, "{name}: {error:?}");
            if warned {
                println!("{name}: {}", found.warnings[0]);
                let codes = rest(&problem(scene, recommended(&found.warnings))).warning_codes;
                assert!(!codes.contains(&Code::CoarseMesh), "{name}");
            }
        }
    }
}

/// The mesh that the program chose has an error of its own, and other results keep their numbers.
#[test]
fn chosen_mesh_has_no_second_estimate() {
    let mut scene = problem(SCENES[0], 5).scene().clone();
    scene.rod.segments = None;
    let chosen = scene.problem().unwrap();
    assert_eq!(rest(&chosen).mesh_error, None);
    assert!(modes(&chosen).modes.iter().all(|mode| mode.mesh_error.is_none()));
    let given = problem(SCENES[0], 5);
    let (before, after) = (given.equilibrium().unwrap(), rest(&given));
    assert_eq!((before.nodes, before.energy), (after.nodes, after.energy));
}

/// A mesh of few edges has fewer modes than requested: the warning says so.
#[test]
fn missing_modes_are_reported() {
    let given = problem(SCENES[0], 4);
    let mut found = given.modes(10, LinearizationPoint::Equilibrium).unwrap();
    assert!(found.modes.len() < 10);
    given.add_mesh_errors(10, &mut found);
    assert!(found.warnings[0].contains("lacks"), "{:?}", found.warnings);
    let finer = problem(SCENES[0], recommended(&found.warnings));
    let mut found = finer.modes(10, LinearizationPoint::Equilibrium).unwrap();
    finer.add_mesh_errors(10, &mut found);
    assert!(!found.warning_codes.contains(&Code::CoarseMesh), "{:?}", found.warnings);
}

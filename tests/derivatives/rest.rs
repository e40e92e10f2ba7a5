//! Derivatives of equilibria and of frequencies about them, against differences and theory.

use nalgebra::Vector3;
use num_dual::HyperDual64;
use rodfit::scene::{
    Clamp, Dimension, End, LineForce, Material, Motion, PointForce, Scene, Section, Shape, Support,
};
use rodfit::vibration::{LinearizationPoint, Mode, ModeFilter, ModeKind, ModeName, ModePlane};
use rodfit::{Error, Parameter, Point, Problem, Trajectory};

use crate::common::differences::{at_rest, difference, mismatch_at_rest};
use crate::common::{at_tip, cantilever, helix_with};

/// A cantilever of 20 edges under its weight.
fn sagging() -> Scene {
    let mut scene = cantilever();
    (scene.rod.segments, scene.time) = (Some(20), None);
    scene
}

/// A curved rod under its weight and a force at its tip.
fn arc() -> Scene {
    let mut scene = sagging();
    scene.rod.shape = Shape::Arc { length: 0.6, angle: 1.2 };
    scene.material.shear_modulus = Some(4e7);
    scene.loads.point = at_tip([0.1, -0.2, 0.0]);
    scene
}

fn helix() -> Scene {
    let mut scene = helix_with(0.5, 1e-3, 0.1, Clamp::MidEdge);
    (scene.rod.segments, scene.time) = (Some(30), None);
    scene.material.poisson_ratio = Some(0.4);
    scene
}

/// An arch whose right foot is pushed in.
fn arch() -> Scene {
    let mut scene = sagging();
    scene.rod.shape = Shape::Arc { length: 0.6, angle: 1.2 };
    scene.supports.end = Support::Clamped;
    let displacement = [-0.05, 0.02, 0.0];
    scene.supports.motion =
        vec![Motion { end: End::End, displacement, ramp: Some(1.0), ..Motion::default() }];
    scene
}

/// A round rod between hinges that sags: nothing resists its spin.
fn hinged() -> Scene {
    let mut scene = sagging();
    (scene.supports.start, scene.supports.end) = (Support::Pinned, Support::Pinned);
    scene.rod.dimension = Dimension::Spatial;
    scene.material.poisson_ratio = Some(0.4);
    scene
}

fn rectangular() -> Scene {
    let mut scene = helix();
    scene.rod.section = Section::Rectangle { width: 0.012, height: 0.008, up: [1.0, 0.3, 0.0] };
    scene.rod.natural_twist = 3.0.into();
    scene
}

/// The scenes with the parameters that matter.
fn scenes() -> Vec<(&'static str, Scene, Vec<Parameter>)> {
    let mut by_shear_modulus = helix();
    let material = &mut by_shear_modulus.material;
    (material.poisson_ratio, material.shear_modulus) = (None, Some(4e6));
    vec![
        (
            "cantilever",
            sagging(),
            vec![
                Parameter::YoungsModulus,
                Parameter::Density,
                Parameter::Radius,
                Parameter::ClampAngle,
            ],
        ),
        (
            "arc",
            arc(),
            vec![
                Parameter::YoungsModulus,
                Parameter::Density,
                Parameter::Radius,
                Parameter::NaturalCurvature,
            ],
        ),
        (
            "helix",
            helix(),
            vec![
                Parameter::YoungsModulus,
                Parameter::PoissonRatio,
                Parameter::Density,
                Parameter::Radius,
                Parameter::NaturalCurvature,
                Parameter::NaturalTwist,
            ],
        ),
        ("helix with G", by_shear_modulus, vec![Parameter::ShearModulus]),
        (
            "flat helix",
            rectangular(),
            vec![Parameter::Width, Parameter::Height, Parameter::NaturalTwist],
        ),
        (
            "arch",
            arch(),
            vec![
                Parameter::YoungsModulus,
                Parameter::Density,
                Parameter::Radius,
                Parameter::NaturalCurvature,
            ],
        ),
        ("hinged", hinged(), vec![Parameter::YoungsModulus, Parameter::Density, Parameter::Radius]),
    ]
}

/// The step of differences by a parameter.
fn step(problem: &Problem, parameter: Parameter) -> f64 {
    let value = parameter.of(problem.scene()).unwrap();
    3e-3 * if value == 0.0 { 1.0 } else { value.abs() }
}

#[test]
fn derivatives_of_equilibria_equal_differences() {
    for (name, scene, parameters) in scenes() {
        let problem = scene.problem().unwrap();
        let middle = problem.nodes() / 2;
        let run = at_rest(&problem, &parameters);
        assert!(run.work().newton_iterations > 0);
        assert_eq!(run.times(), [0.0]);
        assert_eq!(run.tip(0), problem.equilibrium().unwrap().tip, "{name}");
        let points = [Point::Tip, Point::Node(middle), Point::ArcLength(0.1234)];
        for (k, parameter) in parameters.iter().enumerate() {
            let places = |problem: &Problem| {
                let run = at_rest(problem, &[]);
                points.map(|point| run.at(point, 0.0).unwrap().0).concat()
            };
            let h = step(&problem, *parameter);
            let expected = difference(&problem, *parameter, h, places);
            let exact: Vec<f64> =
                points.iter().flat_map(|p| run.at(*p, 0.0).unwrap().1[k]).collect();
            let size = expected.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let off = expected.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{name}, {parameter}: {:.1e} of {size:.3e}", off / size);
            // Central differences of the best step have this error.
            assert!(off < 1e-8 * size, "{name}, {parameter}: {exact:?} {expected:?}");
        }
    }
}

#[test]
fn derivatives_of_frequencies_equal_differences() {
    const NUMBERS: [usize; 3] = [1, 2, 5];
    for (name, mut scene, parameters) in scenes() {
        if name == "hinged" {
            // Both bending modes of a round rod are one about its axis of symmetry, almost.
            scene.rod.section =
                Section::Rectangle { width: 0.02, height: 0.01, up: [0.0, 1.0, 0.0] };
        }
        let parameters: Vec<Parameter> =
            parameters.into_iter().filter(|p| p.of(&scene).is_some()).collect();
        let problem = scene.problem().unwrap();
        let natural_frequencies = problem.natural_frequencies(&NUMBERS, &parameters).unwrap();
        let numbered = |problem: &Problem| -> Vec<f64> {
            let modes = problem.modes(12, LinearizationPoint::Equilibrium).unwrap().modes;
            let of = |number: &usize| {
                let own = |m: &&Mode| m.number == Some(*number) && m.plane != Some(ModePlane::Out);
                modes.iter().find(own).unwrap().frequency_rad_s
            };
            NUMBERS.iter().map(of).collect()
        };
        for (tone, mode) in natural_frequencies.iter().zip(numbered(&problem)) {
            assert!((tone.frequency_rad_s / mode - 1.0).abs() < 1e-11, "{name}");
        }
        for (k, parameter) in parameters.iter().enumerate() {
            let h = step(&problem, *parameter);
            let expected = difference(&problem, *parameter, h, numbered);
            let scale = parameter.of(&scene).filter(|value| *value != 0.0).unwrap_or(1.0);
            for ((tone, expected), number) in natural_frequencies.iter().zip(expected).zip(NUMBERS)
            {
                let off = (tone.derivatives[k] - expected).abs() * scale / tone.frequency_rad_s;
                println!(
                    "{name}, {parameter}, mode {number}: {:.4e} off {off:.1e}",
                    expected * scale / tone.frequency_rad_s
                );
                // The difference of frequencies that are right to 1e-11 to 1e-10.
                assert!(off < 1e-7, "{name}, {parameter}, mode {number}: {tone:?} {expected}");
            }
        }
    }
}

/// A tapered bar that sags, with frequencies of thick rods in its plane, out of it and in space.
#[test]
fn derivatives_of_thick_frequencies_equal_differences() {
    let mut scene = sagging();
    let length = 0.1;
    scene.rod.shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
    scene.rod.section = Section::Rectangle { width: 0.02, height: 0.012, up: [0.0, 1.0, 0.0] };
    scene.material.poisson_ratio = Some(0.3);
    let parameters = [
        Parameter::YoungsModulus,
        Parameter::PoissonRatio,
        Parameter::Density,
        Parameter::Height,
        Parameter::Width,
        "rod.shape.length".parse().unwrap(),
    ];
    for dimension in [Dimension::Planar, Dimension::Spatial] {
        scene.rod.dimension = dimension;
        let problem = scene.problem().unwrap();
        let planes = match dimension {
            Dimension::Spatial => vec![None],
            _ => vec![Some(ModePlane::In), Some(ModePlane::Out)],
        };
        for plane in planes {
            let among = ModeFilter { plane, kind: Some(ModeKind::Bending), direction: None };
            let names = [1, 2].map(|number| ModeName { number, among, timoshenko: true });
            let found = problem.natural_frequencies(&names, &parameters).unwrap();
            let plain = |problem: &Problem| -> Vec<f64> {
                let found = problem.natural_frequencies(&names, &[]).unwrap();
                found.iter().map(|f| f.frequency_rad_s).collect()
            };
            for (k, parameter) in parameters.iter().enumerate() {
                let expected = difference(&problem, *parameter, step(&problem, *parameter), plain);
                let scale = parameter.of(&scene).unwrap();
                for (f, expected) in found.iter().zip(expected) {
                    let off = (f.derivatives[k] - expected).abs() * scale / f.frequency_rad_s;
                    assert!(off < 1e-7, "{plane:?}, {parameter}: {f:?} {expected} off {off:.1e}");
                }
            }
        }
    }
}

/// Second derivatives of frequencies in hyper-dual numbers against differences of the first.
#[test]
fn second_derivatives_of_frequencies_equal_differences() {
    const NUMBERS: [usize; 2] = [1, 3];
    for (name, scene, pair) in [
        ("cantilever", sagging(), [Parameter::YoungsModulus, Parameter::YoungsModulus]),
        ("arc", arc(), [Parameter::NaturalCurvature, Parameter::Density]),
        ("arc", arc(), [Parameter::NaturalCurvature, Parameter::NaturalCurvature]),
        ("helix", helix(), [Parameter::NaturalCurvature, Parameter::YoungsModulus]),
        ("helix", helix(), [Parameter::PoissonRatio, Parameter::PoissonRatio]),
    ] {
        let problem = scene.problem().unwrap();
        let [one, two] = pair;
        let along = |p: Parameter, q: Parameter| f64::from(u8::from(p == q));
        let seed = |p, value| HyperDual64::new(value, along(p, one), along(p, two), 0.0);
        let exact = problem.natural_frequencies_over(&NUMBERS, seed).unwrap();
        let slopes = |problem: &Problem| -> Vec<f64> {
            problem
                .natural_frequencies(&NUMBERS, &[one])
                .unwrap()
                .iter()
                .map(|t| t.derivatives[0])
                .collect()
        };
        let expected = difference(&problem, two, step(&problem, two), slopes);
        let scale = one.of(&scene).unwrap() * two.of(&scene).unwrap();
        for (exact, expected) in exact.iter().zip(expected) {
            let off = (exact.eps1eps2 - expected).abs() * scale / exact.re;
            println!("{name}, {one}, {two}: {:.4e} off {off:.1e}", expected * scale / exact.re);
            assert!(off < 1e-7, "{name}, {one}, {two}: {exact:?} {expected}");
        }
    }
}

/// A weightless cantilever has omega_1 = 3.516 sqrt(EI/(rho A))/L^2: powers of E, rho and radius;
/// bending resists with I, and only the stretch of a vibrating curve would not.
#[test]
fn frequency_derivatives_of_a_cantilever_follow_power_laws() {
    let mut scene = sagging();
    scene.loads.gravity = [0.0; 3];
    scene.rod.segments = Some(40);
    let problem = scene.problem().unwrap();
    let natural_frequencies = problem
        .natural_frequencies(
            &[1, 2],
            &[Parameter::YoungsModulus, Parameter::Density, Parameter::Radius],
        )
        .unwrap();
    let unit = (1e8 * 0.005_f64.powi(2) / (4.0 * 1273.52)).sqrt() / 0.25;
    for (tone, root) in natural_frequencies.iter().zip([1.87510407_f64, 4.69409113]) {
        let w = tone.frequency_rad_s;
        // Lumped masses: -0.32 and -3.8 of (l/L)^2 on the square.
        assert!((w / (root * root * unit) - 1.0).abs() < 1.3e-3, "{w}");
        let powers = [(0, 1e8, 0.5), (1, 1273.52, -0.5), (2, 0.005, 1.0)];
        for (k, value, power) in powers {
            let found = tone.derivatives[k] * value / w;
            println!("{w:.4} rad/s: power {found:.12}");
            // Rounding: 1e-16 of the ratio of the stiffest eigenvalue to the mode's, 2e7.
            assert!((found - power).abs() < 1e-8, "{found} {power}");
        }
    }
}

/// A free bar by its names: the first of bending in and out of the plane, of torsion and stretch,
/// with their powers of E, G and the density; rigid motions do not count.
#[test]
fn frequency_derivatives_of_a_free_bar_follow_power_laws() {
    let (e, g, rho, length) = (69e9, 26e9, 2700.0, 0.4);
    for (direction, dimension) in [
        ([1.0, 0.0, 0.0], Dimension::Auto),
        ([0.6, 0.3, -0.5], Dimension::Auto),
        ([0.6, 0.3, -0.5], Dimension::Spatial),
    ] {
        let shape = Shape::Straight { length, direction };
        let section = Section::Rectangle { width: 0.02, height: 0.004, up: [-0.3, 0.6, 0.0] };
        let material = Material { shear_modulus: Some(g), ..Material::new(rho, e) };
        let mut scene = Scene::new(60, shape, section, material);
        (scene.supports.start, scene.rod.dimension) = (Support::Free, dimension);
        let problem = scene.problem().unwrap();
        let spatial = problem.spatial().is_some();
        let of = |kind| ModeFilter { kind: Some(kind), ..ModeFilter::default() };
        let flat = (e * 0.004_f64.powi(2) / 12.0 / rho).sqrt() * (4.73004074 / length).powi(2);
        // Edgewise is the second in space, the wave of twice the width over the height.
        let edge = match spatial {
            true => ModeFilter { direction: Some(normal(&problem)), ..of(ModeKind::Bending) },
            false => ModeFilter { plane: Some(ModePlane::Out), ..of(ModeKind::Bending) },
        };
        let names = [of(ModeKind::Bending), edge, of(ModeKind::Torsion), of(ModeKind::Axial)];
        let names = names.map(|among| ModeName::new(1, among));
        let natural_frequencies = problem
            .natural_frequencies(
                &names,
                &[Parameter::YoungsModulus, Parameter::ShearModulus, Parameter::Density],
            )
            .unwrap();
        let axial = std::f64::consts::PI / length * (e / rho).sqrt();
        for (k, exact, powers) in [
            (0, Some(flat), [0.5, 0.0, -0.5]),
            (1, Some(5.0 * flat), [0.5, 0.0, -0.5]),
            (2, None, [0.0, 0.5, -0.5]),
            (3, Some(axial), [0.5, 0.0, -0.5]),
        ] {
            let w = natural_frequencies[k].frequency_rad_s;
            assert!(exact.is_none_or(|exact| (w / exact - 1.0).abs() < 2e-3), "{k}: {w} {exact:?}");
            for (j, (value, power)) in [e, g, rho].into_iter().zip(powers).enumerate() {
                let found = natural_frequencies[k].derivatives[j] * value / w;
                assert!((found - power).abs() < 1e-7, "{k} {j}: {found} {power}");
            }
        }
        // Without a word: in the plane, bending first.
        let plain = problem.natural_frequencies(&[1], &[]).unwrap()[0].frequency_rad_s;
        assert!((plain / natural_frequencies[0].frequency_rad_s - 1.0).abs() < 1e-11, "{plain}");
    }
}

/// Across the flat side and the rod.
fn normal(problem: &Problem) -> [f64; 3] {
    let nodes = problem.equilibrium().unwrap().nodes;
    let along = (Vector3::from(nodes[1]) - Vector3::from(nodes[0])).normalize();
    let up = Vector3::new(-0.3, 0.6, 0.0);
    along.cross(&(up - along * along.dot(&up))).into()
}

/// Planes and kinds that a scene does not have are refused, by the key.
#[test]
fn modes_of_impossible_kinds_are_rejected() {
    let mut scene = sagging();
    let problem = scene.problem().unwrap();
    let (inside, outside) = (Some(ModePlane::In), Some(ModePlane::Out));
    let [torsion, axial] = [ModeKind::Torsion, ModeKind::Axial].map(Some);
    let refused = |problem: &Problem, plane, kind, direction, key: &str| {
        let among = ModeFilter { plane, kind, direction };
        let found = problem.natural_frequencies(&[ModeName::new(1, among)], &[]);
        assert!(matches!(&found, Err(Error::Invalid { key: k, .. }) if k == key), "{found:?}");
    };
    refused(&problem, outside, None, None, "modes");
    refused(&problem, None, torsion, None, "modes");
    refused(&problem, inside, torsion, None, "modes.kind");
    refused(&problem, outside, axial, None, "modes.kind");
    refused(&problem, None, None, Some([0.0; 3]), "modes.direction");
    scene.material.poisson_ratio = Some(0.3);
    scene.rod.dimension = Dimension::Spatial;
    refused(&scene.problem().unwrap(), inside, None, None, "modes.plane");
}

/// A stiff cantilever sags by w = rho A g L^4/(8 EI).
#[test]
fn sag_derivatives_of_a_stiff_cantilever_follow_power_laws() {
    let mut scene = sagging();
    scene.material.youngs_modulus = 1e12;
    let run = at_rest(
        &scene.problem().unwrap(),
        &[Parameter::YoungsModulus, Parameter::Density, Parameter::Radius],
    );
    let (x, by) = run.at(Point::Tip, 0.0).unwrap();
    let (e, rho, r) = (1e12, 1273.52, 0.005);
    let sag = rho * 9.8 * 0.5_f64.powi(4) / (2.0 * e * r * r);
    assert!((-x[1] / sag - 1.0).abs() < 5e-3, "{} {sag}", x[1]);
    for (k, value, power) in [(0, e, -1.0), (1, rho, 1.0), (2, r, -2.0)] {
        let found = by[k][1] * value / x[1];
        println!("power {found:.9}");
        assert!((found - power).abs() < 1e-7, "{found} {power}");
    }
}

/// On meshes whose tangents by nodes are rounding errors, what coarse ones say.
#[test]
fn derivatives_on_very_fine_meshes_equal_those_on_coarse_ones() {
    let by = |segments: usize| {
        let mut scene = sagging();
        scene.rod.segments = Some(segments);
        let problem = scene.problem().unwrap();
        let tip = problem.nodes() - 1;
        let run =
            Trajectory::at_rest(&problem, &[tip], &[Parameter::YoungsModulus, Parameter::Density])
                .unwrap();
        run.at(Point::Tip, 0.0).unwrap().1
    };
    let finest = by(20_000);
    for (segments, allowed) in [(400, 1e-5), (3000, 2e-7)] {
        for (coarse, fine) in by(segments).into_iter().zip(&finest) {
            let [coarse, fine] = [coarse, *fine].map(Vector3::from);
            let off = (coarse - fine).norm() / fine.norm();
            println!("{segments} edges: {off:.1e}");
            assert!(off < allowed, "{segments}: {coarse} {fine}");
        }
    }
}

/// Turning a clamped rod that nothing pulls turns it as it is.
#[test]
fn rotation_of_a_clamp_without_weight_rotates_the_rod() {
    let mut scene = arc();
    scene.loads.point.clear();
    scene.loads.gravity = [0.0; 3];
    let run = at_rest(&scene.problem().unwrap(), &[Parameter::ClampAngle]);
    let ([x, by], wall) = (
        run.at(Point::Tip, 0.0).map(|(x, by)| [Vector3::from(x), Vector3::from(by[0])]).unwrap(),
        Vector3::from(run.node(0, 0)),
    );
    let off = (Vector3::z().cross(&(x - wall)) - by).norm();
    println!("{off:.1e}");
    // The tangent of 30 edges loses so many digits when the moved wall carries the rod along.
    assert!(off < 1e-9, "{x} {by} {off:e}");
}

/// Where a column is about to buckle, its place has no derivatives; before and beyond, it has.
#[test]
fn derivatives_at_the_limit_of_stability_are_rejected() {
    let mut scene = sagging();
    scene.loads.gravity = [0.0; 3];
    let load = |scene: &Scene, force: f64| {
        let mut scene = scene.clone();
        scene.loads.point = vec![PointForce { force: [-force, 0.0, 0.0], ..PointForce::default() }];
        scene.problem().unwrap()
    };
    let first = |force: f64| load(&scene, force).modes(1, LinearizationPoint::Equilibrium).unwrap();
    // The load at which the first frequency vanishes.
    let [mut low, mut high] = [0.0, 1.0];
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let stable = first(middle).frequencies_rad_s[0] > 0.0;
        *(if stable { &mut low } else { &mut high }) = middle;
    }
    println!("critical load {high} N");
    let problem = load(&scene, high);
    let tip = problem.nodes() - 1;
    let found = Trajectory::at_rest(&problem, &[tip], &[Parameter::YoungsModulus]).map(|_| ());
    assert!(matches!(found, Err(Error::Indifferent { node }) if node == tip), "{found:?}");
    let found = problem.natural_frequencies(&[1], &[Parameter::YoungsModulus]);
    assert!(matches!(found, Err(Error::Indifferent { .. } | Error::Mode { .. })), "{found:?}");
    for force in [0.9 * low, 1.1 * low] {
        let run =
            Trajectory::at_rest(&load(&scene, force), &[tip], &[Parameter::YoungsModulus]).unwrap();
        let by = run.at(Point::Tip, 0.0).unwrap().1[0];
        // What the force has shortened.
        let exact = force * 0.5 / (1e8 * std::f64::consts::PI * 0.005_f64.powi(2)) / 1e8;
        assert!((by[0] / exact - 1.0).abs() < 1e-3 && by[1].abs() < 1e-20, "{by:?} {exact}");
    }
    // A standing column that cannot stand has no tone.
    let found = load(&scene, 1.1 * low).natural_frequencies(&[1], &[]);
    assert!(matches!(found, Err(Error::Mode { number: 1, .. })), "{found:?}");
}

#[test]
fn frequencies_of_zero_modes_are_rejected() {
    // A round rod in space bends both ways alike.
    let mut scene = sagging();
    scene.loads.gravity = [0.0; 3];
    scene.rod.dimension = Dimension::Spatial;
    scene.material = Material { poisson_ratio: Some(0.3), ..scene.material };
    let problem = scene.problem().unwrap();
    let found = problem.natural_frequencies(&[2], &[Parameter::YoungsModulus]).unwrap_err();
    assert!(matches!(found, Error::Mode { number: 2, .. }), "{found}");
    assert!(found.to_string().contains("mode 1"), "{found}");
    assert_eq!(problem.natural_frequencies(&[2], &[]).unwrap().len(), 1);
    // In the plane, each way has its own.
    scene.rod.dimension = Dimension::Planar;
    let natural_frequencies =
        scene.problem().unwrap().natural_frequencies(&[1, 2], &[Parameter::YoungsModulus]).unwrap();
    for tone in natural_frequencies {
        assert!((tone.derivatives[0] * 1e8 / tone.frequency_rad_s - 0.5).abs() < 1e-9);
    }
    for number in [0, 10_000] {
        let found = scene.problem().unwrap().natural_frequencies(&[number], &[]);
        assert!(matches!(found, Err(Error::OutOfRange { what: "mode", .. })), "{found:?}");
    }
    let found = scene.problem().unwrap().natural_frequencies(&[1], &[Parameter::Width]);
    assert!(matches!(found, Err(Error::Invalid { .. })), "{found:?}");
}

/// A round rod along an axis, curved along its directors: these follow its direction smoothly.
#[test]
fn directors_of_round_rods_follow_the_direction() {
    for direction in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
        let mut scene = hinged();
        (scene.supports.start, scene.supports.end) = (Support::Clamped, Support::Free);
        scene.rod.shape = Shape::Straight { length: 0.5, direction };
        scene.rod.natural_bending = vec![[0.4, -0.7], [1.1, 0.3]];
        scene.loads.gravity = [1.0, -2.0, 0.5];
        let problem = scene.problem().unwrap();
        for axis in ["x", "y", "z"] {
            let parameter: Parameter = format!("rod.shape.direction.{axis}").parse().unwrap();
            let [apart, _] = mismatch_at_rest(&problem, parameter, 1e-3);
            assert!(apart < 1e-7, "{direction:?}, {axis}: {apart:e}");
        }
    }
}

/// Equilibria of an arc under a line load by both ends of the load and its components, in the plane and in space.
#[test]
fn equilibrium_derivatives_by_line_loads_equal_differences() {
    for dimension in [Dimension::Planar, Dimension::Spatial] {
        let mut scene = arc();
        scene.rod.dimension = dimension;
        // Both ends of the load are within edges, on which the nodal forces are smooth.
        let force = [0.1, -0.3, 0.0];
        scene.loads.line =
            vec![LineForce { from: 0.111, to: Some(0.404), force, follower: false, signal: None }];
        let problem = scene.problem().unwrap();
        for (name, h) in [("from", 1e-4), ("to", 1e-4), ("force.x", 1e-2), ("force.y", 1e-2)] {
            let parameter: Parameter = format!("loads.line.0.{name}").parse().unwrap();
            let [error, size] = mismatch_at_rest(&problem, parameter, h);
            println!("{dimension:?}, {name}: {:.1e} of the largest", error / size);
            assert!(error < 1e-6 * size, "{name}: {error:e}");
        }
    }
}

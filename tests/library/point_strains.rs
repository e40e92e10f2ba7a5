//! Curvature and strain at a point of the rod: values of theory, derivatives, exact data, coverage with noise, tables
//! with other units, and invalid input.

use rodfit::code::Code;
use rodfit::fit::{PointChannel, Reading, Sensor, SensorChannel, Tare};
use rodfit::scene::{Dimension, PointForce, Scene, Shape};
use rodfit::{Fit, Parameter, Point, Problem, Unknown};

use crate::calls::{refused, short};
use crate::common::differences::{apart, largest};
use crate::common::fits::{record, same_mesh};
use crate::point_sensors::{covered, fit, fit_file, model, steps, table};

/// The problem of a rod of the length 1 m and the radius 10 mm with this text below `[rod]`, `[material]` and the rest.
fn rod(direction: &str, modulus: f64, more: &str, dimension: &str) -> Problem {
    let text = format!(
        "[rod]\nshape = {{ kind = \"straight\", length = 1.0, direction = {direction} }}\nsegments = 20\n\
         dimension = \"{dimension}\"\nsection = {{ kind = \"circle\", radius = 0.01 }}\n[material]\n\
         density = 1000\nyoungs_modulus = {modulus}\npoisson_ratio = 0.3\n{more}\n"
    );
    Scene::from_toml(&text, ".").unwrap().problem().unwrap()
}

/// The value of a channel of the rod at rest.
fn at_rest(problem: &Problem, channel: PointChannel) -> f64 {
    let zero = Sensor::new(channel, vec![Reading { time: None, value: 0.0 }]).sigma(1.0);
    let residuals = fit(problem, zero).residuals().unwrap();
    residuals.residuals(&[problem.scene().material.youngs_modulus.ln()]).unwrap()[0]
}

/// Second moment of area of the rod, m^4.
const SECOND_MOMENT: f64 = std::f64::consts::PI * 1e-8 / 4.0;

/// M = F (L - s) with the force F at the tip: curvature M/EI towards the force, and strain r M/EI on the other face.
/// Also with a compliant clamp, whose rotation is no curvature.
#[test]
fn cantilever_under_tip_load_has_curvature_and_surface_strain_of_theory() {
    for (dimension, soft) in
        [("planar", ""), ("spatial", ""), ("spatial", "start_compliance = { rotation = 0.02 }")]
    {
        // Down by 10 mN, and in space aside by 4 mN: slopes of 1e-3.
        let aside = if dimension == "planar" { 0.0 } else { -0.004 };
        let more = format!(
            "[supports]\nstart = \"clamped\"\n{soft}\n[loads]\ngravity = [0.0, 0.0, 0.0]\n\
             [[loads.point]]\nnode = \"tip\"\nforce = [0.0, -0.01, {aside}]\n"
        );
        let problem = rod("[1, 0, 0]", 1e9, &more, dimension);
        let root = 0.01 / (1e9 * SECOND_MOMENT);
        for s in [0.0, 0.03, 0.3, 0.61, 1.0] {
            let point = Point::ArcLength(s);
            let [first, second] = [-root, aside / 0.01 * root].map(|k| k * (1.0 - s));
            let mut expected = vec![
                (PointChannel::curvature(point, 0), first),
                (PointChannel::strain(point, [0.01, 0.0]), -0.01 * first),
                (PointChannel::strain(point, [-0.006, 0.008]), 0.006 * first - 0.008 * second),
            ];
            if dimension == "spatial" {
                expected.push((PointChannel::curvature(point, 1), second));
                let turned = PointChannel::curvature(point, 0).rotated([0.3, 0.0, 0.0]);
                expected.push((turned, 0.3_f64.cos() * first + 0.3_f64.sin() * second));
            }
            for (channel, expected) in expected {
                let size = if channel.name() == "strain" { 0.01 * root } else { root };
                let error = (at_rest(&problem, channel) - expected).abs() / size;
                // Of second order in slopes of 6e-4; the axial force at the tip is P times the slope.
                assert!(error < 3e-6, "{dimension} {} at {s}: {error:e}", channel.name());
            }
        }
    }
}

/// A moment at the tip bends the rod to a circle. The moment of a joint is EI/l k (1 + k^2/4) for its strain k = 2
/// tan(phi/2).
#[test]
fn pure_moment_gives_uniform_curvature_towards_its_side() {
    let moment = 0.5 * 1e9 * SECOND_MOMENT;
    let more = format!(
        "[supports]\nstart = \"clamped\"\n[loads]\ngravity = [0.0, 0.0, 0.0]\n\
         [[loads.point]]\nnode = \"tip\"\nmoment = [0.0, 0.0, {moment}]\n"
    );
    let problem = rod("[1, 0, 0]", 1e9, &more, "planar");
    let edge = problem.arc_lengths()[2] - problem.arc_lengths()[1];
    for s in [0.0, 0.02, 0.4, 1.0] {
        let point = Point::ArcLength(s);
        let curvature = at_rest(&problem, PointChannel::curvature(point, 0));
        let of_joint = curvature * (1.0 + (curvature * edge).powi(2) / 4.0);
        assert!((of_joint / 0.5 - 1.0).abs() < 1e-9, "{s}: {curvature}");
        assert!((curvature / 0.5 - 1.0).abs() < 2e-4, "{s}: {curvature}");
        for side in [-0.01, 0.01] {
            let strain = at_rest(&problem, PointChannel::strain(point, [side, 0.0]));
            assert!((strain + side * curvature).abs() < 1e-11, "{s}: {strain}");
        }
    }
}

/// A hanging rod carries the weight below: strain rho g (L - s)/E. A force at the tip adds F/(E A).
#[test]
fn hanging_rod_is_stretched_by_the_weight_below() {
    for dimension in ["planar", "spatial"] {
        let more = "[supports]\nstart = \"clamped\"\n[loads]\ngravity = [0.0, -9.8, 0.0]\n\
                    [[loads.point]]\nnode = \"tip\"\nforce = [0.0, -0.5, 0.0]\n";
        let problem = rod("[0, -1, 0]", 1e6, more, dimension);
        let by_force = 0.5 / (1e6 * std::f64::consts::PI * 1e-4);
        for s in [0.0, 0.02, 0.055, 0.5, 0.99, 1.0] {
            let expected = 9.8e-3 * (1.0 - s) + by_force;
            for offset in [[0.0; 2], [0.01, 0.0]] {
                let strain = at_rest(&problem, PointChannel::strain(Point::ArcLength(s), offset));
                assert!((strain / expected - 1.0).abs() < 1e-9, "{dimension} {s}: {strain}");
            }
        }
    }
}

/// A curved rod without load has the curvature of its shape and no strain.
#[test]
fn unloaded_curved_rod_has_curvature_and_no_strain() {
    let supports = "[supports]\nstart = \"clamped\"\n[loads]\ngravity = [0.0, 0.0, 0.0]\n";
    let material = "section = { kind = \"circle\", radius = 1e-3 }\n[material]\ndensity = 1000\n\
                    youngs_modulus = 1e9\npoisson_ratio = 0.3\n";
    let arc = "shape = { kind = \"arc\", length = 1.0, angle = 0.8 }\nsegments = 40\n";
    let helix = "shape = { kind = \"helix\", length = 0.5, radius = 0.02, pitch = 0.05, axis = [0, 0, -1], \
                 handedness = \"left\" }\nsegments = 400\n";
    let reduced = 0.05 / (2.0 * std::f64::consts::PI);
    let of_helix = 0.02 / (0.02_f64.powi(2) + reduced * reduced);
    for (shape, dimension, curvature) in
        [(arc, "planar", 0.8), (arc, "spatial", 0.8), (helix, "spatial", of_helix)]
    {
        let text = format!("[rod]\n{shape}dimension = \"{dimension}\"\n{material}{supports}");
        let problem = Scene::from_toml(&text, ".").unwrap().problem().unwrap();
        for s in [0.0, 0.01, 0.2, 0.43] {
            let point = Point::ArcLength(s);
            let first = at_rest(&problem, PointChannel::curvature(point, 0));
            let second = match dimension {
                "planar" => 0.0,
                _ => at_rest(&problem, PointChannel::curvature(point, 1)),
            };
            let off = (first.hypot(second) / curvature - 1.0).abs();
            // 2 tan(phi/2) and chords: of second order in the turning angle of a joint, 0.02 and 0.054.
            assert!(off < 6e-4, "{dimension} {s}: {first} {second}");
            let strain = at_rest(&problem, PointChannel::strain(point, [1e-3, 5e-4]));
            assert!(strain.abs() < 1e-10, "{dimension} {s}: {strain:e}");
        }
    }
}

/// The short cantilever in space.
fn in_space() -> Scene {
    let mut scene = short();
    scene.rod.dimension = Dimension::Spatial;
    scene.material.poisson_ratio = Some(0.3);
    scene
}

/// The channels of the tests: curvatures and strains near the wall and within the rod.
fn channels() -> [PointChannel; 3] {
    [
        PointChannel::curvature(Point::ArcLength(0.03), 0),
        PointChannel::strain(Point::ArcLength(0.17), [4e-3, 1e-3]),
        PointChannel::strain(Point::Node(4), [0.0, -4e-3]).rotated([-0.7, 0.0, 0.0]),
    ]
}

#[test]
fn exact_curvature_or_strain_gives_modulus() {
    for scene in [short(), in_space()] {
        let problem = scene.problem().unwrap();
        let start = problem.with([(Parameter::YoungsModulus, 1.2e8)]).unwrap();
        for channel in channels() {
            let exact = model(&problem, channel, &steps(&problem));
            let shifted = exact.iter().map(|r| Reading { value: r.value + 0.2, ..*r }).collect();
            let still = vec![Reading { time: None, value: at_rest(&problem, channel) }];
            let size = exact.iter().map(|r| r.value.abs()).fold(0.0, f64::max);
            for sensor in [
                Sensor::new(channel, exact.clone()),
                Sensor::new(channel, shifted).tare(Tare::Free),
                Sensor::new(channel, still),
            ] {
                let report = fit(&start, sensor.sigma(0.01 * size)).solve().unwrap();
                let off = (report.parameters[0].value.unwrap() / 1e8 - 1.0).abs();
                assert!(off < 1e-7, "{} off by {off:e}", channel.name());
            }
        }
    }
}

/// Strains are geometric: with positions alone they determine the ratio of modulus to density. A known force determines
/// both.
#[test]
fn modulus_and_density_are_determined_by_one_strain_and_a_known_force() {
    let mut scene = short();
    scene.loads.point =
        vec![PointForce { node: Point::Tip, force: [0.0, -0.1, 0.0], ..Default::default() }];
    let problem = scene.problem().unwrap();
    let channel = PointChannel::strain(Point::ArcLength(0.03), [5e-3, 0.0]);
    let sensor = Sensor::new(channel, model(&problem, channel, &steps(&problem))).sigma(1e-5);
    let tip = record(&problem.simulate().unwrap(), 50).sigma(1e-4);
    let start =
        problem.with([(Parameter::YoungsModulus, 1.2e8), (Parameter::Density, 1100.0)]).unwrap();
    let both = Fit::new(&start).observe(tip).observe(sensor).analyse(same_mesh());
    let report = both.identify(Parameter::YoungsModulus).identify(Parameter::Density).solve();
    let report = report.unwrap();
    for (estimate, truth) in report.parameters.iter().zip([1e8, 1273.52]) {
        let off = (estimate.value.unwrap() / truth - 1.0).abs();
        assert!(off < 1e-7, "{}: {off:e}", estimate.name);
    }
}

/// First derivatives of all channels, in motion and at rest, and a second derivative, against central differences.
#[test]
fn derivatives_of_strains_equal_differences() {
    let arc = |scene: Scene| {
        let mut scene = scene;
        scene.rod.shape = Shape::Arc { length: 0.5, angle: 0.7 };
        scene
    };
    let curved = [short(), in_space()].map(|scene| (arc(scene), true));
    for (scene, is_curved) in [(short(), false), (in_space(), false)].into_iter().chain(curved) {
        let problem = scene.problem().unwrap();
        let zero = |time| Reading { time, value: 0.0 };
        let names = [
            "material.youngs_modulus",
            "material.density",
            "rod.shape.length",
            "rod.section.radius",
        ];
        let names = names.into_iter().chain(is_curved.then_some("rod.natural_curvature"));
        for channel in channels() {
            let readings: Vec<Reading> =
                [None, Some(0.0307), Some(0.05), Some(0.0623), Some(0.0811)]
                    .into_iter()
                    .map(zero)
                    .collect();
            let [still, moving] = [&readings[..1], &readings[1..]];
            let fit = Fit::new(&problem)
                .observe(Sensor::new(channel, still.to_vec()).sigma(1.0))
                .observe(Sensor::new(channel, moving.to_vec()).sigma(1.0));
            let fit = names.clone().fold(fit, |fit, name| {
                fit.identify(Unknown::new(name.parse::<Parameter>().unwrap()))
            });
            let residuals = fit.residuals().unwrap();
            let value = |unknown: &Unknown| {
                unknown.to_scale(unknown.parameter.of(problem.scene()).unwrap())
            };
            let x: Vec<f64> = residuals.unknowns().iter().map(value).collect();
            let exact = residuals.jacobian_at(&x).unwrap();
            for j in 0..x.len() {
                let at = |step: f64| {
                    let mut x = x.clone();
                    x[j] += step;
                    residuals.residuals(&x).unwrap()
                };
                let side = |h: f64| -> Vec<f64> {
                    at(h).iter().zip(at(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
                };
                // Richardson's extrapolation: of fourth order.
                let [one, two] = [side(1e-4), side(2e-4)];
                let by_differences: Vec<f64> =
                    one.iter().zip(two).map(|(a, b)| (4.0 * a - b) / 3.0).collect();
                let column: Vec<f64> = exact.iter().map(|row| row[j]).collect();
                let error = apart(&column, &by_differences) / largest(&column);
                assert!(error < 1e-6, "{} by unknown {j}: {error:e}", channel.name());
            }
            // The second derivative of half the sum of squares by the modulus, against that of its slope.
            let slope = |step: f64| -> f64 {
                let mut x = x.clone();
                x[0] += step;
                let values = residuals.residuals(&x).unwrap();
                let rows = residuals.jacobian_at(&x).unwrap();
                values.iter().zip(rows).map(|(value, row)| value * row[0]).sum()
            };
            let second = residuals.hessian_at(&x).unwrap()[0][0];
            let error = (second - (slope(1e-4) - slope(-1e-4)) / 2e-4).abs() / second.abs();
            assert!(error < 1e-6, "{}: second derivative {second}, {error:e}", channel.name());
        }
    }
}

#[test]
fn intervals_from_noisy_curvatures_and_strains_cover_the_modulus() {
    for channel in [channels()[0], PointChannel::strain(Point::ArcLength(0.05), [5e-3, 0.0])] {
        let covered = covered(channel);
        // 92 to 97 %.
        assert!((184..=194).contains(&covered), "{}: {covered}", channel.name());
    }
}

/// The spread of repeated readings at rest is noise, and no small motion that the model misses.
#[test]
fn repeated_readings_at_rest_have_the_size_of_their_mean() {
    let problem = short().problem().unwrap();
    let channel = PointChannel::strain(Point::ArcLength(0.03), [5e-3, 0.0]);
    let exact = at_rest(&problem, channel);
    let repeated = (0..30_u32).map(|k| Reading {
        time: None,
        value: exact * (1.0 + 1e-3 * (1.0 + 2.4 * f64::from(k)).sin()),
    });
    let report = fit(&problem, Sensor::new(channel, repeated.collect())).solve().unwrap();
    assert!(!report.warning_codes.contains(&Code::LargeResiduals), "{report}");
    let [low, high] = report.parameters[0].interval95.unwrap();
    assert!(low < 1e8 && high > 1e8 && high - low < 1e6, "{low} {high}");
}

#[test]
fn tables_of_curvature_and_strain_are_read() {
    let (problem, folder) = (short().problem().unwrap(), tempfile::tempdir().unwrap());
    let times = steps(&problem);
    let curvature = model(&problem, PointChannel::curvature(Point::ArcLength(0.1), 0), &times);
    let strain = PointChannel::strain(Point::ArcLength(0.1), [5e-3, 0.0]);
    let strain = model(&problem, strain, &times);
    let point = "point = { arc_length = 0.1 }";
    for (keys, text) in [
        ("quantity = \"curvature\"\nsigma = 0.01", table("t,k1[1/mm]", 1e3, &curvature)),
        (
            "quantity = \"curvature\"\ntare = [0.0, 0.0]\nsigma = 0.01",
            table("t,curvature", 1.0, &curvature),
        ),
        // The second director of the sensor is the first one of the rod.
        (
            "quantity = \"curvature\"\nsigma = 0.01\nrotation = [-1.5707963267948966, 0.0, 0.0]",
            table("t,kappa2", 1.0, &curvature),
        ),
        (
            "quantity = \"strain\"\noffset = [5e-3, 0.0]\nsigma = 1e-5",
            table("t,strain[%]", 1e-2, &strain),
        ),
        (
            "quantity = \"strain\"\noffset = [0.0, 5e-3, 0.0]\nsigma = 1e-5\ntare = \"free\"",
            table("t,eps[um/m]", 1e-6, &strain),
        ),
        (
            "quantity = \"strain\"\noffset = [5e-3, 0.0]\nsigma = 1e-5\ntare = 0.0",
            table("t,strain[µε]", 1e-6, &strain),
        ),
    ] {
        let read = fit_file(&folder, &format!("{point}\n{keys}"), &text).unwrap();
        let report = read.fit().analyse(same_mesh()).solve().unwrap();
        let off = (report.parameters[0].value.unwrap() / 1e8 - 1.0).abs();
        assert!(off < 1e-7, "{keys}: {off:e}");
    }
}

#[test]
fn invalid_keys_of_strains_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let [strain, curvature] = ["strain", "curvature"].map(|own| format!("quantity = \"{own}\"\n"));
    for (keys, key) in [
        (strain.clone(), "observation[0].offset"),
        (format!("{strain}offset = [0.0, 0.0]\nof = \"start\""), "observation[0].of"),
        (format!("{strain}tare = [0.1, 0.0]"), "observation[0].tare"),
        (
            format!("{strain}offset = [0.0, 0.0]\naxes = [\"x\", \"y\", \"z\"]"),
            "observation[0].axes",
        ),
        (format!("{curvature}axes = [\"x\", \"y\", \"z\"]"), "observation[0].axes"),
        (format!("{curvature}tare = 0.1"), "observation[0].tare"),
        (format!("{curvature}offset = [0.0, 0.1]"), "observation[0].offset"),
    ] {
        let [found, ..] = refused(fit_file(&folder, &keys, "t,strain,k1\n0.01,1,1\n"));
        assert_eq!(found, key, "{keys}");
    }
    let error = fit_file(&folder, &format!("{strain}offset = [1.0]"), "t,strain\n0.01,1\n");
    assert!(error.unwrap_err().to_string().contains("3 numbers, or 2"));
    let error = fit_file(&folder, &curvature, "t,x\n0.01,1\n").unwrap_err().to_string();
    assert!(error.contains("allowed: at least one of k1, k2"), "{error}");
    // What only the scene shows is refused by the fit.
    let problem = short().problem().unwrap();
    let reading = vec![Reading { time: Some(0.01), value: 1.0 }];
    let along = PointChannel::strain(Point::Tip, [1e-3, 0.0]).rotated([0.0, 0.0, 0.5]);
    let endless = PointChannel::strain(Point::Tip, [f64::INFINITY, 0.0]);
    // Ten radii from the axis: 5 mm in a wrong unit.
    let outside = PointChannel::strain(Point::Tip, [0.03, 0.04]);
    for (channel, key) in [
        (PointChannel::curvature(Point::ArcLength(7.0), 0), "observation[0].point"),
        (PointChannel::curvature(Point::Tip, 1), "observation[0].rotation"),
        (
            PointChannel::curvature(Point::Tip, 0).rotated([0.0, 0.5, 0.5]),
            "observation[0].rotation",
        ),
        (along, "observation[0].offset"),
        (endless, "observation[0].offset"),
        (outside, "observation[0].offset"),
    ] {
        let channel: SensorChannel = channel.into();
        let [found, ..] =
            refused(fit(&problem, Sensor::new(channel, reading.clone()).sigma(0.1)).solve());
        assert_eq!(found, key, "{}", channel.name());
    }
}

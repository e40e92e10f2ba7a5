//! Load-deflection curves: exact data of the discrete rod, the closed-form elastica, derivatives, coverage, and fit
//! files.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{
    Buckling, FitFile, FitReport, Grade, InputSensitivity, LoadDeflection, LoadedPoint,
};
use rodfit::scene::{Material, PointForce, Scene, Section, SensorModel, Shape};
use rodfit::{Fit, Parameter, Point, Problem};

use crate::common::fits::{of_a_right_mesh, same_mesh};

use crate::common::{at_tip, straight_rod};

const LENGTH: f64 = 0.5;
const RADIUS: f64 = 1e-3;
const MODULUS: f64 = 2e9;

/// A horizontal cantilever without weight, with a force at its tip.
fn cantilever(segments: Option<usize>) -> Scene {
    let material = Material::new(1200.0, MODULUS);
    let mut scene = straight_rod(20, [LENGTH, RADIUS], material);
    scene.rod.segments = segments;
    scene.loads.gravity = [0.0; 3];
    scene.loads.point = at_tip([0.0, -0.1, 0.0]);
    scene
}

fn bending_stiffness() -> f64 {
    MODULUS * std::f64::consts::PI * RADIUS.powi(4) / 4.0
}

fn load() -> Parameter {
    "loads.point.0.force.y".parse().unwrap()
}

/// Loads from 0.2 to 3 times `E I/L^2`, downwards.
fn loads() -> Vec<f64> {
    let unit = bending_stiffness() / (LENGTH * LENGTH);
    [0.2, 0.5, 1.0, 1.5, 2.0, 3.0].map(|factor| -factor * unit).to_vec()
}

/// Displacements of the tip of the discrete rod along the axis.
fn simulated(problem: &Problem, axis: usize) -> Vec<LoadedPoint> {
    let tip =
        |value: f64| problem.with([(load(), value)]).unwrap().equilibrium().unwrap().tip[axis];
    let start = tip(0.0);
    loads().into_iter().map(|load| LoadedPoint { load, displacement: tip(load) - start }).collect()
}

/// The fit of Young's modulus to a curve of the tip along `axis`, on the mesh of the problem.
fn fitted(problem: &Problem, axis: usize, curve: Vec<LoadedPoint>, sigma: f64) -> FitReport {
    let start = problem.with([(Parameter::YoungsModulus, 1.4 * MODULUS)]).unwrap();
    let curve = LoadDeflection::new(load(), Point::Tip, axis, curve).sigma(sigma);
    let fit = Fit::new(&start).observe(curve).identify(Parameter::YoungsModulus);
    fit.analyse(same_mesh()).solve().unwrap()
}

fn modulus(report: &FitReport) -> f64 {
    report.estimate(Parameter::YoungsModulus).unwrap().value.unwrap()
}

#[test]
fn exact_curve_gives_the_modulus_of_the_discrete_rod() {
    let problem = cantilever(Some(20)).problem().unwrap();
    for axis in [0, 1] {
        let report = fitted(&problem, axis, simulated(&problem, axis), 1e-4);
        let off = modulus(&report) / MODULUS - 1.0;
        assert!(off.abs() < 1e-6, "axis {axis}: {off:e}");
        assert_eq!(report.units, ["m"]);
    }
}

/// A strip of steel with its weight, and a soft rod that hangs down and stretches, fit some readings equally well. The
/// modulus nearer to the scene is the result, whatever the noise, and the report lists the other one.
#[test]
fn soft_rod_that_hangs_down_is_not_the_result() {
    let material = Material::new(7850.0, 2e11);
    let shape = Shape::Straight { length: 0.3, direction: [1.0, 0.0, 0.0] };
    let section = Section::Rectangle { width: 0.02, height: 0.001, up: [0.0, 1.0, 0.0] };
    let mut scene = Scene::new(20, shape, section, material);
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.loads.point = cantilever(None).loads.point;
    let problem = scene.problem().unwrap();
    let (mut random, noise) = (ChaCha8Rng::seed_from_u64(5), Normal::new(0.0, 1e-4).unwrap());
    let tip = |value: f64| problem.with([(load(), value)]).unwrap().equilibrium().unwrap().tip[1];
    for seed in 0..6 {
        let mut reading = |force: f64| LoadedPoint {
            load: -force,
            displacement: tip(-force) - tip(0.0) + noise.sample(&mut random),
        };
        let curve = [0.05, 0.1, 0.15, 0.2].map(&mut reading).to_vec();
        let start = problem.with([(Parameter::YoungsModulus, 8e10)]).unwrap();
        let curve = LoadDeflection::new(load(), Point::Tip, 1, curve).sigma(1e-4);
        let fit = Fit::new(&start).observe(curve).identify(Parameter::YoungsModulus);
        let report = fit.analyse(same_mesh()).solve().unwrap();
        println!("{seed}: {:e}, {:?}", modulus(&report), report.warnings);
        assert!((modulus(&report) / 2e11 - 1.0).abs() < 0.06, "{report}");
        // No solid of this density is as soft as the rod that hangs down.
        assert_eq!(report.grade, Grade::Trustworthy, "{report}");
        let others = &report.local_minima.list;
        assert!(others.iter().any(|own| own.values[0] < 1e7), "{others:?}");
    }
}

/// Deflections depend on `P/(E I)` only: a calibration error of 1 % of all loads is one of 1 % of the modulus.
#[test]
fn sensitivity_to_the_load_is_that_of_a_common_factor() {
    let problem = cantilever(Some(20)).problem().unwrap();
    let curve = LoadDeflection::new(load(), Point::Tip, 1, simulated(&problem, 1)).sigma(1e-4);
    let fit = Fit::new(&problem).observe(curve).identify(Parameter::YoungsModulus);
    let report = fit.analyse(of_a_right_mesh()).solve().unwrap();
    let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
    let of_load = |input: &&InputSensitivity| input.source.starts_with("loads.point.0.force");
    let input = estimate.input_sensitivities.iter().find(of_load).unwrap();
    assert!((input.change / (0.01 * MODULUS) - 1.0).abs() < 1e-2, "{input:?}");
}

/// Curves of two loads, each under the other one as the scene has it. Deflections depend on both `P/(E I)` only: 1 % of
/// both loads together are 1 % of the modulus.
#[test]
fn sensitivities_to_the_loads_of_two_curves_add_up_to_that_of_a_common_factor() {
    let mut scene = cantilever(Some(20));
    let own = [-0.005, -0.006];
    scene.loads.point[0].force[1] = own[0];
    let second =
        PointForce { node: Point::Node(10), force: [0.0, own[1], 0.0], ..Default::default() };
    scene.loads.point.push(second);
    let problem = scene.problem().unwrap();
    let loads: [Parameter; 2] =
        ["loads.point.0.force.y", "loads.point.1.force.y"].map(|path| path.parse().unwrap());
    let curve = |load: Parameter| {
        let tip = |value: f64| problem.with([(load, value)]).unwrap().equilibrium().unwrap().tip[1];
        let start = tip(0.0);
        let values = [-0.002, -0.01, -0.02].into_iter();
        let points =
            values.map(|load| LoadedPoint { load, displacement: tip(load) - start }).collect();
        LoadDeflection::new(load, Point::Tip, 1, points).sigma(1e-4)
    };
    let fit = Fit::new(&problem).observe(curve(loads[0])).observe(curve(loads[1]));
    let report = fit.identify(Parameter::YoungsModulus).analyse(of_a_right_mesh()).solve().unwrap();
    let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
    let of_load = |input: &&InputSensitivity| input.source.starts_with("loads.point.");
    let inputs: Vec<_> = estimate.input_sensitivities.iter().filter(of_load).collect();
    let sum: f64 = inputs.iter().map(|input| input.change).sum();
    assert_eq!(inputs.len(), 2, "{inputs:?}");
    assert!((sum / (0.01 * MODULUS) - 1.0).abs() < 1e-2, "{inputs:?}");
}

/// Load `P L^2/(E I)` and deflection over length of the elastica whose tip turns by `angle`: `theta'^2 = 2 P/(E I)
/// (sin(angle)
/// - sin(theta))`, with `theta = angle (1 - t^2)`, by Simpson's rule.
fn elastica(angle: f64) -> [f64; 2] {
    const PARTS: usize = 2000;
    let (mut length, mut deflection) = (0.0, 0.0);
    for k in 0..=PARTS {
        let t = k as f64 / PARTS as f64;
        let theta = angle * (1.0 - t * t);
        let piece = match k {
            0 => 2.0 * (angle / angle.cos()).sqrt(),
            _ => 2.0 * angle * t / (angle.sin() - theta.sin()).sqrt(),
        };
        let weight = if k == 0 || k == PARTS { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
        length += weight * piece / (3 * PARTS) as f64;
        deflection += weight * piece * theta.sin() / (3 * PARTS) as f64;
    }
    // The length is `integral / sqrt(2 P/(E I))`.
    [0.5 * length * length, deflection / length]
}

/// The error of the modulus is that of the mesh: of second order, and below 1e-4 at 200 segments. The curve of a chosen
/// mesh is within the stated discretization error.
#[test]
fn closed_form_elastica_gives_the_modulus_up_to_the_mesh() {
    let unit = bending_stiffness() / (LENGTH * LENGTH);
    let curve: Vec<LoadedPoint> = [0.1, 0.3, 0.6, 0.9, 1.2]
        .map(|angle| {
            let [load, deflection] = elastica(angle);
            LoadedPoint { load: -load * unit, displacement: -deflection * LENGTH }
        })
        .to_vec();
    // A small angle is the linear beam, P L^3/(3 E I).
    let [small, deflection] = elastica(1e-3);
    assert!((deflection / small - 1.0 / 3.0).abs() < 1e-6);
    let off = |segments: usize| {
        let problem = cantilever(Some(segments)).problem().unwrap();
        modulus(&fitted(&problem, 1, curve.clone(), 1e-4)) / MODULUS - 1.0
    };
    let [coarse, middle, fine] = [20, 40, 200].map(off);
    println!("error of the modulus {coarse:e} {middle:e} {fine:e}");
    assert!((coarse / middle).abs() > 3.0 || coarse.abs() < 1e-5, "{coarse:e} {middle:e}");
    assert!(fine.abs() < 1e-4, "{fine:e}");
    let scene = cantilever(None);
    let measured = LoadDeflection::new(load(), Point::Tip, 1, curve).sigma(1e-6);
    let fit = Fit::new(&scene.problem().unwrap()).observe(measured);
    let report = fit.identify(Parameter::YoungsModulus).solve().unwrap();
    let off = modulus(&report) / MODULUS - 1.0;
    assert!(off.abs() < 2e-4, "{off:e}\n{report}");
}

#[test]
fn jacobian_equals_differences_of_residuals() {
    let mut scene = cantilever(Some(20));
    scene.loads.gravity = [0.0, -2.0, 0.0];
    scene.rod.shape = Shape::Arc { length: LENGTH, angle: 0.5 };
    let problem = scene.problem().unwrap();
    let at = |load: f64, displacement: f64| LoadedPoint { load, displacement };
    let curve = [-0.005, -0.01, -0.02, 0.01, 0.02].map(|load| at(load, load)).to_vec();
    for point in [Point::Tip, Point::ArcLength(0.23)] {
        let curve = LoadDeflection::new(load(), point, 1, curve.clone()).sigma(1e-3);
        let parameters = [
            Parameter::YoungsModulus,
            Parameter::Density,
            Parameter::Radius,
            "rod.shape.length".parse().unwrap(),
        ];
        let fit = Fit::new(&problem).observe(curve);
        let fit = parameters.into_iter().fold(fit, |fit, parameter| fit.identify(parameter));
        let residuals = fit.residuals().unwrap();
        let x = parameters.map(|p: Parameter| p.of(&scene).unwrap().ln());
        let rows = residuals.jacobian_at(&x).unwrap();
        for k in 0..x.len() {
            let h = 1e-5;
            let moved = |by: f64| {
                let mut x = x;
                x[k] += by;
                residuals.residuals(&x).unwrap()
            };
            let [high, low] = [h, -h].map(moved);
            for ((row, high), low) in rows.iter().zip(high).zip(low) {
                let expected = (high - low) / (2.0 * h);
                let off = (row[k] - expected).abs() / expected.abs().max(1.0);
                assert!(off < 1e-6, "{}: {} {expected}", parameters[k], row[k]);
            }
        }
    }
}

/// A gauge at 1 mm without load biases the modulus. The score test names it, the report is not trustworthy, and as a
/// parameter the offset and the modulus are exact.
#[test]
fn gauge_that_is_not_at_zero_is_named_and_identified() {
    let mut scene = cantilever(Some(20));
    scene.sensors = vec![SensorModel::new("dial")];
    let problem = scene.problem().unwrap();
    let (offset, sigma) = (1e-3, 1e-4);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let noise = Normal::new(0.0, sigma).unwrap();
    let exact: Vec<LoadedPoint> = simulated(&problem, 1)
        .into_iter()
        .map(|own| LoadedPoint { displacement: own.displacement + offset, ..own })
        .collect();
    let noisy = exact.iter().map(|own| LoadedPoint {
        displacement: own.displacement + noise.sample(&mut random),
        ..*own
    });
    let fit = |curve: Vec<LoadedPoint>| {
        let curve = LoadDeflection::new(load(), Point::Tip, 1, curve).sigma(sigma);
        Fit::new(&problem).observe(curve.of_sensor("dial")).identify(Parameter::YoungsModulus)
    };
    let report = fit(noisy.collect()).analyse(of_a_right_mesh()).solve().unwrap();
    println!("{report}");
    assert!(report.grade != Grade::Trustworthy && report.grade != Grade::NotUsable, "{report}");
    let source = "sensors.dial.zero_offset";
    let test = report.score_tests.iter().find(|test| test.source == source).unwrap();
    assert!(test.rank == 1 && (test.estimate / offset - 1.0).abs() < 0.5, "{test:?}");
    // A curve without a sensor has the same effect.
    let curve = LoadDeflection::new(load(), Point::Tip, 1, exact.clone()).sigma(sigma);
    let plain = Fit::new(&problem).observe(curve).identify(Parameter::YoungsModulus);
    let report = plain.analyse(of_a_right_mesh()).solve().unwrap();
    let own = report.score_tests.iter().find(|test| test.source == "sensors.gauge-0.zero_offset");
    assert!(own.is_some_and(|test| test.rank == 1), "{report}");
    // Identified from exact data.
    let both = fit(exact).identify(source.parse::<Parameter>().unwrap());
    let report = both.analyse(same_mesh()).solve().unwrap();
    let found = report.estimate(source.parse().unwrap()).unwrap().value.unwrap();
    let off = [modulus(&report) / MODULUS - 1.0, found / offset - 1.0];
    assert!(off.iter().all(|off| off.abs() < 1e-6), "{off:?}");
}

/// Without sigma the offset of a gauge, many times the noise, is a part of the residuals. It is no noise in its own test.
#[test]
fn offset_is_no_noise_in_its_own_test() {
    let problem = cantilever(Some(20)).problem().unwrap();
    let offset = 1e-3;
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let noise = Normal::new(0.0, 5e-5).unwrap();
    let curve: Vec<LoadedPoint> = simulated(&problem, 1)
        .into_iter()
        .map(|own| LoadedPoint {
            displacement: own.displacement + offset + noise.sample(&mut random),
            ..own
        })
        .collect();
    let fit = |offset: f64| {
        let curve =
            curve.iter().map(|own| LoadedPoint { displacement: own.displacement - offset, ..*own });
        let curve = LoadDeflection::new(load(), Point::Tip, 1, curve.collect());
        let fit = Fit::new(&problem).observe(curve).identify(Parameter::YoungsModulus);
        fit.analyse(of_a_right_mesh()).solve().unwrap()
    };
    let report = fit(offset);
    assert!(report.score_tests.iter().all(|test| !test.is_significant()), "{report}");
    let report = fit(0.0);
    println!("{report}");
    assert!(report.grade != Grade::Trustworthy, "{report}");
    let first = report.score_tests.iter().find(|test| test.rank == 1).unwrap();
    assert_eq!(first.source, "sensors.gauge-0.zero_offset", "{report}");
    assert!(first.p_value < 0.01 && (first.estimate / offset - 1.0).abs() < 0.5, "{first:?}");
}

/// A single value for one parameter fits any model: the verdict says so.
#[test]
fn fit_without_redundancy_does_not_check_the_model() {
    let problem = cantilever(Some(20)).problem().unwrap();
    let report = |count: usize| {
        let curve = simulated(&problem, 1).into_iter().take(count).collect();
        let curve = LoadDeflection::new(load(), Point::Tip, 1, curve).sigma(1e-4);
        let fit = Fit::new(&problem).observe(curve).identify(Parameter::YoungsModulus);
        fit.analyse(of_a_right_mesh()).solve().unwrap()
    };
    let verdict = "no more values than parameters";
    let [one, two] = [1, 2].map(report);
    assert!(one.grade == Grade::Trustworthy && one.verdict.contains(verdict), "{one}");
    assert!(!two.verdict.contains(verdict), "{two}");
}

/// A gauge has no delay, and must be in the scene; other sensors have no zero offset.
#[test]
fn unsuitable_sensors_of_curves_are_refused() {
    let mut scene = cantilever(Some(20));
    let refused = |scene: &Scene, name: &str| {
        let problem = scene.problem().unwrap();
        let point = LoadedPoint { load: -0.1, displacement: -0.01 };
        let curve = LoadDeflection::new(load(), Point::Tip, 1, vec![point]).sigma(1e-4);
        let fit = Fit::new(&problem).observe(curve.of_sensor(name));
        fit.identify(Parameter::YoungsModulus).solve().unwrap_err().to_string()
    };
    assert!(refused(&scene, "dial").contains("which has no [[sensors]]"));
    scene.sensors = vec![SensorModel { delay: 0.1, ..SensorModel::new("dial") }];
    assert!(refused(&scene, "dial").contains("sensors.dial: found other numbers"));
}

/// 95 % of 200 intervals: 190 expected; two standard deviations of the count are 6.
#[test]
fn intervals_cover_the_truth_in_95_per_cent_of_fits() {
    let problem = cantilever(Some(10)).problem().unwrap();
    let (exact, sigma) = (simulated(&problem, 1), 2e-3);
    let mut covered = 0;
    for seed in 0..200 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let noise = Normal::new(0.0, sigma).unwrap();
        let noisy = exact.iter().map(|own| LoadedPoint {
            displacement: own.displacement + noise.sample(&mut random),
            ..*own
        });
        let report = fitted(&problem, 1, noisy.collect(), sigma);
        let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
        let [low, high] = estimate.interval95.unwrap();
        covered += usize::from((low..=high).contains(&MODULUS));
    }
    println!("{covered} of 200 intervals cover the truth");
    assert!((184..=196).contains(&covered), "{covered} of 200");
}

/// Euler's load of a clamped column gives the modulus to 1e-4 at 100 segments, and on a chosen mesh.
#[test]
fn critical_load_gives_the_modulus() {
    let euler = std::f64::consts::PI.powi(2) * bending_stiffness() / (4.0 * LENGTH * LENGTH);
    let load: Parameter = "loads.point.0.force.x".parse().unwrap();
    for segments in [Some(100), None] {
        let mut scene = cantilever(segments);
        scene.loads.point[0].force = [0.0; 3];
        scene.material.youngs_modulus = 1.4 * MODULUS;
        let measured = Buckling::new(load, -euler, 1e-3 * euler);
        let fit = Fit::new(&scene.problem().unwrap()).observe(measured);
        let report = fit.identify(Parameter::YoungsModulus).solve().unwrap();
        let off = modulus(&report) / MODULUS - 1.0;
        assert!(off.abs() < 1e-4, "{segments:?}: {off:e}\n{report}");
        let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
        // The relative standard error is that of the load.
        let error = estimate.std_error.unwrap() / MODULUS;
        assert!((error / 1e-3 - 1.0).abs() < 1e-2, "{error}");
    }
}

/// The text of a fit file with the scene `scene.toml`.
fn fit_text(keys: &str, parameters: &str) -> String {
    format!("scene = \"scene.toml\"\n[[load_deflection]]\n{keys}\n{parameters}")
}

/// A lateral curve and a critical load of one rod, each measured alone: one fit of both has the modulus of each. Half
/// the critical load would double the deflections of the curve.
#[test]
fn curve_and_critical_load_of_one_experiment_are_separate_tests() {
    let folder = std::env::temp_dir().join("rodfit-curve-and-critical-load");
    std::fs::create_dir_all(&folder).unwrap();
    let mut scene = cantilever(Some(20));
    scene.loads.point[0].force = [0.0; 3];
    std::fs::write(folder.join("scene.toml"), scene.to_toml().unwrap()).unwrap();
    let problem = scene.problem().unwrap();
    let rows = simulated(&problem, 1).into_iter();
    let rows = rows.map(|row| format!("{},{}\n", row.load, row.displacement));
    std::fs::write(
        folder.join("bending.csv"),
        format!("load[N],y[m]\n{}", rows.collect::<String>()),
    )
    .unwrap();
    let axial: Parameter = "loads.point.0.force.x".parse().unwrap();
    let euler = -2.4674 * bending_stiffness() / (LENGTH * LENGTH);
    let critical = problem.critical_load(axial, euler, &[]).unwrap().value;
    let curve = "[[load_deflection]]\nload = \"loads.point.0.force.y\"\nfile = \"bending.csv\"\nsigma = 1e-4\n";
    let buckling = format!("[[buckling]]\nload = \"{axial}\"\nvalue = {critical}\nsigma = 1e-4\n");
    let parameter = "[[parameter]]\nname = \"youngs_modulus\"\nstart = 3e9\n";
    for tables in [curve.to_string(), buckling.clone(), format!("{curve}{buckling}")] {
        let text = format!("scene = \"scene.toml\"\n{tables}{parameter}");
        let report = FitFile::from_toml(&text, &folder).unwrap().fit().analyse(same_mesh()).solve();
        let off = modulus(&report.unwrap()) / MODULUS - 1.0;
        assert!(off.abs() < 1e-6, "{off:e} from\n{tables}");
    }
    // The order in which the tables are added does not matter.
    let first = FitFile::from_toml(&format!("scene = \"scene.toml\"\n{curve}{parameter}"), &folder);
    let report = first.unwrap().fit().analyse(same_mesh()).add_toml(&buckling, &folder).unwrap();
    let off = modulus(&report.solve().unwrap()) / MODULUS - 1.0;
    assert!(off.abs() < 1e-6, "{off:e}");
}

#[test]
fn fit_file_reads_units_and_factor_and_rejects_wrong_tables() {
    let folder = std::env::temp_dir().join("rodfit-load-deflection");
    std::fs::create_dir_all(&folder).unwrap();
    let scene = cantilever(Some(20));
    std::fs::write(folder.join("scene.toml"), scene.to_toml().unwrap()).unwrap();
    let problem = scene.problem().unwrap();
    let rows = simulated(&problem, 1).into_iter().map(|LoadedPoint { load, displacement }| {
        format!("{},{}\n", -1e3 * load, 1e3 * displacement)
    });
    let table = format!("load[mN],y[mm]\n{}", rows.collect::<String>());
    std::fs::write(folder.join("bending.csv"), table).unwrap();
    let keys = "load = \"loads.point.0.force.y\"\nfile = \"bending.csv\"\nload_factor = -1.0\nsigma = 1e-4\n";
    let parameter = "[[parameter]]\nname = \"youngs_modulus\"\nstart = 3e9\n";
    let file = FitFile::from_toml(&fit_text(keys, parameter), &folder).unwrap();
    let report = file.fit().analyse(same_mesh()).solve().unwrap();
    assert!((modulus(&report) / MODULUS - 1.0).abs() < 1e-6, "{report}");
    let buckling =
        "[[buckling]]\nload = \"loads.point.0.force.x\"\nvalue = -0.0155\nsigma = 1e-4\n";
    let text = fit_text(keys, &format!("{buckling}{parameter}"));
    let both = FitFile::from_toml(&text, &folder).unwrap();
    assert_eq!(both.experiments[0].measurements.len(), 2);
    let rejected = |keys: &str, parameter: &str, parts: [&str; 2]| {
        let error =
            FitFile::from_toml(&fit_text(keys, parameter), &folder).unwrap_err().to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    };
    rejected(&keys.replace("force.y", "force.q"), parameter, ["force.q", ""]);
    let density = keys.replace("loads.point.0.force.y", "density");
    rejected(&density, parameter, ["load_deflection[0].load", "force or moment"]);
    let unknown = "[[parameter]]\nname = \"loads.point.0.force.y\"\n";
    rejected(keys, unknown, ["load_deflection[0].load", "no parameter of the fit"]);
    rejected(&keys.replace("-1.0", "0.0"), parameter, ["load_factor", "not 0"]);
    // Millimeters without a unit would be a deflection of many lengths.
    std::fs::write(folder.join("bending.csv"), "load,y\n0.01,20\n").unwrap();
    rejected(keys, parameter, ["a displacement of 20.0000 m", "y[mm]"]);
    std::fs::write(folder.join("bending.csv"), "F[N],y[mm]\n1,2\n").unwrap();
    rejected(keys, parameter, ["bending.csv", "a column load"]);
    std::fs::write(folder.join("bending.csv"), "load[N],w[mm]\n1,2\n").unwrap();
    rejected(keys, parameter, ["bending.csv", "a column x, y or z"]);
}

//! Sensors at a point of the rod: angle of the tangent and acceleration. Values against positions and a rigid pendulum;
//! exact data give the modulus; coverage with noise; tables with other units; invalid input.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{FitFile, PointChannel, Reading, Sensor, SensorChannel, Tare};
use rodfit::scene::Scene;
use rodfit::{Fit, Parameter, Point, Problem, Unknown};
use std::f64::consts::PI;

use crate::calls::{refused, short};
use crate::common::fits::{record, same_mesh};

/// A fit of the modulus to one sensor.
pub fn fit(problem: &Problem, sensor: Sensor) -> Fit {
    let modulus = Unknown::new(Parameter::YoungsModulus).start(1e8);
    Fit::new(problem).observe(sensor).identify(modulus).analyse(same_mesh())
}

/// The model's values of a channel at these times: residuals of readings of zero with a standard deviation of one.
pub fn model(problem: &Problem, channel: impl Into<SensorChannel>, times: &[f64]) -> Vec<Reading> {
    let zero = times.iter().map(|t| Reading { time: Some(*t), value: 0.0 }).collect();
    let residuals = fit(problem, Sensor::new(channel, zero).sigma(1.0)).residuals().unwrap();
    let values = residuals.residuals(&[problem.scene().material.youngs_modulus.ln()]).unwrap();
    times.iter().zip(values).map(|(t, value)| Reading { time: Some(*t), value }).collect()
}

/// The times of all steps but the start.
pub fn steps(problem: &Problem) -> Vec<f64> {
    let time = problem.time().unwrap();
    (1..=time.steps()).map(|k| k as f64 * time.step_size()).collect()
}

/// The channels of the tests: angles at the tip and within the rod, accelerations along and across the rod.
fn channels() -> [PointChannel; 4] {
    [
        PointChannel::angle(Point::Tip),
        PointChannel::angle(Point::ArcLength(0.21)).rotated([0.0, 0.0, 0.4]),
        PointChannel::acceleration(Point::Tip, 1),
        PointChannel::acceleration(Point::ArcLength(0.3), 0).rotated([0.0, 0.0, 0.2]),
    ]
}

/// The angle is that of the line through two points 2 mm apart, but for the mesh error of edges of 8 mm.
#[test]
fn angle_of_tangent_is_that_of_positions() {
    let mut scene = short();
    scene.rod.segments = Some(60);
    let problem = scene.problem().unwrap();
    let run = problem.simulate().unwrap();
    let times = steps(&problem);
    let readings = model(&problem, PointChannel::angle(Point::ArcLength(0.2)), &times);
    for Reading { time, value } in readings {
        let at = |s: f64| run.at(Point::ArcLength(s), time.unwrap()).unwrap().0;
        let [before, after] = [at(0.199), at(0.201)];
        let angle = (after[1] - before[1]).atan2(after[0] - before[0]);
        assert!((value - angle).abs() < 1e-4, "{time:?}: {value} {angle}");
    }
}

/// A stiff rod hinged at one end is a rigid pendulum. Released from the horizontal, at the angle q below it, its tip
/// has the acceleration 3 g sin q toward the hinge and 1.5 g cos q down across: less gravity, -4 g sin q along the
/// tangent and -0.5 g cos q along the first director.
#[test]
fn accelerations_of_rigid_pendulum_are_those_of_theory() {
    let text = "[rod]\nshape = { kind = \"straight\", length = 0.5, direction = [1, 0, 0] }\nsegments = 20\n\
                section = { kind = \"circle\", radius = 0.01 }\n[material]\ndensity = 1000\nyoungs_modulus = 1e11\n\
                [loads]\ngravity = [0, -9.8, 0]\n[supports]\nstart = \"pinned\"\n\
                [time]\nend = 0.35\nstep = 5e-4\nscheme = \"generalised-alpha\"\nrho_inf = 0.0\n";
    let problem = Scene::from_toml(text, ".").unwrap().problem().unwrap();
    // Elastic vibrations of the release are damped by the scheme in the first 0.1 s.
    let times: Vec<f64> = steps(&problem).into_iter().filter(|t| *t > 0.1).collect();
    let of = |channel| model(&problem, channel, &times);
    let angles = of(PointChannel::angle(Point::Tip));
    let along = of(PointChannel::acceleration(Point::Tip, 0));
    let across = of(PointChannel::acceleration(Point::Tip, 1));
    for ((angle, along), across) in angles.iter().zip(&along).zip(&across) {
        let (sin, cos) = (-angle.value).sin_cos();
        let errors = [along.value + 4.0 * 9.8 * sin, across.value + 0.5 * 9.8 * cos];
        // Lumped masses of 20 edges change the inertia by 1/(2 20^2) = 1.25e-3, and accelerations up to 3 g by 0.037
        // m/s^2.
        assert!(errors.iter().all(|e| e.abs() < 0.045), "{:?}: {errors:?}", angle.time);
    }
    assert!(angles.last().unwrap().value < -1.2);
}

#[test]
fn exact_angle_or_acceleration_gives_modulus() {
    let problem = short().problem().unwrap();
    for channel in channels() {
        let exact = model(&problem, channel, &steps(&problem));
        let shifted = exact.iter().map(|r| Reading { value: r.value + 2.0, ..*r }).collect();
        for sensor in [
            Sensor::new(channel, exact.clone()).sigma(1e-3),
            Sensor::new(channel, shifted).sigma(1e-3).tare(Tare::Free),
        ] {
            let report = fit(&problem.with([(Parameter::YoungsModulus, 1.2e8)]).unwrap(), sensor);
            let report = report.solve().unwrap();
            let off = (report.parameters[0].value.unwrap() / 1e8 - 1.0).abs();
            assert!(off < 1e-7, "{} off by {off:e}", channel.name());
        }
    }
}

#[test]
fn angle_at_rest_gives_modulus_and_whole_turns_do_not_matter() {
    let problem = short().problem().unwrap();
    let zero = vec![Reading { time: None, value: 0.0 }];
    let channel = PointChannel::angle(Point::Tip);
    let residuals = fit(&problem, Sensor::new(channel, zero).sigma(1.0)).residuals().unwrap();
    let value = residuals.residuals(&[1e8_f64.ln()]).unwrap()[0];
    assert!(value < -0.01, "the rod droops: {value}");
    for turns in [0.0, 2.0 * PI] {
        let sensor = Sensor::new(channel, vec![Reading { time: None, value: value + turns }]);
        let report = fit(&problem, sensor.sigma(1e-4)).solve().unwrap();
        let off = (report.parameters[0].value.unwrap() / 1e8 - 1.0).abs();
        assert!(off < 1e-7, "off by {off:e}");
    }
}

/// Positions over time beside an angle at rest: the motion does not record the nodes of the angle.
#[test]
fn angle_at_rest_beside_a_recorded_motion_gives_modulus() {
    let problem = short().problem().unwrap();
    let place = Point::ArcLength(0.21);
    let at_rest = |value: f64| vec![Reading { time: None, value }];
    let channel = PointChannel::angle(place);
    let zero = fit(&problem, Sensor::new(channel, at_rest(0.0)).sigma(1.0)).residuals().unwrap();
    let value = zero.residuals(&[1e8_f64.ln()]).unwrap()[0];
    let tip = record(&problem.simulate().unwrap(), 50).sigma(1e-4);
    let sensor = Sensor::new(channel, at_rest(value)).sigma(1e-3);
    let report = fit(&problem, sensor).observe(tip).solve().unwrap();
    let off = (report.parameters[0].value.unwrap() / 1e8 - 1.0).abs();
    assert!(off < 1e-7, "off by {off:e}");
}

/// Two bad readings of opposite sign shift no other reading by a turn.
#[test]
fn outliers_of_angles_leave_other_residuals_unchanged() {
    let problem = short().problem().unwrap();
    let channel = PointChannel::angle(Point::Tip);
    let mut readings = model(&problem, channel, &steps(&problem));
    readings[2].value -= 2.98;
    readings[3].value += 2.98;
    let residuals = fit(&problem, Sensor::new(channel, readings).sigma(1.0)).residuals().unwrap();
    let values = residuals.residuals(&[1e8_f64.ln()]).unwrap();
    assert!(values[4..].iter().all(|value| value.abs() < 1e-9), "{values:?}");
}

/// Of 200 noisy data sets of a channel, the number whose 95 % interval contains the modulus. The expectation is 190,
/// the standard deviation 3.1.
pub fn covered(channel: PointChannel) -> usize {
    let mut scene = short();
    scene.rod.segments = Some(6);
    let problem = scene.problem().unwrap();
    let exact = model(&problem, channel, &steps(&problem));
    let size = exact.iter().map(|r| r.value.abs()).fold(0.0, f64::max);
    let noise = Normal::new(0.0, 0.05 * size).unwrap();
    let contains = |seed: &u64| {
        let mut random = ChaCha8Rng::seed_from_u64(*seed);
        let mut noisy = |r: &Reading| Reading { value: r.value + noise.sample(&mut random), ..*r };
        let sensor = Sensor::new(channel, exact.iter().map(&mut noisy).collect());
        let report = fit(&problem, sensor).solve().unwrap();
        let [low, high] = report.parameters[0].interval95.unwrap();
        (low..=high).contains(&1e8)
    };
    let covered = (0..200).filter(contains).count();
    println!("{}: {covered} of 200 intervals", channel.name());
    covered
}

#[test]
fn intervals_from_noisy_angles_and_accelerations_cover_the_modulus() {
    for channel in [PointChannel::angle(Point::Tip), PointChannel::acceleration(Point::Tip, 1)] {
        let covered = covered(channel);
        assert!((184..=196).contains(&covered), "{}: {covered}", channel.name());
    }
}

/// The fit file of a folder with a scene and one observation that has these keys, of a table `sensor.csv` with this
/// text.
pub fn fit_file(
    folder: &tempfile::TempDir,
    keys: &str,
    table: &str,
) -> Result<FitFile, rodfit::Error> {
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("scene.toml"), short().to_toml().unwrap()).unwrap();
    std::fs::write(path("sensor.csv"), table).unwrap();
    let text = format!(
        "scene = \"scene.toml\"\n[[parameter]]\nname = \"material.youngs_modulus\"\n[[observation]]\n\
         file = \"sensor.csv\"\n{keys}\n"
    );
    std::fs::write(path("fit.toml"), text).unwrap();
    FitFile::load(path("fit.toml"))
}

/// A table with the values over a unit.
pub fn table(header: &str, unit: f64, readings: &[Reading]) -> String {
    let row = |r: &Reading| format!("{},{}\n", r.time.unwrap(), r.value / unit);
    format!("{header}\n{}", readings.iter().map(row).collect::<String>())
}

#[test]
fn tables_of_degrees_and_of_gravity_are_read() {
    let (problem, folder) = (short().problem().unwrap(), tempfile::tempdir().unwrap());
    let times = steps(&problem);
    let angle = model(&problem, PointChannel::angle(Point::Tip), &times);
    let across = model(&problem, PointChannel::acceleration(Point::Tip, 1), &times);
    for (keys, text) in [
        ("quantity = \"angle\"\nsigma = 0.01", table("t,angle[deg]", PI / 180.0, &angle)),
        ("quantity = \"angle\"\nsigma = 0.01\ntare = \"free\"", table("t,theta", 1.0, &angle)),
        // The sensor's x axis is the first director.
        (
            "quantity = \"acceleration\"\nsigma = 0.1\naxes = [\"-y\", \"x\", \"z\"]",
            table("t,ax[g]", 9.80665, &across),
        ),
        ("quantity = \"acceleration\"\nsigma = 0.1\npoint = \"tip\"", table("t,ay", 1.0, &across)),
    ] {
        let report = fit_file(&folder, keys, &text).unwrap().fit().analyse(same_mesh());
        let report = report.solve().unwrap();
        let off = (report.parameters[0].value.unwrap() / 1e8 - 1.0).abs();
        assert!(off < 1e-7, "{keys}: {off:e}");
    }
}

#[test]
fn invalid_keys_of_point_sensors_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let angle = "quantity = \"angle\"\n";
    for (keys, key) in [
        (format!("{angle}of = \"start\""), "observation[0].of"),
        (format!("{angle}tare = [0.1, 0.0, 0.0]"), "observation[0].tare"),
        (format!("{angle}axes = [\"x\", \"y\", \"z\"]"), "observation[0].axes"),
        (format!("{angle}offset = [0.0, 0.1, 0.0]"), "observation[0].offset"),
        (format!("{angle}point = {{ rod = \"a\", at = \"tip\" }}"), "observation[0].point"),
        ("quantity = \"force\"\nof = \"start\"\npoint = \"tip\"".into(), "observation[0].point"),
    ] {
        let [found, ..] = refused(fit_file(&folder, &keys, "t,angle\n0.01,1\n"));
        assert_eq!(found, key, "{keys}");
    }
    let error = fit_file(&folder, angle, "t,x\n0.01,1\n").unwrap_err().to_string();
    assert!(error.contains("allowed: at least one of angle"), "{error}");
    let error = fit_file(&folder, angle, "t,angle\n0.01,-16.9\n").unwrap_err().to_string();
    assert!(error.contains("up to 16.9") && error.contains("angle[deg]"), "{error}");
    // What only the scene shows is refused by the fit.
    let problem = short().problem().unwrap();
    let reading = |time| vec![Reading { time, value: 1.0 }];
    for (channel, time, key) in [
        (PointChannel::angle(Point::ArcLength(7.0)), Some(0.01), "observation[0].point"),
        (
            PointChannel::angle(Point::Tip).rotated([0.5 * PI, 0.0, 0.0]),
            Some(0.01),
            "observation[0].rotation",
        ),
        (PointChannel::acceleration(Point::Tip, 0), None, "observation[0].file"),
    ] {
        let [found, ..] =
            refused(fit(&problem, Sensor::new(channel, reading(time)).sigma(0.1)).solve());
        assert_eq!(found, key);
    }
}

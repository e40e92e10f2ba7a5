//! Sensors of the scene: rotation, position, delay and filter are identified from exact data beside the modulus;
//! derivatives; coverage with noise; invalid input.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{
    Channel, FitFile, PointChannel, PoseSensor, ReactionPart, Reading, Sensor, SensorChannel, Tare,
};
use rodfit::scene::{Dimension, End, Scene, SensorModel};
use rodfit::{Fit, FitReport, Parameter, Point, Trajectory, Unknown};

use crate::calls::{refused, short};
use crate::common::fits::{of_a_right_mesh, same_mesh};
use crate::point_poses::{PLACE, exact, measured, twisted};
use crate::point_sensors::{model, steps};
use crate::sensors::filtered;

/// Rotation of a frame about z, rad.
const TURN: f64 = 0.2;
/// Delay of the readings, s: not a whole number of steps.
const DELAY: f64 = 0.0071;
/// Position of a load cell relative to the wall, m.
const POSITION: [f64; 3] = [-0.03, 0.01, 0.0];
/// Gain of a cell.
const GAIN: f64 = 1.07;
/// Cutoff frequency, Hz.
const FREQUENCY: f64 = 20.0;

/// The component of the force of the wall along a world axis.
fn force(axis: usize) -> Channel {
    Channel::along_world(End::Start, ReactionPart::Force, axis)
}

/// A scene with a sensor without effect, of the name `cell`.
fn with_sensor(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.sensors = vec![SensorModel::new("cell")];
    scene
}

/// Value of an estimate.
fn value(report: &FitReport, name: &str) -> f64 {
    let parameter: Parameter = name.parse().unwrap();
    report.parameters.iter().find(|e| e.name == parameter).unwrap().value.unwrap()
}

/// Forces at the wall along x and y, at t = 0 and every step.
fn forces(scene: &Scene) -> [Vec<Reading>; 2] {
    let problem = scene.problem().unwrap();
    let mut run = Trajectory::new(&problem, &[], &[]).unwrap().keep_reactions();
    run.run(&problem, problem.time().unwrap().steps(), |_| {}).unwrap();
    let reactions = run.reactions();
    [0, 1].map(|axis| {
        let times = run.times().iter().enumerate();
        times
            .map(|(k, t)| Reading { time: Some(*t), value: reactions[k].start.force[axis] })
            .collect()
    })
}

/// The linear interpolant of readings at a time.
fn at(readings: &[Reading], time: f64) -> f64 {
    let after = readings.iter().position(|r| r.time.unwrap() > time).unwrap();
    let [before, after] = [readings[after - 1], readings[after]];
    let [t0, t1] = [before.time.unwrap(), after.time.unwrap()];
    before.value + (after.value - before.value) * (time - t0) / (t1 - t0)
}

/// Readings of a cell that is turned about z and shows filtered forces times its gain, later by the delay, at every
/// second step.
fn delayed(scene: &Scene) -> [Vec<Reading>; 2] {
    let [along, across] = forces(scene);
    let (sine, cosine) = TURN.sin_cos();
    // Axes of the cell: x is (cos, sin), y is (-sin, cos).
    [[cosine, sine], [-sine, cosine]].map(|[x, y]| {
        let sum = |(a, b): (&Reading, &Reading)| Reading { value: x * a.value + y * b.value, ..*a };
        let turned: Vec<Reading> = along.iter().zip(&across).map(sum).collect();
        let mut shown = filtered(&turned[1..], turned[0].value, FREQUENCY);
        shown.insert(0, turned[0]);
        let times = turned.iter().filter_map(|r| r.time).filter(|t| *t > DELAY).step_by(2);
        times.map(|t| Reading { time: Some(t), value: GAIN * at(&shown, t - DELAY) }).collect()
    })
}

/// The fit of both components, with all numbers of the cell as unknowns.
fn fit_of(scene: &Scene, readings: [Vec<Reading>; 2], sigma: f64) -> Fit {
    let mut scene = with_sensor(scene);
    scene.sensors[0].low_pass = Some(1.3 * FREQUENCY);
    let mut fit = Fit::new(&scene.problem().unwrap());
    for (axis, readings) in readings.into_iter().enumerate() {
        fit = fit.observe(Sensor::new(force(axis), readings).sigma(sigma).of_sensor("cell"));
    }
    fit = fit.identify(Unknown::new(Parameter::YoungsModulus).start(1.05e8));
    for number in ["rotation.z", "delay", "low_pass", "gain"] {
        let name = format!("sensors.cell.{number}");
        fit = fit.identify(Unknown::new(name.parse().unwrap()));
    }
    fit.analyse(same_mesh())
}

#[test]
fn rotation_delay_filter_and_gain_are_identified_from_exact_forces() {
    let report = fit_of(&short(), delayed(&short()), 1e-3).solve().unwrap();
    let numbers = [
        ("youngs_modulus", 1e8),
        ("sensors.cell.rotation.z", TURN),
        ("sensors.cell.delay", DELAY),
        ("sensors.cell.low_pass", FREQUENCY),
        ("sensors.cell.gain", GAIN),
    ];
    for (name, truth) in numbers {
        let off = (value(&report, name) / truth - 1.0).abs();
        println!("{name}: {off:e}");
        // 20000 steps of the midpoint rule per step leave 1e-10 in the filtered readings.
        assert!(off < 1e-7, "{name} off by {off:e}\n{report}");
    }
}

/// Moment of the wall about a cell at this position relative to it, m, and the force along y, at t = 0 and every step.
fn moments(scene: &Scene, position: [f64; 3]) -> [Vec<Reading>; 2] {
    let problem = scene.problem().unwrap();
    let mut run = Trajectory::new(&problem, &[], &[]).unwrap().keep_reactions();
    run.run(&problem, problem.time().unwrap().steps(), |_| {}).unwrap();
    let readings = |value: &dyn Fn([f64; 3], [f64; 3]) -> f64| {
        let rows = run.times().iter().zip(run.reactions());
        let value = |(t, own): (&f64, rodfit::Reactions)| Reading {
            time: Some(*t),
            value: value(own.start.force, own.start.moment),
        };
        rows.map(value).collect()
    };
    let about = |force: [f64; 3], moment: [f64; 3]| {
        moment[2] - (position[0] * force[1] - position[1] * force[0])
    };
    [readings(&about), readings(&|force, _| force[1])]
}

/// The fit of moment and force of a cell of the wall, by the modulus and the given parameters.
fn fit_of_moments(scene: &Scene, position: [f64; 3], names: &[&str]) -> Fit {
    let [moments, forces] = moments(scene, position);
    let channel = Channel::along_world(End::Start, ReactionPart::Moment, 2);
    let mut fit = Fit::new(&with_sensor(scene).problem().unwrap())
        .observe(Sensor::new(channel, moments).sigma(1e-4).of_sensor("cell"))
        .observe(Sensor::new(force(1), forces).sigma(1e-3).of_sensor("cell"))
        .identify(Unknown::new(Parameter::YoungsModulus).start(1.05e8));
    for name in names {
        fit = fit.identify(Unknown::new(name.parse().unwrap()));
    }
    fit.analyse(same_mesh())
}

/// A cell away from the wall: its position is identified from exact data. Without it the score test names the distance
/// along the rod, or the report has the bias by it.
#[test]
fn position_of_a_load_cell_is_identified_and_named() {
    let report =
        fit_of_moments(&short(), POSITION, &["sensors.cell.position.x", "sensors.cell.position.y"]);
    let report = report.solve().unwrap();
    let numbers = [
        ("youngs_modulus", 1e8),
        ("sensors.cell.position.x", POSITION[0]),
        ("sensors.cell.position.y", POSITION[1]),
    ];
    for (name, truth) in numbers {
        let off = (value(&report, name) / truth - 1.0).abs();
        assert!(off < 1e-7, "{name} off by {off:e}\n{report}");
    }
    let near = [-0.002, 0.0, 0.0];
    let report = fit_of_moments(&short(), near, &[]).analyse(of_a_right_mesh()).solve().unwrap();
    let source = "sensors.cell.position.x";
    assert!(report.score_tests.iter().any(|test| test.source == source), "{report}");
    // Observations without a sensor of the scene have the same effect.
    let [moments, _] = moments(&short(), near);
    let channel = Channel::along_world(End::Start, ReactionPart::Moment, 2);
    let fit = Fit::new(&short().problem().unwrap());
    let fit = fit.observe(Sensor::new(channel, moments).sigma(3e-4).tare(Tare::Free));
    let fit = fit.identify(Parameter::YoungsModulus).identify(Parameter::Density);
    let report = fit.analyse(of_a_right_mesh()).solve().unwrap();
    let source = "sensors.load-cell-start.position.x";
    let own = report.undetected_bias.iter().filter(|bias| bias.source == source);
    assert!(own.map(|bias| bias.std_errors).fold(0.0, f64::max) > 1.0, "{report}");
    // A position of a sensor at a point is refused.
    let mut scene = with_sensor(&short());
    scene.sensors[0].position = POSITION;
    let readings = vec![Reading { time: Some(0.01), value: 0.0 }];
    let sensor = Sensor::new(PointChannel::angle(Point::Tip), readings).of_sensor("cell");
    let fit = Fit::new(&scene.problem().unwrap()).observe(sensor.sigma(1.0));
    let refusal = refused(fit.identify(Parameter::YoungsModulus).solve());
    assert_eq!(refusal[0], "sensors.cell.position");
}

/// Five-point differences of residuals by each of the five numbers, and of the gradient for the Hessian.
#[test]
fn derivatives_by_numbers_of_a_sensor_are_those_of_differences() {
    let residuals = fit_of(&short(), delayed(&short()), 0.1).residuals().unwrap();
    // Between two steps, so that no interpolated time meets a step within the difference.
    let x = [1.1e8_f64.ln(), 0.3, 0.0093, 27.0_f64.ln(), 0.9_f64.ln()];
    let jacobian = residuals.jacobian_at(&x).unwrap();
    let hessian = residuals.hessian_at(&x).unwrap();
    let gradient = |x: &[f64]| -> Vec<f64> {
        let (rows, r) = (residuals.jacobian_at(x).unwrap(), residuals.residuals(x).unwrap());
        (0..5).map(|j| rows.iter().zip(&r).map(|(row, r)| row[j] * r).sum()).collect()
    };
    for (j, h) in [1e-3, 1e-3, 1e-4, 1e-3, 1e-3].into_iter().enumerate() {
        let points = [1.0, -1.0, 2.0, -2.0].map(|k| {
            let mut x = x;
            x[j] += k * h;
            x
        });
        let slope = |[a, b, c, d]: [f64; 4]| (8.0 * (a - b) - (c - d)) / (12.0 * h);
        let all = points.map(|x| residuals.residuals(&x).unwrap());
        let largest = jacobian.iter().map(|row| row[j].abs()).fold(0.0, f64::max);
        for (i, row) in jacobian.iter().enumerate() {
            let off = (row[j] - slope([0, 1, 2, 3].map(|p| all[p][i]))).abs();
            assert!(off < 1e-6 * largest, "row {i}, {j}: {off:e} of {largest:e}");
        }
        let gradients = points.map(|x| gradient(&x));
        for i in 0..5 {
            let off = (hessian[i][j] - slope([0, 1, 2, 3].map(|p| gradients[p][i]))).abs();
            let size = (hessian[i][i] * hessian[j][j]).abs().sqrt();
            assert!(off < 1e-6 * size, "{i} {j}: {off:e} of {size:e}");
        }
    }
}

/// Readings that are 7 % too large: the score test names the gain of the sensors beside a larger density and modulus,
/// which have the same effect. The fit with the gain has the modulus.
#[test]
fn gain_of_sensors_without_a_name_is_named_and_identified() {
    let scene = short();
    let [along, across] = forces(&scene).map(|readings| {
        let larger = |own: &Reading| Reading { value: GAIN * own.value, ..*own };
        readings.iter().map(larger).collect::<Vec<_>>()
    });
    let folder = tempfile::tempdir().unwrap();
    let rows = along
        .iter()
        .zip(&across)
        .skip(1)
        .map(|(x, y)| format!("{},{},{}\n", x.time.unwrap(), x.value, y.value));
    let table = format!("t,fx,fy\n{}", rows.collect::<String>());
    std::fs::write(folder.path().join("cell.csv"), table).unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene.to_toml().unwrap()).unwrap();
    let text = "scene = \"scene.toml\"\n[[parameter]]\nname = \"youngs_modulus\"\n[[observation]]\n\
                quantity = \"force\"\nof = \"start\"\nfile = \"cell.csv\"\nsigma = 1e-3\n";
    let file = FitFile::from_toml(text, folder.path()).unwrap();
    let report = file.fit().analyse(of_a_right_mesh()).solve().unwrap();
    let gain = "sensors.force-sensors.gain";
    let best = report.score_tests.iter().filter(|test| test.rank <= 2);
    let mut best: Vec<&str> = best.map(|test| &test.source[..]).collect();
    best.sort_unstable();
    assert_eq!(best, ["material.density", gain], "{report}");
    let extensions = file.extensions(&report).unwrap();
    let extended = extensions.iter().find(|extended| extended.term.contains(gain)).unwrap();
    let report = extended.file.fit().analyse(of_a_right_mesh()).solve().unwrap();
    for (name, truth) in [("youngs_modulus", 1e8), (gain, GAIN)] {
        let off = (value(&report, name) / truth - 1.0).abs();
        assert!(off < 1e-7, "{name} off by {off:e}\n{report}");
    }
}

/// The rotation of an accelerometer and the roll of a curvature sensor in space are found from exact readings.
#[test]
fn frames_of_sensors_in_space_are_identified() {
    let mut scene = short();
    scene.rod.dimension = Dimension::Spatial;
    scene.material.poisson_ratio = Some(0.4);
    scene.loads.gravity = [0.0, -9.8, 4.0];
    let problem = scene.problem().unwrap();
    let turn = [0.3, -0.2, 0.15];
    let accelerations = [0, 1, 2].map(|axis| PointChannel::acceleration(Point::Tip, axis));
    let curvatures = [0, 1].map(|axis| PointChannel::curvature(Point::ArcLength(0.1), axis));
    let cases: [(Vec<PointChannel>, [f64; 3]); 2] =
        [(accelerations.to_vec(), turn), (curvatures.to_vec(), [0.4, 0.0, 0.0])];
    for (channels, turn) in cases {
        let mut fit = Fit::new(&with_sensor(&scene).problem().unwrap());
        for channel in channels {
            let readings = model(&problem, channel.rotated(turn), &steps(&problem));
            fit = fit.observe(Sensor::new(channel, readings).sigma(1e-3).of_sensor("cell"));
        }
        fit = fit.identify(Unknown::new(Parameter::YoungsModulus).start(1.03e8));
        for (axis, turn) in ["x", "y", "z"].into_iter().zip(turn) {
            if turn != 0.0 {
                let name = format!("sensors.cell.rotation.{axis}");
                fit = fit.identify(Unknown::new(name.parse().unwrap()));
            }
        }
        let report = fit.analyse(same_mesh()).solve().unwrap();
        assert!((value(&report, "youngs_modulus") / 1e8 - 1.0).abs() < 1e-7, "{report}");
        for (axis, turn) in ["x", "y", "z"].into_iter().zip(turn).filter(|(_, t)| *t != 0.0) {
            let off = (value(&report, &format!("sensors.cell.rotation.{axis}")) - turn).abs();
            assert!(off < 1e-7, "{axis}: {off:e}");
        }
    }
}

/// Poses of a late clock, whose last one is after the motion; a rotation of their sensor is refused.
#[test]
fn delay_of_poses_is_identified() {
    let mut late = exact(&twisted().problem().unwrap());
    late.iter_mut().for_each(|reading| reading.time = reading.time.map(|t| t + DELAY));
    let mut scene = with_sensor(&twisted());
    let sensor = PoseSensor::new(PLACE, late).of_sensor("cell");
    let fit = |scene: &Scene| {
        let problem = scene.problem().unwrap();
        let fit = measured(&sensor, &problem).into_iter().fold(Fit::new(&problem), Fit::observe);
        let fit = fit.identify(Unknown::new(Parameter::YoungsModulus).start(1.05e8));
        fit.identify(Unknown::new("sensors.cell.delay".parse().unwrap())).analyse(same_mesh())
    };
    let report = fit(&scene).solve().unwrap();
    let off =
        [value(&report, "youngs_modulus") / 1e8, value(&report, "sensors.cell.delay") / DELAY];
    assert!(off.iter().all(|ratio| (ratio - 1.0).abs() < 1e-7), "{off:?}\n{report}");
    scene.sensors[0].rotation = [0.1, 0.0, 0.0];
    assert_eq!(refused(fit(&scene).solve())[0], "sensors.cell.rotation");
}

#[test]
fn intervals_beside_numbers_of_a_sensor_cover_the_modulus() {
    const SETS: usize = 200;
    let mut scene = short();
    scene.rod.segments = Some(6);
    let exact = delayed(&scene);
    let size = exact[1].iter().map(|r| r.value.abs()).fold(0.0, f64::max);
    let noise = Normal::new(0.0, 0.02 * size).unwrap();
    let mut covered = [0; 3];
    for seed in 0..SETS {
        let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
        let noisy = exact.clone().map(|readings| {
            let noisy = |r: Reading| Reading { value: r.value + noise.sample(&mut random), ..r };
            readings.into_iter().map(noisy).collect()
        });
        let report = fit_of(&scene, noisy, 0.02 * size).solve().unwrap();
        let truths = [1e8, TURN, DELAY];
        for ((covered, estimate), truth) in covered.iter_mut().zip(&report.parameters).zip(truths) {
            let interval = estimate.interval95;
            *covered +=
                usize::from(interval.is_some_and(|[low, high]| low <= truth && truth <= high));
        }
    }
    // The expectation is 190 of 200; the standard deviation of each count is 3.1.
    println!("{covered:?} of {SETS} intervals");
    assert!(covered.iter().all(|count| (184..=196).contains(count)), "{covered:?} of {SETS}");
}

/// Readings of a late clock end after the motion; the simulation ends there, as the shown times do.
#[test]
fn readings_of_a_late_clock_may_end_after_the_motion() {
    let mut scene = with_sensor(&short());
    let end = scene.time.as_ref().unwrap().end;
    let readings = |delay: f64| vec![Reading { time: Some(end + delay), value: 1.0 }; 1];
    let fit = |scene: &Scene, delay: f64| {
        let sensor = Sensor::new(force(1), readings(delay)).sigma(1.0).of_sensor("cell");
        Fit::new(&scene.problem().unwrap()).observe(sensor).identify(Parameter::YoungsModulus)
    };
    assert!(fit(&scene, 0.02).residuals().is_err());
    scene.sensors[0].delay = 0.02;
    let late = fit(&scene, 0.02).residuals().unwrap().residuals(&[1e8_f64.ln()]).unwrap()[0];
    scene.sensors[0].delay = 0.0;
    let prompt = fit(&scene, 0.0).residuals().unwrap().residuals(&[1e8_f64.ln()]).unwrap()[0];
    assert!((late - prompt).abs() < 1e-12, "{late} {prompt}");
    // Early clocks show states after the end, up to which the motion is continued.
    scene.sensors[0].delay = -0.01;
    assert!(
        fit(&scene, 0.0).residuals().unwrap().residuals(&[1e8_f64.ln()]).unwrap()[0].is_finite()
    );
}

#[test]
fn invalid_sensors_are_named() {
    let mut scene = with_sensor(&short());
    scene.sensors.push(SensorModel::new("cell"));
    assert_eq!(refused(scene.problem())[0], "sensors[1].name");
    scene.sensors[1].name = "a.b".into();
    assert_eq!(refused(scene.problem())[0], "sensors[1].name");
    scene.sensors.pop();
    let refusal = |scene: &Scene, channel: SensorChannel, name: &str, filter: Option<f64>| {
        let reading = Reading { time: Some(0.01), value: 0.0 };
        let mut sensor = Sensor::new(channel, vec![reading]).sigma(1.0).of_sensor(name);
        sensor.data.low_pass = filter;
        let fit = Fit::new(&scene.problem().unwrap()).observe(sensor);
        refused(fit.identify(Parameter::YoungsModulus).solve())
    };
    let [key, found, allowed] = refusal(&scene, force(0).into(), "bell", None);
    assert_eq!([&*key, &found, &allowed], ["observation[0].sensor", "\"bell\"", "one of cell"]);
    let none = refusal(&short(), force(0).into(), "cell", None);
    assert_eq!(none[2], "a sensor of the scene, which has no [[sensors]]");
    let angle = PointChannel::angle(Point::Tip).into();
    scene.sensors[0].gain = 1.1;
    assert_eq!(refusal(&scene, angle, "cell", None)[0], "sensors.cell.gain");
    (scene.sensors[0].gain, scene.sensors[0].rotation) = (1.0, [0.0, 0.1, 0.0]);
    assert_eq!(refusal(&scene, angle, "cell", None)[0], "sensors.cell.rotation");
    let strain = PointChannel::strain(Point::Tip, [1e-3, 0.0]).into();
    assert_eq!(refusal(&scene, strain, "cell", None)[0], "sensors.cell.rotation");
    scene.sensors[0].rotation = [0.0, 0.0, 0.1];
    let curvature = PointChannel::curvature(Point::ArcLength(0.1), 0).into();
    assert_eq!(refusal(&scene, curvature, "cell", None)[0], "sensors.cell.rotation");
    // A component that is a parameter, with the value zero in the scene.
    scene.sensors[0].rotation = [0.0; 3];
    let readings = vec![Reading { time: Some(0.01), value: 0.0 }; 1];
    let sensor = Sensor::new(PointChannel::curvature(Point::ArcLength(0.1), 0), readings);
    let fit = Fit::new(&scene.problem().unwrap()).observe(sensor.sigma(1.0).of_sensor("cell"));
    let fit = fit.identify(Unknown::new("sensors.cell.rotation.z".parse().unwrap()));
    assert_eq!(refused(fit.solve())[0], "sensors.cell.rotation");
    scene.sensors[0].low_pass = Some(5.0);
    assert_eq!(refusal(&scene, force(0).into(), "cell", Some(5.0))[0], "observation[0].filter");
}

/// The keys of files: `[[sensors]]` in the scene, `sensor` in the observation, and the names of parameters.
#[test]
fn sensor_of_a_fit_file_is_identified() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let [along, across] = delayed(&short());
    let mut table = "t,fx,fy\n".to_string();
    for (x, y) in along.iter().zip(&across) {
        table += &format!("{},{},{}\n", x.time.unwrap(), x.value, y.value);
    }
    std::fs::write(place("cell.csv"), table).unwrap();
    let mut scene = with_sensor(&short());
    (scene.sensors[0].low_pass, scene.sensors[0].gain) = (Some(FREQUENCY), GAIN);
    std::fs::write(place("scene.toml"), scene.to_toml().unwrap()).unwrap();
    let text = "scene = \"scene.toml\"\n[[parameter]]\nname = \"material.youngs_modulus\"\n\
                [[parameter]]\nname = \"sensors.cell.rotation.z\"\n\
                [[parameter]]\nname = \"sensors.cell.delay\"\n\
                [[observation]]\nfile = \"cell.csv\"\nquantity = \"force\"\nof = \"start\"\n\
                sensor = \"cell\"\nsigma = 1e-3\n";
    std::fs::write(place("fit.toml"), text).unwrap();
    let file = FitFile::load(place("fit.toml")).unwrap();
    let report = file.fit().analyse(same_mesh()).solve().unwrap();
    for (name, truth) in
        [("youngs_modulus", 1e8), ("sensors.cell.rotation.z", TURN), ("sensors.cell.delay", DELAY)]
    {
        let off = (value(&report, name) / truth - 1.0).abs();
        assert!(off < 1e-7, "{name} off by {off:e}");
    }
    let text = text
        .replace("sensor = \"cell\"\n", "")
        .replace("quantity = \"force\"\nof = \"start\"", "sensor = \"cell\"");
    std::fs::write(place("fit.toml"), text).unwrap();
    assert_eq!(refused(FitFile::load(place("fit.toml")))[0], "observation[0].sensor");
}

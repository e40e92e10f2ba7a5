//! Sensors of force and moment: exact data give the parameters, also density beside modulus; coverage with noise;
//! invalid input.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::dynamics::NodeTable;
use rodfit::fit::{Channel, FitFile, ReactionPart, Reading, Sensor, Tare};
use rodfit::scene::{End, Scene, Support};
use rodfit::{Code, Fit, FitReport, Parameter, Problem, Trajectory};

use crate::calls::{refused, short};
use crate::common::fits::{record, same_mesh};

/// Force across the rod at the wall.
fn shear() -> Channel {
    Channel::along_world(End::Start, ReactionPart::Force, 1)
}

/// Bending moment at the wall.
fn bending() -> Channel {
    Channel::along_world(End::Start, ReactionPart::Moment, 2)
}

/// The readings of a channel at every step of the whole scene but the first.
pub fn readings(problem: &Problem, channel: Channel) -> Vec<Reading> {
    let mut run = Trajectory::new(problem, &[], &[]).unwrap().keep_reactions();
    run.run(problem, problem.time().unwrap().steps(), |_| {}).unwrap();
    let reactions = run.reactions();
    let component = |k: usize| {
        let start = reactions[k].start;
        let vector = match channel.part {
            ReactionPart::Force => start.force,
            ReactionPart::Moment => start.moment,
        };
        let value = (0..3).map(|c| vector[c] * channel.direction[c]).sum();
        Reading { time: Some(run.times()[k]), value }
    };
    (1..run.times().len()).map(component).collect()
}

fn solve(problem: &Problem, sensor: Sensor) -> FitReport {
    let start = problem.with([(Parameter::YoungsModulus, 1.3e8)]).unwrap();
    let fit = Fit::new(&start).observe(sensor).identify(Parameter::YoungsModulus);
    fit.analyse(same_mesh()).solve().unwrap()
}

/// Relative error of an estimate.
fn error(report: &FitReport, parameter: Parameter, truth: f64) -> f64 {
    let found = report.parameters.iter().find(|e| e.name == parameter).unwrap();
    (found.value.unwrap() / truth - 1.0).abs()
}

#[test]
fn exact_force_or_moment_gives_modulus() {
    let problem = short().problem().unwrap();
    let turned = [0.1, -0.2, 0.3];
    for channel in [shear(), bending(), shear().rotated(turned)] {
        let exact = readings(&problem, channel);
        let shifted = exact.iter().map(|r| Reading { value: r.value + 0.37, ..*r }).collect();
        let sensors = [
            Sensor::new(channel, exact.clone()).sigma(1e-3),
            Sensor::new(channel, shifted).sigma(1e-3).tare(Tare::Free),
        ];
        for sensor in sensors {
            let report = solve(&problem, sensor);
            let off = error(&report, Parameter::YoungsModulus, 1e8);
            assert!(off < 1e-7, "{} off by {off:e}", channel.name());
            let unit = if channel.part == ReactionPart::Force { "N" } else { "N m" };
            assert_eq!(report.units, [unit]);
        }
    }
}

/// A filtered component that is linear between the steps, by small Euler steps.
pub fn filtered(exact: &[Reading], first: f64, frequency: f64) -> Vec<Reading> {
    const PARTS: usize = 20_000;
    let (mut y, mut before, mut time) = (first, first, 0.0);
    let rate = std::f64::consts::TAU * frequency;
    let mut output = Vec::new();
    for Reading { time: end, value } in exact {
        let h = (end.unwrap() - time) / PARTS as f64;
        for k in 0..PARTS {
            let u = before + (value - before) * (k as f64 + 0.5) / PARTS as f64;
            // The midpoint rule.
            let middle = y + 0.5 * h * rate * (u - y);
            y += h * rate * (u - middle);
        }
        (before, time) = (*value, end.unwrap());
        output.push(Reading { time: *end, value: y });
    }
    output
}

#[test]
fn filter_of_sensor_is_applied_to_model() {
    let problem = short().problem().unwrap();
    let mut run = Trajectory::new(&problem, &[], &[]).unwrap().keep_reactions();
    run.run(&problem, 0, |_| {}).unwrap();
    let first = run.reactions()[0].start.moment[2];
    let seen = filtered(&readings(&problem, bending()), first, 20.0);
    let sensor = || Sensor::new(bending(), seen.clone()).sigma(1e-3);
    let with_filter =
        error(&solve(&problem, sensor().low_pass(20.0)), Parameter::YoungsModulus, 1e8);
    let without = error(&solve(&problem, sensor()), Parameter::YoungsModulus, 1e8);
    // 20000 steps of the midpoint rule per step leave 1e-10.
    assert!(with_filter < 1e-7 && without > 1e-2, "{with_filter:e} {without:e}");
}

#[test]
fn modulus_and_density_are_determined_by_positions_and_one_force() {
    let problem = short().problem().unwrap();
    let tip = || record(&problem.simulate().unwrap(), 50).sigma(1e-4);
    let start =
        problem.with([(Parameter::YoungsModulus, 1.2e8), (Parameter::Density, 1100.0)]).unwrap();
    let positions = Fit::new(&start)
        .observe(tip())
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::Density)
        .analyse(same_mesh());
    let both =
        positions.clone().observe(Sensor::new(shear(), readings(&problem, shear())).sigma(1e-3));
    let alone = positions.solve().unwrap();
    assert!(!alone.not_identifiable.is_empty(), "{alone}");
    let report = both.solve().unwrap();
    assert!(report.not_identifiable.is_empty(), "{report}");
    let off = [(Parameter::YoungsModulus, 1e8), (Parameter::Density, 1273.52)]
        .map(|(parameter, truth)| error(&report, parameter, truth));
    assert!(off.iter().all(|off| *off < 1e-7), "{off:?}");
}

#[test]
fn reading_at_rest_gives_density() {
    let problem = short().problem().unwrap();
    let value = problem.equilibrium().unwrap().reactions.start.force[1];
    let sensor = Sensor::new(shear(), vec![Reading { time: None, value }]).sigma(1e-4);
    let start = problem.with([(Parameter::Density, 1000.0)]).unwrap();
    let fit = Fit::new(&start).observe(sensor).identify(Parameter::Density);
    let report = fit.analyse(same_mesh()).solve().unwrap();
    let off = error(&report, Parameter::Density, 1273.52);
    assert!(off < 1e-7, "{off:e}");
}

#[test]
fn intervals_from_noisy_forces_with_free_tare_cover_the_modulus() {
    const SETS: usize = 200;
    let mut scene = short();
    scene.rod.segments = Some(6);
    let problem = scene.problem().unwrap();
    let exact = readings(&problem, bending());
    let size = exact.iter().map(|r| r.value.abs()).fold(0.0, f64::max);
    let noise = Normal::new(0.0, 0.05 * size).unwrap();
    let mut covered = 0;
    for seed in 0..SETS {
        let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
        let mut noisy =
            |r: &Reading| Reading { value: r.value + 0.3 * size + noise.sample(&mut random), ..*r };
        let sensor = Sensor::new(bending(), exact.iter().map(&mut noisy).collect());
        let fit = Fit::new(&problem)
            .observe(sensor.tare(Tare::Free))
            .identify(rodfit::Unknown::new(Parameter::YoungsModulus).start(1e8));
        let report = fit.analyse(same_mesh()).solve().unwrap();
        let [low, high] = report.parameters[0].interval95.unwrap();
        covered += usize::from((low..=high).contains(&1e8));
    }
    // The expectation is 190 of 200; the standard deviation of the count is 3.1.
    println!("{covered} of {SETS} intervals");
    assert!((184..=196).contains(&covered), "{covered} of {SETS}");
}

/// A scene and the table of its reactions in a new folder.
fn files(scene: &Scene) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let problem = scene.problem().unwrap();
    let mut table = NodeTable::new(Vec::new(), problem.nodes()).with_reactions(true);
    table.header().unwrap();
    let mut run = Trajectory::unrecorded(&problem).unwrap().keep_reactions();
    let steps = problem.time().unwrap().steps();
    run.run(&problem, steps, |state| table.push(state).unwrap()).unwrap();
    std::fs::write(folder.path().join("nodes.csv"), table.into_inner()).unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene.to_toml().unwrap()).unwrap();
    folder
}

/// The fit file with one observation that has these keys.
fn fit_file(folder: &tempfile::TempDir, keys: &str) -> Result<FitFile, rodfit::Error> {
    let text = format!(
        "scene = \"scene.toml\"\n[[parameter]]\nname = \"material.youngs_modulus\"\n[[observation]]\n\
         file = \"nodes.csv\"\n{keys}\n"
    );
    let path = folder.path().join("fit.toml");
    std::fs::write(&path, text).unwrap();
    FitFile::load(&path)
}

#[test]
fn table_of_simulation_is_read_as_observation() {
    let folder = files(&short());
    for (keys, components) in [
        ("quantity = \"force\"\nof = \"start\"\nsigma = 0.01", 3),
        ("quantity = \"moment\"\nof = \"start\"\nsigma = 0.01\ntare = \"free\"", 3),
        (
            "quantity = \"force\"\nof = \"start\"\nsigma = 0.01\naxes = [\"none\", \"y\", \"none\"]",
            1,
        ),
        (
            "quantity = \"moment\"\nof = \"start\"\nsigma = 0.01\ncolumns = { t = \"t\", mz = \"start_mz\" }",
            1,
        ),
    ] {
        let file = fit_file(&folder, keys).unwrap();
        assert_eq!(file.experiments[0].measurements.len(), components, "{keys}");
        let report = file.fit().analyse(same_mesh()).solve().unwrap();
        let off = error(&report, Parameter::YoungsModulus, 1e8);
        assert!(off < 1e-7, "{keys}: {off:e}");
    }
}

/// Readings outside the window, here wrong ones, have no effect; those at its ends belong to it.
#[test]
fn window_selects_readings_by_time() {
    let folder = files(&short());
    let keys =
        "quantity = \"force\"\nof = \"start\"\nsigma = 1.0\ntime_zero = 1.0\nwindow = [0.01, 0.03]";
    let table = "t,fx,fy\n1.0,9,9\n1.009,9,9\n1.01,1,2\n1.02,3,\n1.03,5,6\n1.031,9,9\n";
    std::fs::write(folder.path().join("nodes.csv"), table).unwrap();
    let file = fit_file(&folder, keys).unwrap();
    let values = |component: usize| -> Vec<f64> {
        let readings = file.experiments[0].measurements[component].data.readings();
        readings.iter().map(|reading| reading.value).collect()
    };
    assert_eq!([values(0), values(1)], [vec![1.0, 3.0, 5.0], vec![2.0, 6.0]]);
}

#[test]
fn invalid_keys_of_sensors_are_named() {
    let folder = files(&short());
    let of = "quantity = \"force\"\nof = \"start\"\n";
    for (keys, key) in [
        ("quantity = \"force\"".to_string(), "observation[0].of"),
        ("quantity = \"force\"\nof = \"end\"".into(), "observation[0].of"),
        (format!("{of}point = \"tip\""), "observation[0].point"),
        (format!("{of}scale = 2.0"), "observation[0].scale"),
        (format!("{of}filter = {{ low_pass = 0.0 }}"), "observation[0].filter.low_pass"),
        (format!("{of}tare = \"free\"\nloss = \"huber\""), "observation[0].tare"),
        ("tare = \"free\"".into(), "observation[0].tare"),
        ("filter = { low_pass = 5.0 }".into(), "observation[0].filter"),
        ("window = [0.1, 0.2]".into(), "observation[0].window"),
        (format!("{of}window = [0.2, 0.1]"), "observation[0].window"),
        ("of = \"start\"".into(), "observation[0].of"),
    ] {
        let [found, ..] = refused(fit_file(&folder, &keys));
        assert_eq!(found, key, "{keys}");
    }
    let fails = |keys: &str, table: &str, words: &str| {
        std::fs::write(folder.path().join("nodes.csv"), table).unwrap();
        let error = fit_file(&folder, keys).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    fails(of, "t,x\n0.01,1\n", "found the columns t, x");
    fails(of, "t,fx[lb]\n0.01,1\n", "unit [lb]");
    fails(of, "t,fx\n-0.01,1\n", "time_zero");
    fails(of, "frame,fx\n1,1\n", "fps");
    fails(of, "t,fx\n5.0,1\n", "time.end");
    let window = format!("{of}window = [0.1, 0.2]");
    fails(&window, "t,fx\n0.05,1\n", "window from 0.1 to 0.2 s");
    fails(&window, "fx\n1\n", "window and no clock");
    let mut free = short();
    free.supports.start = Support::Free;
    let sensor = Sensor::new(shear(), vec![Reading { time: Some(0.01), value: 1.0 }]).sigma(0.1);
    let fit = Fit::new(&free.problem().unwrap()).observe(sensor).identify(Parameter::YoungsModulus);
    let [key, found, _] = refused(fit.solve());
    assert_eq!((&key[..], &found[..]), ("observation[0].of", "start, a free end"));
}

/// Angles in a column without a unit are read as rad, and the verdict states it.
#[test]
fn angles_without_a_unit_are_no_trustworthy_result() {
    let scene = short();
    let droop = scene.problem().unwrap().equilibrium().unwrap().nodes;
    let [before, tip] = [droop[droop.len() - 2], droop[droop.len() - 1]];
    let angle = (tip[1] - before[1]).atan2(tip[0] - before[0]);
    let folder = files(&scene);
    let keys = "quantity = \"angle\"\nsigma = 1e-2";
    for (header, is_stated) in [("angle", false), ("angle[rad]", true)] {
        std::fs::write(folder.path().join("nodes.csv"), format!("{header}\n{angle}\n{angle}\n"))
            .unwrap();
        let report = fit_file(&folder, keys).unwrap().fit().solve().unwrap();
        let is_named = report.warning_codes.contains(&Code::AssumedUnit);
        assert_eq!(is_named, !is_stated, "{report}");
        assert_eq!(report.verdict.contains("read as rad"), !is_stated, "{report}");
    }
    std::fs::write(folder.path().join("nodes.csv"), "rx,ry,rz\n0,0,-0.1\n0,0,-0.1\n").unwrap();
    let report =
        fit_file(&folder, "quantity = \"pose\"\nsigma = 1e-2").unwrap().fit().solve().unwrap();
    assert!(report.warning_codes.contains(&Code::AssumedUnit), "{report}");
    // Microstrain without a unit would be a strain of many lengths.
    std::fs::write(folder.path().join("nodes.csv"), "strain\n512\n").unwrap();
    let keys = "quantity = \"strain\"\npoint = { arc_length = 0.1 }\noffset = [1e-3, 0.0]";
    let error = fit_file(&folder, keys).unwrap_err().to_string();
    assert!(error.contains("strains up to 512") && error.contains("strain[um/m]"), "{error}");
}

//! Fits of several experiments, of shapes at rest and of frequencies by the command: shared parameters, input
//! uncertainties and priors, validation data, and the messages for invalid tables.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rodfit::vibration::{LinearizationPoint, ModePlane};
use rodfit::{Parameter, Point, Problem, Scene};
use serde_json::Value;
use std::f64::consts::TAU;

use crate::folder::{Folder, change, refused, replaced, stderr, stdout, succeeds};

/// Of positions, m.
const SIGMA: f64 = 1e-4;
const TRUTH: f64 = 1.3e8;
const ANGLES: [f64; 2] = [0.03, -0.02];

const TWO: &str = r#"
[[experiment]]
name = "long"
scene = "long.toml"
[[experiment.observation]]
file = "long.csv"
sigma = 1e-4
loss = "huber"
[[experiment.shape]]
file = "droop.csv"
sigma = 1e-4
held_out = true

[[experiment]]
name = "short"
scene = "short.toml"
[[experiment.observation]]
file = "short.csv"
[[experiment.shape]]
file = "nodes.csv"
sigma = 1e-4
[[experiment.frequencies]]
hz = HZ
modes = [1, 2]
sigma = 0.01

[[parameter]]
name = "youngs_modulus"
prior = { mean = 1.2e8, sigma = 2e7 }
[[parameter]]
name = "clamp_angle"
experiment = "long"
[[parameter]]
name = "clamp_angle"
experiment = ["short"]
"#;

const ONE: &str = r#"
scene = "long.toml"
[[shape]]
file = "droop.csv"
[[frequencies]]
hz = HZ
sigma = 0.01
[[parameter]]
name = "youngs_modulus"
"#;

/// Normal noise of one seed.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    move || SIGMA * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random)
}

/// The tip at 100 Hz.
fn motion(problem: &Problem, seed: u64) -> String {
    let (run, mut noise) = (problem.simulate().unwrap(), noise(seed));
    let row = |k: i32| {
        let t = 0.01 * f64::from(k);
        let (x, _) = run.at(Point::Tip, t).unwrap();
        format!("{t},{},{}\n", x[0] + noise(), x[1] + noise())
    };
    format!("t,x,y\n{}", (1..=30).map(row).collect::<String>())
}

/// Every second node at rest, in mm, with the columns `place` of each.
fn droop(problem: &Problem, header: &str, place: impl Fn(usize) -> f64) -> String {
    let (nodes, mut noise) = (problem.equilibrium().unwrap().nodes, noise(3));
    let row = |i: usize| {
        let [x, y, _] = nodes[i].map(|x| 1e3 * (x + noise()));
        format!("{},{x},{y}\n", place(i))
    };
    format!("{header}\n{}", (2..=problem.segments()).step_by(2).map(row).collect::<String>())
}

/// The lowest two frequencies in the plane, as a list in the unit `factor` rad/s.
fn frequencies(problem: &Problem, factor: f64) -> String {
    let modes = problem.modes(8, LinearizationPoint::Equilibrium).unwrap().modes;
    let inside = modes.iter().filter(|mode| mode.plane == Some(ModePlane::In));
    format!("{:?}", inside.map(|mode| mode.frequency_rad_s / factor).take(2).collect::<Vec<_>>())
}

/// Two rods of one material in slightly inclined clamps, their data, and the fit files of both and of the first alone.
struct Lab {
    folder: Folder,
    long: Problem,
    two: String,
    one: String,
}

/// Writes scenes, data simulated with the true modulus, and both fit files into a folder.
fn lab() -> Lab {
    let folder = Folder::new();
    let rod = |name: &str, length: &str, angle: f64| {
        let file = format!("{name}.toml");
        folder.write(&file, &change("length = 0.5", &format!("length = {length}")));
        let problem = Scene::load(folder.path(&file)).unwrap().problem().unwrap();
        problem.with([(Parameter::YoungsModulus, TRUTH), (Parameter::ClampAngle, angle)]).unwrap()
    };
    let long = rod("long", "0.5", ANGLES[0]);
    let short = rod("short", "0.3", ANGLES[1]);
    // The tracker loses the tip once.
    let seen = motion(&long, 1);
    let lost = seen.lines().map(|row| if row.starts_with("0.2,") { "0.2,0.1,0.1" } else { row });
    folder.write("long.csv", &lost.collect::<Vec<_>>().join("\n"));
    folder.write("short.csv", &motion(&short, 2));
    let place = |i: usize| 1e3 * long.arc_length(Point::Node(i)).unwrap();
    folder.write("droop.csv", &droop(&long, "s[mm],x[mm],y[mm]", place));
    folder.write("long-nodes.csv", &droop(&long, "node,x[mm],y[mm]", |i| i as f64));
    folder.write("nodes.csv", &droop(&short, "node,x[mm],y[mm]", |i| i as f64));
    let two = TWO.replace("HZ", &frequencies(&short, TAU));
    let one = ONE.replace("HZ", &frequencies(&long, TAU));
    folder.write("fit.toml", &two);
    Lab { folder, long, two, one }
}

#[test]
fn two_experiments_share_a_modulus() {
    let Lab { folder, .. } = lab();
    let arguments = ["fit", "fit.toml", "--json", "fit.json", "--save", "fitted.toml"];
    let output = folder.run(&arguments);
    succeeds(&output);
    let fit = folder.json("fit.json");
    let [e, long, short] = [0, 1, 2].map(|i| &fit["parameters"][i]);
    for (parameter, truth) in [(e, TRUTH), (long, ANGLES[0]), (short, ANGLES[1])] {
        let [value, error] = ["value", "std_error"].map(|key| parameter[key].as_f64().unwrap());
        // Noise of known size: three standard errors contain the truth with a probability of 99.7 %.
        assert!((value - truth).abs() < 3.0 * error, "{parameter}");
    }
    let [low, high] = [0, 1].map(|i| e["interval95"][i].as_f64().unwrap());
    // An upper bound of the width: the data determine E to better than 1 %.
    assert!(low < high && high - low < 0.01 * TRUTH, "{e}");
    // The experiments of a parameter, and its prior.
    assert!(e.get("experiments").is_none() && long.get("prior").is_none());
    assert_eq!(
        (&long["experiments"][0], &short["experiments"][0]),
        (&"long".into(), &"short".into())
    );
    // The prior of the fit file `TWO`.
    assert_eq!((&e["prior"]["mean"], &e["prior"]["sigma"]), (&1.2e8.into(), &2e7.into()));
    // One sigma per measurement that was fitted, of which only one was not given.
    let sigma: Vec<f64> =
        fit["sigma"].as_array().unwrap().iter().map(|s| s.as_f64().unwrap()).collect();
    assert_eq!((sigma.len(), sigma[0], sigma[2]), (4, SIGMA, SIGMA));
    assert_eq!(fit["units"], serde_json::json!(["m", "m", "m", "rad/s"]));
    // The only sigma that is estimated, from the coordinates of a tip: three of its relative errors of some 10 %.
    assert!((sigma[1] / SIGMA - 1.0).abs() < 0.3, "{sigma:?}");
    // A stated sigma of 0.01 Hz, in rad/s.
    assert_eq!(sigma[3], 0.01 * TAU);
    // What the loss did with the tip that was lost.
    let losses = fit["losses"].as_array().unwrap();
    assert_eq!((losses.len(), &losses[0]["loss"]), (1, &"huber".into()));
    assert_eq!(losses[0]["observation"], "long: long.csv");
    assert_eq!((&losses[0]["beyond_5_sigma"], &losses[0]["values"]), (&2.into(), &60.into()));
    // What was held out is as far off as its noise.
    let predictions = fit["predictions"].as_array().unwrap();
    assert_eq!(predictions.len(), 1);
    assert_eq!(predictions[0]["observation"], "long: droop.csv");
    assert_eq!((&predictions[0]["values"], &predictions[0]["unit"]), (&20.into(), &"m".into()));
    let [rms, expected] = ["rms", "expected"].map(|key| predictions[0][key].as_f64().unwrap());
    // The RMS of 20 values with noise of standard deviation `SIGMA` has a relative error of 16 %.
    assert!(rms < 1.3 * expected && (expected / SIGMA - 1.0).abs() < 0.1, "{}", predictions[0]);
    let shown = stdout(&output);
    for part in ["clamp_angle (long)", "long: long.csv", "Validation error        long: droop.csv"]
    {
        assert!(shown.contains(part), "{part} in {shown}");
    }
    // A scene for each, with the values that are its own.
    assert!(!folder.path("fitted.toml").exists());
    for (file, angle) in [("fitted-long.toml", long), ("fitted-short.toml", short)] {
        let scene = Scene::load(folder.path(file)).unwrap();
        assert_eq!(Some(scene.material.youngs_modulus), e["value"].as_f64());
        assert_eq!(Parameter::ClampAngle.of(&scene), angle["value"].as_f64());
        succeeds(&folder.run(&["simulate", file, "-q"]));
    }
}

/// A shape by arc length in mm or by node, frequencies in Hz or rad/s, numbered or not: the same
/// numbers.
#[test]
fn units_and_notations_give_equal_results() {
    let Lab { folder, long, one, .. } = lab();
    let value = |fit: &str| {
        folder.write("fit.toml", fit);
        succeeds(&folder.run(&["fit", "fit.toml", "--json", "fit.json", "-q"]));
        let parameter = &folder.json("fit.json")["parameters"][0];
        [&parameter["value"], &parameter["std_error"]].map(|x| x.as_f64().unwrap())
    };
    let plain = value(&one);
    let hz = frequencies(&long, TAU);
    let (sorted, numbered) = (format!("hz = {hz}"), format!("hz = {hz}\nmodes = [1, 2]"));
    let rad_s = format!("rad_s = {}\nsigma = {}", frequencies(&long, 1.0), 0.01 * TAU);
    for (from, to) in [
        ("droop.csv", "long-nodes.csv"),
        (&*sorted, &*numbered),
        (&format!("{sorted}\nsigma = 0.01"), &rad_s),
    ] {
        for (a, b) in value(&replaced(&one, from, to)).iter().zip(&plain) {
            // Both texts describe the same numbers; the search stops within its tolerance.
            assert!((a / b - 1.0).abs() < 1e-6, "{to}: {a:e} {b:e}");
        }
    }
    // A prior that says more than the data has its way.
    let modulus = "name = \"youngs_modulus\"";
    let known = format!("{modulus}\nprior = {{ mean = 1.301e8, sigma = 1e2 }}");
    let [e, error] = value(&one.replace(modulus, &known));
    assert!((e - 1.301e8).abs() < 3e2 && (error / 1e2 - 1.0).abs() < 1e-2, "{e:e} {error:e}");
}

#[test]
fn invalid_experiment_is_rejected() {
    let Lab { folder, two, one, .. } = lab();
    let in_two = |from: &str, to: &str| replaced(&two, from, to);
    let in_one = |from: &str, to: &str| replaced(&one, from, to);
    let scene = "scene = \"short.toml\"\n";
    let hz = one.lines().find(|line| line.starts_with("hz")).unwrap();
    let fixed = |text: &str| format!("{two}[[parameter]]\nname = \"density\"\n{text}\n");
    let cases: Vec<(String, &[&str])> = vec![
        (fixed("fixed = -1"), &["parameter[3].fixed", "found -1", "above 0"]),
        (fixed("fixed = 900\nstart = 1e3"), &["parameter[3].fixed", "900", "no start"]),
        (in_two("[\"short\"]", "\"third\""), &["parameter[2].experiment", "third", "long, short"]),
        (in_two("[\"short\"]", "[\"short\", \"short\"]"), &["parameter[2].experiment", "twice"]),
        (in_two("[\"short\"]", "[]"), &["parameter[2].experiment", "[]", "all experiments share"]),
        (in_two("[\"short\"]", "3"), &["line 35", "a list of names"]),
        (in_two("experiment = [\"short\"]", ""), &["parameter[2].name", "clamp_angle", "once"]),
        (format!("{one}experiment = \"long\"\n"), &["parameter[0].experiment", "only one"]),
        (
            format!("scene = \"long.toml\"\n{two}"),
            &["scene", "both scene and [[experiment]]", "one scene"],
        ),
        (format!("{two}[[observation]]\nfile = \"long.csv\"\n"), &["[[experiment.observation]]"]),
        (format!("{two}[[shape]]\nfile = \"droop.csv\"\n"), &["shape:", "[[experiment.shape]]"]),
        (
            in_two("name = \"short\"", "name = \"long\""),
            &["experiment[1].name", "\"long\"", "once"],
        ),
        (in_two("name = \"short\"", "name = \" \""), &["experiment[1].name", "\" \"", "a name"]),
        (in_two("name = \"short\"\n", ""), &["line 14", "experiment[1].name"]),
        (in_two(scene, ""), &["line 14", "experiment[1].scene"]),
        (in_two(scene, "scene = \"none.toml\"\n"), &["none.toml", "No such file"]),
        (format!("[[experiment]]\nname = \"third\"\n{scene}{two}"), &["experiment[0]", "third"]),
        (in_two("hz =", "rad_s = [3.0]\nhz ="), &["short.frequencies[0]", "both hz and rad_s"]),
        (in_one(hz, ""), &["frequencies[0]", "neither hz nor rad_s", "one of the two"]),
        (
            in_two("[1, 2]", "[1]"),
            &["short.frequencies[0].modes", "1 mode numbers for 2 frequencies"],
        ),
        (in_two("[1, 2]", "[1, 0]"), &["short.frequencies[0].modes[1]", "found 0", "1 .. 200"]),
        (in_two("[1, 2]", "[2, 2]"), &["short.frequencies[0].modes[1]", "found 2", "once"]),
        (in_two("sigma = 0.01", ""), &["missing key", "experiment[1].frequencies[0].sigma"]),
        (in_two("sigma = 0.01", "sigma = 0"), &["short.frequencies[0].sigma", "found 0"]),
        (in_one(hz, "hz = [1.0, -6.0]"), &["frequencies[0].hz[1]", "found -6", "above 0"]),
        (in_one(hz, "hz = []"), &["frequencies[0]", "no values", "at least one"]),
        (in_two("\"huber\"", "\"l3\""), &["`l3`", "`squares`, `huber`, `soft-l1`"]),
        (in_two("sigma = 2e7", "sigma = 0"), &["parameter[0].prior.sigma", "found 0", "above 0"]),
        (in_two("mean = 1.2e8", "mean = -1.0"), &["parameter[0].prior.mean", "-1", "above 0"]),
        (in_two("{ mean = 1.2e8, sigma = 2e7 }", "1e8"), &["{ mean = .., sigma = .. }"]),
        (
            in_two(
                "= \"clamp_angle\"\nexperiment = \"long\"",
                "= \"width\"\nexperiment = \"long\"",
            ),
            &["parameter[1].name", "width in experiment long", "rectangular"],
        ),
        (
            in_two("file = \"short.csv\"", "file = \"short.csv\"\npoint = 99"),
            &["short.observation[0].point", "99", "0 .. 20"],
        ),
    ];
    for (fit, words) in cases {
        folder.write("fit.toml", &fit);
        let output = folder.run(&["fit", "fit.toml"]);
        refused(&output, words);
        let message = stderr(&output);
        assert!(message.contains("fit.toml") || message.contains("none.toml"), "{message}");
    }
}

#[test]
fn invalid_shape_is_rejected() {
    let Lab { folder, one, .. } = lab();
    folder.write("fit.toml", &one);
    let droop = folder.read("droop.csv");
    let header = |other: &str| droop.replace("s[mm],x[mm],y[mm]", other);
    let cases: Vec<(String, &[&str])> = vec![
        ("x,y\n0.1,0\n".into(), &["droop.csv:1", "no column s or node"]),
        ("s,node,x\n0.1,1,0\n".into(), &["droop.csv:1", "columns `s` and `node`", "one of"]),
        (header("s[km],x[mm],y[mm]"), &["droop.csv:1", "[km] of `s`", "m, cm, mm"]),
        (header("s[px],x[mm],y[mm]"), &["droop.csv:1", "[px] of `s`", "m, cm, mm"]),
        (header("s[mm],x[in],y[mm]"), &["droop.csv:1", "[in] of `x`", "m, cm, mm, um, px"]),
        (header("node[mm],x[mm],y[mm]"), &["droop.csv:1", "[mm] of `node`", "no unit"]),
        (header("t,x[mm],y[mm]"), &["droop.csv:1", "column `t`", "s, node, x, y, z"]),
        ("node,x\n1,0.025\n1.5,0.03\n".into(), &["droop.csv:3", "node = 1.5", "an index"]),
        ("node,x\n1,0.025\n21,0.03\n".into(), &["fit.toml", "droop.csv: point 2", "21", "0 .. 20"]),
        (format!("{droop}501,490,-80\n"), &["droop.csv: point 11", "0.501", "0 .. 0.5"]),
        (header("s,x[mm],y[mm]"), &["droop.csv: point 1", "38.46", "0 .. 0.5", "s[mm]"]),
        (format!("{droop},490,-80\n"), &["droop.csv:12", "blank"]),
        ("s,x,y\n0.1,,nan\n".into(), &["droop.csv:1", "no value"]),
    ];
    for (text, words) in cases {
        folder.write("droop.csv", &text);
        refused(&folder.run(&["fit", "fit.toml"]), words);
    }
}

/// Residuals whose squares no double holds are a fit that cannot start, not a crash.
#[test]
fn infinite_misfit_is_an_error() {
    let Lab { folder, one, .. } = lab();
    let shape = one.split("[[frequencies]]").next().unwrap();
    let fit = format!("{shape}sigma = 1e-200\n[[parameter]]\nname = \"youngs_modulus\"\n");
    folder.write("fit.toml", &fit);
    let output = folder.run(&["fit", "fit.toml", "-q"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("sigma"), "{}", stderr(&output));
}

/// Output streams: summary or JSON to stdout, errors to stderr, and nothing with `-q`. A closed pipe is no error.
#[test]
fn quiet_fit_prints_nothing_and_closed_pipe_is_no_error() {
    let Lab { folder, two, one, .. } = lab();
    let run = |arguments: &[&str]| {
        let output = folder.run(arguments);
        (output.status.code(), stdout(&output), stderr(&output))
    };
    let nothing = String::new();
    assert_eq!(run(&["fit", "fit.toml", "-q"]), (Some(0), nothing.clone(), nothing.clone()));
    let (code, summary, _) = run(&["fit", "fit.toml"]);
    assert!(code == Some(0) && summary.contains("youngs_modulus"), "{summary}");
    assert!(summary.contains(" mm, ") && summary.contains(" Hz"), "{summary}");
    for arguments in
        [&["fit", "fit.toml", "--json", "-"][..], &["-q", "fit", "fit.toml", "--json", "-"]]
    {
        let (code, json, _) = run(arguments);
        let json: Value = serde_json::from_str(&json).unwrap();
        assert_eq!((code, &json["converged"]), (Some(0), &true.into()));
    }
    // A fit that fails writes all the same, and quietly says why on stderr.
    folder.write("fit.toml", &one.replace("youngs_modulus", "damping.mass"));
    let (code, json, error) = run(&["fit", "fit.toml", "-q", "--json", "-"]);
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &json["parameters"][0]["identifiable"]), (Some(3), &false.into()));
    assert!(error.starts_with("error: not identifiable") && error.lines().count() == 1, "{error}");
    folder.write("fit.toml", &two.replace("[1, 2]", "[1]"));
    let (code, out, error) = run(&["fit", "fit.toml", "-q", "--json", "-"]);
    assert_eq!((code, out), (Some(2), nothing));
    assert!(error.starts_with("error: fit.toml: short.frequencies[0].modes"), "{error}");
}

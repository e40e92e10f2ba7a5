//! The command: what it writes, and that bad input gets one clear message and exit code 2.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

const SCENE: &str = r#"
[rod]
segments = 20
shape = { kind = "straight", length = 0.5, direction = [1, 0, 0] }
section = { kind = "circle", radius = 0.005 }

[material]
density = 1273.52
youngs_modulus = 1e8
poisson_ratio = 0.5

[loads]
gravity = [0, -9.8, 0]

[time]
end = 0.3
step = 2e-3
beta = 0.5
"#;

const FIT: &str = r#"
scene = "scene.toml"

[[observation]]
file = "tip.csv"
point = "tip"

[[parameter]]
name = "youngs_modulus"
"#;

/// The scene with a part replaced.
fn change(from: &str, to: &str) -> String {
    assert!(SCENE.contains(from), "{from}");
    SCENE.replace(from, to)
}

/// A folder with a scene, a fit file and data.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(TempDir::new().unwrap());
        folder.write("scene.toml", SCENE);
        folder.write("fit.toml", FIT);
        // Free fall for a while, then whatever: a fit need not be good to be possible.
        let rows = (0..30)
            .map(|k| f64::from(k) * 0.01)
            .map(|t| format!("{t},{},{}\n", 0.5 - 2.0 * t * t * t, -2.0 * t * t));
        folder.write("tip.csv", &format!("t,x,y\n{}", rows.collect::<String>()));
        folder
    }
    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }
    fn run(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_rodfit"))
            .args(arguments)
            .current_dir(self.0.path())
            .output()
            .unwrap()
    }
    fn json(&self, name: &str) -> Value {
        serde_json::from_str(&std::fs::read_to_string(self.path(name)).unwrap()).unwrap()
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Expects exit code 2 and one message with all of `words`.
fn refused(output: &Output, words: &[&str]) {
    let message = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    for word in words {
        assert!(message.contains(word), "`{word}` in: {message}");
    }
    assert_eq!(message.matches("error: ").count(), 1, "{message}");
}

#[test]
fn simulate_writes_what_it_promises() {
    let folder = Folder::new();
    let output =
        folder.run(&["simulate", "scene.toml", "--out", "nodes.csv", "--json", "run.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let run = folder.json("run.json");
    assert_eq!(
        (&run["model"], &run["dof"], &run["steps"]),
        (&"planar".into(), &42.into(), &150.into())
    );
    assert_eq!(run["status"], "completed");
    assert_eq!(run["scene"]["supports"]["clamp"], "mid-edge");
    assert!(run["newton_iterations"].as_u64().unwrap() >= 150);
    let (tip, energy) = (run["tip"].as_array().unwrap(), run["energy"].as_array().unwrap());
    assert_eq!((tip.len(), energy.len()), (151, 151));
    assert_eq!((tip[0].as_array().unwrap().len(), energy[0].as_array().unwrap().len()), (4, 6));

    let mut reader = csv::Reader::from_path(folder.path("nodes.csv")).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(Into::into).collect();
    assert_eq!(header[..4], ["t", "x_0", "y_0", "z_0"]);
    assert_eq!(header.len(), 1 + 3 * 21);
    let rows: Vec<Vec<f64>> =
        reader.records().map(|r| r.unwrap().iter().map(|f| f.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), 151);
    for c in 1..4 {
        // The JSON reader of this test rounds the last bit on its own.
        let (json, csv) = (tip[150][c].as_f64().unwrap(), rows[150][60 + c]);
        assert!((json - csv).abs() <= 2.0 * f64::EPSILON * csv.abs(), "{json} {csv}");
    }
}

/// The same scene turned out of the xy plane moves the same, in world axes.
#[test]
fn any_plane_is_planar() {
    let folder = Folder::new();
    folder.write(
        "turned.toml",
        &SCENE.replace("[1, 0, 0]", "[0, 0.6, 0.8]").replace("[0, -9.8, 0]", "[9.8, 0, 0]"),
    );
    for (scene, json) in [("scene.toml", "a.json"), ("turned.toml", "b.json")] {
        assert!(folder.run(&["simulate", scene, "--json", json]).status.success());
    }
    let (a, b) = (folder.json("a.json"), folder.json("b.json"));
    for k in [40, 150] {
        let at = |run: &Value, c: usize| run["tip"][k][c].as_f64().unwrap();
        let along = 0.6 * at(&b, 2) + 0.8 * at(&b, 3);
        assert!((at(&a, 1) - along).abs() < 1e-12 && (at(&a, 2) + at(&b, 1)).abs() < 1e-12);
    }
}

#[test]
fn json_on_stdout_is_only_json() {
    let folder = Folder::new();
    for arguments in
        [&["simulate", "scene.toml", "--json", "-"][..], &["check", "scene.toml", "--json", "-"]]
    {
        let output = folder.run(arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_slice::<Value>(&output.stdout).unwrap();
    }
}

#[test]
fn both_routes_of_derivatives_simulate_the_same() {
    let folder = Folder::new();
    for route in ["hand", "dual"] {
        let json = format!("{route}.json");
        let output =
            folder.run(&["simulate", "scene.toml", "--derivatives", route, "--json", &json]);
        assert!(output.status.success(), "{}", stderr(&output));
    }
    let (hand, dual) = (folder.json("hand.json"), folder.json("dual.json"));
    assert_eq!(hand["newton_iterations"], dual["newton_iterations"]);
    for c in 1..4 {
        let at = |run: &Value| run["tip"][150][c].as_f64().unwrap();
        assert!((at(&hand) - at(&dual)).abs() < 1e-11);
    }
}

#[test]
fn check_reports_agreement() {
    let folder = Folder::new();
    let output = folder.run(&["check", "scene.toml", "--json", "check.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let check = folder.json("check.json");
    for (key, limit) in [("gradient", 1e-12), ("hessian", 1e-12), ("finite_difference", 1e-7)] {
        let error = check["max_relative_error"][key].as_f64().unwrap();
        assert!(error > 0.0 && error < limit, "{key}: {error}");
    }
    for key in ["element", "dof", "hand", "dual"] {
        assert!(!check["worst"][key].is_null(), "{key}");
    }
}

/// The shipped fits find what their data were made with.
#[test]
fn shipped_fits_find_the_truth() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let folder = Folder::new();
    for (file, truth) in [("cantilever-fit.toml", 1e8), ("beta-fit.toml", 0.75)] {
        let path = data.join(file);
        let output = folder.run(&[
            "fit",
            path.to_str().unwrap(),
            "--json",
            "fit.json",
            "--save",
            "fitted.toml",
        ]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let fit = folder.json("fit.json");
        assert_eq!(fit["converged"], true);
        let parameter = &fit["parameters"][0];
        let [low, high] = [0, 1].map(|i| parameter["interval95"][i].as_f64().unwrap());
        assert!(low < truth && truth < high && high - low < 0.02 * truth, "{parameter}");
        assert!((fit["residual_rms"].as_f64().unwrap() / 1e-3 - 1.0).abs() < 0.1, "{fit}");
        assert!(fit["warnings"].as_array().unwrap().is_empty(), "{fit}");
        // The saved scene runs.
        assert!(folder.run(&["simulate", "fitted.toml"]).status.success());
    }
}

#[test]
fn what_is_not_identifiable_exits_with_three_and_still_writes() {
    let folder = Folder::new();
    let fit = FIT.replace(
        "name = \"youngs_modulus\"",
        "name = \"youngs_modulus\"\n[[parameter]]\nname = \"density\"",
    );
    folder.write("fit.toml", &fit);
    let output = folder.run(&["fit", "fit.toml", "--json", "fit.json"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let fit = folder.json("fit.json");
    for parameter in fit["parameters"].as_array().unwrap() {
        assert_eq!(parameter["identifiable"], false);
        assert!(
            parameter["value"].is_null()
                && parameter["std_error"].is_null()
                && parameter["interval95"].is_null()
        );
    }
    assert!(fit["status"].as_str().unwrap().contains("youngs_modulus/density"));
}

/// Where the rod hangs, and how it vibrates there.
#[test]
fn static_and_modes_write_what_they_promise() {
    let folder = Folder::new();
    let output = folder.run(&["static", "scene.toml", "--json", "rest.json", "--out", "rest.csv"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let rest = folder.json("rest.json");
    let tip: Vec<f64> =
        rest["tip"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    assert!((tip[1] / 0.5 + 0.2900).abs() < 1e-3 && tip[2] == 0.0, "{tip:?}");
    assert!(rest["energy"].as_f64().unwrap() < 0.0 && rest["residual"].as_f64().unwrap() < 1e-8);
    assert!(rest["newton_iterations"].as_u64().unwrap() > 0);
    assert_eq!((&rest["stable"], &rest["stable_in_plane"]), (&true.into(), &true.into()));
    // What it writes is a polyline.
    let rows = std::fs::read_to_string(folder.path("rest.csv")).unwrap();
    assert_eq!((rows.lines().next(), rows.lines().count()), (Some("x,y,z"), 22));

    let output = folder.run(&["modes", "scene.toml", "--count", "6", "--json", "modes.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let modes = folder.json("modes.json");
    let frequencies: Vec<f64> = modes["frequencies_rad_s"]
        .as_array()
        .unwrap()
        .iter()
        .map(|w| w.as_f64().unwrap())
        .collect();
    assert!(frequencies.len() == 6 && frequencies.is_sorted() && frequencies[0] > 0.0);
    // A rod that nothing holds falls for ever.
    folder.write("free.toml", &change("[time]", "[supports]\nstart = \"free\"\n[time]"));
    let output = folder.run(&["static", "free.toml"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    refused(&folder.run(&["modes", "scene.toml", "--count", "0"]), &["--count", "1..=200"]);
}

/// A run that dies keeps what it computed.
#[test]
fn a_failed_step_exits_with_three_and_keeps_the_rest() {
    let folder = Folder::new();
    // Long enough for beta = 0.5 to gain energy at this step.
    let scene = change("segments = 20", "segments = 50").replace("end = 0.3", "end = 20.0");
    folder.write("scene.toml", &scene.replace("step = 2e-3", "step = 1e-2"));
    let output =
        folder.run(&["simulate", "scene.toml", "--out", "nodes.csv", "--json", "run.json"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("the total energy has changed by"), "{}", stderr(&output));
    let run = folder.json("run.json");
    let steps = run["steps"].as_u64().unwrap() as usize;
    assert!(run["status"].as_str().unwrap().contains("stopped"));
    assert_eq!(run["tip"].as_array().unwrap().len(), steps + 1);
    assert!(
        run["tip"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(|t| t.as_array().unwrap())
            .all(|x| x.is_f64())
    );
    let rows = std::fs::read_to_string(folder.path("nodes.csv")).unwrap().lines().count();
    assert_eq!(rows, steps + 2);
}

/// Every way a scene can be wrong: key, what was found, what is allowed.
#[test]
fn bad_scenes_are_refused() {
    let cases: Vec<(String, &[&str])> = vec![
        (change("segments = 20", "sgements = 20"), &["sgements", "line 3", "segments"]),
        (change("beta = 0.5", "beta = 0.5\ntheta = 1"), &["theta", "beta"]),
        (change("density = 1273.52", ""), &["density", "missing"]),
        (change("segments = 20", ""), &["rod.segments", "2 .. 1e7"]),
        (change("segments = 20", "segments = \"many\""), &["line 3", "string"]),
        (change("segments = 20", "segments = -4"), &["line 3", "-4"]),
        (change("segments = 20", "segments = 0"), &["rod.segments", "found 0", "2 .. 1e7"]),
        (change("segments = 20", "segments = 1"), &["rod.segments", "found 1", "2 .. 1e7"]),
        (change("segments = 20", "segments = 1000000000"), &["rod.segments", "1000000000", "1e7"]),
        (change("radius = 0.005", "radius = -0.005"), &["rod.section.radius", "-0.005"]),
        (change("radius = 0.005", "radius = nan"), &["rod.section.radius", "NaN"]),
        (change("radius = 0.005", "radius = 0"), &["rod.section.radius", "found 0"]),
        (change("radius = 0.005", "radius = 1e-170"), &["rod.section"]),
        (change("radius = 0.005", "radius = 0.005, width = 1"), &["width"]),
        (change("\"circle\"", "\"oval\""), &["oval", "circle"]),
        (change("density = 1273.52", "density = inf"), &["material.density", "inf"]),
        (change("youngs_modulus = 1e8", "youngs_modulus = 0.0"), &["material.youngs_modulus"]),
        (
            change("poisson_ratio = 0.5", "poisson_ratio = 0.6"),
            &["material.poisson_ratio", "0.6", "(-1, 0.5]"],
        ),
        (change("poisson_ratio = 0.5", "poisson_ratio = -1.0"), &["material.poisson_ratio", "-1"]),
        (
            change("poisson_ratio = 0.5", "poisson_ratio = 0.5\nshear_modulus = 1e7"),
            &["shear_modulus", "one of the two"],
        ),
        (change("beta = 0.5", "beta = 0.49"), &["time.beta", "0.49", "[0.5, 1]"]),
        (change("beta = 0.5", "beta = 1.01"), &["time.beta", "1.01"]),
        (
            change("direction = [1, 0, 0]", "direction = [0, 0, 0]"),
            &["rod.shape.direction", "non-zero"],
        ),
        (change("length = 0.5", "length = -1.0"), &["rod.shape.length", "-1"]),
        (change("step = 2e-3", "step = 0"), &["time.step", "found 0"]),
        (change("step = 2e-3", "step = 1e-10"), &["time.step", "1e9 steps"]),
        (change("end = 0.3", "end = -0.3"), &["time.end", "-0.3"]),
        (change("beta = 0.5", "scheme = \"verlet\""), &["verlet", "newmark-beta"]),
        (SCENE.split("[time]").next().unwrap().to_string(), &["time", "end and step"]),
        (change("[0, -9.8, 0]", "[0, -9.8]"), &["gravity"]),
        (change("[0, -9.8, 0]", "[0, nan, 0]"), &["loads.gravity", "NaN"]),
        (change("gravity", "damping = { mass = -1.0 }\ngravity"), &["loads.damping.mass", "-1"]),
        (
            change("[time]", "[[loads.point]]\nnode = 21\nforce = [0, 1, 0]\n[time]"),
            &["loads.point[0].node", "21", "0 .. 20"],
        ),
        (change("[time]", "[[loads.point]]\nnode = \"top\"\nforce = [0, 1, 0]\n[time]"), &["tip"]),
        (change("[time]", "[supports]\nend = \"wheel\"\n[time]"), &["wheel", "roller"]),
        (
            change("[time]", "[supports]\nstart = \"roller\"\nend = \"roller\"\n[time]"),
            &["supports.end", "second roller"],
        ),
        (
            change("[time]", "[supports]\nroller = [1, 0, 0]\n[time]"),
            &["supports.roller", "no end that rolls"],
        ),
        (
            change("[time]", "[[supports.motion]]\nend = \"end\"\nramp = 1.0\n[time]"),
            &["supports.motion[0].end", "clamped or pinned"],
        ),
        (
            change(
                "[time]",
                "[[supports.motion]]\nend = \"start\"\ndisplacement = [0.1, 0, 0]\n[time]",
            ),
            &["supports.motion[0]", "ramp or frequency"],
        ),
        (
            change(
                "[time]",
                "[[supports.motion]]\nend = \"start\"\nramp = 1.0\nfrequency = 2.0\n[time]",
            ),
            &["supports.motion[0].frequency", "one of the two"],
        ),
        (
            change(
                "[time]",
                "[[supports.motion]]\nend = \"start\"\nramp = 0.0\ntwist = 1.0\n[time]",
            ),
            &["supports.motion[0].ramp", "above 0"],
        ),
        (
            change(
                "[time]",
                "[supports]\nstart = \"pinned\"\n[[supports.motion]]\nend = \"start\"\nramp = 1.0\n\
                 rotation = [0, 0, 1]\n[time]",
            ),
            &["supports.motion[0].rotation", "clamped"],
        ),
        (
            change("[time]", "[initial]\nstate = \"shape\"\n[time]"),
            &["initial.shape", "no such key"],
        ),
        (
            change(
                "[time]",
                "[initial]\nshape = { kind = \"arc\", length = 0.5, angle = 1.0 }\n[time]",
            ),
            &["initial.shape", "state"],
        ),
        (
            change(
                "[time]",
                "[initial]\nstate = \"shape\"\n\
                 shape = { kind = \"arc\", length = -0.5, angle = 1.0 }\n[time]",
            ),
            &["initial.shape.length", "above 0"],
        ),
        (
            change("poisson_ratio = 0.5\n", "")
                .replace("[time]", "[[loads.point]]\nnode = \"tip\"\nforce = [0, 0, 1]\n[time]"),
            &["spatial", "loads.point[0].force", "poisson_ratio"],
        ),
        (
            change("segments = 20", "segments = 20\ndimension = \"planar\"")
                .replace("[time]", "[[loads.point]]\nnode = \"tip\"\nforce = [0, 0, 1]\n[time]"),
            &["rod.dimension", "loads.point[0].force leaves the plane"],
        ),
        (
            change("[time]", "[[initial.point]]\nnode = \"tip\"\nforce = [0, 1, 0]\n[time]"),
            &["initial.point", "equilibrium"],
        ),
        (change("[time]", "[initial]\nstate = \"moving\"\n[time]"), &["moving", "equilibrium"]),
        (
            change("beta = 0.5", "beta = 0.5\nscheme = \"average-vector-field\""),
            &["time.beta", "newmark-beta only"],
        ),
        (
            change("beta = 0.5", "scheme = \"verlet\""),
            &["time.step", "found 0.002", "up to 9.", "e-5 s with verlet", "rodas4"],
        ),
        (
            change("beta = 0.5", "scheme = \"rodas4\"")
                .replace("[time]", "[loads.damping]\nstiffness = 1e-3\n[time]"),
            &["loads.damping.stiffness", "found 0.001", "0 with rodas4", "newmark-beta"],
        ),
        (change("beta = 0.5", "scheme = \"euler\""), &["euler", "rodas4", "verlet", "pefrl"]),
        (
            change("segments = 20", "segments = 20\nnatural_curvature = inf"),
            &["rod.natural_curvature", "inf"],
        ),
        (
            change("segments = 20", "segments = 20\ndiscretization = \"exact\""),
            &["exact", "corrected", "paper"],
        ),
        (
            change(
                "kind = \"straight\", length = 0.5, direction = [1, 0, 0]",
                "kind = \"polyline\", file = \"rest.csv\"",
            ),
            &["rod.segments", "polyline"],
        ),
        (
            change("segments = 20", "").replace(
                "kind = \"straight\", length = 0.5, direction = [1, 0, 0]",
                "kind = \"polyline\", file = \"rest.csv\"",
            ),
            &["rest.csv", "No such file"],
        ),
        ("[rod".to_string(), &["line 1"]),
    ];
    let folder = Folder::new();
    for (text, words) in cases {
        folder.write("scene.toml", &text);
        let output = folder.run(&["simulate", "scene.toml"]);
        refused(&output, words);
        assert!(
            stderr(&output).contains("scene.toml") || stderr(&output).contains("rest.csv"),
            "{}",
            stderr(&output)
        );
    }
    refused(&folder.run(&["simulate", "absent.toml"]), &["absent.toml", "No such file"]);
    refused(&folder.run(&["simulate", "scene.toml", "--out", "no/such/folder.csv"]), &["line 1"]);
    folder.write("scene.toml", SCENE);
    refused(
        &folder.run(&["simulate", "scene.toml", "--out", "no/such/folder.csv"]),
        &["no/such/folder.csv"],
    );
}

#[test]
fn bad_polylines_are_refused() {
    let folder = Folder::new();
    let shape = SCENE.replace("segments = 20", "").replace(
        "kind = \"straight\", length = 0.5, direction = [1, 0, 0]",
        "kind = \"polyline\", file = \"rest.csv\"",
    );
    folder.write("scene.toml", &shape);
    for (rest, words) in [
        ("x,y\n0,0\n1,0\n2,0\n", &["rest.csv:1", "no column `z`"][..]),
        ("x,y,z\n0,0,0\n1,0,0\n", &["rest.csv:1", "at least 3"]),
        ("x,y,z\n0,0,0\n1,,0\n2,0,0\n", &["rest.csv:3", "blank"]),
        ("x,y,z\n0,0,0\n1,0,0\n1,0,0\n2,0,0\n", &["rest.csv:4", "same point"]),
        ("x,y,z\n0,0,0\n1,0,0\n0.5,0,0\n2,0,0\n", &["fold at node 1", "180"]),
        ("x,y,z\n0,0,0\n1,0,0\n2,1,0\n2,1,1\n2,1,0\n", &["fold at node 3", "180"]),
    ] {
        folder.write("rest.csv", rest);
        refused(&folder.run(&["simulate", "scene.toml"]), words);
    }
    for z in [0.0, 0.01] {
        let rest = format!("x,y,z\n0,0,0\n0.1,0.01,0\n0.2,0,0\n0.3,0.02,{z}\n");
        folder.write("rest.csv", &rest);
        let output = folder.run(&["simulate", "scene.toml", "--json", "run.json"]);
        assert!(output.status.success(), "{}", stderr(&output));
        let model = if z == 0.0 { "planar" } else { "spatial" };
        assert_eq!(folder.json("run.json")["model"], model);
    }
}

/// What is asked for is in the JSON, what is not is not.
#[test]
fn analysis_on_request() {
    let folder = Folder::new();
    let plain = {
        folder.run(&["fit", "fit.toml", "--json", "fit.json", "-q"]);
        folder.json("fit.json")
    };
    assert_eq!(plain["discretization_error"][0]["name"], "youngs_modulus");
    assert!(plain["discretization_error"][0]["relative"].as_f64().unwrap() > 0.0);
    assert_eq!(plain["residual_tests"].as_array().unwrap().len(), 2);
    assert!(plain["verdict"].as_str().unwrap().contains("doubtful"), "{plain}");
    assert!(plain["parameters"][0].get("profile95").is_none());
    let analysis = "[analysis]\nprofile = true\nbootstrap = 20\nseed = 3\n\
                    observed_information = true\ndiscretization_error = \"none\"\n";
    folder.write("fit.toml", &format!("{FIT}{analysis}"));
    let output = folder.run(&["fit", "fit.toml", "--json", "fit.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let fit = folder.json("fit.json");
    let e = &fit["parameters"][0];
    for key in ["profile95", "observed_std_error"] {
        assert!(!e[key].is_null(), "{key}: {e}");
    }
    assert!(e["bootstrap"]["std_error"].as_f64().unwrap() > 0.0, "{e}");
    assert!(fit["discretization_error"].as_array().unwrap().is_empty());
    let shown = String::from_utf8_lossy(&output.stdout).to_string();
    assert!(shown.contains("profile") && shown.contains("bootstrap"), "{shown}");
}

#[test]
fn bad_fits_and_data_are_refused() {
    let folder = Folder::new();
    let data = std::fs::read_to_string(folder.path("tip.csv")).unwrap();
    let cases: Vec<(&str, String, &[&str])> = vec![
        ("fit.toml", FIT.replace("scene = \"scene.toml\"", ""), &["fit.toml", "scene", "found none"]),
        ("fit.toml", FIT.replace("scene.toml", "none.toml"), &["none.toml", "No such file"]),
        ("fit.toml", FIT.replace("youngs_modulus", "stiffness"), &["stiffness", "youngs_modulus"]),
        ("fit.toml", FIT.replace("point = \"tip\"", "point = \"nose\""), &["tip", "arc_length"]),
        (
            "fit.toml",
            FIT.replace("point = \"tip\"", "point = 400"),
            &["observation[0].point", "400"],
        ),
        (
            "fit.toml",
            FIT.replace("point = \"tip\"", "point = { arc_length = 0.7 }"),
            &["observation[0].point", "0.7"],
        ),
        (
            "fit.toml",
            FIT.replace("point = \"tip\"", "sigma = -1.0"),
            &["observation[0].sigma", "-1"],
        ),
        ("fit.toml", FIT.replace("point = \"tip\"", "colour = 1"), &["colour"]),
        ("fit.toml", format!("{FIT}start = 0.0\n"), &["parameter[0].start", "found 0"]),
        ("fit.toml", format!("{FIT}bounds = [2.0, 1.0]\n"), &["parameter[0].bounds"]),
        ("fit.toml", FIT.replace("tip.csv", "absent.csv"), &["absent.csv", "No such file"]),
        ("tip.csv", data.replace("t,x,y", "clock,x,y"), &["tip.csv:1", "`clock`"]),
        ("tip.csv", data.replace("t,x,y", "x,y,a"), &["tip.csv:1", "`a`"]),
        ("tip.csv", "x,y\n0.5,0\n0.4,0\n".into(), &["tip.csv:1", "no column t"]),
        ("tip.csv", data.replace("t,x,y", "frame,x,y"), &["tip.csv:1", "fps"]),
        ("tip.csv", data.replace("t,x,y", "t,x[px],y[px]"), &["tip.csv:1", "`x`", "scale"]),
        ("tip.csv", "t,frame,x\n0,0,0.5\n".into(), &["tip.csv:1", "two clocks"]),
        ("tip.csv", data.replace("0.02,", "-0.02,"), &["tip.csv:4", "time_zero"]),
        (
            "tip.csv",
            "t,x,y\n0,500,0\n0.1,490,-30\n0.2,450,-80\n".into(),
            &["tip.csv", "0.5 m", "x[mm]"],
        ),
        ("fit.toml", FIT.replace("point = \"tip\"", "y = \"left\""), &["left", "down"]),
        ("fit.toml", format!("{FIT}[analysis]\nprofiles = true\n"), &["profiles", "bootstrap"]),
        ("fit.toml", format!("{FIT}[analysis]\nbootstrap = 1\n"), &["analysis.bootstrap", "2 .. "]),
        (
            "fit.toml",
            format!("{FIT}[analysis]\ndiscretization_error = \"all\"\n"),
            &["all", "refitted"],
        ),
        ("tip.csv", data.replace("t,x,y", "t,a,b"), &["tip.csv:1", "`a`"]),
        ("tip.csv", data.replace("t,x,y", "t,x,x"), &["tip.csv:1", "two columns `x`"]),
        ("tip.csv", "t\n0\n1\n".into(), &["tip.csv:1", "no column x, y or z"]),
        ("tip.csv", data.replace("t,x,y", "t[min],x,y"), &["tip.csv:1", "[min]", "ms"]),
        ("tip.csv", data.replace("0.02,", "0.01,"), &["tip.csv:4", "increasing"]),
        ("tip.csv", data.replace("0.02,", "abc,"), &["tip.csv:4", "`abc`"]),
        ("tip.csv", data.replace("0.02,", ","), &["tip.csv:4", "time is blank"]),
        ("tip.csv", format!("{data}0.9,0,0\n"), &["tip.csv", "0.9", "time.end"]),
        ("tip.csv", format!("{data}0.295,0\n"), &["tip.csv:32", "2 fields"]),
        ("tip.csv", "t,x,y\n0,,\n0.1,nan,\n".into(), &["tip.csv:1", "no value"]),
        ("tip.csv", "t,x,y\n0.1,0.5,\n".into(), &["observation", "at least 2"]),
        ("tip.csv", String::new(), &["tip.csv:1"]),
    ];
    for (file, text, words) in cases {
        folder.write("fit.toml", FIT);
        folder.write("tip.csv", &data);
        folder.write(file, &text);
        refused(&folder.run(&["fit", "fit.toml"]), words);
    }
}

#[test]
fn data_in_other_units_and_with_gaps_are_the_same_data() {
    let folder = Folder::new();
    let data = std::fs::read_to_string(folder.path("tip.csv")).unwrap();
    let value = || {
        let output = folder.run(&["fit", "fit.toml", "--json", "fit.json", "-q"]);
        assert!(output.status.success() && output.stdout.is_empty(), "{}", stderr(&output));
        folder.json("fit.json")["parameters"][0]["value"].as_f64().unwrap()
    };
    let metres = value();
    let rows = data.lines().skip(1).map(|line| {
        let v: Vec<f64> = line.split(',').map(|f| f.parse().unwrap()).collect();
        format!("{}, {}, {}\n", 1e3 * v[1], 1e2 * v[2], 1e3 * v[0])
    });
    folder.write(
        "tip.csv",
        &format!("# a tracker's comment\nx[mm], y [cm], t[ms]\n{}", rows.collect::<String>()),
    );
    assert!((value() / metres - 1.0).abs() < 1e-9);

    // A camera's frames and pixels, y down, released at frame 12; a continental spreadsheet.
    let samples: Vec<Vec<f64>> = data
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|f| f.parse().unwrap()).collect())
        .collect();
    let number = |x: f64| x.to_string().replace('.', ",");
    let frames = samples.iter().map(|v| {
        let (x, y) = (100.0 + v[1] / 2.5e-4, 200.0 - v[2] / 2.5e-4);
        format!("{};{};{}\n", number(12.0 + 100.0 * v[0]), number(y), number(x))
    });
    let header = "\u{feff}Frame;Y (px);X (px)\n11;1;1\n";
    folder.write("tip.csv", &format!("{header}{}", frames.collect::<String>()));
    let keys = "point = \"tip\"\nfps = 100\nscale = 2.5e-4\norigin = [100, 200, 0]\n\
                y = \"down\"\ntime_zero = 12";
    folder.write("fit.toml", &FIT.replace("point = \"tip\"", keys));
    assert!((value() / metres - 1.0).abs() < 1e-9);
}

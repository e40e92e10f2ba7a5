//! Predictions without a fit: `rodfit predict`, and fit files whose measurements are all validation data. The errors of
//! the true scene are those of the noise.

use crate::common::recordings::{MODULUS, csv, recorded};
use crate::folder::{Folder, refused, replaced, stdout, succeeds, words};

/// Standard deviation of the noise of the recordings, m.
const NOISE: f64 = 1e-4;

/// The cable of the recordings, with their modulus.
fn cable() -> String {
    format!(
        r#"
[rod]
segments = 6
shape = {{ kind = "straight", length = 0.42, direction = [1, 0, 0] }}
section = {{ kind = "circle", radius = 1.5e-3 }}
[material]
density = 1100
youngs_modulus = {MODULUS:e}
[supports]
start = "recorded"
end = "recorded"
path = {{ file = "clip_0.csv" }}
[loads]
gravity = [0, -9.8, 0]
damping = {{ mass = 0.5, stiffness = 0.02 }}
[initial]
state = "recorded"
[time]
step = 0.01
scheme = "generalised-alpha"
"#
    )
}

const PREDICTION: &str = r#"
[[experiment]]
scene = "cable.toml"
paths = ["clip_0.csv", "clip_1.csv", "clip_2.csv"]
held_out = true
[[experiment.observation]]
markers = "free"
sigma = 1e-4
"#;

/// A folder with a cable scene, a prediction file and three recordings.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("cable.toml", &cable());
    folder.write("predict.toml", PREDICTION);
    for k in 0..3 {
        let track = recorded(k, 60 + 10 * k as usize, NOISE, |_| {});
        folder.write(&format!("clip_{k}.csv"), &csv(&track));
    }
    folder
}

/// The errors of the true scene are those of the noise: RMS sigma, mean sqrt(2/pi) sigma. Noise of the
/// held markers moves the simulated ones as well, by less than it is itself.
fn has_errors_of_the_noise(errors: &serde_json::Value, recordings: usize) {
    let list = errors["errors"].as_array().unwrap();
    assert_eq!(list.len(), recordings, "{errors}");
    for one in list {
        // One of three coordinates is zero in both, as all lies in a plane.
        let of = |key: &str| one[key].as_f64().unwrap() / NOISE;
        let (mean, rms) = (1.5 * of("mean"), 1.5_f64.sqrt() * of("rms"));
        assert!(rms > 0.9 && rms < 1.8, "{one}");
        assert!((mean / rms - 0.798).abs() < 0.06, "{one}");
        assert!(of("median") < of("mean"), "{one}");
        // The largest of some hundred normal values lies between 2.5 and 6 standard deviations.
        assert!(of("worst") > 2.5 * rms && of("worst") < 6.0 * rms, "{one}");
    }
    let means: Vec<f64> = list.iter().map(|one| one["mean"].as_f64().unwrap()).collect();
    let summary = &errors["summary"][0];
    let close = |key: &str, value: f64| {
        // Mean, median and worst of the listed means, computed here.
        assert!((summary[key].as_f64().unwrap() / value - 1.0).abs() < 1e-12, "{summary}");
    };
    close("mean", means.iter().sum::<f64>() / recordings as f64);
    close("worst", means.iter().copied().fold(0.0, f64::max));
}

#[test]
fn fit_file_of_validation_data_only_reports_prediction_errors() {
    let folder = folder();
    let output = folder.run(&["fit", "predict.toml", "--json", "errors.json", "--report", "page"]);
    succeeds(&output);
    has_errors_of_the_noise(&folder.json("errors.json"), 3);
    let shown = stdout(&output);
    for words in ["without a fit", "clip_1: the markers", "median", "worst", "sigma"] {
        assert!(shown.contains(words), "{words} in {shown}");
    }
    let page = folder.read("page/fit.html");
    crate::report::is_whole(&page);
    for words in [
        "<h2>Prediction errors</h2>",
        "clip_2",
        "<h2>Free-run prediction errors</h2>",
        "data and model",
    ] {
        assert!(page.contains(words), "{words}");
    }
    // Options of fits have no meaning here.
    for option in ["--extend", "--save=fitted.toml", "--known=rod.section.radius=1e-5"] {
        let name = option.split('=').next().unwrap();
        refused(&folder.run(&["fit", "predict.toml", option]), &[name, "validation data only"]);
    }
}

#[test]
fn predict_command_has_the_errors_of_the_fit_file() {
    let folder = folder();
    let clips = ["clip_0.csv", "clip_1.csv", "clip_2.csv"];
    let arguments = ["--sigma", "1e-4", "--json", "errors.json", "--report", "page", "--on"];
    let output = folder.run(&[&["predict", "cable.toml"][..], &arguments[..], &clips[..]].concat());
    succeeds(&output);
    succeeds(&folder.run(&["fit", "predict.toml", "--json", "other.json"]));
    let (errors, other) = (folder.json("errors.json"), folder.json("other.json"));
    has_errors_of_the_noise(&errors, 3);
    assert_eq!(errors["errors"], other["errors"]);
    assert!(folder.read("page/predict.html").contains("clip_0"));
    assert_eq!(folder.json("page/predict.json")["errors"], errors["errors"]);
    // A hundred times too soft, the cable is far off.
    let soft = replaced(&cable(), &format!("{MODULUS:e}"), "5e6");
    folder.write("soft.toml", &soft);
    let arguments = ["predict", "soft.toml", "--json", "soft.json", "--on", "clip_0.csv"];
    succeeds(&folder.run(&arguments));
    let rms = folder.json("soft.json")["errors"][0]["rms"].as_f64().unwrap();
    // A cable with a hundredth of the stiffness misses the markers by far more than the noise.
    assert!(rms > 5.0 * NOISE, "{rms}");
    refused(&folder.run(&["predict", "cable.toml", "--on", "none.csv"]), &["none.csv"]);
    let output = folder.run(&["predict", "cable.toml", "--marker", "2", "--on", "clip_0.csv"]);
    refused(&output, &["--marker", "supports.path"]);
    let output = folder.run(&["predict", "cable.toml", "--point", "tip", "--on", "clip_0.csv"]);
    refused(&output, &["--point", "supports.path"]);
}

/// The tip of a falling rod, and a shape at rest, compared with their own simulations.
#[test]
fn predict_command_takes_motions_and_shapes() {
    let folder = Folder::new();
    let output = folder.run(&["simulate", "scene.toml", "--out", "nodes.csv", "-q"]);
    succeeds(&output);
    let nodes = folder.read("nodes.csv");
    let columns: Vec<&str> = nodes.lines().next().unwrap().split(',').collect();
    let place = |name: &str| columns.iter().position(|column| *column == name);
    let tip =
        ["t", "x_20", "y_20"].map(|name| place(name).unwrap_or_else(|| panic!("{columns:?}")));
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let [t, x, y] = tip.map(|column| fields[column].parse::<f64>().unwrap());
        // 2 mm too high.
        format!("{t},{x},{}\n", y + 2e-3)
    };
    let rows: String = nodes.lines().skip(1).map(row).collect();
    folder.write("motion.csv", &format!("t,x,y\n{rows}"));
    let output = folder.run(&["predict", "scene.toml", "--json", "e.json", "--on", "motion.csv"]);
    succeeds(&output);
    let error = &folder.json("e.json")["errors"][0];
    let [worst, mean] = ["worst", "mean"].map(|key| error[key].as_f64().unwrap());
    // Positions in the file are displaced by 2 mm in one of two coordinates, as the rows above state.
    assert!((worst - 2e-3).abs() < 1e-6 && (mean - 1e-3).abs() < 1e-6, "{error}");
    assert_eq!(folder.json("e.json")["warning_codes"], serde_json::json!([]));
    // The displacement of 2 mm is many times a noise of 0.1 mm.
    let precise =
        ["predict", "scene.toml", "--json", "p.json", "--on", "motion.csv", "--sigma", "1e-4"];
    succeeds(&folder.run(&precise));
    assert_eq!(folder.json("p.json")["warning_codes"], serde_json::json!(["beyond-sigma"]));
    // The motion of the tip is not that of a point beside the clamp.
    let near =
        ["predict", "scene.toml", "--json", "n.json", "--on", "motion.csv", "--point", "0.02"];
    succeeds(&folder.run(&near));
    let codes = &folder.json("n.json")["warning_codes"];
    assert_eq!(*codes, serde_json::json!(["large-prediction-error"]));
    let still = replaced(crate::folder::SCENE, "[time]\nend = 0.3\nstep = 2e-3\nbeta = 0.5\n", "");
    folder.write("still.toml", &still);
    succeeds(&folder.run(&["static", "still.toml", "--out", "rest.csv", "-q"]));
    // One node lies behind the wall.
    let rest = folder.read("rest.csv");
    let on_the_rod = |line: &&str| !line.starts_with('-');
    println!("{rest}");
    folder.write(
        "rest.csv",
        &(rest.lines().filter(on_the_rod).collect::<Vec<_>>().join("\n") + "\n"),
    );
    let output = folder.run(&["predict", "still.toml", "--json", "r.json", "--on", "rest.csv"]);
    succeeds(&output);
    let error = &folder.json("r.json")["errors"][0];
    // The shape is that of the same scene: only the rounding of the file remains.
    assert!(error["worst"].as_f64().unwrap() < 1e-8, "{error}");
}

#[test]
fn parameters_beside_validation_data_only_are_named_as_not_fitted() {
    let folder = folder();
    folder.write("both.toml", &format!("{PREDICTION}\n[[parameter]]\nname = \"youngs_modulus\"\n"));
    let output = folder.run(&["fit", "both.toml"]);
    succeeds(&output);
    let shown = stdout(&output);
    assert!(shown.contains("youngs_modulus is not fitted"), "{shown}");
    assert!(shown.contains("[not-fitted]"), "{shown}");
    // Fitted data without parameters are still refused, with the way to a prediction.
    folder.write("none.toml", &PREDICTION.replace("held_out = true\n", ""));
    refused(&folder.run(&["fit", "none.toml"]), &["parameter"]);
}

/// A recording that cannot be simulated is named, with exit code 3; the others are predicted.
#[test]
fn failed_recording_does_not_affect_others() {
    let folder = folder();
    let jump = folder
        .read("clip_1.csv")
        .lines()
        .enumerate()
        .map(|(k, line)| {
            // The first held marker leaves its neighbor by nine meters and returns, in twenty frames.
            let away = match k {
                20..40 => 9.0 * (std::f64::consts::PI * (k as f64 - 20.0) / 20.0).sin().powi(2),
                _ => 0.0,
            };
            let mut cells: Vec<String> = line.split(',').map(String::from).collect();
            if let Ok(x) = cells[1].parse::<f64>() {
                cells[1] = (x - away).to_string();
            }
            cells.join(",") + "\n"
        })
        .collect::<String>();
    folder.write("clip_1.csv", &jump);
    let output = folder.run(&["fit", "predict.toml", "--json", "errors.json"]);
    let code = output.status.code();
    let errors = folder.json("errors.json");
    let list = errors["errors"].as_array().unwrap().len();
    match errors["failed"].as_array().map_or(0, Vec::len) {
        0 => assert_eq!((code, list), (Some(0), 3)),
        failed => {
            assert_eq!((code, list + failed), (Some(3), 3));
            assert!(stdout(&output).contains("not simulated: clip_1"), "{}", stdout(&output));
        }
    }
}

#[test]
fn saved_scene_ends_with_its_recording() {
    let folder = folder();
    let fit = replaced(PREDICTION, "held_out = true\n", "")
        + "[[parameter]]\nname = \"youngs_modulus\"\nstart = 4e8\n";
    folder.write("fit.toml", &fit.replace("\"clip_1.csv\", \"clip_2.csv\"", "\"clip_1.csv\""));
    // Two recordings of one cable, one scene.
    let output = folder.run(&["fit", "fit.toml", "--save", "fitted.toml", "-q"]);
    assert!([Some(0), Some(3)].contains(&output.status.code()));
    let saved: Vec<String> =
        folder.files().into_iter().filter(|name| name.starts_with("fitted")).collect();
    assert_eq!(saved, ["fitted.toml"]);
    let text = folder.read("fitted.toml");
    let time = text.split("[time]").nth(1).unwrap().to_string();
    assert!(!time.contains("\nend ="), "{text}");
    // The others last longer: 0.69 and 0.79 s.
    for (clip, end) in [("clip_0", "0.59"), ("clip_1", "0.69"), ("clip_2", "0.79")] {
        folder.write("other.toml", &text.replace("clip_0", clip));
        let output = folder.run(&["simulate", "other.toml"]);
        succeeds(&output);
        let shown = words(&stdout(&output));
        assert!(shown.contains(&format!("t = {end}")), "{shown}");
        succeeds(&folder.run(&["predict", "fitted.toml", "--on", &format!("{clip}.csv")]));
    }
    // An end that the scene gives stays.
    folder.write("cable.toml", &cable().replace("step = 0.01", "step = 0.01\nend = 0.5"));
    folder.run(&["fit", "fit.toml", "--save", "fitted.toml", "-q"]);
    assert!(folder.read("fitted.toml").contains("end = 0.5\n"));
}

/// Scenes with parameters of their own are not one scene.
#[test]
fn experiments_with_own_parameters_have_own_saved_scenes() {
    let folder = folder();
    let own = "[[parameter]]\nname = \"damping.mass\"\nexperiment = \"clip_1\"\nstart = 0.5\n";
    let fit = replaced(PREDICTION, "held_out = true\n", "") + own;
    folder.write("fit.toml", &fit);
    folder.run(&["fit", "fit.toml", "--save", "fitted.toml", "-q"]);
    let mut saved: Vec<String> =
        folder.files().into_iter().filter(|name| name.starts_with("fitted")).collect();
    saved.sort();
    assert_eq!(saved, ["fitted-clip_0.toml", "fitted-clip_1.toml"].map(String::from));
}

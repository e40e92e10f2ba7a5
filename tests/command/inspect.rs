//! `rodfit inspect` describes the same tip in files of all programs equally, and prints a valid observation; `rodfit
//! init` writes templates whose fits run and recover the parameters of their data.

use crate::common::coarse;
use crate::common::formats::{Written, all, tip};
use crate::common::recordings::{csv, recorded};
use crate::folder::{Folder, refused, stderr, stdout, succeeds, words};
use rodfit::scene::Track;
use std::f64::consts::PI;

/// The tip of the folder's rod, in every format.
fn files() -> Vec<Written> {
    all(&tip(&coarse(8, 3.90625e-3, 0.4).problem().unwrap(), 24))
}

/// Options for the keys that the file itself does not contain: frame rate and scale.
fn unsaid(file: &Written) -> Vec<&'static str> {
    let fps = file.recording.fps.map(|_| ["--fps", "64"]);
    let scale = file.recording.scale.map(|_| ["--scale", "1e-3"]);
    fps.into_iter().chain(scale).flatten().collect()
}

/// A marker's name and places.
type Marker = (String, Vec<Option<[f64; 3]>>);

/// The description of the same tip in files of all programs: format, rate, unit, gaps, noise.
#[test]
fn inspection_is_equal_for_files_of_all_programs() {
    let folder = Folder::new();
    for file in files() {
        folder.write(file.name, &file.text);
        let mut arguments = vec!["inspect", file.name, "--json", "inspection.json"];
        if file.recording.fps.is_some() {
            arguments.extend(["--fps", "64"]);
        }
        let output = folder.run(&arguments);
        succeeds(&output);
        let (shown, inspection) = (stdout(&output), folder.json("inspection.json"));
        println!("{shown}");
        assert!(shown.contains(&format!("format = \"{}\"", file.format)), "{shown}");
        assert_eq!(
            (inspection["format"].as_str(), inspection["frames"].as_u64()),
            (Some(file.format), Some(24))
        );
        // The frame rate with which all files are written (`RATE`).
        assert_eq!(inspection["rate"].as_f64().unwrap(), 64.0, "{}", file.name);
        let own = inspection["recording"]["marker"].as_str().map(str::to_string);
        assert_eq!(own, file.recording.marker, "{}", file.name);
        let markers = inspection["markers"].as_array().unwrap();
        let marker = markers.iter().find(|m| own.as_deref().is_none_or(|own| m["name"] == own));
        let marker = marker.unwrap();
        let likely = ["deeplabcut", "sleap"].contains(&file.format);
        assert_eq!(marker["low_confidence"].as_u64(), likely.then_some(1), "{}", file.name);
        assert_eq!(marker["gaps"], serde_json::json!([1, 1]), "{}", file.name);
        assert_eq!(marker["detected"], 23, "{}", file.name);
        // Rounded to a 1024th of a millimeter, and smooth against the frames but for its own third derivative.
        assert!(marker["noise"].as_f64().unwrap() < 0.3, "{marker}");
    }
}

/// The printed observation is complete if the file has frame rate and unit: a fit with it runs.
#[test]
fn printed_observation_is_valid_in_a_fit_file() {
    let folder = Folder::new();
    for file in files() {
        folder.write(file.name, &file.text);
        let mut arguments = vec!["inspect", file.name, "--json", "inspection.json"];
        arguments.extend(unsaid(&file));
        succeeds(&folder.run(&arguments));
        let observation =
            folder.json("inspection.json")["observation"].as_str().unwrap().to_string();
        // What only the person knows: the camera's axes.
        let observation = match file.name {
            "xypts.csv" => observation.replace("origin = [0, 0, 0]", "origin = [1, 1, 0]"),
            "xyzpts.csv" => {
                observation.replace("[\"x\", \"y\", \"z\"]", "[\"x\", \"z\", \"none\"]")
            }
            _ => observation,
        };
        assert!(!observation.contains(".."), "{observation}");
        let fit = format!(
            "scene = \"scene.toml\"\n{observation}\n[[parameter]]\nname = \"youngs_modulus\"\n"
        );
        folder.write("pasted.toml", &fit);
        let scene = crate::folder::replaced(crate::folder::SCENE, "end = 0.3", "end = 0.4");
        folder.write("scene.toml", &scene);
        let output = folder.run(&["fit", "pasted.toml", "--json", "fit.json"]);
        let code = output.status.code();
        assert!(code == Some(0) || code == Some(3), "{}: {}{fit}", file.name, stderr(&output));
        let found = folder.json("fit.json")["parameters"][0]["value"].as_f64().unwrap();
        // The motion is simulated with 1e8 Pa; 24 frames determine it to a few per cent.
        assert!((found / 1e8 - 1.0).abs() < 0.05, "{}: {found:e}", file.name);
    }
}

/// Jumps, leaps of the clock, lost frames and swapped labels.
#[test]
fn inspection_reports_faults_of_a_file() {
    let folder = Folder::new();
    let clean = recorded(0, 120, 1e-5, |_| {});
    folder.write("clean.csv", &csv(&clean));
    let shown = stdout(&folder.run(&["inspect", "clean.csv"]));
    for words in [
        "Frames 120, from 0 s to 1.19 s, 100 frames/s",
        "7 markers, positions in m",
        "noise at most",
    ] {
        assert!(crate::folder::words(&shown).contains(words), "`{words}` in {shown}");
    }
    for words in ["jumps", "leaps", "lost", "label", "gaps"] {
        assert!(!shown.contains(words), "`{words}` in {shown}");
    }
    let markers = |change: &dyn Fn(&mut Vec<Marker>)| {
        let mut all =
            clean.markers().iter().map(|m| (m.name.clone(), m.seen.clone())).collect::<Vec<_>>();
        change(&mut all);
        all
    };
    let jumping = markers(&|all| {
        all[3].1[50].as_mut().unwrap()[1] += 0.03;
        let other = all[5].1.clone();
        all[5].1 = std::mem::replace(&mut all[4].1, other);
        all[2].1[20..25].fill(None);
    });
    let mut times = clean.times().to_vec();
    times[80..].iter_mut().for_each(|t| *t += 0.03);
    folder.write("faulty.csv", &csv(&Track::new(times, jumping).unwrap()));
    let shown = words(&stdout(&folder.run(&["inspect", "faulty.csv"])));
    for words in [
        "the time jumps after 0.79 s: frames missing: 3",
        "lost once for up to 5",
        "jumps once for one frame, first at 0.5 s",
        "the labels of markers 4 and 5 are swapped",
    ] {
        assert!(shown.contains(words), "`{words}` in {shown}");
    }
    folder.write("pixels.csv", "t,x,y\n0,1040,360\n0.01,1039,366\n");
    let shown = words(&stdout(&folder.run(&["inspect", "pixels.csv"])));
    assert!(shown.contains("far from the origin") && shown.contains("x[px] or x[mm]"), "{shown}");
    refused(&folder.run(&["inspect", "none.csv"]), &["none.csv"]);
    folder.write("text.csv", "dear diary\n");
    refused(&folder.run(&["inspect", "text.csv"]), &["text.csv:1", "no column t"]);
    refused(
        &folder.run(&["inspect", "clean.csv", "--json", "clean.csv"]),
        &["an input of this run"],
    );
}

/// All files of each template run, recover the parameters of their data, and are not overwritten without `--overwrite`.
#[test]
fn templates_with_synthetic_data_run() {
    for (template, truth) in [
        ("cantilever", vec![1.1e8, 0.4]),
        ("droop", vec![3e7]),
        ("frequencies", vec![1.1e8]),
        ("helix", vec![1.1e7]),
        ("cable", vec![1e7]),
    ] {
        let folder = Folder::new();
        let output = folder.run(&["init", template]);
        succeeds(&output);
        let fit = format!("{template}-fit.toml");
        assert!(stdout(&output).contains(&format!("rodfit fit {fit}")), "{}", stdout(&output));
        succeeds(&folder.run(&["parameters", &format!("{template}.toml"), "-q"]));
        let output = folder.run(&["fit", &fit, "--json", "found.json"]);
        succeeds(&output);
        println!("{}", stdout(&output));
        let found = folder.json("found.json");
        for (k, truth) in truth.iter().enumerate() {
            let [low, high] =
                [0, 1].map(|end| found["parameters"][k]["interval95"][end].as_f64().unwrap());
            // Three standard errors, and not two.
            let room = 0.25 * (high - low);
            assert!(
                low - room < *truth && *truth < high + room,
                "{template}: {}",
                found["parameters"]
            );
        }
        let before = folder.read(&fit);
        refused(&folder.run(&["init", template]), &["which exists", "--overwrite"]);
        folder.write(&fit, "mine");
        refused(&folder.run(&["init", template]), &["which exists"]);
        assert_eq!(folder.read(&fit), "mine");
        succeeds(&folder.run(&["init", template, "--overwrite"]));
        assert_eq!(folder.read(&fit), before);
    }
}

#[test]
fn templates_with_recorded_data_run() {
    let folder = Folder::new();
    for file in files() {
        folder.write(file.name, &file.text);
        let mut arguments =
            vec!["init", "cantilever", "--force", "--into", "new", "--from", file.name];
        arguments.extend(unsaid(&file));
        succeeds(&folder.run(&arguments));
        // It runs; that the rod is another is the person's to say.
        let output = folder.run(&["fit", "new/cantilever-fit.toml", "--json", "found.json"]);
        let code = output.status.code();
        assert!(code == Some(0) || code == Some(3), "{}: {}", file.name, stderr(&output));
        assert_eq!(folder.json("found.json")["parameters"][0]["name"], "youngs_modulus");
    }
    // What is missing is asked for.
    let output = folder.run(&["init", "cantilever", "--force", "--from", "deeplabcut.csv"]);
    refused(&output, &["deeplabcut.csv", "Set fps to the number of frames per second"]);
    refused(
        &folder.run(&["init", "frequencies", "--from", "table.csv"]),
        &["--from", "frequencies"],
    );
    refused(&folder.run(&["init", "droop", "--from", "table.csv"]), &["table.csv:1", "allowed"]);
    // A cable's lengths, step and way up are those of its recording.
    let track = recorded(3, 120, 1e-5, |_| {});
    folder.write("clip.csv", &csv(&track));
    folder
        .write("few.csv", "t,xa,ya,xb,yb,xc,yc\n0,0,0,1,0,2,0\n0.1,0,0,1,0,2,0\n0.2,0,0,1,0,2,0\n");
    let output = folder.run(&["init", "cable", "--from", "few.csv"]);
    refused(&output, &["--from", "3 markers", "5 or more"]);
    succeeds(&folder.run(&["init", "cable", "--from", "clip.csv"]));
    let scene = folder.read("cable.toml");
    for words in
        ["segments = 6 ", "lengths = [0.07, 0.07, 0.0", "step = 0.01 ", "gravity = [0, -9.81, 0]"]
    {
        assert!(scene.contains(words), "`{words}` in {scene}");
    }
    let output = folder.run(&["fit", "cable-fit.toml", "--json", "found.json"]);
    assert!(output.status.code() == Some(0), "{}{}", stdout(&output), stderr(&output));
}

/// A tip that swings 5 cm at 2 Hz from 0.25 s on, in ms and mm; 200 frames a second.
fn pre_trigger_record() -> String {
    let row = |k: u32| {
        let t = f64::from(k) / 200.0;
        let swing = |t: f64| if t < 0.0 { 0.0 } else { 25.0 * ((4.0 * PI * t).cos() - 1.0) };
        let noise = 0.1 * f64::from(k * 7919).sin();
        format!("{},{:.3},{:.3}\n", 5 * k, 300.0 + noise, swing(t - 0.25) - noise)
    };
    format!("t[ms],x[mm],y[mm]\n{}", (0..300).map(row).collect::<String>())
}

#[test]
fn pre_trigger_record_proposes_the_onset_as_time_zero() {
    let folder = Folder::new();
    folder.write("tip.csv", &pre_trigger_record());
    let output = folder.run(&["inspect", "tip.csv", "--json", "inspection.json"]);
    succeeds(&output);
    let zero = folder.json("inspection.json")["recording"]["time_zero"].as_f64().unwrap();
    // Within a frame of 5 ms.
    assert!((zero - 250.0).abs() <= 5.0, "{zero}");
    assert!(stdout(&output).contains(&format!("time_zero = {zero}")), "{}", stdout(&output));
    succeeds(&folder.run(&["init", "cantilever", "--from", "tip.csv", "--into", "new"]));
    let fit = folder.read("new/cantilever-fit.toml");
    assert!(fit.contains(&format!("time_zero = {zero}")), "{fit}");
}

/// A marker that moves in the first frame, one step after the zero of its clock or long after it.
#[test]
fn start_of_a_marker_that_never_rests_is_assumed() {
    for (first, zero) in [(0, "0"), (5, "0"), (4000, "4000")] {
        let folder = Folder::new();
        let row = |k: i32| {
            let t = 1e-3 * f64::from(5 * k);
            format!("{},{:.3},{:.3}\n", first + 5 * k, 300.0 + t, 25.0 * (9.0 * t + 0.4).cos())
        };
        folder.write(
            "tip.csv",
            &format!("t[ms],x[mm],y[mm]\n{}", (0..300).map(row).collect::<String>()),
        );
        let output = folder.run(&["inspect", "tip.csv"]);
        succeeds(&output);
        let shown = stdout(&output);
        let line = shown.lines().find(|line| line.starts_with("time_zero")).unwrap();
        assert!(
            line.starts_with(&format!("time_zero = {zero} ")) && line.contains("assumed"),
            "{line}"
        );
    }
}

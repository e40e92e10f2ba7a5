//! One fit file for many recordings of a cable between two grippers: free-run errors, faults of recordings, and contradictory
//! keys.

use crate::common::recordings::{MARKERS, MODULUS, csv, recorded};
use crate::folder::{Folder, refused, stdout, succeeds, words};
use rodfit::scene::Track;

const CABLE: &str = r#"
[rod]
segments = 6
shape = { kind = "straight", length = 0.42, direction = [1, 0, 0] }
section = { kind = "circle", radius = 1.5e-3 }
[material]
density = 1100
youngs_modulus = 3e8
[supports]
start = "recorded"
end = "recorded"
path = { file = "clip_0.csv" }
[loads]
gravity = [0, -9.8, 0]
damping = { mass = 0.5, stiffness = 0.02 }
[initial]
state = "recorded"
[time]
step = 0.01
scheme = "generalised-alpha"
"#;

const FIT: &str = r#"
[[experiment]]
scene = "cable.toml"
paths = ["clip_0.csv", "clip_1.csv", "clip_2.csv", "clip_3.csv", "clip_4.csv"]
[[experiment.observation]]
markers = "free"
every = 5
sigma = 1e-5
loss = "soft-l1"
glitches = "mask"

[[experiment]]
name = "another day"
scene = "cable.toml"
path = "clip_5.csv"
held_out = true
[[experiment.observation]]
markers = "free"
sigma = 1e-5

[[parameter]]
name = "youngs_modulus"
start = 3e8
"#;

/// A recording with the labels of two markers exchanged.
fn swapped(track: &Track, [a, b]: [usize; 2]) -> Track {
    let other = |j: usize| match j {
        j if j == a => b,
        j if j == b => a,
        j => j,
    };
    let of = |j: usize| (j.to_string(), track.markers()[other(j)].seen.clone());
    Track::new(track.times().to_vec(), (0..MARKERS).map(of).collect()).unwrap()
}

/// A folder with a cable scene, a fit file and six recordings of different length.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("cable.toml", CABLE);
    folder.write("fit.toml", FIT);
    for k in 0..6 {
        // Clips need not last as long as one another.
        let track = recorded(k, 60 + 5 * k as usize, 1e-5, |_| {});
        folder.write(&format!("clip_{k}.csv"), &csv(&track));
    }
    folder
}

#[test]
fn fit_of_many_recordings_reports_free_run_errors() {
    let folder = folder();
    let arguments = ["fit", "fit.toml", "--json", "fit.json", "--save", "fitted.toml"];
    let output = folder.run(&[&arguments[..], &["--report", "page"]].concat());
    succeeds(&output);
    let (shown, fit) = (stdout(&output), folder.json("fit.json"));
    println!("{shown}");
    let e = &fit["parameters"][0];
    let [low, high] = [0, 1].map(|k| e["interval95"][k].as_f64().unwrap());
    assert!(low < MODULUS && MODULUS < high, "{e}");
    assert_eq!(e["cluster_jackknife"]["experiments"], 5);
    let recordings = &fit["recordings"];
    assert_eq!(recordings["fitted"]["experiments"], 5);
    assert_eq!(recordings["held_out"]["worst_experiment"], "another day");
    let list = recordings["list"].as_array().unwrap();
    // Noise of 1e-5 m, and the response of the model to that of the grippers' markers.
    assert!(list.iter().all(|one| one["mean_error"].as_f64().unwrap() < 3e-5), "{list:?}");
    for words in ["5 recordings, fitted: mean", "1 recording, validation", "5 experiments"] {
        assert!(crate::folder::words(&shown).contains(words), "{words} in {shown}");
    }
    // Of the six recordings and fifteen observations, in lines of 80 columns, with the table of estimates by experiment.
    assert!(shown.lines().count() < 80, "{shown}");
    let page = folder.read("page/fit.html");
    assert!(
        page.contains("another day") && page.contains("between experiments, 95 %"),
        "no such words"
    );
    crate::report::is_whole(&page);
    for words in [
        "<h2>Free-run prediction errors</h2>",
        "mean error over the length of the window",
        "mean error over the speed of the marker",
        "<h3>another day, validation: ",
    ] {
        assert!(page.contains(words), "{words}");
    }
    // A dozen moments in the plane of the cable, each with all its markers.
    assert_eq!(page.matches("class=\"rod\"").count(), 12);
    let groups = page.split("class=\"observed\">").skip(1).map(|g| g.split("</g>").next().unwrap());
    assert!(groups.map(|g| g.matches("<circle").count()).eq([MARKERS; 12]));
    // Many markers have many coordinates, of which the worst are drawn; and no shapes twice.
    assert!(!page.contains("<h2>Trajectory</h2>"), "shapes are drawn twice");
    let plots = &folder.json("page/fit.json")["plot_data"]["recordings"];
    assert_eq!(plots["motions"].as_array().unwrap().len(), 6);
    let windows = plots["windows"].as_array().unwrap();
    let lengths: Vec<f64> = windows.iter().map(|w| w["length"].as_f64().unwrap()).collect();
    // Window lengths below the shortest recording, 0.59 s.
    assert_eq!(lengths, [0.1, 0.25, 0.5]);
    // Recordings of 0.59 to 0.79 s, and one of 0.84 s; eight windows in each at most.
    let ends = |held_out: bool| if held_out { vec![84] } else { vec![59, 64, 69, 74, 79] };
    for (window, frames) in windows.iter().zip([10, 25, 50]) {
        for (what, held_out) in [("fitted", false), ("held_out", true)] {
            let count: u64 = ends(held_out).iter().map(|end| (end / frames).min(8)).sum();
            assert_eq!(window[what]["count"].as_u64(), Some(count), "{window}");
        }
        // As above, in windows.
        assert!(window["fitted"]["mean"].as_f64().unwrap() < 3e-5, "{window}");
    }
    // One scene of the cable, which can be run from anywhere, as long as its recording lasts.
    succeeds(&folder.run(&["simulate", "fitted.toml", "-q"]));
    let saved = folder.read("fitted.toml");
    assert!(saved.contains("clip_0.csv") && !saved.contains("end = 0."), "{saved}");
}

#[test]
fn faults_of_a_recording_are_reported() {
    let folder = folder();
    let track = recorded(0, 60, 1e-5, |_| {});
    folder.write("clip_0.csv", &csv(&swapped(&track, [2, 3])));
    let output = folder.run(&["simulate", "cable.toml"]);
    let shown = words(&stdout(&output));
    assert!(shown.contains("the labels of markers 2 and 3 are swapped"), "{shown}");
    assert!(shown.contains("swapped_labels = \"mend\""), "{shown}");
    let mended = CABLE.replace("clip_0.csv\"", "clip_0.csv\", swapped_labels = \"mend\"");
    folder.write("cable.toml", &mended);
    let output = folder.run(&["fit", "fit.toml", "--json", "fit.json"]);
    succeeds(&output);
    assert!(words(&stdout(&output)).contains("They were exchanged"), "{}", stdout(&output));
    let errors = folder.json("fit.json")["recordings"]["fitted"]["worst"].as_f64().unwrap();
    // The recorded noise is 1e-5 m; swapped labels would be centimeters.
    assert!(errors < 3e-5, "{errors}");
}

#[test]
fn contradictory_recordings_are_rejected() {
    let folder = folder();
    let cases: &[(&str, &str, &[&str])] = &[
        ("every = 5", "every = 0", &["observation[0].every", "1 or more"]),
        ("every = 5", "every = 5\npoint = \"tip\"", &["observation[0].markers", "no file, point"]),
        ("markers = \"free\"\nevery", "file = \"clip_0.csv\"\nevery", &["observation[0].every"]),
        ("markers = \"free\"\nevery", "every", &["missing", "observation[0].file"]),
        ("markers = \"free\"\nevery", "markers = \"all\"\nevery", &["all", "free"]),
        ("glitches = \"mask\"", "glitches = \"mend\"", &["mend", "keep"]),
        (
            "paths = [",
            "path = \"clip_0.csv\"\npaths = [",
            &["experiment[0].paths", "one of the two"],
        ),
        (
            "paths = [",
            "name = \"a\"\npaths = [",
            &["experiment[0].name", "no name together with paths"],
        ),
        ("clip_4.csv", "clip_3.csv", &["experiment[4].name", "each name once"]),
        ("clip_4.csv", "none.csv", &["none.csv"]),
        ("scene = \"cable.toml\"\npaths", "scene = \"scene.toml\"\npaths", &["supports.path"]),
    ];
    for (from, to, words) in cases {
        folder.write("fit.toml", &crate::folder::replaced(FIT, from, to));
        refused(&folder.run(&["fit", "fit.toml"]), words);
    }
    folder.write("fit.toml", FIT);
    for (from, to, words) in [
        (
            "file = \"clip_0.csv\"",
            "file = \"clip_0.csv\", lost_frames = \"drop\"",
            &["drop", "stretch"],
        ),
        ("step = 0.01", "step = 0.01\nend = 9.0", &["time.end", "9 s"]),
        (
            "start = \"recorded\"\nend = \"recorded\"\npath = { file = \"clip_0.csv\" }",
            "",
            &["supports.path", "none"],
        ),
    ] {
        folder.write("cable.toml", &crate::folder::replaced(CABLE, from, to));
        refused(&folder.run(&["fit", "fit.toml"]), &words[..1]);
    }
}

//! The page of a simulation: its animation, its size for long runs, and its completeness for spatial and stopped runs. It is
//! one file that needs nothing else.

use crate::folder::{Folder, change, stderr, stdout, succeeds};
use crate::report::is_whole;
use serde_json::Value;

/// Data of the animation, the page without its scripts, and its length in bytes. The script must not load anything.
fn page(folder: &Folder) -> (Value, String, usize) {
    let page = folder.read("page/simulation.html");
    let (before, script) =
        page.split_once("<script type=\"application/json\" id=\"motion\">").unwrap();
    let (data, rest) = script.split_once("</script>").unwrap();
    let (program, after) = rest.split_once("<script>").unwrap().1.split_once("</script>").unwrap();
    // It runs by itself: nothing is loaded.
    for forbidden in ["http", "fetch", "import", "src", "eval"] {
        assert!(!program.contains(forbidden), "{forbidden}");
    }
    (serde_json::from_str(data).unwrap(), format!("{before}{after}"), page.len())
}

#[test]
fn simulation_page_has_the_animation() {
    let folder = Folder::new();
    let run = ["simulate", "scene.toml", "--report", "page", "--json", "run.json"];
    succeeds(&folder.run(&run));
    let (data, text, length) = page(&folder);
    is_whole(&text);
    for part in [
        "Completed",
        "Energy conserved within",
        "<canvas",
        "Shapes over time",
        "Tip trajectory",
        "bending",
        "Play",
    ] {
        assert!(text.contains(part), "{part}");
    }
    assert!(!text.contains("twisting") && !text.contains("Azimuth"), "planar");
    assert!(length < 500_000, "{length}");
    // The moments of the run, and places that are those of its tip, in whole cells.
    let json = folder.json("run.json");
    let tips = json["tip"].as_array().unwrap();
    let times = data["times"].as_array().unwrap();
    assert_eq!((times.len(), data["frames"].as_array().unwrap().len()), (151, 151));
    assert_eq!(data["axes"], serde_json::json!(["x", "y"]));
    let last = |value: &Value| value.as_array().unwrap().last().unwrap().as_f64().unwrap();
    let place = |k: usize, c: usize| tips[k][c + 1].as_f64().unwrap();
    let cell = data["bar"]["cells"].as_f64().unwrap() / 0.1;
    for k in [0, 75, 150] {
        assert_eq!(times[k].as_f64(), tips[k][0].as_f64());
        let off = last(&data["frames"][k]) - last(&data["frames"][0]);
        let expected = (place(k, 1) - place(0, 1)) * cell;
        // The coordinate of the animation is the displacement over the cell, rounded twice to integers.
        assert!((off - expected).abs() < 10.0, "{off} {expected}");
    }
}

#[test]
fn page_of_a_long_run_stays_small() {
    let folder = Folder::new();
    let scene = change("step = 2e-3", "step = 2e-5").replace("segments = 20", "segments = 250");
    folder.write("scene.toml", &scene.replace("end = 0.3", "end = 0.05"));
    let output = folder.run(&["simulate", "scene.toml", "--report", "page"]);
    succeeds(&output);
    let (data, text, length) = page(&folder);
    let count = |name: &str| data[name].as_array().unwrap().len();
    // Up to 200 shapes and 1000 samples beside the first ones, of up to 100 edges: `Film`.
    assert!((100..=202).contains(&count("frames")) && count("tips") <= 1002, "{}", count("tips"));
    assert!(data["frames"][0].as_array().unwrap().len() <= 2 * 102);
    assert!(text.contains("Stored on this page: every") && text.contains("of 251 nodes"));
    assert!(length < 900_000, "{length}");
    assert!(stdout(&output).contains("2500 steps"));
}

#[test]
fn page_of_a_spatial_or_stopped_run_is_complete() {
    let folder = Folder::new();
    let helix = change(
        "kind = \"straight\", length = 0.5, direction = [1, 0, 0]",
        "kind = \"helix\", length = 0.5, radius = 0.05, pitch = 0.1, axis = [0, 0, -1], handedness = \"right\"",
    );
    folder.write("scene.toml", &helix.replace("[0, -9.8, 0]", "[0, 0, -9.8]"));
    succeeds(&folder.run(&["simulate", "scene.toml", "--report", "page"]));
    let (data, text, _) = page(&folder);
    assert_eq!(data["axes"], serde_json::json!(["x", "y", "z"]));
    assert!(text.contains("id=\"turn\"") && text.contains("twisting"));
    // A load that no step of this length follows.
    let force = "gravity = [0, -9.8, 0]\npoint = [{ node = \"tip\", force = [-500, 3, 0] }]";
    let scene = change("gravity = [0, -9.8, 0]", force).replace("step = 2e-3", "step = 2e-2");
    folder.write("scene.toml", &scene);
    let output = folder.run(&["simulate", "scene.toml", "--report", "page"]);
    assert_eq!(output.status.code(), Some(3));
    let (_, text, _) = page(&folder);
    is_whole(&text.replace("infinite", ""));
    assert!(text.contains("class=\"verdict bad\"") && text.contains("Stopped: "), "{text}");
    let code = "energy-growth";
    assert!(text.contains(&format!("<code>{code}</code></summary>")));
    assert!(stderr(&output).contains(&format!("[{code}]")));
}

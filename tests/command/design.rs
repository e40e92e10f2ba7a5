//! `rodfit design`: printed and JSON results, chosen numerics, exit code 3 of a plan that does not determine a parameter,
//! and errors of invalid plans.

use crate::folder::{Folder, refused, replaced, stderr, stdout, succeeds};

const PLAN: &str = r#"
scene = "scene.toml"
[[observation]]
point = { arc_length = 0.4 }
axes = ["x", "y", "none"]
duration = 0.25
fps = 80
sigma = 1e-3
[[parameter]]
name = "youngs_modulus"
start = 2e8
"#;

/// Runs `rodfit design` with this plan and more arguments in a new folder.
fn run(plan: &str, more: &[&str]) -> (Folder, std::process::Output) {
    let folder = Folder::new();
    folder.write("plan.toml", plan);
    let output = folder.run(&[&["design", "plan.toml"], more].concat());
    (folder, output)
}

#[test]
fn design_is_printed_and_written_as_json() {
    let (_, output) = run(PLAN, &[]);
    succeeds(&output);
    let words = stdout(&output);
    for part in ["2.000", "by marker position", "by duration", "by frame rate", "0.400", "best"] {
        assert!(words.contains(part), "`{part}` in: {words}");
    }
    let (folder, output) = run(PLAN, &["--known", "rod.section.radius=5e-5", "--json", "d.json"]);
    succeeds(&output);
    let design = folder.json("d.json");
    let parameter = &design["parameters"][0];
    // The modulus of the scene.
    assert_eq!(parameter["value"], 2e8);
    assert!(parameter["combined_std"].as_f64() > parameter["std_error"].as_f64());
    let variables: Vec<&str> = design["advice"]
        .as_array()
        .unwrap()
        .iter()
        .map(|a| a["variable"].as_str().unwrap())
        .collect();
    assert_eq!(variables, ["marker_position", "duration", "frame_rate"]);
}

/// Neither a mesh nor a step in the scene, and a recording that is there.
#[test]
fn design_without_mesh_and_data_chooses_numerics() {
    let folder = Folder::new();
    let scene = replaced(&folder.read("scene.toml"), "segments = 20", "");
    folder.write("scene.toml", &replaced(&replaced(&scene, "step = 2e-3", ""), "beta = 0.5", ""));
    refused(&folder.run(&["design", "fit.toml"]), &["fit.toml", "observation[0].sigma"]);
    let output = folder.run(&["design", "fit.toml", "--sigma", "1e-3"]);
    succeeds(&output);
    assert!(stdout(&output).contains("by marker position (tip.csv)"), "{}", stdout(&output));
}

#[test]
fn unidentifiable_design_exits_with_3() {
    let both = format!("{PLAN}[[parameter]]\nname = \"density\"\n");
    let (_, output) = run(&both, &[]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stdout(&output).contains("density: not identifiable with any other"));
}

#[test]
fn invalid_plan_is_rejected() {
    for (from, to, words) in [
        ("fps = 80", "", &["plan.toml", "observation[0].fps"][..]),
        ("fps = 80", "fps = -1", &["plan.toml", "observation[0].fps", "-1"]),
        ("fps = 80", "fps = 1e9", &["observation[0].fps", "frames"]),
        ("fps = 80", "fps = 1", &["observation[0].fps", "frames"]),
        ("duration = 0.25", "duration = nan", &["observation[0].duration", "NaN"]),
        ("duration = 0.25", "duration = 7", &["observation[0].duration", "time.end = 0.3"]),
        ("duration = 0.25", "duration = 0.25\nfile = \"tip.csv\"", &["observation[0].duration"]),
        ("duration = 0.25", "duration = 0.25\nevery = 2", &["observation[0].duration"]),
        ("sigma = 1e-3", "", &["plan.toml", "observation[0].sigma"]),
        ("0.4", "0.7", &["plan.toml", "observation[0].point", "0.7"]),
        (
            "name = \"youngs_modulus\"\nstart = 2e8",
            "name = \"damping.mass\"",
            &["parameter[0].start", "above 0"],
        ),
        ("[[observation]]", "[[shape]]\nat = [0.7]\nsigma = 1e-3\n[[observation]]", &["0.7"]),
        ("[[observation]]", "[[shape]]\nsigma = 1e-3\n[[observation]]", &["shape[0].file"]),
    ] {
        let (_, output) = run(&replaced(PLAN, from, to), &[]);
        refused(&output, words);
    }
    refused(&run(PLAN, &["--sigma", "0"]).1, &["--sigma", "above 0"]);
    let (folder, _) = run(PLAN, &[]);
    refused(&folder.run(&["fit", "plan.toml"]), &["plan.toml", "observation[0].file", "planned"]);
}

/// The sigma of the command line is a length: readings of an angle need their own.
#[test]
fn sigma_of_the_command_line_is_that_of_positions_only() {
    let folder = Folder::new();
    let rows = (0..10).map(|k| f64::from(k) * 0.02).map(|t| format!("{t},{}\n", -4.0 * t * t));
    folder.write("angle.csv", &format!("t,angle\n{}", rows.collect::<String>()));
    let sensor = "[[observation]]\nquantity = \"angle\"\nfile = \"angle.csv\"\n[[parameter]]";
    let plan = replaced(&replaced(PLAN, "sigma = 1e-3\n", ""), "[[parameter]]", sensor);
    folder.write("plan.toml", &plan);
    let output = folder.run(&["design", "plan.toml", "--sigma", "1e-3"]);
    refused(&output, &["observation[1].sigma", "found none", "a number in rad"]);
}

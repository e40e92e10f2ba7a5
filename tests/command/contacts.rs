//! Contacts in the outputs of `rodfit simulate`: forces of obstacles in JSON and CSV, and the advice of a run that stops.

use crate::folder::{Folder, stderr, succeeds};
use serde_json::Value;

/// A rod of 100 edges that lies on a plane, clamped at its start, with this scheme.
fn scene(scheme: &str) -> String {
    format!(
        "[rod]\nsegments = 100\nshape = {{ kind = \"straight\", length = 0.5, direction = [1, 0, 0] }}\n\
         section = {{ kind = \"circle\", radius = 0.002 }}\n[material]\ndensity = 1200\nyoungs_modulus = 5e7\n\
         [loads]\ngravity = [0, -9.81, 0]\n[loads.damping]\nmass = 1\n[time]\nend = 0.1\nstep = 1e-3\n{scheme}\n\
         [[contacts]]\nkind = \"plane\"\npoint = [0, -0.002, 0]\nnormal = [0, 1, 0]\nfriction = 0.3\ndamping = 100\n"
    )
}

/// Damping brings the rod to rest in 0.1 s. Plane and wall carry its weight together.
#[test]
fn forces_of_obstacles_are_written_to_json_and_csv() {
    let folder = Folder::new();
    folder.write("contact.toml", &scene("scheme = \"generalised-alpha\""));
    let files = ["--reactions", "--json", "run.json", "--out", "run.csv"];
    succeeds(&folder.run(&[&["simulate", "contact.toml"][..], &files].concat()));
    let json: Value = serde_json::from_str(&folder.read("run.json")).unwrap();
    let states = json["contact_forces"].as_array().unwrap();
    assert_eq!((states.len(), states[100]["time"].as_f64()), (101, Some(0.1)));
    let table = folder.read("run.csv");
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|own| *own == name).unwrap();
    let (contact, wall) = (column("contact_0_fy[N]"), column("start_fy[N]"));
    let last: Vec<f64> =
        lines.next_back().unwrap().split(',').map(|x| x.parse().unwrap()).collect();
    assert_eq!(states[100]["forces"][0][1].as_f64().unwrap(), last[contact]);
    let weight = 1200.0 * std::f64::consts::PI * 0.002 * 0.002 * 0.5 * 9.81;
    let carried = (last[contact] + last[wall]) / weight;
    assert!((carried - 1.0).abs() < 1e-6, "{carried}");
}

/// A scene with contacts and a step has a scheme with numerical damping unless it gives another, also by a number of it.
#[test]
fn default_scheme_of_contacts_keeps_a_rod_at_rest_on_a_plane() {
    let folder = Folder::new();
    let without_losses = |scheme: &str| scene(scheme).replace("friction = 0.3\ndamping = 100", "");
    folder.write("contact.toml", &without_losses(""));
    folder.write("beta.toml", &without_losses("beta = 0.5"));
    succeeds(&folder.run(&["simulate", "contact.toml", "--json", "run.json"]));
    let json: Value = serde_json::from_str(&folder.read("run.json")).unwrap();
    assert_eq!(json["scene"]["time"]["scheme"].as_str(), Some("generalised-alpha"));
    for number in ["tolerance = 1e-12", "rho_inf = 0.4"] {
        folder.write("number.toml", &without_losses(number));
        succeeds(&folder.run(&["simulate", "number.toml"]));
    }
    let stopped = folder.run(&["simulate", "beta.toml"]);
    assert_eq!(stopped.status.code(), Some(3));
}

/// Newmark's method without numerical damping gains energy where contacts begin and end within a step.
#[test]
fn growing_energy_of_a_scene_with_contacts_names_their_stiffness() {
    let folder = Folder::new();
    folder.write(
        "contact.toml",
        &scene("scheme = \"newmark-beta\"").replace("friction = 0.3\ndamping = 100", ""),
    );
    let output = folder.run(&["simulate", "contact.toml"]);
    assert_eq!(output.status.code(), Some(3));
    let text = stderr(&output);
    assert!(
        text.contains("stiffness of the contacts") && text.contains("[energy-growth]"),
        "{text}"
    );
}

/// The data of the animation have the outline of the obstacle, and its displacements at all stored times.
#[cfg(feature = "page")]
#[test]
fn obstacles_are_in_the_animation() {
    let folder = Folder::new();
    let moved = "motion = [{ displacement = [0, -0.01, 0], ramp = 0.05 }]\n";
    folder.write("contact.toml", &(scene("scheme = \"generalised-alpha\"") + moved));
    succeeds(&folder.run(&["simulate", "contact.toml", "--report", "page"]));
    let page = folder.read("page/simulation.html");
    let start = page.split_once("id=\"motion\">").unwrap().1;
    let data: Value = serde_json::from_str(start.split_once("</script>").unwrap().0).unwrap();
    let obstacle = &data["obstacles"][0];
    assert_eq!(
        obstacle["lines"][0].as_array().unwrap().len(),
        4,
        "a line of two points in a plane"
    );
    let moved = obstacle["moved"].as_array().unwrap();
    assert_eq!(moved.len(), data["frames"].as_array().unwrap().len());
    assert_eq!(moved[0], serde_json::json!([0, 0]));
    assert!(moved.last().unwrap()[1].as_f64().unwrap() < -100.0, "{moved:?}");
}

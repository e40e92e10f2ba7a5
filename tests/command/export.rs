//! `rodfit export`: the numbers of the files against the formulas of the rod, and rods that no file can have.

use crate::folder::{Folder, change, refused, replaced, stderr, stdout, succeeds};
use std::f64::consts::PI;

/// Radius, m, Young's modulus, Pa, and density, kg/m^3, of the scene.
const RADIUS: f64 = 0.005;
const MODULUS: f64 = 1e8;
const DENSITY: f64 = 1273.52;

/// Values of an attribute in a text, in order.
fn attribute(text: &str, before: &str) -> Vec<f64> {
    text.split(before)
        .skip(1)
        .map(|part| part.split('"').next().unwrap().parse().unwrap())
        .collect()
}

/// Section constants of the scene: EI, N m^2, and mass per length, kg/m.
struct Constants {
    bending: f64,
    line_density: f64,
}

/// The constants of a circle of this radius, m, with modulus, Pa, and density, kg/m^3.
fn constants(radius: f64, modulus: f64, density: f64) -> Constants {
    let area = PI * radius * radius;
    Constants { bending: modulus * area * radius * radius / 4.0, line_density: density * area }
}

#[test]
fn mujoco_links_have_mass_and_stiffness_of_the_rod() {
    let folder = Folder::new();
    let output = folder.run(&["export", "scene.toml", "--to", "mujoco", "--segments", "10"]);
    succeeds(&output);
    let text = stdout(&output);
    // The wall cuts the first edge in its middle: 9.5 edges between wall and tip.
    let length = 0.5 / 9.5;
    let rod = constants(RADIUS, MODULUS, DENSITY);
    assert_eq!(text.matches("<body name=\"link_").count(), 10);
    assert_eq!(text.matches("<body").count(), text.matches("</body>").count());
    let masses = attribute(&text, "mass=\"");
    assert!(masses.iter().all(|mass| (mass / (rod.line_density * length) - 1.0).abs() < 1e-12));
    // Three hinges at each of nine joints, and none at the clamped first link. GJ/EI = 1/(1 + 0.5).
    let stiffness = attribute(&text, " stiffness=\"");
    assert_eq!(stiffness.len(), 27);
    // Every second joint has its hinges in the reverse order.
    for (i, joint) in stiffness.chunks(3).enumerate() {
        let twist = if i % 2 == 0 { 2 } else { 0 };
        for (k, stiffness) in joint.iter().enumerate() {
            let relative = if k == twist { 1.0 / 1.5 } else { 1.0 };
            assert!((stiffness * length / rod.bending / relative - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn rod_without_shear_modulus_has_no_twist_in_mujoco() {
    let folder = Folder::new();
    folder.write("plane.toml", &change("poisson_ratio = 0.5", ""));
    let output = folder.run(&["export", "plane.toml", "--to", "mujoco", "--segments", "10"]);
    succeeds(&output);
    assert_eq!(stdout(&output).matches("type=\"hinge\"").count(), 18);
    assert!(stderr(&output).contains("no twist"), "{}", stderr(&output));
}

#[test]
fn table_has_the_constants_of_the_section_in_every_row() {
    let folder = Folder::new();
    let output = folder.run(&["export", "scene.toml", "--to", "csv"]);
    succeeds(&output);
    let text = stdout(&output);
    let rod = constants(RADIUS, MODULUS, DENSITY);
    assert_eq!(text.lines().count(), 21);
    for line in text.lines().skip(1) {
        let row: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        assert!(
            (row[2] / rod.bending - 1.0).abs() < 1e-12
                && (row[3] / rod.bending - 1.0).abs() < 1e-12
        );
        assert!((row[5] / rod.line_density - 1.0).abs() < 1e-12);
    }
}

#[test]
fn frames_for_paraview_end_at_the_simulated_tip() {
    let folder = Folder::new();
    succeeds(&folder.run(&["simulate", "scene.toml", "--json", "run.json"]));
    let output =
        folder.run(&["export", "scene.toml", "--to", "vtk", "--frames", "4", "--out", "frames"]);
    succeeds(&output);
    let list = folder.read("frames/rod.pvd");
    assert_eq!(list.matches("<DataSet").count(), 4);
    let last = folder.read("frames/rod_0003.vtp");
    let points = last.split("Name=\"points\"").nth(1).unwrap();
    let rows: Vec<&str> =
        points.lines().skip(1).take_while(|line| !line.starts_with('<')).collect();
    let tip: Vec<f64> = rows.last().unwrap().split(' ').map(|x| x.parse().unwrap()).collect();
    let tips = folder.json("run.json")["tip"].as_array().unwrap().clone();
    let expected = tips.last().unwrap();
    assert!((0..3).all(|c| (tip[c] - expected[c + 1].as_f64().unwrap()).abs() < 1e-12));
}

#[test]
fn rods_that_no_file_can_have_are_rejected() {
    let folder = Folder::new();
    let sliding = "[supports]\nstart = \"pinned\"\nend = \"roller\"\n[material]";
    folder.write("roller.toml", &change("[material]", sliding));
    refused(&folder.run(&["export", "roller.toml", "--to", "mujoco"]), &["supports.end", "roller"]);
    refused(&folder.run(&["export", "scene.toml", "--to", "vtk"]), &["--out", "folder"]);
    refused(
        &folder.run(&["export", "scene.toml", "--to", "csv", "--out", "scene.toml"]),
        &["input"],
    );
}

#[test]
fn notes_name_only_what_the_file_does_not_have() {
    let folder = Folder::new();
    let damped = |times: &str| {
        let gravity = "gravity = [0, -9.8, 0]";
        let scene = change(gravity, &format!("{gravity}\ndamping = {{ mass = 1.0, {times} }}"));
        replaced(&scene, "[material]", "[[rod.mass]]\nnode = \"tip\"\nmass = 1e-3\n[material]")
    };
    let notes = |target: &str| {
        let output = folder.run(&["export", "scene.toml", "--to", target]);
        succeeds(&output);
        stderr(&output)
    };
    // A curve of USD has the attributes of mass damping and of the viscous time of bending.
    folder.write("scene.toml", &damped("bending = 0.01"));
    let of_curve = notes("usd");
    assert!(!of_curve.contains("damping") && of_curve.contains("point masses"), "{of_curve}");
    let of_table = notes("csv");
    for part in ["mass-proportional damping", "damping of strains", "point masses"] {
        assert!(of_table.contains(part), "`{part}` in: {of_table}");
    }
    for times in ["stiffness = 0.01", "twisting = 0.01", "stretching = 0.01"] {
        folder.write("scene.toml", &damped(times));
        let of_curve = notes("usd");
        assert!(
            of_curve.contains("not in this file: damping of twist and stretching"),
            "{of_curve}"
        );
        assert!(!of_curve.contains("strains"), "{of_curve}");
    }
}

//! Files of structures: the shipped one, the documented one, and the commands.

use rodfit::fit::FitFile;
use rodfit::{Error, Scene, Structure, StructureScene};
#[cfg(feature = "cli")]
use std::process::Command;

use crate::scenes::{joint, rod, steel, support};

#[test]
fn documented_structure_is_valid_and_stable() {
    let page = include_str!("../../docs/reference/structures.md");
    let text = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let structure = Structure::new(StructureScene::from_toml(text, ".").unwrap()).unwrap();
    assert!(structure.equilibrium().unwrap().stable_in_plane);
    structure.simulation().unwrap().step_to(1e-3).unwrap();
}

/// The output of `rodfit` with these arguments.
#[cfg(feature = "cli")]
fn output(arguments: &[&str]) -> (Option<i32>, String, String) {
    let program = env!("CARGO_BIN_EXE_rodfit");
    let output = Command::new(program).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[cfg(feature = "cli")]
#[test]
fn commands_take_the_shipped_structure() {
    let file = "data/portal-frame.toml";
    let (code, json, _) = output(&["static", file, "--json", "-", "-q"]);
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &found["stable_in_plane"]), (Some(0), &true.into()));
    let (code, json, _) = output(&["modes", file, "--count", "2", "--json", "-", "-q"]);
    let modes: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, modes["modes"].as_array().unwrap().len()), (Some(0), 2));
    let (code, table, _) = output(&["simulate", file, "--out", "-", "-q"]);
    // 2001 states of 41 + 31 + 41 nodes.
    assert_eq!((code, table.lines().count()), (Some(0), 1 + 2001 * 113));
    let folder = std::env::temp_dir().join(format!("rodfit-structure-{}", std::process::id()));
    let report = folder.display().to_string();
    let (code, _, message) = output(&["simulate", file, "--report", &report, "-q"]);
    assert_eq!(code, Some(0), "{message}");
    let page = std::fs::read_to_string(folder.join("simulation.html")).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    // Twelve drawings of three rods, and an animation whose rods are separated.
    assert_eq!(page.matches("<polyline class=\"rod\"").count(), 12 * 3);
    assert!(page.contains("null,null"));
    let (code, _, message) = output(&["fit", file]);
    assert_eq!(code, Some(2));
    assert!(message.contains("this is a structure, not a fit file"), "{message}");
    let (code, list, _) = output(&["parameters", file, "--json", "-", "-q"]);
    assert_eq!((code, list.contains("\"joints.1.rotation\"")), (Some(0), true));
}

/// The joint connects a rod that does not exist, which only the building of the structure finds.
#[test]
fn structure_of_a_fit_is_checked_before_it_is_built() {
    let folder = tempfile::tempdir().unwrap();
    let text = [
        steel(),
        rod("a", 20, 0.5, [1.0, 0.0]),
        rod("b", 30, 0.5, [0.0, 1.0]),
        joint("rigid", &["a.end", "none.start"], ""),
        support("a.start", "clamped"),
    ];
    std::fs::write(folder.path().join("frame.toml"), text.concat()).unwrap();
    let fit = folder.path().join("fit.toml");
    let name = "materials.steel.youngs_modulus";
    let text = format!(
        "scene = \"frame.toml\"\n[[frequencies]]\nhz = [9, 50]\nsigma = 0.1\n[[parameter]]\nname = \"{name}\"\n"
    );
    std::fs::write(&fit, text).unwrap();
    let too_large = |scene: &Scene| {
        let found = scene.rod.segments.unwrap().to_string();
        let (key, allowed) = ("rod.segments".into(), "fewer".into());
        Err(Error::Invalid { file: None, key, found, allowed })
    };
    let error = FitFile::load_if(&fit, too_large).unwrap_err().to_string();
    assert!(error.contains("rod.segments: found 50"), "{error}");
    let error = FitFile::load(&fit).unwrap_err().to_string();
    assert!(error.contains("none"), "{error}");
}

//! Names of files: scenes and points in the folder of an environment variable, and outputs of several fits.
#![cfg(target_os = "linux")]

use crate::campaign::{FIT, folder, lines};
use crate::folder::{Folder, polyline, refused, replaced, stderr, succeeds};

#[test]
fn scene_of_a_campaign_is_read_from_the_folder_of_an_environment_variable() {
    let folder = folder("fits = [\"fit.toml\"]\n");
    std::fs::create_dir(folder.path("lab")).unwrap();
    folder.write("lab/rod.toml", &folder.read("scene.toml"));
    folder.write("fit.toml", &replaced(FIT, "scene.toml", "$LAB_OF_RODS/rod.toml"));
    let mut command = folder.command(&["campaign", "plan", "campaign.toml", "--out", "out"]);
    let output = command.env("LAB_OF_RODS", folder.path("lab")).output().unwrap();
    succeeds(&output);
    assert!(!stderr(&output).contains("will be rejected"), "{}", stderr(&output));
    assert_eq!(lines(&folder.read("out/tasks.jsonl")).len(), 1);
}

#[test]
fn size_of_points_is_limited_in_the_folder_of_an_environment_variable() {
    let folder = Folder::new();
    // 30 MB may be 1.5e6 points, whose equilibrium in space takes more memory than allowed.
    let points = "x,y,z\n0,0,0\n0.1,0.01,0\n0.2,0,0\n0.3,0.02,0\n";
    folder.write("rest.csv", &format!("{points}#{}\n", " ".repeat(30_000_000)));
    let scene = replaced(&polyline(), "[rod]", "[rod]\ndimension = \"spatial\"");
    for name in ["rest.csv", "$LAB_OF_RODS/rest.csv"] {
        folder.write("scene.toml", &replaced(&scene, "rest.csv", name));
        let mut command = folder.command(&["static", "scene.toml"]);
        let output = command.env("LAB_OF_RODS", folder.path("")).output().unwrap();
        refused(&output, &["scene.toml", "rod.segments", "1.5e6 nodes", "--no-limits"]);
    }
}

#[test]
fn outputs_of_several_fits_have_different_names_in_any_folders() {
    let folder = folder("");
    let fit = replaced(&replaced(FIT, "scene.toml", "../scene.toml"), "tip.csv", "../tip.csv");
    let fits = ["x/a-fit.toml", "a/fit.toml", "b/fit.toml"];
    for (own, name) in ["x", "a", "b"].into_iter().zip(fits) {
        std::fs::create_dir(folder.path(own)).unwrap();
        folder.write(name, &fit);
    }
    succeeds(&folder.run(&[&["fit"], &fits[..], &["--json", "out.json", "-q"]].concat()));
    let mut found = folder.files();
    found.retain(|name| name.starts_with("out"));
    found.sort();
    // `a-fit` would be the name of the first two.
    assert_eq!(found, ["out-a-fit.json", "out-b-fit.json", "out-x-a-fit.json"]);
}

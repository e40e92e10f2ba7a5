//! Destinations of outputs: temporary files of killed runs are removed, links are followed, and destinations that cannot be
//! written are rejected before the run.
#![cfg(target_os = "linux")]

use std::os::unix::fs::symlink;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use crate::folder::{Folder, change, refused, stderr, succeeds};

/// Longest accepted time before a run starts to write.
const PATIENCE: Duration = Duration::from_secs(60);

/// Names of all unfinished output files, with the suffix `.part`.
fn part_files(folder: &Folder) -> Vec<String> {
    folder.files().into_iter().filter(|name| name.ends_with(".part")).collect()
}

/// A child process that is killed when this value is dropped.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a simulation of days, and waits until it has a file.
fn writing(folder: &Folder, count: usize) -> Running {
    let arguments = ["simulate", "long.toml", "--force", "-q", "--out", "nodes.csv"];
    let child = Running(folder.command(&arguments).stdout(Stdio::null()).spawn().unwrap());
    let since = Instant::now();
    while part_files(folder).len() < count {
        assert!(since.elapsed() < PATIENCE, "no file");
        std::thread::sleep(Duration::from_millis(10));
    }
    child
}

#[test]
fn part_files_of_killed_runs_are_removed_by_the_next_run() {
    let folder = Folder::new();
    folder.write("long.toml", &change("step = 2e-3", "step = 1e-9"));
    for _ in 0..3 {
        drop(writing(&folder, 1));
    }
    // Each run has removed the file of the one before.
    let [killed] = &part_files(&folder)[..] else { panic!("{:?}", folder.files()) };
    // That of a run that is still at work stays, as do files of other names.
    let child = writing(&folder, 1);
    let own = loop {
        // What the killed run left is gone as soon as the next one has a file of its own.
        match &part_files(&folder)[..] {
            [own] if own != killed => break own.clone(),
            _ => std::thread::sleep(Duration::from_millis(10)),
        }
    };
    folder.write("other.csv.Ab3d5f.part", "of another output");
    succeeds(&folder.run(&["simulate", "scene.toml", "--out", "nodes.csv", "-q"]));
    let mut left = part_files(&folder);
    left.sort();
    assert_eq!(left, [own, "other.csv.Ab3d5f.part".into()]);
    drop(child);
    succeeds(&folder.run(&["simulate", "scene.toml", "--out", "nodes.csv", "-q"]));
    assert_eq!(part_files(&folder), ["other.csv.Ab3d5f.part"]);
}

#[test]
fn symbolic_links_are_followed() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("deep")).unwrap();
    folder.write("real.json", "{}");
    symlink("real.json", folder.path("link.json")).unwrap();
    // A chain of links whose end is not there yet.
    symlink("deep/second.json", folder.path("first.json")).unwrap();
    symlink("third.json", folder.path("deep/second.json")).unwrap();
    for (link, target) in [("link.json", "real.json"), ("first.json", "deep/third.json")] {
        succeeds(&folder.run(&["simulate", "scene.toml", "--json", link]));
        assert!(folder.path(link).symlink_metadata().unwrap().is_symlink(), "{link}");
        assert!(!folder.path(target).symlink_metadata().unwrap().is_symlink(), "{target}");
        assert_eq!(folder.json(target)["status"], "completed");
    }
    // A link that is an input by another name, and one that leads to itself.
    symlink("scene.toml", folder.path("input.json")).unwrap();
    symlink("loop.json", folder.path("loop.json")).unwrap();
    symlink("none/there.json", folder.path("nowhere.json")).unwrap();
    for (link, word) in
        [("input.json", "an input of this run"), ("loop.json", "loop"), ("nowhere.json", "folder")]
    {
        refused(&folder.run(&["simulate", "scene.toml", "--json", link]), &[link, word]);
    }
}

#[test]
fn folder_as_output_is_rejected_before_the_run() {
    let folder = Folder::new();
    // It would run for days.
    folder.write("long.toml", &change("step = 2e-3", "step = 1e-9"));
    std::fs::create_dir(folder.path("there")).unwrap();
    let before = folder.files().len();
    for place in
        ["none/", "none/.", "none/..", "none//", "there", "there/", "there/.", "..", "scene.toml/"]
    {
        for option in ["--json", "--out"] {
            let output = folder.run(&["simulate", "long.toml", "--force", option, place]);
            refused(&output, &[option, place, "folder"]);
        }
    }
    assert_eq!(folder.files().len(), before, "{:?}", folder.files());
}

#[test]
fn closed_standard_output_is_rejected_before_the_run() {
    let folder = Folder::new();
    folder.write("long.toml", &change("step = 2e-3", "step = 1e-9"));
    for option in ["--json", "--out"] {
        let arguments = ["simulate", "long.toml", "--force", option, "-"];
        let output = folder.run_after("exec >&-", &arguments);
        refused(&output, &[option, "standard output, which is closed"]);
    }
    // Where nothing is asked for there, and where it is dropped on purpose, all is well.
    for (before, json) in [("exec >&-", "a.json"), ("exec > /dev/null", "-")] {
        let output = folder.run_after(before, &["simulate", "scene.toml", "--json", json]);
        succeeds(&output);
        assert_eq!(stderr(&output).matches("error").count(), 0, "{}", stderr(&output));
    }
}

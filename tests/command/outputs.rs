//! Outputs of all commands: a failed output does not affect the others, a closed pipe is no error, an interrupted or killed run
//! does not damage older files, and no output replaces an input.
#![cfg(target_os = "linux")]

use serde_json::Value;
use std::fs::OpenOptions;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::folder::{FIT, Folder, SCENE, change, polyline, refused, stderr, stdout, succeeds};

const COMMANDS: [&[&str]; 6] = [
    &["simulate", "scene.toml"],
    &["static", "scene.toml"],
    &["modes", "scene.toml"],
    &["check", "scene.toml"],
    &["study", "short.toml"],
    &["fit", "fit.toml"],
];

/// Every command with its summary, and with everything that can go to standard output.
fn commands() -> Vec<Vec<&'static str>> {
    let json = COMMANDS.iter().map(|c| [c, &["--json", "-"][..]].concat());
    let others: [&[&str]; 3] = [
        &["simulate", "scene.toml", "--out", "-"],
        &["static", "scene.toml", "--out", "-"],
        &["fit", "fit.toml", "--save", "-"],
    ];
    let plain = COMMANDS.iter().chain(&others).map(|c| c.to_vec());
    plain.chain(json).collect()
}

/// A folder with a short simulation, `short.toml`, in addition.
fn folder() -> Folder {
    let folder = Folder::new();
    let short = change("end = 0.3", "end = 0.02").replace("segments = 20", "segments = 4");
    folder.write("short.toml", &short);
    folder
}

#[test]
fn full_standard_output_is_an_error() {
    let folder = folder();
    for arguments in commands() {
        let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut command = folder.command(&arguments);
        let output = command.stdout(full).spawn().unwrap().wait_with_output().unwrap();
        refused(&output, &["standard output", "No space left"]);
    }
    // Nor does a full standard error end in a panic.
    let full = || OpenOptions::new().write(true).open("/dev/full").unwrap();
    let status = folder.command(&["simulate", "none.toml"]).stderr(full()).status().unwrap();
    assert_eq!(status.code(), Some(2));
}

/// Quietly, with the exit code of the computation and all other outputs.
#[test]
fn closed_pipe_of_standard_output_is_no_error() {
    let folder = folder();
    for mut arguments in commands() {
        if !arguments.contains(&"--json") {
            arguments.extend(["--json", "result.json"]);
        }
        let mut child = folder.command(&arguments).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        succeeds(&output);
        assert!(!stderr(&output).contains("error"), "{arguments:?}: {}", stderr(&output));
        if arguments.contains(&"result.json") {
            assert!(folder.json("result.json").is_object(), "{arguments:?}");
            std::fs::remove_file(folder.path("result.json")).unwrap();
        }
    }
    // A table that nobody reads is not computed to its end, hours later.
    folder.write("scene.toml", &change("step = 2e-3", "step = 1e-9"));
    let mut child =
        folder.command(&["simulate", "scene.toml", "--out", "-", "--force"]).spawn().unwrap();
    drop(child.stdout.take());
    succeeds(&child.wait_with_output().unwrap());
}

#[test]
fn dash_is_standard_output_for_every_option() {
    let folder = folder();
    let printed = |arguments: &[&str]| {
        let output = folder.run(arguments);
        succeeds(&output);
        stdout(&output)
    };
    let table = printed(&["simulate", "scene.toml", "--out", "-"]);
    // A header, the start and 150 steps; below a header and 21 nodes.
    assert!(table.starts_with("t,x_0,y_0") && table.lines().count() == 152, "{table}");
    assert_eq!(printed(&["static", "scene.toml", "--out", "-"]).lines().count(), 22);
    let saved = printed(&["fit", "fit.toml", "--save", "-", "--json", "fit.json"]);
    folder.write("fitted.toml", &saved);
    succeeds(&folder.run(&["simulate", "fitted.toml"]));
    for command in COMMANDS {
        let json = printed(&[command, &["--json", "-"]].concat());
        serde_json::from_str::<Value>(&json).unwrap();
    }
    assert!(!folder.files().contains(&"-".into()), "{:?}", folder.files());
    refused(
        &folder.run(&["simulate", "scene.toml", "--out", "-", "--json", "-"]),
        &["--out", "standard output", "--json", "one output at most"],
    );
    refused(
        &folder.run(&["fit", "fit.toml", "--report", "-"]),
        &["--report", "found -", "a folder"],
    );
}

/// Two rods, whose names may become one file name.
fn two(first: &str, second: &str) -> String {
    let experiment = |name: &str| {
        format!(
            "[[experiment]]\nname = {name:?}\nscene = \"scene.toml\"\n\
             [[experiment.observation]]\nfile = \"tip.csv\"\n"
        )
    };
    format!("{}{}[[parameter]]\nname = \"youngs_modulus\"\n", experiment(first), experiment(second))
}

/// An output that is the same file as an input or as another output, under any name, is rejected before the run.
#[test]
fn output_equal_to_an_input_or_output_is_rejected() {
    let folder = folder();
    folder.write("two.toml", &two("x/y", "x_y"));
    let rest = "x,y,z\n0,0,0\n0.1,0.01,0\n0.2,0,0\n0.3,0.02,0\n";
    folder.write("rest.csv", rest);
    folder.write("polyline.toml", &polyline());
    let hours = change("step = 2e-3", "step = 1e-9");
    folder.write("hours.toml", &hours);
    symlink("tip.csv", folder.path("link.csv")).unwrap();
    std::fs::create_dir(folder.path("sub")).unwrap();
    let before = folder.files().len();
    let whole = folder.path("tip.csv").to_str().unwrap().to_string();
    let cases: Vec<(Vec<&str>, &[&str])> = vec![
        (
            vec!["fit", "fit.toml", "--json", "tip.csv"],
            &["--json", "tip.csv", "an input of this run"],
        ),
        (
            vec!["fit", "fit.toml", "--json", "./tip.csv"],
            &["--json", "tip.csv", "an input of this run"],
        ),
        (
            vec!["fit", "fit.toml", "--json", "sub/../tip.csv"],
            &["--json", "tip.csv", "an input of this run"],
        ),
        (
            vec!["fit", "fit.toml", "--json", "link.csv"],
            &["--json", "link.csv", "an input of this run"],
        ),
        (vec!["fit", "fit.toml", "--json", &whole], &["--json", "tip.csv", "an input of this run"]),
        (
            vec!["fit", "fit.toml", "--save", "fit.toml"],
            &["--save", "fit.toml", "an input of this run"],
        ),
        (
            vec!["fit", "fit.toml", "--save", "scene.toml"],
            &["--save", "scene.toml", "an input of this run"],
        ),
        (
            vec!["simulate", "scene.toml", "--out", "scene.toml"],
            &["--out", "scene.toml", "an input of this run"],
        ),
        (
            vec!["simulate", "polyline.toml", "--out", "rest.csv"],
            &["--out", "rest.csv", "an input of this run"],
        ),
        (
            vec!["static", "polyline.toml", "--out", "rest.csv"],
            &["--out", "rest.csv", "an input of this run"],
        ),
        (
            vec!["modes", "scene.toml", "--json", "scene.toml"],
            &["--json", "scene.toml", "an input of this run"],
        ),
        (
            vec!["check", "scene.toml", "--json", "scene.toml"],
            &["--json", "scene.toml", "an input of this run"],
        ),
        (
            vec!["study", "scene.toml", "--json", "scene.toml"],
            &["--json", "scene.toml", "an input of this run"],
        ),
        (
            vec!["simulate", "hours.toml", "--force", "--out", "a", "--json", "./a"],
            &["--out", "a", "--json also writes"],
        ),
        (
            vec!["fit", "fit.toml", "--report", "page", "--json", "page/fit.json"],
            &["--report", "fit.json", "--json also writes"],
        ),
        (
            vec!["fit", "two.toml", "--save", "fitted.toml"],
            &["--save of experiment \"x_y\"", "fitted-x_y.toml", "\"x/y\" also writes"],
        ),
        (vec!["fit", "two.toml", "--save", "-"], &["--save", "found -", "2 experiments"]),
    ];
    for (arguments, words) in &cases {
        let output = folder.run(arguments);
        refused(&output, words);
        assert!(output.stdout.is_empty(), "{arguments:?}");
    }
    assert_eq!(folder.files().len(), before, "{:?}", folder.files());
    assert_eq!((folder.read("rest.csv"), folder.read("fit.toml")), (rest.into(), FIT.into()));
    assert_eq!((folder.read("scene.toml"), folder.read("hours.toml")), (SCENE.into(), hours));
}

/// Output paths that cannot be written are rejected before a fit of hours starts, and no file is changed.
#[test]
fn outputs_are_checked_before_the_run() {
    let folder = folder();
    folder.write("scene.toml", &change("step = 2e-3", "step = 1e-9"));
    folder.write("old.json", "{}");
    let mut permissions = std::fs::metadata(folder.path("old.json")).unwrap().permissions();
    permissions.set_mode(0o444);
    std::fs::set_permissions(folder.path("old.json"), permissions).unwrap();
    assert!(Command::new("mkfifo").arg(folder.path("pipe")).status().unwrap().success());
    std::fs::create_dir(folder.path("sub")).unwrap();
    let before = folder.files().len();
    let long = "x".repeat(300);
    for (option, place, words) in [
        ("--json", "no/such/fit.json", &["--json", "no/such/fit.json", "does not exist"][..]),
        ("--save", "no/fitted.toml", &["--save", "no/fitted.toml", "does not exist"]),
        ("--json", "tip.csv/fit.json", &["--json", "tip.csv is not a folder"]),
        ("--json", "sub", &["--json", "sub, a folder"]),
        ("--json", "", &["--json"]),
        ("--json", "old.json", &["--json", "old.json", "read-only"]),
        ("--json", "pipe", &["--json", "pipe", "not a regular file"]),
        ("--json", &long, &["too long"]),
        ("--report", "tip.csv", &["--report", "tip.csv is not a folder"]),
        ("--report", "tip.csv/page", &["--report", "tip.csv is not a folder"]),
    ] {
        let output = folder.run(&["fit", "fit.toml", "--force", option, place]);
        refused(&output, words);
    }
    assert_eq!((folder.files().len(), folder.read("old.json")), (before, "{}".into()));
}

/// Whatever cannot be written: the summary is printed, and everything else is written.
#[test]
fn failed_output_does_not_affect_others() {
    let folder = folder();
    let output = folder.run(&[
        "fit",
        "fit.toml",
        "--json",
        "/dev/full",
        "--save",
        "fitted.toml",
        "--report",
        "page",
    ]);
    refused(&output, &["/dev/full", "No space left"]);
    let summary = stdout(&output);
    assert!(summary.contains("youngs_modulus"), "{summary}");
    assert!(folder.read("fitted.toml").contains("youngs_modulus"));
    assert!(folder.path("page/fit.html").exists() && folder.json("page/fit.json").is_object());

    // A disk that fills up under a simulation: what was written of the table stays, beside the older one.
    folder.write("nodes.csv", "older\n");
    let full = "trap '' XFSZ; ulimit -f 8";
    let output = folder.run_after(full, &["simulate", "scene.toml", "--out", "nodes.csv"]);
    refused(&output, &["nodes.csv", "too large", "the partial output is in", ".kept"]);
    assert!(stdout(&output).contains("150 steps"));
    assert_eq!(folder.read("nodes.csv"), "older\n");
    let part = folder.files().into_iter().find(|name| name.ends_with(".kept")).unwrap();
    assert!(part.starts_with("nodes.csv.") && folder.read(&part).starts_with("t,x_0,"), "{part}");
}

/// Starts the command, and sends it a signal when it has caught Ctrl-C (number 2) and computed for a while.
fn signalled(folder: &Folder, signal: &str, arguments: &[&str]) -> Output {
    let child = folder.command(arguments).stdin(Stdio::null()).spawn().unwrap();
    let id = child.id().to_string();
    let catches = || {
        let status = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
        u64::from_str_radix(mask.trim(), 16).unwrap() & 0b10 != 0
    };
    let start = Instant::now();
    while !catches() {
        assert!(start.elapsed() < Duration::from_secs(60), "no handler");
        std::thread::sleep(Duration::from_millis(20));
    }
    // Enough for a simulation of the coarse model, which takes a millisecond.
    std::thread::sleep(Duration::from_secs(2));
    assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert!(start.elapsed() < Duration::from_secs(120));
    output
}

/// An interrupt signal during a fit of hours: all outputs are marked as interrupted, and older results are kept.
#[test]
fn interrupted_fit_writes_its_best_values() {
    let folder = folder();
    folder.write("scene.toml", &change("step = 2e-3", "step = 1e-9"));
    let fit = [
        "fit",
        "fit.toml",
        "--force",
        "--json",
        "fit.json",
        "--save",
        "fitted.toml",
        "--report",
        "page",
    ];
    let output = signalled(&folder, "-INT", &fit);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("interrupted"), "{}", stderr(&output));
    let is_interrupted = |name: &str| {
        let fit = folder.json(name);
        assert_eq!((&fit["interrupted"], &fit["converged"]), (&true.into(), &false.into()));
        assert_eq!(fit["status"], "interrupted");
        let parameter = &fit["parameters"][0];
        assert!(parameter["value"].as_f64().unwrap() > 0.0 && parameter["std_error"].is_null());
    };
    is_interrupted("fit.json");
    assert!(folder.read("fitted.toml").starts_with("# interrupted"));
    assert!(folder.read("page/fit.html").contains("interrupted"));

    let fit = |fit: &str| {
        for name in ["fit.json", "fitted.toml"] {
            folder.write(name, "older");
        }
        folder.write("fit.toml", fit);
    };
    // Without --no-limits nothing of the hours would run: the estimate lets this shorter one pass.
    fit(FIT);
    folder.write(
        "scene.toml",
        &change("step = 2e-3", "step = 1e-6").replace("segments = 20", "segments = 100"),
    );
    let arguments = ["fit", "fit.toml", "--json", "fit.json", "--save", "fitted.toml"];
    let output = signalled(&folder, "-INT", &arguments);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    for word in ["fit.json of an earlier run is kept", "fit.interrupted.json", "--overwrite"] {
        assert!(stderr(&output).contains(word), "{word} in {}", stderr(&output));
    }
    assert_eq!(
        (folder.read("fit.json"), folder.read("fitted.toml")),
        ("older".into(), "older".into())
    );
    is_interrupted("fit.interrupted.json");
    assert!(folder.read("fitted.interrupted.toml").starts_with("# interrupted"));

    // Schedulers and containers ask with another signal.
    fit(FIT);
    let output = signalled(&folder, "-TERM", &[&arguments[..], &["--overwrite"]].concat());
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    is_interrupted("fit.json");
    assert!(!folder.files().iter().any(|name| name.ends_with(".part")), "{:?}", folder.files());
}

/// `--no-limits` replaces no files, and `--overwrite` lifts no limits; the hidden `--force` does both.
#[test]
fn overwrite_and_no_limits_are_independent() {
    let folder = folder();
    folder.write("scene.toml", &change("step = 2e-3", "step = 1e-8"));
    let check = |arguments: &[&str], word: &str| {
        let output = folder.run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&output).contains(word), "{word} in {}", stderr(&output));
    };
    check(&["study", "scene.toml", "--overwrite"], "--no-limits");
    folder.write("droop.toml", "mine");
    check(&["init", "droop", "--no-limits"], "--overwrite");
    assert_eq!(folder.read("droop.toml"), "mine");
    assert_eq!(folder.run(&["init", "droop", "--force"]).status.code(), Some(0));
    assert_ne!(folder.read("droop.toml"), "mine");
}

/// A killed simulation leaves older tables unchanged and its own unfinished table beside them.
#[test]
fn killed_simulation_leaves_older_files_unchanged() {
    let folder = folder();
    folder.write("scene.toml", &change("step = 2e-3", "step = 1e-9"));
    folder.write("nodes.csv", "older");
    let arguments = ["simulate", "scene.toml", "--no-limits", "--out", "nodes.csv"];
    signalled(&folder, "-KILL", &arguments);
    assert_eq!(folder.read("nodes.csv"), "older");
    let part = folder.files().into_iter().find(|name| name.ends_with(".part")).unwrap();
    assert!(folder.read(&part).lines().count() > 100, "{part}");
    // Interrupted, what there is has a name of its own; a file of its own gets the permissions of any.
    std::fs::remove_file(folder.path("nodes.csv")).unwrap();
    let output = signalled(&folder, "-INT", &arguments);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(folder.read("nodes.csv").lines().count() > 100);
    folder.write("plain", "");
    let mode = |name: &str| std::fs::metadata(folder.path(name)).unwrap().permissions().mode();
    assert_eq!(mode("nodes.csv"), mode("plain"));
}

/// A million and a half steps in 150 MB.
#[test]
fn simulation_without_outputs_has_constant_memory() {
    let folder = folder();
    let scene = change("segments = 20", "segments = 2").replace("end = 0.3", "end = 1.5");
    folder.write("scene.toml", &scene.replace("step = 2e-3", "step = 1e-6"));
    let output = folder.run_after("ulimit -v 150000", &["simulate", "scene.toml", "-q"]);
    succeeds(&output);
}

/// Completion scripts have all subcommands and their options.
#[test]
fn completions_have_all_subcommands() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let output = folder.run(&["completions", shell]);
        succeeds(&output);
        let script = stdout(&output);
        for word in ["simulate", "inspect", "init", "report"] {
            assert!(script.contains(word), "{word} in {shell}");
        }
    }
    refused(&folder.run(&["completions", "csh"]), &["csh", "bash"]);
}

/// Manual pages of the command and of its subcommands.
#[test]
fn manual_pages_exist_for_all_subcommands() {
    let folder = Folder::new();
    let page = |words: &[&str]| {
        let output = folder.run(&[&["man"], words].concat());
        succeeds(&output);
        stdout(&output)
    };
    let whole = page(&[]);
    assert!(whole.contains(".TH rodfit 1") && whole.contains("rodfit\\-explain(1)"), "{whole}");
    let fit = page(&["fit"]);
    assert!(fit.contains(".TH rodfit-fit 1") && fit.contains("\\-\\-monte\\-carlo"), "{fit}");
    refused(&folder.run(&["man", "fti"]), &["man", "fti", "simulate"]);
}

//! Guards of campaigns: changed lists of tasks, patterns over the whole disk, values and thread counts beyond their limits, the
//! time to stop after TERM, and text cells that a spreadsheet would compute.
#![cfg(target_os = "linux")]

use std::time::{Duration, Instant};

use crate::campaign::{collected, folder, lines, plan, run, terminate};
use crate::folder::{Folder, change, refused, stderr, succeeds};

const GRID: &str = "fits = [\"fit.toml\"]\n[grid]\nradius = [4.9e-3, 5e-3, 5.1e-3]\n";
/// Documented longest time between SIGTERM and the end of a run.
const TERM_TIME: Duration = Duration::from_secs(5);

#[test]
fn changed_list_of_tasks_is_rejected() {
    let folder = folder(GRID);
    plan(&folder, "out");
    run(&folder, "out", &[]);
    let tasks = folder.read("out/tasks.jsonl");
    let lines: Vec<&str> = tasks.lines().collect();
    let joined = |lines: &[&str]| lines.iter().map(|line| format!("{line}\n")).collect::<String>();
    let changed = [
        joined(&lines[..2]),
        joined(&lines[1..]),
        joined(&[lines[1], lines[0], lines[2]]),
        joined(&[lines[0], lines[1], lines[2], lines[2]]),
        tasks.replace("0.0049", "0.0099"),
        tasks.trim_end().to_string(),
        String::new(),
    ];
    for changed in changed {
        assert_ne!(changed, tasks);
        folder.write("out/tasks.jsonl", &changed);
        for command in [
            &["status", "out"][..],
            &["collect", "out", "--csv", "all.csv"],
            &["run", "out"],
            &["sbatch", "out", "--time", "1:00:00"],
        ] {
            let output = folder.run(&[&["campaign"], command].concat());
            refused(
                &output,
                &["out/tasks.jsonl", "the 3 planned lines; run `rodfit campaign plan` again"],
            );
        }
    }
    // A plan that was killed while it was written can be made again; other folders are not touched.
    for (left, expected) in [("plan.json.Ab3d5f.part", 0), ("tasks.jsonl", 0), ("notes.txt", 2)] {
        let name = format!("killed-{expected}-{}", left.len());
        std::fs::create_dir(folder.path(&name)).unwrap();
        folder.write(&format!("{name}/{left}"), "");
        let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", &name]);
        assert_eq!(output.status.code(), Some(expected), "{left}: {}", stderr(&output));
    }
    // The same plan again repairs it, and the results are there.
    plan(&folder, "out");
    assert_eq!(folder.read("out/tasks.jsonl"), tasks);
    succeeds(&folder.run(&["campaign", "status", "out"]));
}

#[test]
fn limits_are_in_the_messages() {
    let folder = folder("");
    for (campaign, words) in [
        (
            "[bootstrap]\nreplicates = 1000000000",
            "bootstrap.replicates: found 1000000000, allowed: 2 .. 300000",
        ),
        ("[bootstrap]\nreplicates = 1", "bootstrap.replicates: found 1, allowed: 2 .. 300000"),
        ("[starts]\ncount = 1000000000", "starts.count: found 1000000000, allowed: 1 .. 300000"),
        (
            "[starts]\ncount = 200000\n[bootstrap]\nreplicates = 64",
            "tasks: found 800000, allowed: up to 300000",
        ),
    ] {
        folder.write("campaign.toml", &format!("fits = [\"fit.toml\"]\n{campaign}\n"));
        let since = Instant::now();
        refused(&folder.run(&["campaign", "plan", "campaign.toml", "--out", "out"]), &[words]);
        assert!(since.elapsed() < Duration::from_secs(5));
    }
}

#[test]
fn pattern_over_the_whole_disk_is_rejected() {
    let folder = folder("");
    for pattern in ["/**/*.toml", "/**", "/usr/../**/fit.toml"] {
        folder.write("campaign.toml", &format!("fits = [\"{pattern}\"]\n"));
        let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", "out"]);
        refused(&output, &["campaign.toml", "fits[0]", pattern, "whole disk"]);
    }
    // Nothing is found in folders of devices and processes, whose entries come and go.
    for pattern in ["/[dp][er][vo]*/**/fd/*", "/pro*/*/fd/*"] {
        folder.write("campaign.toml", &format!("fits = [\"{pattern}\"]\n"));
        let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", "out"]);
        refused(&output, &["campaign.toml", "fits[0]", "matches no further file"]);
    }
}

#[test]
fn misspelt_key_of_the_grid_is_rejected() {
    let folder = folder("");
    for (key, word) in [
        ("rod.section.radios", "radios"),
        ("rod.sectio.radius", "sectio"),
        ("observation.0.sigm", "sigm"),
        ("parameter.youngs_modulus.strat", "strat"),
        ("analysis.bootstra", "bootstra"),
        ("parameter.5.start", "parameter.5.start"),
        ("radios", "radios"),
    ] {
        folder.write(
            "campaign.toml",
            &format!("fits = [\"fit.toml\"]\n[grid]\n\"{key}\" = [1, 2]\n"),
        );
        let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", "out"]);
        refused(&output, &["campaign.toml", word]);
        assert!(!folder.path("out").exists(), "{key}");
    }
    // A value that cannot be is the result of its fit.
    folder.write("campaign.toml", "fits = [\"fit.toml\"]\n[grid]\nradius = [5e-3, -1]\n");
    let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", "out"]);
    succeeds(&output);
    assert!(stderr(&output).contains("will be rejected"), "{}", stderr(&output));
}

/// JSON has no infinite numbers: a plan with one could be written and not read.
#[test]
fn value_without_json_is_rejected() {
    let folder = folder("");
    for value in
        ["inf", "-inf", "nan", "2026-01-01", "[0, inf, 0]", "{ kind = \"circle\", radius = nan }"]
    {
        folder.write(
            "campaign.toml",
            &format!("fits = [\"fit.toml\"]\n[grid]\nrod.section = [{value}]\n"),
        );
        let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", "out"]);
        refused(&output, &["campaign.toml", "rod.section", "finite numbers"]);
    }
    folder.write("campaign.toml", "fits = [\"fit.toml\"]\ntable = \"table.csv\"\n");
    folder.write("table.csv", "radius\n5e-3\ninf\n");
    let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", "out"]);
    refused(&output, &["table.csv:3", "radius", "finite numbers"]);
}

#[test]
fn threads_are_limited_to_processors() {
    let folder = folder(GRID);
    plan(&folder, "out");
    for done in [0, 3] {
        let since = Instant::now();
        let output = folder.run(&["campaign", "run", "out", "--threads", "100000"]);
        succeeds(&output);
        assert!(stderr(&output).contains("--threads 100000"), "{}", stderr(&output));
        assert!(stderr(&output).contains("[fewer-threads]"), "{}", stderr(&output));
        // A hundred thousand threads would not end within a minute.
        assert!(since.elapsed() < Duration::from_secs(60), "{done} done: {:?}", since.elapsed());
    }
}

/// SIGTERM ends a run within [`TERM_TIME`] even in a fit whose first step would take minutes.
#[test]
fn term_ends_a_run_within_five_seconds() {
    let folder = folder("fits = [\"fit.toml\"]\n");
    let slow = change("segments = 20", "segments = 20000").replace("step = 2e-3", "step = 1e-4");
    folder.write("scene.toml", &slow.replace("end = 0.3", "end = 0.4"));
    let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", "out", "--force"]);
    succeeds(&output);
    let arguments = ["campaign", "run", "out", "--threads", "100000"];
    let child = folder.command(&arguments).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(2));
    terminate(&child);
    let since = Instant::now();
    let output = child.wait_with_output().unwrap();
    assert!(since.elapsed() < TERM_TIME, "{:?}", since.elapsed());
    succeeds(&output);
    let status = folder.run(&["campaign", "status", "out"]);
    assert_eq!(status.status.code(), Some(3));
}

/// The text cells of a row.
fn row(folder: &Folder, out: &str) -> (String, String) {
    let sheet = collected(folder, out).1;
    let mut records = csv::Reader::from_reader(sheet.as_bytes());
    let record = records.records().next().unwrap().unwrap();
    (record[1].to_string(), record[3].to_string())
}

#[test]
fn formulas_in_text_cells_get_an_apostrophe() {
    let names = [
        ("=cmd|calc", "'=cmd|calc"),
        ("+cmd", "'+cmd"),
        ("-2+3", "'-2+3"),
        ("@SUM(A1)", "'@SUM(A1)"),
        ("'=1+1", "'=1+1"),
        ("a=1", "a=1"),
        ("'quoted", "'quoted"),
    ];
    for (name, cell) in names {
        let folder = folder("fits = [\"fit.toml\"]\ntable = \"table.csv\"\n");
        folder.write("table.csv", &format!("name,loads.gravity.y\n\"{name}\",-9.8\n"));
        plan(&folder, "out");
        run(&folder, "out", &[]);
        // The number is as it was.
        assert_eq!(row(&folder, "out"), (cell.into(), "-9.8".into()));
        // What was written is read back as it was.
        folder.write("table.csv", &format!("name,loads.gravity.y\n{cell},-9.8\n"));
        plan(&folder, "again");
        assert_eq!(folder.read("again/tasks.jsonl"), folder.read("out/tasks.jsonl"));
    }
}

/// The table names Young's modulus by its short name, the grid by its path.
#[test]
fn grid_value_replaces_a_table_value_by_another_name() {
    let grid = "[grid]\n\"material.youngs_modulus\" = [1e8, 2e8]\n";
    let folder = folder(&format!("fits = [\"fit.toml\"]\ntable = \"rods.csv\"\n{grid}"));
    folder.write("rods.csv", "youngs_modulus,radius\n3e8,4.9e-3\n");
    plan(&folder, "out");
    let tasks = lines(&folder.read("out/tasks.jsonl"));
    assert_eq!(tasks.len(), 2);
    assert_ne!(tasks[0]["id"], tasks[1]["id"]);
    for task in &tasks {
        let changes = task["changes"].as_object().unwrap();
        assert!(changes.contains_key("material.youngs_modulus") && changes["radius"] == 4.9e-3);
        assert!(!changes.contains_key("youngs_modulus"), "{task}");
    }
}

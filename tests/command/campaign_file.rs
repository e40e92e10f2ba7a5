//! Campaign files: rows of tables, grids, distributed bootstraps and random starts become the expected tasks; invalid files are
//! rejected with the key or line.
#![cfg(target_os = "linux")]

use rodfit::fit::FitFile;
use serde_json::Value;
use std::collections::BTreeSet;

use crate::campaign::{FIT, GRID, collected, data, folder, lines, plan, planned, run, whole};
use crate::folder::{Folder, refused, replaced, stderr, stdout, succeeds};

const ROWS: &str = "name,rod.section.radius,observation.0.file,#who\nsoft,4.9e-3,tip.csv,Ada\nstiff,,deep/2.csv,\n";

#[test]
fn table_row_defines_a_fit() {
    let folder = folder("fits = [\"fit.toml\"]\ntable = \"rods.csv\"\n");
    std::fs::create_dir(folder.path("deep")).unwrap();
    folder.write("deep/2.csv", &data(2));
    folder.write("rods.csv", ROWS);
    plan(&folder, "out");
    run(&folder, "out", &[]);
    let (_, sheet) = collected(&folder, "out");
    let rows: Vec<Vec<&str>> = sheet.lines().map(|line| line.split(',').collect()).collect();
    // Expected: the keys of the table's columns and the values of its rows; an empty cell changes nothing.
    assert_eq!(rows[0][1..6], ["name", "fit", "observation.0.file", "rod.section.radius", "code"]);
    assert_eq!(rows[1][1..6], ["soft", "fit.toml", "tip.csv", "0.0049", "0"]);
    assert_eq!(rows[2][1..6], ["stiff", "fit.toml", "deep/2.csv", "", "0"]);
    // Each is what a fit of its own file finds.
    let fit = FIT.replace("tip.csv", "deep/2.csv");
    let alone = FitFile::from_toml(&fit, folder.path("")).unwrap().fit().solve().unwrap();
    let value: f64 = rows[2][8].parse().unwrap();
    assert_eq!(alone.parameters[0].value, Some(value));
    // With a column of fit files.
    folder.write("campaign.toml", "table = \"rods.csv\"\n");
    folder.write("rods.csv", "fit;rod.segments\nfit.toml;5\nfit.toml;7\n");
    plan(&folder, "again");
    let tasks = lines(&folder.read("again/tasks.jsonl"));
    assert_eq!((tasks.len(), &tasks[1]["changes"]["rod.segments"]), (2, &7.into()));
    folder.write("rods.csv", "fit;radius\nfit.toml;4,9e-3\n");
    plan(&folder, "comma");
    let tasks = lines(&folder.read("comma/tasks.jsonl"));
    // With semicolons the comma in 4,9e-3 is a decimal comma.
    assert_eq!(tasks[0]["changes"]["radius"], 4.9e-3);

    folder.write("campaign.toml", "fits = [\"fit.toml\"]\ntable = \"rods.csv\"\n");
    for (from, to, words) in [
        ("4.9e-3", "-1", ["rods.csv:2: ", "rod.section.radius", "-1"]),
        ("4.9e-3", "wide", ["rods.csv:2: ", "radius", "wide"]),
        ("deep/2.csv", "deep/3.csv", ["rods.csv:3: ", "deep/3.csv", "No such file"]),
        ("rod.section.radius", "radios", ["rods.csv:1: ", "radios", "short name"]),
        (
            "observation.0",
            "observation.4",
            ["rods.csv:2: ", "observation.4.file", "a key that the file does not have"],
        ),
        ("name", "rod.section.radius", ["rods.csv:1: ", "rod.section.radius twice", "once"]),
        (
            "observation.0.file",
            "radius",
            ["rods.csv:1: ", "the columns radius and rod.section.radius", "one of the two"],
        ),
        ("stiff,", "stiff,,,", ["rods.csv:3: ", "found 6 fields", "4 as in the header"]),
    ] {
        folder.write("rods.csv", &replaced(ROWS, from, to));
        refused(&folder.run(&["campaign", "plan", "campaign.toml", "--out", "bad"]), &words);
    }
    folder.write(
        "campaign.toml",
        "fits = [\"fit.toml\"]\n[grid]\nradius = [4e-3]\n\"rod.section.radius\" = [5e-3]\n",
    );
    let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", "bad"]);
    refused(&output, &["grid.rod.section.radius", "twice", "radius is the same"]);
    assert!(!folder.path("bad").exists());
}

#[test]
fn shard_is_read_from_the_scheduler() {
    let folder = planned(GRID);
    let mut tasks = 0;
    for id in ["10", "13", "16"] {
        let mut command = folder.command(&["campaign", "run", "out", "--threads", "1"]);
        command.env("SLURM_ARRAY_TASK_ID", id).env("SLURM_ARRAY_TASK_MIN", "10");
        command.env("SLURM_ARRAY_TASK_STEP", "3").env("SLURM_ARRAY_TASK_COUNT", "3");
        let output = command.output().unwrap();
        succeeds(&output);
        let said = stdout(&output);
        let count = said.strip_prefix("out: all ").unwrap().split(' ').next().unwrap();
        tasks += count.parse::<usize>().unwrap();
        assert!(!said.contains("12 fits"), "{said}");
    }
    assert_eq!((tasks, collected(&folder, "out")), (12, whole(GRID)));
    let with = |name: &str, more: &[&str]| {
        let mut command = folder.command(&[&["campaign", "run", "out"][..], more].concat());
        command.env(name, "1").output().unwrap()
    };
    for name in ["PBS_ARRAY_INDEX", "HQ_TASK_ID"] {
        succeeds(&with(name, &["--shards", "2"]));
        refused(&with(name, &[]), &[name, "found 1 without the number of shards", "--shards N"]);
        succeeds(&with(name, &["--shard", "1/2"]));
    }
    // One counting: another would give two jobs the same part, and one to nobody.
    let beyond = folder.run(&["campaign", "run", "out", "--shard", "2/2"]);
    refused(&beyond, &["--shard", "2/2", "i from 0 to n - 1"]);
    let mut beyond = folder.command(&["campaign", "run", "out", "--shards", "2"]);
    refused(&beyond.env("HQ_TASK_ID", "2").output().unwrap(), &["HQ_TASK_ID", "found 2", "0 to 1"]);
    refused(
        &folder.run(&["campaign", "run", "out", "--shards", "2"]),
        &["--shards", "--shard I/N"],
    );
}

#[test]
fn distributed_bootstrap_equals_that_of_one_fit() {
    let campaign = "fits = [\"fit.toml\"]\n[bootstrap]\nreplicates = 12\nbatch = 5\nseed = 3\n";
    let folder = planned(campaign);
    let tasks = lines(&folder.read("out/tasks.jsonl"));
    let seed = tasks[0]["changes"]["analysis.seed"].as_u64().unwrap();
    run(&folder, "out", &[]);
    let (results, sheet) = collected(&folder, "out");
    assert_eq!((tasks.len(), lines(&results).len(), sheet.lines().count()), (2, 2, 2));
    let row = sheet.lines().nth(1).unwrap();
    // As one fit would have found.
    let fit = format!("{FIT}bootstrap = 12\nseed = {seed}\n");
    let alone = FitFile::from_toml(&fit, folder.path("")).unwrap().fit().solve().unwrap();
    let bootstrap = alone.parameters[0].bootstrap.as_ref().unwrap();
    assert!(bootstrap.estimates.is_empty());
    let [low, high] = bootstrap.interval95;
    let mut header = sheet.lines().next().unwrap().split(',');
    let first = header.position(|name| name == "youngs_modulus.bootstrap_std_error").unwrap();
    let cells: Vec<&str> = row.split(',').collect();
    for (cell, expected) in cells[first..].iter().zip([bootstrap.std_error, low, high]) {
        let cell: f64 = cell.parse().unwrap();
        // One fit with all replicates is the reference; pooling changes the order of the sums only.
        assert!((cell / expected - 1.0).abs() < 1e-12, "{cell} {expected}");
    }
    assert_eq!(cells[3], "12");
}

#[test]
fn random_starts_are_reproducible_and_within_bounds() {
    let campaign = "fits = [\"fit.toml\"]\n[starts]\ncount = 5\n";
    let folder = folder(campaign);
    let arguments = ["campaign", "plan", "campaign.toml", "--out", "out"];
    refused(&folder.run(&arguments), &["fit.toml", "parameter[0].bounds", "none", "random starts"]);
    let bounds = "name = \"youngs_modulus\"\nbounds = [1e7, 1e9]";
    folder.write("fit.toml", &replaced(FIT, "name = \"youngs_modulus\"", bounds));
    plan(&folder, "out");
    run(&folder, "out", &[]);
    let (results, _) = collected(&folder, "out");
    let of = |line: &Value| {
        let start = line["changes"]["parameter.0.start"].as_f64().unwrap();
        (start, line["result"]["report"]["parameters"][0]["value"].as_f64().unwrap())
    };
    let all: Vec<(f64, f64)> = lines(&results).iter().map(of).collect();
    let starts: BTreeSet<u64> = all.iter().map(|(start, _)| start.to_bits()).collect();
    assert_eq!(starts.len(), 5);
    // Within the bounds; every start leads to the same minimum, to a tolerance of the fit.
    for (start, found) in &all {
        assert!(
            (1e7..=1e9).contains(start) && (found / all[0].1 - 1.0).abs() < 1e-4,
            "{start} {found}"
        );
    }
}

/// A fit of numbers along a rod.
fn along(folder: &Folder) -> String {
    let straight = "kind = \"straight\", length = 0.5, direction = [1, 0, 0]";
    let scene =
        replaced(&folder.read("scene.toml"), straight, "kind = \"arc\", length = 0.5, angle = 1");
    folder.write("arc.toml", &replaced(&scene, "[rod]", "[rod]\nnatural_curvature = [1, 1]"));
    let fit = replaced(&folder.read("fit.toml"), "scene.toml", "arc.toml");
    let (before, _) = fit.split_once("[[parameter]]").unwrap();
    format!(
        "{before}sigma = 1e-3\n[[field]]\nname = \"natural_curvature\"\nsigma = 0.1\nlength = 0.1\n"
    )
}

#[test]
fn invalid_campaign_is_rejected() {
    let folder = planned(GRID);
    folder.write("along.toml", &along(&folder));
    for (campaign, words) in [
        ("", ["campaign.toml", "fits", "table"]),
        ("fits = [\"none/*.toml\"]", ["campaign.toml", "fits[0]", "matches no further file"]),
        (
            "fits = [\"fit.toml\"]\n[grid]\nradios = [1]",
            ["campaign.toml", "grid.radios", "short name"],
        ),
        ("fits = [\"fit.toml\"]\n[grid]\nradius = 1", ["campaign.toml", "grid.radius", "a list"]),
        (
            "fits = [\"fit.toml\"]\n[grid]\nradius = []",
            ["campaign.toml", "grid.radius", "0 values"],
        ),
        ("fits = [\"fit.toml\"]\n[grids]\nradius = [1]", ["campaign.toml", "grids", "grid"]),
        (
            "fits = [\"fit.toml\"]\n[bootstrap]\nreplicates = 1",
            ["bootstrap.replicates", "found 1", "2 .. 300000"],
        ),
        ("fits = [\"fit.toml\"]\n[starts]\ncount = 0", ["starts.count", "found 0", "1 .. 300000"]),
        ("fits = [\"scene.toml\"]", ["scene.toml", "parameter", "bad"]),
        ("fits = [\"along.toml\"]", ["along.toml", "field", "bad"]),
    ] {
        folder.write("campaign.toml", campaign);
        let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", "bad"]);
        if words[2] == "bad" {
            // A file that is not a fit is rejected when its task runs, and the result states it.
            succeeds(&output);
            assert!(stderr(&output).contains("will be rejected"), "{}", stderr(&output));
        } else {
            refused(&output, &words);
        }
    }
    folder.write("campaign.toml", GRID);
    refused(
        &folder.run(&["campaign", "plan", "campaign.toml", "--out", "."]),
        &["--out", "other files"],
    );
    refused(&folder.run(&["campaign", "run", "nowhere"]), &["nowhere/plan.json"]);
    let about = folder.read("out/plan.json");
    folder.write("out/plan.json", &about.replace(env!("CARGO_PKG_VERSION"), "0.0.1"));
    refused(
        &folder.run(&["campaign", "run", "out"]),
        &["version 0.0.1", "run `rodfit campaign plan` again"],
    );
    folder.write("out/plan.json", &about);
    let sbatch = folder.run(&["campaign", "sbatch", "out", "--time", "1:00:00", "--shards", "7"]);
    succeeds(&sbatch);
    for line in [
        "#SBATCH --array=0-6",
        "#SBATCH --time=1:00:00",
        "#SBATCH --requeue",
        "#SBATCH --signal=B:TERM@60",
    ] {
        assert!(stdout(&sbatch).lines().any(|said| said == line), "{}", stdout(&sbatch));
    }
    refused(
        &folder.run(&["campaign", "sbatch", "out", "--time", "an hour"]),
        &["--time", "1:00:00"],
    );
}

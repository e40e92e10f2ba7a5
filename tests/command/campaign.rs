//! Campaigns by the command: planned once, run in shards of any number, killed and continued, and collected to the same bytes.
//! Ids of tasks change with every input; damaged results are computed again.
#![cfg(target_os = "linux")]

use rodfit::campaign::{Plan, Store};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::coarse;
use crate::common::fits::{add_noise, observe};
use crate::folder::{Folder, change, refused, replaced, stderr, stdout, succeeds, words};

/// Mesh and step of the data: fits take some 20 ms.
pub const FIT: &str = r#"
scene = "scene.toml"
[[observation]]
file = "tip.csv"
[[parameter]]
name = "youngs_modulus"
[analysis]
what_if = false
discretization_error = "none"
"#;

/// Twelve fits, that all can be used.
pub const GRID: &str = r#"
fits = ["fit.toml"]
[grid]
"rod.section.radius" = [4.9e-3, 5e-3, 5.1e-3]
material.density = [1200, 1250, 1300, 1350]
"#;

/// The tip of a rod, filmed.
pub fn data(seed: u64) -> String {
    let mut seen = observe(&coarse(6, 4e-3, 0.4), 40);
    add_noise(&mut seen, 1e-3, seed);
    let row = |s: &rodfit::fit::Sample| {
        let [x, y, _] = s.position.map(|x| x.unwrap_or(f64::NAN));
        format!("{},{x},{y}\n", s.time)
    };
    format!("t,x,y\n{}", seen.samples.iter().map(row).collect::<String>())
}

/// A folder with a campaign, not yet planned.
pub fn folder(campaign: &str) -> Folder {
    let folder = Folder::new();
    let scene = change("segments = 20", "segments = 6").replace("step = 2e-3", "step = 4e-3");
    folder.write("scene.toml", &scene.replace("end = 0.3", "end = 0.4"));
    folder.write("fit.toml", FIT);
    folder.write("tip.csv", &data(1));
    folder.write("campaign.toml", campaign);
    folder
}

/// Plans `campaign.toml` into the folder `out`; must succeed.
pub fn plan(folder: &Folder, out: &str) {
    succeeds(&folder.run(&["campaign", "plan", "campaign.toml", "--out", out]));
}

/// A folder with this campaign, planned into `out`.
pub fn planned(campaign: &str) -> Folder {
    let folder = folder(campaign);
    plan(&folder, "out");
    folder
}

/// Runs the planned campaign with more arguments; must succeed. Returns standard output.
#[track_caller]
pub fn run(folder: &Folder, out: &str, more: &[&str]) -> String {
    let output = folder.run(&[&["campaign", "run", out][..], more].concat());
    succeeds(&output);
    stdout(&output)
}

/// How often this thread has read and written.
fn calls() -> [u64; 2] {
    let text = std::fs::read_to_string("/proc/thread-self/io").unwrap();
    ["syscr: ", "syscw: "].map(|key| {
        let line = text.lines().find_map(|line| line.strip_prefix(key));
        line.unwrap().parse().unwrap()
    })
}

/// Overhead of a task beside its fit, in system calls: at most 40 reads and one write, independent of the number of earlier
/// tasks.
#[test]
fn task_takes_few_system_calls_and_one_line() {
    let folder = planned(GRID);
    let plan = Plan::open(&folder.path("out")).unwrap();
    let store = Store::new(&plan.folder);
    let costs: Vec<[u64; 2]> = plan
        .tasks
        .iter()
        .map(|task| {
            let before = calls();
            let outcome = plan.solve(task, &store, Arc::new(AtomicBool::new(false))).unwrap();
            assert_eq!(outcome.unwrap().code, 0);
            let after = calls();
            [0, 1].map(|k| after[k] - before[k])
        })
        .collect();
    println!("reads and writes of each task: {costs:?}");
    // Fit, scene and data, some of them twice, in a few pieces each; and the count itself.
    // The first task finds out the platform besides.
    let [reads, writes] = costs[1];
    assert!(costs[1..].iter().all(|cost| *cost == [reads, writes]), "{costs:?}");
    assert!(reads <= 40 && writes == 1, "{costs:?}");
}

/// Everything that is collected.
#[track_caller]
pub fn collected(folder: &Folder, out: &str) -> (String, String) {
    let arguments = ["campaign", "collect", out, "--out", "all.jsonl", "--csv", "all.csv", "-q"];
    succeeds(&folder.run(&arguments));
    (folder.read("all.jsonl"), folder.read("all.csv"))
}

/// Parses JSON lines.
pub fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Paths of the stored part files of the campaign in `out`, sorted.
fn parts(folder: &Folder) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder.path("out/parts"));
    let mut parts: Vec<PathBuf> =
        entries.into_iter().flatten().map(|entry| entry.unwrap().path()).collect();
    parts.sort();
    parts
}

/// How many results are stored whole.
pub fn stored(folder: &Folder) -> usize {
    let output = folder.run(&["campaign", "status", "out", "--json", "-"]);
    serde_json::from_str::<Value>(&stdout(&output)).unwrap()["done"].as_u64().unwrap() as usize
}

#[test]
fn shards_of_any_number_collect_to_the_same_bytes() {
    let folder = folder(GRID);
    let mut all = BTreeSet::new();
    for n in [1, 3, 7] {
        let out = format!("out-{n}");
        plan(&folder, &out);
        for i in 0..n {
            let threads = if i == 0 { "2" } else { "1" };
            run(&folder, &out, &["--shard", &format!("{i}/{n}"), "--threads", threads]);
        }
        all.insert(collected(&folder, &out));
    }
    // Elsewhere, under other names.
    let elsewhere = Folder::new();
    std::fs::create_dir(elsewhere.path("deep")).unwrap();
    for (from, to) in [("scene.toml", "deep/rod.toml"), ("tip.csv", "deep/seen.csv")] {
        elsewhere.write(to, &folder.read(from));
    }
    let fit = FIT.replace("scene.toml", "deep/rod.toml").replace("tip.csv", "deep/seen.csv");
    elsewhere.write("fit.toml", &fit);
    elsewhere.write("campaign.toml", GRID);
    plan(&elsewhere, "deep/out");
    run(&elsewhere, "deep/out", &[]);
    all.insert(collected(&elsewhere, "deep/out"));
    assert_eq!(all.len(), 1, "{all:?}");

    let (results, sheet) = all.pop_first().unwrap();
    let results = lines(&results);
    assert_eq!((results.len(), sheet.lines().count()), (12, 13));
    let ids: Vec<&str> = results.iter().map(|line| line["id"].as_str().unwrap()).collect();
    assert!(ids.is_sorted() && ids.iter().all(|id| id.len() == 32), "{ids:?}");
    for line in &results {
        let (result, modulus) = (&line["result"], line["changes"]["material.density"].as_f64());
        assert_eq!(result["code"], 0, "{line}");
        // Gravity alone gives E over density and radius squared.
        let radius = line["changes"]["rod.section.radius"].as_f64().unwrap();
        let expected = 1e8 * modulus.unwrap() / 1273.52 * (5e-3 / radius).powi(2);
        let value = result["report"]["parameters"][0]["value"].as_f64().unwrap();
        assert!((value / expected - 1.0).abs() < 0.02, "{value:e} {expected:e}");
        let text = line.to_string();
        assert!(!text.contains("wall_seconds") && !text.contains(".csv"), "{text}");
        assert!(!text.contains(folder.path("").to_str().unwrap()), "{text}");
    }
    let header = "id,name,fit,material.density,rod.section.radius,code,grade,status,youngs_modulus,\
                  youngs_modulus.std_error,youngs_modulus.low95,youngs_modulus.high95";
    assert_eq!(sheet.lines().next().unwrap(), header);
}

/// Output of `collect` (JSON lines and CSV) after an undisturbed campaign.
pub fn whole(campaign: &str) -> (String, String) {
    let folder = planned(campaign);
    run(&folder, "out", &[]);
    collected(&folder, "out")
}

#[test]
fn killed_run_continues_with_the_same_results() {
    let folder = planned(GRID);
    let mut kills = 0;
    let (mut least, before) = (stored(&folder), Instant::now());
    for k in 0..40 {
        let mut child =
            folder.command(&["campaign", "run", "out", "--threads", "1"]).spawn().unwrap();
        // Moments of a run of 12 fits, of 7 ms each on a fast machine.
        sleep(Duration::from_millis(5 + 9 * (k * 7 % 5)));
        let running = child.try_wait().unwrap().is_none();
        child.kill().unwrap();
        child.wait().unwrap();
        kills += usize::from(running);
        // Nothing that was stored is lost.
        let now = stored(&folder);
        assert!(now >= least);
        least = now;
        if now == 12 || before.elapsed() > Duration::from_secs(20) {
            break;
        }
    }
    run(&folder, "out", &[]);
    assert!(kills > 1, "{kills}");
    assert_eq!(collected(&folder, "out"), whole(GRID));
}

/// Sends SIGTERM to a process.
pub fn terminate(child: &std::process::Child) {
    let killed = std::process::Command::new("sh")
        .args(["-c", &format!("kill -TERM {}", child.id())])
        .status();
    assert!(killed.unwrap().success());
}

#[test]
fn terminated_run_stores_finished_results_and_exits_with_0() {
    let folder = planned(GRID);
    let child = folder.command(&["campaign", "run", "out", "--threads", "1"]).spawn().unwrap();
    let since = Instant::now();
    while parts(&folder).is_empty() && since.elapsed() < Duration::from_secs(60) {
        sleep(Duration::from_millis(5));
    }
    terminate(&child);
    let since = Instant::now();
    let output = child.wait_with_output().unwrap();
    assert!(since.elapsed() < Duration::from_secs(10));
    succeeds(&output);
    let done = stored(&folder);
    // Some of the twelve fits of the grid are done, but not all: the process was ended in between.
    assert!((1..12).contains(&done), "{done}: {}", stdout(&output));
    assert!(
        words(&stdout(&output)).contains(&format!("This run {done} fits")),
        "{}",
        stdout(&output)
    );
    // The number of open fits is reported, with exit code 3.
    let status = folder.run(&["campaign", "status", "out"]);
    assert_eq!(status.status.code(), Some(3));
    let expected = format!("out: {done} of 12 fits have a result");
    assert!(stdout(&status).starts_with(&expected), "{}", stdout(&status));
    let partly = folder.run(&["campaign", "collect", "out", "--out", "some.jsonl"]);
    assert_eq!(partly.status.code(), Some(3));
    assert!(stderr(&partly).contains(&format!("{} of 12 fits have no result", 12 - done)));
    assert_eq!(folder.read("some.jsonl").lines().count(), done);
    run(&folder, "out", &[]);
    assert_eq!(collected(&folder, "out"), whole(GRID));
}

#[test]
fn torn_or_damaged_line_is_computed_again() {
    let folder = planned(GRID);
    run(&folder, "out", &["--threads", "1"]);
    let before = collected(&folder, "out");
    let [part] = &parts(&folder)[..] else { panic!() };
    let text = std::fs::read(part).unwrap();
    std::fs::write(part, &text[..text.len() - 100]).unwrap();
    assert_eq!(stored(&folder), 11);
    let said = run(&folder, "out", &[]);
    assert!(words(&said).contains("This run 1 fits, 1 usable Earlier runs 11 fits"), "{said}");
    assert_eq!(collected(&folder, "out"), before);
    // A changed digit is reported as damage, and its fit is computed again.
    let mut damaged = std::fs::read(part).unwrap();
    let digit = damaged.iter().position(|b| b.is_ascii_digit()).unwrap();
    damaged[digit] = if damaged[digit] == b'1' { b'2' } else { b'1' };
    std::fs::write(part, damaged).unwrap();
    let status = folder.run(&["campaign", "status", "out"]);
    assert!(stderr(&status).contains(":1 is damaged"), "{}", stderr(&status));
    run(&folder, "out", &[]);
    assert_eq!(collected(&folder, "out"), before);
    // Everything is done: nothing is written.
    let files = parts(&folder).len();
    let said = words(&run(&folder, "out", &[]));
    assert!(said.contains("This run 0 fits, 0 usable Earlier runs 12 fits"), "{said}");
    assert_eq!(parts(&folder).len(), files);
}

#[test]
fn id_changes_with_every_input_of_the_result() {
    let folder = folder(GRID);
    let ids = |folder: &Folder| -> BTreeSet<String> {
        plan(folder, "out");
        lines(&folder.read("out/tasks.jsonl")).iter().map(|t| t["id"].to_string()).collect()
    };
    let first = ids(&folder);
    assert_eq!((first.len(), ids(&folder)), (12, first.clone()));
    run(&folder, "out", &[]);
    // Comments and the order of keys are nothing.
    folder.write("fit.toml", &format!("# of today\n{FIT}"));
    assert_eq!(ids(&folder), first);
    let mut seen = first.clone();
    let scene = folder.read("scene.toml");
    for (file, text) in [
        ("tip.csv", data(2)),
        ("scene.toml", replaced(&scene, "segments = 6", "segments = 7")),
        ("fit.toml", replaced(FIT, "what_if = false", "what_if = true")),
    ] {
        let before = folder.read(file);
        folder.write(file, &text);
        let now = ids(&folder);
        assert!(seen.is_disjoint(&now), "{file}");
        seen.extend(now);
        // What was computed before is not what is planned now.
        assert_eq!(stored(&folder), 0, "{file}");
        // It cannot be run by an old plan, which would store it under an id that it has not.
        folder.write(file, &before);
        let output = folder.run(&["campaign", "run", "out", "--threads", "1"]);
        assert_eq!(output.status.code(), Some(2));
        let message = stderr(&output);
        assert!(
            message.contains("changed after the plan was written")
                && message.contains("run `rodfit campaign plan` again"),
            "{message}"
        );
        assert!(message.contains("and 7 more"), "{message}");
    }
    // As it was at first, with the results of that time.
    assert_eq!(ids(&folder), first);
    assert_eq!(stored(&folder), 12);
}

#[test]
fn different_results_of_one_task_are_an_error() {
    let folder = planned(GRID);
    run(&folder, "out", &[]);
    let plan = Plan::open(&folder.path("out")).unwrap();
    let stop = || Arc::new(AtomicBool::new(false));
    let again = Store::new(&plan.folder);
    let mut outcome = plan.solve(&plan.tasks[5], &again, stop()).unwrap().unwrap();
    assert_eq!(collected(&folder, "out"), whole(GRID));
    outcome.json = replaced(&outcome.json, "\"converged\":true", "\"converged\":false");
    again.add(&plan.tasks[5].id, &outcome, 0.1).unwrap();
    let collect = folder.run(&["campaign", "collect", "out", "--out", "all.jsonl"]);
    refused(&collect, &[&plan.tasks[5].id, "different results at out/parts/", " and out/parts/"]);
}

#[test]
fn failed_fit_is_a_result() {
    let folder = folder("fits = [\"*fit.toml\"]\n");
    // A droop under gravity determines only the ratio of E and density; the other row has no such file.
    let two = FIT.replace("[analysis]", "[[parameter]]\nname = \"density\"\n[analysis]");
    folder.write("both-fit.toml", &two);
    folder.write("bad-fit.toml", &FIT.replace("tip.csv", "bad.csv"));
    folder.write("bad.csv", &format!("{}0.5,oh,no\n", data(1)));
    let output = folder.run(&["campaign", "plan", "campaign.toml", "--out", "out"]);
    succeeds(&output);
    assert!(stderr(&output).contains("will be rejected") && stderr(&output).contains("bad.csv:42"));
    let said = run(&folder, "out", &[]);
    assert!(said.starts_with("out: all 3 fits have a result"), "{said}");
    assert!(words(&said).contains("This run 3 fits, 1 usable Earlier runs 0 fits"), "{said}");
    let status = folder.run(&["campaign", "status", "out"]);
    succeeds(&status);
    assert!(stdout(&status).starts_with("out: 3 of 3 fits have a result"));
    assert!(words(&stdout(&status)).contains("usable 1 not usable 1 rejected as bad input 1"));
    let (results, sheet) = collected(&folder, "out");
    let of = |fit: &str| {
        let found = lines(&results).into_iter().find(|line| line["fit"] == fit);
        found.unwrap()["result"].clone()
    };
    assert_eq!((&of("fit.toml")["code"], &of("both-fit.toml")["code"]), (&0.into(), &3.into()));
    assert_eq!(of("both-fit.toml")["report"]["grade"], "not-identifiable");
    let bad = of("bad-fit.toml");
    assert_eq!(bad["code"], 2);
    let words = bad["error"].as_str().unwrap();
    assert!(words.starts_with("observation.0.file:42: ") && words.contains("oh"), "{words}");
    assert!(sheet.contains("bad-fit.toml,2,,\"observation.0.file:42"), "{sheet}");
}

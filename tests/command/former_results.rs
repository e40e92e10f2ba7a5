//! Results that version 0.1 stored, with the keys and codes of that version, are collected with current names and the same
//! numbers.

use crate::folder::{Folder, refused, succeeds};
use rodfit::Code;
use rodfit::fit::{FitReport, RENAMED_KEYS};
use serde_json::Value;

/// A plan with one result, written by version 0.1.0; its `plan.json` names version 0.0.1.
const PLAN: &str = include_str!("former_campaign/plan.json");
const TASKS: &str = include_str!("former_campaign/tasks.jsonl");
const PART: &str = include_str!("former_campaign/parts/node1-1-1.jsonl");

/// A folder with plan, tasks and one part file, as an earlier version wrote them.
fn former_campaign() -> Folder {
    let folder = Folder::new();
    std::fs::create_dir_all(folder.path("out/parts")).unwrap();
    folder.write("out/plan.json", PLAN);
    folder.write("out/tasks.jsonl", TASKS);
    folder.write("out/parts/node1-1-1.jsonl", PART);
    folder
}

/// All numbers of a value, in the order of its keys.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Number(number) => number.as_f64().into_iter().collect(),
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        Value::Object(object) => object.values().flat_map(numbers).collect(),
        _ => Vec::new(),
    }
}

fn sorted(mut numbers: Vec<f64>) -> Vec<f64> {
    numbers.sort_by(f64::total_cmp);
    numbers
}

#[test]
fn former_result_is_collected_with_current_keys_and_the_same_numbers() {
    let folder = former_campaign();
    succeeds(&folder.run(&["campaign", "status", "out"]));
    succeeds(&folder.run(&[
        "campaign",
        "collect",
        "out",
        "--out",
        "all.jsonl",
        "--csv",
        "all.csv",
    ]));
    let stored: Value = serde_json::from_str(PART).unwrap();
    let collected: Value = serde_json::from_str(&folder.read("all.jsonl")).unwrap();
    let (before, mut report) = (&stored["result"]["report"], collected["result"]["report"].clone());
    assert_eq!(sorted(numbers(before)), sorted(numbers(&report)));
    assert_eq!(report["local_minima"]["list"][0]["found_by"], "fit");
    assert_eq!(report["local_minima"]["summary"], before["basins"]["words"]);
    let [current, former] = [&report["undetected_bias"][0], &before["could_hide"][0]]; // old name
    for (name, former_name) in [
        ("effect", "words"),
        ("test", "tell"), // old name
        ("plausible_size", "plausible"),
        ("residual_effect", "visible"),
        ("relative", "relative"),
    ] {
        assert_eq!(current[name], former[former_name], "{name}");
    }
    let current_codes: Vec<&str> =
        report["warning_codes"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert_eq!(
        current_codes,
        [
            "large-residuals",
            "beyond-sigma",
            "residuals-not-white",
            "residuals-not-white",
            "correlated-noise",
        ]
    );
    let first = report["warnings"][0].as_str().unwrap();
    assert!(first.ends_with(" [large-residuals]"), "{first}");
    // It is a report of this version, but for the time, which campaigns do not store.
    report["wall_seconds"] = 0.0.into();
    let report: FitReport = serde_json::from_value(report).unwrap();
    assert_eq!(report.warning_codes[0], Code::LargeResiduals);
    let sheet = folder.read("all.csv");
    let value = before["parameters"][0]["value"].to_string();
    assert!(sheet.lines().nth(1).unwrap().contains(&value), "{sheet}");
    assert!(RENAMED_KEYS.iter().all(|key| key.former != key.current));
}

#[test]
fn plan_of_another_version_is_not_run() {
    let folder = former_campaign();
    refused(
        &folder.run(&["campaign", "run", "out"]),
        &["a plan by version 0.0.1", "run `rodfit campaign plan` again"],
    );
}

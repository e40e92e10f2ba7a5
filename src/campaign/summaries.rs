//! The fits of a campaign in short, for their comparison.

use crate::campaign::changes::Changes;
use crate::campaign::collect::Collected;
use crate::campaign::plan::Task;
use crate::campaign::sheet::{BOOTSTRAP_KEYS, Row};
use crate::error::Error;
use crate::fit::FitSummary;
use std::collections::BTreeSet;
use toml::Value;

impl Collected<'_> {
    /// A summary of every fit that has a result, in the order of the plan; the parts of a bootstrap are one fit. Fits
    /// without a name of their own have that of their file, with the keys that differ between the fits.
    ///
    /// # Errors
    ///
    /// Results of another program.
    pub fn summaries(&self) -> Result<Vec<FitSummary>, Error> {
        let rows = self.rows()?;
        let mut keys: BTreeSet<&String> = BTreeSet::new();
        rows.iter().for_each(|row| keys.extend(row.task.changes.keys()));
        // Keys that all fits have alike do not distinguish them.
        let first = rows.first().map(|row| &row.task.changes);
        keys.retain(|key| {
            let is_same =
                |changes: &Changes| first.is_some_and(|first| first.get(*key) == changes.get(*key));
            !BOOTSTRAP_KEYS.contains(&&key[..])
                && !rows.iter().all(|row| is_same(&row.task.changes))
        });
        let is_one_file =
            rows.iter().all(|row| Some(&row.task.fit) == rows.first().map(|r| &r.task.fit));
        let summary = |row: &Row| {
            let changes: Vec<(String, String)> = keys
                .iter()
                .filter_map(|key| Some(((*key).clone(), text(row.task.changes.get(*key)?))))
                .collect();
            let mut summary = FitSummary::without_result(name(row.task, &changes, is_one_file), "");
            match &row.said.report {
                Some(report) => {
                    summary.grade = serde_json::from_value(report.grade.clone()).ok();
                    summary.status.clone_from(&report.status);
                    summary.parameters.clone_from(&report.parameters);
                    summary.warning_codes.clone_from(&report.warning_codes);
                }
                None => summary.status = row.said.error.clone().unwrap_or_default(),
            }
            summary.changes = changes;
            summary
        };
        Ok(rows.iter().map(summary).collect())
    }
}

/// The name of a task; without one its fit file and its changes, or the changes alone where all have one file.
fn name(task: &Task, changes: &[(String, String)], is_one_file: bool) -> String {
    if !task.name.is_empty() {
        return task.name.clone();
    }
    let file = task.fit.with_extension("").display().to_string();
    let last = |key: &str| key.rsplit('.').next().unwrap_or_default().to_string();
    let mut names: Vec<String> = changes.iter().map(|(key, _)| last(key)).collect();
    let is_short_unique = names.iter().enumerate().all(|(k, name)| !names[..k].contains(name));
    if !is_short_unique {
        names = changes.iter().map(|(key, _)| key.clone()).collect();
    }
    let pairs = names.iter().zip(changes).map(|(name, (_, value))| format!("{name} = {value}"));
    let changes = pairs.collect::<Vec<_>>().join(", ");
    match (changes.is_empty(), is_one_file) {
        (true, _) => file,
        (false, true) => changes,
        (false, false) => format!("{file}, {changes}"),
    }
}

fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        value => value.to_string(),
    }
}

//! Summaries of a campaign's fits for the page that compares them: name, changed keys, grade, status, estimates and
//! warnings.
//!
//! Input are the rows of the CSV table, in which the parts of a bootstrap are one fit. Only changed keys whose values
//! differ between the fits are kept, without those of bootstrap parts. A fit without a name is named after its file and
//! these keys: by the keys alone if all fits have one file, by the file alone without keys. Output is a `FitSummary`
//! per fit with a result, in the order of the plan, without the address of a page. A fit with an error has its message
//! as status, and no grade and no estimates. Stored results that are not valid JSON of this version are an error.

use crate::campaign::collect::Collected;
use crate::campaign::csv_table::{BOOTSTRAP_KEYS, ResultRow, plain_text};
use crate::campaign::plan::CampaignTask;
use crate::error::Error;
use crate::fit::FitSummary;
use crate::summary::distinct;
use std::collections::BTreeSet;

impl Collected<'_> {
    /// A summary of every fit with a result, in the order of the plan; the parts of a bootstrap are one fit. Changed
    /// keys of a summary are those whose values differ between the fits, without those of bootstrap parts. A fit
    /// without a name is called after its file and these keys. One without a report has its error message as status,
    /// and no grade and no estimates. Pages are not set.
    ///
    /// # Errors
    ///
    /// Results that are not valid JSON of this version.
    pub fn summaries(&self) -> Result<Vec<FitSummary>, Error> {
        let rows = self.rows()?;
        let keys: BTreeSet<&String> = rows.iter().flat_map(|row| row.task.changes.keys()).collect();
        // Keys with the same value in all fits do not distinguish them.
        let differs = |key: &&String| {
            distinct(rows.iter().map(|row| row.task.changes.get(*key))).len() > 1
                && !BOOTSTRAP_KEYS.contains(&&key[..])
        };
        let keys: Vec<&String> = keys.into_iter().filter(differs).collect();
        // The file is a part of a fit's name only where it distinguishes fits.
        let is_one_file = distinct(rows.iter().map(|row| &row.task.fit)).len() == 1;
        let summary = |row: &ResultRow| {
            let change =
                |key: &&String| Some(((*key).clone(), plain_text(row.task.changes.get(*key)?)));
            let changes: Vec<(String, String)> = keys.iter().filter_map(change).collect();
            let name = fit_name(row.task, &changes, is_one_file);
            let mut summary = FitSummary::without_result(name, "");
            match &row.result.report {
                Some(report) => {
                    summary.grade = serde_json::from_value(report.grade.clone()).ok();
                    summary.status.clone_from(&report.status);
                    summary.parameters.clone_from(&report.parameters);
                    summary.warning_codes.clone_from(&report.warning_codes);
                }
                None => summary.status = row.result.error.clone().unwrap_or_default(),
            }
            summary.changes = changes;
            summary
        };
        Ok(rows.iter().map(summary).collect())
    }
}

/// The name of a task. A task without one is called after its fit file (without extension) and its changes, as `file,
/// key = value`. It has the changes alone if all tasks have one file, and the file alone without changes. Keys are
/// shortened to their last part if that is unique.
fn fit_name(task: &CampaignTask, changes: &[(String, String)], is_one_file: bool) -> String {
    if !task.name.is_empty() {
        return task.name.clone();
    }
    let file = task.fit.with_extension("").display().to_string();
    let last = |key: &str| key.rsplit('.').next().unwrap_or_default().to_string();
    let is_unique = distinct(changes.iter().map(|(key, _)| last(key))).len() == changes.len();
    let name = |key: &String| if is_unique { last(key) } else { key.clone() };
    let pairs = changes.iter().map(|(key, value)| format!("{} = {value}", name(key)));
    let changes = pairs.collect::<Vec<_>>().join(", ");
    match (changes.is_empty(), is_one_file) {
        (true, _) => file,
        (false, true) => changes,
        (false, false) => format!("{file}, {changes}"),
    }
}

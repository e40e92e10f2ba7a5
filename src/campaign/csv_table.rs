//! The results of a campaign as a CSV table: one row for each fit with a result, for spreadsheets and data frames.
//!
//! Input are the collected results, as JSON. Rows are in the order of the plan. Columns are id, name, fit file, all
//! changed keys but `analysis.bootstrap_first`, exit code, grade and status (of a failed fit its error). Value,
//! standard error and ends of the 95 % interval of every parameter in SI units follow, empty where missing; a lower
//! bound alone fills the low end. A text that a spreadsheet would compute has a leading apostrophe. Tasks with
//! `analysis.bootstrap_first` that are parts of one bootstrap (equal fit file, name and other changes) are one row. Its
//! `analysis.bootstrap` is the number of all pooled replicates, which give one standard error and one interval in
//! further columns (also those of a bootstrap that is not divided); its other columns are those of the first part.
//! Results that are not valid JSON of this version are an error. [`Collected::csv_table`] returns the bytes of the
//! table, [`Collected::rows`] the rows before they become text, and [`plain_text`] a TOML value as text.
//!
//! [`ResultRow`] is a row before it becomes text; [`StoredResult`] and [`StoredReport`] are the parts of a stored
//! result that rows and summaries need. [`BOOTSTRAP_KEYS`] are the changed keys that distinguish parts of one
//! bootstrap.

use crate::campaign::changes::Changes;
use crate::campaign::collect::Collected;
use crate::campaign::plan::CampaignTask;
use crate::error::Error;
use crate::fit::{Bootstrap, Estimate, Unknown};
use crate::input::text_cell::to_cell;
use crate::summary::distinct;
use marker_files::printable::with_tokens_cut;
use serde::Deserialize;
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;
use toml::Value;

/// Changed keys that distinguish the parts of one bootstrap: the number of replicates, and the index of the first.
pub(crate) const BOOTSTRAP_KEYS: [&str; 2] = ["analysis.bootstrap", "analysis.bootstrap_first"];
/// Suffixes of the columns of a parameter: value, standard error, and ends of the 95 % interval.
const PARAMETER_COLUMNS: [&str; 4] = ["", ".std_error", ".low95", ".high95"];
/// Suffixes of the further columns of a parameter in campaigns with a bootstrap.
const BOOTSTRAP_COLUMNS: [&str; 3] =
    [".bootstrap_std_error", ".bootstrap_low95", ".bootstrap_high95"];

/// The part of a stored result (JSON) that tables and summaries need: exit code, and error message or report.
#[derive(Deserialize)]
pub(crate) struct StoredResult {
    code: u8,
    pub error: Option<String>,
    pub report: Option<StoredReport>,
}

/// The part of a stored report that tables and summaries need.
#[derive(Deserialize)]
pub(crate) struct StoredReport {
    pub grade: Json,
    pub status: String,
    pub parameters: Vec<Estimate>,
    #[serde(default)]
    pub warning_codes: Vec<String>,
}

impl StoredResult {
    /// The estimates of the report in its order; an empty list without a report.
    fn parameters(&self) -> impl Iterator<Item = &Estimate> {
        self.report.iter().flat_map(|report| &report.parameters)
    }
}

/// A row: a task with its result, which for a bootstrap is that of its first part.
pub(crate) struct ResultRow<'a> {
    pub task: &'a CampaignTask,
    pub result: StoredResult,
    /// Estimates of all replicates, parameter by parameter.
    replicates: Vec<Vec<f64>>,
}

impl ResultRow<'_> {
    /// The cell of a changed `key` as text; empty if the task does not change it. The cell of the number of bootstrap
    /// replicates is that of all pooled ones.
    fn change(&self, key: &str) -> String {
        // The change of the first part has its own number of replicates only.
        match (self.task.changes.get(key), self.replicates.first()) {
            (Some(_), Some(replicates)) if key == BOOTSTRAP_KEYS[0] => replicates.len().to_string(),
            (value, _) => value.map_or_else(String::new, plain_text),
        }
    }

    /// The grade of the fit (its code) and its status; for a fit without a report an empty text and the error message.
    fn grade_and_status(&self) -> [String; 2] {
        match &self.result.report {
            Some(report) => {
                [report.grade.as_str().unwrap_or_default().into(), report.status.clone()]
            }
            None => [String::new(), self.result.error.clone().unwrap_or_default()],
        }
    }

    /// The cells of the parameter with this label: value, standard error, low and high end of the 95 % interval, then
    /// standard error and ends of the pooled bootstrap. Numbers have all digits; missing ones are empty. Without an
    /// interval a lower bound fills only the low end; an upper bound alone is not in the table. All are empty for a fit
    /// without this parameter.
    fn estimate(&self, label: &str) -> [String; 7] {
        let mut own = self.result.parameters().zip(&self.replicates);
        let Some((e, replicates)) = own.find(|(e, _)| e.label() == label) else {
            return Default::default();
        };
        let [low, high] = e.interval95.map_or([e.lower95, None], |ends| ends.map(Some));
        let unknown = Unknown::new(e.name);
        // The error and interval of pooled replicates are those of a single bootstrap with all of them.
        let pooled =
            e.value.and_then(|value| Bootstrap::from_estimates(&unknown, value, replicates));
        let [pooled_low, pooled_high] =
            pooled.as_ref().map_or([None; 2], |b| b.interval95.map(Some));
        let pooled_std = pooled.as_ref().map(|b| b.std_error);
        [e.value, e.std_error, low, high, pooled_std, pooled_low, pooled_high]
            .map(|x| x.map_or(String::new(), |x| format!("{x:?}")))
    }
}

impl Collected<'_> {
    /// A header and a CSV row for every fit with a result, in the order of the plan: id, name, fit file, changed keys,
    /// exit code, grade, status, and value, standard error and 95 % interval of every parameter. Columns are the union
    /// over all fits. The parts of a bootstrap are one row. Text that a spreadsheet would compute has a leading
    /// apostrophe.
    ///
    /// # Errors
    ///
    /// Results that are not valid JSON of this version.
    pub fn csv_table(&self) -> Result<Vec<u8>, Error> {
        let rows = self.rows()?;
        let keys = rows.iter().flat_map(|row| row.task.changes.keys());
        let keys = distinct(keys.filter(|key| *key != BOOTSTRAP_KEYS[1]));
        let labels =
            distinct(rows.iter().flat_map(|row| row.result.parameters()).map(Estimate::label));
        let has_bootstrap = rows.iter().flat_map(|row| &row.replicates).any(|all| !all.is_empty());
        let columns = match has_bootstrap {
            true => [&PARAMETER_COLUMNS[..], &BOOTSTRAP_COLUMNS].concat(),
            false => PARAMETER_COLUMNS.to_vec(),
        };
        // Columns are the union of the keys and parameters of all fits.
        let mut header = ["id", "name", "fit"].map(String::from).to_vec();
        header.extend(keys.iter().map(ToString::to_string));
        header.extend(["code", "grade", "status"].map(String::from));
        for label in &labels {
            header.extend(columns.iter().map(|column| format!("{label}{column}")));
        }
        // Every cell is written as text that no spreadsheet computes.
        let mut writer = csv::Writer::from_writer(Vec::new());
        let failed =
            |error: &dyn Display| Error::Fit(format!("the CSV table cannot be written: {error}"));
        let mut write = |cells: Vec<String>| {
            let cells = cells.iter().map(|text| to_cell(text).into_owned());
            writer.write_record(cells).map_err(|error| failed(&error))
        };
        write(header)?;
        for row in &rows {
            let CampaignTask { id, name, fit, .. } = row.task;
            let mut cells = vec![id.clone(), name.clone(), fit.display().to_string()];
            cells.extend(keys.iter().map(|key| row.change(key)));
            cells.push(row.result.code.to_string());
            cells.extend(row.grade_and_status());
            for label in &labels {
                cells.extend(row.estimate(label).into_iter().take(columns.len()));
            }
            write(cells)?;
        }
        writer.into_inner().map_err(|error| failed(&error))
    }

    /// The results in the order of the plan, with all parts of a bootstrap pooled in the row of its first part with a
    /// result. Pooled are the replicates of each parameter, by its position in the report; the rest is that of the
    /// first part. Parts belong together if fit file, name and all other changes are equal. Error: a result that is not
    /// valid JSON of this version.
    pub(crate) fn rows(&self) -> Result<Vec<ResultRow<'_>>, Error> {
        let mut rows: Vec<ResultRow> = Vec::new();
        // The row of each bootstrap by its fit, its name and its other changes.
        let mut bootstraps: BTreeMap<(&Path, &str, String), usize> = BTreeMap::new();
        for (task, record) in self.results() {
            let result: StoredResult = serde_json::from_str(&record.result).map_err(|error| {
                let error = error.to_string();
                let found = with_tokens_cut(&error, '"');
                let message = format!("found {found}, allowed: a result of this version");
                Error::Data { path: record.file.clone(), line: record.line, message }
            })?;
            let estimates =
                |e: &Estimate| e.bootstrap.as_ref().map_or(Vec::new(), |b| b.estimates.clone());
            let replicates: Vec<Vec<f64>> = result.parameters().map(estimates).collect();
            // Parts of one bootstrap differ in these keys only: their replicates are pooled.
            if task.changes.contains_key(BOOTSTRAP_KEYS[1]) {
                let group = (&*task.fit, &*task.name, other_changes(&task.changes));
                if let Some(first) = bootstraps.get(&group) {
                    let row = &mut rows[*first];
                    // A fit that failed has no parameters: the next part with some stands in its place.
                    if row.replicates.is_empty() {
                        *row = ResultRow { task, result, replicates };
                        continue;
                    }
                    // Parts of one bootstrap have the same parameters in the same order.
                    let all = row.replicates.iter_mut();
                    all.zip(replicates).for_each(|(all, more)| all.extend(more));
                    continue;
                }
                bootstraps.insert(group, rows.len());
            }
            rows.push(ResultRow { task, result, replicates });
        }
        Ok(rows)
    }
}

/// The changes of a task except the keys of its part of a bootstrap, as lines `key = value`. Equal texts identify one
/// bootstrap.
fn other_changes(changes: &Changes) -> String {
    let others = changes.iter().filter(|(key, _)| !BOOTSTRAP_KEYS.contains(&&***key));
    others.map(|(key, value)| format!("{key} = {value}\n")).collect()
}

/// A TOML value as text; strings without quotes.
pub(crate) fn plain_text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        value => value.to_string(),
    }
}

//! Results as a sheet: a row a fit, for spreadsheets and data frames.

use crate::campaign::collect::Collected;
use crate::campaign::plan::Task;
use crate::error::Error;
use crate::fit::{Bootstrap, Estimate, Unknown};
use crate::input::text_cell::to_cell;
use marker_files::printable::with_tokens_cut;
use serde::Deserialize;
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::path::Path;
use toml::Value;

/// Changes that tell parts of one bootstrap apart.
pub(crate) const BOOTSTRAP_KEYS: [&str; 2] = ["analysis.bootstrap", "analysis.bootstrap_first"];

/// What a row takes from a result.
#[derive(Deserialize)]
pub(crate) struct Said {
    code: u8,
    pub error: Option<String>,
    pub report: Option<Report>,
}

#[derive(Deserialize)]
pub(crate) struct Report {
    pub grade: Json,
    pub status: String,
    pub parameters: Vec<Estimate>,
    #[serde(default)]
    pub warning_codes: Vec<String>,
}

/// A row: a task, or all parts of a bootstrap.
pub(crate) struct Row<'a> {
    pub task: &'a Task,
    pub said: Said,
    /// What all replicates found, parameter by parameter.
    estimates: Vec<Vec<f64>>,
}

impl Collected<'_> {
    /// A row for every fit that has a result, in the order of the plan: name, fit file, what was changed, exit code, grade, how it
    /// ended, and value, standard error and 95 % interval of every parameter. The parts of a bootstrap are one row. Text that
    /// a spreadsheet would compute has a leading apostrophe.
    ///
    /// # Errors
    ///
    /// Results of another program.
    pub fn sheet(&self) -> Result<Vec<u8>, Error> {
        let rows = self.rows()?;
        let (mut changes, mut labels) = (Vec::new(), Vec::new());
        for row in &rows {
            add_new(
                &mut changes,
                row.task.changes.keys().filter(|key| *key != BOOTSTRAP_KEYS[1]).cloned(),
            );
            let parameters = row.said.report.iter().flat_map(|report| &report.parameters);
            add_new(&mut labels, parameters.map(Estimate::label));
        }
        let bootstrapped = rows.iter().any(|row| row.estimates.iter().any(|all| !all.is_empty()));
        let mut columns = vec!["", ".std_error", ".low95", ".high95"];
        if bootstrapped {
            columns.extend([".bootstrap_std_error", ".bootstrap_low95", ".bootstrap_high95"]);
        }
        let fixed = ["id", "name", "fit"].map(String::from);
        let header = fixed.into_iter().chain(changes.iter().cloned());
        let header = header.chain(["code", "grade", "status"].map(String::from));
        let header = header
            .chain(labels.iter().flat_map(|l| columns.iter().map(move |c| format!("{l}{c}"))));
        let mut sheet = csv::Writer::from_writer(Vec::new());
        let mut write = |row: Vec<String>| {
            let cells = row.iter().map(|text| to_cell(text).into_owned());
            sheet
                .write_record(cells)
                .map_err(|error| Error::Fit(format!("the CSV table cannot be written: {error}")))
        };
        write(header.collect())?;
        for row in &rows {
            let Row { task, said, estimates } = row;
            let mut cells =
                vec![task.id.clone(), task.name.clone(), task.fit.display().to_string()];
            cells.extend(changes.iter().map(|key| match task.changes.get(key) {
                Some(_) if key == BOOTSTRAP_KEYS[0] && !estimates.is_empty() => {
                    estimates[0].len().to_string()
                }
                Some(Value::String(text)) => text.clone(),
                Some(value) => value.to_string(),
                None => String::new(),
            }));
            let (grade, status) = match &said.report {
                Some(report) => {
                    (report.grade.as_str().unwrap_or_default().into(), report.status.clone())
                }
                None => (String::new(), said.error.clone().unwrap_or_default()),
            };
            cells.extend([said.code.to_string(), grade, status]);
            for label in &labels {
                let parameters = said.report.iter().flat_map(|report| &report.parameters);
                let found = parameters.zip(estimates).find(|(e, _)| e.label() == *label);
                cells.extend(numbers(found, columns.len()));
            }
            write(cells)?;
        }
        sheet
            .into_inner()
            .map_err(|error| Error::Fit(format!("the CSV table cannot be written: {error}")))
    }

    /// The results, with all parts of a bootstrap in one row.
    pub(crate) fn rows(&self) -> Result<Vec<Row<'_>>, Error> {
        let mut rows: Vec<Row> = Vec::new();
        let mut groups: BTreeMap<(&Path, &str, String), usize> = BTreeMap::new();
        for (task, record) in self.results() {
            let said: Said = serde_json::from_str(&record.result).map_err(|error| Error::Data {
                path: record.file.clone(),
                line: record.line,
                message: format!(
                    "found {}, allowed: a result of this version",
                    with_tokens_cut(&error.to_string(), '"')
                ),
            })?;
            let found =
                |e: &Estimate| e.bootstrap.as_ref().map_or(Vec::new(), |b| b.estimates.clone());
            let parameters = said.report.iter().flat_map(|report| &report.parameters);
            let estimates: Vec<Vec<f64>> = parameters.map(found).collect();
            if task.changes.contains_key(BOOTSTRAP_KEYS[1]) {
                let mut others = task.changes.clone();
                others.retain(|key, _| !BOOTSTRAP_KEYS.contains(&&**key));
                let others =
                    others.iter().map(|(key, value)| format!("{key} = {value}\n")).collect();
                let group = (&*task.fit, &*task.name, others);
                if let Some(first) = groups.get(&group) {
                    let first: &mut Row = &mut rows[*first];
                    let all = first.estimates.iter_mut().zip(estimates);
                    all.for_each(|(all, more)| all.extend(more));
                    continue;
                }
                groups.insert(group, rows.len());
            }
            rows.push(Row { task, said, estimates });
        }
        Ok(rows)
    }
}

/// The cells of a parameter.
fn numbers(found: Option<(&Estimate, &Vec<f64>)>, columns: usize) -> Vec<String> {
    let Some((e, replicates)) = found else { return vec![String::new(); columns] };
    let pooled = e
        .value
        .and_then(|value| Bootstrap::from_estimates(&Unknown::new(e.name), value, replicates));
    let [low, high] = e.interval95.map_or([e.lower95, None], |ends| ends.map(Some));
    let all = [
        e.value,
        e.std_error,
        low,
        high,
        pooled.as_ref().map(|b| b.std_error),
        pooled.as_ref().map(|b| b.interval95[0]),
        pooled.as_ref().map(|b| b.interval95[1]),
    ];
    let shown = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:?}"));
    all.into_iter().take(columns).map(shown).collect()
}

/// Adds what is not there yet.
fn add_new(all: &mut Vec<String>, more: impl Iterator<Item = String>) {
    for one in more {
        if !all.contains(&one) {
            all.push(one);
        }
    }
}

//! `campaign.toml`: which fits there are, and what is changed of them.

use crate::campaign::changes::{Changes, Key};
use crate::campaign::fit_pattern::matching_files;
use crate::campaign::resolved::folder_of;
use crate::campaign::row::Row;
use crate::campaign::table;
use crate::error::Error;
use crate::input::hints::{CAMPAIGN, explained};
use crate::input::missing_keys::parse;
use marker_files::file::text;
use serde::Deserialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Most tasks: beyond it is a slip of the pen.
pub(crate) const MOST_TASKS: usize = 300_000;

/// A campaign: a list of fits.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct Form {
    /// Fit files, as glob patterns relative to the campaign file.
    #[serde(default)]
    pub fits: Vec<String>,
    /// CSV table with one row for each fit, relative to the campaign file.
    pub table: Option<PathBuf>,
    /// Values of each key; all combinations are fitted.
    #[serde(default)]
    #[cfg_attr(test, schemars(with = "std::collections::BTreeMap<String, serde_json::Value>"))]
    pub grid: Table,
    /// Bootstrap whose replicates are distributed over tasks.
    pub bootstrap: Option<Bootstrap>,
    /// Fits from random start values.
    pub starts: Option<Starts>,
}

/// `[bootstrap]`: replicates of a bootstrap, distributed over tasks.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct Bootstrap {
    /// Number of replicates.
    pub replicates: usize,
    /// Approximate number of replicates per task.
    #[serde(default = "sixteen")]
    pub batch: usize,
    /// Seed of the random numbers.
    #[serde(default)]
    pub seed: u64,
}

impl Bootstrap {
    /// In how many tasks.
    pub fn parts(self) -> usize {
        (self.replicates / self.batch).max(1)
    }
}

fn sixteen() -> usize {
    16
}

/// `[starts]`: fits from random start values.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct Starts {
    /// Number of random starts.
    pub count: usize,
    /// Seed of the random numbers.
    #[serde(default)]
    pub seed: u64,
}

impl Form {
    /// Reads a campaign file.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let text = text(file)?;
        let form: Self = parse(&text, &[])
            .map_err(|error| explained(error, &text, &CAMPAIGN).in_file(Some(file)))?;
        form.check().map_err(|error| error.in_file(Some(file)))?;
        Ok(form)
    }

    fn check(&self) -> Result<(), Error> {
        if let Some(Bootstrap { replicates, batch, .. }) = self.bootstrap {
            if !(2..=MOST_TASKS).contains(&replicates) {
                let allowed = format!("2 .. {MOST_TASKS}");
                return Err(Error::invalid("bootstrap.replicates", replicates, allowed));
            }
            if !(2..=100_000).contains(&batch) {
                return Err(Error::invalid("bootstrap.batch", batch, "2 .. 100000"));
            }
        }
        match self.starts {
            Some(Starts { count, .. }) if !(1..=MOST_TASKS).contains(&count) => {
                Err(Error::invalid("starts.count", count, format!("1 .. {MOST_TASKS}")))
            }
            _ => Ok(()),
        }
    }

    /// How many tasks so many rows make.
    pub fn tasks_of(&self, rows: usize) -> usize {
        let starts = self.starts.map_or(1, |starts| starts.count);
        let parts = self.bootstrap.map_or(1, Bootstrap::parts);
        rows.saturating_mul(starts).saturating_mul(parts)
    }

    /// All fits with all their changes, but for bootstrap and starts.
    pub fn rows(&self, file: &Path) -> Result<Vec<Row>, Error> {
        let root = folder_of(file);
        let in_file = |error: Error| error.in_file(Some(file));
        let fits = self.matched(root).map_err(in_file)?;
        let rows = match &self.table {
            None => fits.into_iter().map(Row::of).collect(),
            Some(name) => table::rows(&root.join(name), &fits)?,
        };
        if rows.is_empty() {
            return Err(in_file(Error::invalid(
                "fits",
                "none",
                "fits = [\"*/fit.toml\"], or a table of fits",
            )));
        }
        let combinations = combinations(&self.grid).map_err(in_file)?;
        if rows.len().saturating_mul(combinations.len()) > MOST_TASKS {
            let found = format!("{} fits times {}", rows.len(), combinations.len());
            return Err(in_file(Error::invalid(
                "grid",
                found,
                format!("up to {MOST_TASKS} tasks"),
            )));
        }
        let mut all = Vec::new();
        for row in rows {
            for combination in &combinations {
                let mut row = row.clone();
                row.changes.extend(combination.clone());
                all.push(row);
            }
        }
        Ok(all)
    }

    /// The fit files that the patterns name, each once.
    fn matched(&self, root: &Path) -> Result<Vec<PathBuf>, Error> {
        let (mut all, mut seen) = (Vec::new(), BTreeSet::new());
        for (k, pattern) in self.fits.iter().enumerate() {
            let key = format!("fits[{k}]");
            let before = all.len();
            for path in matching_files(root, pattern, &key)? {
                let relative = path.strip_prefix(root).unwrap_or(&path).to_path_buf();
                if seen.insert(relative.clone()) {
                    all.push(relative);
                }
            }
            if all.len() == before {
                let allowed = "the name of a fit file, or a pattern of such, from the folder of the campaign file";
                return Err(Error::invalid(
                    key,
                    format!("{pattern:?}, which no other file matches"),
                    allowed,
                ));
            }
        }
        Ok(all)
    }
}

/// All combinations of the values of a grid; one without changes where there is none. Keys may be quoted, or tables in tables.
fn combinations(grid: &Table) -> Result<Vec<Changes>, Error> {
    let mut axes = Vec::new();
    flatten(grid, "", &mut axes);
    let (mut all, mut known) = (vec![Changes::new()], Vec::new());
    for (key, value) in axes {
        let place = Key::new(&key).map_err(|error| match error {
            Error::Invalid { found, allowed, .. } => {
                Error::invalid(format!("grid.{key}"), found, allowed)
            }
            error => error,
        })?;
        if let Some((other, _)) = known.iter().find(|(_, other)| *other == place) {
            let allowed = format!("one of the two: {other} is the same");
            return Err(Error::invalid(format!("grid.{key}"), "the same number twice", allowed));
        }
        known.push((key.clone(), place));
        let Value::Array(values) = value else {
            return Err(Error::invalid(format!("grid.{key}"), value, "a list of values"));
        };
        if values.is_empty() || all.len().saturating_mul(values.len()) > MOST_TASKS {
            let allowed =
                format!("a list of one value or more, and up to {MOST_TASKS} combinations");
            return Err(Error::invalid(
                format!("grid.{key}"),
                format!("{} values", values.len()),
                allowed,
            ));
        }
        let with = |changes: &Changes, value: &Value| {
            let mut changes = changes.clone();
            changes.insert(key.clone(), value.clone());
            changes
        };
        all = all
            .iter()
            .flat_map(|changes| values.iter().map(|value| with(changes, value)).collect::<Vec<_>>())
            .collect();
    }
    Ok(all)
}

fn flatten(table: &Table, place: &str, axes: &mut Vec<(String, Value)>) {
    for (key, value) in table {
        let place = if place.is_empty() { key.clone() } else { format!("{place}.{key}") };
        match value {
            Value::Table(inner) => flatten(inner, &place, axes),
            value => axes.push((place, value.clone())),
        }
    }
}

//! The campaign file (TOML): which fits are made, and with which changes of their keys.
//!
//! Input: the file. Fit files are given by patterns or by a CSV table, whose columns are changed keys. A grid adds all
//! combinations of listed values; it replaces a value of the table for the same key. [`CampaignFile::read`]
//! checks the keys; [`CampaignFile::rows`] returns one [`CampaignRow`] for each fit file or row of the table and each
//! combination, the grid varying faster. [`CampaignFile::task_count`] is the number of tasks that a number of rows
//! becomes. `[starts]` repeats each row from random start values. `[bootstrap]` divides the replicates of a bootstrap
//! among tasks: replicates over batch, rounded down, at least 1 (`parts`). [`extended`] combines sets of changes. Wrong
//! keys and patterns, no fit, and more than [`MOST_TASKS`] rows are errors, the last detected before the list is built.

use crate::campaign::changes::{Changes, Key};
use crate::campaign::fit_pattern::matching_files;
use crate::campaign::resolved::folder_of;
use crate::campaign::row::CampaignRow;
use crate::campaign::table::table_rows;
use crate::error::Error;
use crate::input::hints::{CAMPAIGN, explained};
use crate::input::missing_keys::parse;
use marker_files::file::text;
use serde::Deserialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Most tasks of a campaign: more are a mistake in its file, such as a grid with too many combinations.
pub(crate) const MOST_TASKS: usize = 300_000;

/// A campaign: a list of fits.
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct CampaignFile {
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
    pub bootstrap: Option<DistributedBootstrap>,
    /// Fits from random start values.
    pub starts: Option<RandomStarts>,
}

/// `[bootstrap]`: replicates of a bootstrap, distributed over tasks.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct DistributedBootstrap {
    /// Number of replicates.
    pub replicates: usize,
    /// Approximate number of replicates per task.
    #[serde(default = "default_batch")]
    pub batch: usize,
    /// Seed of the random numbers.
    #[serde(default)]
    pub seed: u64,
}

impl DistributedBootstrap {
    /// Number of tasks among which the replicates are divided: replicates over batch, rounded down, at least 1. It
    /// panics for a batch of 0, which [`CampaignFile::read`] rejects.
    pub fn parts(self) -> usize {
        (self.replicates / self.batch).max(1)
    }
}

/// Replicates per task without the key `batch`: 16. Fewer lose less at a kill, more repeat the first fit less often.
fn default_batch() -> usize {
    16
}

/// `[starts]`: fits from random start values.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct RandomStarts {
    /// Number of random starts.
    pub count: usize,
    /// Seed of the random numbers.
    #[serde(default)]
    pub seed: u64,
}

impl CampaignFile {
    /// Reads and checks a campaign file. Errors (unreadable, unknown keys, wrong types, numbers out of range) name the
    /// file, the key and the allowed values.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let text = text(file)?;
        let form: Self = parse(&text, &[])
            .map_err(|error| explained(error, &text, &CAMPAIGN).in_file(Some(file)))?;
        form.check().map_err(|error| error.in_file(Some(file)))?;
        Ok(form)
    }

    /// Rejects fewer than 2 or more than [`MOST_TASKS`] replicates of a bootstrap, batches outside 2 to 100000, and
    /// numbers of starts outside 1 to [`MOST_TASKS`]. The error has the key, the value and the allowed range. Missing
    /// tables are not checked.
    fn check(&self) -> Result<(), Error> {
        if let Some(DistributedBootstrap { replicates, batch, .. }) = self.bootstrap {
            if !(2..=MOST_TASKS).contains(&replicates) {
                let allowed = format!("2 .. {MOST_TASKS}");
                return Err(Error::invalid("bootstrap.replicates", replicates, allowed));
            }
            // Every task repeats the first fit: with a single replicate each it would cost more than the replicates.
            if !(2..=100_000).contains(&batch) {
                return Err(Error::invalid("bootstrap.batch", batch, "2 .. 100000"));
            }
        }
        match self.starts {
            Some(RandomStarts { count, .. }) if !(1..=MOST_TASKS).contains(&count) => {
                Err(Error::invalid("starts.count", count, format!("1 .. {MOST_TASKS}")))
            }
            _ => Ok(()),
        }
    }

    /// Number of tasks of this number of `rows`: rows times random starts times parts of the bootstrap, each 1 if the
    /// file has none. It is limited to the largest integer.
    pub fn task_count(&self, rows: usize) -> usize {
        let starts = self.starts.map_or(1, |starts| starts.count);
        let parts = self.bootstrap.map_or(1, DistributedBootstrap::parts);
        // The product is compared with a limit, and must not overflow.
        rows.saturating_mul(starts).saturating_mul(parts)
    }

    /// All fits with their changes: each row of the table, or matched file, with each combination of the grid, the grid
    /// varying faster. Values of the grid win over those of the table for the same key, also by another name of it.
    /// `file` is the path of the campaign file, whose folder all paths are relative to. Error: an invalid pattern,
    /// table or grid, no fit, or more than [`MOST_TASKS`] rows.
    pub fn rows(&self, file: &Path) -> Result<Vec<CampaignRow>, Error> {
        let root = folder_of(file);
        let in_file = |error: Error| error.in_file(Some(file));
        let fits = self.matched(root).map_err(in_file)?;
        // A table has its own fit files or combines with those of the patterns.
        let rows = match &self.table {
            None => {
                let row = |fit| CampaignRow { fit, ..CampaignRow::default() };
                fits.into_iter().map(row).collect()
            }
            Some(name) => table_rows(&root.join(name), &fits)?,
        };
        if rows.is_empty() {
            let allowed = "fits = [\"*/fit.toml\"], or a table of fits";
            return Err(in_file(Error::invalid("fits", "none", allowed)));
        }
        // The number of tasks is checked before the list is built.
        let combinations = combinations(&self.grid).map_err(in_file)?;
        if rows.len().saturating_mul(combinations.len()) > MOST_TASKS {
            let found = format!("{} fits times {}", rows.len(), combinations.len());
            let allowed = format!("up to {MOST_TASKS} tasks");
            return Err(in_file(Error::invalid("grid", found, allowed)));
        }
        // All combinations have the same keys.
        let names = combinations.iter().take(1).flat_map(Changes::keys);
        let of_grid = names.map(|name| Key::new(name)).collect::<Result<Vec<_>, _>>()?;
        let mut all = Vec::new();
        for mut row in rows {
            // A value of the grid replaces that of the table for the same key, whose names may differ.
            row.changes.retain(|name, _| Key::new(name).is_ok_and(|key| !of_grid.contains(&key)));
            for combination in &combinations {
                let mut row = row.clone();
                row.changes.extend(combination.clone());
                all.push(row);
            }
        }
        Ok(all)
    }

    /// The fit files that match the patterns, pattern after pattern, each file once. Paths are relative to the folder
    /// `root` of the campaign file, or as they are if elsewhere. Error: an invalid pattern, or one that matches no
    /// further file.
    fn matched(&self, root: &Path) -> Result<Vec<PathBuf>, Error> {
        let (mut all, mut seen) = (Vec::new(), BTreeSet::new());
        for (k, pattern) in self.fits.iter().enumerate() {
            let key = format!("fits[{k}]");
            let before = all.len();
            for path in matching_files(root, pattern, &key)? {
                // Relative paths keep the plan valid when its folder is moved.
                let relative = path.strip_prefix(root).unwrap_or(&path).to_path_buf();
                if seen.insert(relative.clone()) {
                    all.push(relative);
                }
            }
            if all.len() == before {
                let allowed = "the name of a fit file, or a pattern of names, relative to the \
                               folder of the campaign file";
                let found = format!("{pattern:?}, which matches no further file");
                return Err(Error::invalid(key, found, allowed));
            }
        }
        Ok(all)
    }
}

/// All combinations of the values of a grid, the first key varying slowest; one without changes if the grid is empty.
/// Keys are in the order of the table, and may be quoted paths, or tables in tables. Errors: an unknown key, a key
/// twice, a value that is no list, an empty list, and more than [`MOST_TASKS`] combinations.
fn combinations(grid: &Table) -> Result<Vec<Changes>, Error> {
    let mut axes = Vec::new();
    flatten(grid, "", &mut axes);
    let mut all = vec![Changes::new()];
    let mut known: Vec<(&String, Key)> = Vec::new();
    for GridAxis { key, value } in &axes {
        let path = format!("grid.{key}");
        let own = Key::new(key).map_err(|error| error.below("grid"))?;
        // A short name and a path may be the same parameter.
        if let Some((other, _)) = known.iter().find(|(_, other)| *other == own) {
            let allowed = format!("one of the two keys; {other} is the same parameter");
            return Err(Error::invalid(path, "the same parameter twice", allowed));
        }
        known.push((key, own));
        let Value::Array(values) = value else {
            return Err(Error::invalid(path, value, "a list of values"));
        };
        if values.is_empty() || all.len().saturating_mul(values.len()) > MOST_TASKS {
            let allowed =
                format!("a list of at least one value, and at most {MOST_TASKS} combinations");
            return Err(Error::invalid(path, format!("{} values", values.len()), allowed));
        }
        let more = values.iter().map(|value| Changes::from([(key.clone(), value.clone())]));
        all = extended(&all, more);
    }
    Ok(all)
}

/// A key of a grid as a dotted path, with its value, which must be a list.
struct GridAxis {
    key: String,
    value: Value,
}

/// Every set of changes of `all` combined with each set of `more`, which varies faster and whose values win for equal
/// keys.
pub(crate) fn extended(
    all: &[Changes],
    more: impl Iterator<Item = Changes> + Clone,
) -> Vec<Changes> {
    let mut extended = Vec::new();
    for changes in all {
        extended.extend(more.clone().map(|more| changes.clone().into_iter().chain(more).collect()));
    }
    extended
}

/// Adds each value of a table to `axes`, in the order of the table, with the dotted path of its key. Inner tables are
/// entered; `path` is that of the table, empty for the outermost one.
fn flatten(table: &Table, path: &str, axes: &mut Vec<GridAxis>) {
    for (key, value) in table {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match value {
            Value::Table(inner) => flatten(inner, &path, axes),
            value => axes.push(GridAxis { key: path, value: value.clone() }),
        }
    }
}

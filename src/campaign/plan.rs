//! The plan of a campaign: the list of all its tasks, in the folder that also gets their results.
//!
//! Input is a campaign file with the fits, scenes and data that it names. Each row becomes one task per random start
//! and part of a bootstrap, with an id that is a hash of all inputs. The fit of each row is checked once. One of a
//! pattern that cannot be solved is still planned and listed as refused. One of a table is an error, and so are keys of
//! the grid that do not exist, and fits that [`Admission`] rejects. The folder gets `tasks.jsonl`, a line of JSON per
//! task, and `plan.json` with the version, the number of tasks and their digest. [`Plan::files`] returns the paths of
//! both. [`Plan::make`] writes both; results in the folder stay. A folder without `plan.json` that has other files is
//! an error. [`Plan::open`] rejects a changed list or a plan of another version. [`Plan::open_results`] accepts other
//! versions, to collect results. `Plan::from_lines` makes a plan from the text of `tasks.jsonl`. [`Plan::size`] is the
//! number of tasks of a campaign file, whose fits it does not read.
//!
//! [`CampaignTask`] is a fit file with changes of its keys and an id; [`Planned`] is a new plan with the fits that were
//! refused.

use crate::campaign::changes::{Changes, can_be_planned};
use crate::campaign::form::{CampaignFile, DistributedBootstrap, MOST_TASKS, extended};
use crate::campaign::hash::hash;
use crate::campaign::resolved::{DataHashes, ResolvedFit, folder_of};
use crate::campaign::row::CampaignRow;
use crate::campaign::starts::{bootstrap_seed, start, start_ranges};
use crate::error::Error;
use crate::fit::FitFile;
use crate::input::part_file::PartFile;
use crate::scene::Scene;
use marker_files::file::text;
use marker_files::printable::with_tokens_cut;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Component, Path, PathBuf};
use toml::Value;

/// Name of the file with the description of a plan: version, folder of the campaign, number and digest of tasks (JSON).
const DESCRIPTION_FILE: &str = "plan.json";
/// Name of the file with the tasks of a plan, one line of JSON each.
const TASKS_FILE: &str = "tasks.jsonl";

/// A planned fit: a fit file with changes of its keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CampaignTask {
    /// The first 128 bits of a hash of everything that the result depends on, in hexadecimal.
    pub id: String,
    /// Name in the table of the campaign.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// The fit file, relative to the folder of the campaign file.
    pub fit: PathBuf,
    /// Changed keys of the fit file and its scenes.
    #[serde(default, skip_serializing_if = "Changes::is_empty")]
    pub changes: Changes,
}

/// A folder with tasks and their results.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Plan {
    /// The folder of the plan.
    pub folder: PathBuf,
    /// The folder of the campaign file, which paths are relative to.
    pub root: PathBuf,
    /// All tasks in the order of the campaign file. Tasks with one id are computed once.
    pub tasks: Vec<CampaignTask>,
}

/// Checks of scenes and fits before they are planned, as of their cost in memory and time.
pub struct Admission<'a> {
    /// Accepts or rejects every scene before its mesh is made.
    pub scene: &'a (dyn Fn(&Scene) -> Result<(), Error> + Sync),
    /// Accepts or rejects every fit with the path of its file.
    pub fit: &'a (dyn Fn(&FitFile, &Path) -> Result<(), Error> + Sync),
}

/// A new plan, with the fits that are known to fail.
#[non_exhaustive]
pub struct Planned {
    /// The plan.
    pub plan: Plan,
    /// Errors of fits that cannot be solved: the error will be the result of the task.
    pub refused: Vec<Error>,
}

/// The description of a plan in its folder.
#[derive(Serialize, Deserialize)]
struct PlanDescription {
    /// Version of the program that made the plan.
    version: String,
    /// The folder of the campaign file, relative to that of the plan.
    root: PathBuf,
    /// Number of tasks.
    tasks: usize,
    /// The first 128 bits of the SHA-256 of the file of tasks, in hexadecimal.
    digest: String,
}

/// Bytes of the digest of the file of tasks, 128 bits: enough to detect any change.
const DIGEST_BYTES: usize = 16;

/// The schema of campaign files.
#[cfg(test)]
impl schemars::JsonSchema for Plan {
    /// Name of the JSON schema of campaign files, `Campaign`.
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Campaign".into()
    }

    /// JSON schema of campaign files, that of [`CampaignFile`].
    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        CampaignFile::json_schema(generator)
    }
}

impl Plan {
    /// Reads a campaign file and all files that it names, and writes `tasks.jsonl` and `plan.json` into a folder, which
    /// is created if it is missing. Existing files of a plan are replaced; results in the folder are kept, and belong
    /// to tasks with unchanged ids. Fits of patterns that cannot be solved are planned, and their errors are returned
    /// as `refused`.
    ///
    /// # Errors
    ///
    /// An invalid campaign file or table, with its line; files that cannot be read; a fit of a table that cannot be
    /// solved; a fit that `admission` rejects; too many tasks; and a folder with other files.
    pub fn make(file: &Path, folder: &Path, admission: &Admission) -> Result<Planned, Error> {
        let campaign = CampaignFile::read(file)?;
        let root = folder_of(file);
        let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
        let root = &root.canonicalize().map_err(|error| Error::io(root, error))?;
        let file = &root.join(file.file_name().unwrap_or_default());
        check_folder(folder)?;
        let rows = campaign.rows(file)?;
        check_task_count(campaign.task_count(rows.len()), file)?;
        // Rows are independent and run in parallel. Each thread hashes the data of its rows once.
        let row_tasks: Vec<Result<RowTasks, Error>> = rows
            .par_iter()
            .map_init(DataHashes::new, |hashes, row| {
                let tasks = row_tasks(root, row, &campaign, hashes, admission);
                tasks.map_err(|error| error.in_file(Some(file)))
            })
            .collect();
        let (mut tasks, mut refused) = (Vec::new(), Vec::new());
        for row in row_tasks {
            let row = row?;
            tasks.extend(row.tasks);
            refused.extend(row.refused);
        }
        let failed = |error| Error::io(folder, error);
        std::fs::create_dir_all(folder).map_err(failed)?;
        let whole = folder.canonicalize().map_err(failed)?;
        // The tasks come first: a plan without its description is not opened.
        let lines = json_lines(&tasks).map_err(failed)?;
        let description = PlanDescription {
            version: env!("CARGO_PKG_VERSION").into(),
            root: relative_path(&whole, root),
            tasks: tasks.len(),
            digest: hash(&lines, DIGEST_BYTES),
        };
        write(folder, TASKS_FILE, &lines)?;
        write(folder, DESCRIPTION_FILE, &json_lines(&[description]).map_err(failed)?)?;
        let plan = Self { folder: folder.into(), root: root.clone(), tasks };
        Ok(Planned { plan, refused })
    }

    /// Number of tasks of a campaign file, by its patterns, table, grid, random starts and bootstrap. The fits are not
    /// read.
    ///
    /// # Errors
    ///
    /// An invalid campaign file or table, and more tasks than a plan may have.
    pub fn size(file: &Path) -> Result<usize, Error> {
        let campaign = CampaignFile::read(file)?;
        let tasks = campaign.task_count(campaign.rows(file)?.len());
        check_task_count(tasks, file).map(|()| tasks)
    }

    /// The plan with these lines of tasks, JSON as in `tasks.jsonl`. Nothing is read from the folders, and no digest is
    /// checked.
    ///
    /// # Errors
    ///
    /// A line that is no task.
    pub fn from_lines(folder: &Path, root: &Path, lines: &str) -> Result<Self, Error> {
        let file = folder.join(TASKS_FILE);
        let tasks = lines.lines().zip(1..).map(|(line, number)| parse(&file, line, number));
        let tasks = tasks.collect::<Result<_, _>>()?;
        Ok(Self { folder: folder.into(), root: root.into(), tasks })
    }

    /// Paths of the two files that a plan consists of, `plan.json` and `tasks.jsonl` in its folder.
    pub fn files(&self) -> Vec<PathBuf> {
        [DESCRIPTION_FILE, TASKS_FILE].map(|name| self.folder.join(name)).to_vec()
    }

    /// Reads the plan in a folder, for a run of its tasks.
    ///
    /// # Errors
    ///
    /// A folder without a plan, with a plan by another version of the program, or with other tasks than the planned
    /// ones.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        let description = read_description(folder)?;
        let version = env!("CARGO_PKG_VERSION");
        if description.version != version {
            let found = format!("a plan by version {}", description.version);
            let allowed =
                format!("one by this version, {version}; run `rodfit campaign plan` again");
            let file = folder.join(DESCRIPTION_FILE);
            return Err(Error::invalid("version", found, allowed).in_file(Some(&file)));
        }
        Self::described(folder, description)
    }

    /// Reads the plan in a folder for its results only. The plan may be one by another version, whose open tasks this
    /// version cannot run.
    ///
    /// # Errors
    ///
    /// A folder without a plan, or with other tasks than the planned ones.
    pub fn open_results(folder: &Path) -> Result<Self, Error> {
        Self::described(folder, read_description(folder)?)
    }

    /// The plan with a description, from the file of tasks in its folder. Error: that file or the folder of the
    /// campaign cannot be read, or the number or the digest of the tasks differs.
    fn described(folder: &Path, description: PlanDescription) -> Result<Self, Error> {
        let PlanDescription { root, tasks: planned, digest, .. } = description;
        let root = folder.join(root);
        let root = root.canonicalize().map_err(|error| Error::io(&root, error))?;
        let file = folder.join(TASKS_FILE);
        let tasks = text(&file)?;
        let found = tasks.lines().count();
        if found != planned || hash(tasks.as_bytes(), DIGEST_BYTES) != digest {
            let found = format!("{found} lines that differ from the planned ones");
            let allowed = format!("the {planned} planned lines; run `rodfit campaign plan` again");
            return Err(Error::invalid("tasks", found, allowed).in_file(Some(&file)));
        }
        Self::from_lines(folder, &root, &tasks)
    }
}

/// The tasks of a row, and the error of its fit if it cannot be solved.
struct RowTasks {
    tasks: Vec<CampaignTask>,
    refused: Option<Error>,
}

/// The tasks of a row: one for each combination of its random starts (slower) and of the parts of its bootstrap. `root`
/// is the folder of the campaign file; `hashes` has those of data files read so far, and gets new ones. A fit of a
/// pattern that cannot be solved is returned as `refused`. Errors: a value that cannot be planned, unreadable files,
/// and a fit that `admission` rejects. Further ones are an invalid fit of a table, an unknown key of a grid, and random
/// starts without bounds.
fn row_tasks(
    root: &Path,
    row: &CampaignRow,
    campaign: &CampaignFile,
    hashes: &mut DataHashes,
    admission: &Admission,
) -> Result<RowTasks, Error> {
    let located = |error: Error| row.locate(error);
    if let Some((key, value)) = row.changes.iter().find(|(_, value)| !can_be_planned(value)) {
        let allowed = "finite numbers, texts, true, false, and lists and tables of these";
        return Err(located(Error::invalid(key, value, allowed)));
    }
    // The id of the row without starts and bootstrap seeds their random numbers.
    let resolved = ResolvedFit::new(root, &row.fit, &row.changes).map_err(located)?;
    let base = resolved.id(hashes).map_err(located)?;
    // A fit above a limit is an error of the plan, as another run may admit it; other errors are results.
    let too_large = std::cell::RefCell::new(None);
    let admit = |scene: &Scene| {
        (admission.scene)(scene).map_err(|error| {
            let text = error.to_string();
            *too_large.borrow_mut() = Some(error);
            Error::Fit(text)
        })
    };
    let refused = match resolved.fit(admit) {
        Ok(fit) => {
            (admission.fit)(&fit, &resolved.file).map_err(located)?;
            None
        }
        Err(error) => match too_large.into_inner() {
            Some(error) => return Err(located(error)),
            // A row of a table is explicit, and its error a mistake; a pattern may match fits that cannot be solved.
            None if row.source.is_some() => return Err(located(error)),
            None => match unknown_grid_key(root, row, &error) {
                Some(error) => return Err(error),
                None => Some(error),
            },
        },
    };
    // Starts and bootstrap parts multiply the tasks of the row.
    let mut all = vec![row.changes.clone()];
    if let Some(starts) = campaign.starts {
        let ranges = start_ranges(&resolved).map_err(located)?;
        let starts = (0..starts.count).map(|k| start(&ranges, &base, starts.seed, k));
        all = extended(&all, starts);
    }
    if let Some(bootstrap) = campaign.bootstrap {
        let seed = bootstrap_seed(&base, bootstrap.seed);
        all = extended(&all, bootstrap_parts(bootstrap, seed));
    }
    let task = |changes: Changes| {
        // The row itself has its id already.
        let id = match changes == row.changes {
            true => base.clone(),
            false => ResolvedFit::new(root, &row.fit, &changes)
                .and_then(|r| r.id(hashes))
                .map_err(located)?,
        };
        Ok(CampaignTask { id, name: row.name.clone(), fit: row.fit.clone(), changes })
    };
    Ok(RowTasks { tasks: all.into_iter().map(task).collect::<Result<_, Error>>()?, refused })
}

/// The error of a grid with keys that fit files and scenes do not have: `error` is one of parsing, and the fit is valid
/// without its changes. None otherwise, and for a row without changes; `error` is then the result of the fit.
fn unknown_grid_key(root: &Path, row: &CampaignRow, error: &Error) -> Option<Error> {
    if row.changes.is_empty() || !matches!(error, Error::Parse { .. }) {
        return None;
    }
    let without = ResolvedFit::new(root, &row.fit, &Changes::new()).ok()?;
    let is_valid = without.fit(|_| Ok(())).is_ok();
    let keys: Vec<&str> = row.changes.keys().map(String::as_str).collect();
    let allowed = "keys that the fit file or its scene may have";
    is_valid.then(|| Error::invalid("grid", format!("{} ({error})", keys.join(", ")), allowed))
}

/// The changes of each part of a bootstrap: its number of replicates (`analysis.bootstrap`), the index of its first one
/// from 0 (`analysis.bootstrap_first`), and the common `seed`. Part `k` of `n` has the replicates from `k N/n` to below
/// `(k + 1) N/n`, rounded down. All parts together run the replicates of one fit, in nearly equal numbers.
fn bootstrap_parts(
    bootstrap: DistributedBootstrap,
    seed: i64,
) -> impl Iterator<Item = Changes> + Clone {
    let replicates = bootstrap.replicates;
    let parts = bootstrap.parts();
    (0..parts).map(move |k| {
        // Part k ends where part k + 1 begins, so that no replicate is left out or run twice.
        let (first, next) = (k * replicates / parts, (k + 1) * replicates / parts);
        let change = |key: &str, number: i64| (format!("analysis.{key}"), Value::Integer(number));
        Changes::from([
            change("bootstrap", (next - first) as i64),
            change("bootstrap_first", first as i64),
            change("seed", seed),
        ])
    })
}

/// Rejects more than [`MOST_TASKS`] tasks, with an error that names the campaign `file`.
fn check_task_count(tasks: usize, file: &Path) -> Result<(), Error> {
    match tasks <= MOST_TASKS {
        true => Ok(()),
        false => {
            let allowed = format!("up to {MOST_TASKS}");
            Err(Error::invalid("tasks", tasks, allowed).in_file(Some(file)))
        }
    }
}

/// Rejects a folder with files other than those of a plan or temporary ones of a killed process. A missing, unreadable
/// or empty folder is accepted, and one with `plan.json` whatever else it has. The error has the key `--out`.
fn check_folder(folder: &Path) -> Result<(), Error> {
    let Ok(mut entries) = std::fs::read_dir(folder) else { return Ok(()) };
    let is_of_plan =
        |name: &str| [DESCRIPTION_FILE, TASKS_FILE].iter().any(|own| name.starts_with(own));
    let is_own = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.is_ok_and(|entry| is_of_plan(&entry.file_name().to_string_lossy()))
    };
    match folder.join(DESCRIPTION_FILE).is_file() || entries.all(is_own) {
        true => Ok(()),
        false => {
            let found = format!("{}, a folder with other files", folder.display());
            Err(Error::invalid("--out", found, "a new folder, or the folder of a campaign"))
        }
    }
}

/// Reads `plan.json` in a folder. Error: it is missing, or not valid.
fn read_description(folder: &Path) -> Result<PlanDescription, Error> {
    let file = folder.join(DESCRIPTION_FILE);
    parse(&file, &text(&file)?, 1)
}

/// A value from `text`, line number `line` of the JSON file at `path`. Error: no such value, with file and line.
fn parse<T: serde::de::DeserializeOwned>(path: &Path, text: &str, line: u64) -> Result<T, Error> {
    serde_json::from_str(text).map_err(|error| {
        let error = error.to_string();
        let found = with_tokens_cut(&error, '"');
        let message = format!("found {found}, allowed: a line that `rodfit campaign plan` wrote");
        Error::Data { path: path.into(), line, message }
    })
}

/// The values as JSON, one line each, in UTF-8, with a line break after the last one. Error: a value that JSON cannot
/// represent.
fn json_lines<T: Serialize>(values: &[T]) -> std::io::Result<Vec<u8>> {
    let mut lines = Vec::new();
    for value in values {
        serde_json::to_writer(&mut lines, value)?;
        lines.push(b'\n');
    }
    Ok(lines)
}

/// Writes `bytes` to the file `name` in a folder, under a temporary name first, so that its own never stands for a part
/// of it. It is synced to the disk, readable by all users, and replaces an older file. Error: a failed write, with the
/// path.
fn write(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), Error> {
    let path = folder.join(name);
    let written = PartFile::beside(&path).and_then(|mut file| {
        file.write_all(bytes)?;
        #[cfg(unix)]
        {
            // Other users may run the plan.
            use std::os::unix::fs::PermissionsExt;
            file.file().set_permissions(std::fs::Permissions::from_mode(0o644))?;
        }
        file.file().sync_all()?;
        file.persist(&path).map_err(|(error, _)| error)
    });
    written.map_err(|error| Error::io(&path, error))
}

/// The relative path from one absolute folder to another, so that both can be moved together; `to` itself if they have
/// no common part, as on different drives.
fn relative_path(from: &Path, to: &Path) -> PathBuf {
    let (from, to): (Vec<Component>, Vec<Component>) =
        (from.components().collect(), to.components().collect());
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if common == 0 {
        // On another drive there is no relative path.
        return to.iter().collect();
    }
    let up = std::iter::repeat_n(Component::ParentDir, from.len() - common);
    up.chain(to[common..].iter().copied()).collect()
}

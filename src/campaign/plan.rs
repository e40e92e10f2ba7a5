//! The plan of a campaign: a folder with all its tasks.

use crate::campaign::changes::Changes;
use crate::campaign::form::{Bootstrap, Form, MOST_TASKS};
use crate::campaign::resolved::{Hashes, Resolved, folder_of};
use crate::campaign::row::Row;
use crate::campaign::starts;
use crate::error::Error;
use crate::fit::FitFile;
use crate::input::file::text;
use crate::scene::Scene;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Component, Path, PathBuf};
use toml::Value;

/// The plan's files in its folder.
const ABOUT: &str = "plan.json";
const TASKS: &str = "tasks.jsonl";

/// A fit to be done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Task {
    /// The first 128 bits of a hash of everything that the result depends on, in hexadecimal.
    pub id: String,
    /// What the table calls it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// The fit file, relative to the folder of the campaign file.
    pub fit: PathBuf,
    /// What is changed of it.
    #[serde(default, skip_serializing_if = "Changes::is_empty")]
    pub changes: Changes,
}

/// A folder with tasks and their results.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Plan {
    /// The folder itself.
    pub folder: PathBuf,
    /// The folder of the campaign file, which paths are relative to.
    pub root: PathBuf,
    /// In the order of the campaign file. Two may have one id: they are one to be computed.
    pub tasks: Vec<Task>,
}

/// What is looked at before it is planned.
pub struct Admission<'a> {
    /// Sees every scene before its mesh is made.
    pub scene: &'a (dyn Fn(&Scene) -> Result<(), Error> + Sync),
    /// Sees every fit with the path of its file.
    pub fit: &'a (dyn Fn(&FitFile, &Path) -> Result<(), Error> + Sync),
}

/// A plan that was just made.
#[non_exhaustive]
pub struct Planned {
    /// The plan.
    pub plan: Plan,
    /// Fits that cannot be solved as they stand: what is wrong with them will be their result.
    pub refused: Vec<Error>,
}

#[derive(Serialize, Deserialize)]
struct About {
    version: String,
    root: PathBuf,
}

/// What a campaign file may say.
#[cfg(test)]
impl schemars::JsonSchema for Plan {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Campaign".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        Form::json_schema(generator)
    }
}

impl Plan {
    /// Reads a campaign file and everything it names, and writes the plan into a folder. What has a result there already
    /// keeps it.
    ///
    /// # Errors
    ///
    /// A campaign file or a table that is not right, with its line; files that cannot be read; a fit of a table that cannot
    /// be solved; what `admission` refuses; and a folder that is in use for something else.
    pub fn make(file: &Path, folder: &Path, admission: &Admission) -> Result<Planned, Error> {
        let form = Form::read(file)?;
        let root = folder_of(file);
        let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
        let root = &root.canonicalize().map_err(|error| Error::io(root, error))?;
        let file = &root.join(file.file_name().unwrap_or_default());
        refuse_foreign(folder)?;
        let rows = form.rows(file)?;
        // Every row by itself, in parallel; hashes of data that rows share are found by each thread.
        let shared: Vec<Result<Shared, Error>> = rows
            .par_iter()
            .map_init(Hashes::new, |hashes, row| share_out(root, row, &form, hashes, admission))
            .collect();
        let (mut tasks, mut refused) = (Vec::new(), Vec::new());
        for shared in shared {
            let shared = shared?;
            tasks.extend(shared.tasks);
            refused.extend(shared.refused);
            if tasks.len() > MOST_TASKS {
                let allowed = format!("up to {MOST_TASKS} tasks");
                return Err(Error::invalid("campaign", "more", allowed).in_file(Some(file)));
            }
        }
        std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
        let whole = folder.canonicalize().map_err(|error| Error::io(folder, error))?;
        let about =
            About { version: env!("CARGO_PKG_VERSION").into(), root: relative(&whole, root) };
        write(folder, ABOUT, std::iter::once(&about))?;
        write(folder, TASKS, tasks.iter())?;
        let plan = Self { folder: folder.into(), root: root.clone(), tasks };
        Ok(Planned { plan, refused })
    }

    /// The files of the plan itself.
    pub fn files(&self) -> Vec<PathBuf> {
        [ABOUT, TASKS].map(|name| self.folder.join(name)).to_vec()
    }

    /// Reads the plan in a folder.
    ///
    /// # Errors
    ///
    /// A folder without one, or with one that another version of the program made.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        let file = folder.join(ABOUT);
        let about: About = parse(&file, &text(&file)?, 1)?;
        if about.version != env!("CARGO_PKG_VERSION") {
            let found = format!("a plan by version {}", about.version);
            let allowed = format!("one by this version, {}; plan again", env!("CARGO_PKG_VERSION"));
            return Err(Error::invalid("version", found, allowed).in_file(Some(&file)));
        }
        let root = folder.join(about.root);
        let root = root.canonicalize().map_err(|error| Error::io(&root, error))?;
        let file = folder.join(TASKS);
        let tasks = text(&file)?;
        let tasks = tasks.lines().zip(1..).map(|(line, number)| parse(&file, line, number));
        Ok(Self { folder: folder.into(), root, tasks: tasks.collect::<Result<_, _>>()? })
    }
}

/// A row's tasks, and why it cannot be solved, if so.
struct Shared {
    tasks: Vec<Task>,
    refused: Option<Error>,
}

/// The tasks of a row: itself, its starts, the batches of its bootstrap.
fn share_out(
    root: &Path,
    row: &Row,
    form: &Form,
    hashes: &mut Hashes,
    admission: &Admission,
) -> Result<Shared, Error> {
    let located = |error: Error| row.located(error);
    let resolved = Resolved::new(root, &row.fit, &row.changes).map_err(located)?;
    let base = resolved.id(hashes).map_err(located)?;
    // What is refused as too large is not refused for good.
    let too_large = std::cell::RefCell::new(None);
    let admit = |scene: &Scene| {
        (admission.scene)(scene).map_err(|error| {
            let words = error.to_string();
            *too_large.borrow_mut() = Some(error);
            Error::Fit(words)
        })
    };
    let refused = match resolved.fit(admit) {
        Ok(fit) => {
            (admission.fit)(&fit, &resolved.file).map_err(located)?;
            None
        }
        Err(error) => match too_large.into_inner() {
            Some(error) => return Err(located(error)),
            None if row.from.is_some() => return Err(located(error)),
            None => Some(error),
        },
    };
    let mut all = vec![row.changes.clone()];
    if let Some(starts) = form.starts {
        let ranges = starts::ranges(&resolved).map_err(located)?;
        let from = |number| starts::start(&ranges, &base, starts.seed, number);
        all = extended(all, (0..starts.count).map(from));
    }
    if let Some(bootstrap) = form.bootstrap {
        all = extended(all, batches(bootstrap, starts::seed(&base, bootstrap.seed)));
    }
    let task = |changes: Changes| {
        let id = match changes == row.changes {
            true => base.clone(),
            false => Resolved::new(root, &row.fit, &changes)
                .and_then(|r| r.id(hashes))
                .map_err(located)?,
        };
        Ok(Task { id, name: row.name.clone(), fit: row.fit.clone(), changes })
    };
    Ok(Shared { tasks: all.into_iter().map(task).collect::<Result<_, Error>>()?, refused })
}

/// Every set of changes with each of `more`.
fn extended(all: Vec<Changes>, more: impl Iterator<Item = Changes> + Clone) -> Vec<Changes> {
    let with = |changes: &Changes| {
        let changes = changes.clone();
        more.clone()
            .map(move |more| changes.clone().into_iter().chain(more).collect())
            .collect::<Vec<_>>()
    };
    all.iter().flat_map(with).collect()
}

/// The parts of a bootstrap: together the replicates that one fit with this seed would run.
fn batches(bootstrap: Bootstrap, seed: i64) -> impl Iterator<Item = Changes> + Clone {
    let Bootstrap { replicates, batch, .. } = bootstrap;
    let parts = (replicates / batch).max(1);
    (0..parts).map(move |k| {
        let (first, next) = (k * replicates / parts, (k + 1) * replicates / parts);
        let of = |key: &str, number: i64| (format!("analysis.{key}"), Value::Integer(number));
        Changes::from([
            of("bootstrap", (next - first) as i64),
            of("bootstrap_first", first as i64),
            of("seed", seed),
        ])
    })
}

/// Refuses a folder that holds something else.
fn refuse_foreign(folder: &Path) -> Result<(), Error> {
    let Ok(mut entries) = std::fs::read_dir(folder) else { return Ok(()) };
    match entries.next().is_none() || folder.join(ABOUT).is_file() {
        true => Ok(()),
        false => {
            let found = format!("{}, which has other files in it", folder.display());
            Err(Error::invalid("--out", found, "a new folder, or that of a campaign"))
        }
    }
}

fn parse<T: serde::de::DeserializeOwned>(path: &Path, text: &str, line: u64) -> Result<T, Error> {
    serde_json::from_str(text).map_err(|error| {
        let message = format!("found {error}, allowed: what `rodfit campaign plan` wrote");
        Error::Data { path: path.into(), line, message }
    })
}

/// Writes a file of lines under another name first, so that its own never stands for half of it.
fn write<T: Serialize>(
    folder: &Path,
    name: &str,
    lines: impl Iterator<Item = T>,
) -> Result<(), Error> {
    let path = folder.join(name);
    let written = tempfile::NamedTempFile::new_in(folder).and_then(|mut file| {
        let mut to = std::io::BufWriter::new(&mut file);
        for line in lines {
            to.write_all(&serde_json::to_vec(&line)?)?;
            to.write_all(b"\n")?;
        }
        to.flush()?;
        drop(to);
        #[cfg(unix)]
        {
            // Others of the group may run the plan.
            use std::os::unix::fs::PermissionsExt;
            file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644))?;
        }
        file.as_file().sync_all()?;
        file.persist(&path).map(drop).map_err(|error| error.error)
    });
    written.map_err(|error| Error::io(&path, error))
}

/// A folder as seen from another, so that both can be moved together. Both are absolute.
fn relative(from: &Path, to: &Path) -> PathBuf {
    let (from, to): (Vec<Component>, Vec<Component>) =
        (from.components().collect(), to.components().collect());
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if common == 0 {
        // Another drive.
        return to.iter().collect();
    }
    let up = std::iter::repeat_n(Component::ParentDir, from.len() - common);
    up.chain(to[common..].iter().copied()).collect()
}

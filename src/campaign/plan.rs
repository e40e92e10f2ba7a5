//! The plan of a campaign: a folder with all its tasks.

use crate::campaign::changes::{Changes, can_be_planned};
use crate::campaign::form::{Bootstrap, Form, MOST_TASKS};
use crate::campaign::hash::hash;
use crate::campaign::resolved::{Hashes, Resolved, folder_of};
use crate::campaign::row::Row;
use crate::campaign::starts;
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
    /// How many tasks there are.
    tasks: usize,
    /// The first 128 bits of the SHA-256 of the bytes of the file of tasks, in hexadecimal.
    digest: String,
}

impl About {
    fn read(file: &Path) -> Result<Self, Error> {
        parse(file, &text(file)?, 1)
    }
}

/// Bytes of the digest.
const DIGEST: usize = 16;

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
        refuse_too_many(form.tasks_of(rows.len()), file)?;
        // Every row by itself, in parallel; hashes of data that rows share are found by each thread.
        let shared: Vec<Result<Shared, Error>> = rows
            .par_iter()
            .map_init(Hashes::new, |hashes, row| {
                share_out(root, row, &form, hashes, admission)
                    .map_err(|error| error.in_file(Some(file)))
            })
            .collect();
        let (mut tasks, mut refused) = (Vec::new(), Vec::new());
        for shared in shared {
            let shared = shared?;
            tasks.extend(shared.tasks);
            refused.extend(shared.refused);
        }
        std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
        let whole = folder.canonicalize().map_err(|error| Error::io(folder, error))?;
        let lines = lines(tasks.iter()).map_err(|error| Error::io(folder, error))?;
        let about = About {
            version: env!("CARGO_PKG_VERSION").into(),
            root: relative(&whole, root),
            tasks: tasks.len(),
            digest: hash(&lines, DIGEST),
        };
        let about =
            self::lines(std::iter::once(&about)).map_err(|error| Error::io(folder, error))?;
        write(folder, TASKS, &lines)?;
        write(folder, ABOUT, &about)?;
        let plan = Self { folder: folder.into(), root: root.clone(), tasks };
        Ok(Planned { plan, refused })
    }

    /// How many tasks a campaign file makes. The fits are not read.
    ///
    /// # Errors
    ///
    /// A campaign file or a table that is not right, and more tasks than a plan may have.
    pub fn size(file: &Path) -> Result<usize, Error> {
        let form = Form::read(file)?;
        let tasks = form.tasks_of(form.rows(file)?.len());
        refuse_too_many(tasks, file).map(|()| tasks)
    }

    /// The plan with the lines of its file of tasks, whatever its digest.
    ///
    /// # Errors
    ///
    /// A line that is no task.
    pub fn of_lines(folder: &Path, root: &Path, lines: &str) -> Result<Self, Error> {
        let file = folder.join(TASKS);
        let tasks = lines.lines().zip(1..).map(|(line, number)| parse(&file, line, number));
        let tasks = tasks.collect::<Result<_, _>>()?;
        Ok(Self { folder: folder.into(), root: root.into(), tasks })
    }

    /// The files of the plan itself.
    pub fn files(&self) -> Vec<PathBuf> {
        [ABOUT, TASKS].map(|name| self.folder.join(name)).to_vec()
    }

    /// Reads the plan in a folder.
    ///
    /// # Errors
    ///
    /// A folder without one, or with one that another version of the program made, or whose tasks are not those that were
    /// planned.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        let file = folder.join(ABOUT);
        let about = About::read(&file)?;
        if about.version != env!("CARGO_PKG_VERSION") {
            let found = format!("a plan by version {}", about.version);
            let allowed = format!(
                "one by this version, {}; run `rodfit campaign plan` again",
                env!("CARGO_PKG_VERSION")
            );
            return Err(Error::invalid("version", found, allowed).in_file(Some(&file)));
        }
        Self::planned(folder, about)
    }

    /// Reads the plan in a folder for its results only: the plan may be one by another version. Its open tasks cannot be
    /// run by this version.
    ///
    /// # Errors
    ///
    /// A folder without a plan, or with tasks that are not those that were planned.
    pub fn open_results(folder: &Path) -> Result<Self, Error> {
        Self::planned(folder, About::read(&folder.join(ABOUT))?)
    }

    fn planned(folder: &Path, about: About) -> Result<Self, Error> {
        let root = folder.join(about.root);
        let root = root.canonicalize().map_err(|error| Error::io(&root, error))?;
        let file = folder.join(TASKS);
        let tasks = text(&file)?;
        let found = tasks.lines().count();
        if found != about.tasks || hash(tasks.as_bytes(), DIGEST) != about.digest {
            let found = format!("{found} lines that are not those that were planned");
            let allowed =
                format!("the {} planned lines; run `rodfit campaign plan` again", about.tasks);
            return Err(Error::invalid("tasks", found, allowed).in_file(Some(&file)));
        }
        Self::of_lines(folder, &root, &tasks)
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
    if let Some((key, value)) = row.changes.iter().find(|(_, value)| !can_be_planned(value)) {
        let allowed = "finite numbers, texts, true, false, and lists and tables of these";
        return Err(located(Error::invalid(key, value, allowed)));
    }
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
            None => match misspelt_grid_key(root, row, &error) {
                Some(error) => return Err(error),
                None => Some(error),
            },
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

/// The error of a grid whose keys a fit file and its scene cannot have, though they are right without them; what is
/// wrong with a value is the result of its fit.
fn misspelt_grid_key(root: &Path, row: &Row, error: &Error) -> Option<Error> {
    if row.changes.is_empty() || !matches!(error, Error::Parse { .. }) {
        return None;
    }
    let without = Resolved::new(root, &row.fit, &Changes::new()).ok()?;
    let is_right = without.fit(|_| Ok(())).is_ok();
    let keys: Vec<&str> = row.changes.keys().map(String::as_str).collect();
    let allowed = "keys that the fit file or its scene may have";
    is_right.then(|| Error::invalid("grid", format!("{} ({error})", keys.join(", ")), allowed))
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
    let replicates = bootstrap.replicates;
    let parts = bootstrap.parts();
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

fn refuse_too_many(tasks: usize, file: &Path) -> Result<(), Error> {
    match tasks <= MOST_TASKS {
        true => Ok(()),
        false => {
            let allowed = format!("up to {MOST_TASKS}");
            Err(Error::invalid("tasks", tasks, allowed).in_file(Some(file)))
        }
    }
}

/// Refuses a folder that holds something else than a plan, or what a plan that was killed has left.
fn refuse_foreign(folder: &Path) -> Result<(), Error> {
    let Ok(mut entries) = std::fs::read_dir(folder) else { return Ok(()) };
    let is_of_plan = |name: &str| [ABOUT, TASKS].iter().any(|own| name.starts_with(own));
    let is_own = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.is_ok_and(|entry| is_of_plan(&entry.file_name().to_string_lossy()))
    };
    match folder.join(ABOUT).is_file() || entries.all(is_own) {
        true => Ok(()),
        false => {
            let found = format!("{}, which has other files in it", folder.display());
            Err(Error::invalid("--out", found, "a new folder, or that of a campaign"))
        }
    }
}

fn parse<T: serde::de::DeserializeOwned>(path: &Path, text: &str, line: u64) -> Result<T, Error> {
    serde_json::from_str(text).map_err(|error| {
        let error = error.to_string();
        let found = with_tokens_cut(&error, '"');
        let message = format!("found {found}, allowed: what `rodfit campaign plan` wrote");
        Error::Data { path: path.into(), line, message }
    })
}

/// A line of JSON for each.
fn lines<T: Serialize>(each: impl Iterator<Item = T>) -> std::io::Result<Vec<u8>> {
    let mut lines = Vec::new();
    for one in each {
        serde_json::to_writer(&mut lines, &one)?;
        lines.push(b'\n');
    }
    Ok(lines)
}

/// Writes a file under another name first, so that its own never stands for half of it.
fn write(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), Error> {
    let path = folder.join(name);
    let written = PartFile::beside(&path).and_then(|mut file| {
        file.write_all(bytes)?;
        #[cfg(unix)]
        {
            // Others of the group may run the plan.
            use std::os::unix::fs::PermissionsExt;
            file.file().set_permissions(std::fs::Permissions::from_mode(0o644))?;
        }
        file.file().sync_all()?;
        file.persist(&path).map_err(|(error, _)| error)
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

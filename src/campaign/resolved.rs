//! A task with everything that its result depends on: the fit file as one TOML table, with changes applied, the
//! contents of scene files in the places of their names, and absolute paths of data.
//!
//! Input: a fit file and its changes, applied in the order fit file, all scenes, scene of one experiment.
//! [`ResolvedFit::new`] makes this table. From it come the fit to solve ([`ResolvedFit::fit`]) and the id of the task
//! ([`ResolvedFit::id`]). The id is the first 128 bits, in hexadecimal, of a hash of the program's version, all keys,
//! and the contents of all data files. Paths do not count, except for the stems of recordings, which name experiments.
//! Equal inputs have equal ids, wherever the files are. Errors are unreadable files, unknown names of keys, items of
//! lists or experiments that do not exist, and a change of the scene of an experiment that has none of its own; missing
//! keys are created. [`ResolvedFit::path_names`] are the paths that results must not contain, with names of keys in
//! their place. [`read_toml`] reads a TOML file, and [`folder_of`] returns the folder of a path.

use crate::campaign::changes::{Changes, Key, is_file_key, set_value};
use crate::campaign::hash::hash;
use crate::error::Error;
use crate::fit::FitFile;
use crate::input::missing_keys::parse;
use crate::scene::Scene;
use marker_files::file::{at, data, text};
use serde_json::{Value as Json, json};
use std::cmp::Reverse;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Bytes of a task's id: 128 bits, with which a collision among all campaigns is practically impossible.
const ID_BYTES: usize = 16;
/// Bytes of the hash of a data file, the whole SHA-256.
const DATA_HASH_BYTES: usize = 32;

/// A fit file after all changes, with its scenes in it and the paths of its data absolute.
pub(crate) struct ResolvedFit {
    /// Path of the fit file.
    pub file: PathBuf,
    /// Content of the fit file after the changes.
    pub table: Table,
}

/// Hashes of data files by their paths, so that a plan reads each file once.
pub(crate) type DataHashes = HashMap<PathBuf, String>;

/// A path in a fit with the name of its key, as `observation.0.file`, which replaces the path in results.
pub(crate) struct PathName {
    pub path: String,
    pub name: String,
}

/// The table of a scene of an experiment, or of the whole fit.
struct FitScene<'a> {
    /// Index of the experiment; `None` for the scene of the whole fit.
    experiment: Option<usize>,
    /// Value of the key `name` of the experiment; empty without it, and for the whole fit.
    name: String,
    table: &'a mut Table,
}

impl ResolvedFit {
    /// The fit file `fit` as one table with changes, and with the contents of scene files in the places of their names.
    /// Its path and file names in the changes are relative to `root`; those in files are relative to the folder of
    /// their file; all become absolute. Changes apply in the order fit file, all scenes, own scene of one experiment
    /// (the first with the stated `name`, else that with the stated index); missing keys are created. Errors:
    /// unreadable fit or scene files; keys that start with no table of fits or scenes; items of lists that do not
    /// exist; and experiments that do not exist or have no scene of their own.
    pub fn new(root: &Path, fit: &Path, changes: &Changes) -> Result<Self, Error> {
        let file = root.join(fit);
        let folder = folder_of(&file).to_path_buf();
        let mut table = read_toml(&file)?;
        let mut keys: Vec<(&str, Key, Value)> = Vec::new();
        for (name, value) in changes {
            let key = Key::new(name)?;
            let is_file = key.names_a_file();
            keys.push((
                name.as_str(),
                key,
                if is_file { absolute(value, root) } else { value.clone() },
            ));
        }
        // Keys of the fit file come first: they may name other scenes.
        for (_, key, value) in &keys {
            if let Key::Fit(path) = key {
                set_value(&mut table, path, value)?;
            }
        }
        let mut scenes = fit_scenes(&mut table, &folder)?;
        // Keys of all scenes come before those of one experiment, which take precedence.
        for (_, key, value) in &keys {
            if let Key::Scenes(path) = key {
                scenes.iter_mut().try_for_each(|scene| set_value(scene.table, path, value))?;
            }
        }
        for (name, key, value) in &keys {
            let Key::Scene(experiment, path) = key else { continue };
            // A name may be a number: names come before indices.
            let number: Option<usize> = experiment.parse().ok();
            let is_numbered = |scene: &FitScene| number.is_some() && scene.experiment == number;
            let named = scenes.iter().position(|scene| scene.name == *experiment);
            let index = named.or_else(|| scenes.iter().position(is_numbered)).ok_or_else(|| {
                let found = format!("\"{experiment}\", no experiment with a scene of its own");
                let allowed =
                    "the index, from 0, or the name of an [[experiment]] with the key scene";
                Error::invalid(*name, found, allowed)
            })?;
            set_value(scenes[index].table, path, value)?;
        }
        without_images(&mut table);
        // Paths in changes and scenes are absolute already; those of the fit file remain.
        make_absolute(&mut table, &folder);
        Ok(Self { file, table })
    }

    /// The first 128 bits of the hash (SHA-256) of everything that the result depends on, in hexadecimal: the program's
    /// version, the fit, its scenes, and the contents of its data. Paths do not count, except for the stems of
    /// recordings (`path`, `paths`), which name experiments. The order of keys has no effect. `hashes` has those of
    /// data files read before, and gets new ones. Error: a data file that cannot be read.
    pub fn id(&self, hashes: &mut DataHashes) -> Result<String, Error> {
        let mut table = self.table.clone();
        let mut failure = None;
        for_each_file(&mut table, "", &mut |key, path| {
            let file = PathBuf::from(&*path);
            match data_hash(&file, hashes) {
                Ok(hash) => {
                    // An experiment without a name is called after the file of its recording.
                    let last = key.rsplit('.').find(|part| part.parse::<usize>().is_err());
                    let stem = if last == Some("file") { None } else { file.file_stem() };
                    *path = format!("sha256 {hash} {}", stem.unwrap_or_default().display());
                }
                Err(error) => failure = failure.take().or(Some(error)),
            }
        });
        // Equal fits have equal texts, whatever the order of their keys.
        let fit = canonical_json(&Value::Table(table));
        let whole = json!({ "version": env!("CARGO_PKG_VERSION"), "fit": fit });
        failure.map_or_else(|| Ok(hash(whole.to_string().as_bytes(), ID_BYTES)), Err)
    }

    /// The fit, read and checked, with its data; planned measurements are accepted here and rejected by its solution.
    /// Error: invalid keys, a scene that `admit` rejects before its mesh is made, and a fit of values along the rod
    /// (`[[field]]`).
    pub fn fit(&self, admit: impl Fn(&Scene) -> Result<(), Error>) -> Result<FitFile, Error> {
        FitFile::read(&self.table.to_string(), &self.file, &admit)?
            .of_parameters()
            .map_err(|error| error.in_file(Some(&self.file)))
    }

    /// The paths in the fit with the names of their keys, which replace them in results; that of the fit file is `the
    /// fit`. Longest paths come first, as they may begin with shorter ones.
    pub fn path_names(&self) -> Vec<PathName> {
        let file = self.file.display().to_string();
        let mut names = vec![PathName { path: file, name: "the fit".into() }];
        for_each_file(&mut self.table.clone(), "", &mut |key, path| {
            names.push(PathName { path: path.clone(), name: key.into() })
        });
        names.sort_by_key(|name| Reverse(name.path.len()));
        names
    }
}

/// All scenes of a fit file in `folder`, each read and put into the place of its name: that of the fit first, then
/// those of experiments. Scenes of experiments have their index and name (empty without one). Values that are neither a
/// name nor a table are skipped. Error: a scene file that cannot be read.
fn fit_scenes<'a>(fit: &'a mut Table, folder: &Path) -> Result<Vec<FitScene<'a>>, Error> {
    let mut scenes = Vec::new();
    let mut experiments: &mut [Value] = &mut [];
    for (key, value) in fit.iter_mut() {
        match (&**key, value) {
            ("scene", scene) => {
                let table = inline_scene(scene, folder)?;
                let scene = |table| FitScene { experiment: None, name: String::new(), table };
                scenes.extend(table.map(scene));
            }
            // Experiments are visited later: the scene of the fit comes first, wherever the file has it.
            ("experiment", Value::Array(list)) => experiments = list,
            _ => {}
        }
    }
    for (k, experiment) in experiments.iter_mut().enumerate() {
        let name = experiment.get("name").and_then(Value::as_str).unwrap_or_default().to_string();
        if let Some(scene) = experiment.get_mut("scene") {
            let table = inline_scene(scene, folder)?;
            scenes.extend(table.map(|table| FitScene { experiment: Some(k), name, table }));
        }
    }
    Ok(scenes)
}

/// The keys of a TOML file; an error with the file if it cannot be read or parsed.
pub(crate) fn read_toml(file: &Path) -> Result<Table, Error> {
    parse(&text(file)?, &[]).map_err(|error| error.in_file(Some(file)))
}

/// The folder of a file; empty for a name without a folder, and for the root.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}

/// A text as a file name relative to `root`, or a list of them, made absolute; other values unchanged.
fn absolute(value: &Value, root: &Path) -> Value {
    match value {
        Value::String(name) => Value::String(at(root, Path::new(name)).display().to_string()),
        Value::Array(names) => {
            names.iter().map(|name| absolute(name, root)).collect::<Vec<_>>().into()
        }
        other => other.clone(),
    }
}

/// Makes all file names in a table absolute, in place; relative ones are relative to `folder`.
fn make_absolute(table: &mut Table, folder: &Path) {
    for_each_file(table, "", &mut |_, path| {
        *path = at(folder, Path::new(&*path)).display().to_string()
    });
}

/// Removes the key `image` of all observations and shapes, also of experiments: pictures are for pages, which campaigns
/// do not make.
fn without_images(table: &mut Table) {
    for name in ["observation", "shape", "experiment"] {
        for own in table.get_mut(name).and_then(Value::as_array_mut).into_iter().flatten() {
            if let Some(own) = own.as_table_mut() {
                own.remove("image");
                without_images(own);
            }
        }
    }
}

/// If a scene is the name of a file in `folder`, puts the table of that file in the place of the name, with absolute
/// paths. Returns the table; none if the value is neither a name nor a table. Error: the file cannot be read or parsed.
fn inline_scene<'a>(scene: &'a mut Value, folder: &Path) -> Result<Option<&'a mut Table>, Error> {
    if let Value::String(name) = scene {
        let file = at(folder, Path::new(&*name));
        let mut table = read_toml(&file)?;
        make_absolute(&mut table, folder_of(&file));
        *scene = Value::Table(table);
    }
    Ok(scene.as_table_mut())
}

/// Calls `each` with the dotted path and the value of every name of a file in a table, at any depth. These are texts,
/// or lists of texts, with a key by [`is_file_key`]. `key` is the path of the table, empty for the outermost one.
fn for_each_file(table: &mut Table, key: &str, each: &mut dyn FnMut(&str, &mut String)) {
    for (part, value) in table.iter_mut() {
        let key = if key.is_empty() { part.clone() } else { format!("{key}.{part}") };
        for_each_file_in(value, is_file_key(part), &key, each);
    }
}

/// Calls `each` with every name of a file in a value with the path `key`. If `is_file`, the value is a name itself or a
/// list of names. Tables in it are entered; items of lists have their index, from 0, in the path.
fn for_each_file_in(
    value: &mut Value,
    is_file: bool,
    key: &str,
    each: &mut dyn FnMut(&str, &mut String),
) {
    match value {
        Value::String(name) if is_file => each(key, name),
        Value::Table(table) => for_each_file(table, key, each),
        Value::Array(list) => {
            for (k, value) in list.iter_mut().enumerate() {
                for_each_file_in(value, is_file, &format!("{key}.{k}"), each);
            }
        }
        _ => {}
    }
}

/// The SHA-256 of a data file in hexadecimal, from `hashes` if it is there, else computed and added to it. Error: the
/// file cannot be read.
fn data_hash(file: &Path, hashes: &mut DataHashes) -> Result<String, Error> {
    // Many fits of a plan may share a data file, which is read once.
    if let Some(known) = hashes.get(file) {
        return Ok(known.clone());
    }
    let found = hash(&data(file)?, DATA_HASH_BYTES);
    hashes.insert(file.into(), found.clone());
    Ok(found)
}

/// A TOML value as JSON whose text is the same for equal values (an integer differs from an equal float): keys are
/// sorted, and dates are texts. Infinite and NaN numbers are objects with the number as text.
fn canonical_json(value: &Value) -> Json {
    match value {
        Value::Table(table) => {
            table.iter().map(|(key, value)| (key.clone(), canonical_json(value))).collect()
        }
        Value::Array(list) => list.iter().map(canonical_json).collect(),
        // JSON has no such numbers: as null they would all be equal.
        Value::Float(x) if !x.is_finite() => json!({ "float": x.to_string() }),
        Value::Float(x) => json!(x),
        Value::Integer(n) => json!(n),
        Value::Boolean(is) => json!(is),
        Value::String(text) => json!(text),
        Value::Datetime(time) => json!(time.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of pictures are patterns, which are no files; campaigns make no pages.
    #[test]
    fn pictures_are_no_data_of_a_campaign() {
        let text = "image = \"a.png\"\n[[observation]]\nfile = \"a.csv\"\nimage = { file = \"f{}.png\" }\n\
                    [[experiment]]\n[[experiment.shape]]\nfile = \"b.csv\"\nimage = \"f.png\"\n";
        let mut table: Table = text.parse().unwrap();
        without_images(&mut table);
        let mut files = Vec::new();
        for_each_file(&mut table, "", &mut |_, path| files.push(path.clone()));
        files.sort();
        assert_eq!(files, ["a.csv", "b.csv"]);
        assert!(!table["experiment"][0]["shape"][0].as_table().unwrap().contains_key("image"));
    }

    /// The fit has no `[[experiment]]`; the message has the key of the change.
    #[test]
    fn missing_experiment_is_named_with_the_whole_key() {
        let changes = Changes::from([("experiment.0.radius".into(), Value::Float(0.01))]);
        let found = ResolvedFit::new(Path::new("data"), Path::new("cantilever-fit.toml"), &changes);
        let message = found.err().unwrap().to_string();
        assert!(message.starts_with("experiment.0.radius: found \"0\""), "{message}");
    }
}

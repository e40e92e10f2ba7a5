//! A fit with everything that it depends on: one table, in which scenes stand instead of their names.

use crate::campaign::changes::{Changes, Key, is_file, put};
use crate::campaign::hash::hash;
use crate::error::Error;
use crate::fit::FitFile;
use crate::input::missing_keys::parse;
use crate::scene::Scene;
use marker_files::file::{at, data, text};
use serde_json::{Value as Json, json};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Bytes of an id.
const ID: usize = 16;

/// A fit file after all changes, with its scenes in it and the paths of its data absolute.
pub(crate) struct Resolved {
    pub file: PathBuf,
    pub table: Table,
}

/// Hashes of data by their files: a plan reads each once.
pub(crate) type Hashes = HashMap<PathBuf, String>;

impl Resolved {
    /// Of a fit file and what is changed of it; paths in changes are relative to `root`.
    pub fn new(root: &Path, fit: &Path, changes: &Changes) -> Result<Self, Error> {
        let file = root.join(fit);
        let folder = folder_of(&file).to_path_buf();
        let mut table = read(&file)?;
        let named: Result<Vec<_>, Error> =
            changes.iter().map(|(key, value)| Ok((Key::new(key)?, value))).collect();
        let named: Vec<(Key, Value)> = named?
            .into_iter()
            .map(|(key, value)| {
                let value = if key.names_a_file() { absolute(value, root) } else { value.clone() };
                (key, value)
            })
            .collect();
        for (key, value) in &named {
            if let Key::Fit(place) = key {
                put(&mut table, place, value)?;
            }
        }
        let mut scenes: Vec<(Option<usize>, String, &mut Table)> = Vec::new();
        let mut experiments: &mut [Value] = &mut [];
        for (key, value) in table.iter_mut() {
            match (&**key, value) {
                ("scene", scene) => {
                    scenes.extend(inline(scene, &folder)?.map(|s| (None, String::new(), s)))
                }
                ("experiment", Value::Array(list)) => experiments = list,
                _ => {}
            }
        }
        for (k, experiment) in experiments.iter_mut().enumerate() {
            let name =
                experiment.get("name").and_then(Value::as_str).unwrap_or_default().to_string();
            if let Some(scene) = experiment.get_mut("scene") {
                scenes.extend(inline(scene, &folder)?.map(|scene| (Some(k), name, scene)));
            }
        }
        // What is of one experiment has the last word.
        for (key, value) in &named {
            if let Key::Scenes(place) = key {
                scenes.iter_mut().try_for_each(|(_, _, scene)| put(scene, place, value))?;
            }
        }
        for (key, value) in &named {
            let Key::Scene(which, place) = key else { continue };
            let index = which.parse().ok();
            let is_it = |(k, name, _): &&mut (Option<usize>, String, &mut Table)| {
                (k.is_some() && *k == index) || name == which
            };
            let Some((_, _, scene)) = scenes.iter_mut().find(is_it) else {
                let allowed = "the index, from 0, or the name of an [[experiment]]";
                return Err(Error::invalid(
                    format!("experiment.{which}"),
                    "no such experiment",
                    allowed,
                ));
            };
            put(scene, place, value)?;
        }
        each_file(&mut table, "", &mut |_, path| {
            *path = at(&folder, Path::new(&*path)).display().to_string()
        });
        Ok(Self { file, table })
    }

    /// The first 128 bits of the hash of everything that the result depends on: the program's version, the fit, its
    /// scenes, its data. No paths, and no times.
    pub fn id(&self, hashes: &mut Hashes) -> Result<String, Error> {
        let mut table = self.table.clone();
        let mut failure = None;
        each_file(&mut table, "", &mut |place, path| {
            let file = PathBuf::from(&*path);
            match hash_of(&file, hashes) {
                Ok(found) => {
                    // An experiment that has no name is called after its recording.
                    let key = place.rsplit('.').find(|part| part.parse::<usize>().is_err());
                    let stem = if key == Some("file") { None } else { file.file_stem() };
                    *path = format!("sha256 {found} {}", stem.unwrap_or_default().display());
                }
                Err(error) => failure = failure.take().or(Some(error)),
            }
        });
        match failure {
            Some(error) => Err(error),
            None => {
                let whole = json!({ "version": env!("CARGO_PKG_VERSION"), "fit": canonical(&Value::Table(table)) });
                Ok(hash(whole.to_string().as_bytes(), ID))
            }
        }
    }

    /// The fit, ready to solve.
    pub fn fit(&self, admit: impl Fn(&Scene) -> Result<(), Error>) -> Result<FitFile, Error> {
        FitFile::read(&self.table.to_string(), &self.file, &admit)?
            .of_parameters()
            .map_err(|error| error.in_file(Some(&self.file)))
    }

    /// What is said instead of each path, so that what is said does not depend on where things are: the key that
    /// names it. Longest paths first, as they may begin with shorter ones.
    pub fn names(&self) -> Vec<(String, String)> {
        let mut names = vec![(self.file.display().to_string(), "the fit".to_string())];
        each_file(&mut self.table.clone(), "", &mut |place, path| {
            names.push((path.clone(), place.into()))
        });
        names.sort_by_key(|(path, _)| std::cmp::Reverse(path.len()));
        names
    }
}

/// A TOML file as it is written.
pub(crate) fn read(file: &Path) -> Result<Table, Error> {
    parse(&text(file)?, &[]).map_err(|error| error.in_file(Some(file)))
}

/// The folder of a file.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}

/// A name of a file, or several, from another folder.
fn absolute(value: &Value, root: &Path) -> Value {
    match value {
        Value::String(name) => Value::String(at(root, Path::new(name)).display().to_string()),
        Value::Array(names) => {
            names.iter().map(|name| absolute(name, root)).collect::<Vec<_>>().into()
        }
        other => other.clone(),
    }
}

/// Puts a scene in the place of its name.
fn inline<'a>(scene: &'a mut Value, folder: &Path) -> Result<Option<&'a mut Table>, Error> {
    if let Value::String(name) = scene {
        let file = folder.join(&*name);
        let mut table = read(&file)?;
        let folder = folder_of(&file);
        each_file(&mut table, "", &mut |_, path| {
            *path = at(folder, Path::new(&*path)).display().to_string()
        });
        *scene = Value::Table(table);
    }
    Ok(scene.as_table_mut())
}

/// Every name of a file in a table, with its place.
fn each_file(table: &mut Table, place: &str, each: &mut dyn FnMut(&str, &mut String)) {
    for (key, value) in table.iter_mut() {
        let place = if place.is_empty() { key.clone() } else { format!("{place}.{key}") };
        each_in(value, is_file(key), &place, each);
    }
}

fn each_in(value: &mut Value, is_file: bool, place: &str, each: &mut dyn FnMut(&str, &mut String)) {
    match value {
        Value::String(name) if is_file => each(place, name),
        Value::Table(table) => each_file(table, place, each),
        Value::Array(list) => {
            for (k, value) in list.iter_mut().enumerate() {
                each_in(value, is_file, &format!("{place}.{k}"), each);
            }
        }
        _ => {}
    }
}

fn hash_of(file: &Path, hashes: &mut Hashes) -> Result<String, Error> {
    if let Some(known) = hashes.get(file) {
        return Ok(known.clone());
    }
    let found = hash(&data(file)?, 32);
    hashes.insert(file.into(), found.clone());
    Ok(found)
}

/// The same JSON for the same values: keys are sorted, and what JSON has no numbers for is told apart.
fn canonical(value: &Value) -> Json {
    match value {
        Value::Table(table) => {
            table.iter().map(|(key, value)| (key.clone(), canonical(value))).collect()
        }
        Value::Array(list) => list.iter().map(canonical).collect(),
        Value::Float(x) if !x.is_finite() => json!({ "float": x.to_string() }),
        Value::Float(x) => json!(x),
        Value::Integer(n) => json!(n),
        Value::Boolean(is) => json!(is),
        Value::String(text) => json!(text),
        Value::Datetime(time) => json!(time.to_string()),
    }
}

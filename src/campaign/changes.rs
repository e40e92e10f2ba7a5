//! Changes of a campaign task to its fit file and scenes: new values by the paths of TOML keys.
//!
//! A path has parts separated by dots, as in `rod.segments`, `observation.0.file`, `loads.gravity.y` or
//! `experiment.long.radius`. A part is a key of a table; in a list it is an index (from 0), else an axis (x, y, z),
//! else a `name`. The short name of a scene parameter, as `radius`, stands for its path. [`Key::new`] determines, by
//! the first part or the short name, whether the fit file, all scenes or the scene of one experiment may have the key.
//! Other names are errors. [`set_value`] writes the value into the table; a number or truth value in the place of a
//! text becomes a text. It creates missing tables, and `[0, 0, 0]` for a missing vector, but no items of lists. A
//! missing index or name, or a path below a plain value, is an error. `names_a_file` and [`is_file_key`] return whether
//! the value of a key is the path of a file. [`can_be_planned`] rejects values that JSON does not have.

use crate::error::Error;
use crate::fit::FitFile;
use crate::input::table_keys::table_keys;
use crate::scene::{Parameter, Scene, StructureScene};
use std::collections::BTreeMap;
use toml::{Table, Value};

/// New values (TOML) of a task, sorted by the paths of their keys.
pub type Changes = BTreeMap<String, Value>;

/// The path of a key as a list of parts, with the file that has the key.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Key {
    /// In the fit file.
    Fit(Vec<String>),
    /// In the scene of every experiment.
    Scenes(Vec<String>),
    /// In the scene of one experiment, by its index or name.
    Scene(String, Vec<String>),
}

impl Key {
    /// The key with a dotted path or short name, as in a column of the table or a key of the grid. `experiment.NAME.`
    /// and a key of a scene is one of the scene of that experiment. Otherwise the first part is a table of fit files or
    /// of scenes, or the whole is the short name of a scene parameter. Error: neither fit files nor scenes have the
    /// key.
    pub fn new(name: &str) -> Result<Self, Error> {
        let parts: Vec<String> = name.split('.').map(Into::into).collect();
        // Keys of the scene of one experiment begin with its index or name.
        if let [first, experiment, rest @ ..] = &parts[..]
            && first == "experiment"
            && let Some(path) = scene_path(rest)
        {
            return Ok(Self::Scene(experiment.clone(), path));
        }
        if FitFile::keys().contains(&&*parts[0]) {
            return Ok(Self::Fit(parts));
        }
        scene_path(&parts).map(Self::Scenes).ok_or_else(|| {
            let allowed = "a key of the fit file, such as observation.0.file, a key of its scene, \
                           such as rod.segments, or the short name of a scene parameter, such as radius";
            Error::invalid(name, "no such key", allowed)
        })
    }

    /// Whether a string at this key is the path of a file, of data or of a scene, by the last part that is no index:
    /// `file`, `path`, `paths`, or `scene` in a fit file.
    pub fn names_a_file(&self) -> bool {
        let (Self::Fit(path) | Self::Scenes(path) | Self::Scene(_, path)) = self;
        // The index of a list follows its key, as in `paths.0`.
        let last = path.iter().rfind(|part| part.parse::<usize>().is_err());
        last.is_some_and(|last| {
            is_file_key(last) || (last == "scene" && matches!(self, Self::Fit(_)))
        })
    }
}

/// Whether the values of a key (last part of its path) are paths of files: `file`, `path` or `paths`.
pub(crate) fn is_file_key(key: &str) -> bool {
    ["file", "path", "paths"].contains(&key)
}

/// The path of a key of a scene, from its `parts`. If the first is a key of the scene of one rod or of a structure, the
/// path has these parts; the short name of a parameter (all parts, joined by dots) becomes the parameter's path. None
/// for other keys, or without parts.
fn scene_path(parts: &[String]) -> Option<Vec<String>> {
    let first = &**parts.first()?;
    let tables = [table_keys::<Scene>(), table_keys::<StructureScene>()];
    if tables.iter().any(|keys| keys.contains(&first)) {
        return Some(parts.to_vec());
    }
    let path = Parameter::named(&parts.join("."))?.path();
    Some(path.split('.').map(Into::into).collect())
}

/// Whether a value can stand in a plan, which is JSON: no infinite or NaN numbers, and no dates. Lists and tables are
/// checked in full.
pub(crate) fn can_be_planned(value: &Value) -> bool {
    match value {
        Value::Float(number) => number.is_finite(),
        Value::Datetime(_) => false,
        Value::Array(list) => list.iter().all(can_be_planned),
        Value::Table(table) => table.values().all(can_be_planned),
        Value::String(_) | Value::Integer(_) | Value::Boolean(_) => true,
    }
}

/// Sets the value at a path of a table. Missing tables are created; a missing value whose next part is an axis (x, y,
/// z) becomes `[0, 0, 0]`. Items of lists are never created. A number or truth value that replaces a text becomes a
/// text. An empty path changes nothing; an error leaves the tables that were created. Error: a list has no such index
/// or name, or the path goes on below a plain value.
pub(crate) fn set_value(table: &mut Table, path: &[String], value: &Value) -> Result<(), Error> {
    let missing = || {
        let allowed = "a key of the file; list items are counted from 0";
        Error::invalid(path.join("."), "a key that the file does not have", allowed)
    };
    let [first, rest @ ..] = path else { return Ok(()) };
    // A table that is missing is a vector if the next part is an axis.
    let empty = |next: Option<&String>| match next {
        Some(next) if axis(next).is_some() => Value::Array(vec![Value::Float(0.0); 3]),
        Some(_) => Value::Table(Table::new()),
        None => Value::Boolean(false),
    };
    let mut entry = table.entry(first).or_insert_with(|| empty(rest.first()));
    for (k, part) in rest.iter().enumerate() {
        let next = rest.get(k + 1);
        entry = child(entry, part, || empty(next)).ok_or_else(missing)?;
    }
    // Tables of CSV files have numbers in columns of file names: those stay texts.
    *entry = match (&entry, value) {
        (Value::String(_), Value::Integer(_) | Value::Float(_) | Value::Boolean(_)) => {
            Value::String(value.to_string())
        }
        _ => value.clone(),
    };
    Ok(())
}

/// The index 0, 1, 2 of the component `x`, `y`, `z` of a vector; `None` for another name.
fn axis(name: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|axis| *axis == name)
}

/// The value with the key `part` in a table, created by `missing` if absent. In a list it is the existing item with
/// this `name`, else index (from 0), else axis (x, y, z as 0, 1, 2); the first that applies. None for other kinds of
/// values and items that do not exist.
fn child<'a>(
    value: &'a mut Value,
    part: &str,
    missing: impl FnOnce() -> Value,
) -> Option<&'a mut Value> {
    match value {
        Value::Table(table) => Some(table.entry(part).or_insert_with(missing)),
        Value::Array(list) => {
            let named = |v: &Value| v.get("name").and_then(Value::as_str) == Some(part);
            // A name may be a number or an axis: it is stated, and indices are not.
            let index = list.iter().position(named).or_else(|| part.parse().ok());
            let index = index.or_else(|| axis(part))?;
            list.get_mut(index)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A TOML file with the key of this name set to a value, both given as text.
    fn changed(file: &str, name: &str, value: &str) -> Result<Table, Error> {
        let mut table: Table = file.parse().unwrap();
        let value = format!("v = {value}").parse::<Table>().unwrap()["v"].clone();
        let (Key::Fit(path) | Key::Scenes(path) | Key::Scene(_, path)) = Key::new(name)?;
        set_value(&mut table, &path, &value).map(|()| table)
    }

    #[test]
    fn values_are_set_at_the_paths_of_their_keys() {
        let scene = "[rod]\nsegments = 20\n[loads]\ngravity = [0, -9.8, 0]\n";
        let cases = [
            ("rod.segments", "40", "[rod]\nsegments = 40\n[loads]\ngravity = [0, -9.8, 0]"),
            ("loads.gravity.y", "1.5", "[rod]\nsegments = 20\n[loads]\ngravity = [0, 1.5, 0]"),
            (
                "damping.mass",
                "0.1",
                "[loads]\ngravity = [0, -9.8, 0]\ndamping.mass = 0.1\n[rod]\nsegments = 20",
            ),
            (
                "clamp_position.y",
                "0.1",
                &format!("{scene}[camera]\nclamp_position = [0.0, 0.1, 0.0]"),
            ),
        ];
        // Expected: the scene with the value at the path, written out by hand.
        for (name, value, expected) in cases {
            assert_eq!(changed(scene, name, value).unwrap(), expected.parse().unwrap(), "{name}");
        }
        let fit = "[[observation]]\nfile = \"a.csv\"\n[[parameter]]\nname = \"radius\"\n";
        let file = changed(fit, "observation.0.file", "7").unwrap();
        assert_eq!(file["observation"][0]["file"].as_str(), Some("7"));
        let start = changed(fit, "parameter.radius.start", "0.1").unwrap();
        assert_eq!(start["parameter"][0]["start"].as_float(), Some(0.1));
        assert!(changed(fit, "observation.1.file", "7").is_err());
        // Names come before indices and axes.
        let rods = "[[rods]]\nname = \"y\"\n[[rods]]\nname = \"x\"\n[[rods]]\nname = \"0\"\n";
        for (key, index) in [("rods.y.segments", 0), ("rods.x.segments", 1), ("rods.0.segments", 2)]
        {
            let scene = changed(rods, key, "7").unwrap();
            assert_eq!(scene["rods"][index]["segments"].as_integer(), Some(7), "{key}");
        }
        let error = Key::new("radios").unwrap_err().to_string();
        assert!(error.starts_with("radios: found no such key"), "{error}");
        assert_eq!(Key::new("experiment.long.radius").unwrap(), {
            Key::Scene("long".into(), ["rod", "section", "radius"].map(Into::into).to_vec())
        });
    }

    #[test]
    fn keys_of_all_tables_are_those_of_their_files() {
        let parts = |name: &str| name.split('.').map(String::from).collect::<Vec<_>>();
        for name in ["load_deflection.0.file", "buckling.0.load", "field.0.length", "shape.0.file"]
        {
            assert_eq!(Key::new(name).unwrap(), Key::Fit(parts(name)));
        }
        // Keys that are no parameters: files, texts and numbers of edges.
        for name in
            ["signals.0.file", "actuation.0.signal", "contacts.0.shape", "rods.arm.segments"]
        {
            assert_eq!(Key::new(name).unwrap(), Key::Scenes(parts(name)));
            let of_one = Key::new(&format!("experiment.long.{name}")).unwrap();
            assert_eq!(of_one, Key::Scene("long".into(), parts(name)));
        }
        // Fields of the types that are no keys of files.
        for name in ["path", "gravity_left_out", "structure", "energies"] {
            assert!(Key::new(name).is_err(), "{name}");
        }
    }
}

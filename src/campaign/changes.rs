//! What a task changes of its fit file and scenes, by the keys that stand in them.

use crate::error::Error;
use crate::scene::Parameter;
use std::collections::BTreeMap;
use toml::{Table, Value};

/// Values by the keys they are put at.
pub type Changes = BTreeMap<String, Value>;

/// What a scene file begins with.
const OF_SCENES: [&str; 9] =
    ["accuracy", "rod", "material", "supports", "loads", "initial", "time", "camera", "energy"];
/// What a fit file begins with.
const OF_FITS: [&str; 8] = [
    "scene",
    "observation",
    "shape",
    "frequencies",
    "experiment",
    "parameter",
    "known",
    "analysis",
];

/// Where a value stands.
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
    /// What a column or the grid names.
    pub fn new(name: &str) -> Result<Self, Error> {
        let parts: Vec<String> = name.split('.').map(Into::into).collect();
        if let [first, which, rest @ ..] = &parts[..]
            && first == "experiment"
            && let Some(place) = of_scene(rest)
        {
            return Ok(Self::Scene(which.clone(), place));
        }
        if OF_FITS.contains(&&*parts[0]) {
            return Ok(Self::Fit(parts));
        }
        of_scene(&parts).map(Self::Scenes).ok_or_else(|| {
            let allowed = "a key of the fit file, as in observation.0.file, of its scene, as in rod.segments, or a \
                           number of the scene by its short name, as in radius";
            Error::invalid(name, "no such key", allowed)
        })
    }

    /// Whether a string there names a file.
    pub fn names_a_file(&self) -> bool {
        let (Self::Fit(place) | Self::Scenes(place) | Self::Scene(_, place)) = self;
        let last = place.iter().rfind(|part| part.parse::<usize>().is_err());
        last.is_some_and(|last| is_file(last) || (last == "scene" && matches!(self, Self::Fit(_))))
    }
}

/// Whether what stands at a key is the name of a file, or a list of such.
pub(crate) fn is_file(key: &str) -> bool {
    ["file", "path", "paths"].contains(&key)
}

/// The place of a scene's key, or of a number by its short name.
fn of_scene(parts: &[String]) -> Option<Vec<String>> {
    if OF_SCENES.contains(&&**parts.first()?) {
        return Some(parts.to_vec());
    }
    let path = Parameter::named(&parts.join("."))?.path();
    Some(path.split('.').map(Into::into).collect())
}

/// Whether a value can stand in a plan: JSON has no infinite numbers, and no key takes a date.
pub(crate) fn can_be_planned(value: &Value) -> bool {
    match value {
        Value::Float(number) => number.is_finite(),
        Value::Datetime(_) => false,
        Value::Array(list) => list.iter().all(can_be_planned),
        Value::Table(table) => table.values().all(can_be_planned),
        Value::String(_) | Value::Integer(_) | Value::Boolean(_) => true,
    }
}

/// Puts a value at a place, and makes the tables on the way that are missing. What stands there as text stays text.
pub(crate) fn put(table: &mut Table, place: &[String], value: &Value) -> Result<(), Error> {
    let refused = |found: String, allowed: &str| Error::invalid(place.join("."), found, allowed);
    let [ways @ .., last] = place else { return Ok(()) };
    let mut at = Value::Table(std::mem::take(table));
    let mut here = Some(&mut at);
    for (k, way) in ways.iter().enumerate() {
        let next = &place[k + 1];
        here = here.and_then(|here| entry(here, way, || empty(next)));
    }
    let put = match here.and_then(|here| entry(here, last, || Value::Boolean(false))) {
        Some(there) => {
            *there = match (&there, value) {
                (Value::String(_), Value::Integer(_) | Value::Float(_) | Value::Boolean(_)) => {
                    Value::String(value.to_string())
                }
                _ => value.clone(),
            };
            Ok(())
        }
        None => Err(refused(
            "a key that the file does not have".into(),
            "a key of the file; items of lists are counted from 0",
        )),
    };
    if let Value::Table(changed) = at {
        *table = changed;
    }
    put
}

/// What a place is made of that is missing.
fn empty(next: &str) -> Value {
    match axis(next) {
        Some(_) => Value::Array(vec![Value::Float(0.0); 3]),
        None => Value::Table(Table::new()),
    }
}

/// The index of a component.
fn axis(name: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|axis| *axis == name)
}

/// What stands in a table or a list: the latter by its index, its axis, or its name.
fn entry<'a>(
    value: &'a mut Value,
    part: &str,
    missing: impl FnOnce() -> Value,
) -> Option<&'a mut Value> {
    match value {
        Value::Table(table) => Some(table.entry(part).or_insert_with(missing)),
        Value::Array(list) => {
            let named = |v: &Value| v.get("name").and_then(Value::as_str) == Some(part);
            let index = part.parse().ok().or_else(|| axis(part));
            let index = index.or_else(|| list.iter().position(named))?;
            list.get_mut(index)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed(file: &str, name: &str, value: &str) -> Result<Table, Error> {
        let mut table: Table = file.parse().unwrap();
        let value = format!("v = {value}").parse::<Table>().unwrap()["v"].clone();
        let (Key::Fit(place) | Key::Scenes(place) | Key::Scene(_, place)) = Key::new(name)?;
        put(&mut table, &place, &value).map(|()| table)
    }

    #[test]
    fn values_go_where_their_keys_say() {
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
        for (name, value, expected) in cases {
            assert_eq!(changed(scene, name, value).unwrap(), expected.parse().unwrap(), "{name}");
        }
        let fit = "[[observation]]\nfile = \"a.csv\"\n[[parameter]]\nname = \"radius\"\n";
        let file = changed(fit, "observation.0.file", "7").unwrap();
        assert_eq!(file["observation"][0]["file"].as_str(), Some("7"));
        let start = changed(fit, "parameter.radius.start", "0.1").unwrap();
        assert_eq!(start["parameter"][0]["start"].as_float(), Some(0.1));
        assert!(changed(fit, "observation.1.file", "7").is_err());
        let error = Key::new("radios").unwrap_err().to_string();
        assert!(error.starts_with("radios: found no such key"), "{error}");
        assert_eq!(Key::new("experiment.long.radius").unwrap(), {
            Key::Scene("long".into(), ["rod", "section", "radius"].map(Into::into).to_vec())
        });
    }
}

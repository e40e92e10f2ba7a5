//! [Energies of one's own](crate::energy::own) on a scene: which, where, and with what numbers.
//!
//! Code does not fit into a file. A scene that is written has a table `[energy.<name>]` for each,
//! with its place and its numbers, and one that is read with such a table is no scene until the
//! code is given: see [`Scene::load_with`](crate::Scene::load_with).

use crate::error::Error;
use crate::scene::number::{Numbers, Quantity, Written};
use crate::scene::parameter::Parameter;
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::any::Any;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

/// Where on the rod an energy acts: by place, never by node, so that finer meshes have it where
/// coarse ones do.
///
/// On a mesh it acts at elements: single nodes, edges, or inner nodes with their neighbours,
/// whichever it is [over](crate::energy::OwnEnergy). A point between two of them is shared by both.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum At {
    /// The first element of the rod.
    Start,
    /// The last element of the rod.
    End,
    /// A point by its arc length from the wall, m.
    ArcLength(f64),
    /// All of the rod between two arc lengths from the wall, m.
    Interval(f64, f64),
    /// All of the rod, from wall or end to wall or end.
    Whole,
}

impl At {
    /// Refuses arc lengths off the rod, which is `length` long, m; `key` says whose.
    pub(crate) fn check(self, key: &str, length: f64) -> Result<(), Error> {
        let on_the_rod = |s: f64| (0.0..=length).contains(&s);
        let fine = match self {
            Self::ArcLength(s) => on_the_rod(s),
            Self::Interval(from, to) => on_the_rod(from) && on_the_rod(to) && from < to,
            Self::Start | Self::End | Self::Whole => true,
        };
        if fine {
            return Ok(());
        }
        let allowed = format!("arc lengths from 0 to {length} m, an interval's in their order");
        Err(Error::invalid(format!("{key}.at"), format!("{self:?}"), allowed))
    }
}

/// The code of an energy, which rods look into.
pub(crate) trait Code: Any + Send + Sync {
    /// Its parameters, by name.
    fn parameters(&self) -> &'static [(&'static str, Quantity)];
}

/// An energy of one's own on a rod.
#[derive(Clone)]
pub struct Attached<D = f64> {
    name: Arc<str>,
    at: At,
    /// None if it was read from a file, until it is given.
    code: Option<Arc<dyn Code>>,
    values: Vec<(Arc<str>, D)>,
}

impl<D> Attached<D> {
    /// What it was called when it was attached.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where it acts.
    pub fn at(&self) -> At {
        self.at
    }

    /// Its parameters with their values.
    pub fn values(&self) -> impl Iterator<Item = (&str, &D)> {
        self.values.iter().map(|(name, value)| (&**name, value))
    }

    /// Its code; all of a checked scene have it.
    pub(crate) fn code(&self) -> Option<&dyn Code> {
        self.code.as_deref()
    }

    /// The name, to be kept.
    pub(crate) fn shared_name(&self) -> Arc<str> {
        self.name.clone()
    }

    /// Where its numbers stand in the scene.
    pub(crate) fn key(&self) -> String {
        format!("energy.{}", self.name)
    }
}

impl<D: fmt::Debug> fmt::Debug for Attached<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, at, values, .. } = self;
        f.debug_struct("Attached")
            .field("name", name)
            .field("at", at)
            .field("values", values)
            .finish_non_exhaustive()
    }
}

/// The same code, not only code that does the same.
impl<D: PartialEq> PartialEq for Attached<D> {
    fn eq(&self, other: &Self) -> bool {
        let same = match (&self.code, &other.code) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        same && (&self.name, self.at, &self.values) == (&other.name, other.at, &other.values)
    }
}

impl Attached {
    /// An energy with the values of its parameters, as many as it has.
    pub(crate) fn new(name: &str, at: At, code: Arc<dyn Code>, values: &[f64]) -> Self {
        let known = code.parameters().iter();
        for (parameter, quantity) in known.clone() {
            Parameter::declare(&format!("energy.{name}.{parameter}"), *quantity);
        }
        let values = known.zip(values).map(|((name, _), value)| ((*name).into(), *value));
        Self { name: name.into(), at, values: values.collect(), code: Some(code) }
    }

    pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> Attached<D> {
        let known = self.code.as_ref().map_or(&[][..], |code| code.parameters());
        let values = n.table(&self.name, |n| {
            let each = |(i, (name, value)): (usize, &(Arc<str>, f64))| {
                let quantity = known.get(i).map_or(Quantity::signed(""), |(_, quantity)| *quantity);
                (name.clone(), n.number(name, *value, quantity))
            };
            self.values.iter().enumerate().map(each).collect()
        });
        Attached { name: self.name.clone(), at: self.at, code: self.code.clone(), values }
    }

    fn check(&self) -> Result<(), Error> {
        let key = self.key();
        let Some(code) = &self.code else {
            let allowed = "in code: Scene::load_with gives it to the scene of a file";
            return Err(Error::invalid(key, "an energy of one's own, which is code", allowed));
        };
        let is_name = |name: &str| {
            let letters = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(letters)
        };
        if !is_name(&self.name) {
            let allowed = "a letter, and letters, digits, - and _ after it";
            return Err(Error::invalid("energy", format!("the name {:?}", self.name), allowed));
        }
        for ((name, value), (_, quantity)) in self.values.iter().zip(code.parameters()) {
            let key = format!("{key}.{name}");
            if !is_name(name) || &**name == "at" {
                let allowed = "a letter, and letters, digits, - and _ after it; and not \"at\"";
                return Err(Error::invalid(key, "the name of a parameter", allowed));
            }
            let [low, high] = quantity.limits;
            if !(low..=high).contains(value) {
                return Err(Error::invalid(key, value, format!("from {low:e} to {high:e}")));
            }
            if Parameter::at(&key).quantity() != *quantity {
                let found = "two kinds of numbers under this name, in one program";
                return Err(Error::invalid(
                    key,
                    found,
                    "one; give one of the energies another name",
                ));
            }
        }
        Ok(())
    }
}

/// Checks every energy.
pub(super) fn check(energies: &[Attached]) -> Result<(), Error> {
    for (i, energy) in energies.iter().enumerate() {
        energy.check()?;
        if energies[..i].iter().any(|other| other.name == energy.name) {
            return Err(Error::invalid(energy.key(), "two of this name", "a name for each"));
        }
    }
    Ok(())
}

/// What stands in a file.
#[derive(Deserialize)]
#[serde(bound = "D: Written")]
struct Form<D> {
    at: At,
    #[serde(flatten)]
    values: BTreeMap<String, D>,
}

impl<D: Written> Serialize for Attached<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(1 + self.values.len()))?;
        for (name, value) in self.values() {
            map.serialize_entry(name, value)?;
        }
        map.serialize_entry("at", &self.at)?;
        map.end()
    }
}

/// A table for every energy.
pub(super) fn serialize<S: Serializer, D: Written>(
    energies: &[Attached<D>],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(energies.iter().map(|energy| (&*energy.name, energy)))
}

/// Energies that are still to be given.
pub(super) fn deserialize<'de, T: Deserializer<'de>, D: Written>(
    deserializer: T,
) -> Result<Vec<Attached<D>>, T::Error> {
    let forms = BTreeMap::<String, Form<D>>::deserialize(deserializer)?;
    let attached = |(name, Form { at, values }): (String, Form<D>)| Attached {
        name: name.into(),
        at,
        code: None,
        values: values.into_iter().map(|(name, value)| (name.into(), value)).collect(),
    };
    Ok(forms.into_iter().map(attached).collect())
}

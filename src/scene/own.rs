//! `[energy.<name>]`: [user-defined energies](crate::energy::own) of a scene with their place on the rod and
//! parameters.
//!
//! [`Attached`] is one of them: name, place ([`At`]), values of the parameters and, once given, the code. A scene file
//! contains place and parameters in `[energy.<name>]`, but not the code. A scene that is read from such a file is
//! complete only once the code is given: see [`Scene::load_with`](crate::Scene::load_with). An energy with code is made
//! by `Attached::new`, which also declares the quantities of its parameters for the whole program.
//!
//! The check of a scene rejects an energy without code, a name twice, and names that are not a letter followed by
//! letters, digits, - and _. Rejected are also values outside the limits of the code, and a parameter path that two
//! energies declare with different quantities. Places must be between 0 and the rod length (`At::check`). The functions
//! `serialize` and `deserialize` write and read the tables.

use crate::error::Error;
use crate::scene::number::{NumberVisitor, Quantity, SceneNumber};
use crate::scene::parameter::Parameter;
use crate::scene::table::{NumberTree, TableKind};
use crate::scene::validate::is_name;
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::any::Any;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

/// Place of an energy on the rod, by arc length, so that it does not depend on the mesh.
///
/// On a mesh the energy acts at elements: single nodes, edges, or inner nodes with their neighbors, according to its
/// [number of nodes](crate::energy::OwnEnergy). Two elements share a point between them.
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
    /// Rejects an arc length below 0 or above `length`, the length of the rod, m, and an interval whose second end is
    /// not above the first. Start, end and the whole rod are accepted. `key` is the path of the energy, for the error.
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
        let allowed = format!("arc lengths from 0 to {length} m, ascending in an interval");
        Err(Error::invalid(format!("{key}.at"), format!("{self:?}"), allowed))
    }
}

/// Code of a user-defined energy as a trait object; the module `energy` implements the trait and downcasts to the
/// energy.
pub(crate) trait Code: Any + Send + Sync {
    /// Names and quantities (unit, limits) of the parameters of the energy, in the order of their values.
    fn parameters(&self) -> &'static [(&'static str, Quantity)];
}

/// User-defined energy of a scene: name, place, code and values of its parameters.
#[derive(Clone)]
pub struct Attached<D = f64> {
    name: Arc<str>,
    at: At,
    /// None after reading from a file, until the code is given.
    code: Option<Arc<dyn Code>>,
    values: Vec<(Arc<str>, D)>,
}

impl<D> Attached<D> {
    /// Name of the energy, the `<name>` in `energy.<name>`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Place on the rod where the energy acts.
    pub fn at(&self) -> At {
        self.at
    }

    /// Names and values of the parameters of the energy. They are in the order of the code if the energy was made with
    /// it, and in alphabetical order after reading from a file.
    pub fn values(&self) -> impl Iterator<Item = (&str, &D)> {
        self.values.iter().map(|(name, value)| (&**name, value))
    }

    /// Code of the energy; `None` after reading from a file. Every energy of a validated scene has it.
    pub(crate) fn code(&self) -> Option<&dyn Code> {
        self.code.as_deref()
    }

    /// The name of the energy as a shared pointer, without a copy of the text.
    pub(crate) fn shared_name(&self) -> Arc<str> {
        self.name.clone()
    }

    /// Path of its table in the scene, `energy.<name>`.
    pub(crate) fn key(&self) -> String {
        format!("energy.{}", self.name)
    }
}

impl<D: fmt::Debug> fmt::Debug for Attached<D> {
    /// Writes name, place and values for debugging, without the code.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, at, values, .. } = self;
        f.debug_struct("Attached")
            .field("name", name)
            .field("at", at)
            .field("values", values)
            .finish_non_exhaustive()
    }
}

/// Equal energies share one code object, name, place and values.
impl<D: PartialEq> PartialEq for Attached<D> {
    /// Whether name, place and values are equal, and both have the same code object, or none.
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
    /// Energy of a name at a place with its `code`. Value i is that of the i-th parameter of the code; of lists of
    /// different lengths the excess entries are left out. Declares the quantity of each parameter
    /// `energy.<name>.<parameter>` of the code for the whole program.
    pub(crate) fn new(name: &str, at: At, code: Arc<dyn Code>, values: &[f64]) -> Self {
        let known = code.parameters().iter();
        // Names of parameters are resolved without a scene, so that their quantities are global.
        for (parameter, quantity) in known.clone() {
            Parameter::declare(&format!("energy.{name}.{parameter}"), *quantity);
        }
        let values = known.zip(values).map(|((name, _), value)| ((*name).into(), *value));
        Self { name: name.into(), at, values: values.collect(), code: Some(code) }
    }

    /// Rejects an energy without code; names (of energy and parameters) that are not a letter followed by letters,
    /// digits, - and _; and a parameter named `at`. Rejects values outside the limits of their quantity in the code,
    /// and a parameter path that was first declared with another quantity.
    fn check(&self) -> Result<(), Error> {
        let key = self.key();
        let Some(code) = &self.code else {
            let allowed = "an energy that the program attaches with Scene::load_with";
            return Err(Error::invalid(key, "a user-defined energy without its function", allowed));
        };
        if !is_name(&self.name) {
            let allowed = "a letter followed by letters, digits, - and _";
            return Err(Error::invalid("energy", format!("the name {:?}", self.name), allowed));
        }
        // Each parameter: its name, its limits, and the quantity declared for its path.
        for ((name, value), (_, quantity)) in self.values.iter().zip(code.parameters()) {
            let key = format!("{key}.{name}");
            if !is_name(name) || &**name == "at" {
                let allowed = "a letter followed by letters, digits, - and _, other than \"at\"";
                return Err(Error::invalid(key, "the name of a parameter", allowed));
            }
            let [low, high] = quantity.limits;
            if !(low..=high).contains(value) {
                return Err(Error::invalid(key, value, format!("from {low:e} to {high:e}")));
            }
            // Of two declarations of one path the first remains: this energy may have another one.
            if Parameter::at(&key).quantity() != *quantity {
                let found = "two parameters with this name and different units or limits";
                return Err(Error::invalid(
                    key,
                    found,
                    "one parameter with this name. Rename one of the energies",
                ));
            }
        }
        Ok(())
    }
}

/// The numbers of an energy under its name.
impl NumberTree for Attached {
    type Kind = TableKind;
    type Over<D> = Attached<D>;

    /// The energy over the number type `D`: the visitor converts each value at the path `key.<parameter>`, with its
    /// quantity in the code. Without code the quantity is a signed number without a unit. Name, place and code are
    /// copied.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        _: TableKind,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> Attached<D> {
        // Only the code has units and limits; without it the scene is not valid yet.
        let declared = self.code.as_ref().map_or(&[][..], |code| code.parameters());
        let outer_length = visitor.enter(key);
        let number = |(i, (name, value)): (usize, &(Arc<str>, f64))| {
            let quantity = declared.get(i).map_or(Quantity::signed(""), |(_, quantity)| *quantity);
            (name.clone(), visitor.number(name, *value, quantity))
        };
        let values = self.values.iter().enumerate().map(number).collect();
        visitor.leave(outer_length);
        Attached { name: self.name.clone(), at: self.at, code: self.code.clone(), values }
    }

    /// Accepts all numbers, since the function `check` of this module compares them with the limits of the code.
    fn check_numbers(&self, _: &str, _: TableKind) -> Result<(), Error> {
        Ok(())
    }

    /// Key in the list of energies: the name of the energy in place of its index.
    fn entry_key(&self, _: usize) -> String {
        self.name.to_string()
    }
}

/// Rejects the first energy that is invalid, or has the name of one before it.
pub(super) fn check(energies: &[Attached]) -> Result<(), Error> {
    for (i, energy) in energies.iter().enumerate() {
        energy.check()?;
        if energies[..i].iter().any(|other| other.name == energy.name) {
            return Err(Error::invalid(
                energy.key(),
                "two energies of this name",
                "a different \
                                                     name for each energy",
            ));
        }
    }
    Ok(())
}

/// Table `[energy.<name>]` of a file.
#[derive(Deserialize)]
#[serde(bound = "D: SceneNumber")]
struct EnergyTable<D> {
    at: At,
    #[serde(flatten)]
    values: BTreeMap<String, D>,
}

impl<D: SceneNumber> Serialize for Attached<D> {
    /// Writes the values of the parameters and the place `at` as a table, without the code.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(1 + self.values.len()))?;
        for (name, value) in self.values() {
            map.serialize_entry(name, value)?;
        }
        map.serialize_entry("at", &self.at)?;
        map.end()
    }
}

/// Writes the list of energies as a map from names to tables of values and place, in the order of the list.
pub(super) fn serialize<S: Serializer, D: SceneNumber>(
    energies: &[Attached<D>],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(energies.iter().map(|energy| (&*energy.name, energy)))
}

/// Reads a map from names to tables (`at`, and any number of parameters) as a list of energies in alphabetical order of
/// their names, without code.
pub(super) fn deserialize<'de, T: Deserializer<'de>, D: SceneNumber>(
    deserializer: T,
) -> Result<Vec<Attached<D>>, T::Error> {
    let forms = BTreeMap::<String, EnergyTable<D>>::deserialize(deserializer)?;
    // No file contains the code: the program attaches it to the scene afterwards.
    let attached = |(name, EnergyTable { at, values }): (String, EnergyTable<D>)| Attached {
        name: name.into(),
        at,
        code: None,
        values: values.into_iter().map(|(name, value)| (name.into(), value)).collect(),
    };
    Ok(forms.into_iter().map(attached).collect())
}

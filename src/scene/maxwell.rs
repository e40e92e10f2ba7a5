//! `loads.damping.maxwell`: Maxwell branches parallel to the elastic rod, one table or a list of any length.
//!
//! A [`Maxwell`] branch is a spring in series with a dashpot: its stiffness `g` is a fraction of that of the rod, zero
//! or above, and its relaxation time `tau`, s, is above zero. With one branch the rod is a standard linear solid, with
//! several its relaxation is a Prony series `E(t) = E (1 + sum_i g_i e^(-t/tau_i))`: the modulus E is that of slow
//! loads. [`MaxwellBranches`] is read from a table or a list of tables; the numbers of a table are the parameters
//! `loads.damping.maxwell.stiffness` and `.time`, those of a list `loads.damping.maxwell.0.stiffness` and so on. An
//! empty list has no branch.

use crate::error::Error;
use crate::scene::number::{NumberVisitor, Quantity, SceneNumber};
use crate::scene::table::{NumberTree, TableKind, table};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;
use std::marker::PhantomData;

table! {
    /// `loads.damping.maxwell`: a spring in series with a dashpot, parallel to the elastic rod;
    /// together a standard linear solid.
    #[derive(Copy)]
    pub struct Maxwell {
        /// Stiffness of the branch as a fraction of the stiffness of the rod.
        pub stiffness: D = Quantity::positive("").vanishing(),
        /// Relaxation time of the branch, s.
        pub time: D = Quantity::positive("s"),
    }
}

/// Maxwell branches parallel to the rod. In code: `Maxwell { stiffness, time }.into()`, or that of a list of branches.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: SceneNumber + schemars::JsonSchema"))]
#[serde(untagged, bound = "D: SceneNumber")]
pub enum MaxwellBranches<D = f64> {
    /// One branch.
    One(Maxwell<D>),
    /// A list of branches: a Prony series.
    Series(Vec<Maxwell<D>>),
}

impl<D> MaxwellBranches<D> {
    /// All branches in the order of the scene: one of a table, those of a list, which may be empty.
    pub fn as_slice(&self) -> &[Maxwell<D>] {
        match self {
            Self::One(branch) => std::slice::from_ref(branch),
            Self::Series(branches) => branches,
        }
    }

    /// Whether there is no branch: true for an empty list only.
    pub fn is_empty(&self) -> bool {
        self.as_slice().is_empty()
    }
}

impl<D> Default for MaxwellBranches<D> {
    /// No branch: an empty list.
    fn default() -> Self {
        Self::Series(Vec::new())
    }
}

impl<D> From<Maxwell<D>> for MaxwellBranches<D> {
    /// The branch as one table ([`One`](Self::One)).
    fn from(branch: Maxwell<D>) -> Self {
        Self::One(branch)
    }
}

impl<D> From<Vec<Maxwell<D>>> for MaxwellBranches<D> {
    /// The branches as a list ([`Series`](Self::Series)), in the same order; none for an empty one.
    fn from(branches: Vec<Maxwell<D>>) -> Self {
        Self::Series(branches)
    }
}

/// The reader of a table or a list of tables. It selects by the form of the value, so that errors name the key within
/// a table.
struct BranchesVisitor<D>(PhantomData<D>);

impl<'de, D: SceneNumber> Visitor<'de> for BranchesVisitor<D> {
    type Value = MaxwellBranches<D>;

    /// Writes the allowed forms, for the error of another value.
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("{ stiffness = number, time = number }, or a list of such tables")
    }

    /// Reads a table as one branch (`One`); errors are those of `Maxwell`.
    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        Maxwell::deserialize(MapAccessDeserializer::new(map)).map(MaxwellBranches::One)
    }

    /// Reads a list of tables, possibly empty, as a `Series` in the same order.
    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Self::Value, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(MaxwellBranches::Series)
    }
}

impl<'de, D: SceneNumber> Deserialize<'de> for MaxwellBranches<D> {
    /// Reads a table as one branch, or a list of tables as several. Other values are an error with the allowed forms.
    fn deserialize<T: Deserializer<'de>>(deserializer: T) -> Result<Self, T::Error> {
        deserializer.deserialize_any(BranchesVisitor(PhantomData))
    }
}

/// `key.stiffness` and `key.time` of one branch, `key.0.stiffness`, `key.0.time`, .. of a list.
impl NumberTree for MaxwellBranches {
    type Kind = TableKind;
    type Over<D> = MaxwellBranches<D>;

    /// Converts stiffness and relaxation time of every branch to the number type `D` with the visitor. Their paths are
    /// `key.stiffness` and `key.time` of one branch, `key.0.stiffness`, `key.0.time` and so on of a list.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        kind: TableKind,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> MaxwellBranches<D> {
        match self {
            Self::One(branch) => MaxwellBranches::One(branch.map_numbers(key, kind, visitor)),
            Self::Series(list) => MaxwellBranches::Series(list.map_numbers(key, kind, visitor)),
        }
    }

    /// Rejects, for any branch, a stiffness that is negative or not finite, and a relaxation time that is not finite
    /// and above zero. `key` is the path of the table or list, for the error.
    fn check_numbers(&self, key: &str, kind: TableKind) -> Result<(), Error> {
        match self {
            Self::One(branch) => branch.check_numbers(key, kind),
            Self::Series(branches) => branches.check_numbers(key, kind),
        }
    }
}

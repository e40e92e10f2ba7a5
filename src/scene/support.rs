//! What may hold an end of the rod.

use serde::{Deserialize, Serialize};

/// What holds an end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Support {
    /// Nothing holds the end.
    #[default]
    Free,
    /// A hinge: the end stays where it is.
    Pinned,
    /// A hinge on wheels: the end rolls along one line.
    Roller,
    /// A wall: position and direction stay.
    Clamped,
    /// A hand that leads the end as `supports.path` has recorded it.
    Recorded,
}

/// Where the wall of a clamped end stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Clamp {
    /// At the middle of the outermost edge: second-order accurate.
    #[default]
    MidEdge,
    /// At the outermost node, as in the paper: the rod is half an edge too short.
    Nodes,
}

/// An end of the rod.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum End {
    /// At arc length zero.
    Start,
    /// At the other end.
    #[default]
    End,
}

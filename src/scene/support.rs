//! Kinds of supports of the ends of a rod ([`Support`]: free, pinned, roller, clamped, recorded), as in `[supports]`.
//!
//! [`Clamp`] has the positions of the wall of a clamp: the middle of the outermost edge, or the outermost node. [`End`]
//! has the names of the two ends of a rod. Models and boundary motions decide which nodes an end holds.

use serde::{Deserialize, Serialize};

/// Kind of support of an end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Support {
    /// Nothing holds the end.
    #[default]
    Free,
    /// A hinge: the position is fixed, the direction is free.
    Pinned,
    /// A hinge that moves along a line.
    Roller,
    /// A wall: position and direction are fixed.
    Clamped,
    /// A gripper: position and direction follow the recording `supports.path`.
    Recorded,
}

/// Position of the wall of a clamped end.
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
    /// End at arc length zero.
    Start,
    /// End at the largest arc length.
    #[default]
    End,
}

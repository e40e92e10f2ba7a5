//! Points of a structure: on one of its rods, or fixed to one of its bodies.
//!
//! [`StructurePoint`] is read from `{ rod = "arm", at = "tip" }` or `{ body = "gripper", offset = [0, 0.1, 0] }`. A
//! place on a rod is `"start"`, `"tip"` (or `"end"`), a node index, or an arc length from the start, m. The offset from
//! the center of mass at rest, m, in world axes, is zero by default. Other keys are errors; names, indices and arc
//! lengths are not checked here. `Display` writes text such as `the tip of arm`.

use crate::scene::point::Point;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A point of a structure, `{ rod = "arm", at = "tip" }` or `{ body = "gripper", offset = [0, 0.1, 0] }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected { rod = \"..\", at = \"tip\" } or { body = \"..\" } with an offset if it is not the center of mass"
)]
pub enum StructurePoint {
    /// Point on the centerline of a rod.
    Rod(PointOfRod),
    /// Point fixed to a body.
    Body(PointOfBody),
}

/// A point of the centerline of a rod.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PointOfRod {
    /// Name of the rod.
    pub rod: String,
    /// Position on the rod: `"start"`, `"tip"`, the index of a node, or `{ arc_length = m }`.
    pub at: RodPoint,
}

/// A point that is fixed to a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PointOfBody {
    /// Name of the body.
    pub body: String,
    /// Position relative to the center of mass at rest, m.
    #[serde(default, deserialize_with = "crate::input::arrays::numbers")]
    pub offset: [f64; 3],
}

/// A position on a rod of a structure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected \"start\", \"tip\", the index of a node, or { arc_length = meters from the start }"
)]
pub enum RodPoint {
    /// An end.
    End(RodEndName),
    /// A node by its index.
    Node(usize),
    /// Arc length from the start of the rod.
    ArcLength(ArcLengthOfRod),
}

/// Name of an end of a rod of a structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum RodEndName {
    /// The end at arc length 0.
    Start,
    /// The end at the largest arc length.
    Tip,
    /// Another name of `tip`.
    End,
}

/// Arc length of a point of a rod.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ArcLengthOfRod {
    /// Arc length from the start of the rod, m.
    pub arc_length: f64,
}

impl RodPoint {
    /// The place as a [`Point`] of the scene of this rod alone. The start is arc length 0, not node 0, which may be
    /// behind a wall.
    pub fn point(self) -> Point {
        match self {
            // Not node 0, which is behind the wall of a clamp in the middle of an edge.
            Self::End(RodEndName::Start) => Point::ArcLength(0.0),
            Self::End(RodEndName::Tip | RodEndName::End) => Point::Tip,
            Self::Node(node) => Point::Node(node),
            Self::ArcLength(ArcLengthOfRod { arc_length }) => Point::ArcLength(arc_length),
        }
    }
}

impl StructurePoint {
    /// The point at the place `at` of the rod with the name `rod`, which is not checked.
    pub fn on_rod(rod: impl Into<String>, at: RodPoint) -> Self {
        Self::Rod(PointOfRod { rod: rod.into(), at })
    }

    /// The end of the rod with the name `rod` at its largest arc length.
    pub fn tip(rod: impl Into<String>) -> Self {
        Self::on_rod(rod, RodPoint::End(RodEndName::Tip))
    }

    /// The point of the body with this name at an offset from its center of mass at rest, m, in world axes.
    pub fn on_body(body: impl Into<String>, offset: [f64; 3]) -> Self {
        Self::Body(PointOfBody { body: body.into(), offset })
    }
}

impl fmt::Display for StructurePoint {
    /// Writes the point as text: `the tip of arm`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rod(PointOfRod { rod, at }) => match at {
                RodPoint::End(RodEndName::Start) => write!(f, "the start of {rod}"),
                RodPoint::End(_) => write!(f, "the tip of {rod}"),
                RodPoint::Node(node) => write!(f, "node {node} of {rod}"),
                RodPoint::ArcLength(own) => write!(f, "arc length {} m of {rod}", own.arc_length),
            },
            Self::Body(PointOfBody { body, offset: [0.0, 0.0, 0.0] }) => write!(f, "{body}"),
            Self::Body(PointOfBody { body, offset }) => write!(f, "{body} at {offset:?} m"),
        }
    }
}

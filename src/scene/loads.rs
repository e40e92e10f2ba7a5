//! What pulls and damps.

use super::{finite, not_negative};
use crate::error::Error;
use serde::{Deserialize, Serialize};

/// `[loads]`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Loads {
    /// Acceleration, m/s^2.
    #[serde(default, deserialize_with = "crate::exact::numbers")]
    pub gravity: [f64; 3],
    /// Damping.
    #[serde(default)]
    pub damping: DampingSpec,
    /// Constant forces and moments on nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point: Vec<PointForce>,
}

/// `loads.damping`
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DampingSpec {
    /// Force -mass M v, 1/s.
    #[serde(default)]
    pub mass: f64,
    /// Kelvin-Voigt time on the strain rates, s.
    #[serde(default)]
    pub stiffness: f64,
}

/// `[[loads.point]]`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointForce {
    /// Where.
    pub node: Node,
    /// N, in world axes.
    #[serde(default, deserialize_with = "crate::exact::numbers")]
    pub force: [f64; 3],
    /// N m, about the normal of a planar scene: half of it turns each of the node's edges.
    #[serde(default, deserialize_with = "crate::exact::numbers", skip_serializing_if = "is_zero")]
    pub moment: [f64; 3],
}

fn is_zero(vector: &[f64; 3]) -> bool {
    *vector == [0.0; 3]
}

/// A node: `"tip"` or an index from the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected \"tip\" or the index of a node")]
pub enum Node {
    /// By number, 0 at the start.
    Index(usize),
    /// By name.
    Named(NamedNode),
}

/// The node with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NamedNode {
    /// The last node.
    Tip,
}

impl Default for Node {
    fn default() -> Self {
        Self::TIP
    }
}

impl Node {
    /// The last node.
    pub const TIP: Self = Self::Named(NamedNode::Tip);
}

impl PointForce {
    pub(crate) fn check(&self, key: &str) -> Result<(), Error> {
        finite(&format!("{key}.force"), &self.force)?;
        finite(&format!("{key}.moment"), &self.moment)
    }
}

impl Loads {
    pub(crate) fn check(&self) -> Result<(), Error> {
        finite("loads.gravity", &self.gravity)?;
        not_negative("loads.damping.mass", self.damping.mass)?;
        not_negative("loads.damping.stiffness", self.damping.stiffness)?;
        let mut points = self.point.iter().enumerate();
        points.try_for_each(|(i, load)| load.check(&format!("loads.point[{i}]")))
    }
}

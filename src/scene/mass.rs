//! What is fixed on the rod and weighs: markers, clamps, bobs.

use crate::error::Error;
use crate::scene::number::{Numbers, Quantity, Written};
use crate::scene::point::Point;
use crate::scene::validate::positive;
use serde::{Deserialize, Serialize};

/// `[[rod.mass]]`: a point mass on the rod.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct PointMass<D = f64> {
    /// Position of the mass: `"tip"`, a node index or `{ arc_length = m }`. Between nodes the two
    /// neighbors share it by the lever rule.
    pub node: Point<D>,
    /// Mass, kg; gravity and mass-proportional damping act on it.
    pub mass: D,
}

impl PointMass {
    /// So many kg at a point.
    pub fn new(node: Point, mass: f64) -> Self {
        Self { node, mass }
    }

    pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> PointMass<D> {
        PointMass {
            node: self.node.over("node", n),
            mass: n.number("mass", self.mass, Quantity::positive("kg")),
        }
    }

    pub(super) fn check(&self, key: &str) -> Result<(), Error> {
        positive(&format!("{key}.mass"), self.mass)
    }
}

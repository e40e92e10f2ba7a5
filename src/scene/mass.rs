//! `[[rod.mass]]`: point masses on the rod, such as markers, clamps and bobs.
//!
//! A [`PointMass`] has a point (tip, node index or arc length) and a positive mass in kg. Between two nodes it is
//! shared by the lever rule. Gravity and mass-proportional damping act on it. The setup of a problem adds it to the
//! masses of the nodes.

use crate::scene::number::Quantity;
use crate::scene::point::Point;
use crate::scene::table::{TABLE, table};

table! {
    /// `[[rod.mass]]`: a point mass on the rod.
    #[derive(Copy, Default)]
    pub struct PointMass {
        /// Position of the mass: `"tip"`, a node index or `{ arc_length = m }`. Between nodes the two
        /// neighbors share it by the lever rule.
        pub node: Point<D> = TABLE,
        /// Mass, kg; gravity and mass-proportional damping act on it.
        pub mass: D = Quantity::positive("kg"),
    }
}

impl PointMass {
    /// Point mass of `mass`, kg, at a point of the rod.
    pub fn new(node: Point, mass: f64) -> Self {
        Self { node, mass }
    }
}

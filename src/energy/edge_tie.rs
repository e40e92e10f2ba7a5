//! A spring between a point of an edge and a fixed point of the world.
//!
//! [`EdgeTie`] is a user-defined energy over two nodes. With their positions `x0` and `x1`, m, and the weight `w` of
//! the second, its energy is `k |x0 + w (x1 - x0) - p|^2/2`, J. The stiffness `k`, N/m, is its parameter, and the fixed
//! point `p`, m, is in world axes. It has no hand-derived derivatives: they are computed in dual numbers. Shapes
//! through recorded markers between nodes relax with these springs.

use crate::energy::own::OwnEnergy;
use crate::energy::place::{Directors, Place};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, components, dot};
use crate::scene::number::Quantity;

/// The spring of a point of an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeTie {
    /// Weight of the second node, 0 to 1; the first has the rest.
    pub weight: f64,
    /// Fixed point in world axes, m.
    pub point: [f64; 3],
}

impl OwnEnergy<2, 1> for EdgeTie {
    const PARAMETERS: [(&'static str, Quantity); 1] = [("stiffness", Quantity::positive("N/m"))];

    /// `k |x0 + w (x1 - x0) - p|^2/2`, J: half the stiffness `k`, N/m, times the squared distance of the point of the
    /// edge from the fixed point `p`. `x0` and `x1` are the nodes, m, `w` is the weight.
    fn energy<D: Scalar>(
        &self,
        _: &Place<D>,
        [stiffness]: &[D; 1],
        [a, b]: &[Vector<D>; 2],
        _: &[Directors<D>],
    ) -> D {
        let way = components(|c| a[c] * (1.0 - self.weight) + b[c] * self.weight - self.point[c]);
        *stiffness * dot(way, way) * 0.5
    }
}

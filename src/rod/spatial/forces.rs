//! The gradient of a spatial rod alone, edge after edge.

use crate::energy::joint::Edge;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, scale, sub};

/// Unknowns from one node to the next.
pub(super) const STRIDE: usize = 4;

/// An edge whose last joint is still to come.
pub(super) struct Open<D> {
    pub(super) edge: Edge<D>,
    /// The tangent it moved from.
    pub(super) from: Vector<D>,
    /// The axial force, N, and the derivatives by the joint before.
    pub(super) force: D,
    pub(super) pull: [D; 3],
}

impl<D: Scalar> Open<D> {
    /// The gradient by the edge's vector and angle, with the derivatives by the joint after.
    #[inline(always)]
    pub(super) fn closed(&self, by: [D; 3]) -> [D; 4] {
        let [p, q, torque] = add(self.pull, by);
        let along = scale(self.edge.tangent, self.force);
        let [x, y, z] = add(along, self.edge.across([p, q]));
        [x, y, z, torque]
    }
}

/// Writes a gradient by nodes from that by edges, one after the other.
pub(super) struct Forces<'a, D> {
    pub(super) gradient: &'a mut [D],
    /// By the edge before, N.
    pub(super) carried: Vector<D>,
}

impl<D: Scalar> Forces<'_, D> {
    /// Edge `i` with the gradient by its vector and angle, and the `load` on its first node, N.
    #[inline(always)]
    pub(super) fn edge(&mut self, i: usize, [x, y, z, torque]: [D; 4], load: Vector<D>) {
        let [a, b, c] = sub(sub(self.carried, [x, y, z]), load);
        let node: &mut [D; 4] = self.gradient[STRIDE * i..].first_chunk_mut().expect("a node");
        *node = [a, b, c, torque];
        self.carried = [x, y, z];
    }

    /// The last node, `i`.
    #[inline(always)]
    pub(super) fn end(self, i: usize, load: Vector<D>) {
        self.gradient[STRIDE * i..].copy_from_slice(&sub(self.carried, load));
    }
}

//! Edge coordinates: edge vectors instead of node positions as unknowns of a long rod that is held at its start only.
//!
//! In node positions bending is a fourth difference: the condition number of the tangent of `N` nodes is proportional
//! to `N^4`, and from about 10^4 nodes on its smallest eigenvalues are rounding errors. In edge vectors `e_j` it is a
//! second difference. Node `i` is at `x_0 + sum_{j < i} e_j`. Dead loads are linear in the edges, and elements depend
//! on edges only. So the tangent `T' K T`, with the matrix `T` of these sums, is a band as well. Its condition number
//! is proportional to `N^2`, and by Sylvester's law it has as many negative eigenvalues as `K`. It is assembled from
//! the derivatives of the elements ([`Rod::edge_tangent`]), never from `K`.
//!
//! In every vector, edge `j` has the indices of node `j + 1`; angles keep theirs.
//!
//! [`EdgeCoordinates`] converts lists of all unknowns, in place: forces on nodes (N) to those on edges (`edge_forces`,
//! `T' f`), changes of edges (m) to those of nodes (`node_changes`, `T e`). `metric` returns the weights (kg) that
//! replace the masses, `change` the difference of an edge vector between two states. They exist only for a rod with
//! more than [`MANY_NODES`] nodes whose only held unknowns are at its start (`new`), without user-defined energies or
//! loads without a potential (`Discretized::edge_coordinates`).

use crate::numerics::scalar::Scalar;
use crate::rod::Rod;
use std::ops::Range;

/// Number of nodes above which rods are solved in edge coordinates. In node coordinates rounding errors are then a
/// thousandth of the smallest eigenvalue.
const MANY_NODES: usize = 2000;

/// The transformation between the edge vectors and the node positions of a rod with `stride` unknowns per node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeCoordinates {
    stride: usize,
}

impl EdgeCoordinates {
    /// Edge coordinates of a rod with `stride` unknowns per node and `unknowns` in all, of which those in the range
    /// `free` move. `None` unless the position of the first node is held, the last unknown is free, and there are more
    /// than [`MANY_NODES`] nodes.
    pub fn new(stride: usize, free: &Range<usize>, unknowns: usize) -> Option<Self> {
        let hangs = free.start >= stride.min(3) && free.end == unknowns;
        (hangs && unknowns > MANY_NODES * stride).then_some(Self { stride })
    }

    /// Weights of squared changes of the unknowns, one per unknown, in place of the masses of node coordinates, kg (kg
    /// m^2 for angles). Each component of an edge vector has the sum of all node masses times the number of nodes; an
    /// angle keeps its inertia.
    pub fn metric<R: Rod<f64>>(&self, rod: &R) -> Vec<f64> {
        let mass = rod.mass();
        let total: f64 = mass.iter().step_by(self.stride).sum();
        // A change of all edges moves the tip by their sum.
        let edge = total * (mass.len() / self.stride) as f64;
        let one = |(i, m): (usize, &f64)| if R::is_angle(i) { *m } else { edge };
        mass.iter().enumerate().map(one).collect()
    }

    /// Replaces forces on nodes by forces on edges, `T' f`, in place: each component of a node's force becomes its sum
    /// over this node and all nodes after it. Edge `j` has the entries of node `j + 1`, the first node the sum of all.
    /// Angles stay.
    pub fn edge_forces<D: Scalar, R: Rod<D>>(&self, forces: &mut [D]) {
        for i in (0..forces.len() - self.stride).rev().filter(|i| !R::is_angle(*i)) {
            let beyond = forces[i + self.stride];
            forces[i] += beyond;
        }
    }

    /// Replaces changes of edge vectors by changes of node positions, `T e`, in place: running sums along the rod, from
    /// the change of the first node's position on. Angles stay.
    pub fn node_changes<D: Scalar, R: Rod<D>>(&self, changes: &mut [D]) {
        for i in (self.stride..changes.len()).filter(|i| !R::is_angle(*i)) {
            let before = changes[i - self.stride];
            changes[i] += before;
        }
    }

    /// Change of unknown `i` in edge coordinates from the node state `from` to `to`. It is that of the edge vector that
    /// ends at the node, of the position of the first node, or of an angle.
    pub fn change<R: Rod<f64>>(&self, i: usize, to: &[f64], from: &[f64]) -> f64 {
        match R::is_angle(i) || i < self.stride {
            true => to[i] - from[i],
            false => (to[i] - to[i - self.stride]) - (from[i] - from[i - self.stride]),
        }
    }
}

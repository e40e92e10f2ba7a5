//! Edge coordinates: edges instead of nodes as unknowns.
//!
//! Bending in terms of nodes is a fourth difference: the condition of the tangent of `N` nodes goes
//! with `N^4`, and from some 10^4 nodes on its smallest eigenvalues are rounding errors. In terms of
//! edges it is a second difference. Of a rod that is held at its start and nowhere else node `i` is at `x_0 + sum_{j < i} e_j`, dead loads are linear in the edges, and elements know edges
//! only. So the tangent `T' K T`, with `T` the sums, is a band as well, its condition goes with
//! `N^2`, and by Sylvester's law it has as many negative eigenvalues as `K`. It is assembled from
//! the elements' own derivatives ([`Rod::edge_tangent`]), never from `K`.
//!
//! Edge `j` takes the places of node `j + 1` in every vector; angles keep theirs.

use crate::numerics::scalar::Scalar;
use crate::rod::Rod;
use std::ops::Range;

/// From so many nodes on rods are solved in edge coordinates: rounding has a thousandth in the tangent of
/// nodes.
const MANY: usize = 2000;

/// The edges of a rod as its unknowns, with so many unknowns from one node to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeCoordinates {
    stride: usize,
}

impl EdgeCoordinates {
    /// The edge coordinates of a rod of which the unknowns in `free` move, if it is long and hangs
    /// from its start.
    pub fn of(stride: usize, free: &Range<usize>, unknowns: usize) -> Option<Self> {
        let hangs = free.start >= stride.min(3) && free.end == unknowns;
        (hangs && unknowns > MANY * stride).then_some(Self { stride })
    }

    /// What measures changes of edges as masses do those of nodes.
    pub fn metric<R: Rod<f64>>(&self, rod: &R) -> Vec<f64> {
        let mass = rod.mass();
        let total: f64 = mass.iter().step_by(self.stride).sum();
        // All edges together move the tip.
        let edge = total * (mass.len() / self.stride) as f64;
        let one = |(i, m): (usize, &f64)| if R::is_angle(i) { *m } else { edge };
        mass.iter().enumerate().map(one).collect()
    }

    /// Forces on nodes as forces on edges: those of all nodes beyond.
    pub fn gather<D: Scalar, R: Rod<D>>(&self, forces: &mut [D]) {
        for i in (0..forces.len() - self.stride).rev().filter(|i| !R::is_angle(*i)) {
            let beyond = forces[i + self.stride];
            forces[i] += beyond;
        }
    }

    /// Changes of edges as changes of nodes.
    pub fn spread<D: Scalar, R: Rod<D>>(&self, changes: &mut [D]) {
        for i in (self.stride..changes.len()).filter(|i| !R::is_angle(*i)) {
            let before = changes[i - self.stride];
            changes[i] += before;
        }
    }

    /// How much unknown `i` differs between two states.
    pub fn change<R: Rod<f64>>(&self, i: usize, to: &[f64], from: &[f64]) -> f64 {
        match R::is_angle(i) || i < self.stride {
            true => to[i] - from[i],
            false => (to[i] - to[i - self.stride]) - (from[i] - from[i - self.stride]),
        }
    }
}

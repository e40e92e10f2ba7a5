//! Storage of gradient and tangent of a rod node by node, from entries of several nodes in SIMD lanes.
//!
//! The tangent is a symmetric band matrix, stored column by column as the diagonal and the `W` entries below it.
//! [`NodeEntries`] has gradient, N, and columns, N/m, for one node per lane, with `K` unknowns each.
//! [`NodeColumns::write`] overwrites the gradient and the matrix with them; lanes beyond the rod are left out.
//! `write_gradient` overwrites the gradient alone, with the elastic one less the dead loads on the first `N` unknowns
//! of each node. `loads` collects the dead loads of the nodes in lanes, N, zero beyond the last node. The sinks of
//! planar and spatial rods use it.

use crate::energy::DeadLoad;
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{Scalar, SimdScalar};
use crate::rod::blocks::block;
use std::ops::Range;

/// Gradient and columns of the tangent of one node per SIMD lane: its `K` unknowns, with `W` entries below the
/// diagonal.
pub(super) struct NodeEntries<V, const K: usize, const W: usize> {
    /// Gradient of energy less loads, N.
    pub gradient: [V; K],
    /// Diagonal entries of the tangent, N/m.
    pub diagonal: [V; K],
    /// Entries below the diagonal, N/m.
    pub below: [[V; W]; K],
}

/// The gradient and the columns of the tangent to be written, grouped by nodes of `K` unknowns.
pub(super) struct NodeColumns<'a, D, const K: usize, const W: usize> {
    /// The gradient of complete nodes.
    pub gradient: &'a mut [[D; K]],
    /// The gradient of a last node with fewer unknowns.
    pub rest: &'a mut [D],
    pub diagonal: &'a mut [[D; K]],
    pub below: &'a mut [[[D; W]; K]],
}

impl<'a, D: Scalar, const K: usize, const W: usize> NodeColumns<'a, D, K, W> {
    /// Views of a `gradient` and of the columns of the band matrix `tangent`, in groups of the `K` unknowns of a
    /// node. The gradient of an incomplete last node is `rest`.
    #[inline(always)]
    pub fn new(gradient: &'a mut [D], tangent: &'a mut BandMatrix<D, W>) -> Self {
        let (gradient, rest) = gradient.as_chunks_mut();
        let (diagonal, below) = tangent.columns_mut();
        Self { gradient, rest, diagonal, below }
    }

    /// Overwrites gradient and columns of the tangent with the entries `columns`, one node per SIMD lane from index
    /// `first` on, at most `left` nodes. Lanes beyond them are not written.
    #[inline(always)]
    pub fn write<V: SimdScalar<D>>(
        &mut self,
        first: usize,
        left: usize,
        columns: &NodeEntries<V, K, W>,
    ) {
        // The number of nodes is a constant for the compiler except in the last block.
        if left >= V::LANES {
            self.write_nodes(first..first + V::LANES, columns);
        } else {
            self.write_nodes(first..first + left, columns);
        }
    }

    /// Overwrites gradient, diagonal and entries below it of a range of nodes; lane 0 of `columns` is the first node
    /// of the range.
    #[inline(always)]
    fn write_nodes<V: SimdScalar<D>>(
        &mut self,
        nodes: Range<usize>,
        columns: &NodeEntries<V, K, W>,
    ) {
        for (lane, to) in self.gradient[nodes.clone()].iter_mut().enumerate() {
            *to = V::extract_lane(&columns.gradient, lane);
        }
        for (lane, to) in self.diagonal[nodes.clone()].iter_mut().enumerate() {
            *to = V::extract_lane(&columns.diagonal, lane);
        }
        for (lane, to) in self.below[nodes].iter_mut().enumerate() {
            for c in 0..K {
                to[c] = V::extract_lane(&columns.below[c], lane);
            }
        }
    }
}

/// Overwrites `gradient`, N, of the nodes from index `first` on, one per SIMD lane, at most `left` nodes. Written are
/// the `elastic` gradient less the dead loads on the first `N` of the `K` unknowns.
#[inline(always)]
pub(super) fn write_gradient<D: Scalar, V: SimdScalar<D>, const K: usize, const N: usize>(
    (first, left): (usize, usize),
    elastic: &[V; K],
    load: &[DeadLoad<D, N>],
    gradient: &mut [[D; K]],
) {
    // A constant for the compiler except in the last block, so that the loop is unrolled.
    let count = if left >= V::LANES { V::LANES } else { left };
    let (load, gradient) = (&load[first..first + count], &mut gradient[first..first + count]);
    for lane in 0..count {
        let mut own = V::extract_lane(elastic, lane);
        for c in 0..N {
            own[c] -= load[lane].force[c];
        }
        gradient[lane] = own;
    }
}

/// The dead loads on the nodes from `first` on, N, one array entry per coordinate and one node per lane; zero beyond
/// the last node.
#[inline(always)]
pub(super) fn loads<D: Scalar, V: SimdScalar<D>, const N: usize>(
    all: &[DeadLoad<D, N>],
    level: V::Level,
    first: usize,
) -> [V; N] {
    let mut room = None;
    let load = block::<D, V, _>(all, first, DeadLoad { force: [D::from(0.0); N] }, &mut room);
    let mut forces = [V::gather(level, |lane| load[lane].force[0]); N];
    for c in 1..N {
        forces[c] = V::gather(level, |lane| load[lane].force[c]);
    }
    forces
}

//! Assembly of gradient and tangent of a planar rod from the derivatives of its energy by edges, in SIMD lanes.
//!
//! An edge vector is the position of its second node less that of its first. The forces on a node are therefore
//! differences of edge derivatives. [`PlanarNodes`] overwrites gradient (N, less the dead loads) and band matrix
//! (N/m) by nodes. [`PlanarEdges`] adds to a band matrix by edges: edge `i` has the rows and columns of node `i + 1`.

use crate::energy::DeadLoad;
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{Scalar, SimdScalar};
use crate::numerics::tangent::Tangent;
use crate::rod::columns::{NodeColumns, NodeEntries, loads};
use crate::rod::layout::{EdgeSink, NodeSink, Plane};

/// Half-bandwidth of the planar tangent: a bend couples six successive unknowns.
pub const HALF_BANDWIDTH: usize = 5;

/// Derivatives of the energies of an edge's stretching and of both its joints by the edge's vector.
#[derive(Clone, Copy)]
pub struct ByEdge<D> {
    /// First derivatives, N.
    pub(super) gradient: [D; 2],
    /// Second derivatives `xx, yx, yy`, N/m.
    pub(super) vector: [D; 3],
}

impl<D: Scalar> ByEdge<D> {
    /// The sum of these derivatives and of a `gradient`, N, and second derivatives `vector` in the order `xx, yx, yy`,
    /// N/m.
    pub(super) fn plus(&self, gradient: [D; 2], vector: [D; 3]) -> Self {
        let ([gx, gy], [xx, yx, yy]) = (self.gradient, self.vector);
        Self {
            gradient: [gx + gradient[0], gy + gradient[1]],
            vector: [xx + vector[0], yx + vector[1], yy + vector[2]],
        }
    }
}

/// A consumer of edge derivatives that writes gradient and tangent by nodes, column after column.
pub(super) struct PlanarNodes<'a, D, V: SimdScalar<D>> {
    level: V::Level,
    load: &'a [DeadLoad<D, 2>],
    nodes: NodeColumns<'a, D, 2, HALF_BANDWIDTH>,
    /// Derivatives by the edges of the previous block.
    before: ByEdge<V>,
    /// Derivatives between the next edges (rows) and those of the previous block (columns).
    between: [[V; 2]; 2],
}

impl<'a, D: Scalar, V: SimdScalar<D>> PlanarNodes<'a, D, V> {
    /// The consumer before the first edge, which will overwrite `gradient` and `tangent`. `load` are the dead loads on
    /// all nodes, N; the derivatives of the edge before the first one are zero.
    #[inline(always)]
    pub(super) fn new(
        level: V::Level,
        load: &'a [DeadLoad<D, 2>],
        gradient: &'a mut [D],
        tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    ) -> Self {
        let zero = V::gather(level, |_| D::from(0.0));
        let before = ByEdge { gradient: [zero; 2], vector: [zero; 3] };
        let nodes = NodeColumns::new(gradient, tangent);
        Self { level, load, nodes, before, between: [[zero; 2]; 2] }
    }
}

impl<D: Scalar, V: SimdScalar<D>> EdgeSink<V, Plane, 2, 1> for PlanarNodes<'_, D, V> {
    /// Overwrites gradient, less loads, and columns of the nodes at the start of the edges from index `first` on, one
    /// per lane. `own` are the derivatives by these edges, `after` those between the next edges (rows) and these
    /// (columns). Both are kept for the next block.
    #[inline(always)]
    fn edges(&mut self, first: usize, own: &ByEdge<V>, after: &[[V; 2]; 2]) {
        let ([gx, gy], [xx, yx, yy]) = (own.gradient, own.vector);
        let [[a00, a01], [a10, a11]] = *after;
        // The derivatives by the edges before these, lane by lane.
        let (force, vector, between) = (&self.before.gradient, &self.before.vector, &self.between);
        let (px, py) = (gx.before(force[0]), gy.before(force[1]));
        let (pxx, pyx, pyy) = (xx.before(vector[0]), yx.before(vector[1]), yy.before(vector[2]));
        let (b00, b01) = (a00.before(between[0][0]), a01.before(between[0][1]));
        let (b10, b11) = (a10.before(between[1][0]), a11.before(between[1][1]));
        let [lx, ly] = loads::<D, V, 2>(self.load, self.level, first);
        // A node is the end of one edge and the start of the next, which gives the signs: `e = x1 - x0`.
        let columns = NodeEntries {
            gradient: [px - gx - lx, py - gy - ly],
            diagonal: [pxx + xx - (b00 + b00), pyy + yy - (b11 + b11)],
            below: [
                [pyx + yx - b01 - b10, b00 + a00 - xx, b10 + a10 - yx, -a00, -a10],
                [b01 + a01 - yx, b11 + a11 - yy, -a01, -a11, gx.like(0.0)],
            ],
        };
        self.nodes.write(first, self.load.len() - 1 - first, &columns);
        (self.before, self.between) = (*own, *after);
    }
}

impl<D: Scalar, V: SimdScalar<D>> NodeSink<V, Plane, 2, 1> for PlanarNodes<'_, D, V> {
    /// Overwrites gradient, less its load, and columns of the last node, where only the last edge ends.
    #[inline(always)]
    fn end(self) {
        let (i, zero) = (self.load.len() - 1, D::from(0.0));
        // The last edge is in the block that was kept.
        let lane = (i - 1) % V::LANES;
        let [px, py] = V::extract_lane(&self.before.gradient, lane);
        let [xx, yx, yy] = V::extract_lane(&self.before.vector, lane);
        let load = &self.load[i].force;
        self.nodes.gradient[i] = [px - load[0], py - load[1]];
        self.nodes.diagonal[i] = [xx, yy];
        self.nodes.below[i] = [[yx, zero, zero, zero, zero], [zero; HALF_BANDWIDTH]];
    }
}

/// A consumer that adds second derivatives by edges to a band matrix.
pub(super) struct PlanarEdges<'a, D> {
    pub(super) tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    /// The last edge.
    pub(super) last: usize,
}

impl<D: Scalar, V: SimdScalar<D>> EdgeSink<V, Plane, 2, 1> for PlanarEdges<'_, D> {
    /// Adds the second derivatives `own` by the edges from index `first` on, and `after` between the next edges (rows)
    /// and these (columns), to the band matrix. Edge `i` has the columns `2i + 2` and `2i + 3`. Lanes beyond the last
    /// edge are left out.
    fn edges(&mut self, first: usize, own: &ByEdge<V>, after: &[[V; 2]; 2]) {
        let z = D::from(0.0);
        for lane in 0..V::LANES.min(self.last + 1 - first) {
            let i = first + lane;
            let [xx, yx, yy] = V::extract_lane(&own.vector, lane);
            let (a, b) = (V::extract_lane(&after[0], lane), V::extract_lane(&after[1], lane));
            let rows = [[xx, z, z, z], [yx, yy, z, z], [a[0], a[1], z, z], [b[0], b[1], z, z]];
            self.tangent.add_corner(2 * i + 2, if i < self.last { 4 } else { 2 }, &rows);
        }
    }
}

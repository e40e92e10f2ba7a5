//! Assembly of gradient and tangent of a spatial rod from the derivatives of its energy by edges, in SIMD lanes.
//!
//! An edge vector is the position of its second node less that of its first. The forces on a node are therefore
//! differences of edge derivatives. [`SpatialNodes`] overwrites gradient (N, N m for angles; less the dead loads) and
//! band matrix (N/m) by nodes. Its columns per node are three coordinates, then the angle of the edge after the node.
//! [`SpatialEdges`] adds second derivatives by edge coordinates, the angles and vectors of edges instead of positions
//! of nodes, to a band matrix. There edge `i` has the columns `4i + 3` (its angle) to `4i + 6` (its vector): the vector
//! has the columns of node `i + 1`.

use crate::energy::DeadLoad;
use crate::energy::joint::{Between, ByEdge};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{Scalar, SimdScalar};
use crate::numerics::tangent::Tangent;
use crate::rod::columns::{NodeColumns, NodeEntries, loads};
use crate::rod::layout::{EdgeSink, NodeSink, Space};

/// Half-bandwidth of the spatial tangent: a joint couples 11 successive unknowns.
pub const HALF_BANDWIDTH: usize = 10;
/// Unknowns from one node to the next: three coordinates and one angle.
pub(super) const STRIDE: usize = 4;

/// A consumer of edge derivatives that writes gradient and tangent by nodes, column after column.
pub(super) struct SpatialNodes<'a, D, V: SimdScalar<D>> {
    level: V::Level,
    load: &'a [DeadLoad<D, 3>],
    nodes: NodeColumns<'a, D, 4, HALF_BANDWIDTH>,
    /// First derivatives by the vectors of the edges of the previous block, N.
    force: [V; 3],
    /// Second derivatives by these vectors, N/m.
    vector: [[V; 3]; 3],
    /// Derivatives between the next edges (rows) and these (columns).
    between: Between<V>,
}

impl<'a, D: Scalar, V: SimdScalar<D>> SpatialNodes<'a, D, V> {
    /// The consumer before the first edge, which will overwrite `gradient` and `tangent`. `load` are the dead loads
    /// on all nodes, N; the derivatives of the edge before the first one are zero.
    #[inline(always)]
    pub fn new(
        level: V::Level,
        load: &'a [DeadLoad<D, 3>],
        gradient: &'a mut [D],
        tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    ) -> Self {
        let zero = V::gather(level, |_| D::from(0.0));
        let nodes = NodeColumns::new(gradient, tangent);
        let (force, vector, between) = ([zero; 3], [[zero; 3]; 3], [[zero; 4]; 4]);
        Self { level, load, nodes, force, vector, between }
    }
}

impl<D: Scalar, V: SimdScalar<D>> EdgeSink<V, Space, 3, 3> for SpatialNodes<'_, D, V> {
    /// Overwrites gradient and columns of the nodes at the start of the edges from index `first` on, one per lane.
    /// `own` are the derivatives by these edges, `after` those between the next edges (rows) and these (columns).
    /// Edge derivatives of this block are kept for the next one.
    #[inline(always)]
    fn edges(&mut self, first: usize, own: &ByEdge<V>, after: &Between<V>) {
        // A node is the end of one edge and the start of the next: differences of edge
        // derivatives.
        let (x, t) = (&own.vector, &own.angle_vector);
        let [gx, gy, gz, torque] = own.gradient;
        let load = loads::<D, V, 3>(self.load, self.level, first);
        let gradient = [
            gx.before(self.force[0]) - gx - load[0],
            gy.before(self.force[1]) - gy - load[1],
            gz.before(self.force[2]) - gz - load[2],
            torque,
        ];
        // The derivatives between the edges before these and these, lane by lane.
        let mut before = *after;
        for r in 0..4 {
            for c in 0..3 {
                before[r][c] = after[r][c].before(self.between[r][c]);
            }
        }
        // Rows of the same node, of the next, and of the one after that.
        let (mut here, mut next, mut far, mut turn) = (*x, *x, *x, *t);
        for r in 0..3 {
            for c in 0..3 {
                if c <= r {
                    let vector = x[r][c].before(self.vector[r][c]);
                    here[r][c] = vector + x[r][c] - before[r][c] - before[c][r];
                }
                next[r][c] = before[r][c] - x[r.max(c)][r.min(c)] + after[r][c];
                far[r][c] = -after[r][c];
            }
            turn[r] = before[3][r] - t[r];
        }
        let mut below = [[gx.like(0.0); HALF_BANDWIDTH]; 4];
        for c in 0..3 {
            // The node itself, its edge, the next node and its edge, and the node after that.
            for r in c + 1..3 {
                below[c][r - c - 1] = here[r][c];
            }
            below[c][2 - c] = turn[c];
            below[c][6 - c] = -after[3][c];
            for r in 0..3 {
                below[c][3 - c + r] = next[r][c];
                below[c][7 - c + r] = far[r][c];
            }
            below[3][c] = t[c] - after[c][3];
            below[3][4 + c] = after[c][3];
        }
        below[3][3] = after[3][3];
        // Four columns per node: three coordinates, and the angle of the edge after it.
        let diagonal = [here[0][0], here[1][1], here[2][2], own.angle];
        let columns = NodeEntries { gradient, diagonal, below };
        self.nodes.write(first, self.load.len() - 1 - first, &columns);
        (self.force, self.vector, self.between) = ([gx, gy, gz], own.vector, *after);
    }
}

impl<D: Scalar, V: SimdScalar<D>> NodeSink<V, Space, 3, 3> for SpatialNodes<'_, D, V> {
    /// Overwrites gradient and columns of the last node from the last edge and its load. The column of the angle
    /// beyond the last edge is set to zero.
    #[inline(always)]
    fn end(self) {
        let (i, zero) = (self.load.len() - 1, D::from(0.0));
        // The last node belongs to the last edge only.
        let lane = (i - 1) % V::LANES;
        let force = V::extract_lane(&self.force, lane);
        for c in 0..3 {
            self.nodes.rest[c] = force[c] - self.load[i].force[c];
        }
        let x = [0, 1, 2].map(|r| V::extract_lane(&self.vector[r], lane));
        let mut below = [[zero; HALF_BANDWIDTH]; 4];
        (below[0][0], below[0][1], below[1][0]) = (x[1][0], x[2][0], x[2][1]);
        // There is no edge after it: its column is beyond the matrix.
        self.nodes.diagonal[i] = [x[0][0], x[1][1], x[2][2], zero];
        self.nodes.below[i] = below;
    }
}

/// A consumer that adds second derivatives by edges, in the order angle, edge vector, angle and vector of the next
/// edge.
pub(super) struct SpatialEdges<'a, D> {
    pub tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    /// The last edge.
    pub last: usize,
}

impl<D: Scalar, V: SimdScalar<D>> EdgeSink<V, Space, 3, 3> for SpatialEdges<'_, D> {
    /// Adds the second derivatives `own` by the edges from index `first` on, and `after` between the next edges and
    /// these, to the band matrix. Edge `i` has the columns `4i + 3` (angle) to `4i + 6` (vector). Lanes beyond the
    /// last edge are left out.
    fn edges(&mut self, first: usize, own: &ByEdge<V>, after: &Between<V>) {
        // The angle of an edge is stored before its vector: column 4i + 3.
        const ORDER: [usize; 4] = [3, 0, 1, 2];
        for lane in 0..V::LANES.min(self.last + 1 - first) {
            let i = first + lane;
            let mut block = [[D::from(0.0); 8]; 8];
            block[0][0] = own.angle.lane(lane);
            for r in 0..3 {
                block[1 + r][0] = own.angle_vector[r].lane(lane);
                block[1 + r][1..4].copy_from_slice(&V::extract_lane(&own.vector[r], lane));
            }
            for (row, r) in block[4..].iter_mut().zip(ORDER) {
                row[..4].copy_from_slice(&ORDER.map(|c| after[r][c].lane(lane)));
            }
            self.tangent.add_corner(4 * i + 3, if i < self.last { 8 } else { 4 }, &block);
        }
    }
}

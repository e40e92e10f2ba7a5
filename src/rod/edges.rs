//! Gradient and tangent of a spatial rod by nodes or by edges, from the derivatives of its energy by edges. An edge
//! vector is the position of its second node less that of its first.

use crate::energy::DeadLoad;
use crate::energy::joint::{Between, ByEdge};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{Scalar, SimdScalar};
use crate::numerics::tangent::Tangent;
use crate::rod::blocks::block;
use crate::rod::layout::{EdgeSink, NodeSink, Space};

/// Half-bandwidth of the spatial tangent.
pub const HALF_BANDWIDTH: usize = 10;
/// Unknowns from one node to the next.
pub(super) const STRIDE: usize = 4;

/// What stands below the diagonal in the columns of a node and its edge.
type Below<D> = [[D; HALF_BANDWIDTH]; 4];

/// Writes gradient and tangent by nodes, column after column.
pub(super) struct ToNodes<'a, D, V: SimdScalar<D>> {
    level: V::Level,
    load: &'a [DeadLoad<D, 3>],
    gradient: &'a mut [D],
    /// Of the tangent, four columns for each node.
    diagonal: &'a mut [[D; 4]],
    below: &'a mut [Below<D>],
    /// The first and second derivatives by the vectors of the edges before, and the derivatives between the next edges
    /// (rows) and them (columns).
    force: [V; 3],
    vector: [[V; 3]; 3],
    between: Between<V>,
}

impl<'a, D: Scalar, V: SimdScalar<D>> ToNodes<'a, D, V> {
    #[inline(always)]
    pub fn new(
        level: V::Level,
        load: &'a [DeadLoad<D, 3>],
        gradient: &'a mut [D],
        tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    ) -> Self {
        let zero = V::gather(level, |_| D::from(0.0));
        let (diagonal, below) = tangent.columns_mut();
        let (force, vector, between) = ([zero; 3], [[zero; 3]; 3], [[zero; 4]; 4]);
        Self { level, load, gradient, diagonal, below, force, vector, between }
    }
}

/// What is written of nodes side by side.
struct Columns<V> {
    gradient: [V; 4],
    diagonal: [V; 4],
    below: Below<V>,
}

impl<V: Scalar> Columns<V> {
    /// Writes the nodes of as many lanes as there is room for.
    #[inline(always)]
    fn write<D: Scalar>(&self, [gradient, diagonal]: [&mut [[D; 4]]; 2], below: &mut [Below<D>])
    where
        V: SimdScalar<D>,
    {
        for (lane, to) in gradient.iter_mut().enumerate() {
            *to = V::extract_lane(&self.gradient, lane);
        }
        for (lane, to) in diagonal.iter_mut().enumerate() {
            *to = V::extract_lane(&self.diagonal, lane);
        }
        for (lane, to) in below.iter_mut().enumerate() {
            for c in 0..4 {
                to[c] = V::extract_lane(&self.below[c], lane);
            }
        }
    }
}

impl<D: Scalar, V: SimdScalar<D>> EdgeSink<V, Space, 3, 3> for ToNodes<'_, D, V> {
    #[inline(always)]
    fn edges(&mut self, first: usize, own: &ByEdge<V>, after: &Between<V>) {
        let (x, t) = (&own.vector, &own.angle_vector);
        let [gx, gy, gz, torque] = own.gradient;
        let mut room = None;
        let none = DeadLoad { force: [D::from(0.0); 3] };
        let load = block::<D, V, _>(self.load, first, none, &mut room);
        let load = [
            V::gather(self.level, |lane| load[lane].force[0]),
            V::gather(self.level, |lane| load[lane].force[1]),
            V::gather(self.level, |lane| load[lane].force[2]),
        ];
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
        let zero = gx.like(0.0);
        let columns = Columns {
            gradient,
            diagonal: [here[0][0], here[1][1], here[2][2], own.angle],
            below: [
                [
                    here[1][0],
                    here[2][0],
                    turn[0],
                    next[0][0],
                    next[1][0],
                    next[2][0],
                    -after[3][0],
                    far[0][0],
                    far[1][0],
                    far[2][0],
                ],
                [
                    here[2][1],
                    turn[1],
                    next[0][1],
                    next[1][1],
                    next[2][1],
                    -after[3][1],
                    far[0][1],
                    far[1][1],
                    far[2][1],
                    zero,
                ],
                [
                    turn[2],
                    next[0][2],
                    next[1][2],
                    next[2][2],
                    -after[3][2],
                    far[0][2],
                    far[1][2],
                    far[2][2],
                    zero,
                    zero,
                ],
                [
                    t[0] - after[0][3],
                    t[1] - after[1][3],
                    t[2] - after[2][3],
                    after[3][3],
                    after[0][3],
                    after[1][3],
                    after[2][3],
                    zero,
                    zero,
                    zero,
                ],
            ],
        };
        let left = self.load.len() - 1 - first;
        let (gradient, diagonal) = (self.gradient.as_chunks_mut().0, &mut *self.diagonal);
        // How many there are is known when this is compiled, but for the last ones.
        if left >= V::LANES {
            let span = first..first + V::LANES;
            let both = [&mut gradient[span.clone()], &mut diagonal[span.clone()]];
            columns.write(both, &mut self.below[span]);
        } else {
            let span = first..first + left;
            let both = [&mut gradient[span.clone()], &mut diagonal[span.clone()]];
            columns.write(both, &mut self.below[span]);
        }
        (self.force, self.vector, self.between) = ([gx, gy, gz], own.vector, *after);
    }
}

impl<D: Scalar, V: SimdScalar<D>> NodeSink<V, Space, 3, 3> for ToNodes<'_, D, V> {
    #[inline(always)]
    fn end(self) {
        let (i, zero) = (self.load.len() - 1, D::from(0.0));
        let lane = (i - 1) % V::LANES;
        let force = V::extract_lane(&self.force, lane);
        for c in 0..3 {
            self.gradient[4 * i + c] = force[c] - self.load[i].force[c];
        }
        let x = [0, 1, 2].map(|r| V::extract_lane(&self.vector[r], lane));
        let mut below = [[zero; HALF_BANDWIDTH]; 4];
        (below[0][0], below[0][1], below[1][0]) = (x[1][0], x[2][0], x[2][1]);
        // There is no edge after it: its column is beyond the matrix.
        self.diagonal[i] = [x[0][0], x[1][1], x[2][2], zero];
        self.below[i] = below;
    }
}

/// Adds the second derivatives by edges, in the order of an angle, its edge vector, and those of the next edge.
pub(super) struct ToEdges<'a, D> {
    pub tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    /// The last edge.
    pub last: usize,
}

impl<D: Scalar, V: SimdScalar<D>> EdgeSink<V, Space, 3, 3> for ToEdges<'_, D> {
    fn edges(&mut self, first: usize, own: &ByEdge<V>, after: &Between<V>) {
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

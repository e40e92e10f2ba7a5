//! Tangents by nodes, made of derivatives by edges: an edge is its second node less its first.

use crate::energy::DeadLoad;
use crate::energy::joint::{Between, ByEdge, EdgeState, Joint};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::Scalar;

/// Half-bandwidth of the spatial tangent.
pub const HALF_BANDWIDTH: usize = 10;
const W: usize = HALF_BANDWIDTH;

/// What is shown the edges of a spatial rod, from the first on.
pub(super) trait TakesEdges<D> {
    /// Edge `i` as it is, with the joint after it and the next edge if there are.
    #[inline(always)]
    fn see(&mut self, _i: usize, _edge: &EdgeState<D>, _after: Option<(&Joint<D>, &EdgeState<D>)>) {
    }

    /// Edge `i`; `after` are the derivatives between the next edge (rows) and this one (columns).
    fn edge(&mut self, i: usize, own: &ByEdge<D>, after: &Between<D>);
}

/// Writes gradient and tangent by nodes, column after column.
pub(super) struct ToNodes<'a, D> {
    load: &'a [DeadLoad<D, 3>],
    gradient: &'a mut [D],
    tangent: &'a mut BandMatrix<D, W>,
    /// Of the edge before: the gradient by its vector, the second derivatives, and those between the
    /// edge that comes and it.
    force: [D; 3],
    vector: [[D; 3]; 3],
    between: Between<D>,
}

impl<'a, D: Scalar> ToNodes<'a, D> {
    #[inline(always)]
    pub fn new(
        load: &'a [DeadLoad<D, 3>],
        gradient: &'a mut [D],
        tangent: &'a mut BandMatrix<D, W>,
    ) -> Self {
        let zero = D::from(0.0);
        Self {
            load,
            gradient,
            tangent,
            force: [zero; 3],
            vector: [[zero; 3]; 3],
            between: [[zero; 4]; 4],
        }
    }

    /// The last node.
    #[inline(always)]
    pub fn end(self) {
        let (i, zero) = (self.load.len() - 1, D::from(0.0));
        for c in 0..3 {
            self.gradient[4 * i + c] = self.force[c] - self.load[i].force[c];
        }
        let x = &self.vector;
        let mut below = [[zero; W]; 3];
        (below[0][0], below[0][1], below[1][0]) = (x[1][0], x[2][0], x[2][1]);
        self.tangent.set_columns(4 * i, &[x[0][0], x[1][1], x[2][2]], &below);
    }
}

impl<D: Scalar> TakesEdges<D> for ToNodes<'_, D> {
    #[inline(always)]
    fn edge(&mut self, i: usize, own: &ByEdge<D>, after: &Between<D>) {
        let zero = D::from(0.0);
        let (x, before, t) = (&own.vector, &self.between, &own.angle_vector);
        let [gx, gy, gz, torque] = own.gradient;
        let load = &self.load[i].force;
        let g: &mut [D; 4] = self.gradient[4 * i..].first_chunk_mut().expect("a node of the rod");
        *g = [
            self.force[0] - gx - load[0],
            self.force[1] - gy - load[1],
            self.force[2] - gz - load[2],
            torque,
        ];
        // Rows of the same node, of the next, and of the one after that.
        let here = |r: usize, c: usize| self.vector[r][c] + x[r][c] - before[r][c] - before[c][r];
        let next = |r: usize, c: usize| before[r][c] - x[r.max(c)][r.min(c)] + after[r][c];
        let turn = |c: usize| before[3][c] - t[c];
        let far = |r: usize, c: usize| -after[r][c];
        let diagonal = [here(0, 0), here(1, 1), here(2, 2), own.angle];
        let below = [
            [
                here(1, 0),
                here(2, 0),
                turn(0),
                next(0, 0),
                next(1, 0),
                next(2, 0),
                far(3, 0),
                far(0, 0),
                far(1, 0),
                far(2, 0),
            ],
            [
                here(2, 1),
                turn(1),
                next(0, 1),
                next(1, 1),
                next(2, 1),
                far(3, 1),
                far(0, 1),
                far(1, 1),
                far(2, 1),
                zero,
            ],
            [
                turn(2),
                next(0, 2),
                next(1, 2),
                next(2, 2),
                far(3, 2),
                far(0, 2),
                far(1, 2),
                far(2, 2),
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
        ];
        self.tangent.set_columns(4 * i, &diagonal, &below);
        (self.force, self.vector, self.between) = ([gx, gy, gz], own.vector, *after);
    }
}

/// Adds what stands between edges: an angle, its edge, and the same of the next.
pub(super) struct ToEdges<'a, D> {
    pub tangent: &'a mut BandMatrix<D, W>,
    /// The last edge.
    pub last: usize,
}

impl<D: Scalar> TakesEdges<D> for ToEdges<'_, D> {
    fn edge(&mut self, i: usize, own: &ByEdge<D>, after: &Between<D>) {
        const ORDER: [usize; 4] = [3, 0, 1, 2];
        let mut block = [[D::from(0.0); 8]; 8];
        block[0][0] = own.angle;
        for r in 0..3 {
            block[1 + r][0] = own.angle_vector[r];
            block[1 + r][1..4].copy_from_slice(&own.vector[r]);
        }
        for (row, r) in block[4..].iter_mut().zip(ORDER) {
            row[..4].copy_from_slice(&ORDER.map(|c| after[r][c]));
        }
        self.tangent.add_corner(4 * i + 3, if i < self.last { 8 } else { 4 }, &block);
    }
}

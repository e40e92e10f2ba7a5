//! Derivatives by the edges of a planar rod, and where they go.

use crate::energy::DeadLoad;
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::Scalar;
use crate::rod::planar::geometry::{Edge, Measure};

/// Half-bandwidth of the planar tangent.
pub const HALF_BANDWIDTH: usize = 5;

/// Derivatives by an edge's vector: of the energies of its stretching and of both its joints.
#[derive(Clone, Copy)]
pub(super) struct ByEdge<D> {
    /// N.
    pub(super) gradient: [D; 2],
    /// `xx, yx, yy`, N/m.
    pub(super) vector: [D; 3],
}

impl<D: Scalar> ByEdge<D> {
    pub(super) fn plus(&self, gradient: [D; 2], vector: [D; 3]) -> Self {
        Self {
            gradient: std::array::from_fn(|c| self.gradient[c] + gradient[c]),
            vector: std::array::from_fn(|c| self.vector[c] + vector[c]),
        }
    }
}

/// What is shown the edges, from the first on.
pub(super) trait TakesEdges<D> {
    /// Edge `i` as it is, with the curvature of the joint after it if there is one.
    #[inline(always)]
    fn see(&mut self, _i: usize, _edge: &Edge<D>, _curvature: Option<D>) {}

    /// Edge `i`; `after` are the derivatives between the next edge (rows) and this one (columns).
    fn edge(&mut self, i: usize, own: &ByEdge<D>, after: &[[D; 2]; 2]);
}

/// Writes gradient and tangent by nodes, column after column: an edge is its second node less its first.
pub(super) struct ToNodes<'a, D> {
    pub(super) load: &'a [DeadLoad<D, 2>],
    pub(super) gradient: &'a mut [D],
    pub(super) tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    /// Of the edge before, with the derivatives between the edge that comes and it.
    pub(super) before: ByEdge<D>,
    pub(super) between: [[D; 2]; 2],
}

impl<'a, D: Scalar> ToNodes<'a, D> {
    #[inline(always)]
    pub(super) fn new(
        load: &'a [DeadLoad<D, 2>],
        gradient: &'a mut [D],
        tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    ) -> Self {
        let zero = D::from(0.0);
        let before = ByEdge { gradient: [zero; 2], vector: [zero; 3] };
        Self { load, gradient, tangent, before, between: [[zero; 2]; 2] }
    }

    /// The last node.
    #[inline(always)]
    pub(super) fn end(self) {
        let ([px, py], [xx, yx, yy]) = (self.before.gradient, self.before.vector);
        let i = self.load.len() - 1;
        let load = &self.load[i].force;
        (self.gradient[2 * i], self.gradient[2 * i + 1]) = (px - load[0], py - load[1]);
        let mut below = [[D::from(0.0); HALF_BANDWIDTH]; 2];
        below[0][0] = yx;
        self.tangent.set_columns(2 * i, &[xx, yy], &below);
    }
}

impl<D: Scalar> TakesEdges<D> for (ToNodes<'_, D>, Measure<'_, D>) {
    #[inline(always)]
    fn see(&mut self, i: usize, edge: &Edge<D>, curvature: Option<D>) {
        self.1.see(i, edge, curvature);
    }

    #[inline(always)]
    fn edge(&mut self, i: usize, own: &ByEdge<D>, after: &[[D; 2]; 2]) {
        self.0.edge(i, own, after);
    }
}

impl<D: Scalar> TakesEdges<D> for ToNodes<'_, D> {
    #[inline(always)]
    fn edge(&mut self, i: usize, own: &ByEdge<D>, after: &[[D; 2]; 2]) {
        let ([gx, gy], [xx, yx, yy]) = (own.gradient, own.vector);
        let ([px, py], [pxx, pyx, pyy]) = (self.before.gradient, self.before.vector);
        let [[b00, b01], [b10, b11]] = self.between;
        let [[a00, a01], [a10, a11]] = *after;
        let load = &self.load[i].force;
        let g: &mut [D; 2] = self.gradient[2 * i..].first_chunk_mut().expect("a node of the rod");
        *g = [px - gx - load[0], py - gy - load[1]];
        let diagonal = [pxx + xx - (b00 + b00), pyy + yy - (b11 + b11)];
        let below = [
            [pyx + yx - b01 - b10, b00 + a00 - xx, b10 + a10 - yx, -a00, -a10],
            [b01 + a01 - yx, b11 + a11 - yy, -a01, -a11, D::from(0.0)],
        ];
        self.tangent.set_columns(2 * i, &diagonal, &below);
        (self.before, self.between) = (*own, *after);
    }
}

/// Adds what stands between edges.
pub(super) struct ToEdges<'a, D> {
    pub(super) tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    /// The last edge.
    pub(super) last: usize,
}

impl<D: Scalar> TakesEdges<D> for ToEdges<'_, D> {
    fn edge(&mut self, i: usize, own: &ByEdge<D>, [a, b]: &[[D; 2]; 2]) {
        let ([xx, yx, yy], z) = (own.vector, D::from(0.0));
        let rows = [[xx, z, z, z], [yx, yy, z, z], [a[0], a[1], z, z], [b[0], b[1], z, z]];
        self.tangent.add_corner(2 * i + 2, if i < self.last { 4 } else { 2 }, &rows);
    }
}

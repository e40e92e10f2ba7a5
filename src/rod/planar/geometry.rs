//! Geometry of a planar rod: length, m, direction and axial strain of edges, curvature `2 tan(phi/2)` of joints with
//! the turning angle `phi`.
//!
//! [`PlanarEdge`] has edges in SIMD lanes during a sweep. [`Geometry`] keeps the results in plain numbers, one entry
//! per edge and per joint: also the derivative of each edge's angle by its vector, 1/m, and that of each curvature by
//! the turning angle. The products with derivatives along parameters use it.

use crate::numerics::scalar::{Scalar, SimdScalar};
use crate::rod::frames::RodGeometry;

/// Squared length, m^2, length, m, its inverse, and direction of edges in SIMD lanes.
#[derive(Clone, Copy)]
pub(super) struct PlanarEdge<D> {
    pub squared: D,
    pub length: D,
    pub inverse_length: D,
    pub tangent: [D; 2],
    /// Counter-clockwise of the tangent, over the length: the derivative of the edge's angle, 1/m.
    pub normal: [D; 2],
}

impl<D: Scalar> PlanarEdge<D> {
    /// The edge between two nodes with the coordinates `[x0, y0, x1, y1]`, m: its vector is the second less the first.
    /// Not finite for coinciding nodes.
    #[inline(always)]
    pub fn new([x0, y0, x1, y1]: &[D; 4]) -> Self {
        let e = [*x1 - *x0, *y1 - *y0];
        let squared = e[0] * e[0] + e[1] * e[1];
        let length = squared.sqrt();
        let inverse_length = length.recip();
        let tangent = [e[0] * inverse_length, e[1] * inverse_length];
        let normal = [-(tangent[1] * inverse_length), tangent[0] * inverse_length];
        Self { squared, length, inverse_length, tangent, normal }
    }

    /// The edges shifted by one SIMD lane towards earlier ones; the last lane is the first one of `later`.
    #[inline(always)]
    pub fn after<S>(&self, later: &Self) -> Self
    where
        D: SimdScalar<S>,
    {
        Self {
            squared: self.squared.after(later.squared),
            length: self.length.after(later.length),
            inverse_length: self.inverse_length.after(later.inverse_length),
            tangent: pair_after(self.tangent, later.tangent),
            normal: pair_after(self.normal, later.normal),
        }
    }
}

/// Two numbers of the next edge in every lane: those of this block, shifted by one, and the first of the `later` block.
#[inline(always)]
fn pair_after<S, V: SimdScalar<S>>(own: [V; 2], later: [V; 2]) -> [V; 2] {
    [own[0].after(later[0]), own[1].after(later[1])]
}

/// Unit tangent, derivative of the angle, and strain of an edge, in plain numbers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PlanarEdgeGeometry {
    pub tangent: [f64; 2],
    /// The derivative of its angle, 1/m.
    pub normal: [f64; 2],
    pub strain: f64,
    /// Its length, m, and the inverse of it.
    pub length: f64,
    pub inverse_length: f64,
}

/// Edges and joints of a planar rod at its unknowns.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    pub(super) edges: Vec<PlanarEdgeGeometry>,
    /// Of each joint: curvature `2 tan(phi/2)`, and its derivative by the turning angle `phi`.
    pub(super) joints: Vec<[f64; 2]>,
}

impl RodGeometry for Geometry {
    /// Sets the lists to `edges` edges and `edges - 1` joints; new entries are zero.
    fn resize(&mut self, edges: usize) {
        self.edges.resize(edges, PlanarEdgeGeometry::default());
        self.joints.resize(edges - 1, [0.0; 2]);
    }

    /// The axial strains `|e|/l - 1` of the edges, from the first edge on.
    fn edge_strains(&self) -> impl Iterator<Item = f64> {
        self.edges.iter().map(|edge| edge.strain)
    }

    /// The curvatures `2 tan(phi/2)` of the joints with the turning angles `phi`, from the first joint on.
    fn joint_strains(&self) -> impl Iterator<Item = f64> {
        self.joints.iter().map(|[curvature, _]| *curvature)
    }
}

//! Stencils of observed points of the rod: on the center line, or markers beside it that rotate with the rod.
//!
//! [`MarkerStencil`] is a weighted sum of nodes, plus an offset, m, along the tangent and the two material directors,
//! which are weighted sums of those of edges. Both follow from a [`Point`] (tip, node index or arc length) and the
//! mesh. Weights are cubic, those of edges by the arc lengths of their middles; without an offset there are no edges.
//! Weights of nodes are linear on the straight edge in a clamp; a node index is that node alone. All weights have
//! derivatives if the mesh has. A point outside the rod is an error. `edges_around` returns the range of these edges,
//! and [`is_beside`] whether an offset is not zero.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::mesh::Mesh;
use crate::scene::point::{Point, Stencil};
use std::ops::Range;

/// Marker as a weighted sum of nodes and an offset in the axes of the rod, which are weighted sums of those of edges.
#[derive(Clone, Debug)]
pub(crate) struct MarkerStencil<D = f64> {
    /// Point of the center line.
    pub centre: Stencil<D>,
    /// Edges and weights; empty for a marker on the center line.
    pub edges: Vec<(usize, D)>,
    /// Offset along the rod and along its two directors, m.
    pub offset: [f64; 3],
}

impl<D: Scalar> MarkerStencil<D> {
    /// Stencil of a marker at an `offset`, m, from a point, along the tangent and the two material directors. Edges
    /// have cubic weights by the arc lengths of their middles. For an offset of zero there are no edges. Weights have
    /// derivatives if the mesh has. An error for a point outside the rod.
    pub fn new(point: Point<D>, offset: [f64; 3], mesh: &Mesh<D>) -> Result<Self, Error> {
        let edges = match is_beside(offset) {
            // Smooth along the rod, as the interpolation of positions.
            true => Stencil::between(&middles(mesh), point.place(mesh)?).nodes,
            false => Vec::new(),
        };
        Ok(Self { centre: point.stencil(mesh)?, edges, offset })
    }

    /// Range of up to four edges whose axes are averaged for a marker beside a point, for this rod length and slightly
    /// different ones. An error for a point outside the rod.
    pub fn edges_around(point: Point<D>, mesh: &Mesh<D>) -> Result<Range<usize>, Error> {
        Ok(Stencil::around(&middles(mesh), point.place(mesh)?.value()))
    }
}

/// Whether an offset, m, has a component other than zero, so that its marker is beside the center line.
pub(crate) fn is_beside(offset: [f64; 3]) -> bool {
    offset != [0.0; 3]
}

/// Arc lengths of the middles of all edges, m, from the wall: the means of those of their two nodes.
fn middles<D: Scalar>(mesh: &Mesh<D>) -> Vec<D> {
    mesh.arc_length.windows(2).map(|s| (s[0] + s[1]) * 0.5).collect()
}

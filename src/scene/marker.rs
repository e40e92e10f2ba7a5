//! What a camera follows: a point of the centre line, or a marker beside it that turns with the rod.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::mesh::Mesh;
use crate::scene::point::{Point, Stencil};
use std::ops::Range;

/// A point of the rod as a weighted sum of nodes, and how far beside it a marker is, in the axes of
/// the rod there: a weighted sum of those of edges.
#[derive(Clone, Debug)]
pub(crate) struct Marker<D = f64> {
    /// The point of the centre line.
    pub centre: Stencil<D>,
    /// Edges and weights; none of a marker on the centre line.
    pub edges: Vec<(usize, D)>,
    /// Along the rod and along its two directors, m.
    pub offset: [f64; 3],
}

impl<D: Scalar> Marker<D> {
    /// A marker on a mesh whose lengths may carry derivatives.
    ///
    /// # Errors
    /// Those of [`Point::stencil`].
    pub fn new(point: Point<D>, offset: [f64; 3], mesh: &Mesh<D>) -> Result<Self, Error> {
        let edges = match is_beside(offset) {
            // Smooth along the rod, as positions are.
            true => Stencil::between(&middles(mesh), point.place(mesh)?).nodes,
            false => Vec::new(),
        };
        Ok(Self { centre: point.stencil(mesh)?, edges, offset })
    }

    /// The edges that such a marker may be a sum of, at this length of the rod and at others near it.
    pub fn edges_around(point: Point<D>, mesh: &Mesh<D>) -> Result<Range<usize>, Error> {
        Ok(Stencil::around(&middles(mesh), point.place(mesh)?.value()))
    }
}

/// Whether a marker is not on the centre line.
pub(crate) fn is_beside(offset: [f64; 3]) -> bool {
    offset != [0.0; 3]
}

/// Arc lengths of the middles of the edges, m.
fn middles<D: Scalar>(mesh: &Mesh<D>) -> Vec<D> {
    mesh.arc_length.windows(2).map(|s| (s[0] + s[1]) * 0.5).collect()
}

//! Points and markers of a rod on the mesh of a problem, as weighted sums of nodes and edges.
//!
//! A point (node index, arc length or tip) becomes a [`Stencil`]: nodes with weights. A marker beside the center line becomes a
//! `MarkerStencil`. Loads, results and observations of fits use them.

use crate::error::Error;
use crate::problem::Problem;
use crate::scene::marker::MarkerStencil;
use crate::scene::{Point, Stencil};
use std::ops::Range;

impl Problem {
    /// Nodes and weights whose weighted sum is the end of the rod: the wall of a clamped end, else the last node.
    pub(crate) fn tip(&self) -> Stencil {
        Point::Tip.stencil(&self.mesh).unwrap_or_else(|_| Stencil::node(self.segments()))
    }

    /// Nodes and weights whose weighted sum is a point of the rod.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a point outside the rod.
    pub fn stencil(&self, point: Point) -> Result<Stencil, Error> {
        point.stencil(&self.mesh)
    }

    /// Range of the nodes whose weighted sum is a point, for this rod length and slightly different ones. An error for a point
    /// outside the rod.
    pub(crate) fn nodes_around(&self, point: Point) -> Result<Range<usize>, Error> {
        point.nodes_around(&self.mesh)
    }

    /// Stencil of a marker at an `offset`, m, along the axes of the rod at a point. An error for a point outside the rod.
    pub(crate) fn marker(&self, point: Point, offset: [f64; 3]) -> Result<MarkerStencil, Error> {
        MarkerStencil::new(point, offset, &self.mesh)
    }

    /// Range of the edges whose axes carry a marker beside a point, for this rod length and slightly different ones.
    pub(crate) fn edges_around(&self, point: Point) -> Result<Range<usize>, Error> {
        MarkerStencil::edges_around(point, &self.mesh)
    }

    /// Arc lengths of all nodes from the wall, m; negative behind it. On another mesh than that of the scene, a point that the
    /// scene names by its node index may be between two nodes.
    pub fn arc_lengths(&self) -> &[f64] {
        &self.mesh.arc_length
    }

    /// Arc length of a point from the wall, m.
    ///
    /// # Errors
    /// Those of [`stencil`](Self::stencil).
    pub fn arc_length(&self, point: Point) -> Result<f64, Error> {
        let nodes = self.stencil(point)?.nodes;
        Ok(match point {
            Point::ArcLength(s) => s,
            _ => nodes.iter().map(|(i, weight)| self.mesh.arc_length[*i] * weight).sum(),
        })
    }
}

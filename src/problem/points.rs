//! Points and markers of a rod on the mesh of a problem, as weighted sums of nodes and edges.
//!
//! A point (node index, arc length in m, or tip) becomes a [`Stencil`]: nodes with weights that sum to one. These are
//! one node, four with cubic weights, or two with linear weights in an outermost edge that extends behind a wall. The
//! tip is the wall of an end clamped at mid-edge, else the last node. A marker, with an offset (m) along tangent and
//! directors, becomes a `MarkerStencil`, which has edges with weights too. `nodes_around` and `edges_around` return
//! ranges that also hold for slightly different lengths of the rod. `arc_length` returns that of a point from the wall
//! (m), `arc_lengths` those of all nodes, which are negative behind the wall. A point outside the rod is
//! [`Error::OutOfRange`]. Results, observations of fits and searches for a mesh use them.

use crate::error::Error;
use crate::problem::Problem;
use crate::scene::marker::MarkerStencil;
use crate::scene::{Point, Stencil};
use std::ops::Range;

impl Problem {
    /// Nodes and weights whose weighted sum is the end of the rod. It is the wall, within the last edge, of an end
    /// clamped at mid-edge, else the last node.
    pub(crate) fn tip(&self) -> Stencil {
        Point::Tip.stencil(&self.mesh).unwrap_or_else(|_| Stencil::node(self.segments()))
    }

    /// Nodes and weights, which sum to one, whose weighted sum is a point of the rod. They are one node, four with
    /// cubic weights, or two with linear weights in an outermost edge that extends behind a wall.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a point outside the rod.
    pub fn stencil(&self, point: Point) -> Result<Stencil, Error> {
        point.stencil(&self.mesh)
    }

    /// Range of the nodes whose weighted sum is a point, for this rod length and slightly different ones. It has one
    /// node, or up to four around an arc length. An error for a point outside the rod.
    pub(crate) fn nodes_around(&self, point: Point) -> Result<Range<usize>, Error> {
        point.nodes_around(&self.mesh)
    }

    /// Stencil of a marker at an `offset`, m, from a point, along the tangent and the two material directors there. An
    /// error for a point outside the rod.
    pub(crate) fn marker(&self, point: Point, offset: [f64; 3]) -> Result<MarkerStencil, Error> {
        MarkerStencil::new(point, offset, &self.mesh)
    }

    /// Range of up to four edges whose axes are averaged for a marker beside a point, for this rod length and slightly
    /// different ones. An error for a point outside the rod.
    pub(crate) fn edges_around(&self, point: Point) -> Result<Range<usize>, Error> {
        MarkerStencil::edges_around(point, &self.mesh)
    }

    /// Arc lengths of all nodes from the wall, m; negative behind it. On another mesh than that of the scene, a point
    /// that the scene names by its node index may be between two nodes.
    pub fn arc_lengths(&self) -> &[f64] {
        &self.mesh.arc_length
    }

    /// Positions of all nodes in the rest shape of the scene, m.
    pub(crate) fn rest_nodes(&self) -> &[[f64; 3]] {
        &self.mesh.nodes
    }

    /// Arc length of a point from the wall, m; an arc length itself is returned unchanged.
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

//! Points of a rod on its mesh.

use crate::error::Error;
use crate::problem::Problem;
use crate::scene::marker::Marker;
use crate::scene::{Point, Stencil};
use std::ops::Range;

impl Problem {
    /// The nodes and weights whose sum is the rod's end.
    pub(crate) fn tip(&self) -> Stencil {
        Point::Tip.stencil(&self.mesh).unwrap_or_else(|_| Stencil::node(self.segments()))
    }

    /// The nodes and weights whose sum is a point of the rod.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a point that is not on the rod.
    pub fn stencil(&self, point: Point) -> Result<Stencil, Error> {
        point.stencil(&self.mesh)
    }

    /// The nodes that a point may be a sum of, at this length of the rod and at others near it.
    pub(crate) fn nodes_around(&self, point: Point) -> Result<Range<usize>, Error> {
        point.nodes_around(&self.mesh)
    }

    /// A marker beside a point.
    pub(crate) fn marker(&self, point: Point, offset: [f64; 3]) -> Result<Marker, Error> {
        Marker::new(point, offset, &self.mesh)
    }

    /// The edges whose axes a marker beside a point may move with, likewise.
    pub(crate) fn edges_around(&self, point: Point) -> Result<Range<usize>, Error> {
        Marker::edges_around(point, &self.mesh)
    }

    /// Arc lengths of all nodes from the wall, m; negative behind it. On a mesh of its own a point that the scene names by the
    /// index of a node need not be one.
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

//! Mesh of a rest shape: positions of the nodes, arc lengths of the nodes from the wall, and lengths along the edges,
//! m.
//!
//! The modules `shape` and `polyline` build a [`Mesh`], and the discretized rod refers to it. N edges join N + 1 nodes.
//! Arc lengths start at the wall, or at the first node of an end without one. A clamp within an edge puts the first
//! node behind the wall, at a negative arc length, or the last node beyond the rod length (`is_clamped_at_end`).
//! `is_in_clamped_edge` is true for arc lengths within such an outermost edge, on either side of its wall.
//!
//! A joint is a node between two edges. Its turning angle is the angle between them, 0 to pi, `atan2(|a x b|, a . b)`.
//! A mesh is straight if all its turning angles are below `STRAIGHT`. Over dual numbers, positions and lengths have
//! derivatives with respect to the parameters of the shape.

use crate::numerics::scalar::Scalar;
use nalgebra::Vector3;

/// Nodes of the rest shape with their arc lengths.
#[derive(Clone, Debug)]
pub struct Mesh<D = f64> {
    /// Positions of the nodes, m.
    pub nodes: Vec<[D; 3]>,
    /// Arc length of every node from the wall, m; negative behind the wall.
    pub arc_length: Vec<D>,
    /// Length of the rod between the walls or free ends, m.
    pub length: D,
    /// Length of the curve along every edge, m, in order from the start; estimated from turning angles for a polyline.
    pub arcs: Vec<D>,
    /// Arc lengths of the nodes of the scene's own mesh, m, to which node indices refer; none if this is that mesh.
    pub named: Option<Vec<D>>,
}

/// Difference of arc lengths, as a fraction of the rod length, below which they are equal.
const ROUNDING: f64 = 1e-9;

/// Turning angle of a joint, rad, below which it is a rounding error.
const STRAIGHT: f64 = 1e-9;

impl<D: Scalar> Mesh<D> {
    /// Whether the rod ends within its last edge: the last node is behind a wall. Its arc length then exceeds the rod
    /// length by more than `ROUNDING` of that.
    pub(crate) fn is_clamped_at_end(&self) -> bool {
        let last = self.arc_length.last().map_or(0.0, D::value);
        last > self.length.value() * (1.0 + ROUNDING)
    }

    /// Whether the arc length `s` from the wall, m, is within an outermost edge that extends behind a wall. The first
    /// edge does if its node has a negative arc length, the last one if [`is_clamped_at_end`](Self::is_clamped_at_end).
    /// `ROUNDING` is the tolerance; arc lengths beyond the outermost node count as within.
    pub(crate) fn is_in_clamped_edge(&self, s: f64) -> bool {
        let place = |i: usize| self.arc_length[i].value();
        let (last, tolerance) = (self.arc_length.len() - 1, ROUNDING * self.length.value());
        let at_start = place(0) < -tolerance && s <= place(1) + tolerance;
        at_start || self.is_clamped_at_end() && s >= place(last - 1) - tolerance
    }

    /// Arc lengths of the nodes as fractions of the rod length: negative, or above 1, behind a wall.
    pub(crate) fn places(&self) -> Vec<f64> {
        self.arc_length.iter().map(|s| s.value() / self.length.value()).collect()
    }
}

impl Mesh {
    /// Sum of the absolute turning angles of all joints (inner nodes), rad; 0 for a straight rod.
    pub(crate) fn turning(&self) -> f64 {
        self.turns().sum()
    }

    /// Whether the turning angles of all joints are below [`STRAIGHT`] rad.
    pub(crate) fn is_straight(&self) -> bool {
        self.turns().all(|turn| turn < STRAIGHT)
    }

    /// Absolute turning angle of every joint, rad, 0 to pi, in order from the second node to the last but one. Empty
    /// for fewer than three nodes.
    pub(crate) fn turns(&self) -> impl Iterator<Item = f64> {
        self.nodes.windows(3).map(|p| {
            let [a, b, c] = [0, 1, 2].map(|i| Vector3::from(p[i]));
            angle(&(b - a), &(c - b))
        })
    }

    /// The mesh with all positions and lengths, m, multiplied by the factor `scale`, which fixes the number type `D`.
    pub(super) fn times<D: Scalar>(self, scale: D) -> Mesh<D> {
        let scaled = |lengths: Vec<f64>| lengths.into_iter().map(|l| scale * l).collect();
        Mesh {
            nodes: self.nodes.into_iter().map(|x| x.map(|x| scale * x)).collect(),
            arc_length: scaled(self.arc_length),
            length: scale * self.length,
            arcs: scaled(self.arcs),
            named: self.named.map(scaled),
        }
    }
}

/// Angle between two vectors, rad, 0 to pi: `atan2(|a x b|, a . b)`, which is accurate for small angles. It is 0 if one
/// of them is zero.
pub(super) fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

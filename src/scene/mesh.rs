//! Mesh of a rest shape: positions of the nodes, arc lengths from the wall and lengths along the edges, m, and
//! turning angles of the joints, rad.
//!
//! Shapes build a [`Mesh`] (`shape`, `polyline`), and problems hold it. A clamp in the middle of an edge puts the first
//! node behind the wall, at a negative arc length. At the other end the last node is beyond the length. With dual
//! numbers it has derivatives by the parameters of the shape. `is_clamped_at_end` returns whether this is so, and
//! `is_in_clamped_edge` whether an arc length is in the edge within such a clamp. `places` are the arc lengths of the
//! nodes as fractions of the rod length. `turns` are the absolute turning angles of the joints, `turning` is their sum,
//! and `is_straight` returns whether all are below `STRAIGHT`. `times` is a scaled mesh, and `angle` the angle
//! between two vectors, rad.

use crate::numerics::scalar::Scalar;
use nalgebra::Vector3;

/// Nodes of the rest shape with their arc lengths.
#[derive(Clone, Debug)]
pub struct Mesh<D = f64> {
    /// Positions of the nodes, m.
    pub nodes: Vec<[D; 3]>,
    /// Arc length of every node from the wall, m; negative behind the wall.
    pub arc_length: Vec<D>,
    /// Length between the walls or ends, m.
    pub length: D,
    /// Length of the curve along every edge, m; estimated for a polyline.
    pub arcs: Vec<D>,
    /// Arc lengths of the nodes of the scene's own mesh, m, to which node indices refer; none if this is that mesh.
    pub named: Option<Vec<D>>,
}

/// Difference of arc lengths, as a fraction of the rod length, below which they are equal.
const ROUNDING: f64 = 1e-9;

/// Turning angle of a joint, rad, below which it is a rounding error.
const STRAIGHT: f64 = 1e-9;

impl<D: Scalar> Mesh<D> {
    /// Whether the last node is behind a wall, so that the rod ends between two nodes. Its arc length then exceeds that
    /// of the rod by more than rounding.
    pub(crate) fn is_clamped_at_end(&self) -> bool {
        let last = self.arc_length.last().map_or(0.0, D::value);
        last > self.length.value() * (1.0 + ROUNDING)
    }

    /// Whether an arc length `s` from the wall, m, is within the first or last edge, and this edge extends behind a
    /// wall.
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
    /// Sum of the absolute turning angles of all joints, rad.
    pub(crate) fn turning(&self) -> f64 {
        self.turns().sum()
    }

    /// Whether all turning angles of joints are below [`STRAIGHT`].
    pub(crate) fn is_straight(&self) -> bool {
        self.turns().all(|turn| turn < STRAIGHT)
    }

    /// Absolute turning angle of every joint, rad, from the second node to the last but one.
    pub(crate) fn turns(&self) -> impl Iterator<Item = f64> {
        self.nodes.windows(3).map(|p| {
            let [a, b, c] = [0, 1, 2].map(|i| Vector3::from(p[i]));
            angle(&(b - a), &(c - b))
        })
    }

    /// The mesh with all positions and lengths multiplied by `scale`, over the number type of that.
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

/// Angle between two vectors, rad, 0 to pi, by the arc tangent of cross and scalar product, which is accurate for small
/// angles.
pub(super) fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

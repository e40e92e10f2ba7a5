//! Points of the rod, by name, node or arc length.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::shape::Mesh;
use serde::{Deserialize, Serialize};

/// A point of the rod.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"tip\", the index of a node, or { arc_length = metres from the wall }",
    from = "PointForm",
    into = "PointForm"
)]
pub enum Point {
    /// The last node.
    #[default]
    Tip,
    /// A node by its index.
    Node(usize),
    /// Arc length from the wall, m.
    ArcLength(f64),
}

/// How a point is written in files.
#[derive(Clone, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"tip\", the index of a node, or { arc_length = metres from the wall }"
)]
enum PointForm {
    Name(crate::scene::NamedNode),
    Node(usize),
    ArcLength(ArcLength),
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ArcLength {
    arc_length: f64,
}

impl From<PointForm> for Point {
    fn from(form: PointForm) -> Self {
        match form {
            PointForm::Name(_) => Self::Tip,
            PointForm::Node(i) => Self::Node(i),
            PointForm::ArcLength(ArcLength { arc_length }) => Self::ArcLength(arc_length),
        }
    }
}

impl From<Point> for PointForm {
    fn from(point: Point) -> Self {
        match point {
            Point::Tip => Self::Name(crate::scene::NamedNode::Tip),
            Point::Node(i) => Self::Node(i),
            Point::ArcLength(arc_length) => Self::ArcLength(ArcLength { arc_length }),
        }
    }
}

impl Point {
    /// The nodes and weights whose sum is the point, on a mesh whose lengths may carry derivatives: a
    /// point named by its arc length stays there when the rod gets longer.
    pub fn stencil<D: Scalar>(self, mesh: &Mesh<D>) -> Result<Stencil<D>, Error> {
        let last = mesh.nodes.len() - 1;
        let outside = |what, found, high| Err(Error::OutOfRange { what, found, low: 0.0, high });
        match self {
            Self::Tip => Ok(Stencil::node(last)),
            Self::Node(i) if i <= last => Ok(Stencil::node(i)),
            Self::Node(i) => outside("node", i as f64, last as f64),
            Self::ArcLength(s) => match mesh.length.value() {
                length if (0.0..=length).contains(&s) => Ok(Stencil::between(&mesh.arc_length, s)),
                length => outside("arc_length", s, length),
            },
        }
    }
}

/// A point as a weighted sum of nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Stencil<D = f64> {
    /// Node and weight; the weights sum to one.
    pub nodes: Vec<(usize, D)>,
}

impl<D: Scalar> Stencil<D> {
    /// One node.
    pub fn node(i: usize) -> Self {
        Self { nodes: vec![(i, D::from(1.0))] }
    }

    /// The four nodes next to an arc length.
    pub(crate) fn around(arc_length: &[D], s: f64) -> std::ops::Range<usize> {
        let n = arc_length.len();
        let right = arc_length.partition_point(|a| a.value() < s).clamp(1, n.max(2) - 1);
        let first = right.saturating_sub(2).min(n.saturating_sub(4));
        first..(first + 4).min(n)
    }

    /// Interpolates between nodes of the given arc lengths: a cubic through the four nearest, so
    /// that the error is of a higher order than the mesh's own.
    pub fn between(arc_length: &[D], s: f64) -> Self {
        let n = arc_length.len();
        if n < 2 {
            return Self { nodes: (0..n).map(|i| (i, D::from(1.0))).collect() };
        }
        let nodes = Self::around(arc_length, s);
        let tolerance = 1e-12 * (arc_length[n - 1] - arc_length[0]).value();
        let near = |i: &usize| (arc_length[*i].value() - s).abs() <= tolerance;
        // With derivatives the point slides off its node when the rod gets longer.
        if let Some(i) = nodes.clone().find(near).filter(|_| D::ORDER == 0) {
            return Self::node(i);
        }
        let weight = |i: usize| {
            let others = nodes.clone().filter(|j| *j != i);
            others.fold(D::from(1.0), |product, j| {
                product * ((-arc_length[j] + s) / (arc_length[i] - arc_length[j]))
            })
        };
        Self { nodes: nodes.clone().map(|i| (i, weight(i))).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stencils_reproduce_a_cubic_and_hit_nodes() {
        let s: Vec<f64> = (0..8).map(|i| (i as f64 - 0.5) * 0.1).collect();
        let f = |s: f64| 1.0 + s * (2.0 + s * (3.0 + 4.0 * s));
        for at in [0.0, 0.02, 0.05, 0.33, 0.61, 0.649] {
            let sum: f64 = Stencil::between(&s, at).nodes.iter().map(|(i, w)| w * f(s[*i])).sum();
            assert!((sum - f(at)).abs() < 1e-13, "{at}");
        }
        assert_eq!(Stencil::between(&s, s[7]), Stencil::node(7));
        assert_eq!(Stencil::between(&s[..3], 0.05), Stencil::node(1));
    }
}

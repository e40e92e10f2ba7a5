//! Points of the rod (`"tip"`, a node index or an arc length from the wall, m), and their interpolation by nodes.
//!
//! A [`Point`] on a mesh becomes a [`Stencil`]: nodes with weights that sum to one. Arc lengths between nodes have
//! cubic (Lagrange) weights of four nodes, two on either side. Masses (`Point::shares`), and points on the straight
//! edge in a clamp, have linear weights of two nodes (lever rule). Node indices are those of the mesh with the scene's
//! own number of edges. On a refined mesh an inner index is replaced by its arc length, and the ends by the outermost
//! nodes. A point outside the rod, beyond rounding, is an error.
//!
//! Loads, masses, observations and results are placed with stencils. Over dual numbers the weights have derivatives
//! with respect to arc length and mesh; a point given by its arc length stays there if the rod length changes.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{add, scale};
use crate::scene::mesh::Mesh;
use crate::scene::number::{NumberVisitor, Quantity};
use crate::scene::table::{NumberTree, TableKind};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Distance beyond an end, as a fraction of the rod length, at which an arc length is that of the end: sums and unit
/// conversions have rounding errors of some 1e-16, and printed numbers fewer than 9 digits.
pub(crate) const ROUNDING: f64 = 1e-9;

/// Distance from a node, as a fraction of the rod length, at which a point is that node.
const AT_NODE: f64 = 1e-12;

/// A point of the rod: `"tip"`, the index of a node, or an arc length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: crate::scene::number::SceneNumber + schemars::JsonSchema"))]
#[serde(
    untagged,
    expecting = "expected \"tip\", the index of a node, or { arc_length = meters from the start of the rod }",
    from = "PointForm<D>",
    into = "PointForm<D>",
    bound = "D: crate::scene::number::SceneNumber"
)]
pub enum Point<D = f64> {
    /// The end of the rod: its last node, or the wall that holds this end between two nodes.
    #[default]
    Tip,
    /// A node by its index, 0 at the start. It moves with the mesh when the rod length changes.
    Node(usize),
    /// Arc length from the wall, m, independent of the rod length.
    ArcLength(D),
}

/// Form of a point in files.
#[derive(Clone, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: crate::scene::number::SceneNumber + schemars::JsonSchema"))]
#[serde(
    untagged,
    expecting = "expected \"tip\", the index of a node, or { arc_length = meters from the start of the rod }",
    bound = "D: crate::scene::number::SceneNumber"
)]
enum PointForm<D> {
    Name(Name),
    Node(usize),
    ArcLength(ArcLength<D>),
}

/// Named points of the rod.
#[derive(Clone, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
enum Name {
    Tip,
}

/// A point of the rod given by its arc length.
#[derive(Clone, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: crate::scene::number::SceneNumber + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: crate::scene::number::SceneNumber")]
struct ArcLength<D> {
    /// Arc length from the wall (or the start of the rod), m.
    arc_length: D,
}

impl<D> From<PointForm<D>> for Point<D> {
    /// The point of the form that a file contains.
    fn from(form: PointForm<D>) -> Self {
        match form {
            PointForm::Name(Name::Tip) => Self::Tip,
            PointForm::Node(i) => Self::Node(i),
            PointForm::ArcLength(ArcLength { arc_length }) => Self::ArcLength(arc_length),
        }
    }
}

impl<D> From<Point<D>> for PointForm<D> {
    /// The form of a point in a file: the word `tip`, a node index, or a table with the key `arc_length`, m.
    fn from(point: Point<D>) -> Self {
        match point {
            Point::Tip => Self::Name(Name::Tip),
            Point::Node(i) => Self::Node(i),
            Point::ArcLength(arc_length) => Self::ArcLength(ArcLength { arc_length }),
        }
    }
}

/// The number of an arc length under `key.arc_length`. Its range is checked against the mesh.
impl NumberTree for Point {
    type Kind = TableKind;
    type Over<D> = Point<D>;

    /// The point over `D`: an arc length is converted by the visitor as `key.arc_length`, a positive number in m. The
    /// tip and node indices have no number.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        _: TableKind,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> Point<D> {
        match *self {
            Self::Tip => Point::Tip,
            Self::Node(i) => Point::Node(i),
            Self::ArcLength(s) => Point::ArcLength(visitor.number(
                &format!("{key}.arc_length"),
                s,
                Quantity::positive("m"),
            )),
        }
    }

    /// Accepts every point: arc lengths are checked against the mesh.
    fn check_numbers(&self, _: &str, _: TableKind) -> Result<(), Error> {
        Ok(())
    }
}

impl Point {
    /// The point over the number type `D`; an arc length, m, becomes a number without derivatives.
    pub(crate) fn fixed<D: Scalar>(self) -> Point<D> {
        match self {
            Self::Tip => Point::Tip,
            Self::Node(i) => Point::Node(i),
            Self::ArcLength(s) => Point::ArcLength(D::from(s)),
        }
    }
}

impl<D: Scalar> Point<D> {
    /// Nodes and weights whose weighted sum is the point. A tip or node index has its node alone, with the weight 1. An
    /// arc length has up to four nodes with cubic weights ([`Stencil::between`]), or two with linear ones on the
    /// straight edge in a clamp. On a refined mesh an inner node index is treated as its arc length on the scene's own
    /// mesh. A tip that a clamp holds within the last edge is treated as the arc length of the wall.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a node that the scene's mesh does not have, and for an arc length beyond the ends.
    pub fn stencil(self, mesh: &Mesh<D>) -> Result<Stencil<D>, Error> {
        match self.arc_length(mesh)? {
            Ok(node) => Ok(Stencil::node(node)),
            // The edge within a clamp is straight.
            Err(s) if mesh.is_in_clamped_edge(s.value()) => Ok(Stencil::lever(&mesh.arc_length, s)),
            Err(s) => Ok(Stencil::between(&mesh.arc_length, s)),
        }
    }

    /// The node at the point, with the weight 1, or the two nodes next to it, with linear weights (lever rule). A mass
    /// at the point is divided among nodes by these weights, as those of a cubic may be negative. An error for a point
    /// outside the rod.
    pub(crate) fn shares(self, mesh: &Mesh<D>) -> Result<Stencil<D>, Error> {
        match self.arc_length(mesh)? {
            Ok(node) => Ok(Stencil::node(node)),
            Err(s) => Ok(Stencil::lever(&mesh.arc_length, s)),
        }
    }

    /// Range of the indices of all nodes in the stencil of the point, at this rod length and slightly different ones:
    /// one node for a node, up to four around an arc length. An error for a point outside the rod.
    pub(crate) fn nodes_around(self, mesh: &Mesh<D>) -> Result<Range<usize>, Error> {
        match self.arc_length(mesh)? {
            Ok(node) => Ok(node..node + 1),
            Err(s) => Ok(Stencil::around(&mesh.arc_length, s.value())),
        }
    }

    /// Arc length of the point from the wall, m; that of a node behind a wall is negative. An error for a point outside
    /// the rod.
    pub(crate) fn place(self, mesh: &Mesh<D>) -> Result<D, Error> {
        Ok(self.arc_length(mesh)?.map_or_else(|s| s, |node| mesh.arc_length[node]))
    }

    /// The node at the point (inner `Ok`), or the arc length, m, of a point between nodes (inner `Err`). The latter are
    /// all given arc lengths, a tip within a clamped edge, and inner node indices of a refined mesh. The outer error is
    /// a point outside the rod by more than [`ROUNDING`].
    fn arc_length(self, mesh: &Mesh<D>) -> Result<Result<usize, D>, Error> {
        let outside = |what, found, high| Err(Error::OutOfRange { what, found, low: 0.0, high });
        let last = mesh.nodes.len() - 1;
        match (self, &mesh.named) {
            (Self::Tip, _) if mesh.is_clamped_at_end() => Ok(Err(mesh.length)),
            (Self::Tip, _) => Ok(Ok(last)),
            (Self::Node(i), None) if i <= last => Ok(Ok(i)),
            (Self::Node(i), None) => outside("node", i as f64, last as f64),
            // Ends are nodes of every mesh; an inner index of the scene's mesh becomes its arc length.
            (Self::Node(i), Some(named)) => match named.get(i) {
                Some(_) if i == 0 => Ok(Ok(0)),
                Some(_) if i + 1 == named.len() => Ok(Ok(last)),
                Some(s) => Ok(Err(*s)),
                None => outside("node", i as f64, named.len() as f64 - 1.0),
            },
            // Sums and unit conversions have rounding errors: slightly beyond an end is accepted.
            (Self::ArcLength(s), _) => match (mesh.length.value(), s.value()) {
                (length, at) if (-ROUNDING * length..=(1.0 + ROUNDING) * length).contains(&at) => {
                    Ok(Err(s))
                }
                (length, at) => outside("arc_length", at, length),
            },
        }
    }
}

/// Point as a weighted sum of nodes; the weights may carry derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Stencil<D = f64> {
    /// Node and weight; the weights sum to one.
    pub nodes: Vec<(usize, D)>,
}

impl<D: Scalar> Stencil<D> {
    /// Position of the point, m: the sum of weight times `position(i)`, m, over its nodes i.
    pub(crate) fn place(&self, position: impl Fn(usize) -> [D; 3]) -> [D; 3] {
        let zero = [D::from(0.0); 3];
        self.nodes.iter().fold(zero, |sum, (i, weight)| add(sum, scale(position(*i), *weight)))
    }

    /// Stencil of node `i` alone, with the weight 1.
    pub fn node(i: usize) -> Self {
        Self { nodes: vec![(i, D::from(1.0))] }
    }

    /// Range of the indices of the four nodes around the arc length `s`, m: two on either side, at the ends the
    /// outermost four; all nodes of fewer. `arc_length` has those of all nodes, m, ascending. A node within
    /// [`ROUNDING`] of the rod length below `s` counts as after it, so that rounding errors do not change the range.
    pub(crate) fn around(arc_length: &[D], s: f64) -> Range<usize> {
        let n = arc_length.len();
        let [first, last] =
            [0, n.saturating_sub(1)].map(|i| arc_length.get(i).map_or(0.0, D::value));
        // Rounding of a node's arc length must not change the choice of nodes.
        let there = s - ROUNDING * (last - first);
        let right = arc_length.partition_point(|a| a.value() < there).clamp(1, n.max(2) - 1);
        let first = right.saturating_sub(2).min(n.saturating_sub(4));
        first..(first + 4).min(n)
    }

    /// The two nodes next to the arc length `s`, m, with linear weights (lever rule). `arc_length` has those of all
    /// nodes, at least two, m, ascending. Beyond an end the outermost two nodes extrapolate, with one negative weight.
    pub(crate) fn lever(arc_length: &[D], s: D) -> Self {
        let right = arc_length.partition_point(|a| a.value() < s.value());
        let right = right.clamp(1, arc_length.len() - 1);
        let [a, b] = [right - 1, right].map(|i| arc_length[i]);
        let part = (s - a) / (b - a);
        Self { nodes: vec![(right - 1, -part + 1.0), (right, part)] }
    }

    /// Cubic (Lagrange) interpolation at the arc length `s`, m, through four nodes, two on either side (at the ends the
    /// outermost four, all of fewer). `arc_length` has those of all nodes, m, ascending. A point within `AT_NODE` of a
    /// node is that node alone, unless `D` carries derivatives. A single node has the weight 1; without nodes the
    /// stencil is empty.
    pub fn between(arc_length: &[D], s: D) -> Self {
        let n = arc_length.len();
        if n < 2 {
            return Self { nodes: (0..n).map(|i| (i, D::from(1.0))).collect() };
        }
        let nodes = Self::around(arc_length, s.value());
        let tolerance = AT_NODE * (arc_length[n - 1] - arc_length[0]).value();
        let near = |i: &usize| (arc_length[*i] - s).value().abs() <= tolerance;
        // The derivative by the rod length moves the point relative to its node.
        if let Some(i) = nodes.clone().find(near).filter(|_| D::ORDER == 0) {
            return Self::node(i);
        }
        let weight = |i: usize| {
            let others = nodes.clone().filter(|j| *j != i);
            others.fold(D::from(1.0), |product, j| {
                product * ((s - arc_length[j]) / (arc_length[i] - arc_length[j]))
            })
        };
        Self { nodes: nodes.clone().map(|i| (i, weight(i))).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stencil_reproduces_a_cubic_and_equals_a_node_at_nodes() {
        let s: Vec<f64> = (0..8).map(|i| (i as f64 - 0.5) * 0.1).collect();
        // A cubic is interpolated exactly through four nodes.
        let f = |s: f64| 1.0 + s * (2.0 + s * (3.0 + 4.0 * s));
        for at in [0.0, 0.02, 0.05, 0.33, 0.61, 0.649] {
            let sum: f64 = Stencil::between(&s, at).nodes.iter().map(|(i, w)| w * f(s[*i])).sum();
            assert!((sum - f(at)).abs() < 1e-13, "{at}");
        }
        assert_eq!(Stencil::between(&s, s[7]), Stencil::node(7));
        assert_eq!(Stencil::between(&s[..3], 0.05), Stencil::node(1));
    }

    #[test]
    fn rounding_of_arc_lengths_does_not_change_the_stencil() {
        for n in [10, 12, 24, 50] {
            let by_sums: Vec<f64> =
                std::iter::successors(Some(0.0), |s| Some(s + 0.513 / n as f64))
                    .take(n + 1)
                    .collect();
            let by_parts: Vec<f64> = (0..=n).map(|i| 0.513 * i as f64 / n as f64).collect();
            for k in 0..=n {
                let [a, b] = [&by_sums, &by_parts].map(|mesh| Stencil::around(mesh, by_parts[k]));
                assert_eq!(a, b, "node {k} of {n}");
            }
        }
    }
}

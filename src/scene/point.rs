//! Points of the rod, by name, node or arc length.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{add, scale};
use crate::scene::mesh::Mesh;
use crate::scene::number::{NumberVisitor, Quantity};
use crate::scene::table::{NumberTree, Table};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Arc lengths this far beyond an end, over the length of the rod, are the end: sums and unit conversions leave rounding
/// errors of some 1e-16, and printed numbers have far fewer digits than 9.
pub(crate) const ROUNDING: f64 = 1e-9;

/// A point of the rod: `"tip"`, the index of a node, or an arc length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: crate::scene::number::SceneNumber + schemars::JsonSchema"))]
#[serde(
    untagged,
    expecting = "expected \"tip\", the index of a node, or { arc_length = metres from the wall }",
    from = "PointForm<D>",
    into = "PointForm<D>",
    bound = "D: crate::scene::number::SceneNumber"
)]
pub enum Point<D = f64> {
    /// The end of the rod: its last node, or the wall that holds this end between two nodes.
    #[default]
    Tip,
    /// A node by its index, 0 at the start. It goes along when the rod gets longer.
    Node(usize),
    /// Arc length from the wall, m. It stays where it is when the rod gets longer.
    ArcLength(D),
}

/// How a point is written in files.
#[derive(Clone, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: crate::scene::number::SceneNumber + schemars::JsonSchema"))]
#[serde(
    untagged,
    expecting = "expected \"tip\", the index of a node, or { arc_length = metres from the wall }",
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
    fn from(form: PointForm<D>) -> Self {
        match form {
            PointForm::Name(Name::Tip) => Self::Tip,
            PointForm::Node(i) => Self::Node(i),
            PointForm::ArcLength(ArcLength { arc_length }) => Self::ArcLength(arc_length),
        }
    }
}

impl<D> From<Point<D>> for PointForm<D> {
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
    type Kind = Table;
    type Over<D> = Point<D>;

    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        _: Table,
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

    fn check_numbers(&self, _: &str, _: Table) -> Result<(), Error> {
        Ok(())
    }
}

impl Point {
    /// The same point over another scalar, without derivatives of its own.
    pub(crate) fn fixed<D: Scalar>(self) -> Point<D> {
        match self {
            Self::Tip => Point::Tip,
            Self::Node(i) => Point::Node(i),
            Self::ArcLength(s) => Point::ArcLength(D::from(s)),
        }
    }
}

impl<D: Scalar> Point<D> {
    /// The nodes and weights whose sum is the point, on a mesh whose lengths may carry derivatives.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a node that the scene's mesh does not have, and for an arc length
    /// beyond the ends.
    pub fn stencil(self, mesh: &Mesh<D>) -> Result<Stencil<D>, Error> {
        match self.arc_length(mesh)? {
            Ok(node) => Ok(Stencil::node(node)),
            // A clamp keeps the edge in it straight.
            Err(s) if mesh.is_in_clamped_edge(s.value()) => Ok(Stencil::lever(&mesh.arc_length, s)),
            Err(s) => Ok(Stencil::between(&mesh.arc_length, s)),
        }
    }

    /// The nodes that share a mass at the point, and the part of each: the two next to it, by the
    /// lever. A cubic's parts may be negative, and so might the mass of a node then.
    pub(crate) fn shares(self, mesh: &Mesh<D>) -> Result<Stencil<D>, Error> {
        match self.arc_length(mesh)? {
            Ok(node) => Ok(Stencil::node(node)),
            Err(s) => Ok(Stencil::lever(&mesh.arc_length, s)),
        }
    }

    /// The nodes that the point may be a sum of, at this length of the rod and at others near it.
    pub(crate) fn nodes_around(self, mesh: &Mesh<D>) -> Result<Range<usize>, Error> {
        match self.arc_length(mesh)? {
            Ok(node) => Ok(node..node + 1),
            Err(s) => Ok(Stencil::around(&mesh.arc_length, s.value())),
        }
    }

    /// Its arc length, m.
    pub(crate) fn place(self, mesh: &Mesh<D>) -> Result<D, Error> {
        Ok(self.arc_length(mesh)?.map_or_else(|s| s, |node| mesh.arc_length[node]))
    }

    /// The node that the point is, or else its arc length.
    fn arc_length(self, mesh: &Mesh<D>) -> Result<Result<usize, D>, Error> {
        let outside = |what, found, high| Err(Error::OutOfRange { what, found, low: 0.0, high });
        let last = mesh.nodes.len() - 1;
        match (self, &mesh.named) {
            (Self::Tip, _) if mesh.is_clamped_at_end() => Ok(Err(mesh.length)),
            (Self::Tip, _) => Ok(Ok(last)),
            (Self::Node(i), None) if i <= last => Ok(Ok(i)),
            (Self::Node(i), None) => outside("node", i as f64, last as f64),
            (Self::Node(i), Some(named)) => match named.get(i) {
                Some(_) if i == 0 => Ok(Ok(0)),
                Some(_) if i + 1 == named.len() => Ok(Ok(last)),
                Some(s) => Ok(Err(*s)),
                None => outside("node", i as f64, named.len() as f64 - 1.0),
            },
            (Self::ArcLength(s), _) => match (mesh.length.value(), s.value()) {
                (length, at) if (-ROUNDING * length..=(1.0 + ROUNDING) * length).contains(&at) => {
                    Ok(Err(s))
                }
                (length, at) => outside("arc_length", at, length),
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
    /// The place of the point, m, where nodes have these positions, m.
    pub(crate) fn place(&self, position: impl Fn(usize) -> [D; 3]) -> [D; 3] {
        let zero = [D::from(0.0); 3];
        self.nodes.iter().fold(zero, |sum, (i, weight)| add(sum, scale(position(*i), *weight)))
    }

    /// One node.
    pub fn node(i: usize) -> Self {
        Self { nodes: vec![(i, D::from(1.0))] }
    }

    /// The four nodes next to an arc length. A node that is there but for rounding counts as behind it, whichever way
    /// its own arc length was rounded.
    pub(crate) fn around(arc_length: &[D], s: f64) -> Range<usize> {
        let n = arc_length.len();
        let [first, last] =
            [0, n.saturating_sub(1)].map(|i| arc_length.get(i).map_or(0.0, D::value));
        let there = s - ROUNDING * (last - first);
        let right = arc_length.partition_point(|a| a.value() < there).clamp(1, n.max(2) - 1);
        let first = right.saturating_sub(2).min(n.saturating_sub(4));
        first..(first + 4).min(n)
    }

    /// The two nodes next to an arc length, by the lever.
    fn lever(arc_length: &[D], s: D) -> Self {
        let right = arc_length.partition_point(|a| a.value() < s.value());
        let right = right.clamp(1, arc_length.len() - 1);
        let [a, b] = [right - 1, right].map(|i| arc_length[i]);
        let part = (s - a) / (b - a);
        Self { nodes: vec![(right - 1, -part + 1.0), (right, part)] }
    }

    /// Interpolates between nodes of the given arc lengths: a cubic through the four nearest, so
    /// that the error is of a higher order than the mesh's own.
    pub fn between(arc_length: &[D], s: D) -> Self {
        let n = arc_length.len();
        if n < 2 {
            return Self { nodes: (0..n).map(|i| (i, D::from(1.0))).collect() };
        }
        let nodes = Self::around(arc_length, s.value());
        let tolerance = 1e-12 * (arc_length[n - 1] - arc_length[0]).value();
        let near = |i: &usize| (arc_length[*i] - s).value().abs() <= tolerance;
        // With derivatives the point slides off its node when the rod gets longer.
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

    #[test]
    fn rounding_moves_no_point_to_other_nodes() {
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

//! Elements of a rod on which a user-defined energy acts ([`ElementPlacement`], by `placements`), and their rest shape
//! ([`Place`]).
//!
//! Input: the place named in a scene ([`At`]), the number of nodes of an element, and the mesh. The start or end has
//! the first or last element. An arc length has the two elements whose centers enclose it, with linear weights, or the
//! nearest one beyond all centers. An interval or the whole rod has all elements with a positive tributary length
//! there. Output: per element its first node, its weight (None for 1), and a list of numbers. These are arc length and
//! tributary length, m, then the positions of its nodes, m, and the directors of its edges at rest. The list of
//! elements is empty if the mesh has too few nodes. `numbers` makes this list. Functions of [`Place`] return arc
//! length, tributary length (`length`) and position of a node (`node`) from it, `number` returns any entry, and `edge`
//! the [`Directors`] of an edge (unit tangent and both material directors, in the world).

use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, components};
use crate::scene::At;
use crate::scene::mesh::Mesh;

/// An edge's unit tangent and its two material directors, orthonormal, in the world. At rest the first director of the
/// first edge lies along `up` of the section, less its component along the rod. Of a circle or a tube it is the y axis
/// in place of `up`, or the x axis where the rod begins within 8 degrees of y. The second director is tangent x first.
pub type Directors<D> = [Vector<D>; 3];

/// One element of an energy on a mesh: its first node, weight and rest shape.
#[derive(Clone, Debug)]
pub struct ElementPlacement<D> {
    /// The first node of the element.
    pub first: usize,
    /// Its weight in an energy at a point between two elements.
    pub weight: Option<D>,
    /// The numbers of its [`Place`].
    pub numbers: Vec<D>,
}

/// The rest shape of an element on which an energy acts, in the world: arc length, tributary length, nodes and
/// directors.
pub struct Place<'a, D> {
    numbers: &'a dyn Fn(usize) -> D,
    nodes: usize,
}

impl<'a, D: Scalar> Place<'a, D> {
    /// The place of an element of `nodes` nodes; `numbers(i)` is number `i` of its [`ElementPlacement`].
    pub(crate) fn new(nodes: usize, numbers: &'a dyn Fn(usize) -> D) -> Self {
        Self { numbers, nodes }
    }

    /// Arc length from the wall, m: of the only node, the middle of the edge, or the inner node of three.
    pub fn arc_length(&self) -> D {
        (self.numbers)(0)
    }

    /// Number `i` of the list of the place; built-in energies have lists with other numbers than [`numbers`].
    ///
    /// # Panics
    /// If the list has no such number.
    pub(crate) fn number(&self, i: usize) -> D {
        (self.numbers)(i)
    }

    /// The tributary length of the element, m: halves of the edges next to its only or inner node, or its edge. It is
    /// cut to the part on the rod, between the walls, and in the interval.
    pub fn length(&self) -> D {
        (self.numbers)(1)
    }

    /// The position of node `i` of the element at rest, m.
    ///
    /// # Panics
    /// If the element has no such node.
    pub fn node(&self, i: usize) -> Vector<D> {
        assert!(i < self.nodes, "an element of {} nodes has no node {i}", self.nodes);
        components(|c| (self.numbers)(2 + 3 * i + c))
    }

    /// The directors of edge `j` of the element at rest: unit tangent, first and second material director, in the
    /// world.
    ///
    /// # Panics
    /// If the element has no such edge.
    pub fn edge(&self, j: usize) -> Directors<D> {
        assert!(j + 1 < self.nodes, "an element of {} nodes has no edge {j}", self.nodes);
        let first = 2 + 3 * self.nodes + 9 * j;
        let director = |k: usize| components(|c| (self.numbers)(first + 3 * k + c));
        [director(0), director(1), director(2)]
    }
}

/// The list of numbers of a [`Place`]: arc length and tributary length, m, then the coordinates of the nodes, then nine
/// of the directors of each edge.
pub(crate) fn numbers<D: Copy>(
    lengths: [D; 2],
    nodes: &[Vector<D>],
    edges: &[Directors<D>],
) -> Vec<D> {
    let edges = edges.iter().flatten();
    lengths.into_iter().chain(nodes.iter().chain(edges).flatten().copied()).collect()
}

/// The elements of the place `at` over `nodes` nodes each, with arc length, tributary length and rest shape. `rest(i)`
/// returns the nodes and edges at rest of the element that begins at node `i`. One at the start or end; two with linear
/// weights for an arc length between two centers, beyond all centers only the nearest one. All with a positive length
/// in the interval or rod. Empty if the mesh has too few nodes.
pub(crate) fn placements<D: Scalar>(
    at: At,
    nodes: usize,
    mesh: &Mesh<D>,
    rest: impl Fn(usize) -> (Vec<Vector<D>>, Vec<Directors<D>>),
) -> Vec<ElementPlacement<D>> {
    let (arcs, zero) = (&mesh.arc_length, D::from(0.0));
    let count = (arcs.len() + 1).saturating_sub(nodes);
    let middle = |i: usize| (arcs[i] + arcs[i + 1]) * 0.5;
    // Arc length that represents an element: its node, the middle of its edge, or its inner node.
    let centre = |i: usize| match nodes {
        1 => arcs[i],
        2 => middle(i),
        _ => arcs[i + 1],
    };
    let ends = match at {
        At::Interval(from, to) => [D::from(from), D::from(to)],
        _ => [zero, mesh.length],
    };
    // The tributary length of an element, cut at the ends.
    let length = |i: usize| {
        let last = arcs.len() - 1;
        let cell = match nodes {
            1 => [
                i.checked_sub(1).map_or(arcs[0], middle),
                if i < last { middle(i) } else { arcs[last] },
            ],
            2 => [arcs[i], arcs[i + 1]],
            _ => [middle(i), middle(i + 1)],
        };
        cell[1].min(ends[1]) - cell[0].max(ends[0])
    };
    let placement = |i: usize, weight: Option<D>| {
        let (nodes, edges) = rest(i);
        ElementPlacement {
            first: i,
            weight,
            numbers: numbers([centre(i), length(i)], &nodes, &edges),
        }
    };
    match at {
        _ if count == 0 => Vec::new(),
        At::Start => vec![placement(0, None)],
        At::End => vec![placement(count - 1, None)],
        // Linear interpolation between the two elements whose centers enclose the point.
        At::ArcLength(s) => {
            let after = (0..count).position(|i| centre(i).value() > s).unwrap_or(count);
            if after == 0 || after == count {
                return vec![placement(after.saturating_sub(1), None)];
            }
            let [a, b] = [centre(after - 1), centre(after)];
            let part = (-a + s) / (b - a);
            vec![placement(after - 1, Some(-part + 1.0)), placement(after, Some(part))]
        }
        // Elements with a part in the interval; the tributary length counts that part only.
        At::Interval(..) | At::Whole => {
            let covered = (0..count).filter(|i| length(*i).value() > 0.0);
            covered.map(|i| placement(i, None)).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Shape;

    /// Elements on a straight rod of 0.95 m with ten edges and the wall in the middle of the first.
    fn placements(at: At, nodes: usize) -> Vec<ElementPlacement<f64>> {
        let shape = Shape::Straight { length: 0.95, direction: [1.0, 0.0, 0.0] };
        let mesh = shape.mesh(Some(10), [0.5, 0.0]).unwrap();
        let rest = |i: usize| (mesh.nodes[i..i + nodes].to_vec(), vec![[[0.0; 3]; 3]; nodes - 1]);
        super::placements(at, nodes, &mesh, rest)
    }

    /// Sum of `f(arc length)` over the elements, times weight and tributary length.
    fn sum(placements: &[ElementPlacement<f64>], f: impl Fn(f64) -> f64) -> f64 {
        placements.iter().map(|s| s.weight.unwrap_or(1.0) * s.numbers[1] * f(s.numbers[0])).sum()
    }

    /// Edges of 0.1 m, the wall in the middle of the first.
    #[test]
    fn lengths_add_up_to_the_interval() {
        for nodes in [1, 2] {
            assert!((sum(&placements(At::Whole, nodes), |_| 1.0) - 0.95).abs() < 1e-15);
            for (from, to) in [(0.0, 0.95), (0.03, 0.04), (0.2, 0.77), (0.0, 0.5)] {
                let found = sum(&placements(At::Interval(from, to), nodes), |_| 1.0);
                assert!((found - (to - from)).abs() < 1e-15, "{from} {to}: {found}");
            }
        }
        // The half of the last edge belongs to no inner node.
        assert!((sum(&placements(At::Whole, 3), |_| 1.0) - 0.90).abs() < 1e-15);
    }

    /// A point between two elements is where it is: its shares have it as their centre of mass.
    #[test]
    fn a_point_is_shared() {
        for nodes in [1, 2, 3] {
            for s in [0.2, 0.31, 0.449] {
                let shares = placements(At::ArcLength(s), nodes);
                let part = |s: &ElementPlacement<f64>| s.weight.unwrap_or(1.0);
                let centre: f64 = shares.iter().map(|s| part(s) * s.numbers[0]).sum();
                assert!((centre - s).abs() < 1e-15, "{nodes} {s}: {centre}");
                assert!((shares.iter().map(part).sum::<f64>() - 1.0).abs() < 1e-15);
            }
            assert_eq!(
                placements(At::ArcLength(0.95), nodes)[0].first,
                placements(At::End, nodes)[0].first
            );
        }
        assert_eq!(placements(At::End, 2)[0].first, 9);
    }
}

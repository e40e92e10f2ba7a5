//! Contacts of rods with each other and with themselves: energy (J), gradient (N) and tangent (N/m) of all pairs of
//! edges.
//!
//! Edges, and the pairs of them that are close, are those of [`touching_edges`](crate::rod::assembly::touching_edges).
//! Edges with a node that a body carries touch nothing. Energy and derivatives of a pair are those of the module
//! `energy::edge_pair`. Damping and friction (`have_losses`) are in `pair_losses`.
//!
//! Input: unknowns `q` of the assembly with carried and fixed nodes at their places. `energy` is the sum,
//! `add_gradient` adds its derivatives, and `add_tangent` adds the second ones: within an edge to the band of its rod,
//! between edges to the couplings of rods. Fixed nodes are left out of both. `passed` returns the first law with an
//! edge that passes through another in a step, `deepest` the largest overlap.

use crate::energy::edge_pair::{EdgeNodes, EdgePair, PairDerivatives};
use crate::energy::swept_pair::{TwoEdges, passes_edge, segment_distance};
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use crate::rod::assembly::rod_couplings::{LARGEST_EDGE, NodeBlock};
use crate::rod::assembly::tangent::BorderedTangent;
use crate::rod::assembly::touching_edges::{ContactLaw, SweptBox, TouchingEdge, WorkSpace};
use std::mem::take;
use std::ops::Range;

/// The largest overlap of rods with each other.
#[derive(Clone, Copy, Debug)]
pub struct DeepestOverlap {
    /// Index in `[[rod_contacts]]`.
    pub law: usize,
    /// Overlap, m; negative where no rods touch.
    pub overlap: f64,
    /// Overlap over the smaller radius of both rods.
    pub relative: f64,
    /// Indices of both rods.
    pub rods: [usize; 2],
    /// Arc lengths of the middles of both edges, m.
    pub arc: [f64; 2],
}

/// All contacts of the rods of an assembly with each other.
#[derive(Clone, Debug)]
pub struct ContactPairs<D> {
    pub(super) laws: Vec<ContactLaw<D>>,
    /// Unknowns from one node to the next.
    pub(super) stride: usize,
    pub(super) boxes: WorkSpace<SweptBox>,
    /// Unknowns with all nodes at their places.
    placed: WorkSpace<D>,
    /// Velocities of all unknowns.
    moving: WorkSpace<D>,
}

impl<D: Scalar> ContactPairs<D> {
    /// Contacts by these laws, of rods with `stride` unknowns from one node to the next.
    pub fn new(laws: Vec<ContactLaw<D>>, stride: usize) -> Self {
        let (boxes, placed, moving) = Default::default();
        Self { laws, stride, boxes, placed, moving }
    }

    /// Whether there are no contacts.
    pub fn is_empty(&self) -> bool {
        self.laws.is_empty()
    }

    /// A copy of the unknowns `q` as work space, for the places of all nodes; empty without contacts.
    pub fn borrow_placed(&self, q: &[D]) -> Vec<D> {
        let mut placed = take(&mut *self.placed.lock());
        placed.clear();
        if !self.is_empty() {
            placed.extend_from_slice(q);
        }
        placed
    }

    /// Keeps a list of [`borrow_placed`](Self::borrow_placed) for the next evaluation.
    pub fn return_placed(&self, placed: Vec<D>) {
        *self.placed.lock() = placed;
    }

    /// Whether a contact has forces that depend on the velocity.
    pub fn have_losses(&self) -> bool {
        self.laws.iter().any(|law| law.loss.is_some())
    }

    /// Copies of the unknowns `q` and velocities `v` as work space, for those of all nodes; empty without losses.
    pub fn borrow_moving(&self, [q, v]: [&[D]; 2]) -> [Vec<D>; 2] {
        [(&self.placed, q), (&self.moving, v)].map(|(kept, values)| {
            let mut list = take(&mut *kept.lock());
            list.clear();
            if self.have_losses() {
                list.extend_from_slice(values);
            }
            list
        })
    }

    /// Keeps the lists of [`borrow_moving`](Self::borrow_moving) for the next evaluation.
    pub fn return_moving(&self, [placed, moving]: [Vec<D>; 2]) {
        self.return_placed(placed);
        *self.moving.lock() = moving;
    }

    /// The same contacts where the unknowns are the coordinates of the nodes of all rods, three per node, rod after
    /// rod. `rods` are the ranges of their present unknowns.
    pub fn on_nodes(&self, rods: &[Range<usize>]) -> ContactPairs<f64> {
        let nodes = |rod: &Range<usize>| rod.len().div_ceil(self.stride);
        let law = |law: &ContactLaw<D>| {
            let edge = |edge: &TouchingEdge<D>| {
                let before: usize = rods[..edge.rod].iter().map(nodes).sum();
                let node = (edge.first - rods[edge.rod].start) / self.stride;
                TouchingEdge {
                    rod: edge.rod,
                    first: 3 * (before + node),
                    arc: edge.arc,
                    length: edge.length.value(),
                    radius: edge.radius.value(),
                    is_free: edge.is_free,
                    has_free_angle: edge.has_free_angle,
                    joints: edge.joints,
                }
            };
            ContactLaw {
                index: law.index,
                stiffness: law.stiffness.value(),
                // Overlaps need no velocities.
                loss: None,
                edges: law.edges.iter().map(edge).collect(),
            }
        };
        ContactPairs::new(self.laws.iter().map(law).collect(), 3)
    }

    /// Number of coordinates of a node.
    pub(super) fn width(&self) -> usize {
        self.stride.min(3)
    }

    /// Calls `visit` with every pair of edges that is close, the contact between both and their nodes at `q`.
    fn for_each_contact(
        &self,
        q: &[D],
        mut visit: impl FnMut([&TouchingEdge<D>; 2], EdgePair<D>, [EdgeNodes<D>; 2]),
    ) {
        for law in &self.laws {
            law.for_each_pair(&self.boxes, self.stride, &[q], |i, j| {
                let edges = [&law.edges[i], &law.edges[j]];
                let pair = law.pair(self.stride, [i, j]);
                visit(edges, pair, edges.map(|edge| edge.nodes(q, self.stride)));
            });
        }
    }

    /// The energy at `q`, J.
    pub fn energy(&self, q: &[D]) -> D {
        let mut energy = D::from(0.0);
        self.for_each_contact(q, |_, pair, nodes| energy += pair.energy(nodes));
        energy
    }

    /// Calls `visit` for all pairs in contact at `q`: the first unknown of each of the four nodes, `None` at walls, and
    /// the derivatives.
    fn for_each_derivative(
        &self,
        q: &[D],
        with_hessian: bool,
        mut visit: impl FnMut([Option<usize>; 4], &PairDerivatives<D>),
    ) {
        self.for_each_contact(q, |edges, pair, nodes| {
            let mut sums = PairDerivatives::zero();
            if pair.derive(nodes, with_hessian, &mut sums) {
                let place = |i: usize| {
                    let edge = edges[i / 2];
                    edge.is_free[i % 2].then_some(edge.first + self.stride * (i % 2))
                };
                visit([0, 1, 2, 3].map(place), &sums);
            }
        });
    }

    /// Adds the gradient at `q`, N.
    pub fn add_gradient(&self, q: &[D], gradient: &mut [D]) {
        self.for_each_derivative(q, false, |places, sums| {
            add_forces(places, sums, self.width(), gradient);
        });
    }

    /// Adds the gradient at `q`, N. The second derivatives, N/m, are added to `tangent`: those by the nodes of one edge
    /// to its entries from the first node on, and those by nodes of two edges to its couplings.
    pub fn add_tangent<T: Tangent<D>>(
        &self,
        q: &[D],
        gradient: &mut [D],
        tangent: &mut BorderedTangent<D, T>,
    ) {
        let (stride, width) = (self.stride, self.width());
        self.for_each_derivative(q, true, |places, sums| {
            add_forces(places, sums, width, gradient);
            let [a, b] = [[0, 1], [2, 3]];
            for pair in [a, b] {
                let mut block = [[D::from(0.0); LARGEST_EDGE]; LARGEST_EDGE];
                let free = || pair.iter().enumerate().filter(|(_, i)| places[**i].is_some());
                for (at, i) in free() {
                    for (other, j) in free().filter(|(other, _)| *other <= at) {
                        for k in 0..width {
                            let row = &mut block[stride * at + k][stride * other..][..width];
                            row.copy_from_slice(&sums.hessian[*i][*j][k][..width]);
                        }
                    }
                }
                // The first unknown of the edge; the block of a node at a wall is zero.
                let first = places[pair[0]].or(places[pair[1]].map(|second| second - stride));
                if let Some(first) = first {
                    tangent.add_corner(first, stride + width, &block);
                }
            }
            for i in b {
                for j in a {
                    if let (Some(row), Some(column)) = (places[i], places[j]) {
                        let entries = sums.hessian[i][j];
                        let block = NodeBlock { first: [row, column], entries };
                        tangent.between.blocks.push(block);
                    }
                }
            }
        });
    }

    /// Index in `[[rod_contacts]]` of the first law with an edge that passes through another in a step from the
    /// unknowns `before` to `now`, on straight lines; `None` without one. Derivatives have no influence.
    pub fn passed(&self, before: &[D], now: &[D]) -> Option<usize> {
        self.laws.iter().find_map(|law| {
            let mut passed = false;
            law.for_each_pair(&self.boxes, self.stride, &[before, now], |i, j| {
                let (a, b) = (&law.edges[i], &law.edges[j]);
                let reach = a.radius.value() + b.radius.value();
                let at = |q: &[D]| plain([a, b].map(|edge| edge.nodes(q, self.stride)));
                passed = passed || passes_edge(reach, at(before), at(now));
            });
            passed.then_some(law.index)
        })
    }

    /// The largest overlap over the smaller radius at `q`; `None` where no boxes of edges overlap.
    pub fn deepest(&self, q: &[D]) -> Option<DeepestOverlap> {
        let mut deepest: Option<DeepestOverlap> = None;
        for law in &self.laws {
            law.for_each_pair(&self.boxes, self.stride, &[q], |i, j| {
                let edges = [&law.edges[i], &law.edges[j]];
                let radii = edges.map(|edge| edge.radius.value());
                let distance =
                    segment_distance(plain(edges.map(|edge| edge.nodes(q, self.stride))));
                let overlap = radii[0] + radii[1] - distance;
                let relative = overlap / radii[0].min(radii[1]);
                if deepest.is_none_or(|before| relative > before.relative) {
                    let arc = edges.map(|edge| 0.5 * (edge.arc[0] + edge.arc[1]));
                    let rods = edges.map(|edge| edge.rod);
                    deepest = Some(DeepestOverlap { law: law.index, overlap, relative, rods, arc });
                }
            });
        }
        deepest
    }
}

/// Adds the gradients of four nodes of `width` coordinates, N, at these unknowns; those without a place are left out.
fn add_forces<D: Scalar>(
    places: [Option<usize>; 4],
    sums: &PairDerivatives<D>,
    width: usize,
    gradient: &mut [D],
) {
    for (place, force) in places.iter().zip(&sums.gradient) {
        if let Some(first) = place {
            (0..width).for_each(|k| gradient[first + k] += force[k]);
        }
    }
}

/// The real parts of the nodes of two edges, m.
fn plain<D: Scalar>(edges: [EdgeNodes<D>; 2]) -> TwoEdges {
    edges.map(|nodes| nodes.map(|node| node.map(|x| x.value())))
}

//! Contacts of rods with each other and with themselves: energy (J), gradient (N) and tangent (N/m) of all pairs of
//! edges.
//!
//! A [`ContactLaw`] has the stiffness of a contact, N/m^3, and the edges that may touch. Each [`TouchingEdge`] has its
//! unknowns and arc lengths. Pairs are those whose boxes (edge and radius) overlap; a sweep along the axis with the
//! largest extent finds them. Left out are edges of one rod that are closer along it than half the circumference of
//! the thicker edge, and edges near a common body by the same distance along both rods. Edges with a node that a body
//! carries touch nothing. Energy and derivatives of a pair are those of the module `energy::edge_pair`.
//!
//! Input: unknowns `q` of the assembly with carried and fixed nodes at their places. `energy` is the sum,
//! `add_gradient` adds its derivatives, and `add_tangent` adds the second ones: within an edge to the band of its rod,
//! between edges to the couplings of rods. Fixed nodes are left out of both. `passed` returns the first law with an edge
//! that passes through another in a step, `deepest` the largest overlap.

use crate::energy::edge_pair::{EdgePair, PairDerivatives};
use crate::energy::swept_pair::{TwoEdges, passes_edge, segment_distance};
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::Vector;
use crate::rod::assembly::rod_couplings::NodeBlock;
use crate::rod::assembly::tangent::BorderedTangent;
use std::f64::consts::PI;
use std::mem::take;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Largest number of unknowns of an edge, with the angle between its nodes.
const LARGEST_EDGE: usize = 7;

/// Distance of an edge from an end of its rod that a body carries.
#[derive(Clone, Copy, Debug)]
pub struct JointDistance {
    /// Index of the body.
    pub body: usize,
    /// Distance along the rod, m.
    pub distance: f64,
}

/// An edge that may touch others.
#[derive(Clone, Debug)]
pub struct TouchingEdge<D> {
    /// Index of its rod.
    pub rod: usize,
    /// First unknown of its first node, in those of the assembly.
    pub first: usize,
    /// Arc lengths of its nodes, m.
    pub arc: [f64; 2],
    /// Rest length, m.
    pub length: D,
    /// Radius of the rod, m.
    pub radius: D,
    /// Whether its nodes may move; those at walls may not.
    pub is_free: [bool; 2],
    /// Distances from the ends of the rod that a body carries.
    pub joints: [Option<JointDistance>; 2],
}

impl<D: Scalar> TouchingEdge<D> {
    /// Whether this edge and another one may touch each other.
    fn may_touch(&self, other: &Self) -> bool {
        let apart = PI * self.radius.value().max(other.radius.value());
        let gap = (self.arc[0] - other.arc[1]).max(other.arc[0] - self.arc[1]);
        let is_near_joint = |own: &JointDistance| {
            let ends = other.joints.iter().flatten().filter(|end| end.body == own.body);
            ends.map(|end| own.distance + end.distance).any(|distance| distance < apart)
        };
        (self.rod != other.rod || gap >= apart) && !self.joints.iter().flatten().any(is_near_joint)
    }
}

/// Contact between edges of rods.
#[derive(Clone, Debug)]
pub struct ContactLaw<D> {
    /// Index in `[[rod_contacts]]`.
    pub index: usize,
    /// Force per length over the square of the overlap, N/m^3.
    pub stiffness: D,
    /// The edges, rod after rod, in their order along the rods.
    pub edges: Vec<TouchingEdge<D>>,
}

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

/// A list that is kept between evaluations; empty in a clone.
#[derive(Debug)]
struct WorkSpace<T>(Mutex<Vec<T>>);

impl<T> Default for WorkSpace<T> {
    /// An empty list.
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> Clone for WorkSpace<T> {
    /// An empty list.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<T> WorkSpace<T> {
    /// Locks the list for this thread; a lock that another thread left by a panic is taken too.
    fn lock(&self) -> MutexGuard<'_, Vec<T>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Box around an edge: bounds along the axes, m.
#[derive(Clone, Copy, Debug)]
struct SweptBox {
    edge: usize,
    bounds: [[f64; 2]; 3],
}

/// All contacts of the rods of an assembly with each other.
#[derive(Clone, Debug)]
pub struct ContactPairs<D> {
    laws: Vec<ContactLaw<D>>,
    /// Unknowns from one node to the next.
    stride: usize,
    order: WorkSpace<SweptBox>,
    /// Unknowns with all nodes at their places.
    placed: WorkSpace<D>,
}

impl<D: Scalar> ContactPairs<D> {
    /// Contacts by these laws, of rods with `stride` unknowns from one node to the next.
    pub fn new(laws: Vec<ContactLaw<D>>, stride: usize) -> Self {
        Self { laws, stride, order: WorkSpace::default(), placed: WorkSpace::default() }
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
                    joints: edge.joints,
                }
            };
            ContactLaw {
                index: law.index,
                stiffness: law.stiffness.value(),
                edges: law.edges.iter().map(edge).collect(),
            }
        };
        ContactPairs::new(self.laws.iter().map(law).collect(), 3)
    }

    /// Number of coordinates of a node.
    fn width(&self) -> usize {
        self.stride.min(3)
    }

    /// The positions of both nodes of an edge, m; the third coordinate in a plane is zero.
    fn nodes(&self, edge: &TouchingEdge<D>, q: &[D]) -> [Vector<D>; 2] {
        [0, 1].map(|i| {
            let mut node = [D::from(0.0); 3];
            let first = edge.first + self.stride * i;
            node[..self.width()].copy_from_slice(&q[first..first + self.width()]);
            node
        })
    }

    /// Calls `visit` with every pair of edges of a law whose boxes overlap at one of the `states`, indices in ascending
    /// order. The box of an edge contains it at all of these unknowns.
    fn for_each_pair(
        &self,
        law: &ContactLaw<D>,
        states: &[&[D]],
        mut visit: impl FnMut(usize, usize),
    ) {
        let mut boxes = self.order.lock();
        boxes.clear();
        let mut extent = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for (edge, own) in law.edges.iter().enumerate() {
            let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
            let radius = own.radius.value();
            for node in states.iter().flat_map(|q| self.nodes(own, q)) {
                for k in 0..3 {
                    let x = node[k].value();
                    bounds[k] = [bounds[k][0].min(x - radius), bounds[k][1].max(x + radius)];
                }
            }
            for k in 0..3 {
                extent[k] = [extent[k][0].min(bounds[k][0]), extent[k][1].max(bounds[k][1])];
            }
            boxes.push(SweptBox { edge, bounds });
        }
        let spread = |k: usize| extent[k][1] - extent[k][0];
        let axis = (0..3).max_by(|a, b| spread(*a).total_cmp(&spread(*b))).unwrap_or(0);
        boxes.sort_unstable_by(|a, b| a.bounds[axis][0].total_cmp(&b.bounds[axis][0]));
        for (i, one) in boxes.iter().enumerate() {
            for other in &boxes[i + 1..] {
                if other.bounds[axis][0] > one.bounds[axis][1] {
                    break;
                }
                let overlaps = |k: usize| {
                    let ([a, b], [c, d]) = (one.bounds[k], other.bounds[k]);
                    a <= d && c <= b
                };
                let pair = [one.edge.min(other.edge), one.edge.max(other.edge)];
                let [a, b] = pair.map(|i| &law.edges[i]);
                if (0..3).all(overlaps) && a.may_touch(b) {
                    visit(pair[0], pair[1]);
                }
            }
        }
    }

    /// Whether the edge after edge number `i` of a law belongs to the same rod, follows it, and may touch the edge
    /// `other` too.
    fn goes_on(&self, law: &ContactLaw<D>, i: usize, other: &TouchingEdge<D>) -> bool {
        let (own, next) = (&law.edges[i], law.edges.get(i + 1));
        next.is_some_and(|next| {
            next.rod == own.rod && next.first == own.first + self.stride && next.may_touch(other)
        })
    }

    /// Calls `visit` with every pair of edges that is close, the contact between both and their nodes at `q`.
    fn for_each_contact(
        &self,
        q: &[D],
        mut visit: impl FnMut([&TouchingEdge<D>; 2], EdgePair<D>, [[Vector<D>; 2]; 2]),
    ) {
        for law in &self.laws {
            self.for_each_pair(law, &[q], |i, j| {
                let (a, b) = (&law.edges[i], &law.edges[j]);
                let pair = EdgePair {
                    lengths: [a.length, b.length],
                    radii: [a.radius, b.radius],
                    stiffness: law.stiffness,
                    goes_on: [self.goes_on(law, i, b), self.goes_on(law, j, a)],
                };
                visit([a, b], pair, [self.nodes(a, q), self.nodes(b, q)]);
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
            self.for_each_pair(law, &[before, now], |i, j| {
                let (a, b) = (&law.edges[i], &law.edges[j]);
                let reach = a.radius.value() + b.radius.value();
                let at = |q: &[D]| plain([self.nodes(a, q), self.nodes(b, q)]);
                passed = passed || passes_edge(reach, at(before), at(now));
            });
            passed.then_some(law.index)
        })
    }

    /// The largest overlap over the smaller radius at `q`; `None` where no boxes of edges overlap.
    pub fn deepest(&self, q: &[D]) -> Option<DeepestOverlap> {
        let mut deepest: Option<DeepestOverlap> = None;
        for law in &self.laws {
            self.for_each_pair(law, &[q], |i, j| {
                let edges = [&law.edges[i], &law.edges[j]];
                let radii = edges.map(|edge| edge.radius.value());
                let distance = segment_distance(plain(edges.map(|edge| self.nodes(edge, q))));
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
fn plain<D: Scalar>(edges: [[Vector<D>; 2]; 2]) -> TwoEdges {
    edges.map(|nodes| nodes.map(|node| node.map(|x| x.value())))
}

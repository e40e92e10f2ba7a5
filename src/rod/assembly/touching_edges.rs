//! Edges of rods that may touch each other ([`TouchingEdge`]), and the pairs of them that are close.
//!
//! A [`ContactLaw`] has the numbers of a contact and its edges. `for_each_pair` visits the pairs whose boxes (edge and
//! radius) overlap; a sweep along the axis with the largest extent finds them. Left out are edges of one rod that are
//! closer along it than half the circumference of the thicker edge, and edges near a common body by the same distance
//! along both rods. `nodes` are the positions of an edge in the unknowns of the assembly, m. `pair` is the contact of
//! two edges, with the edges that follow them. `WorkSpace` is a list that evaluations keep.

use crate::energy::edge_pair::EdgePair;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::Vector;
use crate::scene::contact::ContactLoss;
use std::f64::consts::PI;
use std::sync::{Mutex, MutexGuard, PoisonError};

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
    /// Whether its angle may change, in space; not in a clamp.
    pub has_free_angle: bool,
    /// Distances from the ends of the rod that a body carries.
    pub joints: [Option<JointDistance>; 2],
}

impl<D: Scalar> TouchingEdge<D> {
    /// The positions of both nodes, m, of rods with `stride` unknowns from one node to the next; the third coordinate
    /// in a plane is zero.
    pub(super) fn nodes(&self, q: &[D], stride: usize) -> [Vector<D>; 2] {
        let width = stride.min(3);
        [0, 1].map(|i| {
            let mut node = [D::from(0.0); 3];
            let first = self.first + stride * i;
            node[..width].copy_from_slice(&q[first..first + width]);
            node
        })
    }

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
    /// The numbers of the forces that depend on the velocity; none without any.
    pub(crate) loss: Option<ContactLoss<D>>,
    /// The edges, rod after rod, in their order along the rods.
    pub edges: Vec<TouchingEdge<D>>,
}

/// A list that is kept between evaluations; empty in a clone.
#[derive(Debug)]
pub(super) struct WorkSpace<T>(Mutex<Vec<T>>);

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
    pub(super) fn lock(&self) -> MutexGuard<'_, Vec<T>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Box around an edge: bounds along the axes, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct SweptBox {
    edge: usize,
    bounds: [[f64; 2]; 3],
}

impl<D: Scalar> ContactLaw<D> {
    /// Calls `visit` with every pair of edges whose boxes overlap at one of the `states`, indices in ascending order.
    /// The box of an edge contains it at all of these unknowns. `boxes` are work space, and `stride` is the number of
    /// unknowns from one node to the next.
    pub(super) fn for_each_pair(
        &self,
        boxes: &WorkSpace<SweptBox>,
        stride: usize,
        states: &[&[D]],
        mut visit: impl FnMut(usize, usize),
    ) {
        let mut boxes = boxes.lock();
        boxes.clear();
        let mut extent = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for (edge, own) in self.edges.iter().enumerate() {
            let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
            let radius = own.radius.value();
            for node in states.iter().flat_map(|q| own.nodes(q, stride)) {
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
                let [a, b] = pair.map(|i| &self.edges[i]);
                if (0..3).all(overlaps) && a.may_touch(b) {
                    visit(pair[0], pair[1]);
                }
            }
        }
    }

    /// Whether the edge after edge number `i` belongs to the same rod, follows it, and may touch the edge
    /// `other` too.
    fn goes_on(&self, stride: usize, i: usize, other: &TouchingEdge<D>) -> bool {
        let (own, next) = (&self.edges[i], self.edges.get(i + 1));
        next.is_some_and(|next| {
            next.rod == own.rod && next.first == own.first + stride && next.may_touch(other)
        })
    }

    /// The contact of the edges number `i` and `j`.
    pub(super) fn pair(&self, stride: usize, [i, j]: [usize; 2]) -> EdgePair<D> {
        let (a, b) = (&self.edges[i], &self.edges[j]);
        EdgePair {
            lengths: [a.length, b.length],
            radii: [a.radius, b.radius],
            stiffness: self.stiffness,
            goes_on: [self.goes_on(stride, i, b), self.goes_on(stride, j, a)],
        }
    }
}

//! Energy of a tendon of given tension: the tension times the length of its route in the rod, J.
//!
//! The route has the offsets `r1`, `r2` (m) along the material directors, linear in arc length between its points. An
//! element covers a part of the rod around an inner node, or a part of one edge. With the mean length `l` of its edges,
//! the integrated curvatures `k1`, `k2` towards the directors, the integrated twist `t`, and the changes `dr1`, `dr2`
//! of the offsets over it, its vector in the directors is
//!
//! ```text
//! along  w (l - k1 r1 - k2 r2)     d1  dr1 - w t r2     d2  dr2 + w t r1
//! ```
//!
//! `w` is the covered fraction of the cell of the node, or of the edge. This is the derivative of a point beside the
//! center line of a Cosserat rod (Rucker and Webster, IEEE Transactions on Robotics 27, 2011, eq. 11), integrated over
//! the element. Curvatures are those of the bending elements, so that a tendon beside a straight planar rod has exactly
//! the moment `T r` in every joint. The twist is that of the Cayley vector of the rotation between both edges.
//!
//! This is the definition of the energy, over any scalar. Simulations use the hand-derived derivatives of [`element`],
//! with [`route_length`], `planar` and `spatial`. They are compared with those of the definition in dual numbers.

pub(crate) mod element;
mod planar;
mod route_length;
mod spatial;

use crate::energy::own::OwnEnergy;
use crate::energy::place::{Directors, Place};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub};
use crate::scene::number::Quantity;

/// The element of a tendon over `N` nodes: around the inner one of three, or along the edge of two.
pub(crate) struct Tendon<const N: usize>;

/// Numbers of an element of a tendon, in the list of its place: arc length, then these.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoutePart<D> {
    /// Fraction of the cell of the node, or of the edge, that it covers.
    pub weight: D,
    /// Mean offsets along both directors, m.
    pub offset: [D; 2],
    /// Changes of the offsets over the element, m.
    pub change: [D; 2],
}

impl<D: Copy> RoutePart<D> {
    /// The list of numbers of a [`Place`] at the arc length `at`, m: `at`, the weight, both offsets, m, and both
    /// changes, m.
    pub fn numbers(&self, at: D) -> Vec<D> {
        let Self { weight, offset: [r1, r2], change: [dr1, dr2] } = *self;
        vec![at, weight, r1, r2, dr1, dr2]
    }
}

/// The quantity of the only parameter, the tension.
const PARAMETERS: [(&str, Quantity); 1] = [("tension", Quantity::signed("N"))];

impl<D: Scalar> RoutePart<D> {
    /// The part with the list of numbers of a place, the inverse of [`numbers`](Self::numbers); `number(i)` is entry
    /// `i`.
    #[inline]
    pub fn from_numbers(number: impl Fn(usize) -> D) -> Self {
        Self { weight: number(1), offset: [number(2), number(3)], change: [number(4), number(5)] }
    }

    /// The vector of the part in the directors, m (formula of the module): along the tangent, and towards both
    /// directors. `length` is the mean length of the edges of its element, m; `curvature` has the integrated curvatures
    /// towards both directors.
    #[inline]
    pub fn vector(&self, length: D, curvature: [D; 2], twist: D) -> Vector<D> {
        let Self { weight, offset: [r1, r2], change: [dr1, dr2] } = *self;
        [
            weight * (length - curvature[0] * r1 - curvature[1] * r2),
            dr1 - weight * twist * r2,
            dr2 + weight * twist * r1,
        ]
    }

    /// The length of the part, m: that of its [vector](Self::vector) at the same arguments.
    #[inline]
    fn length(&self, length: D, curvature: [D; 2], twist: D) -> D {
        let vector = self.vector(length, curvature, twist);
        dot(vector, vector).sqrt()
    }
}

/// The distance of the points `a` and `b`, m.
fn distance<D: Scalar>(a: Vector<D>, b: Vector<D>) -> D {
    let edge = sub(b, a);
    dot(edge, edge).sqrt()
}

impl OwnEnergy<3, 1> for Tendon<3> {
    const PARAMETERS: [(&'static str, Quantity); 1] = PARAMETERS;

    /// The tension, N, times the length of the route over the cell of the inner node (half an edge on either side), J.
    fn energy<D: Scalar>(
        &self,
        place: &Place<D>,
        [tension]: &[D; 1],
        nodes: &[Vector<D>; 3],
        edges: &[Directors<D>],
    ) -> D {
        let ([t0, a0, b0], [t1, a1, b1]) = (edges[0], edges[1]);
        let mean = (distance(nodes[0], nodes[1]) + distance(nodes[1], nodes[2])) * 0.5;
        // Curvature binormal of the joint; the curvature towards d1 turns about d2.
        let cosine = dot(t0, t1);
        let binormal = scale(cross(t0, t1), (cosine + 1.0).recip() * 2.0);
        let towards_first = dot(binormal, add(b0, b1)) * 0.5;
        let towards_second = -(dot(binormal, add(a0, a1)) * 0.5);
        // Cayley vector of the rotation from one frame to the other, along the tangent.
        let trace = cosine + dot(a0, a1) + dot(b0, b1);
        let axis = add(add(cross(t0, t1), cross(a0, a1)), cross(b0, b1));
        let twist = dot(axis, t0) * 2.0 / (trace + 1.0);
        let part = RoutePart::from_numbers(|i| place.number(i));
        *tension * part.length(mean, [towards_first, towards_second], twist)
    }

    /// Always true: whether the rod is modeled in the plane or in space is decided before, by the offsets of the route.
    fn keeps_plane(&self, _: &[f64; 1], _: [f64; 3], _: [f64; 3]) -> bool {
        true
    }
}

impl OwnEnergy<2, 1> for Tendon<2> {
    const PARAMETERS: [(&'static str, Quantity); 1] = PARAMETERS;

    /// The tension, N, times the length of the route over the part of an edge, which has no curvature and no twist, J.
    fn energy<D: Scalar>(
        &self,
        place: &Place<D>,
        [tension]: &[D; 1],
        nodes: &[Vector<D>; 2],
        _: &[Directors<D>],
    ) -> D {
        let zero = D::from(0.0);
        let part = RoutePart::from_numbers(|i| place.number(i));
        *tension * part.length(distance(nodes[0], nodes[1]), [zero; 2], zero)
    }

    /// Always true: whether the rod is modeled in the plane or in space is decided before, by the offsets of the route.
    fn keeps_plane(&self, _: &[f64; 1], _: [f64; 3], _: [f64; 3]) -> bool {
        true
    }
}

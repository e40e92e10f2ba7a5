//! Material frames of the edges of a rod in space, and their parallel transport in time (Bergou et al. 2010, section
//! 4.2).
//!
//! Every edge keeps a reference: its unit tangent and one director at the last accepted state. At another state the
//! director is transported in parallel from the old tangent to the new one. The edge's angle `theta` then turns it
//! into the material director `m1`. Every inner node keeps the reference twist, rad. To define it, the director of
//! the first edge is transported to the tangent of the second. The reference twist is the angle from there to the
//! director of the second edge. It is continuous beyond half a turn.
//!
//! Between two acceptances the energy is a function of the unknowns alone; this module moves the reference
//! ([`Frames::update_reference_frames`]) without changing that energy.
//!
//! [`Frames::bishop`] makes frames without twist along given tangents. `transport` moves a vector from one unit tangent
//! to another. [`transported_twist`] is an angle, rad, of two edges whose tangents change in time. It is the turn of
//! the second director against the first by their transport: the area of a spherical quadrangle. The twist at the new
//! tangents is the reference twist less this angle, plus the difference of both `theta`. `EdgeFrame::material` returns
//! both material directors at a tangent and an angle. `Frames::replace` exchanges the frame of one edge, with the
//! reference twists of its joints.
//!
//! `EdgeFrame::transported` is the frame moved to another tangent by parallel transport. `EdgeFrame::turned` returns
//! both directors after a rotation about the tangent. `moved_twist` is the reference twist of a joint after its edges
//! moved. `one_plus_dot` is `1 + a.b` of unit vectors, accurate also where they oppose each other. `pack_lanes`,
//! `after` and `vector_after` put consecutive edges in SIMD lanes and shift these by one edge.

use crate::numerics::scalar::{Scalar, SimdScalar};
use crate::numerics::vector::{Vector, add, combine, cross, dot, map_components, scale, sub, unit};
use std::f64::consts::TAU;

/// Tangent and first director of an edge, orthonormal.
#[derive(Clone, Copy, Debug)]
pub struct EdgeFrame<D> {
    /// Unit tangent.
    pub tangent: Vector<D>,
    /// First reference director.
    pub director: Vector<D>,
}

/// The reference of all edges and inner nodes.
#[derive(Debug)]
pub struct Frames<D> {
    /// The frame of every edge, from the start.
    pub edges: Vec<EdgeFrame<D>>,
    /// Reference twist, one per inner node, rad.
    pub twist: Vec<D>,
}

impl<D: Clone> Clone for Frames<D> {
    /// A copy of frames and reference twists.
    fn clone(&self) -> Self {
        Self { edges: self.edges.clone(), twist: self.twist.clone() }
    }
    /// Copies `from` into the existing vectors; allocates nothing if their capacity suffices.
    fn clone_from(&mut self, from: &Self) {
        self.edges.clone_from(&from.edges);
        self.twist.clone_from(&from.twist);
    }
}

/// `1 + a.b` of two unit vectors, to full accuracy when they nearly oppose each other.
#[inline(always)]
pub fn one_plus_dot<D: Scalar>(a: Vector<D>, b: Vector<D>) -> D {
    let sum = add(a, b);
    dot(sum, sum) * 0.5
}

/// Parallel transport of `v`, perpendicular to the unit vector `a`, to the unit vector `b`:
/// `v - (b.v)/(1 + a.b) (a + b)`.
#[inline(always)]
pub fn transport<D: Scalar>(a: Vector<D>, b: Vector<D>, v: Vector<D>) -> Vector<D> {
    let sum = add(a, b);
    sub(v, scale(sum, dot(b, v) / (dot(sum, sum) * 0.5)))
}

/// A complex number `[real, imaginary]` whose argument is half the signed area of the spherical triangle `a b c` of
/// unit vectors: `[(a + b).(b + c), a.(b x c)]`.
#[inline(always)]
fn half_area<D: Scalar>(a: Vector<D>, b: Vector<D>, c: Vector<D>) -> [D; 2] {
    [dot(add(a, b), add(b, c)), dot(a, cross(b, c))]
}

/// The angle by which parallel transport in time, from the reference tangents `e0`, `f0` to `e`,
/// `f`, turns the director of `f` against that of `e`: the area of the spherical quadrangle
/// `e0 e f f0`, rad.
///
/// The quadrangle is cut along the shorter of its diagonals: a cut is singular where its ends
/// oppose each other. Areas beyond half the sphere, which need a turning angle and a rotation of
/// more than 180 degrees together, are indistinguishable from their complements.
#[inline(always)]
pub fn transported_twist<D: Scalar>([e0, f0]: [Vector<D>; 2], [e, f]: [Vector<D>; 2]) -> D {
    let (near, far) = (dot(e, f0), dot(e0, f));
    // The longer of the two scalar products belongs to the shorter diagonal.
    let (x, y) = (nearer(near, far, f0, f), nearer(near, far, e, e0));
    // Half areas are arguments of complex numbers: their product has the sum of both.
    let (a, b) = (half_area(e0, e, x), half_area(y, f, f0));
    argument(a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]) * 2.0
}

/// `a` where `near` is more than `far`, elsewhere `b`: a selection without a branch, so that joints can be computed in
/// SIMD lanes.
#[inline(always)]
fn nearer<D: Scalar>(near: D, far: D, a: Vector<D>, b: Vector<D>) -> Vector<D> {
    [far.if_less(near, a[0], b[0]), far.if_less(near, a[1], b[1]), far.if_less(near, a[2], b[2])]
}

/// A vector with each component shifted by one SIMD lane towards earlier edges; the last lane receives the first lane
/// of `later`.
#[inline(always)]
pub(crate) fn vector_after<S, V: SimdScalar<S>>(own: Vector<V>, later: Vector<V>) -> Vector<V> {
    [own[0].after(later[0]), own[1].after(later[1]), own[2].after(later[2])]
}

/// The argument of the complex number `x + i y`, rad, in (-pi, pi]. For `|y| < 0.02 x`, as over a step, it is the
/// series of the arc tangent, exact to rounding. `atan2` is evaluated only if a SIMD lane exceeds that bound.
#[inline(always)]
fn argument<D: Scalar>(x: D, y: D) -> D {
    let t = y / x;
    let s = t * t;
    let higher = ((s * (-1.0 / 11.0) + 1.0 / 9.0) * s - 1.0 / 7.0) * s + 0.2;
    let series = t * ((higher * s - 1.0 / 3.0) * s + 1.0);
    let (size, bound) = (y.abs(), x * 0.02);
    if size.all_less(bound) {
        return series;
    }
    size.if_less(bound, series, y.atan2(x))
}

impl<D: Scalar> EdgeFrame<D> {
    /// The frames `all` of consecutive edges as one frame in SIMD lanes: lane `k` has the numbers of frame `k`.
    #[inline(always)]
    pub(crate) fn pack_lanes<V: SimdScalar<D>>(level: V::Level, all: &[Self]) -> EdgeFrame<V> {
        EdgeFrame {
            tangent: [
                V::gather(level, |lane| all[lane].tangent[0]),
                V::gather(level, |lane| all[lane].tangent[1]),
                V::gather(level, |lane| all[lane].tangent[2]),
            ],
            director: [
                V::gather(level, |lane| all[lane].director[0]),
                V::gather(level, |lane| all[lane].director[1]),
                V::gather(level, |lane| all[lane].director[2]),
            ],
        }
    }

    /// The frames shifted by one SIMD lane towards earlier edges; the last lane receives the first lane of `later`.
    #[inline(always)]
    pub(crate) fn after<S>(&self, later: &Self) -> Self
    where
        D: SimdScalar<S>,
    {
        Self {
            tangent: vector_after(self.tangent, later.tangent),
            director: vector_after(self.director, later.director),
        }
    }

    /// The frame with every number converted to another number type.
    pub(crate) fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> EdgeFrame<E> {
        let Self { tangent, director } = self;
        EdgeFrame {
            tangent: map_components(tangent, &convert),
            director: map_components(director, &convert),
        }
    }

    /// The frame after parallel transport to the unit vector `tangent`; its director is made orthonormal to that again.
    #[inline(always)]
    pub fn transported(&self, tangent: Vector<D>) -> Self {
        let director = transport(self.tangent, tangent, self.director);
        // Rounding errors of many steps must not add up.
        let along = dot(director, tangent);
        Self { tangent, director: unit(sub(director, scale(tangent, along))) }
    }

    /// Angle, rad in (-pi, pi], from the director of this frame, transported to the tangent of `other`, to the director
    /// of `other`.
    #[inline(always)]
    fn angle_to(&self, other: &Self) -> D {
        let d = transport(self.tangent, other.tangent, self.director);
        argument(dot(d, other.director), dot(other.tangent, cross(d, other.director)))
    }

    /// The two directors after a rotation by `angle`, rad, about the tangent: `[cos d1 + sin d2, cos d2 - sin d1]` with
    /// the director `d1` and `d2 = t x d1`.
    #[inline(always)]
    pub fn turned(&self, angle: D) -> [Vector<D>; 2] {
        let (d1, d2) = (self.director, cross(self.tangent, self.director));
        let [sin, cos] = angle.sin_cos();
        [combine(cos, d1, sin, d2), combine(-sin, d1, cos, d2)]
    }

    /// The two material directors after transport to the unit vector `tangent` and a rotation by `angle`, rad.
    #[inline(always)]
    pub fn material(&self, tangent: Vector<D>, angle: D) -> [Vector<D>; 2] {
        let director = transport(self.tangent, tangent, self.director);
        Self { tangent, director }.turned(angle)
    }
}

impl<D: Scalar> Frames<D> {
    /// Frames without twist (Bishop frames) along the unit vectors `tangents`: `director` on the first edge,
    /// transported in parallel from edge to edge. Reference twists are zero, one fewer than edges. `director` must be a
    /// unit vector across the first tangent.
    pub fn bishop(tangents: &[Vector<D>], director: Vector<D>) -> Self {
        let mut edges: Vec<EdgeFrame<D>> = Vec::with_capacity(tangents.len());
        for tangent in tangents {
            let first = EdgeFrame { tangent: *tangent, director };
            let edge = edges.last().map_or(first, |edge| edge.transported(*tangent));
            edges.push(edge);
        }
        Self { twist: vec![D::from(0.0); tangents.len().saturating_sub(1)], edges }
    }

    /// Replaces the frame of edge `j` by `to`, and adapts the reference twists of its joints. The turn is the angle of
    /// the director of `to` from that of the present frame, transported to its tangent; it is taken below half a turn.
    /// The strains of joints stay if the angle of the edge is reduced by that turn, which the caller does.
    pub(crate) fn replace(&mut self, j: usize, to: &EdgeFrame<D>) {
        let from = self.edges[j];
        let moved = from.transported(to.tangent);
        let across = dot(to.tangent, cross(moved.director, to.director));
        let turn = argument(dot(moved.director, to.director), across);
        // The twist of the joint before the edge grows with its turn, that of the joint after it
        // falls.
        if j > 0 {
            let before = self.edges[j - 1];
            let tangents = [before.tangent, from.tangent];
            self.twist[j - 1] = moved_twist(tangents, [&before, &moved], self.twist[j - 1]) + turn;
        }
        if let (Some(after), Some(twist)) = (self.edges.get(j + 1), self.twist.get_mut(j)) {
            *twist = moved_twist([from.tangent, after.tangent], [&moved, after], *twist) - turn;
        }
        self.edges[j] = *to;
    }

    /// Moves the reference to the unit vector `tangent(j)` for each edge `j`. Directors are transported; reference
    /// twists follow continuously (`moved_twist`). The energy does not change.
    pub fn update_reference_frames(&mut self, tangent: impl Fn(usize) -> Vector<D>) {
        let mut before = None;
        for j in 0..self.edges.len() {
            let from = self.edges[j].tangent;
            self.edges[j] = self.edges[j].transported(tangent(j));
            // A joint needs the old tangents of both of its edges, and their new frames.
            if let Some(left) = before {
                let to = [&self.edges[j - 1], &self.edges[j]];
                self.twist[j - 1] = moved_twist([left, from], to, self.twist[j - 1]);
            }
            before = Some(from);
        }
    }
}

/// The reference twist, rad, of a joint whose edges have moved from the tangents `from` to the frames `to` and had the
/// twist `before`. It is continuous beyond half a turn.
///
/// The angle follows from the new directors, so that rounding errors do not add up over many moves. The transported
/// twist only determines the number of whole turns.
#[inline(always)]
pub(crate) fn moved_twist<D: Scalar>(from: [Vector<D>; 2], to: [&EdgeFrame<D>; 2], before: D) -> D {
    let angle = to[0].angle_to(to[1]);
    let expected = before - transport_turns(from, [to[0].tangent, to[1].tangent]);
    angle + ((expected - angle) * TAU.recip()).nearest_whole() * TAU
}

/// [`transported_twist`], rad, for the number of whole turns: zero where it is certainly below half a turn. That is so
/// when both edges moved by less than 0.14 rad and form no fold: the area of the quadrangle is then below 2.
#[inline(always)]
fn transport_turns<D: Scalar>([e0, f0]: [Vector<D>; 2], [e, f]: [Vector<D>; 2]) -> D {
    let (moved_e, moved_f, folded) = (dot(e0, e), dot(f0, f), dot(e, f));
    let (near, straight) = (e[0].like(0.99), e[0].like(-0.9));
    if near.all_less(moved_e) && near.all_less(moved_f) && straight.all_less(folded) {
        return e[0].like(0.0);
    }
    transported_twist([e0, f0], [e, f])
}

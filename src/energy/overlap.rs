//! Overlap of a rod, as a tube around its edges, with an obstacle, m: positive where they penetrate, at most zero
//! elsewhere.
//!
//! Input: an obstacle, a part of an edge ([`ContactPart`], with the radius of the rod, m), and the positions of both
//! nodes of the edge, m. At a point in the distance `d` from a plane the overlap is `radius - d`. At the distance `d`
//! from the center of a sphere or the axis of a cylinder it is `(D^2 - d^2)/(2 D)`. `D` is the sum of both radii
//! (derivation in [`edge_contact`]). [`EdgePart`] has the surfaces that the edge may touch, each with its part of the
//! edge: three of a capsule (sides and both ends), one of other obstacles. [`Overlap`] is the overlap with one surface.
//! `surfaces` is the number of surfaces, and `surface` one of them with its part of the edge. [`OverlapAlong`]
//! (`Overlap::along`) is the overlap along the edge, a polynomial of second degree, with its gradients at the nodes and
//! the part of the edge where it is positive. `positive_part` returns that part as numbers, `moving_part` with the
//! derivatives of its ends, and `at_moving` the overlap at a fraction that has derivatives. [`largest_overlap`] returns
//! the largest overlap of an edge part. `EdgePart::is_apart` is true only if the edge is certainly out of reach of the
//! obstacle, `is_apart_within` only if it remains so under a movement of the nodes.
//!
//! [`edge_contact`]: crate::energy::edge_contact

use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, dot, scale, sub};
use crate::scene::contact::{Obstacle, ObstacleKind};

/// Part of an edge that may touch an obstacle: numbers of its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactPart<D> {
    /// Arc length of the middle of the edge, m.
    pub arc_length: D,
    /// Rest length of the edge, m.
    pub length: D,
    /// Bounds of the part as fractions of the edge; the rest is behind a wall.
    pub bounds: [f64; 2],
    /// Radius of the rod, m.
    pub radius: D,
}

impl<D: Copy> ContactPart<D> {
    /// The part with its numbers converted to another number type by `over`; the bounds stay plain numbers.
    pub fn map<E>(&self, over: impl Fn(D) -> E) -> ContactPart<E> {
        let Self { arc_length, length, bounds, radius } = *self;
        let (arc_length, length) = (over(arc_length), over(length));
        ContactPart { arc_length, length, bounds, radius: over(radius) }
    }
}

/// Surface of which the overlap is a polynomial of second degree along an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Surface {
    /// Plane through `point` with the normal `axis`.
    Plane,
    /// Points at one distance from `point`.
    Sphere,
    /// Points at one distance from the line through `point` along `axis`.
    Cylinder,
}

/// Overlap with one surface of an obstacle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Overlap<D> {
    pub surface: Surface,
    /// Distance of center lines at touching; from a plane the radius of the rod, m.
    pub reach: D,
    pub point: Vector<D>,
    pub axis: Vector<D>,
}

impl<D: Scalar> Overlap<D> {
    /// Overlap at the point `x`, m, and its gradient. Of a plane it is `reach - d` at the distance `d` along the
    /// normal. Else it is `(reach^2 - d^2)/(2 reach)` at the distance `d` from the center or axis.
    #[inline(always)]
    pub fn at(&self, x: Vector<D>) -> (D, Vector<D>) {
        let way = sub(x, self.point);
        let along = dot(way, self.axis);
        let across = match self.surface {
            Surface::Plane => {
                let [a, b, c] = self.axis;
                return (self.reach - along, [-a, -b, -c]);
            }
            Surface::Sphere => way,
            Surface::Cylinder => sub(way, scale(self.axis, along)),
        };
        let overlap = (self.reach - dot(across, across) / self.reach) * 0.5;
        (overlap, scale(across, -self.reach.recip()))
    }

    /// The overlap along the straight edge between the nodes `a` and `b`, as a polynomial of the fraction of the edge.
    #[inline(always)]
    pub fn along(&self, [a, b]: [Vector<D>; 2]) -> OverlapAlong<D> {
        let ((first, start), (last, end)) = (self.at(a), self.at(b));
        // The gradient of a round surface is linear along the edge.
        let bulge = match self.surface {
            Surface::Plane => D::from(0.0),
            Surface::Sphere | Surface::Cylinder => {
                let change = sub(end, start);
                dot(change, change) * self.reach * 0.5
            }
        };
        let coefficients = [first, last - first + bulge, -bulge];
        OverlapAlong { coefficients, slopes: [start, end] }
    }
}

/// The overlap along an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OverlapAlong<D> {
    /// Its coefficients by powers of the fraction of the edge, m.
    coefficients: [D; 3],
    /// Its gradients at both nodes.
    pub slopes: [Vector<D>; 2],
}

impl<D: Scalar> OverlapAlong<D> {
    /// The overlap at the fraction `t` of the edge, m.
    #[inline(always)]
    pub fn at(&self, t: f64) -> D {
        let [c0, c1, c2] = self.coefficients;
        c0 + (c1 + c2 * t) * t
    }

    /// The overlap, m, at the fraction `t` of the edge, which has derivatives of its own.
    pub fn at_moving(&self, t: D) -> D {
        let [c0, c1, c2] = self.coefficients;
        c0 + (c1 + c2 * t) * t
    }

    /// The [positive part](Self::positive_part) within `bounds`, fractions of the edge, with the derivatives of its
    /// ends: those of a bound, or of a root of the overlap. `None` without a positive part.
    pub fn moving_part(&self, bounds: [D; 2]) -> Option<[D; 2]> {
        let part = self.positive_part(bounds)?;
        let [_, c1, c2] = self.coefficients;
        let end = |end: f64, bound: D| {
            if end == bound.value() {
                return bound;
            }
            // Newton's method at the root: one more order of derivatives in each iteration.
            let mut t = D::from(end);
            for _ in 0..D::ORDER {
                let slope = c1 + c2 * t * 2.0;
                // At a double root the overlap is a rounding error: the end has no derivatives.
                if slope.value() != 0.0 {
                    t -= self.at_moving(t) / slope;
                }
            }
            t
        };
        Some([end(part[0], bounds[0]), end(part[1], bounds[1])])
    }

    /// The interval within `bounds`, fractions of the edge, in which the overlap is positive; `None` without one.
    #[inline(always)]
    pub fn positive_part(&self, bounds: [D; 2]) -> Option<[f64; 2]> {
        let bounds = [bounds[0].value(), bounds[1].value()];
        let [c0, c1, c2] = self.coefficients;
        let (c0, c1, c2) = (c0.value(), c1.value(), c2.value());
        let ends = [self.at(bounds[0]).value(), self.at(bounds[1]).value()];
        // The polynomial is concave (c2 <= 0), and so positive between positive values.
        if ends[0] > 0.0 && ends[1] > 0.0 && bounds[0] < bounds[1] {
            return Some(bounds);
        }
        let discriminant = c1 * c1 - 4.0 * c2 * c0;
        if bounds[0] >= bounds[1]
            || discriminant < 0.0
            || c2 == 0.0 && ends[0] <= 0.0 && ends[1] <= 0.0
        {
            return None;
        }
        // The form without cancellation: with c2 = -0 of a plane one root is infinite, on the correct side.
        let q = -0.5 * (c1 + discriminant.sqrt().copysign(c1));
        if q == 0.0 {
            return (c0 > 0.0).then_some(bounds);
        }
        let (one, other) = (q / c2, c0 / q);
        let [from, to] = [one.min(other).max(bounds[0]), one.max(other).min(bounds[1])];
        (from < to).then_some([from, to])
    }

    /// Largest overlap, m, within `bounds`, fractions of the edge; negative without contact.
    fn largest(&self, bounds: [f64; 2]) -> f64 {
        let [_, c1, c2] = self.coefficients;
        let top = (-0.5 * c1.value() / c2.value()).clamp(bounds[0], bounds[1]);
        let ends = self.at(bounds[0]).value().max(self.at(bounds[1]).value());
        if top.is_finite() { self.at(top).value().max(ends) } else { ends }
    }
}

/// A part of an edge, and the obstacle that it may touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgePart<'a, D> {
    pub obstacle: &'a Obstacle<D>,
    pub part: &'a ContactPart<D>,
}

impl<D: Scalar> EdgePart<'_, D> {
    /// Number of surfaces of the obstacle: 3 of a capsule (its sides and both ends), 1 of any other.
    #[inline(always)]
    pub fn surfaces(&self) -> usize {
        if self.obstacle.kind == ObstacleKind::Capsule { 3 } else { 1 }
    }

    /// Whether the edge between two nodes is certainly out of reach of a round obstacle, by a bound on the distance of
    /// its middle. False does not imply contact; always false of planes.
    #[inline(always)]
    pub fn is_apart(&self, nodes: [Vector<D>; 2]) -> bool {
        // (r + h)^2 <= 2 (r^2 + h^2) with the reach r and half an edge h.
        self.is_middle_apart(nodes, |square, half| 2.0 * (square + half))
    }

    /// Whether the edge between two nodes remains certainly out of reach of a round obstacle if its nodes move by at
    /// most the square root of `squared_movement`, m^2. False does not imply contact; always false of planes.
    pub fn is_apart_within(&self, nodes: [Vector<D>; 2], squared_movement: f64) -> bool {
        // (r + h + m)^2 <= 3 (r^2 + h^2 + m^2) with the movement m.
        self.is_middle_apart(nodes, |square, half| 3.0 * (square + half + squared_movement))
    }

    /// Whether the squared distance of the middle of the edge from a round obstacle, m^2, is above a `bound`, a
    /// function of the squares of the reach and of half an edge. False of planes.
    #[inline(always)]
    fn is_middle_apart(&self, [a, b]: [Vector<D>; 2], bound: impl Fn(f64, f64) -> f64) -> bool {
        let surface = match self.obstacle.kind {
            ObstacleKind::Plane => return false,
            ObstacleKind::Sphere => Surface::Sphere,
            ObstacleKind::Cylinder | ObstacleKind::Capsule => Surface::Cylinder,
        };
        let (edge, overlap) = (sub(b, a), self.overlap(surface, self.obstacle.point));
        let middle = overlap.at(scale(add(a, b), D::from(0.5))).0.value();
        let (reach, squared_half) = (overlap.reach.value(), 0.25 * dot(edge, edge).value());
        reach * (reach - 2.0 * middle) > bound(reach * reach, squared_half)
    }

    /// The overlap with a `surface` of the obstacle whose center, or a point of whose axis or plane, is `point`, m.
    #[inline(always)]
    fn overlap(&self, surface: Surface, point: Vector<D>) -> Overlap<D> {
        let Obstacle { radius, axis, .. } = *self.obstacle;
        Overlap { surface, reach: radius + self.part.radius, point, axis }
    }

    /// Surface number `k` of the obstacle, with the bounds, fractions of the edge between two nodes, of the part that
    /// may touch it. Of a capsule 0 is the side, 1 the first and 2 the last end. Bounds in descending order are an
    /// empty part.
    #[inline(always)]
    pub fn surface(&self, k: usize, nodes: [Vector<D>; 2]) -> (Overlap<D>, [D; 2]) {
        let surface = match self.obstacle.kind {
            ObstacleKind::Plane => Surface::Plane,
            ObstacleKind::Sphere => Surface::Sphere,
            ObstacleKind::Cylinder => Surface::Cylinder,
            ObstacleKind::Capsule => return self.capsule_surface(k, nodes),
        };
        let [from, to] = self.part.bounds;
        (self.overlap(surface, self.obstacle.point), [D::from(from), D::from(to)])
    }

    /// [`surface`](Self::surface) of a capsule: its sides (`k` = 0), and the spheres at its first (1) and last end (2).
    /// The edge is divided where it passes the ends of the axis.
    fn capsule_surface(&self, k: usize, [a, b]: [Vector<D>; 2]) -> (Overlap<D>, [D; 2]) {
        let Obstacle { point, axis, length, .. } = *self.obstacle;
        let [from, to] = self.part.bounds.map(D::from);
        let height = |x: Vector<D>| dot(sub(x, point), axis);
        let (start, rise) = (height(a), height(b) - height(a));
        // Fractions of the edge at which it passes the ends of the axis; an edge across the axis passes none.
        let pass = |level: D| {
            let at = (level - start) / rise;
            match at.value() {
                x if x <= from.value() => from,
                x if x >= to.value() => to,
                x if x.is_finite() => at,
                _ if start.value() < level.value() => to,
                _ => from,
            }
        };
        let [low, high] = [pass(D::from(0.0)), pass(length)];
        let (first, last) = (point, add(point, scale(axis, length)));
        match (k, rise.value() < 0.0) {
            (0, false) => (self.overlap(Surface::Cylinder, point), [low, high]),
            (0, true) => (self.overlap(Surface::Cylinder, point), [high, low]),
            (1, false) => (self.overlap(Surface::Sphere, first), [from, low]),
            (1, true) => (self.overlap(Surface::Sphere, first), [low, to]),
            (_, false) => (self.overlap(Surface::Sphere, last), [high, to]),
            (_, true) => (self.overlap(Surface::Sphere, last), [from, high]),
        }
    }
}

/// Largest overlap, m, of a part of an edge between two nodes with all surfaces of an obstacle; negative without
/// contact.
pub(crate) fn largest_overlap(edge: EdgePart<'_, f64>, nodes: [Vector<f64>; 2]) -> f64 {
    let mut largest = f64::NEG_INFINITY;
    for k in 0..edge.surfaces() {
        let (overlap, [from, to]) = edge.surface(k, nodes);
        // Beside the ends of a capsule the part at its side is empty.
        if from < to {
            largest = largest.max(overlap.along(nodes).largest([from, to]));
        }
    }
    largest
}

//! Overlap of a rod, as a tube around its edges, with an obstacle: along an edge, m.
//!
//! Input: an obstacle, the positions of the nodes of an edge (m) and the radius of the rod (m). [`EdgePart`] lists the surfaces
//! that the edge may touch, each with its part of the edge: three of a capsule, one of other obstacles. [`Overlap`] is the
//! overlap with one surface, a polynomial of second degree along the edge (formulas in [`edge_contact`]), and the part of the
//! edge where it is positive. [`largest_overlap`] returns the largest overlap of an edge.
//!
//! [`edge_contact`]: crate::energy::edge_contact

use crate::energy::adapter::Site;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, components, dot, scale, sub};
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

impl<D: Scalar> ContactPart<D> {
    /// The numbers of its place.
    pub fn numbers(&self) -> Vec<D> {
        let [from, to] = self.bounds.map(D::from);
        vec![self.arc_length, self.length, from, to, self.radius]
    }
}

/// Surface of which the overlap is a polynomial of second degree along an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Surface {
    /// Plane through `point` with the normal `axis`.
    Plane,
    /// Points at one distance from `point`.
    Sphere,
    /// Points at one distance from the line through `point` along `axis`.
    Cylinder,
}

/// Overlap with an obstacle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Overlap<D> {
    pub surface: Surface,
    /// Distance of center lines at touching; from a plane the radius of the rod, m.
    pub reach: D,
    pub point: Vector<D>,
    pub axis: Vector<D>,
}

impl<D: Scalar> Overlap<D> {
    /// Overlap at the point `x`, m, and its gradient.
    #[inline]
    pub fn at(&self, x: Vector<D>) -> (D, Vector<D>) {
        let way = sub(x, self.point);
        let along = dot(way, self.axis);
        let across = match self.surface {
            Surface::Plane => return (self.reach - along, self.axis.map(|c| -c)),
            Surface::Sphere => way,
            Surface::Cylinder => sub(way, scale(self.axis, along)),
        };
        let overlap = (self.reach - dot(across, across) / self.reach) * 0.5;
        (overlap, scale(across, -self.reach.recip()))
    }

    /// The overlap in plain numbers.
    pub fn plain(&self) -> Overlap<f64> {
        let plain = |v: &Vector<D>| [0, 1, 2].map(|c| v[c].value());
        Overlap {
            surface: self.surface,
            reach: self.reach.value(),
            point: plain(&self.point),
            axis: plain(&self.axis),
        }
    }
}

impl Overlap<f64> {
    /// Coefficients of the overlap along the edge from `a` to `b`, by powers of the fraction of the edge.
    fn coefficients(&self, [a, b]: [Vector<f64>; 2]) -> [f64; 3] {
        let ([first, _], edge) = ([self.at(a).0, 0.0], sub(b, a));
        let along = dot(edge, self.axis);
        let bulge = match self.surface {
            Surface::Plane => 0.0,
            Surface::Sphere => dot(edge, edge) / (2.0 * self.reach),
            // The difference of the squares may be negative by rounding.
            Surface::Cylinder => {
                let across = sub(edge, scale(self.axis, along));
                dot(across, across) / (2.0 * self.reach)
            }
        };
        [first, self.at(b).0 - first + bulge, -bulge]
    }

    /// The interval within `bounds`, fractions of the edge from `a` to `b`, in which the overlap is positive; `None` without
    /// one.
    pub fn positive(&self, nodes: [Vector<f64>; 2], bounds: [f64; 2]) -> Option<[f64; 2]> {
        if bounds[0] >= bounds[1] {
            return None;
        }
        let [c0, c1, c2] = self.coefficients(nodes);
        let discriminant = c1 * c1 - 4.0 * c2 * c0;
        if discriminant < 0.0 {
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

    /// Largest overlap, m, within `bounds` of the edge.
    fn largest(&self, nodes: [Vector<f64>; 2], bounds: [f64; 2]) -> f64 {
        let [c0, c1, c2] = self.coefficients(nodes);
        let at = |t: f64| c0 + t * (c1 + t * c2);
        let top = (-0.5 * c1 / c2).clamp(bounds[0], bounds[1]);
        let ends = at(bounds[0]).max(at(bounds[1]));
        if top.is_finite() { at(top).max(ends) } else { ends }
    }
}

/// Obstacle and part of an edge in contact, at one place of a rod.
pub(crate) struct EdgePart<D> {
    kind: ObstacleKind,
    pub overlap: Overlap<D>,
    pub stiffness: D,
    /// Distance of the centers of the ends of a capsule, m.
    axis_length: D,
    /// Rest length of the edge, m.
    pub length: D,
    /// Bounds as fractions of the edge.
    bounds: [f64; 2],
}

impl<D: Scalar> EdgePart<D> {
    /// The contact with an obstacle of a kind at a site, whose numbers are converted by `over`.
    #[inline]
    pub fn new<B: Scalar>(kind: ObstacleKind, site: &Site<B>, over: impl Fn(B) -> D) -> Self {
        let (value, place) = (|i: usize| over(site.values[i]), |i: usize| over(site.place[i]));
        let surface = match kind {
            ObstacleKind::Plane => Surface::Plane,
            ObstacleKind::Sphere => Surface::Sphere,
            ObstacleKind::Cylinder | ObstacleKind::Capsule => Surface::Cylinder,
        };
        let overlap = Overlap {
            surface,
            reach: value(1) + place(4),
            point: components(|c| value(2 + c)),
            axis: components(|c| value(5 + c)),
        };
        Self {
            kind,
            overlap,
            stiffness: value(0),
            axis_length: value(8),
            length: place(1),
            bounds: [site.place[2].value(), site.place[3].value()],
        }
    }

    /// Surfaces that the edge between two nodes may touch, each with its bounds on the edge: three of a capsule, one of
    /// others. Bounds in descending order are an empty part.
    #[inline]
    pub fn surfaces(&self, [a, b]: [Vector<f64>; 2]) -> [(Overlap<D>, [f64; 2]); 3] {
        let [from, to] = self.bounds;
        let empty = (self.overlap, [1.0, 0.0]);
        if self.kind != ObstacleKind::Capsule {
            return [(self.overlap, self.bounds), empty, empty];
        }
        let plain = self.overlap.plain();
        let height = |x: Vector<f64>| dot(sub(x, plain.point), plain.axis);
        let (start, rise) = (height(a), height(b) - height(a));
        let sphere = |at: D| Overlap {
            surface: Surface::Sphere,
            point: add(self.overlap.point, scale(self.overlap.axis, at)),
            ..self.overlap
        };
        let (first, last) = (sphere(D::from(0.0)), sphere(self.axis_length));
        // Fractions of the edge at which it passes the ends of the axis; an edge across the axis passes none.
        let pass = |level: f64| match (level - start) / rise {
            at if at.is_finite() => at.clamp(from, to),
            _ if start < level => to,
            _ => from,
        };
        let [low, high] = [pass(0.0), pass(self.axis_length.value())];
        if rise < 0.0 {
            return [(last, [from, high]), (self.overlap, [high, low]), (first, [low, to])];
        }
        [(first, [from, low]), (self.overlap, [low, high]), (last, [high, to])]
    }
}

/// Largest overlap, m, of an edge between two nodes with an obstacle; negative without contact. `bounds` are those of the part
/// of the edge, and `radius`, m, is that of the rod.
pub(crate) fn largest_overlap(
    obstacle: &Obstacle<f64>,
    part: &ContactPart<f64>,
    nodes: [Vector<f64>; 2],
) -> f64 {
    let Obstacle { kind, radius, point, axis, length } = *obstacle;
    let surface = match kind {
        ObstacleKind::Plane => Surface::Plane,
        ObstacleKind::Sphere => Surface::Sphere,
        ObstacleKind::Cylinder | ObstacleKind::Capsule => Surface::Cylinder,
    };
    let overlap = Overlap { surface, reach: radius + part.radius, point, axis };
    let (stiffness, bounds) = (0.0, part.bounds);
    let edge =
        EdgePart { kind, overlap, stiffness, axis_length: length, length: part.length, bounds };
    let parts = edge.surfaces(nodes).into_iter().filter(|(_, [from, to])| from <= to);
    parts.map(|(overlap, bounds)| overlap.largest(nodes, bounds)).fold(f64::NEG_INFINITY, f64::max)
}

//! Energy of the frictionless contact between two edges of rods, J.
//!
//! Rods are tubes around their edges. The overlap of a point `x` of one edge with the other edge is that with a capsule
//! around it: `delta = (D - d^2/D)/2` at the distance `d` from the segment, with the sum `D` of both radii. The force
//! per length is `k delta^2`, so that the energy of the point is `k delta^3/3` per length. It is integrated along the
//! edge as in [`edge_contact`](crate::energy::edge_contact), exactly by Gauss points, for each edge against the other;
//! a pair has half the sum. Where the other rod goes on behind an edge (`goes_on`), the sphere around their common node
//! would count in both capsules. It is subtracted once, so that the energy is that of the polygon, continuous with its
//! first derivatives wherever the nearest point is.
//!
//! Derivatives by the four nodes follow by hand. With the nearest point at the fraction `s` of the other edge, the
//! vector from it to `x` is `w = sum c_i y_i`, `c = (1 - t, t, s - 1, -s)` by the nodes `y` of both edges. The gradient
//! of `d^2` is `2 c_i w`, its second derivatives are
//!
//! ```text
//! 2 c_i c_j I - 2 m_i m_j'/(e.e)     with  m_i = c_i' w - c_i e,  c' = dc/ds = (0, 0, 1, -1)
//! ```
//!
//! for an interior nearest point (stationary in `s`), where `e` is the other edge. At its ends the second term is zero.
//!
//! Input: positions of the nodes along the axes of the model, m (the third coordinate in a plane is zero), rest lengths
//! and radii, m, and the stiffness `k`, N/m^3. `energy` is the energy, `derive` adds gradient (N) and Hessian (N/m).
//! `for_each_part` visits the parts that touch, and `touches` is whether there are any.

use crate::energy::edge_contact::GAUSS;
use crate::energy::overlap::{ContactPart, EdgePart, Overlap, OverlapAlong, Surface};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, components, dot, norm, scale, sub};
use crate::scene::contact::{Obstacle, ObstacleKind};

/// Nodes of an edge, m.
pub(crate) type EdgeNodes<D> = [Vector<D>; 2];

/// Contact between two edges.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgePair<D> {
    /// Rest lengths, m.
    pub lengths: [D; 2],
    /// Radii of the rods, m.
    pub radii: [D; 2],
    /// Force per length over the square of the overlap, N/m^3.
    pub stiffness: D,
    /// Of each edge: whether the next edge of its rod may touch the other edge too.
    pub goes_on: [bool; 2],
}

/// Gradient, N, and Hessian, N/m, by the nodes of both edges: of the first edge, then of the second.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairDerivatives<D> {
    pub gradient: [Vector<D>; 4],
    /// Block `[i][j]` by nodes `i` and `j`, for `j` up to `i`.
    pub hessian: [[[Vector<D>; 3]; 4]; 4],
}

impl<D: Scalar> PairDerivatives<D> {
    /// Zeros as gradient and Hessian.
    pub fn zero() -> Self {
        let zero = [D::from(0.0); 3];
        Self { gradient: [zero; 4], hessian: [[[zero; 3]; 4]; 4] }
    }
}

/// A part of one edge, along which the overlap with one surface around the other edge is positive.
pub(crate) struct TouchingPart<D> {
    overlap: Overlap<D>,
    /// Overlap along the edge by powers of its fraction `t`, from `bounds[0]` to `bounds[1]`.
    pub along: OverlapAlong<D>,
    bounds: [f64; 2],
    /// Fractions of this edge between which it may touch the surface.
    pub limits: [D; 2],
    /// Minus one of a sphere that is subtracted, else one.
    pub sign: f64,
    /// Fractions of the other edge nearest to both nodes of this one, or to all its points at a sphere.
    pub nearest: [D; 2],
}

impl<D: Copy> EdgePair<D> {
    /// The pair with its numbers converted to another number type.
    pub fn map<E>(&self, over: impl Fn(D) -> E + Copy) -> EdgePair<E> {
        let Self { lengths, radii, stiffness, goes_on } = *self;
        let (lengths, radii) = (lengths.map(over), radii.map(over));
        EdgePair { lengths, radii, stiffness: over(stiffness), goes_on }
    }
}

impl<D: Scalar> EdgePair<D> {
    /// The parts of edge number `own` (0 or 1) that touch the other one, for nodes of this and of the other edge.
    pub fn for_each_part(
        &self,
        own: usize,
        [nodes, other]: [EdgeNodes<D>; 2],
        mut visit: impl FnMut(TouchingPart<D>),
    ) {
        let edge = sub(other[1], other[0]);
        let length = norm(edge);
        let obstacle = Obstacle {
            kind: ObstacleKind::Capsule,
            radius: self.radii[1 - own],
            point: other[0],
            axis: scale(edge, length.recip()),
            length,
        };
        let part = ContactPart {
            arc_length: D::from(0.0),
            length: self.lengths[own],
            bounds: [0.0, 1.0],
            radius: self.radii[own],
        };
        let capsule = EdgePart { obstacle: &obstacle, part: &part };
        for k in 0..capsule.surfaces() {
            let (overlap, mut limits) = capsule.surface(k, nodes);
            let is_last = k == 2;
            // The sphere behind the edge less the whole one: minus the sphere before its end.
            let is_subtracted = is_last && self.goes_on[1 - own];
            if is_subtracted {
                let [zero, one] = [D::from(0.0), D::from(1.0)];
                let falls = dot(sub(nodes[1], nodes[0]), obstacle.axis) < 0.0;
                limits = if falls { [limits[1], one] } else { [zero, limits[0]] };
            }
            let along = overlap.along(nodes);
            let Some(bounds) = along.positive_part(limits) else { continue };
            let nearest = match overlap.surface {
                Surface::Cylinder => {
                    nodes.map(|x| dot(sub(x, other[0]), obstacle.axis) / obstacle.length)
                }
                _ => [D::from(f64::from(is_last)); 2],
            };
            let sign = if is_subtracted { -1.0 } else { 1.0 };
            visit(TouchingPart { overlap, along, bounds, limits, sign, nearest });
        }
    }

    /// Whether the edges touch, with the nodes of both at these positions, m.
    pub fn touches(&self, [first, second]: [EdgeNodes<D>; 2]) -> bool {
        let mut touches = false;
        for (own, nodes) in [[first, second], [second, first]].into_iter().enumerate() {
            self.for_each_part(own, nodes, |_| touches = true);
        }
        touches
    }

    /// The energy, J, with the nodes of both edges at these positions, m.
    pub fn energy(&self, [first, second]: [EdgeNodes<D>; 2]) -> D {
        let mut energy = D::from(0.0);
        for (own, nodes) in [[first, second], [second, first]].into_iter().enumerate() {
            self.for_each_part(own, nodes, |part| {
                let [from, to] = part.bounds;
                let factor = self.stiffness * self.lengths[own] * (part.sign * (to - from) / 6.0);
                for [point, weight] in GAUSS {
                    let delta = part.along.at(from + (to - from) * point);
                    energy += delta * delta * delta * factor * weight;
                }
            });
        }
        energy
    }

    /// Adds gradient and, if requested, Hessian of the energy to `sums`. Returns whether the edges touch; without
    /// contact nothing is added.
    pub fn derive(
        &self,
        [first, second]: [EdgeNodes<D>; 2],
        with_hessian: bool,
        sums: &mut PairDerivatives<D>,
    ) -> bool {
        let mut touches = false;
        for (own, nodes) in [[first, second], [second, first]].into_iter().enumerate() {
            // Places of the nodes of this edge and of the other one in the sums.
            let place = if own == 0 { [0, 1, 2, 3] } else { [2, 3, 0, 1] };
            self.for_each_part(own, nodes, |part| {
                touches = true;
                let factor = self.stiffness * self.lengths[own] * (0.5 * part.sign);
                part.add(factor, nodes, place, with_hessian, sums);
            });
        }
        touches
    }
}

impl<D: Scalar> TouchingPart<D> {
    /// Adds `factor` times the integrals over this part of the edge of `delta^2` times gradient of the overlap, and of
    /// the derivative of that product. Node `i` of both edges (`nodes`: own, other) has the place `place[i]` in `sums`.
    fn add(
        &self,
        factor: D,
        [[a, b], [c, d]]: [EdgeNodes<D>; 2],
        place: [usize; 4],
        with_hessian: bool,
        sums: &mut PairDerivatives<D>,
    ) {
        let zero = D::from(0.0);
        let ([from, to], reach) = (self.bounds, self.overlap.reach);
        let edge = sub(d, c);
        let is_stationary = self.overlap.surface == Surface::Cylinder;
        let over_square = if is_stationary { dot(edge, edge).recip() } else { zero };
        let curvature_factor = -reach.recip();
        for [point, weight] in GAUSS {
            let t = from + (to - from) * point;
            let s = self.nearest[0] * (1.0 - t) + self.nearest[1] * t;
            let shares = [D::from(1.0 - t), D::from(t), s - 1.0, -s];
            let w: Vector<D> = components(|k| {
                a[k] * shares[0] + b[k] * shares[1] + c[k] * shares[2] + d[k] * shares[3]
            });
            let delta = self.along.at(t);
            let slope = factor * delta * (2.0 * weight * (to - from));
            let force = factor * delta * delta * (weight * (to - from));
            // The gradient of the overlap by node i is -c_i w/D.
            let across = force * curvature_factor;
            for i in 0..4 {
                let by = across * shares[i];
                (0..3).for_each(|k| sums.gradient[place[i]][k] += by * w[k]);
            }
            if !with_hessian {
                continue;
            }
            let steep = slope * curvature_factor * curvature_factor;
            let turned = [zero, zero, D::from(1.0), D::from(-1.0)];
            let moved: [Vector<D>; 4] =
                [0, 1, 2, 3].map(|i| components(|k| turned[i] * w[k] - shares[i] * edge[k]));
            for i in 0..4 {
                for j in 0..4 {
                    if place[j] > place[i] {
                        continue;
                    }
                    let product = shares[i] * shares[j];
                    let block = &mut sums.hessian[place[i]][place[j]];
                    for k in 0..3 {
                        for l in 0..3 {
                            let mut entry = steep * product * w[k] * w[l];
                            if k == l {
                                entry += across * product;
                            }
                            entry -= across * over_square * moved[i][k] * moved[j][l];
                            block[k][l] += entry;
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;

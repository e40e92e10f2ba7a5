//! Energy of the frictionless contact between an edge of a rod and a fixed obstacle, J.
//!
//! The rod is a tube of the radius `r` around its edges. At a point `x` of an edge the overlap with an obstacle of the
//! radius `R` around the point or axis through `c` is, with the distance `R + r = D` of touching,
//!
//! ```text
//! plane   delta = r - n.(x - c)          others   delta = (D^2 - |P (x - c)|^2)/(2 D)
//! ```
//!
//! where `P` is the identity (sphere) or the projection across the axis (cylinder). To first order this is the overlap
//! of the surfaces. The force per length along the normal is `k delta^2`, so that the energy of an edge of the rest
//! length `l` is `k l/3` times the integral of `delta^3` over the part of the edge where `delta > 0`. Along a straight
//! edge `delta` is a quadratic polynomial, and its gradient `g` a linear one. Closed forms (planes) and four Gauss
//! points integrate energy, gradient and Hessian exactly between the roots, and the energy depends on the shape of the
//! polygon, not on the place of its nodes. At the roots the integrands vanish: the bounds have no derivatives. A
//! capsule is a cylinder between two spheres, with bounds where the axial coordinate reaches its ends; there the second
//! derivative of `delta` jumps, its first one does not.
//!
//! Without an overlap energy and derivatives are zero.
//!
//! Input: obstacle, part of the edge and positions of its nodes (m) along the axes of the model, and the stiffness `k`
//! (N/m^3). Output: the energy, and for each surface of the obstacle gradient (N) and lower triangle of the Hessian
//! (N/m), derived by hand: with the share `w` of a node the integrals of `k l w delta^2 g` and `k l w w' (2 delta g
//! g' + delta^2 H)`, where `H` is the second derivative of the overlap. `derive` overwrites the derivatives of one
//! surface, and returns false, with nothing written, without contact.
//!
//! `EdgeContact` is the contact of a part of an edge, `ContactDerivatives` its gradient and Hessian by the unknowns of
//! the edge. `GAUSS` are points and weights on [0, 1].

use crate::energy::overlap::{EdgePart, Overlap, OverlapAlong, Surface};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::Vector;

/// Points and weights of Gauss and Legendre on the interval from 0 to 1, exact up to degree 7.
pub(super) const GAUSS: [[f64; 2]; 4] = [
    [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
    [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
    [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
    [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
];

/// Contact of a part of an edge with an obstacle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeContact<'a, D> {
    /// The edge and the obstacle.
    pub edge: EdgePart<'a, D>,
    /// Force per length over the square of the overlap, N/m^3.
    pub stiffness: D,
}

/// Gradient, N, and lower triangle of the Hessian, N/m, by `U` unknowns of an edge.
pub(crate) struct ContactDerivatives<D, const U: usize> {
    pub gradient: [D; U],
    pub hessian: [[D; U]; U],
}

impl<D: Scalar, const U: usize> ContactDerivatives<D, U> {
    /// Zeros as gradient, N, and Hessian, N/m.
    pub fn zero() -> Self {
        Self { gradient: [D::from(0.0); U], hessian: [[D::from(0.0); U]; U] }
    }
}

impl<D: Scalar> EdgeContact<'_, D> {
    /// The energy, J, with the nodes of the edge at these positions, m: the sum over all surfaces of the obstacle; zero
    /// without an overlap.
    #[inline]
    pub fn energy(&self, nodes: [Vector<D>; 2]) -> D {
        let mut energy = D::from(0.0);
        if self.edge.is_apart(nodes) {
            return energy;
        }
        for k in 0..self.edge.surfaces() {
            let (overlap, bounds) = self.edge.surface(k, nodes);
            let along = overlap.along(nodes);
            let Some([from, to]) = along.positive_part(bounds) else { continue };
            for [point, weight] in GAUSS {
                let delta = along.at(from + (to - from) * point);
                energy += delta * delta * delta * (weight * (to - from) / 3.0);
            }
        }
        energy * self.stiffness * self.edge.part.length
    }

    /// Overwrites `local` with the derivatives of the energy of surface number `k` by the `A` coordinates of both
    /// nodes. Those of the second node begin at the index `U - A` of the `U` unknowns of the edge; entries between them
    /// (the angle in space) stay. The Hessian is left out unless it is requested. False without contact, when nothing
    /// is written.
    #[inline(always)]
    pub fn derive<const A: usize, const U: usize>(
        &self,
        k: usize,
        nodes: [Vector<D>; 2],
        with_hessian: bool,
        local: &mut ContactDerivatives<D, U>,
    ) -> bool {
        let (overlap, bounds) = self.edge.surface(k, nodes);
        let along = overlap.along(nodes);
        let Some(part) = along.positive_part(bounds) else { return false };
        match overlap.surface {
            Surface::Plane => self.derive_plane::<A, U>(&along, part, with_hessian, local),
            _ => self.derive_round::<A, U>(&overlap, &along, part, with_hessian, local),
        }
        true
    }

    /// [`derive`](Self::derive) for a plane, whose overlap is linear along the part of the edge between the fractions
    /// `from` and `to`, and has a constant gradient: integrals of products of linear functions in closed form.
    #[inline(always)]
    fn derive_plane<const A: usize, const U: usize>(
        &self,
        along: &OverlapAlong<D>,
        [from, to]: [f64; 2],
        with_hessian: bool,
        local: &mut ContactDerivatives<D, U>,
    ) {
        let (first, last, g) = (along.at(from), along.at(to), &along.slopes[0]);
        let factor = self.stiffness * self.edge.part.length * ((to - from) / 12.0);
        let (both, squares) = (first * last * 2.0, [first * first, last * last]);
        let forces = [
            factor * (squares[0] * 3.0 + both + squares[1]),
            factor * (squares[0] + both + squares[1] * 3.0),
        ];
        // Shares of both nodes at the ends of the part.
        let shares = [[1.0 - from, 1.0 - to], [from, to]];
        for i in 0..2 {
            let force = forces[0] * shares[i][0] + forces[1] * shares[i][1];
            for k in 0..A {
                local.gradient[(U - A) * i + k] = force * g[k];
            }
        }
        if !with_hessian {
            return;
        }
        let slope = factor * 2.0;
        let sum = slope * (first + last);
        let [start, end] = [sum + slope * first * 2.0, sum + slope * last * 2.0];
        for i in 0..2 {
            for j in 0..=i {
                let ([a, b], [c, d]) = (shares[i], shares[j]);
                let stiffness = start * (a * c) + sum * (a * d + b * c) + end * (b * d);
                for k in 0..A {
                    for l in 0..=if i == j { k } else { A - 1 } {
                        local.hessian[(U - A) * i + k][(U - A) * j + l] = stiffness * g[k] * g[l];
                    }
                }
            }
        }
    }

    /// [`derive`](Self::derive) for a sphere or cylinder, by Gauss quadrature over the part of the edge between the
    /// fractions `from` and `to`.
    fn derive_round<const A: usize, const U: usize>(
        &self,
        overlap: &Overlap<D>,
        along: &OverlapAlong<D>,
        [from, to]: [f64; 2],
        with_hessian: bool,
        local: &mut ContactDerivatives<D, U>,
    ) {
        // Integrals of k l delta^2 and 2 k l delta times products of the shares of the nodes, by the powers of the
        // second one.
        let (mut force, mut slope) = ([D::from(0.0); 3], [D::from(0.0); 5]);
        let stiffness = self.stiffness * self.edge.part.length * (to - from);
        for [point, weight] in GAUSS {
            let t = from + (to - from) * point;
            let (delta, shares) = (along.at(t), [(1.0 - t) * (1.0 - t), (1.0 - t) * t, t * t]);
            let factor = stiffness * delta * weight;
            let squared = factor * delta;
            for p in 0..3 {
                force[p] += squared * shares[p];
                slope[2 * p] += factor * (2.0 * shares[p] * shares[p]);
            }
            slope[1] += factor * (2.0 * shares[0] * shares[1]);
            slope[3] += factor * (2.0 * shares[1] * shares[2]);
        }
        let [start, end] = along.slopes;
        for i in 0..2 {
            for k in 0..A {
                local.gradient[(U - A) * i + k] = force[i] * start[k] + force[i + 1] * end[k];
            }
        }
        if !with_hessian {
            return;
        }
        for i in 0..2 {
            for j in 0..=i {
                let p = i + j;
                for k in 0..A {
                    for l in 0..=if i == j { k } else { A - 1 } {
                        local.hessian[(U - A) * i + k][(U - A) * j + l] =
                            slope[p] * start[k] * start[l]
                                + slope[p + 1] * (start[k] * end[l] + end[k] * start[l])
                                + slope[p + 2] * end[k] * end[l]
                                + force[p] * second(overlap, k, l);
                    }
                }
            }
        }
    }
}

/// Second derivative of the overlap with a round surface by the coordinates `k` and `l` of a point, 1/m.
#[inline]
fn second<D: Scalar>(overlap: &Overlap<D>, k: usize, l: usize) -> D {
    let same = D::from(if k == l { 1.0 } else { 0.0 });
    let across = match overlap.surface {
        Surface::Cylinder => same - overlap.axis[k] * overlap.axis[l],
        Surface::Plane | Surface::Sphere => same,
    };
    -(across / overlap.reach)
}

#[cfg(test)]
mod tests;

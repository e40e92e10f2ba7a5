//! Energy of the frictionless contact between an edge of a rod and a fixed obstacle, J.
//!
//! The rod is a tube of the radius `r` around its edges. At a point `x` of an edge the overlap with an obstacle of the radius
//! `R` around the point or axis through `c` is, with the distance `R + r = D` of touching,
//!
//! ```text
//! plane   delta = r - n.(x - c)          others   delta = (D^2 - |P (x - c)|^2)/(2 D)
//! ```
//!
//! where `P` is the identity (sphere) or the projection across the axis (cylinder). To first order this is the overlap of the
//! surfaces. The force per length along the normal is `k delta^2`, so that the energy of an edge of the rest length `l` is
//! `k l/3` times the integral of `delta^3` over the part of the edge where `delta > 0`. Along a straight edge `delta` is a
//! quadratic polynomial. Four Gauss points between its roots integrate energy, gradient and Hessian exactly, and the energy
//! depends on the shape of the polygon, not on the place of its nodes. At the roots the integrands vanish: the bounds have no
//! derivatives. A capsule is a cylinder between two spheres, with bounds where the axial coordinate reaches its ends; there
//! the second derivative of `delta` jumps, its first one does not.
//!
//! Input: the unknowns of an edge, the values `[k, R, c, axis, length]`, and the numbers of a [`ContactPart`]. Output by
//! [`Over`]: energy, gradient and lower triangle of the Hessian, derived by hand, or by dual numbers from the energy.

use crate::energy::Derivatives;
use crate::energy::adapter::{AnyEnergy, MOST, Over, OwnLocal, Site};
use crate::energy::by_unknowns::{self, Function};
use crate::energy::overlap::{EdgePart, Surface};
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::{Vector, components, dot, map_components};
use crate::scene::contact::{Obstacle, ObstacleKind};
use crate::scene::number::Quantity;

/// Points and weights of Gauss and Legendre on the interval from 0 to 1, exact up to degree 7.
const GAUSS: [[f64; 2]; 4] = [
    [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
    [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
    [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
    [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
];

/// Contact of edges with an obstacle of a kind.
pub(crate) struct EdgeContact(pub ObstacleKind);

/// Values of the parameters of a contact of the `stiffness`, N/m^3, with an obstacle.
pub(crate) fn contact_values<D: Scalar>(stiffness: D, obstacle: &Obstacle<D>) -> Vec<D> {
    let Obstacle { radius, point, axis, length, .. } = *obstacle;
    [stiffness, radius].into_iter().chain(point).chain(axis).chain([length]).collect()
}

/// The positions of both nodes of an edge with the unknowns `q`, m; `over` converts the numbers of the site.
#[inline]
fn edge_nodes<B: Scalar, D: Scalar>(
    site: &Site<B>,
    over: impl Fn(B) -> D,
    q: &[D],
) -> [Vector<D>; 2] {
    let ([a], _) = site.chart.world::<D, 1>(&over, q, &[]);
    let ([b], _) = site.chart.world::<D, 1>(&over, &q[site.chart.stride()..], &[]);
    [a, b]
}

/// A vector without its derivatives.
#[inline]
fn values<D: Scalar>(v: Vector<D>) -> Vector<f64> {
    [v[0].value(), v[1].value(), v[2].value()]
}

impl EdgeContact {
    /// The energy, J, at the unknowns `q` of an edge; `over` converts the numbers of the site.
    #[inline]
    fn value<B: Scalar, D: Scalar>(
        &self,
        site: &Site<B>,
        over: impl Fn(B) -> D + Copy,
        q: &[D],
    ) -> D {
        let edge = EdgePart::new(self.0, site, over);
        let [a, b] = edge_nodes(site, over, q);
        let plain = [values(a), values(b)];
        let mut energy = D::from(0.0);
        for (overlap, bounds) in edge.surfaces(plain) {
            let Some([from, to]) = overlap.plain().positive(plain, bounds) else { continue };
            for [point, weight] in GAUSS {
                let t = from + (to - from) * point;
                let x = components(|c| a[c] * (1.0 - t) + b[c] * t);
                let (delta, _) = overlap.at(x);
                energy += delta * delta * delta * (weight * (to - from) / 3.0);
            }
        }
        energy * edge.stiffness * edge.length
    }

    /// Overwrites the gradient by the unknowns `q` and, if there is one, the lower triangle of the Hessian: with the weight
    /// `w` of a node, the integrals of `k l w delta^2 g` and `k l w w' (2 delta g g' + delta^2 H)`. `g` and `H` are first and
    /// second derivatives of the overlap.
    #[inline]
    fn derive<D: Scalar>(
        &self,
        site: &Site<D>,
        q: &[D],
        gradient: &mut [D; MOST],
        mut hessian: Option<&mut [[D; MOST]; MOST]>,
    ) {
        gradient[..q.len()].fill(D::from(0.0));
        if let Some(hessian) = &mut hessian {
            hessian[..q.len()].iter_mut().for_each(|row| row[..q.len()].fill(D::from(0.0)));
        }
        let edge = EdgePart::new(self.0, site, |x| x);
        let [a, b] = edge_nodes(site, |x| x, q);
        let plain = [values(a), values(b)];
        let stride = site.chart.stride();
        let axes = stride.min(3);
        for (overlap, bounds) in edge.surfaces(plain) {
            let Some([from, to]) = overlap.plain().positive(plain, bounds) else { continue };
            // The axis of the obstacle along the axes of the model.
            let mut axis = [D::from(0.0); 3];
            for k in 0..axes {
                axis[k] = dot(map_components(&site.chart.axis(k), D::from), overlap.axis);
            }
            let round = overlap.reach.recip();
            for [point, weight] in GAUSS {
                let t = from + (to - from) * point;
                let x = components(|c| a[c] * (1.0 - t) + b[c] * t);
                let (delta, slope) = overlap.at(x);
                let factor = edge.stiffness * edge.length * (weight * (to - from));
                let mut g = [D::from(0.0); 3];
                for k in 0..axes {
                    g[k] = dot(map_components(&site.chart.axis(k), D::from), slope);
                }
                let (force, shares) = (factor * delta * delta, [1.0 - t, t]);
                for i in 0..2 {
                    for k in 0..axes {
                        gradient[stride * i + k] += force * g[k] * shares[i];
                    }
                }
                let Some(hessian) = &mut hessian else { continue };
                for k in 0..axes {
                    for l in 0..axes {
                        let same = if k == l { 1.0 } else { 0.0 };
                        let second = match overlap.surface {
                            Surface::Plane => D::from(0.0),
                            Surface::Sphere => -(round * same),
                            Surface::Cylinder => (axis[k] * axis[l] - same) * round,
                        };
                        let entry = factor * delta * g[k] * g[l] * 2.0 + force * second;
                        for i in 0..2 {
                            for j in 0..=i {
                                let (row, column) = (stride * i + k, stride * j + l);
                                if column <= row {
                                    hessian[row][column] += entry * (shares[i] * shares[j]);
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The energy as a function of the unknowns, for dual numbers.
struct EnergyAtSite<'a, B> {
    contact: &'a EdgeContact,
    site: &'a Site<'a, B>,
}

impl<B: Scalar> Function<B> for EnergyAtSite<'_, B> {
    /// The energy, J, at the unknowns `q`.
    #[inline]
    fn at<D: Scalar>(&self, over: impl Fn(B) -> D + Copy, q: &[D]) -> D {
        self.contact.value(self.site, over, q)
    }
}

/// Number of unknowns of an edge in a plane.
const IN_PLANE: usize = 4;
/// Number of unknowns of an edge in space.
const IN_SPACE: usize = 7;

/// Overwrites the first entries of `local` by the derivatives of the energy by `Q` unknowns, in dual numbers.
fn derive_by_dual_numbers<D: Nestable, const Q: usize>(
    energy: &EnergyAtSite<D>,
    q: &[D],
    local: &mut OwnLocal<D>,
) {
    let q: &[D; Q] = q.first_chunk().expect("as many unknowns as an edge has");
    let (gradient, hessian) = by_unknowns::hessian(energy, q);
    local.0[..Q].copy_from_slice(&gradient);
    for (to, row) in local.1.iter_mut().zip(&hessian) {
        to[..Q].copy_from_slice(row);
    }
}

impl<D: Nestable> Over<D> for EdgeContact {
    /// The energy, J, at the unknowns `q`; the weight of the site is not used.
    fn energy(&self, site: &Site<D>, q: &[D]) -> D {
        self.value(site, |x| x, q)
    }

    /// Writes the gradient by the unknowns, N, to the first entries of `gradient`: by hand, or by dual numbers.
    fn gradient(&self, site: &Site<D>, q: &[D], by: Derivatives, gradient: &mut [D; MOST]) {
        match by {
            Derivatives::Hand => self.derive(site, q, gradient, None),
            Derivatives::Dual => {
                let mut local = (*gradient, [[D::from(0.0); MOST]; MOST]);
                self.tangent(site, q, by, &mut local);
                *gradient = local.0;
            }
        }
    }

    /// Writes gradient and lower triangle of the Hessian by the unknowns: by hand, or by dual numbers.
    fn tangent(&self, site: &Site<D>, q: &[D], by: Derivatives, local: &mut OwnLocal<D>) {
        let energy = EnergyAtSite { contact: self, site };
        match by {
            Derivatives::Hand => self.derive(site, q, &mut local.0, Some(&mut local.1)),
            Derivatives::Dual if q.len() == IN_PLANE => {
                derive_by_dual_numbers::<D, IN_PLANE>(&energy, q, local);
            }
            Derivatives::Dual => derive_by_dual_numbers::<D, IN_SPACE>(&energy, q, local),
        }
    }
}

impl AnyEnergy for EdgeContact {
    /// Two: the element is an edge.
    fn nodes(&self) -> usize {
        2
    }

    /// The stiffness; other values of the site are those of the obstacle.
    fn parameters(&self) -> &'static [(&'static str, Quantity)] {
        const { &[("stiffness", Quantity::positive("N/m^3"))] }
    }

    /// True; the model is chosen by the directions of the obstacles.
    fn keeps_plane(&self, _: &[f64], _: [f64; 3], _: [f64; 3]) -> bool {
        true
    }

    /// Sizes of gradient and Hessian at an overlap of the distance of touching, which errors are relative to: the overlap is a
    /// difference of lengths of that size. Entries of angles are zero.
    fn terms(&self, site: &Site<f64>, q: &[f64]) -> OwnLocal<f64> {
        let edge = EdgePart::new(self.0, site, |x| x);
        let reach = edge.overlap.reach;
        let slope = edge.stiffness * edge.length * reach;
        let mut local = ([0.0; MOST], [[0.0; MOST]; MOST]);
        let is_place = |i: usize| i % site.chart.stride() < 3;
        for r in (0..q.len()).filter(|r| is_place(*r)) {
            local.0[r] = slope * reach;
            for c in (0..q.len()).filter(|c| is_place(*c)) {
                local.1[r][c] = 2.0 * slope;
            }
        }
        local
    }
}

#[cfg(test)]
mod tests;

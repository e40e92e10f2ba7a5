//! Element for stretching of one edge by a law that is nonlinear in the strain, in the plane or in space.
//!
//! It is the linear element [`Stretch`] plus a [`NonlinearPart`] of the axial force, N. Both depend on the strain `eps
//! = |e|/l - 1` of the edge vector `e`, m, with the rest length `l`, m. Input: the coordinates of both nodes, m.
//! Energy, J, gradient, N, and Hessian, N/m, are those of an axial force that depends on the length only; without the
//! part they are those of [`Stretch`]. The dynamics evaluate both terms apart, so that rods with a linear law have no
//! cost: [`nonlinear_gradient`] and [`nonlinear_derivatives`] return the derivatives of the part alone by the edge
//! vector. `geometric_stiffness_change` is the change of the Hessian where a given tension replaces the force. Checks
//! and num-dual take this element.

use crate::energy::law::NonlinearPart;
use crate::energy::stretch::{
    Stretch, along, axial_hessian, axial_tangent, edge, squared, to_nodes,
};
use crate::energy::{Element, Local};
use crate::numerics::scalar::Scalar;

/// One edge of `M` components. Unknowns, m: `[x0, y0, x1, y1]` in the plane, `[x0, y0, z0, x1, y1, z1]` in space.
#[derive(Clone, Copy, Debug)]
pub struct HyperelasticStretch<D, const M: usize> {
    /// The linear law.
    pub linear: Stretch<D, M>,
    /// The force beyond the linear law; `None` without one.
    pub nonlinear: Option<NonlinearPart<D>>,
}

impl<D: Scalar, const M: usize> HyperelasticStretch<D, M> {
    /// The energy, J, at the squared length, m^2, and the length, m.
    fn energy_at(&self, squared: D, length: D) -> D {
        let linear = self.linear.energy_at(squared, length);
        match self.nonlinear {
            None => linear,
            Some(part) => {
                let strain = self.linear.strain_of(squared, length);
                linear + part.energy(strain) * self.linear.rest_length
            }
        }
    }

    /// The axial force, N, and its derivative by the length, N/m, at the squared length, m^2, and the length, m.
    fn tension(&self, squared: D, length: D) -> [D; 2] {
        let [force, stiffness] = self.linear.tension(squared, length);
        match self.nonlinear {
            None => [force, stiffness],
            Some(part) => {
                let [slope, beyond] = part.response(self.linear.strain_of(squared, length));
                [force + beyond, stiffness + slope / self.linear.rest_length]
            }
        }
    }

    /// The change of the Hessian by the edge vector `e`, m, where `tension`, N, replaces the axial force `F` in the
    /// geometric stiffness: `(T - F)/|e| (I - t t')`.
    pub(crate) fn geometric_stiffness_change(&self, e: &[D; M], tension: D) -> [[D; M]; M] {
        let squared = squared(e);
        let length = squared.sqrt();
        let [force, _] = self.tension(squared, length);
        axial_hessian(e, length, [tension - force, tension.like(0.0)])
    }
}

/// The derivative by the edge vector `e`, m, of the energy beyond the linear law: the force of the `part`, N, as a
/// vector along `e`. The `linear` element gives the strain.
pub(crate) fn nonlinear_gradient<D: Scalar, const M: usize>(
    part: &NonlinearPart<D>,
    linear: &Stretch<D, M>,
    e: &[D; M],
) -> [D; M] {
    let squared = squared(e);
    let length = squared.sqrt();
    along(e, length, part.response(linear.strain_of(squared, length))[1])
}

/// Gradient, N, and Hessian, N/m, of the part beyond the linear law by the edge vector `e`, m. With `under_tension` the
/// force has no part in the geometric stiffness, because a given tension replaces it there.
pub(crate) fn nonlinear_derivatives<D: Scalar, const M: usize>(
    part: &NonlinearPart<D>,
    linear: &Stretch<D, M>,
    e: &[D; M],
    under_tension: bool,
) -> ([D; M], [[D; M]; M]) {
    let squared = squared(e);
    let length = squared.sqrt();
    let [slope, force] = part.response(linear.strain_of(squared, length));
    let geometric = if under_tension { force.like(0.0) } else { force };
    let hessian = axial_hessian(e, length, [geometric, slope / linear.rest_length]);
    (along(e, length, force), hessian)
}

/// The element in the plane and in space: the same formulas on edges of two and three components.
macro_rules! element {
    ($n:literal, $m:literal) => {
        impl<D: Scalar> Element<D, $n> for HyperelasticStretch<D, $m> {
            const NAME: &'static str = "stretch";
            type Over<E: Scalar> = HyperelasticStretch<E, $m>;

            /// The element with every parameter converted to another number type.
            fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> HyperelasticStretch<E, $m> {
                HyperelasticStretch {
                    linear: self.linear.map(&convert),
                    nonlinear: self.nonlinear.as_ref().map(|part| part.map(&convert)),
                }
            }
            /// The energy, J, at the coordinates `q` of both nodes, m.
            fn energy(&self, q: &[D; $n]) -> D {
                let squared = squared::<D, $m>(&edge(q));
                self.energy_at(squared, squared.sqrt())
            }
            /// dE/dq at the coordinates `q` of both nodes, derived by hand, N.
            fn gradient(&self, q: &[D; $n]) -> [D; $n] {
                let e: [D; $m] = edge(q);
                let squared = squared(&e);
                let length = squared.sqrt();
                to_nodes(along(&e, length, self.tension(squared, length)[0]))
            }
            /// E, J, dE/dq, N, and the full matrix d2E/dq2, N/m, at the coordinates `q` of both nodes, derived by hand.
            fn tangent(&self, q: &[D; $n]) -> Local<D, $n> {
                let e: [D; $m] = edge(q);
                let squared = squared(&e);
                let length = squared.sqrt();
                axial_tangent(
                    &e,
                    length,
                    self.energy_at(squared, length),
                    self.tension(squared, length),
                )
            }
        }
    };
}

element!(4, 2);
element!(6, 3);

//! Element for a dead load, which keeps its direction and size (weight or a point force on a node): `E = -f.x`, J.
//!
//! Input: the force `f`, N, and the `M` coordinates of one node, m, 2 in a plane or 3 in space. Its gradient is
//! `-f`, N, and its Hessian zero. The potential is measured from the origin of the coordinates.

use crate::energy::{Element, Local};
use crate::numerics::scalar::Scalar;

/// A constant force on one node: `E = -f.x`. Unknowns: its `M` coordinates, m.
#[derive(Clone, Copy, Debug)]
pub struct DeadLoad<D, const M: usize> {
    /// Force, N.
    pub force: [D; M],
}

impl<D: Scalar, const M: usize> Element<D, M> for DeadLoad<D, M> {
    const NAME: &'static str = "dead load";
    type Over<E: Scalar> = DeadLoad<E, M>;

    /// The element with every parameter converted to another number type.
    fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> DeadLoad<E, M> {
        DeadLoad { force: self.force.map(convert) }
    }
    /// The energy `-f.x`, J, at the coordinates `q`, m.
    #[inline]
    fn energy(&self, q: &[D; M]) -> D {
        let mut energy = -(self.force[0] * q[0]);
        for i in 1..M {
            energy -= self.force[i] * q[i];
        }
        energy
    }
    /// dE/dq, the negative force `-f`, N, at any coordinates.
    #[inline]
    fn gradient(&self, _: &[D; M]) -> [D; M] {
        self.force.map(|f| -f)
    }
    /// Energy `-f.x`, J, gradient `-f`, N, and a Hessian of zeros at the coordinates `q`, m.
    #[inline]
    fn tangent(&self, q: &[D; M]) -> Local<D, M> {
        Local {
            energy: self.energy(q),
            gradient: self.gradient(q),
            hessian: [[D::from(0.0); M]; M],
        }
    }
}

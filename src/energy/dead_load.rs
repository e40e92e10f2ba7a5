//! Dead loads: weight and point forces, which keep their direction and size.

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

    /// Converts every parameter.
    fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> DeadLoad<E, M> {
        DeadLoad { force: self.force.map(convert) }
    }
    /// The energy, J: the definition of the element.
    #[inline]
    fn energy(&self, q: &[D; M]) -> D {
        let mut energy = -(self.force[0] * q[0]);
        for i in 1..M {
            energy -= self.force[i] * q[i];
        }
        energy
    }
    /// dE/dq, derived by hand.
    #[inline]
    fn gradient(&self, _: &[D; M]) -> [D; M] {
        self.force.map(|f| -f)
    }
    /// E, dE/dq and d2E/dq2, derived by hand, in one pass.
    #[inline]
    fn tangent(&self, q: &[D; M]) -> Local<D, M> {
        Local {
            energy: self.energy(q),
            gradient: self.gradient(q),
            hessian: [[D::from(0.0); M]; M],
        }
    }
}

//! Dead loads: weight and point forces, which keep their direction and size.

use super::{Element, Local};
use crate::scalar::Scalar;
use num_dual::Dual64;

/// A constant force on one node of the plane: `E = -f.x`. Unknowns: `[x, y]`, m.
#[derive(Clone, Copy, Debug)]
pub struct DeadLoad<D> {
    /// Force, N.
    pub force: [D; 2],
}

impl<D: Scalar> Element<D, 2> for DeadLoad<D> {
    const NAME: &'static str = "dead load";
    type Over<E: Scalar> = DeadLoad<E>;

    fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> DeadLoad<E> {
        DeadLoad { force: self.force.map(convert) }
    }
    #[inline]
    fn energy(&self, q: &[D; 2]) -> D {
        -(self.force[0] * q[0] + self.force[1] * q[1])
    }
    #[inline]
    fn gradient(&self, _: &[D; 2]) -> [D; 2] {
        [-self.force[0], -self.force[1]]
    }
    #[inline]
    fn tangent(&self, q: &[D; 2]) -> Local<D, 2> {
        Local {
            energy: self.energy(q),
            gradient: self.gradient(q),
            hessian: [[D::from(0.0); 2]; 2],
        }
    }
    #[inline]
    fn gradient_rate(element: &DeadLoad<Dual64>, _: &[f64; 2]) -> [f64; 2] {
        element.force.map(|f| -f.eps)
    }
}

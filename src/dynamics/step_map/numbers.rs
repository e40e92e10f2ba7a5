//! The numbers of damping and of the scheme in the equations of a step, as one list.

use crate::numerics::scalar::Scalar;
use crate::scene::{Damping, Maxwell};
use num_dual::Dual64;

/// How many numbers there are.
pub const COUNT: usize = 8;
/// Place of the mass damping in the list.
pub const MASS: usize = 0;
/// Place of the relaxation time of a Maxwell branch in the list.
pub const RELAXATION: usize = 6;
/// Place of the scheme's parameter in the list.
pub const SCHEME: usize = 7;

/// The numbers of damping, zero for those of an absent Maxwell branch, and the scheme's parameter.
pub fn list<D: Scalar>(damping: &Damping<D>, parameter: D) -> [D; COUNT] {
    let Damping { mass, stiffness, stretching, bending, twisting, maxwell, .. } = *damping;
    let zero = D::from(0.0);
    let maxwell = maxwell.unwrap_or(Maxwell { stiffness: zero, time: zero });
    let Maxwell { stiffness: branch, time } = maxwell;
    [mass, stiffness, stretching, bending, twisting, branch, time, parameter]
}

/// Damping and the scheme's parameter with the derivative along the number at `place` of the list; along none for a
/// place beyond it.
pub fn along(damping: &Damping<f64>, parameter: f64, place: usize) -> (Damping<Dual64>, Dual64) {
    let dual = |k: usize, x: f64| Dual64::new(x, f64::from(u8::from(k == place)));
    let maxwell = damping.maxwell.map(|Maxwell { stiffness, time }| Maxwell {
        stiffness: dual(5, stiffness),
        time: dual(RELAXATION, time),
    });
    let damping = Damping {
        mass: dual(MASS, damping.mass),
        stiffness: dual(1, damping.stiffness),
        stretching: dual(2, damping.stretching),
        bending: dual(3, damping.bending),
        twisting: dual(4, damping.twisting),
        maxwell,
        friction: None,
    };
    (damping, dual(SCHEME, parameter))
}

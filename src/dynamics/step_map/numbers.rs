//! The scalar numbers of damping and of the time integration scheme in the equations of a step, as one list of
//! [`COUNT`] entries.
//!
//! Order: mass damping (1/s); Kelvin-Voigt times of all strains, stretching, bending and twisting (s); stiffness
//! fraction and relaxation time (s) of the Maxwell branch; parameter of the scheme. [`list`] makes it from the damping,
//! over any scalar, with zeros for an absent Maxwell branch. [`along`] returns damping and parameter as dual numbers,
//! with derivative 1 of one entry and 0 of all others; an index of [`COUNT`] or more gives no derivatives. Internal
//! friction is no part of it. The step map loops over the list for derivatives by each number.

use crate::numerics::scalar::Scalar;
use crate::scene::{Damping, Maxwell};
use num_dual::Dual64;

/// The number of entries of the list.
pub const COUNT: usize = 8;
/// Index of the mass damping, 1/s, in the list.
pub const MASS: usize = 0;
/// Index of the relaxation time of the Maxwell branch, s, in the list.
pub const RELAXATION: usize = 6;
/// Index of the scheme's parameter in the list.
pub const SCHEME: usize = 7;

/// The list from the damping and the scheme's parameter; zeros for an absent Maxwell branch.
pub fn list<D: Scalar>(damping: &Damping<D>, parameter: D) -> [D; COUNT] {
    let Damping { mass, stiffness, stretching, bending, twisting, maxwell, .. } = *damping;
    let zero = D::from(0.0);
    let maxwell = maxwell.unwrap_or(Maxwell { stiffness: zero, time: zero });
    let Maxwell { stiffness: branch, time } = maxwell;
    [mass, stiffness, stretching, bending, twisting, branch, time, parameter]
}

/// Damping and the scheme's parameter as dual numbers, with derivative 1 of the entry `place` of the list and 0 of all
/// others. `place >= COUNT`: no derivatives. Internal friction is left out.
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

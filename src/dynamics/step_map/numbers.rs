//! The scalar numbers of damping and of the time integration scheme in the equations of a step.
//!
//! [`StepNumbers`] has one entry for each: mass damping (1/s); Kelvin-Voigt times of all strains, stretching, bending
//! and twisting (s); stiffness fraction and relaxation time (s) of every Maxwell branch; parameter of the scheme. The
//! entries are derivatives along parameters, one SIMD lane each, or derivatives of a misfit by these numbers. `product`
//! is the derivative of a misfit along one parameter through them. [`along`] returns Kelvin-Voigt times and scheme as
//! dual numbers, with derivative 1 of one of them. Internal friction is no part.

use crate::numerics::directions::Directions;
use crate::numerics::vector::components;
use crate::scene::{Damping, Maxwell, MaxwellBranches};
use num_dual::Dual64;

/// The number of Kelvin-Voigt times.
const TIMES: usize = 4;
/// Place of the scheme's parameter for [`along`]; the Kelvin-Voigt times have the places before it.
pub const SCHEME: usize = TIMES;
/// A place of no number: [`along`] returns no derivatives.
pub const NONE: usize = SCHEME + 1;

/// One entry for each number of damping and scheme.
#[derive(Clone, Debug)]
pub struct StepNumbers<T> {
    /// Mass damping.
    pub mass: T,
    /// Kelvin-Voigt times of all strains, stretching, bending and twisting.
    pub times: [T; TIMES],
    /// Stiffness fraction and relaxation time of every Maxwell branch.
    pub branches: Vec<Maxwell<T>>,
    /// The parameter of the scheme.
    pub scheme: T,
}

impl StepNumbers<f64> {
    /// Zeros for all numbers, with the given number of Maxwell `branches`.
    pub fn zeros(branches: usize) -> Self {
        let branches = vec![Maxwell { stiffness: 0.0, time: 0.0 }; branches];
        Self { mass: 0.0, times: [0.0; TIMES], branches, scheme: 0.0 }
    }

    /// The derivative of a misfit along one parameter through these numbers. It is the sum over all numbers of the
    /// derivative of the misfit (`self`) times the derivative of the number by the parameter (`along`).
    pub fn product(&self, along: &StepNumbers<Directions<1>>) -> f64 {
        let mut sum = self.mass * along.mass.0[0];
        for (by, rate) in self.times.iter().zip(&along.times) {
            sum += by * rate.0[0];
        }
        for (by, rate) in self.branches.iter().zip(&along.branches) {
            sum += by.stiffness * rate.stiffness.0[0];
            sum += by.time * rate.time.0[0];
        }
        sum + self.scheme * along.scheme.0[0]
    }
}

impl<const G: usize> StepNumbers<Directions<G>> {
    /// The derivatives that `damping` and the schemes' `parameters` contain, one lane each. All have equally many
    /// Maxwell branches.
    pub fn new(damping: [&Damping<Dual64>; G], parameters: [Dual64; G]) -> Self {
        let lanes = |of: &dyn Fn(&Damping<Dual64>) -> Dual64| {
            Directions(components(|g| of(damping[g]).eps))
        };
        let branches = damping.iter().map(|damping| damping.maxwell.as_slice().len()).min();
        let branch = |k: usize| Maxwell {
            stiffness: lanes(&|damping| damping.maxwell.as_slice()[k].stiffness),
            time: lanes(&|damping| damping.maxwell.as_slice()[k].time),
        };
        Self {
            mass: lanes(&|damping| damping.mass),
            times: [
                lanes(&|damping| damping.stiffness),
                lanes(&|damping| damping.stretching),
                lanes(&|damping| damping.bending),
                lanes(&|damping| damping.twisting),
            ],
            branches: (0..branches.unwrap_or(0)).map(branch).collect(),
            scheme: Directions(components(|g| parameters[g].eps)),
        }
    }
}

/// Damping and the scheme's parameter as dual numbers, with derivative 1 of the Kelvin-Voigt time or the parameter at
/// `place`; [`NONE`]: no derivatives. Maxwell branches and internal friction are left out.
pub fn along(damping: &Damping<f64>, parameter: f64, place: usize) -> (Damping<Dual64>, Dual64) {
    let dual = |k: usize, x: f64| Dual64::new(x, f64::from(u8::from(k == place)));
    let times = Damping {
        mass: damping.mass.into(),
        stiffness: dual(0, damping.stiffness),
        stretching: dual(1, damping.stretching),
        bending: dual(2, damping.bending),
        twisting: dual(3, damping.twisting),
        maxwell: MaxwellBranches::default(),
        power_law: None,
        friction: None,
    };
    (times, dual(SCHEME, parameter))
}

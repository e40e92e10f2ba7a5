//! The numbers of a step, as going back over it needs them.

use crate::dynamics::coefficients::StepCoefficients;
use num_dual::Dual64;

/// The numbers of a step, and their derivatives by the scheme's.
pub struct Numbers {
    pub dual: StepCoefficients<Dual64>,
    pub coefficients: StepCoefficients<f64>,
    pub slopes: StepCoefficients<f64>,
}

/// The derivatives of what is linear in the change of an unknown, its velocity at the start and its acceleration there.
pub fn by_each(of: impl Fn(f64, f64, f64) -> f64) -> [f64; 3] {
    [of(1.0, 0.0, 0.0), of(0.0, 1.0, 0.0), of(0.0, 0.0, 1.0)]
}

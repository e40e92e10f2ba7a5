//! Wrapper [`Scaled`]: an energy as a function of its unknowns divided by given units, for the check of derivatives.
//!
//! Input: an energy and a unit for each unknown, such as an edge length for positions and 1 rad for angles. In these
//! units finite differences by all unknowns have comparable steps. The energy, J, is that at `x_i units_i`. Its
//! gradient is multiplied by the unit of each unknown, its Hessian by the units of both (chain rule); both are then in
//! J. [`Scaled::scaled`] divides unknowns by their units.

use crate::energy::{Analytic, Energy};
use crate::numerics::scalar::Scalar;

/// Energy as a function of `q / units`, so that finite differences by lengths and angles have comparable steps.
#[derive(Clone, Copy, Debug)]
pub struct Scaled<E, const N: usize> {
    /// The energy.
    pub energy: E,
    /// The unit of each unknown.
    pub units: [f64; N],
}

impl<E, const N: usize> Scaled<E, N> {
    /// The unknowns `q` divided by their units.
    pub fn scaled(&self, q: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|i| q[i] / self.units[i])
    }

    /// The unknowns `x` (in units) multiplied by their units.
    fn unscaled(&self, x: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|i| x[i] * self.units[i])
    }
}

impl<E: Energy<N>, const N: usize> Energy<N> for Scaled<E, N> {
    /// The energy, J, at the scaled unknowns `x`, in their units.
    fn energy<D: Scalar>(&self, x: &[D; N]) -> D {
        self.energy.energy(&std::array::from_fn(|i| x[i] * self.units[i]))
    }
}

impl<E: Analytic<N>, const N: usize> Analytic<N> for Scaled<E, N> {
    /// The gradient, J, by the scaled unknowns `x`: that of the energy times the unit of each unknown.
    fn gradient(&self, x: &[f64; N]) -> [f64; N] {
        let gradient = self.energy.gradient(&self.unscaled(x));
        std::array::from_fn(|i| gradient[i] * self.units[i])
    }
    /// The full Hessian, J, by the scaled unknowns `x`: that of the energy times the units of both unknowns.
    fn hessian(&self, x: &[f64; N]) -> [[f64; N]; N] {
        let hessian = self.energy.hessian(&self.unscaled(x));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| hessian[i][j] * self.units[i] * self.units[j])
        })
    }
}

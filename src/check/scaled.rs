//! Energies as functions of unknowns in given units.

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
    /// The unknowns in their units.
    pub fn scaled(&self, q: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|i| q[i] / self.units[i])
    }

    /// Unknowns from those in units.
    fn unscaled(&self, x: &[f64; N]) -> [f64; N] {
        std::array::from_fn(|i| x[i] * self.units[i])
    }
}

impl<E: Energy<N>, const N: usize> Energy<N> for Scaled<E, N> {
    /// The energy in J at the unknowns `q`.
    fn energy<D: Scalar>(&self, x: &[D; N]) -> D {
        self.energy.energy(&std::array::from_fn(|i| x[i] * self.units[i]))
    }
}

impl<E: Analytic<N>, const N: usize> Analytic<N> for Scaled<E, N> {
    /// The gradient dE/dq, J over the units of `q`.
    fn gradient(&self, x: &[f64; N]) -> [f64; N] {
        let gradient = self.energy.gradient(&self.unscaled(x));
        std::array::from_fn(|i| gradient[i] * self.units[i])
    }
    /// d2E/dq2, all of the symmetric matrix.
    fn hessian(&self, x: &[f64; N]) -> [[f64; N]; N] {
        let hessian = self.energy.hessian(&self.unscaled(x));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| hessian[i][j] * self.units[i] * self.units[j])
        })
    }
}

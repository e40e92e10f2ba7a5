//! What the stepper asks of a rod, whatever its dimension.
//!
//! A rod is a list of [elements](crate::energy), a diagonal mass and dead loads. The stepper sees
//! only this trait; [`PlanarRod`](crate::planar_rod::PlanarRod) is a rod of the plane.

use crate::banded::BandMatrix;
use crate::energy::Derivatives;
use crate::scalar::Scalar;
use num_dual::Dual64;
use serde::Serialize;

/// Energies by term, J.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Energies {
    /// Of motion.
    pub kinetic: f64,
    /// Of stretching.
    pub stretch: f64,
    /// Of bending.
    pub bend: f64,
    /// Of twisting.
    pub twist: f64,
    /// Of the dead loads: weight and point forces.
    pub potential: f64,
}

impl Energies {
    /// The sum of all terms, J.
    pub fn total(&self) -> f64 {
        self.kinetic + self.stretch + self.bend + self.twist + self.potential
    }
}

/// A discrete rod with unknowns `q` and a tangent of half-bandwidth `W`.
pub trait Rod<D: Scalar, const W: usize>: Clone {
    /// The same rod with a derivative along one parameter in every quantity.
    type Seeded: Rod<Dual64, W>;

    /// Lumped mass of every degree of freedom, kg (kg m^2 for angles).
    fn mass(&self) -> &[D];

    /// Writes the gradient of the elastic energy less the dead loads, N.
    fn gradient(&self, q: &[D], derivatives: Derivatives, gradient: &mut [D]);

    /// Writes the gradient as [`gradient`](Rod::gradient) does, and its tangent, N/m.
    fn tangent(
        &self,
        q: &[D],
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut BandMatrix<D, W>,
    );

    /// Writes the derivative of the gradient along the parameter `seeded` carries, at fixed `q`.
    fn gradient_rate(seeded: &Self::Seeded, q: &[f64], derivatives: Derivatives, rate: &mut [f64]);

    /// Elastic energies and the potential of the loads; kinetic energy zero.
    fn energies(&self, q: &[D]) -> Energies;

    /// Writes the strains of all elements, in the order [`set_viscous`](Rod::set_viscous) expects.
    fn strains(&self, q: &[D], strains: &mut Vec<D>);

    /// Becomes `elastic` with every stiffness times `factor` and every natural strain
    /// `(natural + shift[i]) / factor`.
    fn set_viscous(&mut self, elastic: &Self, factor: D, shift: &[D]);
}

//! Derivatives of the forces and strains of a rod along parameters.

use crate::energy::Derivatives;
use crate::numerics::lanes::Lanes;
use crate::rod::{FrameRate, Rod, RodGeometry};

/// The effective strains from which the stress at one moment follows, in the order of the strains, with their
/// derivatives along `G` parameters: the stress of a joint is `K (s - s_natural)`, and that of dashpots alone `K s`.
#[derive(Clone, Debug, Default)]
pub struct EffectiveStrains<const G: usize> {
    /// Whether natural strains are subtracted.
    pub natural: bool,
    /// The strains.
    pub values: Vec<f64>,
    /// Their derivatives.
    pub rates: Vec<Lanes<G>>,
    /// Strains of kinds with a viscosity of their own, without the coupling of bending and twisting; empty of most rods.
    pub own: Vec<f64>,
    /// Their derivatives.
    pub own_rates: Vec<Lanes<G>>,
}

/// The derivatives of the numbers of a rod along `G` parameters.
#[derive(Debug)]
pub struct ChangedRods<'a, R: Sensitive, const G: usize> {
    /// Dual rods, one for each parameter, which contain the derivatives.
    pub duals: &'a [R::Dual; G],
    /// The derivatives of loads and stresses that these rods contain.
    pub rates: &'a R::Rates<G>,
}

impl<R: Sensitive, const G: usize> Copy for ChangedRods<'_, R, G> {}
impl<R: Sensitive, const G: usize> Clone for ChangedRods<'_, R, G> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

/// A rod with derivatives of its forces along `G` parameters in SIMD lanes. Dual rods, one for each parameter, contain
/// the derivatives of its numbers. Each lane has the result that it would have alone.
pub trait Sensitive: Rod<f64, Geometry: RodGeometry> + 'static {
    /// Derivatives of the loads, and of the stresses as functions of the strains.
    type Rates<const G: usize>: Clone + std::fmt::Debug + Default + Send + Sync;

    /// Writes the derivatives that dual rods contain.
    fn set_rates<const G: usize>(duals: &[Self::Dual; G], rates: &mut Self::Rates<G>);

    /// Writes the derivatives of the gradient at fixed unknowns and frames, at the state of the `geometry`, by the
    /// numbers that have `changed`.
    fn gradient_rate<const G: usize>(
        changed: ChangedRods<'_, Self, G>,
        geometry: &Self::Geometry,
        q: &[f64],
        frames: &Self::Frames,
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    );

    /// The kind of a strain: 0 of stretching, 1 of bending, 2 of twisting.
    fn kind(&self, strain: usize) -> usize;

    /// Writes the derivatives of the strains at fixed unknowns: those by the rest lengths of the edges.
    fn rest_strain_rates<const G: usize>(
        rates: &Self::Rates<G>,
        geometry: &Self::Geometry,
        out: &mut [Lanes<G>],
    );

    /// Adds the derivatives of the strains along those of the unknowns and frames.
    fn add_strain_rates<const G: usize>(
        &self,
        frames: &[FrameRate<G>],
        geometry: &Self::Geometry,
        q: &[[f64; G]],
        out: &mut [Lanes<G>],
    );

    /// Converts the derivatives of the stretches `z` of springs without slip to those with slip.
    fn slip_rates<const G: usize>(&self, rates: &Self::Rates<G>, z: &[f64], out: &mut [Lanes<G>]);

    /// Writes the derivatives of the stresses of all elements: N, and N m.
    fn stress_rates<const G: usize>(
        &self,
        rates: &Self::Rates<G>,
        strains: &EffectiveStrains<G>,
        out: &mut [Lanes<G>],
    );

    /// Writes the derivatives of the gradient at fixed unknowns and frames from the derivatives `stress` of the stresses,
    /// and of the loads and user-defined energies that have `changed`, if any.
    fn stressed_rate<const G: usize>(
        changed: Option<ChangedRods<'_, Self, G>>,
        stress: &[Lanes<G>],
        geometry: &Self::Geometry,
        q: &[f64],
        frames: &Self::Frames,
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    );
}

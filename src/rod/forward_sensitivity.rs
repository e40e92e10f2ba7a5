//! Derivatives of the forces and strains of a rod along parameters: the trait [`ForwardSensitivity`] of forward
//! sensitivities.
//!
//! A parameter changes numbers of the rod (stiffnesses, natural strains, rest lengths, loads). One rod over dual
//! numbers per parameter contains these changes ([`ChangedRods`]). Input: these rods, and the derivatives of unknowns
//! and frames along the parameters. Output: derivatives of strains, of stresses (N, N m), of the stretches of friction
//! springs with slip, and of the energy gradient and the forces of viscous stresses (N). They are computed for `G`
//! parameters at a time, one per SIMD lane. All are per unit of the parameter. [`EffectiveStrains`] are sums of present
//! and past strains, strain rates and stretches of Maxwell branches, with their derivatives along the parameters. The
//! stress of a joint with its viscous part is `K (s - s_natural)` of such a strain `s`, that of its dashpots alone `K
//! s`.

use crate::energy::Derivatives;
use crate::numerics::directions::Directions;
use crate::rod::{FrameRate, Rod, RodGeometry};

/// The effective strains from which the stress at one moment follows, in the order of the strains, with their
/// derivatives along `G` parameters: the stress of a joint is `K (s - s_natural)`, and that of dashpots alone `K s`.
#[derive(Clone, Debug, Default)]
pub struct EffectiveStrains<const G: usize> {
    /// Whether natural strains are subtracted.
    pub natural: bool,
    /// The effective strains, of edges first, then of joints.
    pub values: Vec<f64>,
    /// Their derivatives.
    pub rates: Vec<Directions<G>>,
    /// Additional effective strains by the viscous times of single kinds of strain, whose stress has no coupling of
    /// bending and twisting; empty for most rods.
    pub own: Vec<f64>,
    /// Their derivatives.
    pub own_rates: Vec<Directions<G>>,
}

/// The derivatives of the numbers of a rod along `G` parameters.
#[derive(Debug)]
pub struct ChangedRods<'a, R: ForwardSensitivity, const G: usize> {
    /// Dual rods, one for each parameter, which contain the derivatives.
    pub duals: &'a [R::Dual; G],
    /// The derivatives of loads and stresses that these rods contain.
    pub rates: &'a R::Rates<G>,
}

impl<R: ForwardSensitivity, const G: usize> Copy for ChangedRods<'_, R, G> {}
impl<R: ForwardSensitivity, const G: usize> Clone for ChangedRods<'_, R, G> {
    /// A copy of the references to the dual rods and their rates.
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

/// A rod with derivatives of its forces along `G` parameters in SIMD lanes. Dual rods, one for each parameter, contain
/// the derivatives of its numbers. The result in each lane does not depend on the other lanes.
pub trait ForwardSensitivity: Rod<f64, Geometry: RodGeometry> + 'static {
    /// Derivatives of the loads, and of the stresses as functions of the strains.
    type Rates<const G: usize>: Clone + std::fmt::Debug + Default + Send + Sync;

    /// Overwrites `rates` with the derivatives of laws, rest lengths, dead loads and friction springs that the dual
    /// rods contain, one lane per rod.
    fn set_rates<const G: usize>(duals: &[Self::Dual; G], rates: &mut Self::Rates<G>);

    /// Overwrites `out` with the derivatives of the gradient, N (N m for angles), by the numbers of the rod that
    /// `changed` contains, at fixed unknowns `q` and frames. One row per unknown, one column per parameter.
    /// `geometry` is that of the rod at `q`; `derivatives` selects hand-derived formulas or num-dual.
    fn gradient_rate<const G: usize>(
        changed: ChangedRods<'_, Self, G>,
        geometry: &Self::Geometry,
        q: &[f64],
        frames: &Self::Frames,
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    );

    /// The kind of the strain with the index `strain` in the list of edges, then joints: 0 stretching, 1 bending, 2
    /// twisting.
    fn kind(&self, strain: usize) -> usize;

    /// Overwrites `out` with the derivatives of the strains at fixed unknowns. Those of edges are
    /// `-(1 + strain) dl/l` with the rest length `l`; those of joints are zero.
    fn rest_strain_rates<const G: usize>(
        rates: &Self::Rates<G>,
        geometry: &Self::Geometry,
        out: &mut [Directions<G>],
    );

    /// Adds to `out`, one row per strain, the derivatives `B dq` of the strains (`B = ds/dq`) that follow from those
    /// of the unknowns, `q`, and of the `frames`. `geometry` is that at the present unknowns.
    fn add_strain_rates<const G: usize>(
        &self,
        frames: &[FrameRate<G>],
        geometry: &Self::Geometry,
        q: &[[f64; G]],
        out: &mut [Directions<G>],
    );

    /// Converts `out`, the derivatives of the stretches of friction springs without slip, to those with slip, in place.
    /// `z` are the stretches without slip. Springs below their limit keep their derivatives; others get those of
    /// `z R/|z|` with the limit `R`. Nothing happens without friction.
    fn slip_rates<const G: usize>(
        &self,
        rates: &Self::Rates<G>,
        z: &[f64],
        out: &mut [Directions<G>],
    );

    /// Overwrites `out` with the derivatives of the stresses of all elements, N for edges and N m for joints, at the
    /// effective strains and at fixed unknowns, with the rod at the state of the `geometry`.
    fn stress_rates<const G: usize>(
        &self,
        rates: &Self::Rates<G>,
        strains: &EffectiveStrains<G>,
        geometry: &Self::Geometry,
        out: &mut [Directions<G>],
    );

    /// Overwrites `out` with the derivatives of the forces, N, of the stresses `K s` of the effective `strains` `s`,
    /// without natural strains. They are along the changes of laws (`rates`), strains, unknowns `q` and `frames`; the
    /// change of the strains' directions is included.
    fn viscous_force_rate<const G: usize>(
        &self,
        rates: &Self::Rates<G>,
        strains: &EffectiveStrains<G>,
        frames: &[FrameRate<G>],
        geometry: &Self::Geometry,
        q: &[[f64; G]],
        out: &mut [[f64; G]],
    );

    /// Overwrites `out` with the derivatives of the gradient, N, at fixed unknowns `q` and frames, from the derivatives
    /// `stress` of the stresses of all elements: `B^T stress` with `B = ds/dq`. `changed` adds those of dead loads,
    /// moments, user-defined energies and contacts; `None` leaves them out. `derivatives` selects hand-derived formulas
    /// or num-dual.
    fn stressed_rate<const G: usize>(
        changed: Option<ChangedRods<'_, Self, G>>,
        stress: &[Directions<G>],
        geometry: &Self::Geometry,
        q: &[f64],
        frames: &Self::Frames,
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    );
}

//! Transposed products of the [derivatives](crate::rod::sensitive) of a rod, for the gradient of a misfit by the
//! adjoint method: the trait [`Transposed`].
//!
//! Input: the derivatives `d` of the misfit by the forces on the unknowns. They become those by the stresses of the
//! elements, `w = B d` with `B = ds/dq` ([`strained`]). Parameters change laws and loads only, so that the derivatives
//! by each law and each load ([`LawDerivatives`]) are sufficient for all parameters. Output: their product with the
//! changes of one rod over dual numbers ([`Transposed::along`]), which is the derivative of the misfit along its
//! parameter.

use crate::energy::law::{BendingSlopes, LawSlopes};
use crate::numerics::directions::Directions;
use crate::rod::{ForwardSensitivity, FrameRate};

/// The derivatives of a misfit by the laws and loads of a rod.
#[derive(Clone, Debug, Default)]
pub struct LawDerivatives {
    /// By stiffness and natural stress of each edge at fixed unknowns, and by the numbers of its nonlinear law.
    pub stretch: Vec<LawSlopes>,
    /// By the relative change of each rest length, where it changes effective strains.
    pub rest: Vec<f64>,
    /// By stiffness and natural stress of each joint.
    pub joint: Vec<LawSlopes>,
    /// By the numbers of nonlinear bending of each joint. Empty for linear laws.
    pub bending: Vec<BendingSlopes>,
    /// By the loads on all unknowns.
    pub load: Vec<f64>,
    /// By a dead moment on each edge; empty where moments are not possible or not needed.
    pub moment: Vec<f64>,
}

impl LawDerivatives {
    /// Zeros for a rod with `edges` edges, one joint fewer, `unknowns` unknowns, and possible moments on the first
    /// `moments` edges.
    pub fn new(edges: usize, unknowns: usize, moments: usize) -> Self {
        Self {
            stretch: vec![LawSlopes::default(); edges],
            rest: vec![0.0; edges],
            joint: vec![LawSlopes::default(); edges - 1],
            bending: Vec::new(),
            load: vec![0.0; unknowns],
            moment: vec![0.0; moments],
        }
    }
}

/// The effective strains from which stresses follow.
#[derive(Clone, Copy, Debug)]
pub struct StressInputs<'a> {
    /// The effective strains, of edges first, then of joints.
    pub strains: &'a [f64],
    /// Additional effective strains by the viscous times of single kinds of strain, in the same order; empty for most
    /// rods.
    pub own: &'a [f64],
    /// The strains of the rod themselves, on which the parts of stresses beyond a linear law depend.
    pub now: &'a [f64],
    /// Whether rest lengths act through effective strains instead of through the laws of the edges.
    pub counted: bool,
}

/// A rod with transposed products of its [derivatives](ForwardSensitivity), which convert derivatives of a misfit.
pub trait Transposed: ForwardSensitivity {
    /// Zero derivatives for this rod. Those by dead moments have one entry per edge in the plane if `moments` is true
    /// or the rod has moments; else they are empty.
    fn zero_law_derivatives(&self, moments: bool) -> LawDerivatives;

    /// Multiplies the strains of edges, the first of the list, by their rest lengths, so that their products with
    /// forces are energies. Strains of joints stay.
    fn scale_edges_by_rest_length(&self, strains: &mut [f64]);

    /// Overwrites `out` with `K w`: the elastic stiffness of each element times its entries of `w`, N for edges and N
    /// m for joints. `coupled` includes the coupling of bending and twisting in a joint.
    fn stiffened(&self, w: &[f64], coupled: bool, out: &mut Vec<f64>);

    /// Adds to `laws` the derivatives of the misfit by stiffness and natural stress of every law, from its derivatives
    /// `w` by the stresses at the effective strains `strained`. If `strained.counted`, those by relative changes of the
    /// rest lengths are added too. Nonlinear laws of edges and joints add those by their moduli, natural strains and
    /// rest lengths at `strained.now`.
    fn add_to_laws(&self, w: &[f64], strained: StressInputs<'_>, laws: &mut LawDerivatives);

    /// Adds to `laws.moment` the derivatives of the misfit by a dead moment on each edge at `q`, from those `d` by
    /// the forces. Nothing happens if that list is empty.
    fn add_to_moments(&self, q: &[f64], d: &[f64], laws: &mut LawDerivatives);

    /// The derivative of the misfit along one parameter: the sum of `laws` times the derivatives along it. Those of
    /// stiffnesses, natural stresses, moduli of nonlinear laws, rest lengths and loads are in `rates`, those of the
    /// moments in `dual`.
    fn along(&self, dual: &Self::Dual, rates: &Self::Rates<1>, laws: &LawDerivatives) -> f64;

    /// The part of [`along`](Self::along) by stiffness and natural stress of each joint: one number per joint, from
    /// the first on.
    fn along_joints(rates: &Self::Rates<1>, laws: &LawDerivatives) -> Vec<f64>;
}

/// Overwrites `out` with the strains `B change` along a `change` of the unknowns (`B = ds/dq`), edges first, then
/// joints. Those of edges are multiplied by their rest lengths. `still` are zero derivatives, one per reference
/// frame.
pub fn strained<R: Transposed>(
    rod: &R,
    geometry: &R::Geometry,
    still: &[FrameRate<1>],
    change: &[f64],
    out: &mut [f64],
) {
    // The strains along one direction are the forward product with a single lane.
    let mut strains = vec![Directions::ZERO; out.len()];
    rod.add_strain_rates(still, geometry, change.as_chunks::<1>().0, &mut strains);
    out.iter_mut().zip(strains).for_each(|(out, strain)| *out = strain.0[0]);
    rod.scale_edges_by_rest_length(out);
}

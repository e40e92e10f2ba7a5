//! Laws of the material: the stresses of an edge or a joint as functions of its strains.
//!
//! A [`Law`] is elastic, with the stress `K (s - s_natural)`: stretching of an edge, bending of a planar joint, bending
//! and twisting of a spatial one. Each law states its stiffness, its natural strains and its energies, for any
//! [`Scalar`]; the sweeps over a rod, its viscous steps, its dashpots and all derivatives follow from these.
//!
//! - Kelvin-Voigt and Maxwell stress over a step make another elastic law of an elastic one: [`Law::viscous`].
//! - Internal friction is an elastic law in parallel with springs that slip: [`slip`].
//! - Derivatives along parameters, and by the numbers of a law, are those of its stiffness and of its stress without
//!   strain: [`LawRate`] and [`LawSlopes`].

mod rate;
pub mod slip;
pub(crate) mod stiffness;

pub use rate::{LawRate, LawSlopes};
pub use slip::{Sliders, Spring, Springs};
pub use stiffness::{Entry, Stiffness, Symmetric};

use crate::numerics::scalar::Scalar;
use crate::numerics::vector::components;
use std::fmt::Debug;

/// The elastic law of an edge or a joint with `S` strains.
pub trait Law<D: Scalar, const S: usize>: Copy + Debug + Send + Sync {
    /// The derivatives of the stresses by the strains.
    type Stiffness: Symmetric<D, S>;

    /// The kind of each strain: 0 of stretching, 1 of bending, 2 of twisting.
    const KINDS: [usize; S];

    /// The stiffness `K`: N of an edge, N m of a joint.
    fn stiffness(&self) -> Self::Stiffness;

    /// The strains at which there is no stress.
    fn natural(&self) -> [D; S];

    /// The law with other stiffnesses and natural strains.
    fn with(&self, stiffness: Self::Stiffness, natural: [D; S]) -> Self;

    /// Energies of stretching, bending and twisting, J, at the difference of the strains from the natural ones. The
    /// energy of a coupling counts half for each of its kinds.
    fn energies(&self, difference: &[D; S]) -> [D; 3];

    /// The strains less the natural ones.
    #[inline(always)]
    fn difference(&self, strains: &[D; S]) -> [D; S] {
        let (mut difference, natural) = (*strains, self.natural());
        for c in 0..S {
            difference[c] = difference[c] - natural[c];
        }
        difference
    }

    /// The stresses at these strains: N of an edge, N m of a joint.
    #[inline(always)]
    fn stress(&self, strains: &[D; S]) -> [D; S] {
        self.stiffness().times(&self.difference(strains))
    }

    /// The law of a viscous step, with the stress `K (factor s - natural - shift)`.
    #[inline(always)]
    fn viscous(&self, factor: D, shift: &[D; S]) -> Self {
        let natural = self.natural();
        let natural = components(|c| (natural[c] + shift[c]) / factor);
        self.with(self.stiffness().scaled(factor, &[factor; S]), natural)
    }

    /// The law of a viscous step with the additional stress `K' (kinds s - own)`, where `kinds` are factors of each
    /// kind of strain and `K'` is the stiffness without the coupling of bending and twisting.
    fn viscous_by_kind(&self, factor: D, shift: &[D; S], kinds: &[D; 3], own: &[D; S]) -> Self {
        let (elastic, natural) = (self.stiffness(), self.natural());
        let factors = components(|c| factor + kinds[Self::KINDS[c]]);
        let stiffness = elastic.scaled(factor, &factors);
        let coupled: [D; S] = elastic.times(&components(|c| natural[c] + shift[c]));
        let own: [D; S] = elastic.uncoupled().times(own);
        let stress = components(|c| coupled[c] + own[c]);
        self.with(stiffness, stiffness.inverse_times(&stress))
    }

    /// The law with every stiffness times the factor of its kind, that of the coupling times `coupling`, and these
    /// natural strains.
    fn dashpot(&self, coupling: D, kinds: &[D; 3], natural: [D; S]) -> Self {
        let factors = components(|c| kinds[Self::KINDS[c]]);
        self.with(self.stiffness().scaled(coupling, &factors), natural)
    }
}

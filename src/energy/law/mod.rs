//! Laws of the material: the stresses of an edge or a joint as functions of its strains.
//!
//! A [`Law`] is elastic: stretching of an edge, bending of a planar joint, bending and twisting of a spatial one.
//! Strain and stress of an edge are without unit and in N, those of joints in rad and N m. Its stress is
//! `K (s - s_natural)`. Stretching that is not linear in the strain adds a part beyond that: [`NonlinearPart`]. Each
//! law has a stiffness, natural strains and energies (J), for any [`Scalar`]; the sweeps over a rod, its viscous steps,
//! its dashpots and all derivatives follow from these.
//!
//! - Kelvin-Voigt and Maxwell stress over a step make another elastic law of an elastic one: [`Law::viscous`].
//! - Viscous stress has the stiffness at no strain, also of laws that are not linear: [`hyperelastic`].
//! - Bending that is not linear in the curvature is a further stress of a joint: [`NonlinearBending`], with the ratio
//!   [`SecantStiffness`] of the material.
//! - Internal friction is an elastic law in parallel with springs that slip: [`slip`].
//! - Derivatives along parameters, and by the numbers of a law, are those of its stiffness and of its stress without
//!   strain: [`LawRate`] and [`LawSlopes`].

pub mod hyperelastic;
mod nonlinear_bending;
mod rate;
mod secant_stiffness;
pub mod slip;
pub(crate) mod stiffness;

pub use hyperelastic::NonlinearPart;
pub use nonlinear_bending::{BendingSlopes, NonlinearBending};
pub use rate::{LawRate, LawSlopes};
pub use secant_stiffness::{SecantStiffness, SecantTable};
pub use slip::{ActiveSlipElements, SlipElements, Spring};
pub use stiffness::{Stiffness, StiffnessEntry, Symmetric};

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

    /// The natural strains, at which there is no stress: dimensionless of an edge, rad of a joint.
    fn natural(&self) -> [D; S];

    /// The law with another stiffness and other natural strains.
    fn with(&self, stiffness: Self::Stiffness, natural: [D; S]) -> Self;

    /// Replaces stiffness and natural strains of this law, in place.
    #[inline(always)]
    fn set(&mut self, stiffness: Self::Stiffness, natural: [D; S]) {
        *self = self.with(stiffness, natural);
    }

    /// Energies of stretching, bending and twisting, J, at the `difference` of the strains from the natural ones. The
    /// energy of a coupling counts half for each of its kinds. The strains of a joint are integrated over its length;
    /// the energy of an edge is multiplied by its rest length, which is a part of the law.
    fn energies(&self, difference: &[D; S]) -> [D; 3];

    /// The strains less the natural ones, entry by entry.
    #[inline(always)]
    fn difference(&self, strains: &[D; S]) -> [D; S] {
        let (mut difference, natural) = (*strains, self.natural());
        for c in 0..S {
            difference[c] -= natural[c];
        }
        difference
    }

    /// The stresses at these strains, N of an edge, N m of a joint: `K (s - natural)`.
    #[inline(always)]
    fn stress(&self, strains: &[D; S]) -> [D; S] {
        self.stiffness().times(&self.difference(strains))
    }

    /// The derivatives of the stresses by the strains, and the stresses, at these strains.
    #[inline(always)]
    fn response(&self, strains: &[D; S]) -> (Self::Stiffness, [D; S]) {
        (self.stiffness(), self.stress(strains))
    }

    /// The law of a viscous step, with the stress `K (factor s - natural - shift)`: stiffness
    /// `factor K`, natural strains `(natural + shift)/factor`.
    #[inline(always)]
    fn viscous(&self, factor: D, shift: &[D; S]) -> Self {
        let natural = self.natural();
        let natural = components(|c| (natural[c] + shift[c]) / factor);
        self.with(self.stiffness().scaled(factor, &[factor; S]), natural)
    }

    /// The law of a viscous step with the stress `K (factor s - natural - shift) + K' (kinds s - own)`. `kinds` are
    /// factors of stretching, bending and twisting, and `K'` is the stiffness without the coupling of bending and
    /// twisting. It is one linear law: its stiffness is the sum of both, and its natural strains give the same stress
    /// at zero strain.
    fn viscous_by_kind(&self, factor: D, shift: &[D; S], kinds: &[D; 3], own: &[D; S]) -> Self {
        // A single strain has no coupling: both stiffnesses are the same.
        if S == 1 {
            return self
                .viscous(factor + kinds[Self::KINDS[0]], &components(|c| shift[c] + own[c]));
        }
        // The sum of both stresses is one linear law: its stiffness is the sum, and its natural
        // strains follow from the stress without strain.
        let (elastic, natural) = (self.stiffness(), self.natural());
        let factors = components(|c| factor + kinds[Self::KINDS[c]]);
        let stiffness = elastic.scaled(factor, &factors);
        let coupled: [D; S] = elastic.times(&components(|c| natural[c] + shift[c]));
        let own: [D; S] = elastic.uncoupled().times(own);
        let stress = components(|c| coupled[c] + own[c]);
        self.with(stiffness, stiffness.inverse_times(&stress))
    }

    /// The law with every stiffness times the factor of its kind (`kinds` of stretching, bending, twisting), that
    /// between bending and twisting times `coupling`, and the given natural strains.
    fn dashpot(&self, coupling: D, kinds: &[D; 3], natural: [D; S]) -> Self {
        let factors = components(|c| kinds[Self::KINDS[c]]);
        self.with(self.stiffness().scaled(coupling, &factors), natural)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::PlanarBend;
    use crate::energy::bend_twist::JointLaw;
    use crate::numerics::directions::Directions;

    const STIFFNESS: Stiffness<f64> =
        Stiffness { bend: [2.0, 0.1, 1.4], twist: 0.8, coupling: [0.05, -0.1] };

    /// `K (factor s - natural - shift) + K' (kinds s - own)`, where `K'` is `K` without its coupling, at any strains.
    #[test]
    fn viscous_law_has_the_stress_of_the_step() {
        let law = JointLaw { stiffness: STIFFNESS, natural: [0.3, -0.2, 0.1] };
        let (factor, kinds) = (1.7, [9.0, 0.4, 0.9]);
        let (shift, own) = ([0.2, 0.5, -0.4], [-0.1, 0.6, 0.3]);
        let uncoupled = Stiffness { coupling: [0.0; 2], ..STIFFNESS };
        for s in [[0.0; 3], [0.7, -0.3, 0.5]] {
            let kind = |c: usize| kinds[JointLaw::<f64>::KINDS[c]];
            let coupled =
                STIFFNESS.times(&[0, 1, 2].map(|c| factor * s[c] - law.natural[c] - shift[c]));
            let alone: [f64; 3] = uncoupled.times(&[0, 1, 2].map(|c| kind(c) * s[c] - own[c]));
            let found = law.viscous_by_kind(factor, &shift, &kinds, &own).stress(&s);
            let plain = law.viscous(factor, &shift).stress(&s);
            for c in 0..3 {
                assert!((plain[c] - coupled[c]).abs() < 1e-14, "{plain:?} {coupled:?}");
                let exact = coupled[c] + alone[c];
                assert!((found[c] - exact).abs() < 1e-14, "{found:?} {coupled:?} {alone:?}");
            }
        }
    }

    /// The derivative of `w.stress` along a parameter is the product of its derivatives by the law with those of the
    /// law.
    #[test]
    fn slopes_are_the_transpose_of_rates() {
        let ([w1, w2, w3], s) = ([0.7, -1.1, 0.4], [0.3, 0.8, -0.5]);
        let rate = LawRate {
            stiffness: Stiffness::from_entries(|k| Directions([1.0 / (1.0 + k as f64)])),
            offset: [Directions([0.2]), Directions([-0.6]), Directions([0.9])],
        };
        let [a, b, c] = rate.stress(&s);
        let exact = a * w1 + b * w2 + c * w3;
        let mut slopes = LawSlopes::default();
        slopes.add::<Stiffness<f64>, 3>(&[w1, w2, w3], &s, &[0.0; 3]);
        assert!((rate.along(&slopes).0[0] - exact.0[0]).abs() < 1e-15, "{exact:?}");
    }

    /// A joint with one strain: `EI/dl (k - natural)`.
    #[test]
    fn planar_law_is_linear_in_its_curvature() {
        let law = PlanarBend { stiffness: 3.0, natural_curvature: 0.1 };
        let ([stiffness], [stress]) = law.response(&[0.5]);
        assert!((stiffness - 3.0).abs() < 1e-15 && (stress - 1.2).abs() < 1e-15, "{stress}");
    }
}

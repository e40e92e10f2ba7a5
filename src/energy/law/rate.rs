//! Derivatives of the stresses of a law along parameters, and of a number by the law.
//!
//! The stress `K s + w` of a linear [`Law`] is linear in its stiffness `K` and in its stress without strain `w = -K
//! s_natural`. [`LawRate`] has the derivatives of `K` and `w` along `G` parameters, one lane each, from one dual law
//! per parameter; its `stress` returns `dK s + dw` at fixed strains. [`LawSlopes`] has the derivatives of a number by
//! the entries of `K` (upper triangle) and by `w`, added from those by the stresses: the transposed product (`add`).
//! `along` is the sum of rates times slopes. The modulus of a [`NonlinearPart`](crate::energy::law::NonlinearPart) is
//! only a field of [`LawSlopes`], which others fill.

use crate::energy::law::{Law, Symmetric};
use crate::numerics::directions::Directions;
use crate::numerics::vector::components;
use num_dual::Dual64;

/// Derivatives of a law with `S` strains along `G` parameters.
#[derive(Clone, Copy, Debug)]
pub struct LawRate<K, const S: usize, const G: usize> {
    /// Of the stiffness.
    pub stiffness: K,
    /// Of the stress without strain.
    pub offset: [Directions<G>; S],
}

impl<K: Symmetric<Directions<G>, S>, const S: usize, const G: usize> LawRate<K, S, G> {
    /// The derivatives of `K` and of `-K s_natural` that dual laws contain, one lane for each parameter.
    pub fn from_duals<L: Law<Dual64, S>>(duals: [&L; G]) -> Self {
        let offsets = duals.map(|law| law.stiffness().times(&law.natural()));
        Self {
            stiffness: K::from_entries(|k| {
                Directions(components(|g| duals[g].stiffness().entry(k).eps))
            }),
            offset: components(|c| Directions(components(|g| -offsets[g][c].eps))),
        }
    }

    /// Whether all derivatives, of stiffness and of stress without strain, are zero.
    pub fn is_zero(&self) -> bool {
        (0..K::PLACES.len()).all(|k| self.stiffness.entry(k) == Directions::ZERO)
            && self.offset == [Directions::ZERO; S]
    }

    /// The derivatives of the stresses at fixed strains `s`: `dK s + dw`.
    #[inline(always)]
    pub fn stress(&self, strains: &[f64; S]) -> [Directions<G>; S] {
        let mut stress: [Directions<G>; S] = self.stiffness.times(strains);
        for c in 0..S {
            stress[c] += self.offset[c];
        }
        stress
    }

    /// The derivatives along the parameters of a number that has these `slopes` by the law: sum of rates times slopes
    /// over the entries of the stiffness and the stresses without strain. The modulus is left out.
    pub fn along(&self, slopes: &LawSlopes) -> Directions<G> {
        let mut sum = Directions::ZERO;
        for k in 0..K::PLACES.len() {
            sum += self.stiffness.entry(k) * slopes.stiffness[k];
        }
        for c in 0..S {
            sum += self.offset[c] * slopes.offset[c];
        }
        sum
    }
}

/// The derivatives of a number by a law; entries beyond those of its strains are zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct LawSlopes {
    /// By the entries of the stiffness, the upper triangle row by row.
    pub stiffness: [f64; 6],
    /// By the stresses without strain.
    pub offset: [f64; 3],
    /// By the modulus of the part beyond a linear law.
    pub modulus: f64,
    /// By its second modulus.
    pub second_modulus: f64,
    /// By its ratio of arc to chord.
    pub arc_ratio: f64,
}

impl LawSlopes {
    /// Adds the derivatives of a number that has those `w` by the stresses, at the strains `strains`: `w_r s_c` by each
    /// entry of the stiffness (both triangles), `w` by the stress without strain. Strains `own` are added to `strains`
    /// for all entries but the coupling of bending and twisting. That by the modulus stays.
    #[inline(always)]
    pub fn add<K: Symmetric<f64, S>, const S: usize>(
        &mut self,
        w: &[f64; S],
        strains: &[f64; S],
        own: &[f64; S],
    ) {
        for (k, [row, column]) in K::PLACES.iter().copied().enumerate() {
            // Damping times of single kinds of strain do not act on the coupling of bending and
            // twisting.
            let strain = |c: usize| strains[c] + if K::is_coupling(k) { 0.0 } else { own[c] };
            let mut product = w[row] * strain(column);
            // An entry off the diagonal stands in two rows of the matrix.
            if row != column {
                product += w[column] * strain(row);
            }
            self.stiffness[k] += product;
        }
        for c in 0..S {
            self.offset[c] += w[c];
        }
    }
}

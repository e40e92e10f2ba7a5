//! Bending that is not linear in the curvature: the part of the law of a joint beyond the linear one.
//!
//! A joint with the stiffness `B` of bending, N m, over its length `l`, m, has the linear stress `B s` at the
//! difference `s` of its integrated curvatures from the natural ones. The law `M = EI kappa (1 + b kappa^2)`, with
//! `kappa = s/l`, adds the energy `1/2 |s|^2 (s.A s)` with `A = b/(2 l^2) B`, N m:
//!
//! ```text
//! stress      w = s (s.A s) + |s|^2 A s
//! stiffness   C = (s.A s) I + 2 s (A s)' + 2 (A s) s' + |s|^2 A
//! ```
//!
//! In the plane that is `EI b kappa^3`. In space it is the same law in every direction of a round section, since `|s|`
//! is the size of the curvature. With two stiffnesses each principal direction alone has `EI_a kappa (1 + b kappa^2)`.
//! Twisting has no part. Input: the coefficient `b` (m^2), linear stiffness, natural strains and length of the joint,
//! and its strains. Output of [`NonlinearBending`], beyond the linear law only: energy (J), stresses (`stress`, N m),
//! stiffness with stresses (`response`), and derivatives of a number by `A` and natural strains from those by the
//! stresses, which `add_slopes` adds. Rods with this law keep it in a list beside their joints.

use crate::energy::law::{LawSlopes, Symmetric};
use crate::numerics::scalar::Scalar;
use crate::scene::material::BendingLaw;

/// The stress of a joint beyond that of its linear law.
#[derive(Clone, Copy, Debug)]
pub struct NonlinearBending<D, K, const S: usize> {
    /// The matrix `A` of bending, N m, with zeros for twisting.
    pub modulus: K,
    /// The natural strains.
    pub natural: [D; S],
}

/// The number of strains of bending, which come first, of a joint with `strains` strains.
const fn bending_strains(strains: usize) -> usize {
    if strains == 1 { 1 } else { 2 }
}

impl<D: Scalar, K: Symmetric<D, S>, const S: usize> NonlinearBending<D, K, S> {
    /// The part beyond the linear law of a joint with the linear stiffness `B`, N m, the `natural` strains and the
    /// `length` `l`, m. Its matrix is `A = b/(2 l^2) B` with the coefficient `b`, m^2, of the `law`; entries of
    /// twisting and its couplings are zero.
    pub fn new(law: &BendingLaw<D>, stiffness: &K, natural: [D; S], length: D) -> Self {
        let BendingLaw::Cubic { coefficient } = law;
        let factor = *coefficient * 0.5 / (length * length);
        let is_bending = |k: usize| K::PLACES[k][1] < bending_strains(S);
        let entry = |k: usize| {
            if is_bending(k) { stiffness.entry(k) * factor } else { D::from(0.0) }
        };
        Self { modulus: K::from_entries(entry), natural }
    }

    /// The differences of the curvatures from the natural ones; zero for twisting.
    fn difference(&self, strains: &[D; S]) -> [D; S] {
        let mut difference = [D::from(0.0); S];
        for c in 0..bending_strains(S) {
            difference[c] = strains[c] - self.natural[c];
        }
        difference
    }

    /// `A s`, `s.A s` and `|s|^2` at the difference `s` from the natural curvatures.
    fn products(&self, s: &[D; S]) -> ([D; S], D, D) {
        let product: [D; S] = self.modulus.times(s);
        let (mut along, mut squared) = (D::from(0.0), D::from(0.0));
        for c in 0..S {
            along += s[c] * product[c];
            squared += s[c] * s[c];
        }
        (product, along, squared)
    }

    /// The energy beyond the linear law, `1/2 |s|^2 (s.A s)`, J, at these strains, whose difference from the natural
    /// ones is `s`.
    pub fn energy(&self, strains: &[D; S]) -> D {
        let (_, along, squared) = self.products(&self.difference(strains));
        along * squared * 0.5
    }

    /// The stresses beyond the linear law, `s (s.A s) + |s|^2 A s`, N m, at these strains, whose difference from the
    /// natural ones is `s`; zero for twisting.
    pub fn stress(&self, strains: &[D; S]) -> [D; S] {
        let s = self.difference(strains);
        let (product, along, squared) = self.products(&s);
        let mut stress = s;
        for c in 0..S {
            stress[c] = s[c] * along + product[c] * squared;
        }
        stress
    }

    /// The derivatives of the stresses beyond the linear law by the strains (`C` of the header, N m), and these
    /// stresses, N m, at these strains.
    pub fn response(&self, strains: &[D; S]) -> (K, [D; S]) {
        let s = self.difference(strains);
        let (product, along, squared) = self.products(&s);
        let stiffness = K::from_entries(|k| {
            let [r, c] = K::PLACES[k];
            let mixed = (s[r] * product[c] + product[r] * s[c]) * 2.0;
            let entry = mixed + self.modulus.entry(k) * squared;
            if r == c && r < bending_strains(S) { entry + along } else { entry }
        });
        (stiffness, self.stress(strains))
    }

    /// Adds the derivatives of a number by the entries of `A` to the `stiffness` of `slopes`, and those by the natural
    /// strains to the `offset`. Input are its derivatives `w` by the stresses, at these strains.
    pub fn add_slopes(&self, w: &[D; S], strains: &[D; S], slopes: &mut LawSlopes) {
        let s = self.difference(strains);
        let (_, _, squared) = self.products(&s);
        let mut along = D::from(0.0);
        for c in 0..S {
            along += w[c] * s[c];
        }
        for (k, [r, c]) in K::PLACES.iter().copied().enumerate() {
            let mut slope = along * s[r] * s[c] + squared * w[r] * s[c];
            if r != c {
                slope += along * s[r] * s[c] + squared * w[c] * s[r];
            }
            if c < bending_strains(S) {
                slopes.stiffness[k] += slope.value();
            }
        }
        let by_strains: [D; S] = self.response(strains).0.times(w);
        for c in 0..bending_strains(S) {
            slopes.offset[c] -= by_strains[c].value();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::bend_twist::Stiffness;
    use nalgebra::SVector;
    use num_dual::{Dual64, hessian};

    const CUBIC: BendingLaw = BendingLaw::Cubic { coefficient: 0.03 };
    const LENGTH: f64 = 0.02;

    fn spatial<D: Scalar>() -> NonlinearBending<D, Stiffness<D>, 3> {
        let number = D::from;
        let stiffness = Stiffness {
            bend: [number(2.0), number(0.3), number(1.2)],
            twist: number(0.7),
            coupling: [number(0.1), number(-0.2)],
        };
        let law = BendingLaw::Cubic { coefficient: number(0.03) };
        let natural = [number(0.1), number(-0.05), number(0.4)];
        NonlinearBending::new(&law, &stiffness, natural, number(LENGTH))
    }

    /// In the plane the moment is `EI kappa (1 + b kappa^2)` with the linear part.
    #[test]
    fn planar_moment_is_that_of_the_cubic_law() {
        let bending = 3.0;
        let joint = NonlinearBending::new(&CUBIC, &[bending / LENGTH], [0.1], LENGTH);
        for k in [-0.4, 0.1, 0.1001, 0.7] {
            let kappa = (k - 0.1) / LENGTH;
            let exact = bending * 0.03 * f64::powi(kappa, 3);
            let [stress] = joint.stress(&[k]);
            assert!((stress - exact).abs() <= 1e-13 * exact.abs(), "{stress} {exact}");
            // The energy over the length, and the stiffness over the length.
            let energy = bending * 0.03 * kappa.powi(4) / 4.0 * LENGTH;
            assert!((joint.energy(&[k]) - energy).abs() <= 1e-13 * energy);
            let slope = 3.0 * bending * 0.03 * kappa * kappa / LENGTH;
            assert!((joint.response(&[k]).0[0] - slope).abs() <= 1e-13 * slope);
        }
    }

    /// Stresses and stiffness by hand are the derivatives of the energy by num-dual, in space with coupled directions.
    #[test]
    fn stress_and_stiffness_are_derivatives_of_the_energy() {
        for strains in [[0.4, -0.3, 0.9], [0.1, -0.05, 0.2], [-0.6, 0.5, -0.1]] {
            let (energy, gradient, second) = hessian(
                |s: SVector<_, 3>| spatial().energy(&[s[0], s[1], s[2]]),
                &SVector::from(strains),
            );
            let (stiffness, stress) = spatial::<f64>().response(&strains);
            assert!((energy - spatial::<f64>().energy(&strains)).abs() < 1e-15);
            for r in 0..3 {
                assert!((stress[r] - gradient[r]).abs() < 1e-13, "{stress:?} {gradient}");
            }
            for (k, [r, c]) in <Stiffness<f64> as Symmetric<f64, 3>>::PLACES.iter().enumerate() {
                let entry = Symmetric::<f64, 3>::entry(&stiffness, k);
                assert!((entry - second[(*r, *c)]).abs() < 1e-12, "{k} {entry} {second}");
            }
        }
    }

    /// Slopes by modulus and natural strains are those of `w.stress` by num-dual.
    #[test]
    fn slopes_are_derivatives_of_the_work_of_the_stresses() {
        let (w, strains) = ([0.3, -0.7, 0.2], [0.4, -0.3, 0.9]);
        let mut slopes = LawSlopes::default();
        spatial::<f64>().add_slopes(&w, &strains, &mut slopes);
        let work = |joint: NonlinearBending<Dual64, Stiffness<Dual64>, 3>| {
            let stress = joint.stress(&strains.map(Dual64::from));
            (0..3).map(|c| stress[c].eps * w[c]).sum::<f64>()
        };
        for k in 0..6 {
            let mut joint = spatial::<Dual64>();
            let [_, column] = <Stiffness<f64> as Symmetric<f64, 3>>::PLACES[k];
            let own = |j: usize| {
                let entry = Symmetric::<Dual64, 3>::entry(&joint.modulus, j);
                if j == k && column < 2 { entry.derivative() } else { entry }
            };
            joint.modulus = Symmetric::<Dual64, 3>::from_entries(own);
            let exact = work(joint);
            assert!((slopes.stiffness[k] - exact).abs() < 1e-14, "{k} {exact} {slopes:?}");
        }
        for c in 0..3 {
            let mut joint = spatial::<Dual64>();
            joint.natural[c] = joint.natural[c].derivative();
            let exact = work(joint);
            assert!((slopes.offset[c] - exact).abs() < 1e-12, "{c} {exact} {slopes:?}");
        }
    }
}

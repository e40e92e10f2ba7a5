//! Bending that is not linear in the curvature: the part of the law of a joint beyond the linear one.
//!
//! A joint with the stiffness `B` of bending, N m, over its length `l`, m, has the linear stress `B s` at the
//! difference `s` of its integrated curvatures from the natural ones. With the [ratio](SecantStiffness) `phi` of the
//! secant stiffness to that at small curvature, at the squared curvature `p = |s|^2/l^2`, the law `M = EI kappa phi`
//! adds the energy `(s.B s) H(p)`, where `2 H` is the mean of `phi - 1` over the squared curvatures up to `p`. With
//! `r = 1/l^2`:
//!
//! ```text
//! stress      w = 2 H B s + 2 r H' (s.B s) s
//! stiffness   C = 2 H B + 2 r H' ((s.B s) I + 2 s (B s)' + 2 (B s) s') + 4 r^2 H'' (s.B s) s s'
//! ```
//!
//! In the plane that is `EI kappa (phi - 1)`. In space it is the same law in every direction of a round section, since
//! `|s|` is the size of the curvature. With two stiffnesses each principal direction alone has `EI_a kappa phi`.
//! Twisting has no part. Input: the ratio `phi`, linear stiffness, natural strains and length of the joint, and its
//! strains. Output of [`NonlinearBending`], beyond the linear law only: energy (J), stresses (`stress`, N m), stiffness
//! with stresses (`response`), and derivatives of a number by the law and natural strains from those by the stresses,
//! which `add_slopes` adds to [`BendingSlopes`]. Rods with this law keep it in a list beside their joints.

use crate::energy::law::secant_stiffness::{MAX_NUMBERS, SecantStiffness};
use crate::energy::law::{LawSlopes, Symmetric};
use crate::numerics::scalar::Scalar;
use num_dual::Dual64;
use std::sync::Arc;

/// The stress of a joint beyond that of its linear law.
#[derive(Clone, Debug)]
pub struct NonlinearBending<D, K, const S: usize> {
    /// The matrix `B` of bending, N m, with zeros for twisting.
    linear: K,
    /// The natural strains.
    pub natural: [D; S],
    /// The factor `r` from squared strains to squared curvatures, 1/m^2.
    inverse_square_length: D,
    /// The ratio `phi` of the material.
    secant: Arc<SecantStiffness<D>>,
}

/// The derivatives of a number by the nonlinear bending of a joint.
#[derive(Clone, Copy, Debug)]
pub struct BendingSlopes {
    /// By the entries of `B`, as stiffness, and by the natural strains, as offset.
    law: LawSlopes,
    /// By `1/l^2`.
    inverse_square_length: f64,
    /// By the numbers of the ratio `phi`.
    secant: [f64; MAX_NUMBERS],
}

impl Default for BendingSlopes {
    /// Zeros.
    fn default() -> Self {
        Self { law: LawSlopes::default(), inverse_square_length: 0.0, secant: [0.0; MAX_NUMBERS] }
    }
}

/// The number of strains of bending, which come first, of a joint with `strains` strains.
const fn bending_strains(strains: usize) -> usize {
    if strains == 1 { 1 } else { 2 }
}

/// The state of a joint: its strains, and the quantities in its energy and stresses.
struct Bent<D, const S: usize> {
    /// The difference `s` from the natural curvatures; zero for twisting.
    s: [D; S],
    /// `B s`.
    product: [D; S],
    /// `s.B s`.
    along: D,
    /// `|s|^2`.
    squared: D,
    /// `2 H`, `2 r H'` and `4 r^2 H''`.
    factors: [D; 3],
}

impl<D: Scalar, K: Symmetric<D, S>, const S: usize> NonlinearBending<D, K, S> {
    /// The part beyond the linear law of a joint with the linear stiffness `stiffness`, N m, the `natural` strains and
    /// the `length` `l`, m, for the ratio `secant` of its material. Entries of twisting and its couplings are left out.
    pub fn new(
        secant: &Arc<SecantStiffness<D>>,
        stiffness: &K,
        natural: [D; S],
        length: D,
    ) -> Self {
        let is_bending = |k: usize| K::PLACES[k][1] < bending_strains(S);
        let entry = |k: usize| if is_bending(k) { stiffness.entry(k) } else { D::from(0.0) };
        Self {
            linear: K::from_entries(entry),
            natural,
            inverse_square_length: (length * length).recip(),
            secant: Arc::clone(secant),
        }
    }

    /// The length of the joint, m.
    pub fn length(&self) -> D {
        self.inverse_square_length.sqrt().recip()
    }

    /// The state at these strains.
    fn at(&self, strains: &[D; S]) -> Bent<D, S> {
        let mut s = [D::from(0.0); S];
        for c in 0..bending_strains(S) {
            s[c] = strains[c] - self.natural[c];
        }
        let product: [D; S] = self.linear.times(&s);
        let (mut along, mut squared) = (D::from(0.0), D::from(0.0));
        for c in 0..S {
            along += s[c] * product[c];
            squared += s[c] * s[c];
        }
        let r = self.inverse_square_length;
        let [mean, first, second] = self.secant.excess(squared * r);
        let factors = [mean * 2.0, first * r * 2.0, second * r * r * 4.0];
        Bent { s, product, along, squared, factors }
    }

    /// The energy beyond the linear law, `(s.B s) H`, J, at these strains, whose difference from the natural ones is
    /// `s`.
    pub fn energy(&self, strains: &[D; S]) -> D {
        let Bent { along, factors, .. } = self.at(strains);
        along * factors[0] * 0.5
    }

    /// The stresses beyond the linear law, N m, at these strains; zero for twisting.
    pub fn stress(&self, strains: &[D; S]) -> [D; S] {
        let Bent { s, product, along, factors: [mean, first, _], .. } = self.at(strains);
        let mut stress = s;
        for c in 0..S {
            stress[c] = product[c] * mean + s[c] * (along * first);
        }
        stress
    }

    /// The derivatives of the stresses beyond the linear law by the strains (`C` of the header, N m), and these
    /// stresses, N m, at these strains.
    pub fn response(&self, strains: &[D; S]) -> (K, [D; S]) {
        let Bent { s, product, along, factors: [mean, first, second], .. } = self.at(strains);
        let stiffness = K::from_entries(|k| {
            let [r, c] = K::PLACES[k];
            let mixed = (s[r] * product[c] + product[r] * s[c]) * 2.0;
            let entry =
                self.linear.entry(k) * mean + mixed * first + s[r] * s[c] * (second * along);
            if r == c && r < bending_strains(S) { entry + along * first } else { entry }
        });
        (stiffness, self.stress(strains))
    }
}

impl<K: Symmetric<f64, S>, const S: usize> NonlinearBending<f64, K, S> {
    /// Adds the derivatives of a number by the law and the natural strains of the joint to `slopes`. Input are its
    /// derivatives `w` by the stresses, at these strains.
    pub fn add_slopes(&self, w: &[f64; S], strains: &[f64; S], slopes: &mut BendingSlopes) {
        let Bent { s, product, along, squared, factors: [mean, first, second] } = self.at(strains);
        let (mut w_s, mut w_product) = (0.0, 0.0);
        for c in 0..S {
            w_s += w[c] * s[c];
            w_product += w[c] * product[c];
        }
        for (k, [r, c]) in K::PLACES.iter().copied().enumerate() {
            if c < bending_strains(S) {
                let mut slope = first * w_s * s[r] * s[c] + mean * w[r] * s[c];
                if r != c {
                    slope += first * w_s * s[r] * s[c] + mean * w[c] * s[r];
                }
                slopes.law.stiffness[k] += slope;
            }
        }
        let by_strains: [f64; S] = self.response(strains).0.times(w);
        for c in 0..bending_strains(S) {
            slopes.law.offset[c] -= by_strains[c];
        }
        // `w.stress = 2 H (w.B s) + 2 r H' (s.B s)(w.s)` by `r`, also through `p = r |s|^2`.
        let r = self.inverse_square_length;
        slopes.inverse_square_length += first / r * (squared * w_product + along * w_s)
            + 0.5 * second / r * squared * along * w_s;
        self.secant.number_slopes(squared * r, |number, [mean, first]| {
            slopes.secant[number] += 2.0 * (mean * w_product + r * first * along * w_s);
        });
    }
}

impl<K: Symmetric<Dual64, S>, const S: usize> NonlinearBending<Dual64, K, S> {
    /// The derivative along the parameter of this dual law, of a number with these `slopes`.
    pub fn along(&self, slopes: &BendingSlopes) -> f64 {
        let mut sum = self.inverse_square_length.eps * slopes.inverse_square_length;
        for k in 0..K::PLACES.len() {
            sum += self.linear.entry(k).eps * slopes.law.stiffness[k];
        }
        for c in 0..S {
            sum += self.natural[c].eps * slopes.law.offset[c];
        }
        let numbers = self.secant.numbers().zip(slopes.secant);
        sum + numbers.map(|(number, slope)| number.eps * slope).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::bend_twist::Stiffness;
    use crate::scene::material::BendingLaw;
    use nalgebra::SVector;
    use num_dual::hessian;

    const LENGTH: f64 = 0.02;

    /// A cubic law, and a table whose intervals are those of the tests' strains.
    fn laws<D: Scalar>() -> [Arc<SecantStiffness<D>>; 2] {
        let factor = [0.9, 0.6, 1.3].map(D::from).to_vec();
        let table = BendingLaw::Table { curvature: vec![3.0, 15.0, 25.0], factor };
        [BendingLaw::Cubic { coefficient: D::from(0.03) }, table]
            .map(|law| Arc::new(SecantStiffness::new(&law)))
    }

    fn spatial<D: Scalar>(
        law: &Arc<SecantStiffness<D>>,
        length: D,
    ) -> NonlinearBending<D, Stiffness<D>, 3> {
        let number = D::from;
        let stiffness = Stiffness {
            bend: [number(2.0), number(0.3), number(1.2)],
            twist: number(0.7),
            coupling: [number(0.1), number(-0.2)],
        };
        let natural = [number(0.1), number(-0.05), number(0.4)];
        NonlinearBending::new(law, &stiffness, natural, length)
    }

    /// In the plane the moment is `EI kappa (1 + b kappa^2)` with the linear part.
    #[test]
    fn planar_moment_is_that_of_the_cubic_law() {
        let bending = 3.0;
        let joint = NonlinearBending::new(&laws()[0], &[bending / LENGTH], [0.1], LENGTH);
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

    /// In the plane the moment at a curvature of the table is `EI kappa` times its factor.
    #[test]
    fn planar_moment_is_that_of_the_table() {
        let bending = 3.0;
        let joint = NonlinearBending::new(&laws()[1], &[bending / LENGTH], [0.1], LENGTH);
        for (kappa, factor) in [(3.0, 0.9), (-15.0, 0.6), (25.0, 1.3), (-60.0, 1.3)] {
            let [stress] = joint.stress(&[0.1 + kappa * LENGTH]);
            let exact = bending * kappa * (factor - 1.0);
            assert!((stress - exact).abs() <= 1e-12 * exact.abs(), "{kappa} {stress} {exact}");
        }
    }

    const STRAINS: [[f64; 3]; 4] =
        [[0.4, -0.3, 0.9], [0.1, -0.05, 0.2], [-0.6, 0.5, -0.1], [0.2, 0.1, 0.0]];

    /// Stresses and stiffness by hand are the derivatives of the energy by num-dual, in space with coupled directions.
    #[test]
    fn stress_and_stiffness_are_derivatives_of_the_energy() {
        for (law, dual) in laws().iter().zip(laws()) {
            for strains in STRAINS {
                let (energy, gradient, second) = hessian(
                    |s: SVector<_, 3>| spatial(&dual, LENGTH.into()).energy(&[s[0], s[1], s[2]]),
                    &SVector::from(strains),
                );
                let own = spatial::<f64>(law, LENGTH);
                let (stiffness, stress) = own.response(&strains);
                assert!((energy - own.energy(&strains)).abs() < 1e-15);
                for r in 0..3 {
                    assert!((stress[r] - gradient[r]).abs() < 1e-12, "{stress:?} {gradient}");
                }
                for (k, [r, c]) in <Stiffness<f64> as Symmetric<f64, 3>>::PLACES.iter().enumerate()
                {
                    let entry = Symmetric::<f64, 3>::entry(&stiffness, k);
                    assert!((entry - second[(*r, *c)]).abs() < 1e-11, "{k} {entry} {second}");
                }
            }
        }
    }

    /// Slopes by stiffness, natural strains and length are those of `w.stress` by num-dual.
    #[test]
    fn slopes_are_derivatives_of_the_work_of_the_stresses() {
        let w = [0.3, -0.7, 0.2];
        for (law, dual) in laws().iter().zip(laws::<Dual64>()) {
            for strains in STRAINS {
                let mut slopes = BendingSlopes::default();
                spatial::<f64>(law, LENGTH).add_slopes(&w, &strains, &mut slopes);
                let check = |joint: NonlinearBending<Dual64, Stiffness<Dual64>, 3>| {
                    let stress = joint.stress(&strains.map(Dual64::from));
                    let exact = (0..3).map(|c| stress[c].eps * w[c]).sum::<f64>();
                    let found = joint.along(&slopes);
                    assert!((found - exact).abs() < 1e-12 * (1.0 + exact.abs()), "{found} {exact}");
                };
                let plain = || spatial::<Dual64>(&dual, LENGTH.into());
                for k in 0..6 {
                    let mut joint = plain();
                    let [_, column] = <Stiffness<f64> as Symmetric<f64, 3>>::PLACES[k];
                    let own = |j: usize| {
                        let entry = Symmetric::<Dual64, 3>::entry(&joint.linear, j);
                        if j == k && column < 2 { entry.derivative() } else { entry }
                    };
                    joint.linear = Symmetric::<Dual64, 3>::from_entries(own);
                    check(joint);
                }
                for c in 0..3 {
                    let mut joint = plain();
                    joint.natural[c] = joint.natural[c].derivative();
                    check(joint);
                }
                check(spatial(&dual, Dual64::from(LENGTH).derivative()));
            }
        }
    }

    /// Slopes by the numbers of the laws, from scenes over dual numbers.
    #[test]
    fn slopes_by_numbers_of_the_law_are_those_of_dual_laws() {
        let w = [0.3, -0.7, 0.2];
        let unit = |k: usize, j: usize, x: f64| Dual64::new(x, f64::from(u8::from(k == j)));
        let table = |k: usize| {
            let factor = [0.9, 0.6, 1.3].iter().enumerate().map(|(j, x)| unit(k, j, *x)).collect();
            BendingLaw::Table { curvature: vec![3.0, 15.0, 25.0], factor }
        };
        let duals = [
            vec![BendingLaw::Cubic { coefficient: unit(0, 0, 0.03) }],
            [0, 1, 2].map(table).to_vec(),
        ];
        for (law, duals) in laws().iter().zip(duals) {
            for strains in STRAINS {
                let mut slopes = BendingSlopes::default();
                spatial::<f64>(law, LENGTH).add_slopes(&w, &strains, &mut slopes);
                for dual in &duals {
                    let joint = spatial(&Arc::new(SecantStiffness::new(dual)), LENGTH.into());
                    let stress = joint.stress(&strains.map(Dual64::from));
                    let exact = (0..3).map(|c| stress[c].eps * w[c]).sum::<f64>();
                    let found = joint.along(&slopes);
                    assert!((found - exact).abs() < 1e-12 * (1.0 + exact.abs()), "{found} {exact}");
                }
            }
        }
    }
}

//! Laws of the stretch that are nonlinear in the strain.
//!
//! A law with the force `N(s; p)` of an edge at the strain `s` is the linear law with its stiffness `K` at no
//! strain, and a [`NonlinearPart`]: `N = K s + C x(s)`. The modulus `C`, N (EA), depends on the parameters, and `x`
//! has no slope at no strain. Viscous stress takes the linear law. In this form no digits are lost at small
//! strains: `x` of an incompressible neo-Hookean rod is not the difference of `(lambda - 1/lambda^2)/3` and `s`,
//! but
//!
//! ```text
//! x = -s^2 (3 + 2 s)/(3 lambda^2)    dx/ds = -2/3 s (3 + 3 s + s^2)/lambda^3    integral = -s^3/(3 lambda)
//! ```
//!
//! with the stretch ratio `lambda = 1 + s`. An incompressible Mooney-Rivlin rod has `N = 2 A (C1 + C2/lambda) (lambda -
//! 1/lambda^2)` with `EA = 6 A (C1 + C2)`. Beside the neo-Hookean `x` with `C = EA` it has `C2/(C1 + C2) EA y(s)`:
//!
//! ```text
//! y = -s^2 (3 + 3 s + s^2)/(3 lambda^3)    dy/ds = -s (6 + 6 s + 4 s^2 + s^3)/(3 lambda^4)
//! integral = -s^3 (2 + s)/(6 lambda^2)
//! ```
//!
//! The chord of an edge may be shorter than the arc `n l` that it represents, as next to a wall. At the strain `s` of
//! the chord the material then has the strain `s/n`. The energy over the rest length is `n X(s/n)`, with `X` the
//! integral of `C x`, and the force is `C x(s/n)`.
//!
//! Input: the law, EA (N), C2/(C1 + C2) of a Mooney-Rivlin rod, `n`, and a strain. Output of [`NonlinearPart`] is the
//! part beyond the linear law only: energy over the rest length, force, and its derivative by the strain, all in N.
//! `response` returns derivative and force, `force_slopes` the derivatives of the force by both moduli and `n`;
//! `scaled` multiplies the moduli, `map` converts their scalar type. [`NonlinearPart::new`] is `None` for the linear
//! law. A new law is a variant of [`StretchLaw`] and its formulas here.

use crate::numerics::scalar::Scalar;
use crate::scene::StretchLaw;

/// The force of an edge beyond that of its linear law.
#[derive(Clone, Copy, Debug)]
pub struct NonlinearPart<D> {
    /// The law; a linear one has no part beyond.
    law: StretchLaw,
    /// The modulus C of `x`, N: EA.
    pub modulus: D,
    /// The modulus of `y`, N: EA C2/(C1 + C2) of a Mooney-Rivlin rod, else zero.
    pub second_modulus: D,
    /// Length of the arc that the edge represents, over that of its chord.
    pub arc_ratio: D,
}

/// The shape of a law beyond the linear one at a strain, for a modulus of one.
struct ForceShape<D> {
    /// `x` and `dx/ds`, or `y` and `dy/ds`.
    force: D,
    slope: D,
}

impl<D: Scalar> NonlinearPart<D> {
    /// The part of a law beyond the linear one, with the axial stiffness EA at no strain, N, as its modulus; `None` for
    /// the linear law. The `ratio` C2/(C1 + C2) is that of a Mooney-Rivlin rod; others ignore it. The edge represents
    /// an arc of `arc_ratio` times the length of its chord.
    pub fn new(law: StretchLaw, stiffness: D, ratio: D, arc_ratio: D) -> Option<Self> {
        let second_modulus = match law {
            StretchLaw::Linear => return None,
            StretchLaw::NeoHookean => stiffness.like(0.0),
            StretchLaw::MooneyRivlin => stiffness * ratio,
        };
        Some(Self { law, modulus: stiffness, second_modulus, arc_ratio })
    }

    /// The part with its numbers converted to another number type.
    pub fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> NonlinearPart<E> {
        NonlinearPart {
            law: self.law,
            modulus: convert(self.modulus),
            second_modulus: convert(self.second_modulus),
            arc_ratio: convert(self.arc_ratio),
        }
    }

    /// The part with both moduli times `factor`; the law and the ratio of arc to chord stay.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let (modulus, second_modulus) = (self.modulus * factor, self.second_modulus * factor);
        Self { modulus, second_modulus, ..*self }
    }

    /// The energy beyond the linear law over the rest length of the chord, N, at its strain `s`. It is `n` times the
    /// integrals of `x` and `y` from 0 to `s/n`, each times its modulus.
    pub fn energy(&self, s: D) -> D {
        let s = s / self.arc_ratio;
        let stretch = s + 1.0;
        let first = match self.law {
            StretchLaw::Linear => s.like(0.0),
            StretchLaw::NeoHookean | StretchLaw::MooneyRivlin => -(s * s * s) / (stretch * 3.0),
        };
        let energy = self.modulus * first;
        match self.law {
            StretchLaw::MooneyRivlin => {
                let second = s * s * s * (s + 2.0) / (stretch * stretch * 6.0);
                (energy - self.second_modulus * second) * self.arc_ratio
            }
            _ => energy * self.arc_ratio,
        }
    }

    /// The force beyond the linear law, `C x(s/n)` plus the second modulus times `y(s/n)`, N, at the strain `s` of the
    /// chord.
    #[inline(always)]
    pub fn force(&self, s: D) -> D {
        self.response(s)[1]
    }

    /// The derivatives of the force at the strain `s` of the chord by both moduli, dimensionless, and by the ratio of
    /// arc to chord, N.
    #[inline(always)]
    pub(crate) fn force_slopes(&self, s: D) -> [D; 3] {
        let of_arc = s / self.arc_ratio;
        let second = self.second_shape(of_arc).map_or(s.like(0.0), |shape| shape.force);
        let by_arc_ratio = -(self.response(s)[0] * of_arc);
        [self.shape(of_arc).force, second, by_arc_ratio]
    }

    /// The derivative of the force by the strain `s` of the chord, and the force, N.
    pub fn response(&self, s: D) -> [D; 2] {
        let of_arc = s / self.arc_ratio;
        let ForceShape { force, slope } = self.shape(of_arc);
        let [slope, force] = [self.modulus * slope, self.modulus * force];
        let [slope, force] = match self.second_shape(of_arc) {
            None => [slope, force],
            Some(second) => [
                slope + self.second_modulus * second.slope,
                force + self.second_modulus * second.force,
            ],
        };
        [slope / self.arc_ratio, force]
    }

    /// `y` and `dy/ds` of a Mooney-Rivlin law at the strain `s`; `None` for others.
    #[inline(always)]
    fn second_shape(&self, s: D) -> Option<ForceShape<D>> {
        if self.law != StretchLaw::MooneyRivlin {
            return None;
        }
        let inverse = (s + 1.0).recip();
        let cube = inverse * inverse * inverse;
        let sum = s * (s * (s + 4.0) + 6.0) + 6.0;
        Some(ForceShape {
            force: -(s * s * (s * s + s * 3.0 + 3.0) * cube) * (1.0 / 3.0),
            slope: -(s * sum * (cube * inverse)) * (1.0 / 3.0),
        })
    }

    /// `x` and `dx/ds` at the strain `s`, by the formulas of the header; zeros of a linear law.
    #[inline(always)]
    fn shape(&self, s: D) -> ForceShape<D> {
        match self.law {
            StretchLaw::Linear => ForceShape { force: s.like(0.0), slope: s.like(0.0) },
            StretchLaw::NeoHookean | StretchLaw::MooneyRivlin => {
                // Products instead of a difference of nearly equal numbers, so that small strains
                // lose no digits.
                let inverse = (s + 1.0).recip();
                let square = inverse * inverse;
                ForceShape {
                    force: -(s * s * (s * 2.0 + 3.0) * square) * (1.0 / 3.0),
                    slope: -(s * (s * s + s * 3.0 + 3.0) * (square * inverse)) * (2.0 / 3.0),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::{Element, HyperelasticStretch, Stretch, dual_tangent};
    use num_dual::Dual2_64;

    fn edge<const M: usize>(law: StretchLaw) -> HyperelasticStretch<f64, M> {
        let nonlinear = NonlinearPart::new(law, 7.0, 0.3, 1.0);
        let linear = Stretch { stiffness: 7.0, rest_length: 0.9, natural_strain: 0.0 };
        HyperelasticStretch { linear, nonlinear }
    }

    /// Energy, force and stiffness of the whole law are those of `E A/6 (lambda^2 + 2/lambda - 3)`.
    #[test]
    fn neo_hookean_law_is_that_of_the_literature() {
        let nonlinear = NonlinearPart::new(StretchLaw::NeoHookean, 7.0, 0.3, 1.0).unwrap();
        for s in [-0.6, -0.01, 1e-9, 0.0, 0.02, 1.5] {
            let stretch = Dual2_64::from(s).derivative() + 1.0;
            let exact = (stretch * stretch + stretch.recip() * 2.0 - 3.0) * (7.0 / 6.0);
            let [slope, force] = nonlinear.response(s);
            let energy = 3.5 * s * s + nonlinear.energy(s);
            assert!((energy - exact.re).abs() < 1e-14, "{s} {energy} {exact:?}");
            assert!((7.0 * s + force - exact.v1).abs() < 1e-13, "{s} {force} {exact:?}");
            assert!((7.0 + slope - exact.v2).abs() < 1e-12, "{s} {slope} {exact:?}");
            let lambda = 1.0 + s;
            let literature = 7.0 / 3.0 * (lambda - 1.0 / (lambda * lambda));
            assert!((7.0 * s + nonlinear.force(s) - literature).abs() < 1e-13);
        }
        // The relative error of the difference of two numbers near one would be 1e-7.
        let exact = -1e-18 * (1.0 + 2e-9 / 3.0) / (1.0 + 2e-9) * 7.0;
        assert!((nonlinear.force(1e-9) / exact - 1.0).abs() < 1e-15, "{:e}", nonlinear.force(1e-9));
    }

    /// Energy, force and stiffness are those of `C1 (lambda^2 + 2/lambda - 3) + C2 (1/lambda^2 + 2 lambda - 3)`.
    #[test]
    fn mooney_rivlin_law_is_that_of_the_literature() {
        let part = NonlinearPart::new(StretchLaw::MooneyRivlin, 7.0, 0.3, 1.0).unwrap();
        let [c1, c2] = [0.7, 0.3].map(|share| share * 7.0 / 6.0);
        for s in [-0.6, -0.01, 1e-9, 0.0, 0.02, 1.5] {
            let stretch = Dual2_64::from(s).derivative() + 1.0;
            let first = stretch * stretch + stretch.recip() * 2.0 - 3.0;
            let second = stretch.recip() * stretch.recip() + stretch * 2.0 - 3.0;
            let exact = first * c1 + second * c2;
            let [slope, force] = part.response(s);
            let energy = 3.5 * s * s + part.energy(s);
            assert!((energy - exact.re).abs() < 1e-14, "{s} {energy} {exact:?}");
            assert!((7.0 * s + force - exact.v1).abs() < 1e-12, "{s} {force} {exact:?}");
            assert!((7.0 + slope - exact.v2).abs() < 1e-11, "{s} {slope} {exact:?}");
            let [x, y, _] = part.force_slopes(s);
            assert!((part.modulus * x + part.second_modulus * y - force).abs() < 1e-15);
        }
    }

    /// Gradient and Hessian of an edge by hand are those of its energy by num-dual, in the plane and in space.
    #[test]
    fn edge_has_the_derivatives_of_dual_numbers() {
        for law in [StretchLaw::NeoHookean, StretchLaw::MooneyRivlin] {
            check_edge(law);
        }
    }

    fn check_edge(law: StretchLaw) {
        for q in [[0.0, 0.1, -0.2, 0.9, 0.4, 0.3], [0.2, 0.0, 0.0, 0.5, -0.3, 0.2]] {
            let (hand, dual) = (edge::<3>(law).tangent(&q), dual_tangent(&edge::<3>(law), &q));
            assert!((hand.energy - dual.energy).abs() < 1e-14);
            for r in 0..6 {
                assert!((hand.gradient[r] - dual.gradient[r]).abs() < 1e-13, "{hand:?} {dual:?}");
                for c in 0..6 {
                    let [hand, dual] = [&hand, &dual].map(|local| local.hessian[r][c]);
                    assert!((hand - dual).abs() < 1e-12, "{r} {c} {hand} {dual}");
                }
            }
            let plane = [q[0], q[1], q[3], q[4]];
            let (hand, dual) =
                (edge::<2>(law).tangent(&plane), dual_tangent(&edge::<2>(law), &plane));
            for r in 0..4 {
                for c in 0..4 {
                    let [hand, dual] = [&hand, &dual].map(|local| local.hessian[r][c]);
                    assert!((hand - dual).abs() < 1e-12, "{r} {c} {hand} {dual}");
                }
            }
        }
    }
}

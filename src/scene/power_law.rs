//! `loads.damping.power_law`: relaxation by a power law of time, as of many polymers, by a Prony series.
//!
//! A [`PowerLaw`] has relaxation times between `from` and `to`, s, each with a stiffness proportional to `time^-n` per
//! interval of the logarithm of time; `n` is the `exponent`. Their sum is `stiffness`, `g`, as a fraction of that of
//! the rod. Between `from` and `to` the modulus then relaxes by the power `-n` of time (Tschoegl 1989, section 4.1):
//!
//! ```text
//! E(t) = E (1 + g (Gamma(1 + n) t^-n - to^-n)/(from^-n - to^-n))        from << t << to
//! ```
//!
//! It is `E (1 + g)` for fast loads and E for slow ones. [`PowerLaw::branches`] returns Maxwell branches in geometric
//! progression of times over any scalar, two per decade. Near `from` and `to` they differ from the
//! continuous spectrum by up to 4 % of the relaxing stiffness; far from both the relaxing part is larger than that of
//! the formula by `(n h)^2/24` with the interval `h = ln(10)/2` (0.2 % at `n = 0.2`). Rejected are exponents outside
//! (0, 1], times that are not above zero and ascending, and ranges of more than twelve decades.

use crate::error::{Error, ensure};
use crate::numerics::scalar::Scalar;
use crate::scene::maxwell::Maxwell;
use crate::scene::number::Quantity;
use crate::scene::table::table;

/// Branches per decade of relaxation time.
const PER_DECADE: f64 = 2.0;

/// Largest ratio of the longest to the shortest time: 24 branches.
const LONGEST_RANGE: f64 = 1e12;

/// Largest number of branches: one more than [`LONGEST_RANGE`] has, for rounding.
const MOST_BRANCHES: f64 = 25.0;

table! {
    /// `loads.damping.power_law`: relaxation by a power law of time.
    #[derive(Copy)]
    pub struct PowerLaw {
        /// Stiffness that relaxes, as a fraction of that of the rod: the modulus of fast loads is `1 + stiffness` times
        /// that of slow ones.
        pub stiffness: D = Quantity::positive("").vanishing(),
        /// Exponent n of the relaxation `t^-n`, above 0, at most 1.
        pub exponent: D = Quantity::positive("").within(1e-3, 1.0),
        /// Shortest relaxation time, s.
        pub from: f64,
        /// Longest relaxation time, s.
        pub to: f64,
    }
}

impl<D: Scalar> PowerLaw<D> {
    /// The Maxwell branches of the law, in the order of their times, s. The sum of their stiffnesses is that of the
    /// law.
    ///
    /// ```
    /// use rodfit::scene::PowerLaw;
    /// let law = PowerLaw { stiffness: 0.3, exponent: 0.5, from: 1e-4, to: 1e4 }; // s
    /// let branches = law.branches();
    /// let left = |t: f64| branches.iter().map(|b| b.stiffness * (-t / b.time).exp()).sum::<f64>();
    /// // Gamma(1.5) is sqrt(pi)/2; from^-0.5 and to^-0.5 are 100 and 0.01.
    /// let exact = 0.3 * (0.886227 - 0.01) / (100.0 - 0.01); // after 1 s
    /// assert!((left(1.0) / exact - 1.0).abs() < 2e-2);
    /// ```
    pub fn branches(&self) -> Vec<Maxwell<D>> {
        let range = (self.to / self.from).ln();
        let count = (PER_DECADE * range / std::f64::consts::LN_10).ceil().clamp(1.0, MOST_BRANCHES);
        // The logarithm of the times over the shortest one, in the middle of equal intervals.
        let place = |k: usize| (k as f64 + 0.5) / count * range;
        let weight = |place: f64| (-self.exponent * place).exp();
        let places = (0..count as usize).map(place);
        let whole: D = places.clone().map(weight).sum();
        let branch = |place: f64| Maxwell {
            stiffness: self.stiffness * weight(place) / whole,
            time: D::from(self.from * place.exp()),
        };
        places.map(branch).collect()
    }
}

impl PowerLaw {
    /// Rejects an exponent outside (0, 1], and times that are not finite, above zero and ascending, or too far apart.
    pub(super) fn check(&self) -> Result<(), Error> {
        let Self { exponent, from, to, .. } = *self;
        let key = |name: &str| format!("loads.damping.power_law.{name}");
        let is_exponent = exponent > 0.0 && exponent <= 1.0;
        ensure(is_exponent, key("exponent"), exponent, "above 0, at most 1")?;
        let is_time = from.is_finite() && from > 0.0;
        ensure(is_time, key("from"), from, "a finite time above 0, s")?;
        let allowed = format!("above from = {from} s, at most {LONGEST_RANGE:e} times as long");
        ensure(to > from && to / from <= LONGEST_RANGE, key("to"), to, allowed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    /// Stiffness that is left of the branches after a time.
    fn relaxing_stiffness<D: Scalar>(law: &PowerLaw<D>, time: f64) -> D {
        law.branches().iter().map(|b| b.stiffness * (-b.time.recip() * time).exp()).sum()
    }

    /// The same of the continuous spectrum, by the midpoint rule in the logarithm of the relaxation time.
    fn exact(law: &PowerLaw, time: f64) -> f64 {
        const PARTS: usize = 100_000;
        let range = (law.to / law.from).ln();
        let (mut sum, mut whole) = (0.0, 0.0);
        for k in 0..PARTS {
            let relaxation = law.from * ((k as f64 + 0.5) / PARTS as f64 * range).exp();
            let weight = relaxation.powf(-law.exponent);
            (sum, whole) = (sum + weight * (-time / relaxation).exp(), whole + weight);
        }
        law.stiffness * sum / whole
    }

    #[test]
    fn series_relaxes_as_the_spectrum() {
        let mut worst = 0.0_f64;
        for exponent in [0.05, 0.2, 0.5, 0.9] {
            for to in [0.02, 1.0, 1e4] {
                let law = PowerLaw { stiffness: 0.4, exponent, from: 1e-3, to };
                for k in 0..=20 {
                    let time = 1e-3 * (to / 1e-3).powf(k as f64 / 20.0);
                    worst =
                        worst.max((relaxing_stiffness(&law, time) - exact(&law, time)).abs() / 0.4);
                }
            }
        }
        println!("{worst:.1e}");
        assert!(worst < 0.04, "{worst:e}");
    }

    /// Far from both ends of the spectrum the relaxation is the closed form with the gamma function. The sum of the
    /// branches is that of the spectrum, so that each of them is larger by `sinh(n h/2)/(n h/2)` than the rule of
    /// rectangles, which is exact there up to 1e-3.
    #[test]
    fn relaxation_is_a_power_of_time() {
        let h = std::f64::consts::LN_10 / PER_DECADE;
        for (exponent, gamma) in [(0.2, 0.918_168_742_399_760_6), (0.5, 0.886_226_925_452_758)] {
            let law = PowerLaw { stiffness: 0.4, exponent, from: 1e-6, to: 1e6 };
            let [from, to] = [1e-6_f64, 1e6].map(|t| t.powf(-exponent));
            let factor = (0.5 * exponent * h).sinh() / (0.5 * exponent * h);
            for time in [1e-4_f64, 1e-2, 1.0, 30.0] {
                let closed = 0.4 * (gamma * time.powf(-exponent) - to) / (from - to);
                let off = relaxing_stiffness(&law, time) / (closed * factor) - 1.0;
                println!("{exponent} {time}: {off:.1e}");
                assert!(off.abs() < 1e-3, "{exponent} {time}: {off:e}");
            }
        }
    }

    /// The derivative by the exponent is that of differences.
    #[test]
    fn derivative_by_the_exponent_is_exact() {
        let law = |exponent: f64| PowerLaw { stiffness: 0.4, exponent, from: 1e-3, to: 10.0 };
        let seeded = PowerLaw {
            stiffness: Dual64::from(0.4),
            exponent: Dual64::new(0.3, 1.0),
            from: 1e-3,
            to: 10.0,
        };
        let h = 1e-5;
        for time in [2e-3, 0.05, 3.0] {
            let slope = (relaxing_stiffness(&law(0.3 + h), time)
                - relaxing_stiffness(&law(0.3 - h), time))
                / (2.0 * h);
            let exact = relaxing_stiffness(&seeded, time).eps;
            assert!((slope - exact).abs() < 1e-9, "{time}: {slope} {exact}");
        }
    }
}

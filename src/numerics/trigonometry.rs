//! Sine and cosine by argument reduction and polynomials (FDLIBM), without branches, so that all SIMD lanes run the
//! same code.
//!
//! [`sin_and_cos`] takes an angle, rad, of any [`Scalar`] and returns `[sin, cos]` with an error up to 1.5 units in the
//! last place of 1. It subtracts the nearest multiple of a right angle, in two parts (Cody and Waite 1980), and
//! evaluates both polynomials at the rest, at most half a right angle. The number of right angles modulo 4 exchanges
//! the results and selects their signs. It is valid for absolute angles below [`LARGEST`]; NaN gives NaN. SIMD numbers
//! use it for such angles.

use crate::numerics::scalar::Scalar;
use std::f64::consts::FRAC_2_PI;

/// Bound of the angles, rad, that are reduced to full accuracy: fewer than 2^19 right angles, whose number times the
/// first term of [`RIGHT_ANGLE`] is exact.
pub const LARGEST: f64 = 8e5;

/// A right angle as a sum (Cody and Waite 1980). The first term has 20 zero bits at its end, so that its product with
/// the number of right angles is exact.
const RIGHT_ANGLE: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
/// Coefficients of the polynomial of `(sin r - r)/r^3` in `r^2` on [-pi/4, pi/4], highest power first (FDLIBM, Sun
/// Microsystems 1993).
const SIN: [f64; 6] = [
    1.589_690_995_211_55e-10,
    -2.505_076_025_340_686_3e-8,
    2.755_731_370_707_006_8e-6,
    -1.984_126_982_985_795e-4,
    8.333_333_333_322_49e-3,
    -1.666_666_666_666_663_2e-1,
];
/// Coefficients of the polynomial of `(cos r - 1 + r^2/2)/r^4` in `r^2` on [-pi/4, pi/4], highest power first (FDLIBM).
const COS: [f64; 6] = [
    -1.135_964_755_778_819_5e-11,
    2.087_572_321_298_175e-9,
    -2.755_731_435_139_066_3e-7,
    2.480_158_728_947_673e-5,
    -1.388_888_888_887_411e-3,
    4.166_666_666_666_66e-2,
];

/// The polynomial of fifth degree with these six coefficients, highest power first, at `x` (Horner).
#[inline(always)]
fn polynomial<D: Scalar>(coefficients: &[f64; 6], x: D) -> D {
    let [first, rest @ ..] = coefficients;
    let mut sum = x * *first + rest[0];
    for coefficient in &rest[1..] {
        sum = sum * x + *coefficient;
    }
    sum
}

/// `[sin x, cos x]` of an angle whose absolute value is below [`LARGEST`], rad, to an error of one and a half units in
/// the last place of 1. NaN for NaN. Number types with derivatives differentiate the polynomials.
#[inline(always)]
pub fn sin_and_cos<D: Scalar>(x: D) -> [D; 2] {
    let count = (x * FRAC_2_PI).nearest_whole();
    let r = x - count * RIGHT_ANGLE[0] - count * RIGHT_ANGLE[1];
    let z = r * r;
    // Polynomials of the reduced angle.
    let sin = r + r * z * polynomial(&SIN, z);
    let half = z * 0.5;
    // 1 - z/2 with its rounding error, which is added to the small terms.
    let leading = -half + 1.0;
    let cos = leading + ((-leading + 1.0 - half) + z * z * polynomial(&COS, z));
    // The quadrant: whether the count of right angles is odd exchanges sine and cosine, and the parity of half of it
    // changes signs.
    let pairs = (count * 0.5 - 0.25).nearest_whole();
    let odd = count - pairs * 2.0;
    let odd_pairs = pairs - (pairs * 0.5 - 0.25).nearest_whole() * 2.0;
    let sign = odd_pairs * -2.0 + 1.0;
    let half = odd.like(0.5);
    let first = odd.if_less(half, sin, cos);
    let second = odd.if_less(half, cos, sin);
    [first * sign, second * sign * (odd * -2.0 + 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sin_and_cos_agree_with_std_to_two_units_in_the_last_place() {
        let mut worst: f64 = 0.0;
        for k in -200_000..200_000_i32 {
            // From tiny angles to the largest, and multiples of right angles among them.
            let angles = [f64::from(k) * 1.234_567e-4, f64::from(k) * 3.9, f64::from(k) * 1e-12];
            for x in angles.into_iter().chain([f64::from(k % 1000) * FRAC_2_PI.recip()]) {
                let [sin, cos] = sin_and_cos(x);
                worst = worst.max((sin - x.sin()).abs()).max((cos - x.cos()).abs());
                let tiny = f64::EPSILON * x.sin().abs().max(1e-20);
                assert!(
                    (sin - x.sin()).abs() < 3.0 * tiny.max(1e-21),
                    "{x}: {sin:e} {:e}",
                    x.sin()
                );
            }
        }
        assert!(worst <= 1.5 * f64::EPSILON, "{worst:e}");
        let [sin, cos] = sin_and_cos(-0.0);
        assert!(sin == 0.0 && cos == 1.0);
        assert!(sin_and_cos(f64::NAN).iter().all(|x| x.is_nan()));
    }
}

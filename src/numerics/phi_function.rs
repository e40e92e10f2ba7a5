//! The function `phi_1(x) = (1 - e^-x)/x` of exponential integrators: the mean of a decay `e^(-x t)` over
//! `0 <= t <= 1`.
//!
//! [`phi1`] returns it for any real or dual number `x` of either sign; it is 1 at zero. Up to `|x| = 0.1` it is
//! computed by the Taylor series to the tenth order, because the quotient loses digits there. Derivatives by `x` follow
//! from the dual number.

use crate::numerics::scalar::Scalar;

/// `(1 - e^-x)/x` for any `x`; 1 at zero. Up to `|x|` of 0.1 the Taylor series to the tenth order replaces the
/// quotient, which loses digits.
pub fn phi1<D: Scalar>(x: D) -> D {
    if x.value().abs() > 0.1 {
        return (-(-x).exp() + 1.0) / x;
    }
    // The Taylor series `sum (-x)^k/(k + 1)!`; omitted terms are below 1e-17.
    (1..=10).rev().fold(D::from(1.0), |sum, k| -(sum * x) * (1.0 / f64::from(k + 1)) + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phi1_is_accurate_where_series_and_quotient_meet() {
        // The series is used below 0.1. Exact: (1 - e^-x)/x by expm1; its slope at zero is -1/2.
        for x in [1e-9, 0.09999, 0.10001, -0.1001, 2.0] {
            let exact = -f64::exp_m1(-x) / x;
            assert!((phi1(x) / exact - 1.0).abs() < 1e-14, "{x}");
        }
        assert_eq!(phi1(num_dual::Dual64::new(0.0, 1.0)).eps, -0.5);
    }
}

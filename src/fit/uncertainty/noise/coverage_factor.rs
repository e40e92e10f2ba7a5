//! Coverage factors of 95 % intervals: quantiles of the normal distribution, or of Student's t where the variance is
//! estimated.
//!
//! Input are the degrees of freedom of the variance; none stands for a known variance, and fewer than [`FEWEST`] count
//! as that. [`quantile95`] returns the half-width of a two-sided interval in standard deviations (1.96 or more),
//! [`one_sided95`] the distance of a one-sided limit (1.645 or more). From [`MANY`] degrees on the quantile of
//! Student's t is computed by an expansion about the normal one. Estimates, budgets and one-sided bounds use them.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Degrees of freedom from which on the quantile is that of the expansion about the normal one, accurate to 1e-9 there;
/// the iterative inverse may not converge for so many.
const MANY: f64 = 200.0;
/// Fewest degrees of freedom: an estimate of fewer counts as one.
const FEWEST: f64 = 1.0;

/// Half-width of a 95 % interval in standard deviations, for a variance with these degrees of freedom: the 97.5 %
/// quantile of Student's t, and 1.96 (normal) for a known variance (none).
pub(crate) fn quantile95(freedom: Option<f64>) -> f64 {
    quantile(0.975, freedom)
}

/// Distance of a one-sided 95 % limit in standard deviations, for a variance with these degrees of freedom: the 95 %
/// quantile of Student's t, and 1.645 (normal) for a known variance (none).
pub(crate) fn one_sided95(freedom: Option<f64>) -> f64 {
    quantile(0.95, freedom)
}

/// Quantile, at this probability, of the standard normal distribution (`freedom` none), or of Student's t with
/// `freedom` degrees of freedom, at least [`FEWEST`]. From [`MANY`] on it is the expansion about the normal one.
fn quantile(probability: f64, freedom: Option<f64>) -> f64 {
    let z = Normal::standard().inverse_cdf(probability);
    match freedom.map(|freedom| freedom.max(FEWEST)) {
        None => z,
        Some(n) if n >= MANY => expanded_quantile(z, n),
        Some(n) => StudentsT::new(0.0, 1.0, n).map_or(z, |t| t.inverse_cdf(probability)),
    }
}

/// Student's quantile for `n` degrees of freedom from the normal quantile `z` (Abramowitz and Stegun 1964, 26.7.5).
fn expanded_quantile(z: f64, n: f64) -> f64 {
    let w = z * z;
    let terms = [
        (w + 1.0) / 4.0,
        ((5.0 * w + 16.0) * w + 3.0) / 96.0,
        (((3.0 * w + 19.0) * w + 17.0) * w - 15.0) / 384.0,
    ];
    // Horner's scheme in 1/n.
    z * terms.iter().rev().fold(0.0, |sum, term| (sum + term) / n) + z
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Tables of the normal distribution and of Student's t with 10 degrees of freedom.
    #[test]
    fn quantiles_agree_with_tables() {
        assert_relative_eq!(quantile95(None), 1.959963984540054, max_relative = 1e-9);
        assert_relative_eq!(quantile95(Some(10.0)), 2.228138851964939, max_relative = 1e-9);
    }

    /// The expansion continues the iteration at 200 degrees of freedom, and both are finite for any number.
    #[test]
    fn quantiles_fall_to_the_normal_one_with_the_degrees_of_freedom() {
        for (probability, z) in [(0.975, 1.959963984540054), (0.95, 1.6448536269514722)] {
            let t = StudentsT::new(0.0, 1.0, 200.0).unwrap().inverse_cdf(probability);
            assert_relative_eq!(expanded_quantile(z, 200.0), t, max_relative = 1e-9);
            let mut before = f64::INFINITY;
            for k in 0..900 {
                let found = quantile(probability, Some(10.0_f64.powf(-1.0 + 0.01 * f64::from(k))));
                assert!(found.is_finite() && found <= before * (1.0 + 1e-9), "{k}: {found}");
                before = found;
            }
            assert_relative_eq!(before, z, max_relative = 1e-7);
        }
    }
}

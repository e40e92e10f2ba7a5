//! Where 95 % intervals end.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// How many standard deviations a 95 % interval reaches to each side: normal when the noise is
/// known, Student's t when it was estimated with `freedom` degrees of freedom.
pub(crate) fn quantile95(freedom: Option<f64>) -> f64 {
    quantile(0.975, freedom)
}

/// The same of one that is open to one side.
pub(crate) fn one_sided95(freedom: Option<f64>) -> f64 {
    quantile(0.95, freedom)
}

/// From so many degrees of freedom on Student's quantiles are those of its expansion about the normal
/// one, to 1e-9; the inverse that is iterated need not come to an end there.
const MANY: f64 = 200.0;
/// Fewer degrees of freedom than one say nothing that one does not.
const FEWEST: f64 = 1.0;

fn quantile(probability: f64, freedom: Option<f64>) -> f64 {
    let z = Normal::standard().inverse_cdf(probability);
    match freedom.map(|freedom| freedom.max(FEWEST)) {
        None => z,
        Some(n) if n >= MANY => about_normal(z, n),
        Some(n) => {
            StudentsT::new(0.0, 1.0, n).map_or(z, |student| student.inverse_cdf(probability))
        }
    }
}

/// Student's quantile by the normal one (Abramowitz and Stegun 1964, 26.7.5).
fn about_normal(z: f64, n: f64) -> f64 {
    let w = z * z;
    let terms = [
        (w + 1.0) / 4.0,
        ((5.0 * w + 16.0) * w + 3.0) / 96.0,
        (((3.0 * w + 19.0) * w + 17.0) * w - 15.0) / 384.0,
    ];
    z * terms.iter().rev().fold(0.0, |sum, term| (sum + term) / n) + z
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn quantiles() {
        assert_relative_eq!(quantile95(None), 1.959963984540054, max_relative = 1e-9);
        assert_relative_eq!(quantile95(Some(10.0)), 2.228138851964939, max_relative = 1e-9);
    }

    /// The expansion goes on where the iteration ends, and both come to an end everywhere.
    #[test]
    fn quantiles_of_any_freedom() {
        for (probability, z) in [(0.975, 1.959963984540054), (0.95, 1.6448536269514722)] {
            let t = StudentsT::new(0.0, 1.0, 200.0).unwrap().inverse_cdf(probability);
            assert_relative_eq!(about_normal(z, 200.0), t, max_relative = 1e-9);
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

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

fn quantile(probability: f64, freedom: Option<f64>) -> f64 {
    let normal = || Normal::standard().inverse_cdf(probability);
    match freedom {
        None => normal(),
        Some(freedom) => StudentsT::new(0.0, 1.0, freedom)
            .map_or_else(|_| normal(), |t| t.inverse_cdf(probability)),
    }
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
}

//! The smooth prior of values along a rod: a Gaussian field about the values of the scene.
//!
//! Input: the number of values, their standard deviation in their unit, and the correlation length `l` in spacings of
//! the values. With independent normal numbers `z` of variance one,
//!
//! ```text
//! x = x_scene + c A^-1 z,    A = 1 - l^2 d^2/ds^2
//! ```
//!
//! with zero slope at the ends, solved on equal spacings as a tridiagonal system. The prior penalizes second
//! differences, and deviations from the scene. Its covariance is that of Matern with a smoothness of 3/2 (Lindgren, Rue
//! and Lindstrom 2011). The factor `c` normalizes the standard deviation in the middle of the rod; at the ends it is up
//! to 1.5 times as large. [`SmoothPrior::multiply`] multiplies a vector by `c A^-1` in place, without the mean, for the
//! search. [`SmoothPrior::deviation`] returns the standard deviation of each value, in its unit, for the report.

/// Smooth prior of values at equal spacings along a rod.
#[derive(Clone, Debug)]
pub struct SmoothPrior {
    /// `(l/spacing)^2`.
    stiffness: f64,
    /// `c`, in the unit of the values.
    factor: f64,
    /// Number of values.
    count: usize,
}

impl SmoothPrior {
    /// The prior of `count` values, at least one, with the standard deviation `sigma`, in their unit, of the value with
    /// the index `count/2` (middle of the rod). `spacings` is the correlation length `l` over the distance of
    /// neighboring values, at least 0; with 0 the values are independent.
    pub fn new(count: usize, sigma: f64, spacings: f64) -> Self {
        let mut prior = Self { stiffness: spacings * spacings, factor: 1.0, count };
        // The stated deviation is that of the middle: towards the ends the field has fewer neighbors and varies more.
        prior.factor = sigma / prior.deviation(count / 2);
        prior
    }

    /// The standard deviation of value `k` (from 0), in its unit: the norm of row `k` of `c A^-1`.
    pub fn deviation(&self, k: usize) -> f64 {
        let mut row = vec![0.0; self.count];
        row[k] = 1.0;
        self.multiply(&mut row);
        row.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// Replaces `z`, one number per value, by `c A^-1 z`, where `c A^-1` is the symmetric root of the covariance:
    /// independent numbers become deviations from the scene, in their unit. With `k = (l/spacing)^2`, the tridiagonal
    /// matrix `A` has `1 + 2 k` (`1 + k` at both ends, 1 for a single value) on its diagonal and `-k` beside it.
    pub fn multiply(&self, z: &mut [f64]) {
        let (n, k) = (z.len(), self.stiffness);
        // Gaussian elimination of the tridiagonal matrix with 1 + k or 1 + 2 k on its diagonal and -k beside it.
        let diagonal =
            |i: usize| 1.0 + k * (f64::from(u8::from(i > 0)) + f64::from(u8::from(i + 1 < n)));
        let mut pivots = vec![0.0; n];
        for i in 0..n {
            pivots[i] = diagonal(i);
            if i > 0 {
                let factor = k / pivots[i - 1];
                pivots[i] -= k * factor;
                z[i] += factor * z[i - 1];
            }
        }
        // Back substitution.
        for i in (0..n).rev() {
            let after = if i + 1 < n { k * z[i + 1] } else { 0.0 };
            z[i] = (z[i] + after) / pivots[i];
        }
        z.iter_mut().for_each(|x| *x *= self.factor);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The standard deviation is 0.3 in the middle, and up to 1.5 times that at the ends, which have zero slope.
    #[test]
    fn prior_deviation_is_sigma_in_the_middle() {
        for spacings in [0.0, 0.4, 5.0, 20.0] {
            let prior = SmoothPrior::new(200, 0.3, spacings);
            let deviations: Vec<f64> = (0..200).map(|k| prior.deviation(k)).collect();
            assert!((deviations[100] - 0.3).abs() < 1e-12);
            assert!(
                deviations.iter().all(|d| (0.2999..0.45).contains(d)),
                "{spacings}: {deviations:?}"
            );
        }
    }

    /// The Matern covariance of smoothness 3/2 is `(1 + d) e^-d` at a distance of `d` lengths.
    #[test]
    fn prior_correlation_is_that_of_matern() {
        let prior = SmoothPrior::new(200, 1.0, 10.0);
        let column = |k: usize| {
            let mut z = vec![0.0; 200];
            z[k] = 1.0;
            prior.multiply(&mut z);
            z
        };
        let correlation = |a: usize, b: usize| -> f64 {
            let (a, b) = (column(a), column(b));
            a.iter().zip(&b).map(|(a, b)| a * b).sum()
        };
        for (apart, d) in [(1, 0.1_f64), (10, 1.0), (30, 3.0)] {
            let expected = (1.0 + d) * (-d).exp();
            let found = correlation(90, 90 + apart);
            assert!((found - expected).abs() < 0.02, "{apart}: {found} for {expected}");
        }
    }
}

//! First-order autocorrelated (AR(1)) noise on unevenly spaced samples.
//!
//! An autoregressive process of first order in continuous time (an Ornstein-Uhlenbeck process): values `dt` apart have
//! the correlation `correlation^(dt/spacing)`; a negative correlation counts as 0. So gaps and uneven sampling need no
//! special treatment. Neighbors have a correlation of at most [`MAX_FACTOR`]. The correlation matrix `R` and the root
//! of its inverse are products of bidiagonal matrices: products with a vector take one or two passes over the values.
//! Input: ascending times, their usual spacing (the median one, [`usual_spacing`]), and the correlation at it.
//! [`Ar1Correlation`] applies `R` (`apply`), makes white innovations of correlated noise (`whiten`) and the reverse
//! (`color`), both with the same standard deviation. It also returns the `effective_sample_size`, the number of
//! independent values whose mean has the same variance. [`ar1_factor`] is the correlation of two values.

use crate::numerics::upper_median;

/// Largest correlation of two consecutive values. Two values at the same time would have 1, and innovations are divided
/// by the root of one less its square.
const MAX_FACTOR: f64 = 0.9999;

/// Correlation of a series: the correlation of every value with the one before, at least 0; 0 for the first.
#[derive(Clone, Debug)]
pub(crate) struct Ar1Correlation(Vec<f64>);

impl Ar1Correlation {
    /// The correlation of values at ascending `times`, s: each has `correlation^(dt/spacing)` with the one before, `dt`
    /// earlier, at most [`MAX_FACTOR`]. Values one `spacing`, s, apart have the `correlation`; a negative one counts as
    /// 0.
    pub fn new(times: &[f64], spacing: f64, correlation: f64) -> Self {
        let factor = |pair: &[f64]| ar1_factor(correlation, (pair[1] - pair[0]) / spacing);
        let after = times.windows(2).map(factor);
        Self(std::iter::once(0.0).take(times.len()).chain(after).collect())
    }

    /// The product `R values` of the correlation matrix `R` with `values`, one per value of the series. A forward pass
    /// sums correlations with earlier values, a backward pass those with later ones. `R_ij` is the product of the
    /// correlations of neighbors between `i` and `j`, 1 for `i = j`.
    pub fn apply(&self, values: &[f64]) -> Vec<f64> {
        // R_ij is a product over the steps between i and j, so that one recursion has all earlier values.
        let mut sums = values.to_vec();
        for k in 1..sums.len() {
            sums[k] += self.0[k] * sums[k - 1];
        }
        // The backward pass adds the correlations with later values.
        let mut after = 0.0;
        for k in (0..sums.len()).rev() {
            sums[k] += after;
            after = self.0[k] * (after + values[k]);
        }
        sums
    }

    /// The product `R^(-1/2) values`: innovations, by which correlated noise becomes white noise of the same standard
    /// deviation. The first value stays; value `k` becomes `(v_k - c_k v_(k-1))/sqrt(1 - c_k^2)`. At least one value.
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        // The process is Markov: given the value before, a value does not depend on earlier ones.
        let new = |k: usize| match k {
            0 => values[0],
            _ => (values[k] - self.0[k] * values[k - 1]) / (1.0 - self.0[k].powi(2)).sqrt(),
        };
        (0..values.len()).map(new).collect()
    }

    /// Correlated noise from independent `white` values of the same standard deviation: the inverse of
    /// [`whiten`](Self::whiten), `v_k = c_k v_(k-1) + sqrt(1 - c_k^2) white_k`, with one value per value of the series.
    pub fn color(&self, white: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut last = 0.0;
        let next = |(new, kept): (f64, &f64)| {
            last = kept * last + (1.0 - kept * kept).sqrt() * new;
            last
        };
        white.zip(&self.0).map(next).collect()
    }

    /// Number of independent values whose mean has the same variance as that of these: `n^2` over the sum of all
    /// entries of `R`.
    pub fn effective_sample_size(&self) -> f64 {
        let n = self.0.len();
        (n * n) as f64 / self.apply(&vec![1.0; n]).iter().sum::<f64>()
    }
}

/// Correlation of two values that are this many usual spacings apart: `correlation^|spacings|`, at most [`MAX_FACTOR`];
/// 0 for a `correlation` that is not positive. `correlation` is that of values one usual spacing apart.
pub(crate) fn ar1_factor(correlation: f64, spacings: f64) -> f64 {
    match correlation > 0.0 {
        true => correlation.powf(spacings.abs()).min(MAX_FACTOR),
        false => 0.0,
    }
}

/// The median (the upper one of an even number) distance between consecutive ascending `times`, in their unit; `None`
/// for fewer than two times or a median of zero.
pub(crate) fn usual_spacing(times: &[f64]) -> Option<f64> {
    upper_median(times.windows(2).map(|pair| pair[1] - pair[0])).filter(|spacing| *spacing > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::DMatrix;

    /// The dense matrix `R_ij = 0.8^|t_i - t_j|` as the reference, with gaps between the times.
    #[test]
    fn ar1_passes_equal_products_with_dense_correlation_matrix() {
        let times = [0.0, 1.0, 2.0, 2.5, 6.0, 7.0];
        let correlation = Ar1Correlation::new(&times, 1.0, 0.8);
        let r = DMatrix::from_fn(6, 6, |a, b| 0.8_f64.powf((times[a] - times[b]).abs()));
        let values = [1.0, -2.0, 0.5, 3.0, 0.1, -1.0];
        let v = DMatrix::from_column_slice(6, 1, &values);
        for (a, b) in correlation.apply(&values).iter().zip((&r * &v).iter()) {
            assert_relative_eq!(a, b, max_relative = 1e-12);
        }
        let innovations = correlation.whiten(&values);
        let expected = (v.transpose() * r.clone().try_inverse().unwrap() * &v)[(0, 0)];
        assert_relative_eq!(
            innovations.iter().map(|e| e * e).sum::<f64>(),
            expected,
            max_relative = 1e-12
        );
        assert_relative_eq!(
            correlation.effective_sample_size(),
            36.0 / r.sum(),
            max_relative = 1e-12
        );
        for (a, b) in correlation.color(innovations.iter().copied()).iter().zip(values) {
            assert_relative_eq!(*a, b, max_relative = 1e-12);
        }
        assert_eq!(Ar1Correlation::new(&times, 1.0, 0.0).whiten(&values), values);
        assert_eq!(Ar1Correlation::new(&times, 1.0, 0.0).effective_sample_size(), 6.0);
    }

    /// The median ignores one gap of seven spacings.
    #[test]
    fn usual_spacing_of_times_with_gap_is_median_distance() {
        assert_eq!(usual_spacing(&[0.0, 1.0, 2.0, 9.0]), Some(1.0));
        assert_eq!(usual_spacing(&[1.0]), None);
        assert_eq!(usual_spacing(&[1.0, 1.0]), None);
    }
}

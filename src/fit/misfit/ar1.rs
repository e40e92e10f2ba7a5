//! First-order autocorrelated (AR(1)) noise on unevenly spaced samples.
//!
//! An autoregressive process of first order in continuous time: values `dt` apart correlate by
//! `correlation^(dt/spacing)`, so gaps and uneven sampling need nothing of their own. Its correlation matrix
//! `R` and the root of its inverse are products of bidiagonal ones, and take one pass over the values.

/// Of two values at the same time one says nothing new; some of it is left, to divide by.
const MOST: f64 = 0.9999;

/// Correlation of a series: the lag-one factor of every value.
#[derive(Clone, Debug)]
pub(crate) struct Ar1Correlation(Vec<f64>);

impl Ar1Correlation {
    /// Of values at ascending `times`, where neighbours at the usual `spacing` correlate by `correlation`,
    /// 0 or more.
    pub fn new(times: &[f64], spacing: f64, correlation: f64) -> Self {
        let factor = |pair: &[f64]| ar1_factor(correlation, (pair[1] - pair[0]) / spacing);
        let after = times.windows(2).map(factor);
        Self(std::iter::once(0.0).take(times.len()).chain(after).collect())
    }

    /// `R values`.
    pub fn apply(&self, values: &[f64]) -> Vec<f64> {
        let mut sums = values.to_vec();
        for k in 1..sums.len() {
            sums[k] += self.0[k] * sums[k - 1];
        }
        let mut after = 0.0;
        for k in (0..sums.len()).rev() {
            sums[k] += after;
            after = self.0[k] * (after + values[k]);
        }
        sums
    }

    /// `R^(-1/2) values`: innovations, by which correlated noise becomes white noise of the same size.
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        let new = |k: usize| match k {
            0 => values[0],
            _ => (values[k] - self.0[k] * values[k - 1]) / (1.0 - self.0[k].powi(2)).sqrt(),
        };
        (0..values.len()).map(new).collect()
    }

    /// Correlated noise of the same size from white noise.
    pub fn color(&self, white: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut last = 0.0;
        let next = |(new, kept): (f64, &f64)| {
            last = kept * last + (1.0 - kept * kept).sqrt() * new;
            last
        };
        white.zip(&self.0).map(next).collect()
    }

    /// Number of independent values with as much information on a mean.
    pub fn effective_sample_size(&self) -> f64 {
        let n = self.0.len();
        (n * n) as f64 / self.apply(&vec![1.0; n]).iter().sum::<f64>()
    }
}

/// Correlation over so many usual spacings.
pub(crate) fn ar1_factor(correlation: f64, spacings: f64) -> f64 {
    match correlation > 0.0 {
        true => correlation.powf(spacings.abs()).min(MOST),
        false => 0.0,
    }
}

/// The median distance of neighbours; none where there are not two places.
pub(crate) fn usual_spacing(times: &[f64]) -> Option<f64> {
    let mut distances: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    distances.sort_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().filter(|spacing| *spacing > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::DMatrix;

    /// Against the matrices themselves, with gaps.
    #[test]
    fn passes_are_products_with_the_correlation_matrix() {
        let times = [0.0, 1.0, 2.0, 2.5, 6.0, 7.0];
        let correlation = Ar1Correlation::new(&times, 1.0, 0.8);
        let r = DMatrix::from_fn(6, 6, |a, b| 0.8_f64.powf((times[a] - times[b]).abs()));
        let values = [1.0, -2.0, 0.5, 3.0, 0.1, -1.0];
        let v = DMatrix::from_column_slice(6, 1, &values);
        for (a, b) in correlation.apply(&values).iter().zip((&r * &v).iter()) {
            assert_relative_eq!(a, b, max_relative = 1e-12);
        }
        let news = correlation.whiten(&values);
        let expected = (v.transpose() * r.clone().try_inverse().unwrap() * &v)[(0, 0)];
        assert_relative_eq!(
            news.iter().map(|e| e * e).sum::<f64>(),
            expected,
            max_relative = 1e-12
        );
        assert_relative_eq!(
            correlation.effective_sample_size(),
            36.0 / r.sum(),
            max_relative = 1e-12
        );
        for (a, b) in correlation.color(news.iter().copied()).iter().zip(values) {
            assert_relative_eq!(*a, b, max_relative = 1e-12);
        }
        assert_eq!(Ar1Correlation::new(&times, 1.0, 0.0).whiten(&values), values);
        assert_eq!(Ar1Correlation::new(&times, 1.0, 0.0).effective_sample_size(), 6.0);
    }

    #[test]
    fn the_usual_spacing_minds_no_gap() {
        assert_eq!(usual_spacing(&[0.0, 1.0, 2.0, 9.0]), Some(1.0));
        assert_eq!(usual_spacing(&[1.0]), None);
        assert_eq!(usual_spacing(&[1.0, 1.0]), None);
    }
}

//! Errors of weights that are estimated: several measurements, some without a stated sigma.
//!
//! A measurement without a sigma has the weight `1/s^2`, with its sigma `s` estimated from residuals with `nu` degrees
//! of freedom. Weights with errors make the estimates less accurate than known ones, and the normal matrix looks larger
//! than it is. With the information `N = J'J` of each such measurement and the covariance `C` of the unknowns with
//! known weights, the covariance is about
//!
//! ```text
//! C + sum over measurements of (4/nu) C (N - N C N) C
//! ```
//!
//! (Kenward and Roger, Biometrics 53, 1997, for independent variances; for a weighted mean it is that of Meier,
//! Biometrics 9, 1953). The sum is zero for a single measurement, as a common factor of all weights changes nothing.
//! [`information_with_estimated_weights`] is the list of these matrices, and [`weight_errors`] the sum without the
//! outer factors `C`, a part of the covariance of the gradient. The noise model uses both.

use crate::fit::misfit::initial_sigmas::weights_depend_on_the_fit;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use nalgebra::DMatrix;

/// Information of a measurement whose sigma is estimated.
pub(crate) struct EstimatedInformation {
    /// Index of the measurement among all.
    pub measurement: usize,
    /// `J'J` of its rows, in units of sigma.
    pub normal: DMatrix<f64>,
    /// Degrees of freedom of its estimated variance, at least 1.
    pub degrees_of_freedom: f64,
}

/// The information of every measurement without a stated sigma, from the weighted `rows` of the Jacobian at an optimum.
/// Empty where no weight depends on estimated sigmas, as in a fit of one measurement.
pub(crate) fn information_with_estimated_weights(
    fitted: Fitted,
    rows: &[Vec<f64>],
) -> Vec<EstimatedInformation> {
    let Fitted { search, optimum } = fitted;
    if !weights_depend_on_the_fit(search.experiments, search.unknowns) {
        return Vec::new();
    }
    let n = search.unknowns.len();
    // The unknowns use up degrees of freedom of all measurements in proportion to their values.
    let used = n as f64 / optimum.residuals.len() as f64;
    let without_sigma = fitted.measured().filter(|own| own.measurement.sigma().is_none());
    let information = |own: MeasuredResiduals| {
        let first = own.rows.start;
        let jacobian = DMatrix::from_fn(own.rows.len(), n, |a, j| rows[first + a][j]);
        // A value with the weight w of growing sensitivities counts as w^2 values.
        let values: f64 = own.rows.clone().map(|row| search.growth_weight(row).powi(2)).sum();
        let free = values * own.measurement.free_share() * (1.0 - used);
        EstimatedInformation {
            measurement: own.index,
            normal: jacobian.tr_mul(&jacobian),
            degrees_of_freedom: free.max(1.0),
        }
    };
    without_sigma.map(information).collect()
}

/// Covariance of the gradient by errors of estimated weights, `sum (4/nu) (N - N C N)` over the measurements, with the
/// covariance `inverse` of the unknowns for known weights. Zero for an empty list.
pub(crate) fn weight_errors(
    information: &[EstimatedInformation],
    inverse: &DMatrix<f64>,
) -> DMatrix<f64> {
    let zero = DMatrix::zeros(inverse.nrows(), inverse.ncols());
    information.iter().fold(zero, |sum, EstimatedInformation { normal, degrees_of_freedom, .. }| {
        sum + 4.0 / degrees_of_freedom * (normal - normal * inverse * normal)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The variance of a weighted mean of two groups with the weights 1 and 3 is `1/4 (1 + 4 (1/4) (3/4) (1/5 + 1/9))`
    /// for 5 and 9 degrees of freedom (Meier). One group alone has no such error.
    #[test]
    fn weight_errors_of_a_mean_are_those_of_meier() {
        let group = |weight: f64, degrees_of_freedom: f64| EstimatedInformation {
            measurement: 0,
            normal: DMatrix::from_element(1, 1, weight),
            degrees_of_freedom,
        };
        let inverse = DMatrix::from_element(1, 1, 0.25);
        let errors = weight_errors(&[group(1.0, 5.0), group(3.0, 9.0)], &inverse);
        let variance = 0.25 + 0.25 * errors[(0, 0)] * 0.25;
        let expected = 0.25 * (1.0 + 4.0 * 0.25 * 0.75 * (1.0 / 5.0 + 1.0 / 9.0));
        assert_relative_eq!(variance, expected, max_relative = 1e-12);
        assert_eq!(weight_errors(&[group(4.0, 5.0)], &inverse)[(0, 0)], 0.0);
    }
}

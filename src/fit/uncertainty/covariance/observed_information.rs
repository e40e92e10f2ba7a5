//! Observed information: standard errors from the exact Hessian `H` of the misfit, on request, beside the
//! Gauss-Newton ones.
//!
//! The Hessian, by the unknowns on their scales, contains the second derivatives of the simulation. The covariance is
//! `v H^-1` for white noise of the variance `v`. With noise of other correlations or variances, or weights of rows
//! (robust losses, leverage), it is `H^-1 M H^-1`, with the covariance `M` of the gradient of the misfit. Unknowns with
//! a one-sided bound count as exact: their rows and columns of `H` and `M` are left out. [`std_errors`] returns a
//! standard error per estimate, in its unit, none for those with a one-sided bound or without a value. If the remaining
//! `H` is not positive definite, the optimum is no isolated minimum: a warning makes the fit unusable. A failed
//! simulation is a note. In both cases all standard errors are none.

use crate::code::Code;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::noise::residual_noise::score_covariance;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use nalgebra::DMatrix;

/// Standard errors of the `estimates`, one each, in their units, from the Hessian of the misfit at the optimum. None
/// for estimates without a value, and for those with a one-sided bound: their logarithm has no standard deviation, and
/// their rows of the Hessian are left out. If the simulation of the Hessian fails, all are none, and a note is added.
/// If the rest of the Hessian is not positive definite, all are none, with a warning of the severity `Worthless`.
pub(crate) fn std_errors(
    fitted: Fitted,
    LocalAnalysis { noise, correlations, .. }: &LocalAnalysis,
    estimates: &[Estimate],
    warnings: &mut Warnings,
) -> Vec<Option<f64>> {
    let Fitted { search, optimum } = fitted;
    let mut errors = vec![None; estimates.len()];
    let hessian = match search.all_residuals().and_then(|r| r.hessian_at(&optimum.x)) {
        Ok(hessian) => hessian,
        Err(error) => {
            let text = format!(
                "the observed information is missing: its simulation failed ({error}). Standard \
                                 errors are those of the Gauss-Newton approximation"
            );
            warnings.add(Severity::Note, Code::NoHessian, text);
            return errors;
        }
    };
    let n = estimates.len();
    // A parameter that may be zero, or infinite, has no standard deviation of its logarithm.
    let is_one_sided = |e: &Estimate| e.upper95.is_some() || e.lower95.is_some();
    let own: Vec<usize> = (0..n).filter(|i| !is_one_sided(&estimates[*i])).collect();
    let select = |m: &DMatrix<f64>| m.select_rows(&own).select_columns(&own);
    // The decomposition exists for positive definite matrices only.
    let Some(factors) = select(&DMatrix::from_fn(n, n, |i, j| hessian[i][j])).cholesky() else {
        let text = "the Hessian of the misfit is not positive definite: the optimum is no isolated minimum. The \
                     intervals are meaningless. Fit fewer parameters, or give bounds";
        warnings.add(Severity::Worthless, Code::NotAMinimum, text);
        return errors;
    };
    let inverse = factors.inverse();
    let is_robust = noise.weights.iter().any(|w| *w != 1.0);
    let covariance = match &correlations.score_covariance {
        Some(scores) => noise.variance * &inverse * select(scores) * &inverse,
        None if is_robust => &inverse * select(&score_covariance(fitted)) * &inverse,
        // Under squares the covariance of the gradient is the variance times the Hessian.
        None => noise.variance * inverse,
    };
    for (place, i) in own.into_iter().enumerate() {
        let sd = covariance[(place, place)].sqrt();
        errors[i] = estimates[i].value.map(|value| sd * search.unknowns[i].slope(value));
    }
    errors
}

//! Observed information: standard errors from the exact Hessian of the misfit.

use crate::code::Code;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::{Severity, Warnings};
use crate::fit::uncertainty::noise::residual_noise::score_covariance;
use nalgebra::DMatrix;

/// Standard errors of the `estimates` from the Hessian at the optimum; none where it gives none.
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
            let words = format!(
                "the observed information is missing: its simulation failed ({error}). Standard \
                                 errors are those of the Gauss-Newton approximation"
            );
            warnings.add(Severity::Note, Code::NoHessian, words);
            return errors;
        }
    };
    let n = estimates.len();
    // Of what may be zero there is no logarithm to speak of.
    let known: Vec<usize> = (0..n).filter(|i| estimates[*i].upper95.is_none()).collect();
    let among = |m: &DMatrix<f64>| m.select_rows(&known).select_columns(&known);
    let hessian = among(&DMatrix::from_fn(n, n, |i, j| hessian[i][j]));
    let Some(factors) = hessian.cholesky() else {
        let words = "the Hessian of the misfit is not positive definite: the optimum is no isolated minimum. The \
                     intervals are meaningless. Fit fewer parameters, or give bounds";
        warnings.add(Severity::Worthless, Code::NotAMinimum, words);
        return errors;
    };
    let inverse = factors.inverse();
    // The gradient scatters with psi^2; under squares that is the variance times the Hessian.
    let robust = noise.weights.iter().any(|w| *w != 1.0);
    let covariance = match (robust, &correlations.scatter) {
        (_, Some(scatter)) => noise.variance * &inverse * among(scatter) * &inverse,
        (false, None) => noise.variance * inverse,
        (true, None) => {
            let scatter = among(&score_covariance(fitted));
            &inverse * scatter * &inverse
        }
    };
    for (place, i) in known.into_iter().enumerate() {
        let sd = covariance[(place, place)].sqrt();
        errors[i] = estimates[i].value.map(|value| sd * search.unknowns[i].slope(value));
    }
    errors
}

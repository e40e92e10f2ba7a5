//! Effect of the errors of known inputs on a fit that takes them for exact: on the estimates, and on the residuals.
//!
//! An error `dk` of an input leaves `u dk` in the residuals, `u` being the part of `dr/dk` that the unknowns cannot
//! follow. The columns of `U` are these `u` for one standard uncertainty of each known input. `R` are the correlations
//! of their errors, in units of their standard uncertainties, and `v` is the variance of the noise. The most probable
//! errors, in standard uncertainties, for weighted residuals `r`, are
//!
//! ```text
//! dk = -(U'U/v + R^-1)^-1 U'r/v
//! ```
//!
//! The estimates do not change, as `U` is orthogonal to the Jacobian. [`InputErrors::without_explained`] returns the
//! optimum with the residuals without these errors, for tests. If one is above [`IMPROBABLE`] standard uncertainties it
//! adds a warning of a misfit instead, and returns `None`. It also returns `None` without known inputs, or for
//! residuals of rounding errors. [`InputErrors::variance`] is the variance of each unknown by the inputs, on its scale
//! (logarithm of a positive parameter), a part of its budget. `responses_of` are its changes by one standard
//! uncertainty of each input. Contradictory correlations are an error.

use crate::code::Code;
use crate::error::Error;
use crate::fit::known::{Known, correlations};
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::budget::input_changes::InputChange;
use crate::fit::uncertainty::budget::input_sensitivities::InputSensitivities;
use crate::fit::uncertainty::noise::residual_noise::{ResidualNoise, weighted_residuals};
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use nalgebra::{DMatrix, DVector};

/// Rounds in which the variance of the noise and the errors of the inputs are computed from each other. More rounds
/// change the result less.
const ROUNDS: usize = 10;
/// Most probable error of an input, in standard uncertainties, above which it is no chance: it is then a warning.
const IMPROBABLE: f64 = 4.0;

/// Known inputs, and the responses of the fit to their errors.
#[derive(Default)]
pub(crate) struct InputErrors<'a> {
    /// The known inputs.
    pub knowns: &'a [Known],
    /// Value of every known input, if all its experiments have the same one.
    pub values: Vec<Option<f64>>,
    /// Correlation matrix of their errors.
    pub correlations: DMatrix<f64>,
    /// Responses of every unknown, on its scale, to one standard uncertainty of every known input.
    responses: Vec<Vec<Option<f64>>>,
    /// Change of the weighted residuals by one standard uncertainty of each, orthogonal to the Jacobian.
    orthogonal: DMatrix<f64>,
}

impl<'a> InputErrors<'a> {
    /// Known inputs with the responses to them, from the `sensitivities` that were computed for the same inputs. Error:
    /// stated correlations that contradict each other.
    pub fn new(knowns: &'a [Known], sensitivities: &InputSensitivities) -> Result<Self, Error> {
        let count = knowns.len();
        Ok(Self {
            knowns,
            values: sensitivities.known.iter().map(InputChange::value).collect(),
            correlations: correlations(knowns)?,
            responses: sensitivities.responses[..count].to_vec(),
            orthogonal: sensitivities.orthogonal.columns(0, count).into_owned(),
        })
    }

    /// Changes of unknown `j`, on its scale (logarithm of a positive parameter), by one standard uncertainty of each
    /// known input; 0 where the unknown does not respond.
    pub fn responses_of(&self, j: usize) -> DVector<f64> {
        let own = self.responses.iter().map(|responses| responses[j].unwrap_or(0.0));
        DVector::from_iterator(self.knowns.len(), own)
    }

    /// Variance `c'Rc` of unknown `j`, on its scale (logarithm of a positive parameter), by the errors of all known
    /// inputs. Here `c` are the changes by one standard uncertainty of each, and `R` their correlations; at least 0.
    pub fn variance(&self, j: usize) -> f64 {
        let own = self.responses_of(j);
        own.dot(&(&self.correlations * &own)).max(0.0)
    }

    /// Most probable errors of the known inputs, in standard uncertainties, for weighted `residuals`, by the equation
    /// of the module. Where the variance of the noise is estimated, it is that of the residuals without these errors,
    /// and both are computed alternately for [`ROUNDS`]. A singular system ends the rounds with the last errors, at
    /// first zeros.
    fn probable_errors(&self, residuals: &DVector<f64>, noise: &ResidualNoise) -> DVector<f64> {
        let k = self.knowns.len();
        let square = self.orthogonal.tr_mul(&self.orthogonal);
        let product = self.orthogonal.tr_mul(residuals);
        // The variance of the noise is that of the residuals without the explained part, which depends on the variance.
        let mut errors = DVector::zeros(k);
        let mut variance = noise.variance;
        for _ in 0..ROUNDS {
            // R (A R + 1)^-1 is (A + R^-1)^-1 where R has an inverse, and is defined where it has none.
            let system = &square * &self.correlations / variance + DMatrix::identity(k, k);
            let Some(solved) = system.lu().solve(&(&product / -variance)) else { break };
            errors = &self.correlations * solved;
            let freedom = noise.degrees_of_freedom.filter(|_| noise.is_estimated);
            // A stated variance does not depend on the errors: one round is exact.
            let Some(freedom) = freedom else { break };
            variance = (residuals + &self.orthogonal * &errors).norm_squared() / freedom;
        }
        errors
    }

    /// The optimum with the residuals that remain without the most probable errors of the known inputs; its unknowns
    /// and cost do not change. `None` without known inputs, without a positive finite variance of the noise, or where
    /// the residuals are rounding errors. If the largest error exceeds [`IMPROBABLE`], a warning of a misfit is added,
    /// and the result is `None` too.
    pub fn without_explained(
        &self,
        fitted: Fitted,
        noise: &ResidualNoise,
        warnings: &mut Warnings,
    ) -> Option<Optimum> {
        let Fitted { search, optimum } = fitted;
        if self.knowns.is_empty() || search.is_rounding(optimum) || !noise.variance.is_normal() {
            return None;
        }
        let errors = self.probable_errors(&weighted_residuals(fitted, noise), noise);
        // A contradicted input would hide a missing effect in its error.
        let largest = errors.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        if let Some((i, error)) = largest.filter(|(_, error)| error.abs() > IMPROBABLE) {
            let known = &self.knowns[i];
            let text = format!(
                "the data contradict the stated {} by {:.1} standard uncertainties ({:+.1e} {}). Its value is \
                 wrong, or the model lacks a similar effect. Measure it again",
                known.label(),
                error.abs(),
                error * known.sigma,
                known.parameter.unit()
            );
            warnings.add(Severity::Misfit, Code::InconsistentInput, text);
            return None;
        }
        let mut optimum = optimum.clone();
        add_unweighted(&mut optimum.residuals, &(&self.orthogonal * errors), &noise.weights);
        Some(optimum)
    }
}

/// Adds to each residual its weighted `change` over its weight. Rows of weight zero have no unweighted change, and stay
/// as they are.
fn add_unweighted(residuals: &mut [f64], change: &DVector<f64>, weights: &[f64]) {
    for ((residual, change), weight) in residuals.iter_mut().zip(change).zip(weights) {
        if *weight > 0.0 {
            *residual += change / weight;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::add_unweighted;
    use nalgebra::DVector;

    #[test]
    fn row_of_weight_zero_does_not_shift_the_following_rows() {
        let mut residuals = [1.0, 2.0, 3.0];
        add_unweighted(&mut residuals, &DVector::from_vec(vec![0.5, 0.0, 1.0]), &[0.5, 0.0, 2.0]);
        assert_eq!(residuals, [2.0, 2.0, 3.5]);
    }
}

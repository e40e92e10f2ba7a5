//! Statistics of omitted effects at an optimum, from the change `u` of the weighted residuals by an effect of plausible
//! size, orthogonal to the Jacobian.
//!
//! [`FitStatistics`] is an optimum with its local analysis; score tests and undetected biases use its methods. For
//! weighted residuals `r` whose noise has the covariance `V`, `variance_along` returns the variance `u'Vu` with its
//! degrees of freedom. `likelihood` returns mean `-u.r/|u|^2` and standard deviation `sqrt(u'Vu)/|u|^2` of the size of
//! the effect, as a multiple of the plausible size. `largest_bias` returns the parameter with the largest bias, over
//! its standard error, by an effect of a given size. `relinearize` returns likelihood and response about another size
//! of the effect, by one run with derivatives at the optimum predicted there; a run that fails is an error.

use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::budget::input_changes::InputChange;
use crate::fit::uncertainty::budget::input_directions::InputDirections;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::discrepancy::undetected_bias::{
    EffectResponse, Likelihood, Relinearization,
};
use crate::fit::uncertainty::estimate::{Estimate, ParameterBias};
use crate::fit::uncertainty::noise::adequacy::VarianceAlong;
use crate::fit::uncertainty::noise::residual_noise::weighted_residuals;
use crate::fit::unknown::Unknown;
use nalgebra::{DMatrix, DVector};

/// An optimum with its local analysis and estimates.
#[derive(Clone, Copy)]
pub(crate) struct FitStatistics<'a> {
    /// The search with its optimum.
    pub fitted: Fitted<'a>,
    /// One per unknown, in their order.
    pub estimates: &'a [Estimate],
    /// Noise, covariance and bounds at the optimum.
    pub local: &'a LocalAnalysis,
}

/// Bias of an estimate in its standard errors; 0 and without a name where no parameter responds.
#[derive(Default)]
pub(crate) struct StandardizedBias {
    /// Absolute bias over the standard error.
    pub std_errors: f64,
    /// Name of the parameter.
    pub parameter: String,
    /// Bias as a fraction of the true value, if the effect has the given size; none where the parameter may be zero.
    pub relative: Option<f64>,
}

impl FitStatistics<'_> {
    /// Variance `d'Vd` of the noise along a `direction` `d` of the weighted residuals (one number per row), with its
    /// degrees of freedom.
    pub fn variance_along(&self, direction: &DVector<f64>) -> VarianceAlong {
        let LocalAnalysis { noise, correlations, adequacy, .. } = self.local;
        adequacy.variance_along(direction.as_slice(), noise, correlations)
    }

    /// Likelihood of the size of an effect as a multiple of the plausible size, by the weighted `residuals` `r`:
    /// estimate `-u.r/|u|^2` and standard error `sqrt(u'Vu)/|u|^2`. The plausible size changes the residuals by
    /// `direction`, `u`, which is orthogonal to the Jacobian.
    pub fn likelihood(&self, direction: &DVector<f64>, residuals: &DVector<f64>) -> Likelihood {
        let square = direction.norm_squared();
        let deviation = self.variance_along(direction).variance.sqrt();
        Likelihood { estimate: -direction.dot(residuals) / square, std_error: deviation / square }
    }

    /// The bias of the estimate that is biased most, in standard errors, by an effect of `sizes` plausible sizes.
    /// `responses` are those of the unknowns, on their scales, to the plausible size; the bias is the opposite.
    /// Estimates without a value or a standard error, or without a response, are left out; without any the bias is 0
    /// and has no name.
    pub fn largest_bias(&self, responses: &[Option<f64>], sizes: f64) -> StandardizedBias {
        let unknowns = self.fitted.search.unknowns;
        let bias = |((e, response), unknown): ((&Estimate, &Option<f64>), &Unknown)| {
            // A model with the effect has another optimum: without it the estimate is biased by the opposite.
            let (value, shift) = (e.value?, -sizes * (*response)?);
            let std_errors = (shift * unknown.slope(value) / e.std_error?).abs();
            let relative = ParameterBias::new(unknown, value, shift).relative;
            Some(StandardizedBias { std_errors, parameter: e.label(), relative })
        };
        let all = self.estimates.iter().zip(responses).zip(unknowns).filter_map(bias);
        all.max_by(|a, b| a.std_errors.total_cmp(&b.std_errors)).unwrap_or_default()
    }

    /// Linearizes an effect again about `mode` times its plausible size. The start is the optimum moved by `mode` times
    /// its first response `slope`, within the bounds. One run of the `experiments` there yields residuals and
    /// derivatives by the unknowns and by the `change` of plausible size. A Gauss-Newton step with the effect held
    /// corrects the unknowns. Returns the likelihood of the size, and the change of the unknowns from the optimum at
    /// `mode` with its derivative by the size. Error: the run fails.
    pub fn relinearize(
        self,
        experiments: &[Experiment],
        change: &InputChange,
        slope: &[Option<f64>],
        mode: f64,
    ) -> Result<Relinearization, Error> {
        let Fitted { search, optimum } = self.fitted;
        // The predicted optimum at this size of the effect.
        let mut there = optimum.clone();
        for ((x, by), unknown) in there.x.iter_mut().zip(slope).zip(search.unknowns) {
            let [low, high] = unknown.scaled_bounds();
            *x = (*x + mode * by.unwrap_or(0.0)).clamp(low, high);
        }
        let (fit, change) = (self.local.linear_fit(), change.shifted(mode));
        let at_mode = Fitted { search, optimum: &there };
        let directions = InputDirections::new(at_mode, experiments, &fit, &[&change])?;
        // Its residuals, of the same run as the derivatives.
        there.residuals.clone_from(&directions.residuals);
        let at_mode = Fitted { search, optimum: &there };
        let residuals = weighted_residuals(at_mode, &self.local.noise);
        // The Gauss-Newton step removes the error of the prediction.
        let column = DMatrix::from_column_slice(residuals.len(), 1, residuals.as_slice());
        let step = directions.responses_to(&column).remove(0);
        let moved = |j: usize| Some(there.x[j] - optimum.x[j] + step[j]?);
        let direction = directions.orthogonal_changes().column(0).into_owned();
        let mut likelihood = self.likelihood(&direction, &residuals);
        // The likelihood is about the size of the linearization.
        likelihood.estimate += mode;
        let moved = (0..there.x.len()).map(moved).collect();
        let response =
            EffectResponse { about: mode, moved, slope: directions.responses().remove(0) };
        Ok(Relinearization { likelihood, response })
    }
}

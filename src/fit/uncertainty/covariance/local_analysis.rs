//! Local analysis of an optimum by its residuals and their derivatives: noise, autocorrelation, adequacy, covariance
//! and one-sided bounds.
//!
//! [`LocalAnalysis::new`] computes, from the residuals and the Jacobian at an optimum: (1) the variance of the noise
//! and the weights of the rows; (2) AR(1) correlations; (3) the residuals over the noise of the samples (adequacy); (4)
//! estimates of dampings near zero; (5) the covariance with the unidentifiable directions; (6) one-sided bounds of open
//! parameters, by profile likelihoods with one unknown held. One-sided bounds of an earlier analysis replace step 6. If
//! step 6 adds bounds, the covariance is computed again, as bounded unknowns do not count as unidentifiable. All later
//! assessments of a fit or a plan use the results.
//!
//! [`LocalAnalysis::linear_fit`] returns the weights of the rows, and which unknowns respond to changes: those with a
//! standard deviation or a one-sided bound, and the first one of each identifiable combination. Errors: a failed
//! decomposition or simulation setup, a failed fit at a lower minimum that a profile finds, and a stop.

use crate::error::Error;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::gauss_newton::{Covariance, LinearFit};
use crate::fit::uncertainty::covariance::one_sided_bound::add_one_sided_bounds;
use crate::fit::uncertainty::covariance::zero_bound::{NearZeroEstimate, zero_bounds};
use crate::fit::uncertainty::noise::adequacy::Adequacy;
use crate::fit::uncertainty::noise::autocorrelation::NoiseModel;
use crate::fit::uncertainty::noise::coverage_factor::quantile95;
use crate::fit::uncertainty::noise::residual_noise::{ResidualNoise, weighted_rows};
use crate::numerics::half_sum_of_squares;

/// Statistics of an optimum by its residuals and their derivatives.
pub(crate) struct LocalAnalysis {
    /// Variance of the noise, and weights of the rows of the Jacobian.
    pub noise: ResidualNoise,
    /// AR(1) correlations of the noise, and the factor by which they inflate each standard error.
    pub correlations: NoiseModel,
    /// Residuals compared with the noise scale of the samples.
    pub adequacy: Adequacy,
    /// Covariance of the unknowns, with the directions that the data do not determine.
    pub covariance: Covariance,
    /// Estimates of dampings near zero, and one-sided bounds, one entry per unknown; none for unknowns with a normally
    /// distributed logarithm.
    pub bounds: Vec<Option<NearZeroEstimate>>,
}

impl LocalAnalysis {
    /// Analyzes an optimum. `known` are the bounds of an earlier analysis, before a correction of the residuals, one
    /// entry per unknown. Its one-sided ones fill entries that dampings near zero leave empty. With `None` one-sided
    /// bounds are searched for, by fits with one unknown held. Errors: failed decomposition or simulation, and
    /// [`Error::Interrupted`] after a stop.
    pub fn new(fitted: Fitted, known: Option<&[Option<NearZeroEstimate>]>) -> Result<Self, Error> {
        let Fitted { search, optimum } = fitted;
        // Noise first: its weights scale the rows of the Jacobian for everything after.
        let noise = ResidualNoise::new(fitted);
        let residuals = search.all_residuals()?;
        let rows = weighted_rows(&optimum.jacobian, &noise.weights);
        let correlations = NoiseModel::new(fitted, &rows, &noise);
        let adequacy = Adequacy::new(fitted, &correlations);
        let mut bounds = zero_bounds(fitted, &rows, &noise, &correlations, &residuals);
        // Rise of twice the misfit by a step, over that at the end of a 95 % interval; infinite where the simulation
        // fails.
        let end = noise.misfit_scale * quantile95(noise.degrees_of_freedom).powi(2);
        let rise = |step: &[f64]| {
            let x: Vec<f64> = optimum.x.iter().zip(step).map(|(x, s)| x + s).collect();
            let found = residuals.residuals(&x);
            found.map_or(f64::INFINITY, |r| 2.0 * (half_sum_of_squares(&r) - optimum.cost) / end)
        };
        let motion = motion_norm(fitted);
        let scores = correlations.score_covariance.as_ref();
        let analyze = |bounds: &[Option<NearZeroEstimate>]| {
            Covariance::new(search.unknowns, bounds, &rows, noise.variance, motion, scores, rise)
        };
        let mut covariance = analyze(&bounds)?;
        let count = bounds.iter().flatten().count();
        // Bounds are searched for once: after a correction of the residuals they are the same.
        match known {
            Some(known) => {
                for (bound, known) in bounds.iter_mut().zip(known) {
                    *bound = bound.or(known.filter(NearZeroEstimate::is_one_sided));
                }
            }
            None => add_one_sided_bounds(fitted, &noise, &correlations, &covariance, &mut bounds)?,
        }
        // Unknowns with a bound are no longer unidentifiable.
        if bounds.iter().flatten().count() > count {
            covariance = analyze(&bounds)?;
        }
        if search.is_stopped() {
            return Err(Error::Interrupted);
        }
        Ok(Self { noise, correlations, adequacy, covariance, bounds })
    }

    /// The linear model of the fit at its optimum: which unknowns respond to changes of the residuals, and the weights
    /// of the rows. Those with a standard deviation or a one-sided bound respond. Of each identifiable combination the
    /// first unknown responds and represents it.
    pub fn linear_fit(&self) -> LinearFit {
        let is_bounded = |bound: &Option<NearZeroEstimate>| bound.is_some_and(|b| b.is_one_sided());
        let all = self.covariance.deviation.iter().zip(&self.bounds);
        let mut identified: Vec<bool> =
            all.map(|(deviation, bound)| deviation.is_some() || is_bounded(bound)).collect();
        for combination in &self.covariance.combinations {
            combination.powers().take(1).for_each(|(j, _)| identified[j] = true);
        }
        LinearFit { identified, weights: self.noise.weights.clone() }
    }
}

/// Norm of the scales of all measured values, in units of the noise: the root of the sum of `(scale/sigma)^2` over
/// them. The scale of positions is the larger of rod length and size of the motion, that of other values their size;
/// sigma is the noise of the measurement. Effects of unknowns that are tiny beside this norm count as none.
fn motion_norm(fitted: Fitted) -> f64 {
    let squares = fitted.measured().map(|own| {
        let scale = own.measurement.scale(&own.experiment.problem);
        (scale / own.sigma).powi(2) * own.residuals.len() as f64
    });
    squares.sum::<f64>().sqrt()
}

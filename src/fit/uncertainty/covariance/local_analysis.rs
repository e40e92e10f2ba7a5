//! Local analysis of an optimum by its residuals and their derivatives: noise, autocorrelation, adequacy, covariance
//! and one-sided bounds.
//!
//! [`LocalAnalysis::new`] computes in this order: the variance of the residuals and weights of the rows; the AR(1)
//! correlations; the noise scales of the samples; bounds of dampings near zero; the covariance; one-sided bounds by
//! profile likelihoods. If one-sided bounds of an earlier analysis are given, they are taken over instead of the last
//! computation. If these add bounds, the covariance is computed again, as bounded unknowns are no longer
//! unidentifiable. Errors are a failed decomposition or simulation set-up, a failed fit at a lower minimum that a
//! profile finds, and a stop. All later assessments of a fit or a plan use the results. [`LocalAnalysis::linear_fit`]
//! returns the weights of the rows, and which unknowns respond to changes: identified or bounded ones, and the first
//! one of each identifiable combination.

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
    /// Variance of the residuals, and weights of the rows.
    pub noise: ResidualNoise,
    /// AR(1) correlations of the noise, and their effect on each unknown.
    pub correlations: NoiseModel,
    /// Residuals compared with the noise scale of the samples.
    pub adequacy: Adequacy,
    pub covariance: Covariance,
    /// Bounds of unknowns whose logarithm has no normal distribution, in the order of the unknowns.
    pub bounds: Vec<Option<NearZeroEstimate>>,
}

impl LocalAnalysis {
    /// Analyzes an optimum. `known` are the one-sided bounds that were found before a correction of the residuals, one
    /// per unknown; only these are then added to the bounds of dampings. With None they are searched for, by fits with
    /// one unknown held. Errors: failed decomposition or simulation, and [`Error::Interrupted`] after a stop.
    pub fn new(fitted: Fitted, known: Option<&[Option<NearZeroEstimate>]>) -> Result<Self, Error> {
        let Fitted { search, optimum } = fitted;
        // Noise first: its weights scale the rows of the Jacobian for everything after.
        let noise = ResidualNoise::new(fitted);
        let residuals = search.all_residuals()?;
        let rows = weighted_rows(&optimum.jacobian, &noise.weights);
        let correlations = NoiseModel::new(fitted, &rows, &noise);
        let adequacy = Adequacy::new(fitted, &correlations);
        let mut bounds = zero_bounds(fitted, &rows, &noise, &correlations, &residuals);
        // Rise of twice the misfit by a step, over that at the end of a 95 % interval; infinite where the simulation fails.
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
    /// first unknown responds, and represents it.
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
/// them. The scale of positions is the larger of rod length and size of the motion, that of other values their size.
/// The covariance compares effects with it.
fn motion_norm(fitted: Fitted) -> f64 {
    let squares = fitted.measured().map(|own| {
        let scale = own.measurement.scale(&own.experiment.problem);
        (scale / own.sigma).powi(2) * own.residuals.len() as f64
    });
    squares.sum::<f64>().sqrt()
}

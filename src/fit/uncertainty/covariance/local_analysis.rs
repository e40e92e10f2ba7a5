//! Local analysis of an optimum: noise, autocorrelation, adequacy, covariance and one-sided bounds by the residuals and
//! their derivatives there.

use crate::error::Error;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::gauss_newton::{Covariance, LinearFit};
use crate::fit::uncertainty::covariance::one_sided_bound::one_sided;
use crate::fit::uncertainty::covariance::zero_bound::{Bound, zero_bounds};
use crate::fit::uncertainty::noise::adequacy::Adequacy;
use crate::fit::uncertainty::noise::autocorrelation::Correlations;
use crate::fit::uncertainty::noise::residual_noise::{Noise, weighted};
use crate::numerics::half_sum_of_squares;

/// Statistics of an optimum by its residuals and their derivatives.
pub(crate) struct LocalAnalysis {
    pub noise: Noise,
    pub correlations: Correlations,
    pub adequacy: Adequacy,
    pub covariance: Covariance,
    /// Unknowns that are bounded from one side, or known too little for their logarithm to be normal.
    pub bounds: Vec<Option<Bound>>,
}

impl LocalAnalysis {
    /// Analyzes an optimum; the bounds of parameters other than dampings are computed, or those that were `known` from the
    /// data before a correction.
    pub fn new(fitted: Fitted, known: Option<&[Option<Bound>]>) -> Result<Self, Error> {
        let Fitted { search, optimum } = fitted;
        let unknowns = search.unknowns;
        let noise = Noise::at(fitted);
        let residuals = search.all_residuals()?;
        let rows = weighted(&optimum.jacobian, &noise.weights);
        let correlations = Correlations::of(fitted, &rows, &noise);
        let adequacy = Adequacy::of(fitted, &correlations);
        let mut bounds = zero_bounds(fitted, &rows, &noise, &correlations, &residuals);
        let rise = |step: &[f64]| {
            let x: Vec<f64> = optimum.x.iter().zip(step).map(|(x, s)| x + s).collect();
            // What cannot be simulated does not fit.
            residuals.residuals(&x).map_or(f64::INFINITY, |r| {
                2.0 * (half_sum_of_squares(&r) - optimum.cost) / (noise.rise * noise.reach.powi(2))
            })
        };
        let effect = size(fitted);
        let scatter = correlations.scatter.as_ref();
        let covariance = |bounds: &[Option<Bound>]| {
            Covariance::new(unknowns, bounds, &rows, noise.variance, effect, scatter, rise)
        };
        let mut local = covariance(&bounds)?;
        let before: Vec<bool> = bounds.iter().map(Option::is_some).collect();
        match known {
            Some(known) => {
                for (bound, known) in bounds.iter_mut().zip(known) {
                    *bound = bound.or(known.filter(Bound::is_one_sided));
                }
            }
            None => one_sided(fitted, &noise, &correlations, &local, &mut bounds)?,
        }
        if bounds.iter().zip(&before).any(|(bound, before)| bound.is_some() != *before) {
            local = covariance(&bounds)?;
        }
        let covariance = local;
        if search.is_stopped() {
            // Half an analysis is none.
            return Err(Error::Interrupted);
        }
        Ok(Self { noise, correlations, adequacy, covariance, bounds })
    }

    /// The linear model of the fit at its optimum.
    pub fn linear_fit(&self) -> LinearFit {
        let zero = self.bounds.iter().map(|bound| bound.is_some_and(|bound| bound.is_one_sided()));
        let deviations = self.covariance.deviation.iter();
        let identified = deviations.zip(zero).map(|(d, zero)| d.is_some() || zero).collect();
        let mut identified: Vec<bool> = identified;
        // One unknown of a combination stands for it.
        for combination in &self.covariance.combinations {
            combination.powers().take(1).for_each(|(j, _)| identified[j] = true);
        }
        LinearFit { identified, weights: self.noise.weights.clone() }
    }
}

/// The size of what was measured, in units of the noise.
fn size(fitted: Fitted) -> f64 {
    let sizes = fitted.measured().map(|own| {
        let scale = own.measurement.scale(&own.experiment.problem);
        (scale / own.sigma).powi(2) * own.residuals.len() as f64
    });
    sizes.sum::<f64>().sqrt()
}

//! Local analysis of an optimum: noise, autocorrelation, adequacy, covariance and one-sided bounds by the residuals and
//! their derivatives there.

use crate::error::Error;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::adequacy::Adequacy;
use crate::fit::uncertainty::correlation::Correlations;
use crate::fit::uncertainty::covariance::Covariance;
use crate::fit::uncertainty::input_sensitivities::LinearFit;
use crate::fit::uncertainty::noise::{Noise, weighted};
use crate::fit::uncertainty::one_sided::one_sided;
use crate::fit::uncertainty::vanishing::{Bound, vanishing};
use crate::numerics::half_square;

/// Statistics of an optimum by its residuals and their derivatives.
pub(crate) struct Local {
    pub noise: Noise,
    pub correlations: Correlations,
    pub adequacy: Adequacy,
    pub covariance: Covariance,
    /// Unknowns that are bounded from one side, or known too little for their logarithm to be normal.
    pub bounds: Vec<Option<Bound>>,
}

/// Computes them.
pub(crate) fn local(search: &Search, optimum: &Optimum) -> Result<Local, Error> {
    local_with((search, optimum), None)
}

/// The same; the bounds of parameters other than dampings are found, or `known` from the data before they were
/// corrected.
pub(crate) fn local_with(
    (search, optimum): (&Search, &Optimum),
    known: Option<&[Option<Bound>]>,
) -> Result<Local, Error> {
    let unknowns = search.unknowns;
    let noise = Noise::at(search, optimum);
    let residuals = search.all_residuals()?;
    let rows = weighted(&optimum.jacobian, &noise.weights);
    let correlations = Correlations::of((search, optimum), &rows, &noise);
    let adequacy = Adequacy::of(search, optimum, &correlations);
    let about = (&noise, &correlations);
    let mut bounds = vanishing(unknowns, (optimum, &rows, &residuals.losses()), about, &residuals);
    let rise = |step: &[f64]| {
        let x: Vec<f64> = optimum.x.iter().zip(step).map(|(x, s)| x + s).collect();
        // What cannot be simulated does not fit.
        residuals.residuals(&x).map_or(f64::INFINITY, |r| {
            2.0 * (half_square(&r) - optimum.cost) / (noise.rise * noise.reach.powi(2))
        })
    };
    let effect = size(search, optimum);
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
        None => one_sided((search, optimum), about, &local, &mut bounds)?,
    }
    if bounds.iter().zip(&before).any(|(bound, before)| bound.is_some() != *before) {
        local = covariance(&bounds)?;
    }
    let covariance = local;
    if search.is_stopped() {
        // Half an analysis is none.
        return Err(Error::Interrupted);
    }
    Ok(Local { noise, correlations, adequacy, covariance, bounds })
}

impl Local {
    /// The linear model of the fit at its optimum.
    pub fn linear_fit(&self) -> LinearFit {
        let zero = self.bounds.iter().map(|bound| bound.is_some_and(|bound| bound.is_one_sided()));
        let deviations = self.covariance.deviation.iter();
        let identified = deviations.zip(zero).map(|(d, zero)| d.is_some() || zero).collect();
        LinearFit { identified, weights: self.noise.weights.clone() }
    }
}

/// The size of what was measured, in units of the noise.
fn size(search: &Search, optimum: &Optimum) -> f64 {
    let sizes = search.measured(optimum).map(|(experiment, m, sigma, own)| {
        (m.scale(&experiment.problem) / sigma).powi(2) * own.len() as f64
    });
    sizes.sum::<f64>().sqrt()
}

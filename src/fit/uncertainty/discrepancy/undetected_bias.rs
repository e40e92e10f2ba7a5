//! Bias of the estimates by effects that the model omits and the data do not reveal.
//!
//! An effect of size `a`, in units of its plausible size, changes the residuals by `a d`, of which the parameters
//! follow all but `a u`. Residuals `r` with the variance `v = u'Vu` along `u` give its likelihood, a normal
//! distribution about `-u.r/|u|^2` with the standard deviation `sqrt(v)/|u|^2`. The prior is Student's t with four
//! degrees of freedom and the scale one; effects of one sign have no negative sizes. Where the parameters follow all
//! of the effect (`u = 0`) the posterior is the prior. The listed size is the one that the posterior exceeds, in
//! absolute value, with a probability of 5 %. It has the sign of the most probable size.
//!
//! The response of the parameters to the effect is linear, and the bias of a fit without the effect is its opposite. An
//! effect is linearized again, by a run of the full model at its most probable size, if that is above [`SIGNIFICANT`]
//! standard deviations and changes a parameter by more than [`LARGE`]. This holds for at most [`MOST_RELINEARIZED`]
//! effects, and not for derivatives of a coarse model. [`undetected_biases`] returns one entry per effect and estimate
//! with a standard error, at the listed size, the largest bias in standard errors first. Entries without a response, or
//! with one above [`LARGEST_CHANGE`] on the scale of the parameter, are left out. [`EffectPosterior`] has likelihood,
//! posterior and response of one effect; `relinearize` replaces them. `is_large` is the criterion above, and
//! `largest_change` the largest change of a parameter on its scale by the listed size. [`SizePosterior::new`] returns most
//! probable and listed size from a likelihood (none: the prior alone).
//!
//! `Likelihood` is that of the size of an effect, `EffectResponse` the response of the parameters per plausible size,
//! and `Relinearization` has both about a size.

use crate::error::Error;
use crate::fit::uncertainty::discrepancy::findings::UndetectedBias;
use crate::fit::uncertainty::discrepancy::tested_effects::TestedEffect;
use crate::fit::uncertainty::estimate::{Estimate, ParameterBias};
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use std::cmp::Reverse;

/// Degrees of freedom of the prior: with its heavy tails one in 20 effects is beyond 2.8 plausible sizes.
const PRIOR_FREEDOM: f64 = 4.0;
/// Probability with which the absolute size of an effect is below the listed one.
const LISTED: f64 = 0.95;
/// Number of points of the posterior, which is normalized by sums. Larger: finer sizes.
const POINTS: usize = 2000;
/// Range of the posterior, in standard deviations of the likelihood from the estimate and from zero.
const FARTHEST: f64 = 8.0;
/// Largest size of the posterior, in plausible sizes: no linear model holds as far.
const LARGEST_SIZE: f64 = 60.0;
/// Distance of the most probable size from zero, in standard deviations of the likelihood, above which an effect is
/// linearized again.
const SIGNIFICANT: f64 = 2.0;
/// Change of a parameter on its scale (2 % of a positive one) above which an effect is linearized again: second-order
/// terms then begin to matter.
const LARGE: f64 = 0.02;
/// Largest change of a parameter on its scale for which the linear response has a meaning: eight is a factor of 3000.
const LARGEST_CHANGE: f64 = 8.0;
/// Largest number of effects that are linearized again: a run with derivatives each.
pub(crate) const MOST_RELINEARIZED: usize = 3;

/// Normal likelihood of the size of an effect, in units of its plausible size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Likelihood {
    pub estimate: f64,
    pub std_error: f64,
}

/// Posterior of the size of an effect, in units of its plausible size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SizePosterior {
    /// Most probable size.
    pub mode: f64,
    /// Size that is exceeded in absolute value with a probability of 5 %; with the sign of the most probable size.
    pub limit: f64,
}

impl SizePosterior {
    /// Most probable and listed size of an effect. The density of the size `a` is that of the prior, `(1 +
    /// a^2/4)^(-5/2)`, times the normal one of the `likelihood` if the data determine the size. The density is summed
    /// over [`POINTS`] equal parts of a range. The range reaches [`FARTHEST`] standard errors beyond zero and beyond
    /// the estimate, at most [`LARGEST_SIZE`] to either side, which also holds without likelihood. Negative sizes are
    /// excluded if it `is_one_sided`.
    pub fn new(likelihood: Option<Likelihood>, is_one_sided: bool) -> Self {
        let most = LARGEST_SIZE;
        let [mut low, mut high] = match likelihood {
            Some(Likelihood { estimate, std_error }) => {
                // The prior is between zero and the estimate, the likelihood about the latter.
                let reach = FARTHEST * std_error;
                [estimate.min(0.0) - reach, estimate.max(0.0) + reach].map(|a| a.clamp(-most, most))
            }
            None => [-most, most],
        };
        if is_one_sided {
            low = 0.0;
            high = high.max(f64::MIN_POSITIVE);
        }
        // Midpoints of equal parts of the range.
        let size = |k: usize| low + (high - low) * (k as f64 + 0.5) / POINTS as f64;
        let log_density = |a: f64| {
            let prior = -0.5 * (PRIOR_FREEDOM + 1.0) * (a * a / PRIOR_FREEDOM).ln_1p();
            let data = likelihood.map_or(0.0, |l| -0.5 * ((a - l.estimate) / l.std_error).powi(2));
            prior + data
        };
        // Densities are relative to the largest one: their logarithms may be far below zero.
        let logs: Vec<f64> = (0..POINTS).map(|k| log_density(size(k))).collect();
        // The first of equal maxima.
        let best = (0..POINTS).rev().max_by(|a, b| logs[*a].total_cmp(&logs[*b])).unwrap_or(0);
        // The limit of the absolute value: both sides together, from zero on.
        let mut order: Vec<usize> = (0..POINTS).collect();
        order.sort_by_cached_key(|k| total_order(size(*k).abs()));
        let densities: Vec<f64> = order.iter().map(|k| (logs[*k] - logs[best]).exp()).collect();
        let total: f64 = densities.iter().sum();
        let (mut below, mut limit) = (0.0, 0.0);
        for (k, density) in order.into_iter().zip(densities) {
            below += density;
            limit = size(k).abs();
            if below >= LISTED * total {
                break;
            }
        }
        Self { mode: size(best), limit: if size(best) < 0.0 { -limit } else { limit } }
    }
}

/// Response of the parameters to an effect, on their scales and per plausible size; none for those that are not
/// identified.
#[derive(Clone, Debug)]
pub(crate) struct EffectResponse {
    /// Size of the effect about which it is linearized, in plausible sizes.
    pub about: f64,
    /// Change of the optimum from that without the effect, at that size.
    pub moved: Vec<Option<f64>>,
    /// Derivative of the optimum by the size there.
    pub slope: Vec<Option<f64>>,
}

impl EffectResponse {
    /// Change of parameter `j`, on its scale (logarithm if positive), by an effect of this `size` in plausible sizes.
    /// It is linear about the size of the linearization; none if the parameter does not respond.
    fn change(&self, j: usize, size: f64) -> Option<f64> {
        Some(self.moved[j]? + (size - self.about) * self.slope[j]?)
    }

    /// The largest absolute change of a parameter on its scale (logarithm if positive) by an effect of this `size`, in
    /// plausible sizes; 0 without a response.
    fn largest_change(&self, size: f64) -> f64 {
        let changes = (0..self.slope.len()).filter_map(|j| self.change(j, size));
        changes.map(f64::abs).fold(0.0, f64::max)
    }
}

/// Likelihood and response of an effect, linearized about a size of it.
pub(crate) struct Relinearization {
    pub likelihood: Likelihood,
    pub response: EffectResponse,
}

/// The size of an effect by the data and its plausible size, and the response of the parameters.
pub(crate) struct EffectPosterior<'a> {
    pub tested: &'a TestedEffect,
    /// None where the parameters follow all of the effect.
    likelihood: Option<Likelihood>,
    /// Posterior of the size.
    posterior: SizePosterior,
    /// Response of the parameters.
    pub response: EffectResponse,
}

impl<'a> EffectPosterior<'a> {
    /// Posterior by the `likelihood` of the size of an effect (none: the parameters follow all of it). The response
    /// `slope` of the parameters, on their scales and per plausible size, is that at the optimum; it is linear about
    /// the size 0.
    pub fn new(
        tested: &'a TestedEffect,
        likelihood: Option<Likelihood>,
        slope: Vec<Option<f64>>,
    ) -> Self {
        let posterior = SizePosterior::new(likelihood, tested.effect.is_one_sided());
        let response = EffectResponse { about: 0.0, moved: vec![Some(0.0); slope.len()], slope };
        Self { tested, likelihood, posterior, response }
    }

    /// Whether the data determine a large effect: its most probable size is above [`SIGNIFICANT`] standard deviations
    /// of the likelihood, and changes a parameter by more than [`LARGE`]. Such an effect is linearized again about its
    /// most probable size.
    pub fn is_large(&self) -> bool {
        let Self { likelihood, posterior, response, .. } = self;
        let is_significant =
            likelihood.is_some_and(|l| (posterior.mode / l.std_error).abs() > SIGNIFICANT);
        is_significant && response.largest_change(posterior.mode) > LARGE
    }

    /// Replaces likelihood, posterior and response by those that `relinearize` returns for the most probable size, in
    /// plausible sizes. Error: its run fails, and nothing changes.
    pub fn relinearize(
        &mut self,
        relinearize: impl FnOnce(f64) -> Result<Relinearization, Error>,
    ) -> Result<(), Error> {
        let Relinearization { likelihood, response } = relinearize(self.posterior.mode)?;
        self.posterior = SizePosterior::new(Some(likelihood), self.tested.effect.is_one_sided());
        (self.likelihood, self.response) = (Some(likelihood), response);
        Ok(())
    }

    /// The largest absolute change of a parameter on its scale (logarithm if positive) by the effect of its listed
    /// size; 0 without a response.
    pub fn largest_change(&self) -> f64 {
        self.response.largest_change(self.posterior.limit)
    }
}

/// Biases of all estimates with a standard error by all effects at their listed sizes, one entry per pair. The largest
/// absolute bias in standard errors comes first. A bias is the opposite of the response to the effect. Responses above
/// [`LARGEST_CHANGE`], and pairs without a response, are left out.
pub(crate) fn undetected_biases(
    effects: &[EffectPosterior],
    unknowns: &[Unknown],
    estimates: &[Estimate],
) -> Vec<UndetectedBias> {
    let mut all = Vec::new();
    for EffectPosterior { tested, likelihood, posterior, response } in effects {
        for (j, estimate) in estimates.iter().enumerate() {
            let (Some(value), Some(std_error)) = (estimate.value, estimate.std_error) else {
                continue;
            };
            // A model with the effect has another optimum: without it the estimate is biased by the opposite.
            let Some(shift) = response.change(j, posterior.limit).map(|change| -change) else {
                continue;
            };
            let ParameterBias { change, relative } = ParameterBias::new(&unknowns[j], value, shift);
            // A linear response of orders of magnitude has no meaning.
            if !change.is_finite()
                || relative.is_some_and(|r| !r.is_finite())
                || shift.abs() > LARGEST_CHANGE
            {
                continue;
            }
            let plausible_size = tested.plausible_size;
            all.push(UndetectedBias {
                source: tested.effect.path.into(),
                effect: tested.name.clone(),
                size: posterior.limit * plausible_size,
                plausible_size,
                estimate: likelihood.map(|l| l.estimate * plausible_size),
                estimate_std_error: likelihood.map(|l| l.std_error * plausible_size),
                unit: tested.effect.parameter().unit().into(),
                parameter: estimate.label(),
                change,
                relative,
                std_errors: change.abs() / std_error,
                residual_effect: likelihood.map_or(0.0, |l| posterior.limit.abs() / l.std_error),
                test: tested.effect.test.into(),
            });
        }
    }
    all.sort_by_cached_key(|x| Reverse(total_order(x.std_errors)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Listed size of an effect by data with this likelihood.
    fn limit(estimate: f64, std_error: f64, is_one_sided: bool) -> f64 {
        SizePosterior::new(Some(Likelihood { estimate, std_error }), is_one_sided).limit
    }

    /// Student's t with four degrees of freedom is within 2.776 with 95 %, whichever of its sides are allowed.
    #[test]
    fn posterior_without_data_is_the_prior() {
        for is_one_sided in [false, true] {
            let limit = SizePosterior::new(None, is_one_sided).limit;
            assert!((limit.abs() - 2.776).abs() < 0.05, "{limit}");
        }
        assert!((limit(0.0, 1e6, false).abs() - 2.776).abs() < 0.05);
    }

    /// Precise data prevail: the limit is the normal one about the estimate, 1.645 standard errors on one side.
    #[test]
    fn precise_data_prevail_over_the_prior() {
        assert!((limit(10.0, 0.1, false) - 10.15).abs() < 0.02);
        assert!((limit(-10.0, 0.1, false) + 10.15).abs() < 0.02);
        // Zero is within: the limit is that of the absolute value, 1.96 standard errors.
        assert!((limit(0.0, 0.01, false).abs() - 0.0196).abs() < 2e-4);
        // A one-sided effect with a negative estimate is small.
        assert!(limit(-10.0, 1.0, true) < 0.3);
    }

    /// Ten plausible sizes that the data determine to one shrink by less than a twentieth.
    #[test]
    fn precise_data_shrink_ten_plausible_sizes_by_less_than_a_twentieth() {
        let posterior =
            SizePosterior::new(Some(Likelihood { estimate: 10.0, std_error: 1.0 }), false);
        assert!((9.4..9.7).contains(&posterior.mode), "{posterior:?}");
        assert!(posterior.limit > 11.0);
    }
}

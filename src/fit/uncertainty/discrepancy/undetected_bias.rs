//! Bias of the estimates by effects that the model omits and the data do not reveal.
//!
//! An effect of size `a`, in units of its plausible size, changes the residuals by `a d`, of which the parameters follow
//! all but `u`. Residuals `r` with the variance `v` along `u` give its likelihood, a normal distribution about
//! `-u.r/|u|^2` with the standard deviation `sqrt(v)/|u|^2`. The prior is Student's t with four degrees of freedom and the
//! scale one: where the data determine the size they prevail, however large it is, and where the parameters follow all
//! of the effect (`u = 0`) the posterior is the prior. The listed size is the one that the posterior exceeds with 5 %.
//!
//! The answer of the parameters is linear. Where the data determine a large size it is repeated there: the run with the
//! effect of the most probable size has derivatives of its own.

use crate::error::Error;
use crate::fit::uncertainty::discrepancy::findings::UndetectedBias;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use std::cmp::Reverse;

/// Degrees of freedom of the prior: heavy tails, of which one in 20 effects is beyond 2.8 plausible sizes.
const PRIOR_FREEDOM: f64 = 4.0;
/// Probability with which the size of an effect is below the listed one.
const LISTED: f64 = 0.95;
/// Points of the posterior, which is normalized by sums.
const POINTS: usize = 2000;
/// The posterior is evaluated up to so many standard deviations of the likelihood from the estimate and from zero,
const FARTHEST: f64 = 8.0;
/// and up to so many plausible sizes: a rod with a larger effect is another rod, and no linear model holds as far.
const LARGEST_SIZE: f64 = 60.0;
/// An effect is linearized again where it is so many standard deviations from zero,
const SIGNIFICANT: f64 = 2.0;
/// and changes a parameter by more than this on its scale (2 % of a positive one), where second-order terms begin to count.
const LARGE: f64 = 0.02;
/// Effects that are linearized again: a run with derivatives each.
pub(crate) const MOST_RELINEARIZED: usize = 3;

/// An effect that the model omits, with its plausible size.
pub(crate) struct Effect<'a> {
    /// Its number, by the place in the scene.
    pub source: &'a str,
    /// Name of the effect.
    pub name: &'a str,
    /// In the unit of its number.
    pub plausible_size: f64,
    pub unit: &'a str,
    /// Experiment that would reveal it.
    pub test: &'a str,
    /// Whether the number cannot be below what the scene has.
    pub is_one_sided: bool,
}

/// What the data determine of the size of an effect, in units of its plausible size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Likelihood {
    pub estimate: f64,
    pub std_error: f64,
}

/// The size of an effect after the data, in units of its plausible size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Posterior {
    pub mode: f64,
    /// Exceeded in absolute value with a probability of 5 %; with the sign of the more probable side.
    pub limit: f64,
}

impl Posterior {
    /// Of an effect that may have either sign, unless it `is_one_sided`.
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
        let at = |k: usize| low + (high - low) * (k as f64 + 0.5) / POINTS as f64;
        let log_density = |a: f64| {
            let prior = -0.5 * (PRIOR_FREEDOM + 1.0) * (a * a / PRIOR_FREEDOM).ln_1p();
            let data = likelihood.map_or(0.0, |l| -0.5 * ((a - l.estimate) / l.std_error).powi(2));
            prior + data
        };
        let logs: Vec<f64> = (0..POINTS).map(|k| log_density(at(k))).collect();
        let (best, most) =
            logs.iter().enumerate().fold((0, f64::NEG_INFINITY), |(best, most), (k, log)| {
                if *log > most { (k, *log) } else { (best, most) }
            });
        let mut sizes: Vec<(f64, f64)> =
            (0..POINTS).map(|k| (at(k).abs(), (logs[k] - most).exp())).collect();
        sizes.sort_by_cached_key(|x| total_order(x.0));
        let total: f64 = sizes.iter().map(|(_, density)| density).sum();
        let (mut below, mut limit) = (0.0, 0.0);
        for (size, density) in sizes {
            below += density;
            limit = size;
            if below >= LISTED * total {
                break;
            }
        }
        let side = if at(best) < 0.0 { -1.0 } else { 1.0 };
        Self { mode: at(best), limit: side * limit }
    }
}

/// How the parameters answer to an effect, on their scales and per plausible size; none for those that are not
/// identified.
#[derive(Clone, Debug)]
pub(crate) struct Answer {
    /// Where it is linearized, in plausible sizes.
    pub about: f64,
    /// Change of the optimum from that without the effect.
    pub moved: Vec<Option<f64>>,
    /// Derivative of the optimum there.
    pub slope: Vec<Option<f64>>,
}

impl Answer {
    /// Change of parameter `j` for an effect of this size.
    fn at(&self, j: usize, size: f64) -> Option<f64> {
        Some(self.moved[j]? + (size - self.about) * self.slope[j]?)
    }
}

/// An effect with what the data say of it.
pub(crate) struct Weighed<'a> {
    /// Its place among all tested effects.
    pub term: usize,
    pub effect: Effect<'a>,
    pub likelihood: Option<Likelihood>,
    pub posterior: Posterior,
    pub answer: Answer,
}

impl Weighed<'_> {
    /// Whether it is to be linearized about its most probable size.
    pub fn is_large(&self) -> bool {
        let Self { likelihood, posterior, answer, .. } = self;
        let is_significant =
            likelihood.is_some_and(|l| (posterior.mode / l.std_error).abs() > SIGNIFICANT);
        let changes = (0..answer.slope.len()).filter_map(|j| answer.at(j, posterior.mode));
        is_significant && changes.map(f64::abs).fold(0.0, f64::max) > LARGE
    }

    /// Linearized again by `about_mode`, whose likelihood and answer are at the most probable size.
    pub fn relinearized(
        &mut self,
        about_mode: impl FnOnce(f64) -> Result<(Likelihood, Answer), Error>,
    ) -> Result<(), Error> {
        let (likelihood, answer) = about_mode(self.posterior.mode)?;
        self.posterior = Posterior::new(Some(likelihood), self.effect.is_one_sided);
        (self.likelihood, self.answer) = (Some(likelihood), answer);
        Ok(())
    }

    /// The largest change of a parameter on its scale at the listed size.
    pub fn largest_change(&self) -> f64 {
        let changes =
            (0..self.answer.slope.len()).filter_map(|j| self.answer.at(j, self.posterior.limit));
        changes.map(f64::abs).fold(0.0, f64::max)
    }
}

/// The bias of every estimate by every effect at its listed size: the most standard errors first.
pub(crate) fn biases(
    weighed: &[Weighed],
    unknowns: &[Unknown],
    estimates: &[Estimate],
) -> Vec<UndetectedBias> {
    let mut all = Vec::new();
    for Weighed { effect: omitted, likelihood, posterior, answer, .. } in weighed {
        for (j, estimate) in estimates.iter().enumerate() {
            let (Some(value), Some(std_error)) = (estimate.value, estimate.std_error) else {
                continue;
            };
            // Beside the effect the optimum moves; without it the estimate is off by the opposite.
            let Some(moved) = answer.at(j, posterior.limit).map(|moved| -moved) else { continue };
            let unknown = &unknowns[j];
            let (change, relative) = match unknown.parameter.is_positive() {
                // Logarithms: the estimate over the true value, less one.
                true => (-value * (-moved).exp_m1(), Some(moved.exp_m1())),
                false => (moved * unknown.slope(value), None),
            };
            // A linear answer of orders of magnitude is none.
            if !change.is_finite()
                || relative.is_some_and(|r| !r.is_finite())
                || moved.abs() > FARTHEST
            {
                continue;
            }
            let size = posterior.limit * omitted.plausible_size;
            all.push(UndetectedBias {
                source: omitted.source.into(),
                effect: omitted.name.into(),
                size,
                plausible_size: omitted.plausible_size,
                estimate: likelihood.map(|l| l.estimate * omitted.plausible_size),
                estimate_std_error: likelihood.map(|l| l.std_error * omitted.plausible_size),
                unit: omitted.unit.into(),
                parameter: estimate.label(),
                change,
                relative,
                std_errors: change.abs() / std_error,
                residual_effect: likelihood.map_or(0.0, |l| posterior.limit.abs() / l.std_error),
                test: omitted.test.into(),
            });
        }
    }
    all.sort_by_cached_key(|x| Reverse(total_order(x.std_errors)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limit(estimate: f64, std_error: f64, is_one_sided: bool) -> f64 {
        Posterior::new(Some(Likelihood { estimate, std_error }), is_one_sided).limit
    }

    /// Student's t with four degrees of freedom is within 2.776 with 95 %, whichever of its sides are allowed.
    #[test]
    fn posterior_without_data_is_the_prior() {
        for is_one_sided in [false, true] {
            let limit = Posterior::new(None, is_one_sided).limit;
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
        // Of a mass that would have to be negative, little is left.
        assert!(limit(-10.0, 1.0, true) < 0.3);
    }

    /// Ten plausible sizes that the data determine to one shrink by less than a twentieth.
    #[test]
    fn heavy_tails_follow_unlikely_sizes() {
        let posterior = Posterior::new(Some(Likelihood { estimate: 10.0, std_error: 1.0 }), false);
        assert!((9.4..9.7).contains(&posterior.mode), "{posterior:?}");
        assert!(posterior.limit > 11.0);
    }
}

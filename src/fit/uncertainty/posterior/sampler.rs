//! One Markov chain of the No-U-Turn Sampler (crate nuts-rs) for a target whose scales are near 1.
//!
//! Input is a [`LogDensity`] with its gradient, the numbers of draws, the seed and the number of the chain, which has a
//! random stream of its own. The chain starts at a random point of [`START_SPREAD`] standard deviations, nearer to zero
//! where the density there is zero. Step size and a diagonal metric are adapted in the warm-up. Output is a
//! [`SampledChain`]: draws, log densities, and the number of divergences. A point that cannot be evaluated has density
//! zero, which ends the trajectory as a divergence. A stop ends the chain without a result.

use crate::fit::uncertainty::posterior::settings::PosteriorSettings;
use nuts_rs::{
    Chain, CpuLogpFunc, CpuMath, CpuMathError, DiagNutsSettings, HasDims, LogpError, Settings,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::HashMap;

/// Spread of the starts, in standard deviations of the target: wider than the target, so that R-hat detects chains that
/// have not met.
const START_SPREAD: f64 = 1.5;
/// Number of starts that are tried, each nearer to zero than the last.
const STARTS: usize = 20;
/// Largest number of doublings of a trajectory, 64 steps: one through a standard normal distribution has 3 to 7.
const MOST_DOUBLINGS: u64 = 6;

/// Logarithm of a probability density, up to a constant, of a target with scales near 1.
pub(crate) trait LogDensity {
    /// Number of coordinates.
    fn dimension(&self) -> usize;

    /// The log density at `x`, and its gradient in `gradient`, both of the [dimension](Self::dimension). Error: the
    /// point cannot be evaluated, or the user stopped.
    fn evaluate(&self, x: &[f64], gradient: &mut [f64]) -> Result<f64, EvaluationError>;
}

/// Reason for a missing density.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(crate) enum EvaluationError {
    #[error("the point cannot be simulated")]
    NotSimulated,
    #[error("stopped")]
    Stopped,
}

/// Draws of a chain after its warm-up.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SampledChain {
    /// Points, one per draw.
    pub draws: Vec<Vec<f64>>,
    /// Log density of the target at every draw.
    pub log_densities: Vec<f64>,
    /// Number of draws whose trajectory diverged.
    pub divergences: usize,
}

/// A density as nuts-rs uses it.
struct SamplerTarget<D>(D);

impl LogpError for EvaluationError {
    fn is_recoverable(&self) -> bool {
        *self == Self::NotSimulated
    }
}

impl<D: LogDensity> HasDims for SamplerTarget<D> {
    fn dim_sizes(&self) -> HashMap<String, u64> {
        HashMap::from([("unconstrained_parameter".into(), self.0.dimension() as u64)])
    }
}

impl<D: LogDensity> CpuLogpFunc for SamplerTarget<D> {
    type LogpError = EvaluationError;
    type FlowParameters = ();
    type ExpandedVector = Vec<f64>;

    fn dim(&self) -> usize {
        self.0.dimension()
    }

    fn logp(&mut self, position: &[f64], gradient: &mut [f64]) -> Result<f64, EvaluationError> {
        let value = self.0.evaluate(position, gradient)?;
        let is_finite = value.is_finite() && gradient.iter().all(|g| g.is_finite());
        if is_finite { Ok(value) } else { Err(EvaluationError::NotSimulated) }
    }

    fn expand_vector<R: Rng + ?Sized>(
        &mut self,
        _: &mut R,
        position: &[f64],
    ) -> Result<Vec<f64>, CpuMathError> {
        Ok(position.to_vec())
    }
}

/// Draws chain `number` from the target `density`, with the random stream `number` of the `seed`. `after` is called
/// after every draw, those of the warm-up included. None if no start can be evaluated, or after a stop.
pub(crate) fn sample_chain<D: LogDensity>(
    density: D,
    settings: PosteriorSettings,
    seed: u64,
    number: usize,
    mut after: impl FnMut(),
) -> Option<SampledChain> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // A stream of its own: the result does not depend on the threads of the chains.
    random.set_stream(number as u64);
    let dimension = density.dimension();
    let options = DiagNutsSettings {
        num_tune: settings.warmup as u64,
        num_draws: settings.draws as u64,
        maxdepth: MOST_DOUBLINGS,
        ..DiagNutsSettings::default()
    };
    let math = CpuMath::new(SamplerTarget(density));
    let mut chain = options.new_chain(number as u64, math, &mut random).ok()?;
    let start: Vec<f64> =
        (0..dimension).map(|_| START_SPREAD * sample_normal(&mut random)).collect();
    let nearer = |k: usize| 1.0 - k as f64 / STARTS as f64;
    let mut starts = (0..=STARTS).map(|k| start.iter().map(|x| x * nearer(k)).collect::<Vec<_>>());
    starts.find(|start| chain.set_position(start).is_ok())?;
    let mut found = SampledChain { draws: Vec::new(), log_densities: Vec::new(), divergences: 0 };
    for k in 0..settings.warmup + settings.draws {
        let (position, _, stats, progress) = chain.expanded_draw().ok()?;
        after();
        if k >= settings.warmup {
            found.draws.push(position.into_vec());
            found.log_densities.push(stats.point.logp);
            found.divergences += usize::from(progress.diverging);
        }
    }
    Some(found)
}

/// A standard normal random number.
fn sample_normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::uncertainty::posterior::diagnostics::Diagnostics;

    /// A normal distribution about `MEAN` with the covariance `[[1, 0.5], [0.5, 2]]`, which has no density for
    /// `x[0] < -1` where it is cut.
    struct Gaussian {
        is_cut: bool,
    }

    const MEAN: [f64; 2] = [0.3, -2.0];

    impl LogDensity for Gaussian {
        fn dimension(&self) -> usize {
            2
        }

        fn evaluate(&self, x: &[f64], gradient: &mut [f64]) -> Result<f64, EvaluationError> {
            if self.is_cut && x[0] < -1.0 {
                return Err(EvaluationError::NotSimulated);
            }
            let [a, b] = [x[0] - MEAN[0], x[1] - MEAN[1]];
            // The inverse of the covariance, whose determinant is 1.75.
            gradient.copy_from_slice(&[-(2.0 * a - 0.5 * b) / 1.75, -(b - 0.5 * a) / 1.75]);
            Ok(0.5 * (gradient[0] * a + gradient[1] * b))
        }
    }

    /// Four chains of a Gaussian.
    fn chains(is_cut: bool) -> Vec<SampledChain> {
        let settings = PosteriorSettings { draws: 2000, ..PosteriorSettings::default() };
        let chain = |k| sample_chain(Gaussian { is_cut }, settings, 3, k, || {}).unwrap();
        (0..4).map(chain).collect()
    }

    /// Mean, variances and covariance agree within four Monte Carlo errors.
    #[test]
    fn sampler_recovers_moments_of_a_gaussian() {
        let found = chains(false);
        assert_eq!(found.iter().map(|chain| chain.divergences).sum::<usize>(), 0);
        let moments = |x: &Vec<f64>| {
            let [a, b] = [x[0] - MEAN[0], x[1] - MEAN[1]];
            [x[0], x[1], a * a, b * b, a * b]
        };
        for (k, expected) in [MEAN[0], MEAN[1], 1.0, 2.0, 0.5].into_iter().enumerate() {
            let of = |chain: &SampledChain| chain.draws.iter().map(|x| moments(x)[k]).collect();
            let values: Vec<Vec<f64>> = found.iter().map(of).collect();
            let quality = Diagnostics::new(&values).unwrap();
            let mean = values.concat().iter().sum::<f64>() / 8000.0;
            println!("moment {k}: {mean} for {expected}, {quality:?}");
            assert!((mean - expected).abs() < 4.0 * quality.mc_error, "{k}: {mean}, {quality:?}");
            assert!(quality.mc_error < 0.06 && quality.r_hat < 1.01, "{k}: {quality:?}");
        }
        // The log density of every draw is that of the target.
        let chain = &found[0];
        let value = Gaussian { is_cut: false }.evaluate(&chain.draws[7], &mut [0.0; 2]).unwrap();
        assert!((chain.log_densities[7] - value).abs() < 1e-12);
    }

    /// Draws stay in the region with a density, and trajectories that leave it are divergences.
    #[test]
    fn points_without_density_are_divergences() {
        let found = chains(true);
        assert!(found.iter().flat_map(|chain| &chain.draws).all(|x| x[0] >= -1.0));
        assert!(found.iter().all(|chain| chain.divergences > 0), "{}", found[0].divergences);
    }

    /// A target that never has a density, or is stopped, has no chain.
    #[test]
    fn target_without_density_has_no_chain() {
        struct Failing(EvaluationError);
        impl LogDensity for Failing {
            fn dimension(&self) -> usize {
                1
            }
            fn evaluate(&self, _: &[f64], _: &mut [f64]) -> Result<f64, EvaluationError> {
                Err(self.0)
            }
        }
        for reason in [EvaluationError::NotSimulated, EvaluationError::Stopped] {
            let settings = PosteriorSettings::default();
            assert_eq!(sample_chain(Failing(reason), settings, 0, 0, || {}), None);
        }
    }
}

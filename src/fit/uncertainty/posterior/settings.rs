//! Settings of the posterior sampler: the table `[analysis] posterior` of a fit file.
//!
//! [`PosteriorSettings`] has the numbers of chains, of draws and of warm-up draws of each chain, with defaults. `check`
//! rejects numbers outside of their ranges, and any settings in a build without the sampler (feature `posterior`).

use crate::error::{Error, ensure};
use serde::Deserialize;

/// Fewest draws of a chain: its halves are compared by their variances and autocorrelations.
const FEWEST_DRAWS: usize = 20;
/// Largest number of draws of a chain, and of warm-up draws; more are a typing error.
const MOST_DRAWS: usize = 1_000_000;
/// Largest number of chains; more are a typing error.
const MOST_CHAINS: usize = 1000;

/// `[analysis] posterior`: numbers of draws and chains of the posterior sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    deny_unknown_fields,
    default,
    expecting = "posterior = { draws = 1000, chains = 4, warmup = 300 }, all keys optional"
)]
pub struct PosteriorSettings {
    /// Number of draws of each chain, after its warm-up.
    pub draws: usize,
    /// Number of chains.
    pub chains: usize,
    /// Number of draws of each chain before, which adapt the step size and are not kept.
    pub warmup: usize,
}

impl Default for PosteriorSettings {
    /// Four chains of 1000 draws. The target is nearly a standard normal distribution, so that 300 draws are enough to
    /// adapt the step size.
    fn default() -> Self {
        Self { draws: 1000, chains: 4, warmup: 300 }
    }
}

impl PosteriorSettings {
    /// Number of all draws of all chains, those of the warm-up included.
    pub fn total(self) -> usize {
        self.chains.saturating_mul(self.draws.saturating_add(self.warmup))
    }

    /// Rejects numbers of draws ([`FEWEST_DRAWS`] to [`MOST_DRAWS`]), of chains (1 to [`MOST_CHAINS`]) and of warm-up
    /// draws (at least [`FEWEST_DRAWS`]) outside of their ranges, and a build without the feature `posterior`.
    pub(crate) fn check(self) -> Result<(), Error> {
        let allowed = "a build with the feature `posterior`";
        ensure(cfg!(feature = "posterior"), "analysis.posterior", "no sampler", allowed)?;
        let draws = FEWEST_DRAWS..=MOST_DRAWS;
        let numbers = [
            ("draws", self.draws, draws.clone()),
            ("chains", self.chains, 1..=MOST_CHAINS),
            ("warmup", self.warmup, draws),
        ];
        for (key, number, range) in numbers {
            let allowed = format!("{} .. {}", range.start(), range.end());
            ensure(range.contains(&number), format!("analysis.posterior.{key}"), number, allowed)?;
        }
        Ok(())
    }
}

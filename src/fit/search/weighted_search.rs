//! The best of all starts, with the weights of the measurements that belong to it.

use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::misfit::initial_sigmas::weights_depend_on_the_fit;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;

/// How often weights are estimated from the residuals.
const MOST_WEIGHTINGS: usize = 20;
/// Noise below this part of the rod's length is none.
const EXACT: f64 = 1e-12;

impl Search<'_> {
    /// The best of all starts; the sigmas are those that belong to it from then on.
    pub fn best(&mut self) -> Result<Optimum, Error> {
        self.journal.reweight(&self.sigmas);
        let optimum = if self.is_displacement_driven() { self.led()? } else { self.globally()? };
        let mut optimum = self.with_leverage_weights(optimum)?;
        if !weights_depend_on_the_fit(self.experiments, self.unknowns) {
            return Ok(optimum);
        }
        let first = optimum.x.clone();
        for _ in 0..MOST_WEIGHTINGS {
            let sigmas = self.estimated_sigmas(&optimum);
            let before = std::mem::replace(&mut self.sigmas, sigmas);
            self.journal.reweight(&self.sigmas);
            optimum = self.polish_reweighted(&optimum, &before)?;
            let settled = |(a, b): (&f64, &f64)| (a / b - 1.0).abs() < 1e-3;
            if self.sigmas.iter().zip(&before).all(settled) {
                break;
            }
        }
        let optimum = self.raised(optimum)?;
        self.journal.move_minimum(&first, self.minimum(&optimum));
        Ok(optimum)
    }

    /// The sigmas; those that are not given from the spread of the residuals.
    pub fn estimated_sigmas(&self, optimum: &Optimum) -> Vec<f64> {
        let total = optimum.residuals.len() as f64;
        let freedom = (1.0 - self.unknowns.len() as f64 / total).max(1.0 / total);
        let estimated = |((sigma, (experiment, measurement)), spread): (
            (&f64, (&Experiment, &Measurement)),
            f64,
        )| {
            if measurement.sigma().is_some() || spread <= 0.0 {
                return *sigma;
            }
            // Perfect data have no noise to estimate.
            let least = EXACT * measurement.scale(&experiment.problem);
            let freedom = freedom * measurement.free_share();
            (spread / freedom.sqrt()).max(least)
        };
        let own = self.sigmas.iter().zip(all(self.experiments));
        own.zip(self.spreads(optimum)).map(estimated).collect()
    }
}

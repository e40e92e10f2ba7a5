//! The optimum with the weights that belong to it: sigmas (standard deviations of measurements) that are not given are
//! estimated from its residuals, by iteratively reweighted least squares.
//!
//! Input: a search with preliminary sigmas. [`Search::find_optimum`] searches the global optimum, and adds leverage
//! weights where sensitivities grow. Each sigma that is not given is then set to the RMS residual of its measurement,
//! or with a robust loss to one by the median, corrected for the degrees of freedom. The fit is repeated from there
//! until all sigmas change by less than [`SIGMA_TOLERANCE`], at most [`MOST_WEIGHTINGS`] times; then dampings near zero
//! are raised. [`Search::reweighted`] has this iteration alone, for an optimum on another mesh. Where missing sigmas do
//! not change the optimum, as of a single measurement with squared loss and without priors, nothing is repeated and the
//! preliminary sigmas stay. Output: the optimum, with the sigmas (in the unit of each measurement) and leverage weights
//! in the search, and its minimum in the journal; `estimated_sigmas` returns the sigmas of any optimum. A search
//! without an optimum, a repeated fit that fails, and a stop are errors.

use crate::error::Error;
use crate::fit::measurement::experiment::all;
use crate::fit::misfit::initial_sigmas::weights_depend_on_the_fit;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;

/// Largest number of fits with new sigmas. Each costs a fit from the last optimum.
const MOST_WEIGHTINGS: usize = 20;
/// Relative change of all sigmas below which they have converged. A change of 0.1 % of a sigma is far below its own
/// uncertainty.
const SIGMA_TOLERANCE: f64 = 1e-3;
/// Smallest estimated sigma of a measurement, over its scale: of positions the length of the rod or a larger motion, of
/// other values their size.
const EXACT: f64 = 1e-12;

impl Search<'_> {
    /// The global optimum; the search's sigmas and leverage weights become those that belong to it. Sigmas and fits
    /// alternate up to [`MOST_WEIGHTINGS`] times, then dampings near zero are raised, and the minimum in the journal is
    /// replaced. Where sigmas that are not given do not change the optimum, the first optimum is the result, with
    /// preliminary sigmas. An error if the search has no optimum, a repeated fit fails, or the user stops.
    pub fn find_optimum(&mut self) -> Result<Optimum, Error> {
        self.journal.reweight(&self.sigmas);
        let optimum = match self.is_displacement_driven() {
            true => self.driven_optimum()?,
            false => self.global_optimum()?,
        };
        let optimum = self.with_growth_weights(optimum)?;
        if !weights_depend_on_the_fit(self.experiments, self.unknowns) {
            return Ok(optimum);
        }
        let first = optimum.x.clone();
        let optimum = self.reweighted(optimum)?;
        let optimum = self.with_raised_damping(optimum)?;
        self.journal.move_minimum(&first, self.minimum(&optimum));
        Ok(optimum)
    }

    /// The optimum near `optimum` with the sigmas that belong to it, which become those of the search. Sigmas and fits
    /// alternate up to [`MOST_WEIGHTINGS`] times. Nothing changes where sigmas that are not given do not change the
    /// optimum. An error if a repeated fit fails or the user stops.
    pub fn reweighted(&mut self, mut optimum: Optimum) -> Result<Optimum, Error> {
        if !weights_depend_on_the_fit(self.experiments, self.unknowns) {
            return Ok(optimum);
        }
        // Sigmas and optimum depend on each other: a fixed-point iteration.
        for _ in 0..MOST_WEIGHTINGS {
            let sigmas = self.estimated_sigmas(&optimum);
            let before = std::mem::replace(&mut self.sigmas, sigmas);
            self.journal.reweight(&self.sigmas);
            optimum = self.polish_reweighted(&optimum, &before)?;
            let has_converged = |(a, b): (&f64, &f64)| (a / b - 1.0).abs() < SIGMA_TOLERANCE;
            if self.sigmas.iter().zip(&before).all(has_converged) {
                break;
            }
        }
        Ok(optimum)
    }

    /// The sigma of every measurement, in its unit: the given one, or else `s/sqrt((1 - unknowns/values) f)`, with
    /// `1 - unknowns/values` at least `1/values`. `s` is the [spread](Search::spreads) of its residuals at an optimum
    /// (RMS, or by a median with a robust loss). `values` is the number of all residuals, those of the priors included.
    /// `f` is the fraction of the measurement's degrees of freedom that fitted nuisance parameters (arc lengths, a free
    /// tare) leave. The result is at least [`EXACT`] times the scale; zero residuals keep the present sigma.
    pub fn estimated_sigmas(&self, optimum: &Optimum) -> Vec<f64> {
        let total = optimum.residuals.len() as f64;
        // Fitted unknowns make residuals smaller than the noise.
        let freedom = (1.0 - self.unknowns.len() as f64 / total).max(1.0 / total);
        let mut spreads = self.spreads(optimum).into_iter();
        let mut sigmas = self.sigmas.clone();
        for (sigma, (experiment, measurement)) in sigmas.iter_mut().zip(all(self.experiments)) {
            let spread = spreads.next().unwrap_or(0.0);
            if measurement.sigma().is_none() && spread > 0.0 {
                // Exact data have no noise: a sigma of zero would make the weights infinite.
                let least = EXACT * measurement.scale(&experiment.problem);
                *sigma = (spread / (freedom * measurement.free_share()).sqrt()).max(least);
            }
        }
        sigmas
    }
}

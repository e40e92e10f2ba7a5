//! Bootstrap: fit data made by the fitted model and noise of the estimated size, again and again, and look
//! at how the estimates spread. The noise is normal; where neighbours resemble each other, it is blocks of
//! the residuals, long enough to hold what they have in common (Kuensch 1989). With noise that is drawn all
//! of it, and other values of the known numbers each time, it is the Monte Carlo that checks their budget.

use crate::code::Code;
use crate::error::Error;
use crate::fit::known::{self, Known};
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::Task;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::grade::{Severity, Warnings};
use crate::fit::uncertainty::noise::autocorrelation::{Correlations, Series};
use crate::fit::unknown::Unknown;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Replicates between two reports of progress.
const BATCH: usize = 16;

/// Spread of an estimate over bootstrap replicates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Bootstrap {
    /// Standard deviation of the estimates, in the parameter's unit.
    pub std_error: f64,
    /// 2.5 and 97.5 percentiles of the estimates, in the parameter's unit.
    pub interval95: [f64; 2],
    /// Estimate of each replicate, in the parameter's unit, where fits share a bootstrap.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub estimates: Vec<f64>,
}

/// Which replicates are run: their name, numbers and seed, and whether what each of them found is kept.
#[derive(Clone)]
pub(crate) struct Replicates {
    pub what: &'static str,
    pub numbers: Range<usize>,
    pub seed: u64,
    pub kept: bool,
}

/// What replicates differ by.
#[derive(Clone, Copy)]
pub(crate) struct Draws<'a> {
    /// Standard deviation of the noise of each measurement, in its unit.
    pub sigma: &'a [f64],
    pub knowns: &'a [Known],
    pub correlations: &'a Correlations,
    /// Whether noise that remembers is blocks of the residuals, not drawn.
    pub blocks: bool,
}

/// What every replicate needs; the threads share it.
struct Shared<'a> {
    task: Task<'a>,
    /// Simulated values at the optimum, in the order of the residuals.
    simulated: Vec<f64>,
    /// Standard deviation of the noise of every value, in its unit.
    noise: Vec<f64>,
    /// Noise to take blocks of, value by value, where it is not drawn.
    residuals: Option<Vec<f64>>,
    /// Series whose neighbours may resemble each other.
    series: &'a [Series],
    start: &'a [f64],
    knowns: &'a [Known],
    /// Of their correlations.
    root: DMatrix<f64>,
}

/// The experiments with the known numbers off by these errors.
fn with_errors(
    experiments: &mut [Experiment],
    knowns: &[Known],
    errors: &DVector<f64>,
) -> Result<(), Error> {
    for experiment in experiments {
        let scene = experiment.problem.scene();
        let own = knowns.iter().zip(errors).filter(|(k, _)| k.as_unknown().is_of(experiment));
        let off = own.filter_map(|(known, error)| {
            Some((known.parameter, known.parameter.of(scene)? + known.sigma * error))
        });
        let off: Vec<_> = off.collect();
        experiment.problem = experiment.problem.varied(off)?;
    }
    Ok(())
}

impl Shared<'_> {
    /// Estimates from one replicate, on the unknowns' scales, and the work they took.
    fn replicate(&self, seed: u64, number: usize) -> (Result<Vec<f64>, Error>, f64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number as u64);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let mut noise: Vec<f64> = self.noise.iter().map(|sigma| sigma * draw()).collect();
        // What was known before is one more measurement.
        let mut unknowns = self.task.unknowns.to_vec();
        for (unknown, x) in unknowns.iter_mut().zip(self.start) {
            let value = unknown.from_scale(*x);
            if let Some(prior) = &mut unknown.prior {
                prior.mean = value + prior.sigma * draw();
            }
        }
        let errors = &self.root * DVector::from_fn(self.knowns.len(), |_, _| draw());
        for series in self.series {
            let rows = &series.rows;
            match (series.block(), &self.residuals) {
                (Some(length), Some(residuals)) => {
                    for block in rows.chunks(length) {
                        let first = random.random_range(0..rows.len());
                        for (k, row) in block.iter().enumerate() {
                            noise[*row] = residuals[rows[(first + k) % rows.len()]];
                        }
                    }
                }
                (Some(_), None) => {
                    let own = |row: &usize| noise[*row] / self.noise[*row];
                    let remembered = series.ar1().color(rows.iter().map(own));
                    for (row, drawn) in rows.iter().zip(remembered) {
                        noise[*row] = self.noise[*row] * drawn;
                    }
                }
                (None, _) => {}
            }
        }
        let mut experiments = self.task.experiments.to_vec();
        let measurements = experiments.iter_mut().flat_map(|e| e.measurements.iter_mut());
        let seen = measurements.flat_map(|m| m.data.values_mut());
        for ((seen, simulated), noise) in seen.zip(&self.simulated).zip(noise) {
            *seen = simulated + noise;
        }
        if !self.knowns.is_empty()
            && let Err(error) = with_errors(&mut experiments, self.knowns, &errors)
        {
            return (Err(error), 0.0);
        }
        let task = Task { experiments: &experiments, unknowns: &unknowns, ..self.task };
        let search = task.search();
        let found = search.polish(self.start).and_then(|optimum| match optimum.converged {
            true => Ok(optimum.x),
            false => Err(Error::Fit(optimum.status)),
        });
        (found, search.work.total())
    }
}

/// The spread of every estimate over the replicates, each with other values of `knowns`; none where
/// there was no time for them.
pub(crate) fn spreads(
    fitted: Fitted,
    draws: Draws,
    replicates: Replicates,
    warnings: &mut Warnings,
) -> Vec<Option<Bootstrap>> {
    let (what, count) = (replicates.what, replicates.numbers.len());
    let search = fitted.search;
    let found = spread(fitted, draws, replicates);
    let (spreads, failed) = found.unwrap_or_else(|_| (vec![None; search.unknowns.len()], count));
    if search.is_stopped() {
        // Those that were done in time are no fair sample.
        return vec![None; search.unknowns.len()];
    }
    if failed > 0 {
        let words = format!(
            "{failed} of {count} fits of the {what} did not converge. They are left out, and the \
                             spread may be too small. Give a start or bounds"
        );
        warnings.add(Severity::Note, Code::ReplicatesFailed, words);
    }
    spreads
}

/// Runs the replicates; one spread per unknown, and how many replicates failed.
fn spread(
    fitted: Fitted,
    Draws { sigma, knowns, correlations, blocks }: Draws,
    Replicates { what, numbers, seed, kept }: Replicates,
) -> Result<(Vec<Option<Bootstrap>>, usize), Error> {
    let Fitted { search, optimum } = fitted;
    let (mut simulated, mut noise, mut units) = (Vec::new(), Vec::new(), Vec::new());
    for (own, sigma) in fitted.measured().zip(sigma) {
        let MeasuredResiduals { measurement, sigma: unit, residuals, .. } = own;
        let mut measurement = measurement.clone();
        let own = measurement.sigmas(unit);
        let seen = measurement.data.values_mut().into_iter().zip(residuals).zip(&own);
        simulated.extend(seen.map(|((seen, r), unit)| *seen + r * unit));
        units.extend(own);
        noise.extend(measurement.sigmas(*sigma));
    }
    // The fit has taken a part of the noise with it, and coordinates may have one of their own.
    let series = &correlations.series[..];
    let mut residuals = vec![0.0; simulated.len()];
    for series in series.iter().filter(|s| s.own) {
        let of = |row: &usize| optimum.residuals[*row];
        let square = series.rows.iter().map(|row| of(row).powi(2)).sum::<f64>();
        let scale = (series.variance * series.rows.len() as f64 / square).sqrt();
        for row in &series.rows {
            residuals[*row] = scale * units[*row] * of(row);
            noise[*row] = series.variance.sqrt() * units[*row];
        }
    }
    let (task, root, start) = (search.task(), known::root(knowns)?, &optimum.x[..]);
    let residuals = blocks.then_some(residuals);
    let shared = Shared { task, simulated, noise, residuals, series, start, knowns, root };
    let mut found: Vec<Vec<f64>> = Vec::new();
    let count = numbers.len();
    for done in (0..count).step_by(BATCH) {
        if search.is_stopped() {
            break;
        }
        let first = numbers.start + done;
        let batch = first..(first + BATCH).min(numbers.end);
        let results: Vec<_> = batch.into_par_iter().map(|k| shared.replicate(seed, k)).collect();
        for (result, work) in results {
            search.work.add(work);
            found.extend(result.ok());
        }
        search.report(&format!("{what}, {} of {count}", (done + BATCH).min(count)));
    }
    let spreads = (0..search.unknowns.len()).map(|i| {
        let unknown = &search.unknowns[i];
        let value = unknown.from_scale(optimum.x[i]);
        let x: Vec<f64> = found.iter().map(|x| x[i]).collect();
        let estimates =
            if kept { x.iter().map(|x| unknown.from_scale(*x)).collect() } else { Vec::new() };
        Some(Bootstrap { estimates, ..spread_of(unknown, value, x)? })
    });
    Ok((spreads.collect(), count - found.len()))
}

#[cfg(feature = "cli")]
impl Bootstrap {
    /// The spread of what all replicates found that fits have shared out, about the parameter's value.
    pub(crate) fn of(unknown: &Unknown, value: f64, estimates: &[f64]) -> Option<Self> {
        let x = estimates.iter().map(|estimate| unknown.to_scale(*estimate)).collect();
        spread_of(unknown, value, x)
    }
}

/// The spread of estimates that are on the scale of the fit.
fn spread_of(unknown: &Unknown, value: f64, mut x: Vec<f64>) -> Option<Bootstrap> {
    if x.len() < 2 {
        return None;
    }
    x.sort_by(f64::total_cmp);
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let sd = (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let percentile = |p: f64| {
        let place = p * (n - 1.0);
        let (below, fraction) = (place.floor(), place.fract());
        let above = x[(below as usize + 1).min(x.len() - 1)];
        unknown.from_scale(x[below as usize] * (1.0 - fraction) + above * fraction)
    };
    Some(Bootstrap {
        std_error: sd * unknown.slope(value),
        interval95: [percentile(0.025), percentile(0.975)],
        estimates: Vec::new(),
    })
}

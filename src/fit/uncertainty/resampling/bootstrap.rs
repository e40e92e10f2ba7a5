//! Parametric bootstrap and Monte Carlo: fits of data made by the fitted model and random noise.
//!
//! Every replicate adds noise to the simulated values at the optimum and fits them again from the optimum; the spread
//! of the estimates is that of the parameters. The noise is normal, and means of priors have random errors of their
//! sigma. Autocorrelated noise of a bootstrap consists of random blocks of the residuals, longer than its correlation
//! (Kuensch 1989; Politis and White 2004). A Monte Carlo draws it from its AR(1) model, and the known inputs from their
//! distributions: it verifies the linear uncertainty budget (JCGM 101). [`spreads`] returns the standard deviation and
//! the 2.5 and 97.5 percentiles of each estimate, in its unit. Both are computed on the scale of the fit (logarithm of
//! a positive parameter) and converted. Fits that do not converge are left out, with a note; the spread is none for
//! fewer than two, or after a stop. Replicate `n` has the random stream `n`, so that results do not depend on threads.

use crate::code::Code;
use crate::error::Error;
use crate::fit::known::{self, Known};
use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::observed_experiment::ExperimentRun;
use crate::fit::search::Search;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::noise::autocorrelation::NoiseModel;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::fit::unknown::Unknown;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Number of replicates between two reports of progress, run in parallel. Larger: fewer reports and a later stop.
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

/// Random data of the replicates, and the replicates to be run.
#[derive(Clone)]
pub(crate) struct Resampling<'a> {
    /// Name for messages.
    pub name: &'static str,
    /// Numbers of the replicates, each with a random stream of its own.
    pub numbers: Range<usize>,
    /// Seed of the random numbers of all replicates.
    pub seed: u64,
    /// Whether the estimates of each replicate are stored.
    pub stores_estimates: bool,
    /// Standard deviation of the noise of each measurement, in its unit.
    pub sigma: &'a [f64],
    /// Inputs with random errors.
    pub knowns: &'a [Known],
    /// Series of autocorrelated noise.
    pub correlations: &'a NoiseModel,
    /// Whether autocorrelated noise consists of blocks of the residuals, instead of draws from its AR(1) model.
    pub draws_blocks: bool,
}

/// Inputs of all replicates, shared by the threads.
struct ReplicateInputs<'a> {
    resampling: &'a Resampling<'a>,
    search: &'a Search<'a>,
    /// Simulated values at the optimum, in the order of the residuals.
    simulated: Vec<f64>,
    /// Standard deviation of the noise of every value, in its unit.
    noise: Vec<f64>,
    /// Residuals that blocks are drawn from, scaled to the variance of the noise, in the unit of every value.
    residuals: Vec<f64>,
    /// Optimum on the unknowns' scales.
    start: &'a [f64],
    /// Simulations with derivatives at the optimum; none where the inputs of replicates differ.
    runs: Option<Vec<ExperimentRun>>,
    /// Root of the correlation matrix of the known inputs.
    root: DMatrix<f64>,
}

/// Changes the known inputs of the experiments, in place, by `errors`, one per input and in units of its standard
/// uncertainty. Experiments without an input keep their value. Without inputs nothing changes. Error: a scene does not
/// allow the changed value.
fn add_input_errors(
    experiments: &mut [Experiment],
    knowns: &[Known],
    errors: &DVector<f64>,
) -> Result<(), Error> {
    if knowns.is_empty() {
        return Ok(());
    }
    for experiment in experiments {
        let scene = experiment.problem.scene();
        let own = knowns.iter().zip(errors).filter(|(k, _)| k.as_unknown().is_of(experiment));
        let values = own.filter_map(|(known, error)| {
            Some((known.parameter, known.parameter.of(scene)? + known.sigma * error))
        });
        let values: Vec<_> = values.collect();
        experiment.problem = experiment.problem.with_fixed_layout(values)?;
    }
    Ok(())
}

impl ReplicateInputs<'_> {
    /// Estimates of replicate `number`, on the unknowns' scales (logarithms of positive parameters), and the work of
    /// its fit, steps times segments. The data are the simulated values plus noise, from the random stream `number`;
    /// the mean of a prior is the optimum plus a random error of its sigma, and inputs have random errors with their
    /// correlations. The fit starts at the optimum. Error: a fit that fails or does not converge, or a scene that does
    /// not allow the inputs.
    fn replicate(&self, number: usize) -> (Result<Vec<f64>, Error>, f64) {
        let Resampling { seed, knowns, correlations, draws_blocks, .. } = self.resampling;
        let mut random = ChaCha8Rng::seed_from_u64(*seed);
        // A stream of its own: the result does not depend on the order in which threads run replicates.
        random.set_stream(number as u64);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        // White noise of all values first, so that the random numbers do not depend on the series.
        let mut noise: Vec<f64> = self.noise.iter().map(|sigma| sigma * draw()).collect();
        // A prior is a measurement of the parameter, with an error of its own.
        let mut unknowns = self.search.unknowns.to_vec();
        for (unknown, x) in unknowns.iter_mut().zip(self.start) {
            let value = unknown.from_scale(*x);
            if let Some(prior) = &mut unknown.prior {
                prior.mean = value + prior.sigma * draw();
            }
        }
        let errors = &self.root * DVector::from_fn(knowns.len(), |_, _| draw());
        // Autocorrelated noise: random blocks of the residuals, or the AR(1) model driven by the white noise.
        for series in &correlations.series {
            let (rows, Some(length)) = (&series.rows, series.block_length()) else { continue };
            if *draws_blocks {
                for block in rows.chunks(length) {
                    let first = random.random_range(0..rows.len());
                    // Blocks go on at the start of the series, so that all residuals are equally frequent.
                    for (k, row) in block.iter().enumerate() {
                        noise[*row] = self.residuals[rows[(first + k) % rows.len()]];
                    }
                }
            } else {
                let white = rows.iter().map(|row| noise[*row] / self.noise[*row]);
                let colored = series.ar1().color(white);
                rows.iter().zip(colored).for_each(|(row, x)| noise[*row] = self.noise[*row] * x);
            }
        }
        // Simulated values with noise replace the measured ones.
        let mut experiments = self.search.experiments.to_vec();
        let measurements = experiments.iter_mut().flat_map(|e| e.measurements.iter_mut());
        let values = measurements.flat_map(|m| m.data.values_mut());
        for ((value, simulated), noise) in values.zip(&self.simulated).zip(noise) {
            *value = simulated + noise;
        }
        if let Err(error) = add_input_errors(&mut experiments, knowns, &errors) {
            return (Err(error), 0.0);
        }
        let (experiments, unknowns) = (&experiments[..], &unknowns[..]);
        let search = Search { experiments, unknowns, ..self.search.detached() };
        // All replicates start at the optimum: they differ from it by their noise only.
        let found = match &self.runs {
            Some(runs) => search.polish_from_runs(self.start, runs),
            None => search.polish(self.start),
        };
        let found = found.and_then(|optimum| match optimum.converged {
            true => Ok(optimum.x),
            false => Err(Error::Fit(optimum.status)),
        });
        (found, search.work.total())
    }
}

/// Spread of every estimate over the replicates, one entry per unknown. None where the fit is stopped before all are
/// done, or fewer than two converge. Failed replicates add one note and are left out. The estimates of each replicate
/// are stored if `resampling` requests it. If the simulation at the optimum fails, all count as failed.
pub(crate) fn spreads(
    fitted: Fitted,
    resampling: &Resampling,
    warnings: &mut Warnings,
) -> Vec<Option<Bootstrap>> {
    let Fitted { search, optimum } = fitted;
    let found = replicates(fitted, resampling).unwrap_or_default();
    if search.is_stopped() {
        // Replicates that are done earlier than others are no random sample.
        return vec![None; search.unknowns.len()];
    }
    let (name, count) = (resampling.name, resampling.numbers.len());
    // Failed replicates are no random sample of all: the spread without them is doubtful.
    let failed = count - found.len();
    if failed > 0 {
        let text = format!(
            "{failed} of {count} fits of the {name} did not converge. They are left out, and the \
                             spread may be too small. Give a start or bounds"
        );
        warnings.add(Severity::Note, Code::ReplicatesFailed, text);
    }
    let spread = |(i, unknown): (usize, &Unknown)| {
        let estimates: Vec<f64> = found.iter().map(|x| unknown.from_scale(x[i])).collect();
        let x = found.iter().map(|x| x[i]).collect();
        let spread = Bootstrap::from_scaled(unknown, unknown.from_scale(optimum.x[i]), x)?;
        Some(if resampling.stores_estimates { Bootstrap { estimates, ..spread } } else { spread })
    };
    search.unknowns.iter().enumerate().map(spread).collect()
}

/// Runs the replicates in parallel, in batches of [`BATCH`], and adds their work to that of the search. Series with a
/// noise of their own have their own variance, and their residuals are scaled to it before blocks are drawn. With exact
/// inputs all replicates share the simulation at the optimum. Returns the estimates of the converged ones on the
/// unknowns' scales, in the order of their numbers; fewer after a stop. Error: the simulation at the optimum fails, or
/// the correlations of the inputs contradict each other.
fn replicates(fitted: Fitted, resampling: &Resampling) -> Result<Vec<Vec<f64>>, Error> {
    let Fitted { search, optimum } = fitted;
    let (mut simulated, mut noise, mut units) = (Vec::new(), Vec::new(), Vec::new());
    for (own, sigma) in fitted.measured().zip(resampling.sigma) {
        let MeasuredResiduals { measurement, sigma: unit, residuals, .. } = own;
        let mut measurement = measurement.clone();
        let own = measurement.sigmas(unit);
        // Residuals are simulated less measured values, over their units.
        let observed = measurement.data.values_mut().into_iter().zip(residuals).zip(&own);
        simulated.extend(observed.map(|((observed, r), unit)| *observed + r * unit));
        units.extend(own);
        noise.extend(measurement.sigmas(*sigma));
    }
    // The fit absorbs a part of the noise: residuals are smaller, and are scaled to its variance.
    let mut residuals = vec![0.0; simulated.len()];
    for series in resampling.correlations.series.iter().filter(|s| s.has_own_noise()) {
        let square = series.rows.iter().map(|row| optimum.residuals[*row].powi(2)).sum::<f64>();
        let scale = (series.variance * series.len() as f64 / square).sqrt();
        for row in &series.rows {
            residuals[*row] = scale * units[*row] * optimum.residuals[*row];
            noise[*row] = series.variance.sqrt() * units[*row];
        }
    }
    // All replicates start at the optimum, and share its simulation unless their inputs differ.
    let (root, start) = (known::correlation_root(resampling.knowns)?, &optimum.x[..]);
    let runs = match resampling.knowns.is_empty() {
        true => Some(search.all_residuals()?.runs(start, true)?),
        false => None,
    };
    let inputs =
        ReplicateInputs { resampling, search, simulated, noise, residuals, start, runs, root };
    let mut found = Vec::new();
    let Range { start, end } = resampling.numbers;
    // Batches, so that progress is reported and a stop takes effect.
    for first in (start..end).step_by(BATCH) {
        if search.is_stopped() {
            break;
        }
        let batch = first..(first + BATCH).min(end);
        let done = batch.end - start;
        let results: Vec<_> =
            batch.into_par_iter().map(|number| inputs.replicate(number)).collect();
        for (result, work) in results {
            search.work.add(work);
            found.extend(result.ok());
        }
        search.report(&format!("{}, {done} of {}", resampling.name, end - start));
    }
    Ok(found)
}

impl Bootstrap {
    /// Spread of the estimates of all replicates of a shared bootstrap, `all` in the parameter's unit, about its
    /// `value`; none for fewer than two.
    #[cfg(feature = "cli")]
    pub(crate) fn from_estimates(unknown: &Unknown, value: f64, all: &[f64]) -> Option<Self> {
        let x = all.iter().map(|estimate| unknown.to_scale(*estimate)).collect();
        Self::from_scaled(unknown, value, x)
    }

    /// Spread of estimates `x` on the unknown's scale (logarithm of a positive parameter) about its `value` in its
    /// unit. The standard deviation of `x` (over `n - 1`) is converted by the derivative at `value`. Percentiles are
    /// linear interpolations of the sorted `x`, then converted. None for fewer than two.
    fn from_scaled(unknown: &Unknown, value: f64, mut x: Vec<f64>) -> Option<Self> {
        if x.len() < 2 {
            return None;
        }
        x.sort_by(f64::total_cmp);
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        let sd = (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        // Percentiles on the scale of the fit, where the distribution is nearly normal.
        let percentile = |p: f64| {
            let place = p * (n - 1.0);
            let (below, fraction) = (place.floor() as usize, place.fract());
            let above = x[(below + 1).min(x.len() - 1)];
            unknown.from_scale(x[below] * (1.0 - fraction) + above * fraction)
        };
        Some(Self {
            std_error: sd * unknown.slope(value),
            interval95: [percentile(0.025), percentile(0.975)],
            estimates: Vec::new(),
        })
    }
}

//! What an optimum is worth: errors, doubts and a verdict.

use super::experiment::all;
use super::journal::Stage;
use super::residuals::half_square;
use super::search::{Optimum, Search};
use super::uncertainty::{Local, quantile95};
use super::{
    Estimate, Experiment, Fit, FitReport, Loss, LossEffect, Measurement, Profile, Refinement,
    ResidualTests, UNEXPLAINED, Unknown, bootstrap, discretization, prediction, profile, replay,
};
use crate::error::Error;
use nalgebra::DMatrix;

/// Residuals below this part of the rod's length are rounding errors, not noise.
const ROUNDING: f64 = 1e-8;
/// Values per coordinate from which on tests are trusted to find what is not noise.
const ENOUGH: usize = 30;

/// What the noise at an optimum makes of misfits and derivatives.
pub(super) struct Noise {
    /// Variance of the residuals under squares; 1 when sigma is known or was estimated before.
    pub variance: f64,
    /// A rise of twice the misfit by the square of a quantile times this ends an interval.
    pub rise: f64,
    /// How many standard deviations a 95 % interval reaches to each side.
    pub reach: f64,
    /// Root of the information of every residual: below 1 under robust losses.
    pub weights: Vec<f64>,
}

impl Fit {
    /// What the residuals at an optimum say of the noise.
    fn noise(&self, search: &Search, optimum: &Optimum) -> Noise {
        let total = optimum.residuals.len();
        let freedom = (total - self.unknowns.len()) as f64;
        let known = all(search.experiments).all(|(_, m)| m.sigma().is_some());
        let settled = known || self.weights_depend_on_the_fit(search.experiments);
        let variance = if settled { 1.0 } else { 2.0 * optimum.cost / freedom };
        let mut weights = Vec::with_capacity(total);
        // Sums of psi' and psi^2 (Huber 1981).
        let (mut slope, mut square) = (0.0, 0.0);
        for (_, measurement, _, own) in search.measured(optimum) {
            let loss = measurement.loss();
            let part = self.unknowns.len() * own.len() / total;
            let weight = loss.information(own, part).sqrt();
            weights.extend(std::iter::repeat_n(weight, own.len()));
            for r in own {
                let [psi, by_r] = loss.influence(*r);
                (slope, square) = (slope + by_r, square + psi * psi);
            }
        }
        weights.resize(total, 1.0);
        let robust = all(search.experiments).any(|(_, m)| m.loss().is_robust());
        let reach = quantile95((!known).then_some(freedom));
        Noise { variance, rise: if robust { square / slope } else { variance }, reach, weights }
    }

    /// What `optimum` says about the parameters, and what speaks against it.
    pub(super) fn assess(&self, search: &Search, optimum: &Optimum) -> Result<FitReport, Error> {
        let noise = self.noise(search, optimum);
        // The size of what was measured in units of the noise.
        let sizes = search.measured(optimum).map(|(experiment, m, sigma, own)| {
            (m.scale(&experiment.problem) / sigma).powi(2) * own.len() as f64
        });
        let effect = sizes.sum::<f64>().sqrt();
        let residuals = search.all_residuals()?;
        let rise = |step: &[f64]| {
            let x: Vec<f64> = optimum.x.iter().zip(step).map(|(x, s)| x + s).collect();
            // What cannot be simulated does not fit.
            residuals.residuals(&x).map_or(f64::INFINITY, |r| {
                2.0 * (half_square(&r) - optimum.cost) / (noise.rise * noise.reach.powi(2))
            })
        };
        let rows = weighted(&optimum.jacobian, &noise.weights);
        let local = Local::new(&self.unknowns, &rows, noise.variance, effect, rise)?;
        if search.is_stopped() {
            // Half an analysis is none.
            return Err(Error::Interrupted);
        }
        let mut sigma = search.sigmas.clone();
        search.estimate_sigmas(optimum, &mut sigma);
        let mut report = FitReport {
            converged: optimum.converged,
            parameters: self.estimates(optimum, &local, noise.reach),
            correlation: local.correlation.clone(),
            residual_rms: residual_rms(search, optimum),
            sigma,
            singular_values: local.singular_values.clone(),
            not_identifiable: local.findings.clone(),
            discretization_error: Vec::new(),
            residual_tests: Vec::new(),
            losses: losses(search, optimum, &noise),
            predictions: Vec::new(),
            basins: search.journal.basins(&self.unknowns, Some((&optimum.x, optimum.cost))),
            simulations: 0.0,
            wall_seconds: 0.0,
            status: String::new(),
            verdict: String::new(),
            warnings: Vec::new(),
            interrupted: false,
            evidence: None,
        };
        report.warnings.extend(self.bounds_reached(optimum, &local));
        report.warnings.extend(unexplained(search, optimum));
        report.warnings.extend(self.surprises(optimum));
        // Rounding errors are neither noise nor made by another mesh.
        let rounding = search
            .measured(optimum)
            .zip(search.spreads(optimum))
            .all(|((experiment, m, ..), spread)| spread <= ROUNDING * m.scale(&experiment.problem));
        if !rounding {
            test_residuals(search, optimum, &mut report);
            self.add_discretization(search, optimum, &local, &noise, &mut report);
        }
        let mut profiles = Vec::new();
        if optimum.converged && local.findings.is_empty() {
            self.add_observed_information(search, optimum, &noise, &mut report);
            profiles = self.add_profiles(search, optimum, (&local, &noise), &mut report);
            self.add_bootstrap(search, optimum, &mut report);
        }
        prediction::add(&self.experiments, (search, optimum), &local, &mut report);
        if self.keep_evidence {
            let mut evidence = replay::evidence(search, Some(optimum), &report.sigma);
            if let Err(error) = replay::add_motion(search, &optimum.x, &mut evidence) {
                report.warnings.push(format!("no shapes of the rod: {error}"));
            }
            evidence.profiles = profiles;
            report.evidence = Some(evidence);
        }
        report.interrupted = search.is_stopped();
        let identified = report.parameters.iter().all(|e| e.identifiable);
        report.status = match (optimum.converged, identified) {
            (true, true) if report.interrupted => "interrupted after convergence".to_string(),
            (true, true) => "converged".to_string(),
            (true, false) => format!("not identifiable: {}", local.in_words()),
            (false, _) => format!("not converged: {}", optimum.status),
        };
        if !optimum.converged {
            report.warnings.extend(local.findings.iter().map(|f| f.words.clone()));
        }
        report.verdict = match (optimum.converged, identified, report.warnings.is_empty()) {
            (true, true, _) if report.interrupted => {
                "a minimum, but what was to be done beyond it is not complete".into()
            }
            (false, ..) => "do not believe this: the fit did not converge".into(),
            (_, false, _) => "the data do not determine all that was asked for".into(),
            (true, true, false) => "doubtful: see the warnings".into(),
            (true, true, true) => "nothing speaks against this".into(),
        };
        Ok(report)
    }

    /// What an interrupted search has found so far: values without errors.
    pub(super) fn unfinished(&self, search: &Search) -> Result<FitReport, Error> {
        let best = search.journal.best().ok_or(Error::Interrupted)?;
        let (stage, whole) = (best.stage, best.stage == Stage::Full);
        let optimum = Optimum {
            x: best.x,
            cost: best.cost,
            residuals: best.residuals,
            jacobian: Vec::new(),
            counts: best.counts,
            converged: false,
            status: "interrupted".into(),
        };
        let mut sigma = search.sigmas.clone();
        search.estimate_sigmas(&optimum, &mut sigma);
        let parameters = self.unknowns.iter().zip(&optimum.x).map(|(unknown, x)| Estimate {
            name: unknown.parameter,
            experiments: unknown.experiments.clone(),
            value: Some(unknown.from_scale(*x)),
            std_error: None,
            interval95: None,
            identifiable: false,
            prior: unknown.prior,
            observed_std_error: None,
            profile95: None,
            bootstrap: None,
        });
        let n = self.unknowns.len();
        let evidence =
            self.keep_evidence.then(|| replay::evidence(search, whole.then_some(&optimum), &sigma));
        Ok(FitReport {
            converged: false,
            parameters: parameters.collect(),
            correlation: vec![vec![None; n]; n],
            residual_rms: residual_rms(search, &optimum),
            sigma,
            singular_values: Vec::new(),
            not_identifiable: Vec::new(),
            discretization_error: Vec::new(),
            residual_tests: Vec::new(),
            losses: Vec::new(),
            predictions: Vec::new(),
            basins: search.journal.basins(&self.unknowns, None),
            simulations: 0.0,
            wall_seconds: 0.0,
            status: optimum.status,
            verdict: format!(
                "do not believe this: these are the best values when the search was stopped ({})",
                stage.name()
            ),
            warnings: Vec::new(),
            interrupted: true,
            evidence,
        })
    }

    fn estimates(&self, optimum: &Optimum, local: &Local, reach: f64) -> Vec<Estimate> {
        let estimate = |(i, unknown): (usize, &Unknown)| {
            let x = optimum.x[i];
            let value = unknown.from_scale(x);
            let deviation = local.deviation[i].filter(|_| optimum.converged);
            let known = local.deviation[i].is_some();
            let ends = |sd: f64| {
                let [low, high] = unknown.parameter.limits();
                [x - reach * sd, x + reach * sd].map(|x| unknown.from_scale(x).clamp(low, high))
            };
            Estimate {
                name: unknown.parameter,
                experiments: unknown.experiments.clone(),
                value: known.then_some(value),
                std_error: deviation.map(|sd| sd * unknown.slope(value)),
                interval95: deviation.map(ends),
                identifiable: known,
                prior: unknown.prior,
                observed_std_error: None,
                profile95: None,
                bootstrap: None,
            }
        };
        self.unknowns.iter().enumerate().map(estimate).collect()
    }

    fn bounds_reached(&self, optimum: &Optimum, local: &Local) -> Vec<String> {
        let words = |(i, unknown): (usize, &Unknown)| {
            let ([low, high], x) = (unknown.scaled_bounds(), optimum.x[i]);
            (local.deviation[i].is_some() && (x <= low || x >= high)).then(|| {
                let bound = unknown.from_scale(if x <= low { low } else { high });
                format!(
                    "{unknown} ended at its bound {bound}: its interval does not account for that"
                )
            })
        };
        self.unknowns.iter().enumerate().filter_map(words).collect()
    }

    /// Data that contradict what was known before them.
    fn surprises(&self, optimum: &Optimum) -> Vec<String> {
        let words = |(unknown, x): (&Unknown, &f64)| {
            let surprise = unknown.surprise(*x).filter(|s| s.abs() > 3.0)?;
            Some(format!(
                "{unknown} ended {:.1} sigma from its prior's mean: data and prior contradict each \
                 other",
                surprise.abs()
            ))
        };
        self.unknowns.iter().zip(&optimum.x).filter_map(words).collect()
    }

    fn add_discretization(
        &self,
        search: &Search,
        optimum: &Optimum,
        local: &Local,
        noise: &Noise,
        report: &mut FitReport,
    ) {
        let how = self.analysis.discretization_error;
        if how == Refinement::None || !optimum.converged {
            return;
        }
        match discretization::errors(search, optimum, (local, &noise.weights), how) {
            Ok(errors) => report.discretization_error = errors,
            Err(error) => report
                .warnings
                .push(format!("the discretisation error is unknown: a finer run failed ({error})")),
        }
        for (estimate, error) in report.parameters.iter().zip(&report.discretization_error) {
            if let (Some(value), Some(sd), Some(relative)) =
                (estimate.value, estimate.std_error, error.relative)
                && relative * value.abs() > 2.0 * noise.reach * sd
            {
                report.warnings.push(format!(
                    "{}: mesh and step may be {:.2} % off, more than the 95 % interval is wide; refine segments or step",
                    estimate.label(),
                    100.0 * relative
                ));
            }
        }
    }

    fn add_observed_information(
        &self,
        search: &Search,
        optimum: &Optimum,
        noise: &Noise,
        report: &mut FitReport,
    ) {
        if !self.analysis.observed_information {
            return;
        }
        let hessian = search.all_residuals().and_then(|r| r.hessian_at(&optimum.x));
        let hessian = match hessian {
            Ok(hessian) => hessian,
            Err(error) => {
                let words = format!("no observed information: its simulation failed ({error})");
                return report.warnings.push(words);
            }
        };
        let n = self.unknowns.len();
        let Some(factors) = DMatrix::from_fn(n, n, |i, j| hessian[i][j]).cholesky() else {
            let words =
                "the Hessian of the misfit is not positive: this is not a minimum of its own";
            return report.warnings.push(words.into());
        };
        let inverse = factors.inverse();
        // The gradient scatters with psi^2; under squares that is the variance times the Hessian.
        let robust = noise.weights.iter().any(|w| *w != 1.0);
        let covariance = match robust {
            false => noise.variance * inverse,
            true => {
                let scatter = scatter(search, optimum);
                &inverse * scatter * &inverse
            }
        };
        for (i, estimate) in report.parameters.iter_mut().enumerate() {
            let sd = covariance[(i, i)].sqrt();
            estimate.observed_std_error =
                estimate.value.map(|value| sd * self.unknowns[i].slope(value));
        }
    }

    fn add_profiles(
        &self,
        search: &Search,
        optimum: &Optimum,
        (local, noise): (&Local, &Noise),
        report: &mut FitReport,
    ) -> Vec<Profile> {
        let mut profiles = Vec::new();
        if !self.analysis.profile {
            return profiles;
        }
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let Some(sd) = local.deviation[i].filter(|sd| *sd > 0.0) else { continue };
            let found = profile::interval(search, optimum, i, (sd, noise.rise.sqrt(), noise.reach));
            if search.is_stopped() {
                // Half a profile says nothing about its ends.
                break;
            }
            report.parameters[i].profile95 = Some(found.values(unknown));
            profiles.push(found.profile(unknown, noise.reach));
            if let Some(x) = found.better {
                report.warnings.push(format!(
                    "{unknown} = {:e} fits better: this is not the best minimum",
                    unknown.from_scale(x)
                ));
            }
        }
        profiles
    }

    fn add_bootstrap(&self, search: &Search, optimum: &Optimum, report: &mut FitReport) {
        let count = self.analysis.bootstrap;
        if count == 0 {
            return;
        }
        let plan = (count, self.analysis.seed);
        let (spreads, failed) = bootstrap::spread(search, optimum, &report.sigma, plan);
        if search.is_stopped() {
            // Those that were done in time are no fair sample.
            return;
        }
        for (estimate, spread) in report.parameters.iter_mut().zip(spreads) {
            estimate.bootstrap = spread;
        }
        if failed > 0 {
            report
                .warnings
                .push(format!("{failed} of {count} bootstrap replicates did not converge"));
        }
    }
}

fn weighted(rows: &[Vec<f64>], weights: &[f64]) -> Vec<Vec<f64>> {
    let scaled = |(row, w): (&Vec<f64>, &f64)| row.iter().map(|d| d * w).collect();
    rows.iter().zip(weights).map(scaled).collect()
}

/// Covariance of the gradient of the misfit: `sum psi^2 j j'`, measurement by measurement with the
/// mean of `psi^2`, and 1 for priors.
fn scatter(search: &Search, optimum: &Optimum) -> DMatrix<f64> {
    let mut sizes = Vec::with_capacity(optimum.residuals.len());
    for (_, measurement, _, own) in search.measured(optimum) {
        let square = |r: &f64| measurement.loss().influence(*r)[0].powi(2);
        let mean = own.iter().map(square).sum::<f64>() / own.len().max(1) as f64;
        sizes.extend(std::iter::repeat_n(mean, own.len()));
    }
    sizes.resize(optimum.residuals.len(), 1.0);
    let n = optimum.x.len();
    let rows = optimum.jacobian.iter().zip(&sizes);
    DMatrix::from_fn(n, n, |i, j| rows.clone().map(|(row, size)| size * row[i] * row[j]).sum())
}

/// Of all positions, m; of frequencies, rad/s, where there are only those.
fn residual_rms(search: &Search, optimum: &Optimum) -> f64 {
    let of_unit = |unit: &str| {
        let (mut sum, mut count) = (0.0, 0);
        for (_, _, sigma, own) in search.measured(optimum).filter(|(_, m, ..)| m.unit() == unit) {
            sum += own.iter().map(|r| (r * sigma).powi(2)).sum::<f64>();
            count += own.len();
        }
        (count > 0).then(|| (sum / count as f64).sqrt())
    };
    of_unit("m").or_else(|| of_unit("rad/s")).unwrap_or(0.0)
}

/// What robust losses did.
fn losses(search: &Search, optimum: &Optimum, noise: &Noise) -> Vec<LossEffect> {
    let mut weights = &noise.weights[..];
    let mut effects = Vec::new();
    for (experiment, measurement, _, own) in search.measured(optimum) {
        let (mine, others) = weights.split_at(own.len());
        weights = others;
        let loss = measurement.loss();
        if loss != Loss::Squares {
            effects.push(LossEffect {
                observation: experiment.label(measurement),
                loss,
                beyond_scale: own.iter().filter(|r| r.abs() > loss.scale()).count(),
                beyond_5_sigma: own.iter().filter(|r| r.abs() > 5.0).count(),
                values: own.len(),
                error_factor: mine.first().map_or(1.0, |w| w.recip()),
            });
        }
    }
    effects
}

/// What of the measurements is left, if it is too much.
fn unexplained(search: &Search, optimum: &Optimum) -> Vec<String> {
    let mut warnings = Vec::new();
    let spreads = search.spreads(optimum);
    for ((experiment, measurement, _, own), rms) in search.measured(optimum).zip(spreads) {
        let (label, unit) = (experiment.label(measurement), measurement.unit());
        let size = measurement.size(&experiment.problem);
        let noise = 3.0 * measurement.sigma().unwrap_or(0.0);
        if rms > (UNEXPLAINED * size).max(noise) && !is_noisy(experiment, measurement, rms, own) {
            warnings.push(format!(
                "{label}: the model leaves {:.0} % of what was observed unexplained ({rms:.3e} {unit} of {size:.3e} {unit})",
                100.0 * rms / size.max(f64::MIN_POSITIVE)
            ));
        }
        if let Some(sigma) = measurement.sigma().filter(|sigma| rms > 1.5 * sigma) {
            warnings.push(format!(
                "{label}: the residuals are {:.1} times the stated sigma; the intervals are too narrow",
                rms / sigma
            ));
        }
    }
    warnings
}

/// Tests every coordinate of a measurement, whose residuals these are, for being noise.
fn residual_tests(
    experiment: &Experiment,
    measurement: &Measurement,
    residuals: &[f64],
) -> Vec<ResidualTests> {
    if let Measurement::Frequencies(_) = measurement {
        return Vec::new();
    }
    let tests = measurement.coordinates(&experiment.problem).into_iter().filter_map(|coordinate| {
        let seen = coordinate.places.iter().filter(|(k, _)| *k < residuals.len());
        let (times, values): (Vec<f64>, Vec<f64>) = seen.map(|(k, t)| (t, residuals[*k])).unzip();
        let label = experiment.label(measurement);
        ResidualTests::new(label, coordinate.axis, &times, &values, measurement.loss())
    });
    tests.collect()
}

/// Whether the record is noisy enough, and long enough to tell, that what is left of it is
/// noise. At a wrong minimum more than half is left.
pub(super) fn is_noisy(
    experiment: &Experiment,
    measurement: &Measurement,
    rms: f64,
    residuals: &[f64],
) -> bool {
    let tests = residual_tests(experiment, measurement, residuals);
    rms <= 0.5 * measurement.size(&experiment.problem)
        && residuals.len() >= ENOUGH * tests.len().max(1)
        && tests.iter().all(ResidualTests::is_noise)
}

fn test_residuals(search: &Search, optimum: &Optimum, report: &mut FitReport) {
    for (experiment, measurement, _, own) in search.measured(optimum) {
        for tests in residual_tests(experiment, measurement, own) {
            if !tests.is_noise() {
                report.warnings.push(format!(
                    "{}, {}: {}: the model misses something, and the intervals are too narrow",
                    tests.observation, tests.axis, tests.verdict
                ));
            }
            report.residual_tests.push(tests);
        }
    }
}

//! What an optimum is worth: errors, doubts and a verdict.

use super::journal::Stage;
use super::residuals::half_square;
use super::search::{Optimum, Search};
use super::uncertainty::{Local, quantile95};
use super::{
    Estimate, Fit, FitReport, Observation, Profile, Refinement, ResidualTests, UNEXPLAINED,
    Unknown, bootstrap, discretization, profile, replay, rms_per_observation,
};
use crate::error::Error;

/// Residuals below this part of the rod's length are rounding errors, not noise.
const ROUNDING: f64 = 1e-8;
/// Values per coordinate from which on tests are trusted to find what is not noise.
const ENOUGH: usize = 30;

impl Fit {
    /// What `optimum` says about the parameters, and what speaks against it.
    pub(super) fn assess(&self, search: &Search, optimum: &Optimum) -> Result<FitReport, Error> {
        let sigmas = &search.sigmas;
        let n = optimum.residuals.len() as f64;
        let freedom = n - self.unknowns.len() as f64;
        let known_noise = self.observations.iter().all(|o| o.sigma.is_some());
        let variance = if known_noise { 1.0 } else { 2.0 * optimum.cost / freedom };
        // The size of the observed motion in units of the noise.
        let motions = self.observations.iter().zip(sigmas).zip(&optimum.counts);
        let effect: f64 = motions
            .map(|((o, sigma), count)| {
                (self.problem.length().max(o.spread()) / sigma).powi(2) * *count as f64
            })
            .sum::<f64>()
            .sqrt();
        let reach = quantile95((!known_noise).then_some(freedom));
        let residuals = search.residuals(search.duration())?;
        let rise = |step: &[f64]| {
            let x: Vec<f64> = optimum.x.iter().zip(step).map(|(x, s)| x + s).collect();
            // What cannot be simulated does not fit.
            residuals.residuals(&x).map_or(f64::INFINITY, |r| {
                2.0 * (half_square(&r) - optimum.cost) / (variance * reach * reach)
            })
        };
        let local = Local::new(&self.unknowns, &optimum.jacobian, variance, effect, rise)?;
        self.problem.check_stop()?;
        let rms = rms_per_observation(optimum, sigmas);
        let squares: f64 = rms.iter().zip(&optimum.counts).map(|(r, c)| r * r * *c as f64).sum();
        let mut noise = sigmas.to_vec();
        self.estimate_sigmas(optimum, &mut noise);
        let mut report = FitReport {
            converged: optimum.converged,
            parameters: self.estimates(optimum, &local, reach),
            correlation: local.correlation.clone(),
            residual_rms: (squares / n).sqrt(),
            sigma: noise,
            singular_values: local.singular_values.clone(),
            not_identifiable: local.findings.clone(),
            discretization_error: Vec::new(),
            residual_tests: Vec::new(),
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
        report.warnings.extend(self.unexplained(optimum, &rms));
        // Rounding errors are neither noise nor made by another mesh.
        if report.residual_rms > ROUNDING * self.problem.length() {
            self.test_residuals(optimum, &mut report);
            self.add_discretization(search, optimum, &local, reach, &mut report);
        }
        let mut profiles = Vec::new();
        if optimum.converged && local.findings.is_empty() {
            self.add_observed_information(search, optimum, variance, &mut report);
            profiles = self.add_profiles(search, optimum, (&local, variance, reach), &mut report);
            self.add_bootstrap(search, optimum, &mut report);
        }
        if self.keep_evidence {
            let residuals = Some(&optimum.residuals[..]);
            let mut evidence = replay::evidence(search, residuals, &report.sigma);
            if let Err(error) = replay::add_motion(search, &optimum.x, &mut evidence) {
                report.warnings.push(format!("no shapes of the rod: {error}"));
            }
            evidence.profiles = profiles;
            report.evidence = Some(evidence);
        }
        report.interrupted = self.problem.is_stopped();
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
        let rms = rms_per_observation(&optimum, &search.sigmas);
        let squares: f64 = rms.iter().zip(&optimum.counts).map(|(r, c)| r * r * *c as f64).sum();
        let mut sigma = search.sigmas.clone();
        self.estimate_sigmas(&optimum, &mut sigma);
        let parameters = self.unknowns.iter().zip(&optimum.x).map(|(unknown, x)| Estimate {
            name: unknown.parameter,
            value: Some(unknown.from_scale(*x)),
            std_error: None,
            interval95: None,
            identifiable: false,
            observed_std_error: None,
            profile95: None,
            bootstrap: None,
        });
        let n = self.unknowns.len();
        let residuals = whole.then_some(&optimum.residuals[..]);
        Ok(FitReport {
            converged: false,
            parameters: parameters.collect(),
            correlation: vec![vec![None; n]; n],
            residual_rms: (squares / optimum.residuals.len() as f64).sqrt(),
            evidence: self.keep_evidence.then(|| replay::evidence(search, residuals, &sigma)),
            sigma,
            singular_values: Vec::new(),
            not_identifiable: Vec::new(),
            discretization_error: Vec::new(),
            residual_tests: Vec::new(),
            basins: search.journal.basins(&self.unknowns, None),
            simulations: 0.0,
            wall_seconds: 0.0,
            status: "interrupted".into(),
            verdict: format!(
                "do not believe this: these are the best values when the search was stopped ({})",
                stage.name()
            ),
            warnings: Vec::new(),
            interrupted: true,
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
                value: known.then_some(value),
                std_error: deviation.map(|sd| sd * unknown.slope(value)),
                interval95: deviation.map(ends),
                identifiable: known,
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
                    "{} ended at its bound {bound}: its interval does not account for that",
                    unknown.parameter
                )
            })
        };
        self.unknowns.iter().enumerate().filter_map(words).collect()
    }

    /// What of the motion is left, if it is too much.
    fn unexplained(&self, optimum: &Optimum, rms: &[f64]) -> Vec<String> {
        let mut warnings = Vec::new();
        let mut rest = &optimum.residuals[..];
        for ((observation, rms), count) in self.observations.iter().zip(rms).zip(&optimum.counts) {
            let (own, others) = rest.split_at(*count);
            rest = others;
            let spread = observation.spread();
            if *rms > UNEXPLAINED * spread && !self.is_noisy(observation, *rms, own) {
                warnings.push(format!(
                    "{}: the model leaves {:.0} % of the observed motion unexplained ({rms:.3e} m of {spread:.3e} m)",
                    observation.label(),
                    100.0 * rms / spread.max(f64::MIN_POSITIVE)
                ));
            }
            if let Some(sigma) = observation.sigma.filter(|sigma| *rms > 1.5 * sigma) {
                warnings.push(format!(
                    "{}: the residuals are {:.1} times the stated sigma; the intervals are too narrow",
                    observation.label(),
                    rms / sigma
                ));
            }
        }
        warnings
    }

    /// Tests every coordinate of an observation, whose residuals these are, for being noise.
    pub(super) fn residual_tests(
        &self,
        observation: &Observation,
        residuals: &[f64],
    ) -> Vec<ResidualTests> {
        let mut residuals = residuals.iter();
        let mut series = [const { (Vec::new(), Vec::new()) }; 3];
        for sample in &observation.samples {
            for (position, (times, values)) in sample.position.iter().zip(&mut series) {
                if position.is_some()
                    && let Some(r) = residuals.next()
                {
                    times.push(sample.time);
                    values.push(*r);
                }
            }
        }
        let label = observation.label();
        let tests = ["x", "y", "z"].into_iter().zip(&series);
        tests.filter_map(|(axis, (t, r))| ResidualTests::new(label.clone(), axis, t, r)).collect()
    }

    /// Whether the record is noisy enough, and long enough to tell, that what is left of it is
    /// noise. At a wrong minimum more than half is left.
    pub(super) fn is_noisy(&self, observation: &Observation, rms: f64, residuals: &[f64]) -> bool {
        let tests = self.residual_tests(observation, residuals);
        rms <= 0.5 * observation.spread()
            && residuals.len() >= ENOUGH * tests.len().max(1)
            && tests.iter().all(ResidualTests::is_noise)
    }

    fn test_residuals(&self, optimum: &Optimum, report: &mut FitReport) {
        let mut rest = &optimum.residuals[..];
        for (observation, count) in self.observations.iter().zip(&optimum.counts) {
            let (own, others) = rest.split_at(*count);
            rest = others;
            for tests in self.residual_tests(observation, own) {
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

    fn add_discretization(
        &self,
        search: &Search,
        optimum: &Optimum,
        local: &Local,
        reach: f64,
        report: &mut FitReport,
    ) {
        let how = self.analysis.discretization_error;
        if how == Refinement::None || !optimum.converged {
            return;
        }
        match discretization::errors(search, optimum, local, how) {
            Ok(errors) => report.discretization_error = errors,
            Err(error) => report
                .warnings
                .push(format!("the discretisation error is unknown: a finer run failed ({error})")),
        }
        for (estimate, error) in report.parameters.iter().zip(&report.discretization_error) {
            if let (Some(value), Some(sd), Some(relative)) =
                (estimate.value, estimate.std_error, error.relative)
                && relative * value.abs() > 2.0 * reach * sd
            {
                report.warnings.push(format!(
                    "{}: mesh and step may be {:.2} % off, more than the 95 % interval is wide; refine segments or step",
                    estimate.name,
                    100.0 * relative
                ));
            }
        }
    }

    fn add_observed_information(
        &self,
        search: &Search,
        optimum: &Optimum,
        variance: f64,
        report: &mut FitReport,
    ) {
        if !self.analysis.observed_information {
            return;
        }
        let hessian = search.residuals(search.duration()).and_then(|r| r.hessian_at(&optimum.x));
        let hessian = match hessian {
            Ok(hessian) => hessian,
            Err(error) => {
                let words = format!("no observed information: its simulation failed ({error})");
                return report.warnings.push(words);
            }
        };
        let n = self.unknowns.len();
        let Some(factors) = nalgebra::DMatrix::from_fn(n, n, |i, j| hessian[i][j]).cholesky()
        else {
            let words =
                "the Hessian of the misfit is not positive: this is not a minimum of its own";
            return report.warnings.push(words.into());
        };
        let inverse = factors.inverse();
        for (i, estimate) in report.parameters.iter_mut().enumerate() {
            let sd = (variance * inverse[(i, i)]).sqrt();
            estimate.observed_std_error =
                estimate.value.map(|value| sd * self.unknowns[i].slope(value));
        }
    }

    fn add_profiles(
        &self,
        search: &Search,
        optimum: &Optimum,
        (local, variance, reach): (&Local, f64, f64),
        report: &mut FitReport,
    ) -> Vec<Profile> {
        let mut profiles = Vec::new();
        if !self.analysis.profile {
            return profiles;
        }
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let Some(sd) = local.deviation[i].filter(|sd| *sd > 0.0) else { continue };
            let found = profile::interval(search, optimum, i, (sd, variance.sqrt(), reach));
            if self.problem.is_stopped() {
                // Half a profile says nothing about its ends.
                break;
            }
            report.parameters[i].profile95 = Some(found.values(unknown));
            profiles.push(found.profile(unknown, reach));
            if let Some(x) = found.better {
                report.warnings.push(format!(
                    "{} = {:e} fits better: this is not the best minimum",
                    unknown.parameter,
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

//! What an optimum is worth: errors, doubts and a verdict.

use crate::error::Error;
use crate::fit::Fit;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::experiment::all;
use crate::fit::report::setup::Setup;
use crate::fit::report::{Estimate, FitReport, replay};
use crate::fit::search::Search;
use crate::fit::search::journal::Stage;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::covariance::Local;
use crate::fit::uncertainty::noise::{losses, residual_rms, weighted};
use crate::fit::uncertainty::prediction;
use crate::fit::uncertainty::vanishing::{Vanishing, vanishing};
use crate::fit::uncertainty::verdict::Grade;
use crate::fit::uncertainty::verdict::{Doubts, Weight};
use crate::fit::uncertainty::warnings::{
    bounds_reached, steps_too_large, surprises, test_residuals, unexplained,
};
use crate::fit::unknown::Unknown;
use crate::numerics::half_square;

impl Fit {
    /// What `optimum` says about the parameters, and what speaks against it.
    pub(crate) fn assess(
        &self,
        search: &Search,
        optimum: &Optimum,
        setup: &Setup,
    ) -> Result<FitReport, Error> {
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
        let losses_of_all = residuals.losses();
        let vanishing = vanishing(
            &self.unknowns,
            (optimum, &rows, &losses_of_all),
            (&noise, noise.up),
            &residuals,
        );
        let local = Local::new(&self.unknowns, &vanishing, &rows, noise.variance, effect, rise)?;
        if search.is_stopped() {
            // Half an analysis is none.
            return Err(Error::Interrupted);
        }
        let mut sigma = search.sigmas.clone();
        search.estimate_sigmas(optimum, &mut sigma);
        let mut report = FitReport {
            converged: optimum.converged,
            parameters: self.estimates(optimum, (&local, &vanishing), noise.reach),
            correlation: local.correlation.clone(),
            residual_rms: residual_rms(search, optimum),
            sigma,
            singular_values: local.singular_values.clone(),
            not_identifiable: local.findings.clone(),
            losses: losses(search, optimum, &noise),
            basins: search.journal.basins(&self.unknowns, Some((&optimum.x, optimum.cost))),
            ..self.bare(search)
        };
        let mut doubts = Doubts::default();
        for estimate in &report.parameters {
            if let Some(upper) = estimate.upper95 {
                let words = format!(
                    "{} cannot be told from zero: at most {upper:.3e} {} (one-sided 95 %)",
                    estimate.label(),
                    estimate.name.unit()
                );
                doubts.add(Weight::Note, words);
            }
        }
        bounds_reached(&self.unknowns, optimum, &local, &mut doubts);
        unexplained(search, optimum, &mut doubts);
        surprises(&self.unknowns, optimum, &mut doubts);
        steps_too_large(search.experiments, &mut doubts);
        if !search.explained(optimum) {
            setup.suspicions.iter().for_each(|words| doubts.add(Weight::Setup, words));
        }
        // Rounding errors are neither noise nor made by another mesh; as few values as unknowns
        // leave nothing else.
        let as_few = optimum.residuals.len() == self.unknowns.len();
        if as_few || !search.is_rounding(optimum) {
            report.residual_tests = test_residuals(search, optimum, &mut doubts);
            search.jumps(optimum, &mut doubts);
            self.add_discretization(search, optimum, (&local, &noise), &mut report, &mut doubts);
        }
        let mut profiles = Vec::new();
        if optimum.converged && local.findings.is_empty() {
            self.add_observed_information(search, optimum, &noise, &mut report, &mut doubts);
            profiles =
                self.add_profiles(search, optimum, (&local, &noise), &mut report, &mut doubts);
            self.add_bootstrap(search, optimum, &mut report, &mut doubts);
        }
        prediction::add(&self.experiments, (search, optimum), &local, &mut report, &mut doubts);
        if self.keep_evidence {
            let mut evidence = replay::evidence(search, Some(optimum), &report.sigma);
            if let Err(error) = replay::add_motion(search, &optimum.x, &mut evidence) {
                doubts.add(Weight::Note, format!("no shapes of the rod: {error}"));
            }
            evidence.profiles = profiles;
            report.evidence = Some(evidence);
        }
        report.interrupted = search.is_stopped();
        report.conclude(doubts, &optimum.status);
        Ok(report)
    }

    /// What an interrupted search has found so far: values without errors.
    pub(crate) fn unfinished(&self, search: &Search) -> Result<FitReport, Error> {
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
            halved: false,
        };
        let mut sigma = search.sigmas.clone();
        search.estimate_sigmas(&optimum, &mut sigma);
        let evidence =
            self.keep_evidence.then(|| replay::evidence(search, whole.then_some(&optimum), &sigma));
        let mut report = FitReport {
            residual_rms: residual_rms(search, &optimum),
            sigma,
            status: optimum.status,
            grade: Grade::Interrupted,
            verdict: format!(
                "do not believe this: these are the best values when the search was stopped ({})",
                stage.name()
            ),
            interrupted: true,
            evidence,
            ..self.bare(search)
        };
        for ((estimate, unknown), x) in
            report.parameters.iter_mut().zip(&self.unknowns).zip(&optimum.x)
        {
            estimate.value = Some(unknown.from_scale(*x));
        }
        Ok(report)
    }

    /// What recordings are worth that a search would be wasted on: what is left is all that moves
    /// in them.
    pub(crate) fn unsearched(&self, search: &Search, words: &str) -> FitReport {
        let left = |(e, m): (&Experiment, &Measurement)| m.size(&e.problem);
        let left: Vec<f64> = all(search.experiments).map(left).collect();
        FitReport {
            residual_rms: left.iter().copied().fold(0.0, f64::max),
            sigma: left,
            status: format!("not to be used: {words}"),
            verdict: words.into(),
            warnings: vec![words.into()],
            evidence: self.keep_evidence.then(|| replay::evidence(search, None, &search.sigmas)),
            ..self.bare(search)
        }
    }

    /// A report without results.
    fn bare(&self, search: &Search) -> FitReport {
        let parameters = self.unknowns.iter().map(|unknown| Estimate {
            name: unknown.parameter,
            experiments: unknown.experiments.clone(),
            value: None,
            std_error: None,
            interval95: None,
            upper95: None,
            identifiable: false,
            prior: unknown.prior,
            observed_std_error: None,
            profile95: None,
            bootstrap: None,
        });
        let n = self.unknowns.len();
        FitReport {
            converged: false,
            parameters: parameters.collect(),
            correlation: vec![vec![None; n]; n],
            residual_rms: 0.0,
            sigma: Vec::new(),
            units: units(search),
            singular_values: Vec::new(),
            not_identifiable: Vec::new(),
            discretization_error: Vec::new(),
            residual_tests: Vec::new(),
            dropped: Vec::new(),
            losses: Vec::new(),
            predictions: Vec::new(),
            basins: search.journal.basins(&self.unknowns, None),
            simulations: 0.0,
            wall_seconds: 0.0,
            status: String::new(),
            grade: Grade::NotUsable,
            verdict: String::new(),
            warnings: Vec::new(),
            interrupted: false,
            evidence: None,
        }
    }

    fn estimates(
        &self,
        optimum: &Optimum,
        (local, vanishing): (&Local, &[Option<Vanishing>]),
        reach: f64,
    ) -> Vec<Estimate> {
        let estimate = |(i, unknown): (usize, &Unknown)| {
            let x = optimum.x[i];
            let value = unknown.from_scale(x);
            let deviation = local.deviation[i].filter(|_| optimum.converged);
            let zero = vanishing[i].and_then(|v| Some((v.value, v.upper95?)));
            let known = local.deviation[i].is_some() || zero.is_some();
            let ends = |sd: f64| {
                let [low, high] = unknown.parameter.limits();
                [x - reach * sd, x + reach * sd].map(|x| unknown.from_scale(x).clamp(low, high))
            };
            Estimate {
                name: unknown.parameter,
                experiments: unknown.experiments.clone(),
                value: known.then_some(zero.map_or(value, |(value, _)| value)),
                std_error: deviation.map(|sd| sd * unknown.slope(value)),
                interval95: zero.map(|(_, upper)| [0.0, upper]).or(deviation.map(ends)),
                upper95: zero.map(|(_, upper)| upper),
                identifiable: known,
                prior: unknown.prior,
                observed_std_error: None,
                profile95: None,
                bootstrap: None,
            }
        };
        self.unknowns.iter().enumerate().map(estimate).collect()
    }
}

/// Of the measurements.
fn units(search: &Search) -> Vec<String> {
    all(search.experiments).map(|(_, m)| m.unit().into()).collect()
}

//! A plan, filled with what its scenes do and looked at as an optimum is.

use crate::accuracy::Aim;
use crate::error::Error;
use crate::fit::design::candidate_designs::CandidateDesigns;
use crate::fit::design::contributions::contributions;
use crate::fit::design::report::Design;
use crate::fit::design::usable_rows::UsableRows;
use crate::fit::known::Known;
use crate::fit::measurement::experiment::{Experiment, all, fitted, full_work};
use crate::fit::measurement::loss::Loss;
use crate::fit::misfit::initial_sigmas::first_sigmas;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::search::{Progress, Search};
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::assessment::{FitAssessment, expected};
use crate::fit::uncertainty::warning_list::ReportedWarnings;
use crate::fit::unknown::Unknown;
use crate::fit::validate::key;
use std::time::Instant;

/// A plan: `experiments` with their layouts, what is looked for in them, and what is known.
pub(crate) struct Plan<'a> {
    pub experiments: &'a [Experiment],
    pub unknowns: &'a [Unknown],
    pub knowns: &'a [Known],
    pub analysis: &'a Analysis,
    pub progress: Option<Progress>,
}

impl Plan<'_> {
    /// What it would tell.
    pub fn design(self) -> Result<Design, Error> {
        let since = Instant::now();
        let Self { experiments, unknowns, knowns, analysis, progress } = self;
        let x = values(experiments, unknowns)?;
        let mut planned = fitted(experiments);
        for experiment in &mut planned {
            ready(experiment, (unknowns, &x))?;
        }
        let choices = CandidateDesigns::of(&planned)?;
        let widened = choices.experiments(&planned);
        let (sigmas, work) = (first_sigmas(&widened), full_work(&planned)?);
        let horizons = vec![f64::MAX; widened.len()];
        let residuals = Residuals::new(&widened, &sigmas, unknowns, &horizons, work)?;
        let mut rows = residuals.plain_jacobian(&x)?;
        let simulated = residuals.plain(&x)?;
        choices.fill(&mut planned, &simulated);
        let usable = UsableRows::new(widened, (unknowns, &sigmas), &simulated, &rows);
        usable.leave_out_others(&mut rows);

        let mut search = Search::new(&planned, unknowns, progress, analysis.tolerance)?;
        search.leverage_weights = usable.weights(&choices);
        search.work.add(residuals.simulations() * work);
        let optimum = Optimum {
            residuals: vec![0.0; choices.planned(&rows).len()],
            jacobian: choices.planned(&rows),
            counts: all(&planned).map(|(_, m)| m.values()).collect(),
            cost: 0.0,
            converged: true,
            status: "planned".into(),
            halved: residuals.halved(),
            x,
        };
        let planned_fit = Fitted { search: &search, optimum: &optimum };
        let assessment = expected(planned_fit, analysis, knowns)?;
        let FitAssessment { estimates, covariance, discrepancy, mut warnings, .. } = assessment;
        usable.warn(&mut warnings);
        let mut advice = choices.advice(&planned, (unknowns, &optimum.x), &rows)?;
        usable.withdraw_marks(&planned, &mut advice);
        let contributions = contributions(&choices, &planned, (unknowns, &optimum.x), &rows)?;
        let found = |j: usize| {
            let mut all = advice.iter().flat_map(|advice| &advice.choices);
            estimates[j].identifiable || all.any(|choice| choice.std_error[j].is_some())
        };
        let never = (0..unknowns.len()).filter(|j| !found(*j)).map(|j| estimates[j].label());
        let n = unknowns.len();
        let (correlation, singular_values, not_identifiable) = match covariance {
            Some(c) => (c.correlation, c.singular_values, c.findings),
            None => (vec![vec![None; n]; n], Vec::new(), Vec::new()),
        };
        let ReportedWarnings { texts: warnings, codes: warning_codes } = warnings.into_report();
        Ok(Design {
            never_identifiable: never.collect(),
            budget: estimates.iter().flat_map(|e| e.budget.clone()).collect(),
            parameters: estimates,
            correlation,
            singular_values,
            not_identifiable,
            undetected_bias: discrepancy.undetected_bias,
            contributions,
            advice,
            warnings,
            warning_codes,
            simulations: search.simulations(),
            wall_seconds: since.elapsed().as_secs_f64(),
        })
    }
}

/// What the plan is looked at for: starts, or what the scenes say, on the scales of the unknowns.
fn values(experiments: &[Experiment], unknowns: &[Unknown]) -> Result<Vec<f64>, Error> {
    let value = |(i, unknown): (usize, &Unknown)| {
        let own = experiments.iter().filter(|e| unknown.is_of(e));
        let said = own.filter_map(|e| unknown.parameter.of(e.problem.scene())).next();
        let value = unknown.start.or(said).unwrap_or(f64::NAN);
        let x = unknown.to_scale(value);
        match x.is_finite() {
            true => Ok(x),
            false => {
                let found = format!("none, and {value} in the scene");
                let allowed = "a start above 0: the value that the plan is for";
                Err(Error::invalid(format!("parameter[{i}].start"), found, allowed))
            }
        }
    };
    unknowns.iter().enumerate().map(value).collect()
}

/// Makes an experiment ready: with a known noise that counts by its squares, and a mesh and a step as a simulation
/// would have them where the scene leaves these to the program.
fn ready(experiment: &mut Experiment, (unknowns, x): (&[Unknown], &[f64])) -> Result<(), Error> {
    for i in 0..experiment.measurements.len() {
        if experiment.measurements[i].sigma().is_none() {
            let allowed = "a number, m: there is nothing yet that would show the noise";
            return Err(Error::invalid(format!("{}.sigma", key(experiment, i)), "none", allowed));
        }
        experiment.measurements[i].header.loss = Loss::Squares;
    }
    let scene = experiment.problem.scene();
    if scene.chosen().any() {
        let own = unknowns.iter().zip(x).filter(|(u, _)| u.is_of(experiment));
        let there = experiment.problem.with(own.map(|(u, x)| (u.parameter, u.from_scale(*x))))?;
        let aim = match (experiment.moves(), experiment.highest_mode()) {
            (true, _) => Aim::Motion,
            (false, 0) => Aim::Rest,
            (false, modes) => Aim::Modes(modes),
        };
        let fine = there.scene().reopened().problem_for(aim)?;
        let step = fine.scene().time.as_ref().map_or(0.0, |time| time.step_size());
        let resolved = scene.resolved(fine.segments(), step);
        experiment.problem = experiment.problem.with_scene(resolved)?;
    }
    Ok(())
}

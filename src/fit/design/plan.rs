//! Assessment of a planned experiment: its measurements get simulated values, and the exact fit is assessed as an
//! optimum.
//!
//! [`PlannedFit::design`] simulates the plan and its candidate recordings at the start values, or else the values of
//! the scenes, with derivatives. Mesh and step that the program chose are chosen again at these values. The residuals
//! of the plan are zero, so that its Jacobian and the stated noise yield expected standard errors, budgets and
//! undetected biases. Measurements of validation data are left out, and losses are squares. Rows after the onset of an
//! exponential growth of sensitivities are zero, with a warning. The result, a [`Design`], also has the expected errors
//! of candidate designs, the contribution of each measurement, and the parameters that no candidate determines. A
//! measurement without sigma, an unknown without a value and a failed simulation are errors.

use crate::error::Error;
use crate::fit::design::candidate_designs::CandidateDesigns;
use crate::fit::design::contributions::contributions;
use crate::fit::design::report::Design;
use crate::fit::design::usable_rows::{UsableRows, add_residuals};
use crate::fit::known::Known;
use crate::fit::measurement::camera_needs::{CameraNeeds, camera_needs};
use crate::fit::measurement::experiment::{Experiment, all, fitted, full_work};
use crate::fit::measurement::loss::Loss;
use crate::fit::misfit::initial_sigmas::first_sigmas;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::report::covariance_parts;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::search::{Progress, Search};
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::assessment::{FitAssessment, expected};
use crate::fit::uncertainty::warning_list::ReportedWarnings;
use crate::fit::unknown::{ParameterPoint, Unknown};
use crate::fit::validate::measurement_key;
use crate::numerics::stopwatch::Stopwatch;

/// Fixed-point iterations for the positions of a plan; the error falls by the speed times the row delay in each.
const POSITION_ITERATIONS: usize = 10;

/// A fit of planned measurements, which have times and noise, but no values.
pub(crate) struct PlannedFit<'a> {
    pub experiments: &'a [Experiment],
    pub unknowns: &'a [Unknown],
    pub knowns: &'a [Known],
    pub analysis: &'a Analysis,
    pub progress: Option<Progress>,
}

impl PlannedFit<'_> {
    /// The expected uncertainties of the plan and of its candidate designs, by a simulation with derivatives and the
    /// assessment of the exact fit. Where the program chose mesh or step, they are chosen again at these values. Rows
    /// of motions after the onset of an exponential growth of their sensitivities are set to zero, with a warning. A
    /// parameter that neither the plan nor a candidate determines is listed as never identifiable. Errors: a
    /// measurement without sigma, an unknown without a value, a simulation that fails, or a failed assessment.
    pub fn design(self) -> Result<Design, Error> {
        // 1. The plan with all candidate recordings, simulated at the given values.
        let since = Stopwatch::start();
        let Self { experiments, unknowns, knowns, analysis, progress } = self;
        let x = planned_values(experiments, unknowns)?;
        let mut planned = fitted(experiments);
        for experiment in &mut planned {
            prepare(experiment, ParameterPoint { unknowns, x: &x })?;
        }
        let designs = CandidateDesigns::new(&planned)?;
        let mut widened = designs.experiments(&planned);
        let (sigmas, work) = (first_sigmas(&widened), full_work(&planned)?);
        // A plan has no search with growing horizons: all rows are simulated at once.
        let horizons = vec![f64::MAX; widened.len()];
        let mut simulations = 0.0;
        // Lens distortion and row delay depend on the recorded positions. Those of a plan are zeros, which are replaced
        // by simulated positions: a fixed-point iteration, as these depend on the positions of the iteration before.
        let needs_positions =
            |e: &Experiment| camera_needs(e, unknowns).into_iter().any(CameraNeeds::any);
        if widened.iter().any(needs_positions) {
            for _ in 0..POSITION_ITERATIONS {
                let residuals = Residuals::new(&widened, &sigmas, unknowns, &horizons, work)?;
                let found = residuals.plain_residuals(&x)?;
                simulations += residuals.simulations();
                designs.fill(&mut planned, &found);
                add_residuals(&mut widened, &sigmas, &found);
            }
        }
        let residuals = Residuals::new(&widened, &sigmas, unknowns, &horizons, work)?;
        let mut rows = residuals.plain_jacobian(&x)?;
        let simulated = residuals.plain_residuals(&x)?;
        designs.fill(&mut planned, &simulated);
        let usable = UsableRows::new(widened, unknowns, &sigmas, &simulated, &rows);
        usable.remove_others(&mut rows);

        // 2. The assessment of the exact fit of the plan.
        // With the simulated values as data the residuals are zero, and the given values are the optimum.
        let mut search = Search::new(&planned, unknowns, progress, analysis.tolerance)?;
        search.leverage_weights = usable.weights(&designs);
        search.work.add((simulations + residuals.simulations()) * work);
        let jacobian = designs.planned(&rows);
        let optimum = Optimum {
            residuals: vec![0.0; jacobian.len()],
            jacobian,
            counts: all(&planned).map(|(_, m)| m.values()).collect(),
            converged: true,
            status: "planned".into(),
            halved: residuals.has_halved_steps(),
            x,
            ..Optimum::default()
        };
        let planned_fit = Fitted { search: &search, optimum: &optimum };
        let assessment = expected(planned_fit, analysis, knowns)?;
        let FitAssessment { estimates, covariance, discrepancy, mut warnings, .. } = assessment;
        let (correlation, singular_values, not_identifiable) =
            covariance_parts(covariance, unknowns.len());

        // 3. The candidate designs.
        usable.warn(&mut warnings);
        let point = ParameterPoint { unknowns, x: &optimum.x };
        let mut advice = designs.advice(&planned, point, &rows)?;
        usable.withdraw_marks(&planned, &mut advice);
        let contributions = contributions(&designs, &planned, point, &rows)?;
        // A parameter that a candidate determines can be identified by a change of the plan.
        let is_identifiable = |j: usize| {
            let mut all = advice.iter().flat_map(|advice| &advice.choices);
            estimates[j].identifiable || all.any(|choice| choice.std_error[j].is_some())
        };
        let never = (0..unknowns.len()).filter(|j| !is_identifiable(*j));
        let never_identifiable = never.map(|j| estimates[j].label()).collect();
        let ReportedWarnings { texts: warnings, codes: warning_codes } = warnings.into_report();
        Ok(Design {
            never_identifiable,
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

/// The values at which the plan is simulated, one per unknown on its scale (logarithm of a positive parameter). Each is
/// the start, or else the value of the first scene that has the parameter. Error: an unknown with neither, or with a
/// value that has no logarithm.
fn planned_values(experiments: &[Experiment], unknowns: &[Unknown]) -> Result<Vec<f64>, Error> {
    let value = |(i, unknown): (usize, &Unknown)| {
        let mut own = experiments.iter().filter(|e| unknown.is_of(e));
        let of_scene = own.find_map(|e| unknown.parameter.of(e.problem.scene()));
        let value = unknown.start.or(of_scene).unwrap_or(f64::NAN);
        let x = unknown.to_scale(value);
        match x.is_finite() {
            true => Ok(x),
            false => {
                let found = format!("no start, and {value} in the scene");
                let allowed = "a start above 0, the value for which the plan is evaluated";
                Err(Error::invalid(format!("parameter[{i}].start"), found, allowed))
            }
        }
    };
    unknowns.iter().enumerate().map(value).collect()
}

/// Prepares an experiment, in place: its losses become squares. Where the program chose mesh or step, these become
/// those that a simulation at `point` requires. Error: a measurement without a given noise, or a scene that does not
/// allow the values at `point`.
fn prepare(experiment: &mut Experiment, point: ParameterPoint) -> Result<(), Error> {
    for i in 0..experiment.measurements.len() {
        if experiment.measurements[i].sigma().is_none() {
            let key = format!("{}.sigma", measurement_key(experiment, i));
            // A sigma is in the unit of the given values.
            let unit = match experiment.measurements[i].data_unit().name {
                "" => String::new(),
                unit => format!(" in {unit}"),
            };
            let allowed =
                format!("a number{unit}, as a plan has no data from which to estimate it");
            return Err(Error::invalid(key, "none", allowed));
        }
        experiment.measurements[i].header.loss = Loss::Squares;
    }
    let scene = experiment.problem.scene();
    // Without data the mesh is chosen for the accuracy of the simulation, not by residuals.
    if scene.chosen().any() {
        let problem = experiment.problem.with(point.values_of(experiment))?;
        let fine = problem.scene().reopened().problem_for(experiment.aim())?;
        let step = fine.scene().time.as_ref().map_or(0.0, |time| time.step_size());
        let resolved = scene.resolved(fine.segments(), step);
        experiment.problem = experiment.problem.with_scene(resolved)?;
    }
    Ok(())
}

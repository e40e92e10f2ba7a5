//! The report of a fit: its result as data, as JSON and as text.
//!
//! [`FitReport`] is assembled from the outcome of a fit (`outcome`), the search and the experiments. It serializes to
//! the JSON of `rodfit fit --json`. `display` makes the text for a terminal, with the estimates (`quoted`,
//! `estimate_table`, `experiment_estimates`), their `uncertainty` and `budget`, omitted `effects` and `validation`.
//! `method_table` has the intervals by several methods. `plot_data`, `replay` and `recorded_motion` make the data of
//! the page's plots, `fit_summary` the rows of a comparison of several fits. `renamed_keys` converts stored reports of
//! version 0.1. Methods of the report: `parameters` and `parameters_of` (one experiment) are the values for a
//! simulation, `estimate` is the first estimate of a parameter. `in_a_line` is a line of text for a list of fits.
//! `likely_omitted_effects` and `undetected_bias_texts` are findings as texts. `is_success` returns whether the grade
//! is usable (exit code 0). `in_data_unit` converts rad/s to Hz if frequencies were given in Hz and none in rad/s.
//! `resolutions` are mesh, step and scheme of the experiments for which the program chose any, `digits` is a value with
//! digits by its error.

pub(crate) mod budget;
mod display;
pub(crate) mod effects;
pub(crate) mod estimate_table;
pub(crate) mod experiment_estimates;
pub(crate) mod fit_summary;
pub(crate) mod image_overlay;
mod method_table;
mod node_history;
pub(crate) mod outcome;
pub(crate) mod overlay_run;
pub(crate) mod plot_data;
pub(crate) mod quoted;
pub(crate) mod recorded_motion;
#[cfg(feature = "cli")]
pub(crate) mod renamed_keys;
pub(crate) mod replay;
mod uncertainty;
mod validation;

use crate::code::Code;
use crate::fit::measurement::dataset::DataUnit;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::misfit::residual_tests::ResidualTests;
use crate::fit::report::outcome::FitOutcome;
use crate::fit::report::plot_data::PlotData;
use crate::fit::search::Search;
use crate::fit::search::local_minima::LocalMinima;
use crate::fit::uncertainty::budget::entries::BudgetLine;
use crate::fit::uncertainty::covariance::determined_groups::DeterminedGroup;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::uncertainty::covariance::identifiability::UnidentifiableDirection;
use crate::fit::uncertainty::discrepancy::findings::{
    ScoreTest, UndetectedBias, largest_biases, likely_omitted_effects,
};
use crate::fit::uncertainty::discrepancy::free_run::RecordingErrors;
use crate::fit::uncertainty::discrepancy::prediction::Prediction;
use crate::fit::uncertainty::discretization::errors::DiscretizationError;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::Grade;
use crate::fit::uncertainty::method_intervals::{MethodIntervals, method_intervals};
use crate::fit::uncertainty::noise::noise_scale::NoiseScale;
use crate::fit::uncertainty::noise::residual_noise::LossEffect;
use crate::fit::uncertainty::posterior::draws::PosteriorDraws;
use crate::fit::uncertainty::warning_list::ReportedWarnings;
use crate::numerics::simd::simd_level;
use crate::numerics::stopwatch::Stopwatch;
use crate::scene::{Parameter, Resolution};
use marker_files::Dropped;
use serde::{Deserialize, Serialize};

/// Rows of a file that the fit does not use.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct DroppedRows {
    /// File of the dropped rows.
    pub observation: String,
    /// Numbers of dropped rows.
    #[serde(flatten)]
    pub rows: Dropped,
}

/// Result of a fit: the JSON of `rodfit fit --json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FitReport {
    /// Whether a minimum of the misfit was reached.
    pub converged: bool,
    /// Estimates, in the order of the fit file.
    pub parameters: Vec<Estimate>,
    /// 95 % intervals by each method, in the order of `parameters`; empty unless a profile likelihood, a bootstrap or
    /// a posterior distribution was requested.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub method_intervals: Vec<MethodIntervals>,
    /// Correlations between the parameters; none where one is not identifiable.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Root mean square residual per coordinate, m; per frequency, rad/s, without positions.
    pub residual_rms: f64,
    /// Standard deviation of the noise of each measurement, given or estimated, in `units`.
    pub sigma: Vec<f64>,
    /// Unit of each `sigma`: m, rad/s, N, N m, m/s^2, rad, 1/m, or that of a gauge; empty for strains.
    pub units: Vec<String>,
    /// Unit of each measurement in the displayed report and on the page: that of `units`, or Hz for frequencies in Hz.
    /// The values of the JSON are in `units`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub data_units: Vec<String>,
    /// Singular values of the Jacobian with normalized columns, descending; near zero where
    /// parameters are collinear.
    pub singular_values: Vec<f64>,
    /// Combinations of parameters that the data do not determine.
    pub not_identifiable: Vec<UnidentifiableDirection>,
    /// Discretization error of each parameter; empty if it was not estimated.
    pub discretization_error: Vec<DiscretizationError>,
    /// The budgets of all parameters in one list.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub budget: Vec<BudgetLine>,
    /// Chosen mesh, step and scheme, in the order of the experiments.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resolution: Vec<Option<Resolution>>,
    /// Tests of the residuals of each coordinate of each observation.
    pub residual_tests: Vec<ResidualTests>,
    /// Noise of each coordinate of the recorded motions, estimated from differences of the samples.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub noise_scale: Vec<NoiseScale>,
    /// Rows of the files that were left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dropped: Vec<DroppedRows>,
    /// Effect of robust losses on the measurements.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub losses: Vec<LossEffect>,
    /// Errors of the predictions of validation data.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub predictions: Vec<Prediction>,
    /// Likely omitted effects by score tests, those of the first three ranks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub score_tests: Vec<ScoreTest>,
    /// Undetected bias: effect of omitted effects on each parameter that the data do not exclude,
    /// the most standard errors first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub undetected_bias: Vec<UndetectedBias>,
    /// Ratios to the density that the data determine, where no force was measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub determined_groups: Vec<DeterminedGroup>,
    /// Errors of the free-run predictions of recordings with driven ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recordings: Option<RecordingErrors>,
    /// Local minima of the misfit that were found, and the reason for the selection.
    pub local_minima: LocalMinima,
    /// Cost of the fit, in full simulations.
    pub simulations: f64,
    /// Wall-clock time of the fit, s.
    pub wall_seconds: f64,
    /// SIMD unit of the processor that was used.
    #[serde(default)]
    pub vector_unit: String,
    /// End of the search, in one line.
    pub status: String,
    /// Grade of the result.
    pub grade: Grade,
    /// Reason for the grade, and the recommended action.
    pub verdict: String,
    /// Warnings, the most severe first.
    pub warnings: Vec<String>,
    /// Codes of `warnings`, in the same order.
    #[serde(default)]
    pub warning_codes: Vec<Code>,
    /// Whether the fit was stopped before convergence.
    pub interrupted: bool,
    /// Draws from the posterior distribution, if requested; not part of the JSON.
    #[serde(skip)]
    pub posterior_draws: Option<PosteriorDraws>,
    /// Data of the plots, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plot_data: Option<PlotData>,
}

impl FitReport {
    /// The report of the `outcome` of a fit that began at `since` (for the wall time). `experiments` include the
    /// validation data, those of `search` do not. Sigmas, units and data units are those of the fitted measurements;
    /// resolutions and left-out rows are those of all `experiments`. The cost is the work of `search` in full
    /// simulations on its mesh. The budgets of all estimates are joined to one list.
    pub(crate) fn new(
        outcome: FitOutcome,
        search: &Search,
        experiments: &[Experiment],
        since: Stopwatch,
    ) -> Self {
        let FitOutcome { converged, interrupted, assessment, conclusion, local_minima, plot_data } =
            outcome;
        // Unfinished searches have no covariance: the lists have the right shape without values.
        let (correlation, singular_values, findings) =
            covariance_parts(assessment.covariance, search.unknowns.len());
        // Warnings are already ordered by severity.
        let ReportedWarnings { texts: warnings, codes: warning_codes } = conclusion.warnings;
        Self {
            converged,
            budget: assessment.estimates.iter().flat_map(|e| e.budget.clone()).collect(),
            method_intervals: method_intervals(&assessment.estimates),
            parameters: assessment.estimates,
            correlation,
            residual_rms: assessment.residual_rms,
            sigma: assessment.sigma,
            units: all(search.experiments).map(|(_, m)| m.unit().into()).collect(),
            data_units: all(search.experiments).map(|(_, m)| m.data_unit().name.into()).collect(),
            singular_values,
            not_identifiable: findings,
            discretization_error: assessment.discretization,
            resolution: resolutions(experiments),
            residual_tests: assessment.residual_tests,
            noise_scale: assessment.noise_scale,
            dropped: dropped(experiments),
            losses: assessment.losses,
            predictions: assessment.predictions,
            score_tests: assessment.discrepancy.score_tests,
            undetected_bias: assessment.discrepancy.undetected_bias,
            determined_groups: assessment.determined_groups,
            recordings: assessment.recordings,
            posterior_draws: assessment.posterior_draws,
            local_minima,
            simulations: search.simulations(),
            wall_seconds: since.elapsed().as_secs_f64(),
            vector_unit: simd_level().into(),
            status: conclusion.status,
            grade: conclusion.grade,
            verdict: conclusion.verdict,
            warnings,
            warning_codes,
            interrupted,
            plot_data,
        }
    }

    /// A value and its unit, converted to the unit of the data files: from rad/s to Hz if frequencies were given in Hz
    /// and none in rad/s. Other units stay.
    pub(crate) fn in_data_unit<'a>(&self, value: f64, unit: &'a str) -> (f64, &'a str) {
        // Reports use Hz only if no measurement was given in rad/s.
        let is_frequency = unit == "rad/s";
        let is_given = |name: &str| self.data_units.iter().any(|own| own == name);
        match is_frequency && is_given("Hz") && !is_given("rad/s") {
            true => (value / DataUnit::HERTZ.size, DataUnit::HERTZ.name),
            false => (value, unit),
        }
    }

    /// The identified parameters with their values, in their units, for [`Problem::with`](crate::Problem::with); of all
    /// experiments. Those without a value are left out.
    pub fn parameters(&self) -> Vec<(Parameter, f64)> {
        self.parameters.iter().filter_map(|e| Some((e.name, e.value?))).collect()
    }

    /// The identified parameters that belong to one experiment with their values, in their units. Those without a value
    /// are left out.
    pub fn parameters_of(&self, experiment: &Experiment) -> Vec<(Parameter, f64)> {
        let scene = experiment.problem.scene();
        // Without names of experiments an estimate belongs to all whose scenes have the parameter.
        let own = self.parameters.iter().filter(|e| match e.experiments.is_empty() {
            true => e.name.of(scene).is_some(),
            false => e.experiments.contains(&experiment.name),
        });
        own.filter_map(|e| Some((e.name, e.value?))).collect()
    }

    /// Descriptions of the likely omitted effects, by significant score tests of the residuals, in their order.
    pub fn likely_omitted_effects(&self) -> Vec<String> {
        likely_omitted_effects(&self.score_tests)
    }

    /// One description per omitted effect with the largest biases above a standard error, with all its biased
    /// parameters. Effects without such a bias are left out.
    pub fn undetected_bias_texts(&self) -> Vec<String> {
        largest_biases(&self.undetected_bias).iter().map(|all| all[0].with(all)).collect()
    }

    /// Old name of [`likely_omitted_effects`](Self::likely_omitted_effects).
    #[deprecated(since = "0.2.0", note = "renamed to `likely_omitted_effects`")]
    pub fn looks_like(&self) -> Vec<String> {
        self.likely_omitted_effects()
    }

    /// Old name of [`undetected_bias_texts`](Self::undetected_bias_texts).
    #[deprecated(since = "0.2.0", note = "renamed to `undetected_bias_texts`")]
    pub fn hidden(&self) -> Vec<String> {
        self.undetected_bias_texts()
    }

    /// The first estimate of a parameter; `None` if it was not identified.
    pub fn estimate(&self, parameter: Parameter) -> Option<&Estimate> {
        self.parameters.iter().find(|e| e.name == parameter)
    }

    /// Code of the grade and all estimates with standard errors or one-sided bounds in one line, for a list of several
    /// fits. Estimates without these are `no error` or `not identifiable`. The code is padded to 22 characters, then
    /// the estimates follow, separated by semicolons.
    pub fn in_a_line(&self) -> String {
        let value = |e: &Estimate| {
            let unit = e.name.unit();
            let words = match (e.value, e.std_error, e.upper95) {
                // Data that bound a parameter from below only have no estimate of it.
                _ if e.lower95.is_some() => {
                    format!("at least {:.2e} {unit}", e.lower95.unwrap_or_default())
                }
                (Some(_), _, Some(upper)) => format!("at most {upper:.2e} {unit}"),
                (Some(value), Some(error), None) => {
                    format!("{} +- {} {unit}", digits(value, error), digits(error, error))
                }
                (Some(value), None, None) => format!("{value:e} {unit}, no error"),
                (None, ..) => "not identifiable".into(),
            };
            format!("{} {}", e.label(), words.trim_end())
        };
        let values: Vec<String> = self.parameters.iter().map(value).collect();
        format!("{:<22}  {}", self.grade.code(), values.join("; ")).trim_end().into()
    }

    /// Whether the grade is usable, so that the exit code is 0. The fit then converged, was not stopped, every
    /// parameter is identified, and no warning makes the values unusable. Other warnings, as of the model or of the
    /// discretization, do not count.
    pub fn is_success(&self) -> bool {
        self.grade.is_usable()
    }
}

/// The parts of a covariance of `n` parameters for a report: correlations, singular values and unidentifiable
/// directions. Without a covariance the `n` by `n` correlations are `None`, and the other two are empty.
pub(crate) fn covariance_parts(
    covariance: Option<Covariance>,
    n: usize,
) -> (Vec<Vec<Option<f64>>>, Vec<f64>, Vec<UnidentifiableDirection>) {
    match covariance {
        Some(c) => (c.correlation, c.singular_values, c.findings),
        None => (vec![vec![None; n]; n], Vec::new(), Vec::new()),
    }
}

/// Mesh, step and scheme of each experiment for which the program chose any of them, `None` for others; an empty list
/// if it chose none.
pub(crate) fn resolutions(experiments: &[Experiment]) -> Vec<Option<Resolution>> {
    let chosen = |e: &Experiment| e.problem.resolution().copied().filter(|r| r.chosen.any());
    let all: Vec<_> = experiments.iter().map(chosen).collect();
    if all.iter().any(Option::is_some) { all } else { Vec::new() }
}

/// Numbers of left-out rows of each measurement that has any, with its label.
fn dropped(experiments: &[Experiment]) -> Vec<DroppedRows> {
    let all = all(experiments).filter(|(_, m)| m.dropped() != Dropped::default());
    all.map(|(e, m)| DroppedRows { observation: e.label(m), rows: m.dropped() }).collect()
}

/// A `value` as text in exponential form, with `ceil(log10(|value/error|)) + 1` digits after the point, 1 to 15. These
/// reach at least the second significant digit of its `error`. There are 15 digits for a value of zero, and for a
/// number or error that is not finite.
pub(crate) fn digits(value: f64, error: f64) -> String {
    // The digits of value over error, and one more for the second significant digit of the error.
    let needed = (value.abs() / error.abs().max(f64::MIN_POSITIVE)).log10().ceil() + 1.0;
    let after_point = if needed.is_finite() { needed.clamp(1.0, 15.0) as usize } else { 15 };
    format!("{value:.after_point$e}")
}

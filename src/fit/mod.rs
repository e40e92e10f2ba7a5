//! Identification of parameters of rods and structures from measurements.
//!
//! Input: [experiments](Experiment), each a scene with its measurements, unknown parameters, and inputs with a
//! standard uncertainty. [`Fit`] minimizes the difference between measurements and simulations by the
//! [Levenberg-Marquardt](crate::numerics::levenberg_marquardt) method with exact sensitivities. Start values are
//! optional.
//!
//! Output: a [`FitReport`]. Of a completed fit, an identifiable parameter has an estimate with a standard error or a
//! one-sided bound, and in general an uncertainty budget ([`Estimate::budget`]). Standard errors are by the exact
//! Jacobian, [on request](Analysis) also by the exact Hessian, the profile likelihood or a bootstrap. The report also
//! has the parameters that the data do not determine ([`FitReport::not_identifiable`]), the discretization error
//! ([`DiscretizationError`]), tests of the residuals ([`ResidualTests`]), the errors of predicted validation data
//! ([`Prediction`]), and other local minima ([`LocalMinima`]).
//!
//! A [`FitFile`] (`file`, the `*_form` files, `measurement_tables`, `required`), or calls to [`Fit`], define a fit;
//! `validate`, `duplicates` and `known` check it. `measurement` has the data, `misfit` their [residuals](Residuals),
//! `search` finds the optimum. Where scenes leave mesh and step open, `resolution` refines these and the fit is
//! repeated. `uncertainty` assesses the optimum, `report` is the result, `extend` adds omitted effects. `design`
//! evaluates plans, `field` fits lists along the rod, `validation_errors` compares without a fit, and `structure`
//! serves scenes of several rods.
//!
//! [`Fit::solve`] is the fit. `stop_when` sets a flag that stops it; its report then has the best values so far.
//! `keep_plot_data` costs further simulations. `with_resolution_of` is the fit on the final meshes of its report, and
//! `residuals` are its residuals as a function of the unknowns.

mod buckling_form;
pub(crate) mod design;
mod duplicates;
mod experiment_form;
mod extend;
mod field;
mod file;
mod former_names;
mod frequencies_form;
pub(crate) mod image;
mod known;
mod load_deflection_form;
pub(crate) mod measurement;
mod measurement_tables;
pub(crate) mod misfit;
mod observation_form;
mod parameter_form;
mod pose_form;
pub(crate) mod report;
mod required;
pub(crate) mod resolution;
pub(crate) mod search;
mod sensor_form;
mod shape_form;
pub(crate) mod structure;
pub(crate) mod uncertainty;
mod unknown;
mod validate;
mod validation_errors;

pub use crate::input::missing_keys::placeholders;
pub use crate::numerics::levenberg_marquardt::LevenbergMarquardt;
pub use design::report::{Advice, Choice, Contribution, Design, DesignVariable};
pub use extend::ExtendedFit;
pub use field::{Field, FieldEstimate, FieldFit, FieldReport, SingleEstimate};
pub use file::FitFile;
#[doc(hidden)]
pub use former_names::*;
#[cfg(all(test, feature = "page"))]
pub(crate) use image::ImageFile;
#[cfg(feature = "page")]
pub(crate) use image::MOST_BYTES as MOST_IMAGE_BYTES;
pub use known::{Correlation, Known};
pub use marker_files::{Axes, AxisColumnNames, Dropped, Format, Recording, SigmaColumns, Vertical};
pub use marker_files::{ColumnKey, ColumnRule, ColumnRules, ColumnWithUnit};
pub use measurement::buckling::{Buckling, BucklingLoad};
pub use measurement::dataset::{Abscissa, Dataset, Header};
pub use measurement::experiment::Experiment;
pub use measurement::frequencies::{Frequencies, Frequency, ModeFrequencies};
pub use measurement::gauge::{Gauge, GaugeReadings};
pub use measurement::inspection::{InspectedMarker, Inspection};
pub use measurement::load_deflection::{LoadCurve, LoadDeflection, LoadedPoint};
pub use measurement::loss::Loss;
pub use measurement::motion::{Glitches, Observation, PointMotion, Sample};
pub use measurement::point_channel::{PointChannel, PointQuantity};
pub use measurement::point_pose::PoseReadings;
pub use measurement::pose_sensor::{Mounting, PoseSensor};
pub use measurement::quantity::{GaugeContext, Observable, PointState};
pub use measurement::reading::Reading;
pub use measurement::rotation_readings::RotationReading;
pub use measurement::sensor::{Sensor, SensorReadings, Tare};
pub use measurement::sensor_channel::{Channel, ReactionPart, SensorChannel};
pub use measurement::shape::{EquilibriumShape, RestShape, ShapePoint};
pub use measurement::{MeasuredData, Measurement};
pub use misfit::residual_tests::ResidualTests;
pub use misfit::residuals::Residuals;
#[cfg(feature = "page")]
pub(crate) use report::estimate_table::interval_content;
#[cfg(feature = "page")]
pub(crate) use report::experiment_estimates::compared_estimates;
pub use report::fit_summary::FitSummary;
pub use report::image_overlay::{ImageOverlay, OverlayMarker};
pub use report::plot_data::{
    Measured, PlotData, RodShape, SearchRange, Series, SimulationSettings,
};
#[cfg(feature = "page")]
pub(crate) use report::quoted::{
    QuotedEstimate, QuotedInterval, interval_heading, quoted_estimates,
};
pub use report::recorded_motion::{
    MeanError, RecordedMotion, RecordedSnapshot, RecordingPlots, SpeedError, WindowError,
};
#[cfg(feature = "cli")]
pub use report::renamed_keys::{RENAMED_KEYS, RenamedKey, with_current_names};
pub use report::{DroppedRows, FitReport};
pub use search::Progress;
pub use search::grid::Landscape;
pub use search::journal::Iterate;
pub use search::local_minima::{LocalMinima, LocalMinimum, MinimumSource};
pub use uncertainty::analysis::{Analysis, Refinement};
pub use uncertainty::budget::entries::{BudgetLine, InputSensitivity, MonteCarlo};
pub use uncertainty::covariance::determined_groups::DeterminedGroup;
pub use uncertainty::covariance::identifiability::{NonIdentifiability, UnidentifiableDirection};
pub use uncertainty::covariance::profile_likelihood::Profile;
#[cfg(feature = "page")]
pub(crate) use uncertainty::discrepancy::findings::biases_beyond_interval;
pub use uncertainty::discrepancy::findings::{ScoreTest, UndetectedBias};
pub use uncertainty::discrepancy::free_run::{ErrorSummary, RecordingError, RecordingErrors};
pub use uncertainty::discrepancy::prediction::Prediction;
use uncertainty::discrepancy::scene_notes::is_impossible;
pub use uncertainty::discretization::errors::DiscretizationError;
pub use uncertainty::estimate::{ClusterJackknife, Estimate, ExperimentEstimate};
pub use uncertainty::grade::Grade;
pub use uncertainty::method_intervals::MethodIntervals;
#[cfg(feature = "page")]
pub(crate) use uncertainty::method_intervals::method_intervals;
pub use uncertainty::noise::noise_scale::NoiseScale;
pub use uncertainty::noise::residual_noise::LossEffect;
pub use uncertainty::posterior::draws::{PosteriorDraw, PosteriorDraws};
pub use uncertainty::posterior::settings::PosteriorSettings;
pub use uncertainty::posterior::summary::Posterior;
pub use uncertainty::resampling::bootstrap::Bootstrap;
pub use unknown::{Prior, Unknown};
pub use validation_errors::report::{
    FailedPrediction, MeasurementError, ValidationReport, ValidationSummary,
};

use crate::code::Code;
use crate::error::{Error, none_on_failure};
use crate::fit::design::plan::PlannedFit;
use crate::fit::duplicates::check_duplicates;
use crate::fit::measurement::constant_axes::{all_constant_axes, without_constant_axes};
use crate::fit::measurement::experiment::{fitted as measured, full_work};
use crate::fit::measurement::repeated_frames::all_repeated_frames;
use crate::fit::misfit::initial_sigmas::first_sigmas;
use crate::fit::report::outcome::FitOutcome;
use crate::fit::resolution::{
    RefinedStart, refined_start, with_initial_resolution, with_reported_resolution,
    with_smooth_steps,
};
use crate::fit::search::Search;
use crate::fit::search::data_precheck::DataPrecheck;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::local_minima::{SAME, distance};
use crate::fit::search::minimum_comparison::{
    MinimumComparison, equal_minimum_warning, unreached_minimum_warning,
};
use crate::fit::search::optimum::Optimum;
use crate::fit::structure::structure_problem::refuse_structure;
use crate::fit::uncertainty::assessment::{AssessmentInputs, assess};
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::discretization::limit::estimate_bias;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::fit::uncertainty::warnings::data::{constant_axes, repeated_frames};
use crate::fit::unknown::with_fixed_layouts;
use crate::fit::validate::{check, check_recorded};
use crate::numerics::stopwatch::Stopwatch;
use crate::problem::Problem;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A fit: experiments, unknowns, inputs with an uncertainty, and the analyses of the result.
///
/// ```no_run
/// use rodfit::{Fit, Observation, Parameter, Scene};
/// let problem = Scene::load("data/cantilever.toml")?.problem()?;
/// let fit = Fit::new(&problem)
///     .observe(Observation::read("data/cantilever-tip.csv")?)
///     .identify(Parameter::YoungsModulus)
///     .solve()?;
/// println!("{fit}");
/// # Ok::<(), rodfit::Error>(())
/// ```
///
/// Experiments share all parameters but those with names of experiments:
///
/// ```no_run
/// use rodfit::fit::{Experiment, Frequencies, RestShape};
/// use rodfit::{Fit, Parameter, Scene, Unknown};
/// # let (long, short) = (Scene::load("a.toml")?.problem()?, Scene::load("b.toml")?.problem()?);
/// let droop = Experiment::new("long", &long).observe(RestShape::read("droop.csv")?);
/// let ringing = Experiment::new("short", &short).observe(Frequencies::hz(&[4.21], 0.02));
/// let fit = Fit::of([droop, ringing])
///     .identify(Parameter::YoungsModulus)
///     .identify(Parameter::Density)
///     .identify(Unknown::new(Parameter::ClampAngle).of_experiment("long"))
///     .solve()?;
/// # Ok::<(), rodfit::Error>(())
/// ```
#[derive(Clone)]
pub struct Fit {
    experiments: Vec<Experiment>,
    unknowns: Vec<Unknown>,
    knowns: Vec<Known>,
    analysis: Analysis,
    progress: Option<Progress>,
    keep_plot_data: bool,
}

/// State of a search that [stopped at the first acceptable optimum](Search::stops_at_first_fit), from which a complete
/// search continues.
struct FirstFit<'a> {
    search: &'a Search<'a>,
    experiments: &'a [Experiment],
    /// The optimum, on the unknowns' scales.
    x: Vec<f64>,
}

/// State of a fit between the first optimum and the report, passed on by [`Fit::refine`].
#[derive(Clone, Copy)]
struct RefinementState<'a> {
    precheck: &'a DataPrecheck,
    /// Start of the fit.
    since: Stopwatch,
    /// The search, if it stopped at the first optimum that explains the motion.
    first_fit: Option<&'a FirstFit<'a>>,
    /// Whether the other minima have been compared with the optimum on its mesh.
    is_compared: bool,
    /// Number of refinements of mesh and step.
    round: usize,
}

impl Fit {
    /// A fit of the parameters of `problem`, as one experiment without a name, and without measurements and unknowns
    /// yet.
    pub fn new(problem: &Problem) -> Self {
        Self::of([Experiment::new("", problem)])
    }

    /// A fit of several experiments, which may share parameters, without unknowns and inputs yet. Analyses are the
    /// default ones, and data of plots are not kept.
    pub fn of(experiments: impl IntoIterator<Item = Experiment>) -> Self {
        Self {
            experiments: experiments.into_iter().collect(),
            unknowns: Vec::new(),
            knowns: Vec::new(),
            analysis: Analysis::default(),
            progress: None,
            keep_plot_data: false,
        }
    }

    /// The experiments with their measurements, in the order in which they were added.
    pub fn experiments(&self) -> &[Experiment] {
        &self.experiments
    }

    /// The parameters to identify, in the order in which they were added.
    pub fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// Adds an experiment. Later measurements are added to it.
    pub fn experiment(mut self, experiment: Experiment) -> Self {
        self.experiments.push(experiment);
        self
    }

    /// Adds a measurement to the last experiment, after those that it has; no effect without an experiment.
    pub fn observe(mut self, measurement: impl Into<Measurement>) -> Self {
        if let Some(experiment) = self.experiments.last_mut() {
            experiment.measurements.push(measurement.into());
        }
        self
    }

    /// Adds a parameter to identify, with or without start, bounds and prior.
    pub fn identify(mut self, unknown: impl Into<Unknown>) -> Self {
        self.unknowns.push(unknown.into());
        self
    }

    /// Adds an input with a standard uncertainty, which is a line of the uncertainty budget.
    pub fn known(mut self, known: Known) -> Self {
        self.knowns.push(known);
        self
    }

    /// Replaces the analyses beside the estimates, as bootstrap or profile likelihood.
    pub fn analyse(self, analysis: Analysis) -> Self {
        Self { analysis, ..self }
    }

    /// Calls `progress` at each stage and iteration of the fit, with the name of the stage and the work done so far, in
    /// full simulations of all experiments.
    pub fn on_progress(mut self, progress: impl Fn(&str, f64) + Send + Sync + 'static) -> Self {
        self.progress = Some(Arc::new(progress));
        self
    }

    /// Keeps the data of the plots in [`FitReport::plot_data`]. This costs one more simulation of each experiment, and
    /// several of recordings that prescribe the ends.
    pub fn keep_plot_data(self) -> Self {
        Self { keep_plot_data: true, ..self }
    }

    /// Stops the fit at the next time step once `flag` is set, for the experiments added before this call. The report
    /// then has the best values so far, and its `interrupted` is true. Before the first evaluated point,
    /// [`solve`](Self::solve) returns [`Error::Interrupted`].
    pub fn stop_when(mut self, flag: Arc<AtomicBool>) -> Self {
        for experiment in &mut self.experiments {
            experiment.problem = experiment.problem.clone().stop_when(flag.clone());
        }
        self
    }

    /// The residuals in units of their standard deviations (preliminary ones where none is given) as functions of the
    /// unknowns, and their derivatives, for any solver of argmin. They are those of all fitted measurements over the
    /// whole records with their robust losses, then of the priors; validation data are left out. Meshes and steps are
    /// those of the scenes, also where the program chose these for a simulation. [`solve`](Self::solve) chooses them by
    /// the accuracy that the data require; [`with_resolution_of`](Self::with_resolution_of) has the fit on these.
    ///
    /// # Errors
    ///
    /// A fit that cannot be solved.
    pub fn residuals(&self) -> Result<Residuals, Error> {
        self.check()?;
        // Solvers of the user need residuals that are smooth functions of the unknowns.
        let fitted = measured(&with_smooth_steps(self.prepared_experiments()?)?);
        let horizons = vec![f64::MAX; fitted.len()];
        let (sigmas, work) = (first_sigmas(&fitted), full_work(&fitted)?);
        Residuals::new(&fitted, &sigmas, &self.unknowns, &horizons, work)
    }

    /// The fit on the meshes and with the steps on which `report`, a result of it, ended, where its scenes leave them
    /// open. Its [`residuals`](Self::residuals) are then minimal at the values of the report less the corrections of
    /// their discretization errors ([`DiscretizationError`]), within the tolerance of the search.
    ///
    /// # Errors
    ///
    /// A report of a fit with another number of experiments.
    pub fn with_resolution_of(&self, report: &FitReport) -> Result<Self, Error> {
        let experiments = with_reported_resolution(&self.experiments, &report.resolution)?;
        Ok(Self { experiments, ..self.clone() })
    }

    /// The expected uncertainty of planned or existing measurements, without a fit: standard errors, intervals and
    /// budgets at the start values, or else at the values of the scenes. It also has the standard errors with other
    /// markers, durations and frame rates. Of existing data only the times, observed coordinates and noise are used.
    ///
    /// # Errors
    ///
    /// A fit that cannot be solved even with the planned data, a structure, a noise that is not given, and a simulation
    /// that fails.
    pub fn design(&self) -> Result<Design, Error> {
        self.check_plan()?;
        for experiment in &self.experiments {
            refuse_structure(&experiment.problem, "scene", "the design of experiments")?;
        }
        let experiments = self.prepared_experiments()?;
        let (unknowns, knowns) = (&self.unknowns[..], &self.knowns[..]);
        let (analysis, progress) = (&self.analysis, self.progress.clone());
        PlannedFit { experiments: &experiments, unknowns, knowns, analysis, progress }.design()
    }

    /// Finds the parameters. Stages: validation, plausibility of the data, global search, refinement of mesh and step
    /// where the scenes leave these open, comparison with other minima, uncertainties. The report includes whether the
    /// fit converged or was interrupted, and the parameters that are not identifiable. Data without motion give a
    /// report without values.
    ///
    /// ```
    /// use rodfit::{Fit, Observation, Parameter, Scene};
    /// let problem = Scene::load("data/cantilever.toml")?.problem()?;
    /// let report = Fit::new(&problem)
    ///     .observe(Observation::read("data/cantilever-tip.csv")?)
    ///     .identify(Parameter::YoungsModulus)
    ///     .solve()?;
    /// let estimate = report.estimate(Parameter::YoungsModulus).expect("an identified parameter");
    /// let [low, high] = estimate.interval95.expect("an interval"); // Pa
    /// assert!(report.converged && low < 1e8 && 1e8 < high);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// A fit that is not valid, recordings that cannot be of this rod, or no start that can be simulated.
    pub fn solve(&self) -> Result<FitReport, Error> {
        let since = Stopwatch::start();
        self.check()?;
        let experiments = with_initial_resolution(self.prepared_experiments()?)?;
        let measured = measured(&experiments);
        let mut precheck = DataPrecheck::new(&measured, &self.unknowns)?;
        // Findings that the report mentions, though the fit already takes them into account.
        precheck.constant_axes = all_constant_axes(&self.experiments, &self.stated_numbers());
        precheck.repeated_frames = all_repeated_frames(&measured);
        let (progress, tolerance) = (self.progress.clone(), self.analysis.tolerance);
        let mut search = Search::new(&measured, &self.unknowns, progress, tolerance)?;
        search.suspicious = !precheck.suspicions.is_empty();
        let outcome = match &precheck.fatal {
            Some(words) => FitOutcome::unsearched(&search, words, self.keep_plot_data),
            None => match self.search(&mut search, &experiments, &precheck, since) {
                Err(Error::Interrupted) => FitOutcome::unfinished(&search, self.keep_plot_data)?,
                // A failed search often has its cause in the data: the suspicions of the precheck come first.
                Err(error @ Error::Fit(_)) => return Err(precheck.explain(error)),
                report => return report,
            },
        };
        Ok(FitReport::new(outcome, &search, &experiments, since))
    }

    /// Searches the global optimum on the initial mesh, and refines and assesses it. Where a scene leaves mesh or step
    /// open, the search stops at the first optimum that explains the motion, except for rods with recorded ends. If its
    /// residuals are then not noise, the state of the search is kept, so that `refine` can complete it. `since` is the
    /// start of the fit, for its duration. The sigmas and leverage weights in `search` are changed. Errors are those of
    /// the search and of the assessment.
    fn search(
        &self,
        search: &mut Search,
        experiments: &[Experiment],
        precheck: &DataPrecheck,
        since: Stopwatch,
    ) -> Result<FitReport, Error> {
        let open = experiments.iter().any(|e| e.problem.scene().chosen().any());
        // On a coarse first mesh residuals are not yet noise: only a wrong minimum can be recognized by them.
        search.stops_at_first_fit = open && !search.is_displacement_driven();
        let optimum = search.find_optimum()?;
        let first = FirstFit { search, experiments, x: optimum.x.clone() };
        let first_fit = (search.stops_at_first_fit && !search.is_noise(&optimum)).then_some(&first);
        let state = RefinementState { precheck, since, first_fit, is_compared: false, round: 0 };
        self.refine(Fitted { search, optimum: &optimum }, experiments, state)
    }

    /// From an optimum to the report. Stages: hold undetermined unknowns, and refine mesh and step to the accuracy that
    /// the optimum requires. Then complete a search that stopped early, compare the optimum with other minima, and
    /// assess the final one. A finer mesh, or another optimum of the completion or the comparison, calls this function
    /// again with the changed `state`; held unknowns do not. A lower minimum whose report did not converge is replaced
    /// by the report of this optimum, with a warning. Errors are those of the assessment of this optimum.
    fn refine(
        &self,
        fitted: Fitted,
        experiments: &[Experiment],
        state: RefinementState,
    ) -> Result<FitReport, Error> {
        // 1. Unknowns along directions that the data do not determine are held.
        let search = fitted.search;
        let mut local = LocalAnalysis::new(fitted, None)?;
        let held = local.covariance.held_unknowns();
        let reduced = match held.is_empty() {
            true => None,
            false => none_on_failure(fitted.without_undetermined(&held))?,
        };
        let optimum = reduced.as_ref().unwrap_or(fitted.optimum);
        let fitted = Fitted { search, optimum };
        if reduced.is_some() {
            local = LocalAnalysis::new(fitted, None)?;
        }
        // 2. Mesh and step are refined by the estimated discretization errors.
        let mut warnings = Warnings::default();
        let open = experiments.iter().any(|e| e.problem.scene().chosen().any());
        let bias = match open {
            true => estimate_bias(fitted, &local, &self.analysis, &mut warnings)?,
            false => None,
        };
        // Standard errors at the optimum determine the discretization error that is acceptable.
        let finer = refined_start(experiments, fitted, &local, bias.as_ref(), state.round)?;
        if let Some(RefinedStart { experiments, x: start }) = finer {
            let measured = measured(&experiments);
            let mut next = search.with_experiments(&measured)?;
            // The start is the optimum expected on this mesh, so that few iterations remain.
            let polished = next.polish(&start)?;
            // A damping near zero on a coarser mesh may be larger on this one.
            let raised = next.with_raised_damping(polished)?;
            let weighted = next.with_growth_weights(raised)?;
            // Sigmas that are not given contained the discretization errors of the coarser mesh.
            next.follow(&optimum.x, &start, &weighted);
            let before = weighted.x.clone();
            let found = next.reweighted(weighted)?;
            search.journal.move_minimum(&before, next.minimum(&found));
            let state = RefinementState { round: state.round + 1, ..state };
            return self.refine(Fitted { search: &next, optimum: &found }, &experiments, state);
        }
        // 3. A search that stopped early is completed if its residuals are no discretization error.
        if let Some(first) = state.first_fit.filter(|_| !search.is_noise(optimum)) {
            // The search continues on its first mesh, where its many simulations cost least.
            let mut complete = first.search.with_experiments(first.search.experiments)?;
            if let Some(other) = none_on_failure(complete.find_optimum())?
                && distance(&other.x, &first.x) > SAME
            {
                let state = RefinementState { first_fit: None, round: 0, ..state };
                let fitted = Fitted { search: &complete, optimum: &other };
                return self.refine(fitted, first.experiments, state);
            }
            // The first mesh may be too coarse for the basin of a right start.
            if let Some(start) = search.given_start(Some(optimum))
                && let Some(other) = none_on_failure(search.polish(&start))?
                && other.cost < optimum.cost
            {
                let state = RefinementState { first_fit: None, ..state };
                let mut next = search.clone();
                if let Some(other) = none_on_failure(next.reweighted(other))? {
                    let fitted = Fitted { search: &next, optimum: &other };
                    return self.refine(fitted, experiments, state);
                }
                search.journal.reweight(&search.sigmas);
            }
        }
        // 4. Minima that were near in their objective are compared on this mesh.
        if !state.is_compared {
            let compared = search.compare_minima(optimum, local.noise.misfit_scale)?;
            let MinimumComparison { search: mut next, lower, mut unreached } = compared;
            let lower = match lower {
                Some(lower) => {
                    let before = lower.x.clone();
                    let found = none_on_failure(next.reweighted(lower))?;
                    if let Some(found) = &found {
                        search.journal.move_minimum(&before, next.minimum(found));
                    }
                    found
                }
                None => None,
            };
            if let Some(lower) = lower {
                let state = RefinementState { first_fit: None, is_compared: true, ..state };
                let fitted = Fitted { search: &next, optimum: &lower };
                let report = self.refine(fitted, experiments, state)?;
                // A lower point where the optimizer did not converge is a warning beside a converged optimum, not the
                // result.
                if report.converged || report.interrupted || !optimum.converged {
                    return Ok(report);
                }
                unreached = Some(lower.x);
            }
            // Later points are in the units of this search again.
            search.journal.reweight(&search.sigmas);
            if let Some(x) = unreached {
                let words = unreached_minimum_warning(search.unknowns, &x);
                warnings.add(Severity::Worthless, Code::BetterMinimum, words);
            }
        }
        if let Some(other) =
            search.equal_minimum(optimum, local.noise.misfit_scale, &local.covariance.deviation)
        {
            let words = equal_minimum_warning(search.unknowns, &other.x);
            // A rod that cannot exist is no other explanation of the data.
            let other = Optimum { x: other.x, ..optimum.clone() };
            let is_possible = !is_impossible(Fitted { search, optimum: &other });
            let severity = if is_possible { Severity::Worthless } else { Severity::Note };
            warnings.add(severity, Code::EqualMinimum, words);
        }
        // 5. The final optimum is assessed.
        repeated_frames(&state.precheck.repeated_frames, &mut warnings);
        let suspicions = &state.precheck.suspicions;
        let inputs = AssessmentInputs { local, bias, warnings, suspicions, experiments };
        let mut assessment = assess(fitted, inputs, &self.analysis, &self.knowns)?;
        constant_axes(&state.precheck.constant_axes, &mut assessment.warnings);
        let outcome = FitOutcome::assessed(fitted, assessment, experiments, self.keep_plot_data);
        Ok(FitReport::new(outcome, search, experiments, state.since))
    }

    /// The experiments without constant coordinates. The layout of each mesh is fixed for generic values of all
    /// parameters by which the residuals are differentiated: unknowns and inputs with an uncertainty. Error: a scene
    /// that cannot be prepared.
    fn prepared_experiments(&self) -> Result<Vec<Experiment>, Error> {
        // The budget varies the inputs too: the layout must not change with them either.
        let parameters = self.stated_numbers();
        let without = |experiment: &Experiment| without_constant_axes(experiment, &parameters);
        let experiments: Vec<Experiment> = self.experiments.iter().map(without).collect();
        with_fixed_layouts(&experiments, &parameters)
    }

    /// The unknowns, and then the inputs with a stated uncertainty as unknowns.
    fn stated_numbers(&self) -> Vec<Unknown> {
        let knowns = self.knowns.iter().map(Known::as_unknown);
        self.unknowns.iter().cloned().chain(knowns).collect()
    }

    /// Rejects a fit that cannot be solved: the errors of [`check_plan`](Self::check_plan), and planned measurements.
    fn check(&self) -> Result<(), Error> {
        self.check_plan()?;
        check_recorded(&self.experiments)
    }

    /// Rejects a fit that cannot be solved even if all planned measurements were recorded: missing data or unknowns,
    /// wrong values of keys, duplicates of measurements, and contradictory inputs.
    fn check_plan(&self) -> Result<(), Error> {
        check(&self.experiments, &self.unknowns, &self.analysis)?;
        check_duplicates(&self.experiments)?;
        known::check(&self.experiments, &self.unknowns, &self.knowns)
    }
}

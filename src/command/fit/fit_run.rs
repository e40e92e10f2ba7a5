//! One fit of `rodfit fit`: reads a fit file, solves it and writes its outputs.
//!
//! Three kinds of fit files are distinguished: validation data only (predictions, no fit), parameters that vary along
//! the rod (`[[field]]`), and single parameters. Each prints a summary and writes the requested report (`--json`) and
//! page (`--report`); fits also write the scenes with fitted values (`--save`), and those of single parameters the
//! draws of the posterior distribution (`--draws`). `--extend` and `--known` are errors for the first two kinds,
//! `--save` and `--draws` for the first, `--monte-carlo` for the second. `inputs` are the files that the fit reads;
//! `solve` makes the fit until a stop flag is set. The result is an exit code with a line for the overview of several
//! fits, and of single parameters a summary for the comparison page. The code is 3 if the grade is not usable, no
//! minimum was reached or an experiment could not be predicted. An output that cannot be written may raise it.

use crate::command::fit::FitOptions;
use crate::command::fit::extend::extended_fit;
use crate::command::fit::fit_name::output_path;
use crate::command::fit::save::{SavedScene, add_saved_scenes, scene_text};
use crate::command::known::add_known_inputs;
use crate::command::output::{Output, Outputs};
use crate::command::predict::{finish_prediction, prediction, set_derivatives};
use crate::command::{GlobalOptions, conclude, limits, terminal};
use rodfit::fit::{Experiment, FieldFit, FitFile, FitReport, FitSummary, PosteriorSettings};
use rodfit::{Code, Error, Parameter, page};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Comment in the first line of a scene file with the best values of an interrupted fit.
const INTERRUPTED_HEADER: &str =
    "# interrupted: the best values when the fit was stopped, not a result\n";

/// The outcome of a fit: its exit code, the result on one line (grade first), and its summary for the comparison page
/// (only of fits of single parameters).
pub(super) struct SolvedFit {
    pub code: u8,
    pub line: String,
    pub summary: Option<FitSummary>,
}

/// A fit that is read but not yet solved, with the destinations of its results.
pub(super) struct FitRun {
    pub path: PathBuf,
    /// Name of the fit among several.
    pub name: Option<String>,
    pub file: FitFile,
    pub outputs: Outputs,
    global: GlobalOptions,
    saved_scenes: Vec<SavedScene>,
    /// File of the draws from the posterior distribution.
    draws: Option<Output>,
    /// Whether to refit with effects that may explain the residuals.
    extends: bool,
    /// Whether the options request a Monte Carlo.
    has_monte_carlo_option: bool,
    /// Whether the options request a posterior distribution.
    has_posterior_option: bool,
}

impl FitRun {
    /// Reads the fit file at `path`, rejects meshes above the limits, applies the options (`--known`, `--monte-carlo`,
    /// `--posterior`, `--derivatives`), and adds the outputs, which are not yet checked. With a `name`, which a fit
    /// among several has, their paths contain it.
    pub fn new(
        path: &Path,
        name: Option<String>,
        options: &FitOptions,
        global: GlobalOptions,
    ) -> Result<Self, Error> {
        // Meshes are built while the file is read: those above the limits are rejected before.
        let admit = |scene: &_| limits::mesh_cost(scene).admit(global);
        let mut file = FitFile::load_if(path, admit)?;
        add_known_inputs(&mut file, &options.known)?;
        file.analysis.monte_carlo = options.monte_carlo.unwrap_or(file.analysis.monte_carlo);
        if let Some(draws) = options.posterior {
            let settings = file.analysis.posterior.unwrap_or_default();
            file.analysis.posterior = Some(PosteriorSettings { draws, ..settings });
        }
        set_derivatives(&mut file, options.derivatives);
        let own = name.as_deref();
        // Outputs of several fits have the names of their fits.
        let json = output_path(options.json.json.as_deref(), own, "--json")?;
        let mut outputs = Outputs::with_json_file(json.as_deref(), global);
        let folder = options.report.as_ref().map(|folder| folder.join(own.unwrap_or_default()));
        outputs.add_page_with_data(folder.as_deref(), "fit");
        let saved_scenes = match output_path(options.save.as_deref(), own, "--save")? {
            Some(path) => add_saved_scenes(&path, &file, &mut outputs)?,
            None => Vec::new(),
        };
        let draws = output_path(options.draws.as_deref(), own, "--draws")?;
        let draws = outputs.add("--draws", draws.as_deref());
        if draws.is_some() && file.analysis.posterior.is_none() {
            let allowed = "with --posterior N or [analysis] posterior";
            return Err(Error::invalid("--draws", "without a posterior distribution", allowed));
        }
        let (path, extends) = (path.into(), options.extend);
        Ok(Self {
            path,
            name,
            file,
            outputs,
            global,
            saved_scenes,
            draws,
            extends,
            has_monte_carlo_option: options.monte_carlo.is_some_and(|count| count > 0),
            has_posterior_option: options.posterior.is_some(),
        })
    }

    /// Paths of all files that the fit reads: its scenes, recordings and data, and the fit file last. Outputs must
    /// differ from them.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let mut inputs = self.file.files();
        inputs.push(self.path.clone());
        inputs
    }

    /// Runs the fit by the kind of its file: prediction of validation data, fit along the rod, or fit of single
    /// parameters, and writes its outputs. `stop` interrupts it; a fit of single parameters then has a report of the
    /// best values so far.
    pub fn solve(self, stop: Arc<AtomicBool>) -> Result<SolvedFit, Error> {
        if self.file.is_validation_only() {
            self.predict(stop)
        } else if let Some(fit) = self.file.field_fit()? {
            self.solve_field(&fit.stop_when(stop))
        } else {
            self.solve_parameters(&stop)
        }
    }

    /// Fits single parameters, extends the model with `--extend` (unless interrupted), and writes the scenes, the
    /// report, the page and the summary. The exit code is 3 if the grade is not usable (a note has the status and the
    /// grade), or that of an output that cannot be written.
    fn solve_parameters(mut self, stop: &Arc<AtomicBool>) -> Result<SolvedFit, Error> {
        let (plots, global) = (self.outputs.has_page(), self.global);
        let has_draws_file = self.draws.is_some();
        let solve = |file: &FitFile| solve(file, plots, stop.clone(), global);
        let mut report = solve(&self.file)?;
        // Residuals of an interrupted fit are not those of an optimum.
        if self.extends && !report.interrupted {
            report = extended_fit(&mut self.file, report, solve)?;
        }
        if report.interrupted {
            self.outputs.set_interrupted();
        }
        // The scenes are written before the report; an output that fails does not prevent the others.
        let title = self.path.display().to_string();
        let mut saved = self
            .write_scenes(|experiment| Ok(report.parameters_of(experiment)), report.interrupted);
        if let Some(draws) = &report.posterior_draws {
            saved.push(self.outputs.write(self.draws, || Ok(draws.to_csv().into_bytes())));
        }
        let lacks_draws = has_draws_file && report.posterior_draws.is_none();
        let code = if report.is_success() && !lacks_draws { 0 } else { 3 };
        let page = || page::fit_page(&report, &title);
        let summary = report.summary().with_subject(&title);
        let written = self.outputs.finish(code, &report, Some(&page), &summary);
        if !report.is_success() {
            let grade = report.grade.code();
            terminal::print_note(format_args!("error: {} [{grade}]", report.status));
        }
        if lacks_draws {
            terminal::print_note(
                "error: --draws: there is no posterior distribution, and no file was written",
            );
        }
        let (line, summary) = (report.in_a_line(), Some(FitSummary::new("", &report)));
        Ok(SolvedFit { code: conclude(written, saved), line, summary })
    }

    /// Predicts measurements that are all validation data, and writes the errors. The exit code is 3 if an experiment
    /// could not be predicted. Options of a fit (`--extend`, `--save`, `--draws`, `--known`, also inputs in the file)
    /// are rejected.
    fn predict(self, stop: Arc<AtomicBool>) -> Result<SolvedFit, Error> {
        // Nothing is fitted, so that options of a fit would be ignored silently.
        let excluded = [
            ("--extend", self.extends),
            ("--save", !self.saved_scenes.is_empty()),
            ("--draws", self.draws.is_some()),
            ("--known", !self.file.knowns.is_empty()),
            ("--monte-carlo", self.has_monte_carlo_option),
            ("--posterior", self.has_posterior_option),
        ];
        if let Some((option, _)) = excluded.into_iter().find(|(_, is_given)| *is_given) {
            let found = "with validation data only, to which nothing is fitted";
            return Err(Error::invalid(option, found, "--json and --report with predictions"));
        }
        let report = prediction(&self.file, self.outputs.has_page(), stop)?;
        let code = finish_prediction(&self.outputs, &report, &self.path.display().to_string());
        Ok(SolvedFit { code, line: report.in_a_line(), summary: None })
    }

    /// Estimates parameters that vary along the rod and writes the scenes (also without convergence), the report, the
    /// page and the summary. `--extend` is rejected here, `--known` and `--monte-carlo` when the fit is made. The exit
    /// code is 3 if no minimum was reached, or that of an output that cannot be written.
    fn solve_field(self, fit: &FieldFit) -> Result<SolvedFit, Error> {
        if self.extends {
            let allowed =
                "--json, --report and --save with fits of distributed parameters ([[field]])";
            return Err(Error::invalid("--extend", "with [[field]]", allowed));
        }
        let report = fit.solve()?;
        let title = self.path.display().to_string();
        let values = |experiment: &Experiment| report.values(experiment.problem.scene());
        // Scenes with the fitted values are written even if the fit did not converge.
        let saved = self.write_scenes(values, false);
        let (code, line) = match report.converged {
            true => (0, "converged, distributed parameters".to_string()),
            false => (3, Code::NotUsable.to_string()),
        };
        let page = || page::field_page(&report, &title);
        let summary = report.summary().with_subject(&title);
        let written = self.outputs.finish(code, &report, Some(&page), &summary);
        if code != 0 {
            let grade = Code::NotUsable;
            terminal::print_note(format_args!("error: no minimum was reached [{grade}]"));
        }
        Ok(SolvedFit { code: conclude(written, saved), line, summary: None })
    }

    /// Writes a scene file (TOML) for every saved scene, with the fitted `values` of the parameters of its experiment.
    /// Scenes of an interrupted fit begin with [`INTERRUPTED_HEADER`]. Returns the outcome of each file.
    fn write_scenes(
        &self,
        values: impl Fn(&Experiment) -> Result<Vec<(Parameter, f64)>, Error>,
        is_interrupted: bool,
    ) -> Vec<Result<(), Error>> {
        let write = |saved: &SavedScene| {
            let experiment = &self.file.experiments[saved.experiment];
            self.outputs.write(saved.output, || {
                let scene = scene_text(&experiment.problem, values(experiment)?)?;
                let header = if is_interrupted { INTERRUPTED_HEADER } else { "" };
                Ok([header.as_bytes(), &scene].concat())
            })
        };
        self.saved_scenes.iter().map(write).collect()
    }
}

/// The report of the fit of single parameters in `file`, with a spinner that shows the stage and the number of
/// simulations. `plots` keeps the data of the page's plots; `stop` interrupts the fit, which then has a report of the
/// best values so far.
fn solve(
    file: &FitFile,
    plots: bool,
    stop: Arc<AtomicBool>,
    global: GlobalOptions,
) -> Result<FitReport, Error> {
    let bar = terminal::spinner(global);
    let shown = bar.clone();
    let mut fit = file.fit().stop_when(stop);
    if plots {
        fit = fit.keep_plot_data();
    }
    let report = fit
        .on_progress(move |stage, simulations| {
            shown.set_message(format!("{stage} ({simulations:.1} simulations)"));
            shown.tick();
        })
        .solve();
    bar.finish_and_clear();
    report
}

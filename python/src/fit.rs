//! Fits in Python: their construction from scenes, arrays or files, their solution, their results, predictions and
//! designs, and their residuals with derivatives for other solvers (SciPy).
//!
//! Arrays are in SI units; missing coordinates are NaN. Results pass as JSON. Invalid input is an `InputError`, a
//! failed computation a `ComputationError`. Residuals are functions of a vector of the parameters on the solver's
//! scale: the natural logarithm of the value in SI units for positive parameters, the value for others.

use crate::error::{raised, refused};
use crate::json::{from_json, from_value, json_to_toml, raised_in_table, to_json};
use crate::scene::PyScene;
use crate::work::{WorkEvent, interruptible};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rodfit::fit::{
    Design, Experiment, FitFile, FitReport, PlotData, PosteriorDraws, Sample, ValidationReport,
    with_current_names,
};
use rodfit::{Observation, Parameter, Unknown};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A fit under construction; methods replace it under a lock.
#[pyclass(frozen, name = "Fit", module = "rodfit._rodfit")]
pub struct PyFit {
    fit: Mutex<rodfit::Fit>,
}

impl PyFit {
    /// The Python object of a fit.
    fn new_from(fit: rodfit::Fit) -> Self {
        Self { fit: Mutex::new(fit) }
    }

    /// The fit, also after a panic of another thread.
    fn lock(&self) -> MutexGuard<'_, rodfit::Fit> {
        self.fit.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The point of an observation.
#[derive(serde::Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"tip\", the index of a node, or {\"arc_length\": meters}; of a structure \
                 {\"rod\": name, \"at\": ..} or {\"body\": name}"
)]
enum ObservedPoint {
    /// Point of one rod.
    OfRod(rodfit::Point),
    /// Point of a structure.
    OfStructure(rodfit::scene::StructurePoint),
}

#[pymethods]
impl PyFit {
    /// A fit of experiments without measurements, given by their names and, in the same order, their scenes.
    #[new]
    fn new(names: Vec<String>, scenes: Vec<Py<PyScene>>) -> Self {
        let experiments = names.into_iter().zip(&scenes);
        let experiments =
            experiments.map(|(name, scene)| Experiment::new(name, &scene.get().problem));
        Self::new_from(rodfit::Fit::of(experiments))
    }

    /// The fit of a file (TOML); an error for an invalid file, and for values along the rod (`[[field]]`).
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let file = FitFile::load(path)
            .and_then(FitFile::of_parameters)
            .map_err(|error| raised(py, error))?;
        Ok(Self::new_from(file.fit()))
    }

    /// The fit of a TOML text, whose paths are relative to `folder`; errors as for a file.
    #[staticmethod]
    fn from_toml(py: Python<'_>, text: &str, folder: PathBuf) -> PyResult<Self> {
        let file = FitFile::from_toml(text, folder)
            .and_then(FitFile::of_parameters)
            .map_err(|error| raised(py, error))?;
        Ok(Self::new_from(file.fit()))
    }

    /// The fit of a plan file (TOML), whose measurements may have no data yet.
    #[staticmethod]
    fn load_plan(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let file = FitFile::load_plan_if(path, |_| Ok(()))
            .and_then(FitFile::of_parameters)
            .map_err(|error| raised(py, error))?;
        Ok(Self::new_from(file.fit()))
    }

    /// The names of the parameters to identify, and the number of measurements of each experiment.
    fn summary(&self) -> (Vec<String>, Vec<usize>) {
        let fit = self.lock();
        let names = fit.unknowns().iter().map(ToString::to_string).collect();
        (names, fit.experiments().iter().map(|e| e.measurements.len()).collect())
    }

    /// A copy of the fit in its current state.
    fn snapshot(&self) -> Self {
        Self::new_from(self.lock().clone())
    }

    /// Adds an experiment with a name and a scene, to which all later measurements belong.
    fn experiment(&self, name: &str, scene: Py<PyScene>) {
        let mut fit = self.lock();
        *fit = fit.clone().experiment(Experiment::new(name, &scene.get().problem));
    }

    /// Adds the observed motion of a point to the last experiment: times `t`, s, and positions `xyz`, m. Each time has
    /// a row of 1 to 3 coordinates, NaN if missing. `sigma` has no standard deviation, m, one, or one for each time;
    /// `point` and `loss` are JSON. Times without any coordinate are left out. `held_out` data validate the fit and are
    /// not fitted. Other shapes are an `InputError`.
    #[pyo3(signature = (t, xyz, point, sigma, loss, held_out))]
    #[allow(clippy::too_many_arguments)]
    fn observe(
        &self,
        py: Python<'_>,
        t: PyReadonlyArray1<'_, f64>,
        xyz: PyReadonlyArray2<'_, f64>,
        point: &str,
        sigma: Vec<f64>,
        loss: &str,
        held_out: bool,
    ) -> PyResult<()> {
        let (t, xyz) = (t.as_array(), xyz.as_array());
        let [rows, axes] = [xyz.nrows(), xyz.ncols()];
        // Shapes are checked here: the library has no arrays.
        if rows != t.len() || !(1..=3).contains(&axes) {
            let n = t.len();
            let words = format!(
                "xyz: found {rows} by {axes}, allowed: {n} by 1 to 3, one row for each time"
            );
            return Err(refused(py, words));
        }
        if ![0, 1, rows].contains(&sigma.len()) {
            let words = format!(
                "sigma: found {} values, allowed: one value, or {rows}, one for each time",
                sigma.len()
            );
            return Err(refused(py, words));
        }
        let samples = t.iter().zip(xyz.rows()).map(|(time, row)| Sample {
            time: *time,
            position: std::array::from_fn(|c| row.get(c).copied().filter(|x| !x.is_nan())),
        });
        // Rows without any coordinate are left out together with their standard deviations.
        let sigma_of = |k: usize| sigma.get(k).or(sigma.first()).copied();
        let observed = samples.enumerate().filter(|(_, s)| s.position.iter().any(Option::is_some));
        let (sigmas, samples): (Vec<Option<f64>>, Vec<Sample>) =
            observed.map(|(k, s)| (sigma_of(k), s)).unzip();
        let sigmas: Vec<f64> = sigmas.into_iter().flatten().collect();
        let mut observation =
            Observation::new(samples).sigmas(&sigmas).loss(from_json(py, "loss", loss)?);
        observation = match from_json(py, "at", point)? {
            ObservedPoint::OfRod(point) => observation.at(point),
            ObservedPoint::OfStructure(place) => observation.of_structure(place),
        };
        let mut fit = self.lock();
        observation.header.held_out = held_out;
        *fit = fit.clone().observe(observation);
        Ok(())
    }

    /// Adds `tables` of a fit file, given as JSON, with paths relative to `folder`: measurements to the last
    /// experiment, parameters and inputs to the fit. Analyses are replaced.
    fn add(&self, py: Python<'_>, tables: &str, folder: PathBuf) -> PyResult<()> {
        let text = json_to_toml(py, tables)?;
        let mut fit = self.lock();
        *fit = fit.add_toml(&text, folder).map_err(|error| raised_in_table(py, &text, error))?;
        Ok(())
    }

    /// Estimates the parameters; with `plots` the result has the data of plots. `progress` is called with the stage and
    /// the simulations so far; Ctrl-C stops the fit, which then returns its best values.
    fn solve(
        &self,
        py: Python<'_>,
        plots: bool,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<FitResult> {
        let fit = self.lock().clone();
        let has_progress = progress.is_some();
        let report = interruptible(py, progress.as_ref(), move |hooks| {
            let mut fit = fit.stop_when(hooks.stop);
            if plots {
                fit = fit.keep_plot_data();
            }
            if has_progress {
                let events = Mutex::new(hooks.events);
                fit = fit.on_progress(move |stage, simulations| {
                    let events = events.lock().unwrap_or_else(PoisonError::into_inner);
                    // Without a receiver the progress is not needed.
                    let _ = events.send(WorkEvent::Progress { stage: stage.into(), simulations });
                });
            }
            fit.solve()
        })?;
        Ok(FitResult { report })
    }

    /// The residuals of the fit as a function of the parameters, for other solvers. Mesh and step are those of the
    /// scenes, or of a `result` of the fit.
    #[pyo3(signature = (result=None))]
    fn residuals(&self, py: Python<'_>, result: Option<Py<FitResult>>) -> PyResult<PyResiduals> {
        let fit = self.lock().clone();
        let residuals = match &result {
            Some(result) => {
                fit.with_resolution_of(&result.get().report).and_then(|f| f.residuals())
            }
            None => fit.residuals(),
        };
        Ok(PyResiduals { residuals: residuals.map_err(|error| raised(py, error))? })
    }

    /// The expected uncertainties of planned or existing measurements. Ctrl-C stops the work.
    fn design(&self, py: Python<'_>) -> PyResult<PyReport> {
        let fit = self.lock().clone();
        let design = interruptible(py, None, move |hooks| fit.stop_when(hooks.stop).design())?;
        Ok(PyReport { content: ReportContent::Design(Box::new(design)) })
    }

    /// The errors of all measurements with the values of the scenes, without a fit. `plots`: with the data of plots,
    /// which pages need. Ctrl-C stops the work.
    fn predict(&self, py: Python<'_>, plots: bool) -> PyResult<PyReport> {
        let fit = self.lock().clone();
        let fit = if plots { fit.keep_plot_data() } else { fit };
        let report = interruptible(py, None, move |hooks| fit.stop_when(hooks.stop).predict())?;
        Ok(PyReport { content: ReportContent::Prediction(Box::new(report)) })
    }
}

/// Content of a report that is not the result of a fit.
enum ReportContent {
    /// Expected uncertainties.
    Design(Box<Design>),
    /// Errors of predictions.
    Prediction(Box<ValidationReport>),
}

/// A design or a prediction.
#[pyclass(frozen, name = "Report", module = "rodfit._rodfit")]
pub struct PyReport {
    content: ReportContent,
}

#[pymethods]
impl PyReport {
    /// The design or prediction in JSON, as `rodfit design` or `rodfit predict` writes it.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        match &self.content {
            ReportContent::Design(design) => to_json(py, design),
            ReportContent::Prediction(report) => to_json(py, report),
        }
    }

    /// The summary that the command prints.
    fn words(&self) -> String {
        match &self.content {
            ReportContent::Design(design) => design.to_string(),
            ReportContent::Prediction(report) => report.to_string(),
        }
    }

    /// The HTML page of `rodfit design` or `rodfit predict`, with this title.
    fn page(&self, title: &str) -> String {
        match &self.content {
            ReportContent::Design(design) => rodfit::page::design_page(design, title),
            ReportContent::Prediction(report) => rodfit::page::prediction_page(report, title),
        }
    }
}

/// The result of a fit.
#[pyclass(frozen, module = "rodfit._rodfit")]
pub struct FitResult {
    report: FitReport,
}

#[pymethods]
impl FitResult {
    /// Reads the JSON that `json` returns, also with the keys of version 0.1; an `InputError` for another text.
    #[new]
    fn new(py: Python<'_>, text: &str) -> PyResult<Self> {
        let mut value: serde_json::Value = from_json(py, "result", text)?;
        with_current_names(&mut value);
        Ok(Self { report: from_value(py, "result", text, value)? })
    }

    /// The report in JSON, with its plot data if `plots` is true and the fit kept them.
    fn json(&self, py: Python<'_>, plots: bool) -> PyResult<String> {
        match plots || self.report.plot_data.is_none() {
            true => to_json(py, &self.report),
            false => {
                let mut report = self.report.clone();
                report.plot_data = None;
                to_json(py, &report)
            }
        }
    }

    /// The plot data in JSON; `None` if the fit did not keep them.
    fn plots(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let plots: Option<&PlotData> = self.report.plot_data.as_ref();
        plots.map(|plots| to_json(py, plots)).transpose()
    }

    /// The draws from the posterior distribution as CSV, if it was requested.
    fn draws(&self) -> Option<String> {
        self.report.posterior_draws.as_ref().map(PosteriorDraws::to_csv)
    }

    /// The summary that the command prints.
    fn words(&self) -> String {
        self.report.to_string()
    }

    /// The HTML page of `rodfit fit --report`, with this title.
    fn page(&self, title: &str) -> String {
        rodfit::page::fit_page(&self.report, title)
    }

    /// Whether `rodfit fit` would return exit code 0: the grade is usable.
    #[getter]
    fn success(&self) -> bool {
        self.report.is_success()
    }

    /// Names and estimated values, in their units, of the parameters; those without a value are left out.
    #[getter]
    fn values(&self) -> Vec<(String, f64)> {
        let name = |(parameter, value): (Parameter, f64)| (parameter.name().to_string(), value);
        self.report.parameters().into_iter().map(name).collect()
    }
}

/// Residuals in units of their noise, over the logarithms of positive parameters and the values of others.
#[pyclass(frozen, name = "Residuals", module = "rodfit._rodfit")]
pub struct PyResiduals {
    residuals: rodfit::fit::Residuals,
}

impl PyResiduals {
    /// The start value, else the mean of the prior, on the solver's scale; `None` without both.
    fn start_of(unknown: &Unknown) -> Option<f64> {
        unknown.start.or(unknown.prior.map(|prior| prior.mean)).map(|start| unknown.to_scale(start))
    }
}

#[pymethods]
impl PyResiduals {
    /// The names of the parameters, in the order of the vectors `x`.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.residuals.unknowns().iter().map(ToString::to_string).collect()
    }

    /// The start values, else the means of the priors, on the solver's scale; `None` for parameters without both.
    #[getter]
    fn x0(&self) -> Vec<Option<f64>> {
        self.residuals.unknowns().iter().map(Self::start_of).collect()
    }

    /// The lower and the upper bound of each parameter on the solver's scale.
    #[getter]
    fn bounds(&self) -> Vec<[f64; 2]> {
        self.residuals.unknowns().iter().map(Unknown::scaled_bounds).collect()
    }

    /// Whether the entry of each parameter in the vectors `x` is the natural logarithm of its value.
    #[getter]
    fn logarithmic(&self) -> Vec<bool> {
        self.residuals.unknowns().iter().map(|unknown| unknown.parameter.is_positive()).collect()
    }

    /// Number of residuals.
    fn __len__(&self) -> usize {
        self.residuals.len()
    }

    /// Converts all parameters, in the order of `names`, from the solver's scale to SI units.
    fn values(&self, x: Vec<f64>) -> Vec<f64> {
        self.residuals.values(&x).into_iter().map(|(_, value)| value).collect()
    }

    /// Converts all parameters, in the order of `names`, from SI units to the solver's scale.
    fn scaled(&self, values: Vec<f64>) -> Vec<f64> {
        let pairs = self.residuals.unknowns().iter().zip(values);
        pairs.map(|(unknown, value)| unknown.to_scale(value)).collect()
    }

    /// The residuals at the parameters `x` on the solver's scale, in units of their noise.
    fn fun<'py>(&self, py: Python<'py>, x: Vec<f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let found = py.detach(|| self.residuals.residuals(&x));
        Ok(found.map_err(|error| raised(py, error))?.into_pyarray(py))
    }

    /// The derivatives of the residuals at `x` by the parameters on the solver's scale: a matrix, residuals by
    /// parameters.
    fn jac<'py>(&self, py: Python<'py>, x: Vec<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows =
            py.detach(|| self.residuals.jacobian_at(&x)).map_err(|error| raised(py, error))?;
        Ok(PyArray2::from_vec2(py, &rows)?)
    }

    /// The second derivatives, at `x`, of half the sum of the squared residuals by the parameters on the solver's
    /// scale: a matrix, parameters by parameters.
    fn hess<'py>(&self, py: Python<'py>, x: Vec<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows =
            py.detach(|| self.residuals.hessian_at(&x)).map_err(|error| raised(py, error))?;
        Ok(PyArray2::from_vec2(py, &rows)?)
    }
}

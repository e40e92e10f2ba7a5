//! Fits, what comes of them, and their residuals for other solvers.

use crate::error::{raised, refused};
use crate::json::{json, said};
use crate::scene::{Scene, toml_of};
use crate::work::{News, interruptible};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rodfit::fit::{Experiment, FitFile, FitReport, PlotData, Sample, with_current_names};
use rodfit::{Observation, Parameter, Unknown};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// An identification in the making.
#[pyclass(frozen, module = "rodfit._rodfit")]
pub struct Fit {
    fit: Mutex<rodfit::Fit>,
}

impl Fit {
    fn of(fit: rodfit::Fit) -> Self {
        Self { fit: Mutex::new(fit) }
    }

    fn lock(&self) -> MutexGuard<'_, rodfit::Fit> {
        self.fit.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Fit {
    /// A fit of experiments: names with their scenes.
    #[new]
    fn new(experiments: Vec<(String, Py<Scene>)>) -> Self {
        let of = |(name, scene): &(String, Py<Scene>)| {
            Experiment::new(name.as_str(), &scene.get().problem)
        };
        Self::of(rodfit::Fit::of(experiments.iter().map(of)))
    }

    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let file = FitFile::load(path)
            .and_then(FitFile::of_parameters)
            .map_err(|error| raised(py, error))?;
        Ok(Self::of(file.fit()))
    }

    #[staticmethod]
    fn from_toml(py: Python<'_>, text: &str, folder: PathBuf) -> PyResult<Self> {
        let file = FitFile::from_toml(text, folder)
            .and_then(FitFile::of_parameters)
            .map_err(|error| raised(py, error))?;
        Ok(Self::of(file.fit()))
    }

    /// The fit as it is now.
    fn snapshot(&self) -> Self {
        Self::of(self.lock().clone())
    }

    /// Adds an experiment, which what is observed from now on is of.
    fn experiment(&self, name: &str, scene: Py<Scene>) {
        let mut fit = self.lock();
        *fit = fit.clone().experiment(Experiment::new(name, &scene.get().problem));
    }

    /// Adds what was seen of a point in the last experiment: times, s, and places, m, NaN where it was not seen; with no
    /// standard deviation, one, or one a time.
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
        if rows != t.len() || !(1..=3).contains(&axes) {
            let n = t.len();
            let words = format!(
                "xyz: found {rows} by {axes}, allowed: {n} by 1 to 3, a row for every time"
            );
            return Err(refused(py, words));
        }
        if ![0, 1, rows].contains(&sigma.len()) {
            let words = format!(
                "sigma: found {} values, allowed: one, or {rows}, one for every time",
                sigma.len()
            );
            return Err(refused(py, words));
        }
        let samples = t.iter().zip(xyz.rows()).map(|(time, row)| Sample {
            time: *time,
            position: std::array::from_fn(|c| row.get(c).copied().filter(|x| !x.is_nan())),
        });
        let of = |k: usize| sigma.get(k).or(sigma.first()).copied();
        let seen = samples.enumerate().filter(|(_, s)| s.position.iter().any(Option::is_some));
        let (sigmas, seen): (Vec<Option<f64>>, Vec<Sample>) = seen.map(|(k, s)| (of(k), s)).unzip();
        let sigmas: Vec<f64> = sigmas.into_iter().flatten().collect();
        let mut observation = Observation::new(seen)
            .sigmas(&sigmas)
            .at(said(py, "at", point)?)
            .loss(said(py, "loss", loss)?);
        let mut fit = self.lock();
        observation.header.held_out = held_out;
        *fit = fit.clone().observe(observation);
        Ok(())
    }

    /// Adds what the JSON of tables of a fit file says.
    fn add(&self, py: Python<'_>, tables: &str, folder: PathBuf) -> PyResult<()> {
        let text = toml_of(py, tables)?;
        let mut fit = self.lock();
        *fit = fit.add_toml(&text, folder).map_err(|error| raised(py, error))?;
        Ok(())
    }

    /// Finds the parameters. `told` is called with stage and simulations so far; Ctrl-C ends it with the best so far.
    fn solve(
        &self,
        py: Python<'_>,
        plots: bool,
        told: Option<Bound<'_, PyAny>>,
    ) -> PyResult<FitResult> {
        let fit = self.lock().clone();
        let tells = told.is_some();
        let report = interruptible(py, told.as_ref(), move |hooks| {
            let mut fit = fit.stop_when(hooks.stop);
            if plots {
                fit = fit.keep_plot_data();
            }
            if tells {
                let news = Mutex::new(hooks.news);
                fit = fit.on_progress(move |stage, simulations| {
                    let news = news.lock().unwrap_or_else(PoisonError::into_inner);
                    // Who does not listen any more need not be told.
                    let _ = news.send(News::Progress(stage.into(), simulations));
                });
            }
            fit.solve()
        })?;
        Ok(FitResult { report })
    }

    fn residuals(&self, py: Python<'_>) -> PyResult<Residuals> {
        let residuals = self.lock().residuals().map_err(|error| raised(py, error))?;
        Ok(Residuals { residuals })
    }
}

/// What came of a fit.
#[pyclass(frozen, module = "rodfit._rodfit")]
pub struct FitResult {
    report: FitReport,
}

#[pymethods]
impl FitResult {
    /// Reads the JSON of `json(True)`, with former keys too.
    #[new]
    fn new(py: Python<'_>, text: &str) -> PyResult<Self> {
        let mut value: serde_json::Value = said(py, "result", text)?;
        with_current_names(&mut value);
        let report = serde_json::from_value(value)
            .map_err(|error| refused(py, format!("result: found {text}: {error}")))?;
        Ok(Self { report })
    }

    /// The report of the command, with or without what plots are drawn from.
    fn json(&self, py: Python<'_>, plots: bool) -> PyResult<String> {
        match plots || self.report.plot_data.is_none() {
            true => json(py, &self.report),
            false => {
                let mut report = self.report.clone();
                report.plot_data = None;
                json(py, &report)
            }
        }
    }

    /// What plots are drawn from, in JSON, if it was kept.
    fn plots(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let plots: Option<&PlotData> = self.report.plot_data.as_ref();
        plots.map(|plots| json(py, plots)).transpose()
    }

    /// What the command prints.
    fn words(&self) -> String {
        self.report.to_string()
    }

    /// The page of `rodfit fit --report`.
    fn page(&self, title: &str) -> String {
        rodfit::page::fit_page(&self.report, title)
    }

    /// Whether the command would end with 0.
    #[getter]
    fn success(&self) -> bool {
        self.report.is_success()
    }

    /// The values that were found, by name.
    #[getter]
    fn values(&self) -> Vec<(String, f64)> {
        let name = |(parameter, value): (Parameter, f64)| (parameter.name().to_string(), value);
        self.report.parameters().into_iter().map(name).collect()
    }
}

/// Residuals in units of their noise, over the logarithms of positive parameters and the values of others.
#[pyclass(frozen, module = "rodfit._rodfit")]
pub struct Residuals {
    residuals: rodfit::fit::Residuals,
}

impl Residuals {
    fn start_of(unknown: &Unknown) -> Option<f64> {
        unknown.start.or(unknown.prior.map(|prior| prior.mean)).map(|start| unknown.to_scale(start))
    }
}

#[pymethods]
impl Residuals {
    #[getter]
    fn names(&self) -> Vec<String> {
        self.residuals.unknowns().iter().map(ToString::to_string).collect()
    }

    /// Where the parameters start, on the solver's scale; none where no start was given.
    #[getter]
    fn x0(&self) -> Vec<Option<f64>> {
        self.residuals.unknowns().iter().map(Self::start_of).collect()
    }

    #[getter]
    fn bounds(&self) -> Vec<[f64; 2]> {
        self.residuals.unknowns().iter().map(Unknown::scaled_bounds).collect()
    }

    fn __len__(&self) -> usize {
        self.residuals.len()
    }

    /// From the solver's scale to SI units.
    fn values(&self, x: Vec<f64>) -> Vec<f64> {
        self.residuals.values(&x).into_iter().map(|(_, value)| value).collect()
    }

    /// From SI units to the solver's scale.
    fn scaled(&self, values: Vec<f64>) -> Vec<f64> {
        let pairs = self.residuals.unknowns().iter().zip(values);
        pairs.map(|(unknown, value)| unknown.to_scale(value)).collect()
    }

    fn fun<'py>(&self, py: Python<'py>, x: Vec<f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let found = py.detach(|| self.residuals.residuals(&x));
        Ok(found.map_err(|error| raised(py, error))?.into_pyarray(py))
    }

    fn jac<'py>(&self, py: Python<'py>, x: Vec<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows =
            py.detach(|| self.residuals.jacobian_at(&x)).map_err(|error| raised(py, error))?;
        Ok(PyArray2::from_vec2(py, &rows)?)
    }

    /// The Hessian of half the sum of squares.
    fn hess<'py>(&self, py: Python<'py>, x: Vec<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows =
            py.detach(|| self.residuals.hessian_at(&x)).map_err(|error| raised(py, error))?;
        Ok(PyArray2::from_vec2(py, &rows)?)
    }
}

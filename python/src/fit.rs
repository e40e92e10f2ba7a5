//! Fits, and their residuals for other solvers.

use crate::error::raised;
use crate::run::interruptible;
use crate::scene::Scene;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use rodfit::fit::{Experiment, FitFile, Sample};
use rodfit::{Observation, Parameter, Unknown};
use std::sync::Mutex;

/// An identification in the making.
#[pyclass(frozen, module = "rodfit._rodfit")]
pub struct Fit {
    fit: Mutex<rodfit::Fit>,
}

/// What a JSON text says, as files do; `key` is what it is called.
fn said<T: serde::de::DeserializeOwned>(key: &str, text: &str) -> PyResult<T> {
    serde_json::from_str(text)
        .map_err(|error| crate::error::InputError::new_err(format!("{key}: found {text}: {error}")))
}

impl Fit {
    fn lock(&self) -> std::sync::MutexGuard<'_, rodfit::Fit> {
        self.fit.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn change(&self, how: impl FnOnce(rodfit::Fit) -> rodfit::Fit) {
        let mut fit = self.lock();
        *fit = how(fit.clone());
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
        Self { fit: Mutex::new(rodfit::Fit::of(experiments.iter().map(of))) }
    }

    #[staticmethod]
    fn load(py: Python<'_>, path: std::path::PathBuf) -> PyResult<Self> {
        let file = FitFile::load(path).map_err(|error| raised(py, error))?;
        Ok(Self { fit: Mutex::new(file.fit()) })
    }

    #[staticmethod]
    fn from_toml(py: Python<'_>, text: &str, folder: std::path::PathBuf) -> PyResult<Self> {
        let file = FitFile::from_toml(text, folder).map_err(|error| raised(py, error))?;
        Ok(Self { fit: Mutex::new(file.fit()) })
    }

    /// Adds what was seen of a point in the last experiment: times, s, and places, m, NaN where it was not seen.
    fn observe(
        &self,
        t: PyReadonlyArray1<'_, f64>,
        xyz: PyReadonlyArray2<'_, f64>,
        point: &str,
        sigma: Option<f64>,
        loss: &str,
    ) -> PyResult<()> {
        let (t, xyz) = (t.as_array(), xyz.as_array());
        let [rows, axes] = [xyz.nrows(), xyz.ncols()];
        if rows != t.len() || !(1..=3).contains(&axes) {
            let n = t.len();
            let words = format!(
                "xyz: found {rows} by {axes}, allowed: {n} by 1 to 3, a row for every time"
            );
            return Err(crate::error::InputError::new_err(words));
        }
        let samples = t.iter().zip(xyz.rows()).map(|(time, row)| Sample {
            time: *time,
            position: std::array::from_fn(|c| row.get(c).copied().filter(|x| !x.is_nan())),
        });
        let seen = samples.filter(|sample| sample.position.iter().any(Option::is_some)).collect();
        let mut observation =
            Observation::new(seen).at(said("point", point)?).loss(said("loss", loss)?);
        if let Some(sigma) = sigma {
            observation = observation.sigma(sigma);
        }
        self.change(|fit| fit.observe(observation));
        Ok(())
    }

    /// Adds a parameter to identify.
    fn add(
        &self,
        py: Python<'_>,
        name: &str,
        start: Option<f64>,
        bounds: Option<(f64, f64)>,
        prior: Option<(f64, f64)>,
    ) -> PyResult<()> {
        let parameter: Parameter = name.parse().map_err(|error| raised(py, error))?;
        let mut unknown = Unknown::new(parameter);
        if let Some(start) = start {
            unknown = unknown.start(start);
        }
        if let Some((low, high)) = bounds {
            unknown = unknown.bounds(low, high);
        }
        if let Some((mean, sigma)) = prior {
            unknown = unknown.prior(mean, sigma);
        }
        self.change(|fit| fit.identify(unknown));
        Ok(())
    }

    /// Says what to do beyond finding the parameters: the JSON of the fit file's `[analysis]`.
    fn analyse(&self, text: &str) -> PyResult<()> {
        let analysis = said("analysis", text)?;
        self.change(|fit| fit.analyse(analysis));
        Ok(())
    }

    /// Finds the parameters; the JSON of the report, and the text of the terminal. Ctrl-C ends it with the best so far.
    fn solve(&self, py: Python<'_>) -> PyResult<(String, String)> {
        let fit = self.lock().clone();
        let report = interruptible(py, move |stop| fit.stop_when(stop).solve())?;
        let json = serde_json::to_string(&report)
            .map_err(|error| crate::error::ComputationError::new_err(error.to_string()))?;
        Ok((json, report.to_string()))
    }

    fn residuals(&self, py: Python<'_>) -> PyResult<Residuals> {
        let residuals = self.lock().residuals().map_err(|error| raised(py, error))?;
        Ok(Residuals { residuals })
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
        self.residuals
            .unknowns()
            .iter()
            .map(|unknown| unknown.parameter.name().to_string())
            .collect()
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

    /// From the solver's scale to SI units.
    fn values(&self, x: Vec<f64>) -> Vec<f64> {
        self.residuals.values(&x).into_iter().map(|(_, value)| value).collect()
    }

    /// From SI units to the solver's scale.
    fn scaled(&self, values: Vec<f64>) -> Vec<f64> {
        self.residuals
            .unknowns()
            .iter()
            .zip(values)
            .map(|(unknown, value)| unknown.to_scale(value))
            .collect()
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

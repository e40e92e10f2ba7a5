//! Scenes and what is computed of them.

use crate::error::{raised, refused};
use crate::json::json;
use crate::run::Run;
use crate::work::{Hooks, interruptible};
use pyo3::prelude::*;
use rodfit::accuracy::{RunCheck, simulate_checked};
use rodfit::problem::ParameterList;
use rodfit::vibration::LinearizationPoint;
use rodfit::{Parameter, Problem, Trajectory};

/// A scene, read and validated.
#[pyclass(frozen, module = "rodfit._rodfit")]
pub struct Scene {
    pub problem: Problem,
    /// The check of a run by numerics that the program chose.
    check: Option<RunCheck>,
}

impl Scene {
    pub fn of(py: Python<'_>, scene: rodfit::Scene) -> PyResult<Self> {
        let (problem, check) = scene.checked_problem().map_err(|error| raised(py, error))?;
        Ok(Self { problem, check })
    }
}

/// A table in TOML, of its JSON.
pub fn toml_of(py: Python<'_>, json: &str) -> PyResult<String> {
    let table: toml::Table = serde_json::from_str(json).map_err(|error| refused(py, error))?;
    toml::to_string(&table).map_err(|error| refused(py, error))
}

/// Parameters by name.
pub fn parameters(py: Python<'_>, names: &[String]) -> PyResult<Vec<Parameter>> {
    names.iter().map(|name| name.parse().map_err(|error| raised(py, error))).collect()
}

#[pymethods]
impl Scene {
    #[staticmethod]
    fn load(py: Python<'_>, path: std::path::PathBuf) -> PyResult<Self> {
        let scene = rodfit::Scene::load(path).map_err(|error| raised(py, error))?;
        Self::of(py, scene)
    }

    #[staticmethod]
    fn from_toml(py: Python<'_>, text: &str, folder: std::path::PathBuf) -> PyResult<Self> {
        let scene = rodfit::Scene::from_toml(text, folder).map_err(|error| raised(py, error))?;
        Self::of(py, scene)
    }

    /// A scene of the JSON of a table.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str, folder: std::path::PathBuf) -> PyResult<Self> {
        Self::from_toml(py, &toml_of(py, text)?, folder)
    }

    /// As a file; what the program chose is left out again.
    fn to_toml(&self, py: Python<'_>) -> PyResult<String> {
        self.problem.scene().reopened().to_toml().map_err(|error| raised(py, error))
    }

    /// All physical numbers, as JSON: name, aliases, value, unit, limits, note.
    fn parameters(&self, py: Python<'_>) -> PyResult<String> {
        json(py, &ParameterList::of(&self.problem))
    }

    /// The scene with other values of its numbers, and the mesh, step and scheme for them where these are left to the program.
    fn with_values(&self, py: Python<'_>, values: Vec<(String, f64)>) -> PyResult<Self> {
        let (names, values): (Vec<String>, Vec<f64>) = values.into_iter().unzip();
        let pairs = parameters(py, &names)?.into_iter().zip(values);
        let problem = self.problem.with(pairs).map_err(|error| raised(py, error))?;
        match problem.resolution() {
            Some(_) => Self::of(py, problem.scene().reopened()),
            None => Ok(Self { problem, check: None }),
        }
    }

    fn warnings(&self) -> Vec<String> {
        self.problem.warnings()
    }

    /// `planar` or `spatial`.
    #[getter]
    fn model(&self) -> &'static str {
        self.problem.model().0
    }

    #[getter]
    fn nodes(&self) -> usize {
        self.problem.nodes()
    }

    #[getter]
    fn length(&self) -> f64 {
        self.problem.length()
    }

    /// Mesh, step and scheme, who chose them and what error is left, as JSON; none where the scene gives them all.
    fn resolution(&self, py: Python<'_>) -> PyResult<Option<String>> {
        self.problem.resolution().map(|resolution| json(py, resolution)).transpose()
    }

    /// Simulates the scene; Ctrl-C ends it. Chosen numerics are checked, and the run is repeated with finer ones where needed.
    fn simulate(&self, py: Python<'_>, derivatives: Vec<String>) -> PyResult<Run> {
        let by = parameters(py, &derivatives)?;
        let (problem, check) = (self.problem.clone(), self.check.clone());
        let run = move |hooks: Hooks| {
            simulate_checked(problem, check, |problem| {
                let problem = problem.stop_when(hooks.stop.clone());
                let nodes: Vec<usize> = (0..problem.nodes()).collect();
                let trajectory = Trajectory::new(&problem, &nodes, &by)?.keep_energies();
                Ok((problem, trajectory))
            })
        };
        let (problem, trajectory) = interruptible(py, None, run)?;
        Ok(Run::new(problem, trajectory, derivatives))
    }

    /// The equilibrium, as JSON.
    fn equilibrium(&self, py: Python<'_>) -> PyResult<String> {
        let found = py.detach(|| self.problem.equilibrium());
        json(py, &found.map_err(|error| raised(py, error))?)
    }

    /// The lowest modes, as JSON.
    fn modes(&self, py: Python<'_>, count: usize) -> PyResult<String> {
        let found = py.detach(|| self.problem.modes(count, LinearizationPoint::Equilibrium));
        json(py, &found.map_err(|error| raised(py, error))?)
    }
}

//! Scenes in Python: read from TOML or JSON, their parameters, simulations, equilibria and modes.
//!
//! A scene without its own mesh, step or scheme gets chosen ones, whose error each simulation checks.

use crate::error::raised;
use crate::json::{json_to_toml, raised_in_table, to_json};
use crate::run::PyRun;
use crate::work::{WorkHooks, interruptible};
use pyo3::prelude::*;
use rodfit::accuracy::{RunCheck, simulate_checked};
use rodfit::problem::ParameterList;
use rodfit::vibration::LinearizationPoint;
use rodfit::{Error, Parameter, Problem, Trajectory};

/// A scene, read and validated.
#[pyclass(frozen, name = "Scene", module = "rodfit._rodfit")]
pub struct PyScene {
    pub problem: Problem,
    /// The check of runs with chosen mesh and step; `None` if the scene gives them, and for other reasons of
    /// `Scene::checked_problem`.
    check: Option<RunCheck>,
}

impl PyScene {
    /// The Python object of a scene, whose mesh, step and scheme are chosen where it leaves them out.
    pub fn of(py: Python<'_>, scene: rodfit::Scene) -> PyResult<Self> {
        let (problem, check) = scene.checked_problem().map_err(|error| raised(py, error))?;
        Ok(Self { problem, check })
    }

    /// The Python object of a problem with given mesh and step.
    pub fn of_problem(problem: Problem) -> Self {
        Self { problem, check: None }
    }
}

/// The parameters with these names, in the same order; an error for an unknown name.
pub fn parameters(py: Python<'_>, names: &[String]) -> PyResult<Vec<Parameter>> {
    names.iter().map(|name| name.parse().map_err(|error| raised(py, error))).collect()
}

#[pymethods]
impl PyScene {
    /// The scene of a file (TOML).
    #[staticmethod]
    fn load(py: Python<'_>, path: std::path::PathBuf) -> PyResult<Self> {
        let scene = rodfit::Scene::load(path).map_err(|error| raised(py, error))?;
        Self::of(py, scene)
    }

    /// The scene of a TOML text, whose paths are relative to `folder`.
    #[staticmethod]
    fn from_toml(py: Python<'_>, text: &str, folder: std::path::PathBuf) -> PyResult<Self> {
        let scene = rodfit::Scene::from_toml(text, folder).map_err(|error| raised(py, error))?;
        Self::of(py, scene)
    }

    /// The scene of a table in JSON, with paths relative to `folder`.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str, folder: std::path::PathBuf) -> PyResult<Self> {
        let text = json_to_toml(py, text)?;
        let scene = rodfit::Scene::from_toml(&text, folder);
        Self::of(py, scene.map_err(|error| raised_in_table(py, &text, error))?)
    }

    /// The scene as TOML, without chosen mesh, step and scheme.
    fn to_toml(&self, py: Python<'_>) -> PyResult<String> {
        self.problem.scene().reopened().to_toml().map_err(|error| raised(py, error))
    }

    /// All parameters as JSON: name, aliases, value, unit, limits, note.
    fn parameters(&self, py: Python<'_>) -> PyResult<String> {
        to_json(py, &ParameterList::of(&self.problem))
    }

    /// The scene with other `values`, in SI units, of the parameters with these `names`. Mesh, step and scheme are
    /// chosen again unless the scene gives them.
    fn with_values(&self, py: Python<'_>, names: Vec<String>, values: Vec<f64>) -> PyResult<Self> {
        let pairs = parameters(py, &names)?.into_iter().zip(values);
        let problem = self.problem.with(pairs).map_err(|error| raised(py, error))?;
        match problem.resolution() {
            Some(_) => Self::of(py, problem.scene().reopened()),
            None => Ok(Self { problem, check: None }),
        }
    }

    /// Warnings of the scene, with their codes.
    fn warnings(&self) -> Vec<String> {
        self.problem.warnings()
    }

    /// The model of the rod, `planar` or `spatial`.
    #[getter]
    fn model(&self) -> &'static str {
        self.problem.model().0
    }

    /// Number of nodes.
    #[getter]
    fn nodes(&self) -> usize {
        self.problem.nodes()
    }

    /// Length of the rod, m.
    #[getter]
    fn length(&self) -> f64 {
        self.problem.length()
    }

    /// Chosen mesh, step and scheme with their estimated error, as JSON; `None` if the scene gives all of them.
    fn resolution(&self, py: Python<'_>) -> PyResult<Option<String>> {
        self.problem.resolution().map(|resolution| to_json(py, resolution)).transpose()
    }

    /// Simulates the scene and returns the motion of all nodes with energies, and its `derivatives` by the parameters
    /// with these names. A run with chosen mesh and step is checked, and repeated with finer ones if needed. Ctrl-C
    /// stops the run.
    fn simulate(&self, py: Python<'_>, derivatives: Vec<String>) -> PyResult<PyRun> {
        let by = parameters(py, &derivatives)?;
        let (problem, check) = (self.problem.clone(), self.check.clone());
        let run = move |hooks: WorkHooks| {
            simulate_checked(problem, check, |problem| {
                let problem = problem.stop_when(hooks.stop.clone());
                let nodes: Vec<usize> = (0..problem.nodes()).collect();
                let trajectory = Trajectory::new(&problem, &nodes, &by)?.keep_energies();
                Ok((problem, trajectory))
            })
        };
        let (problem, trajectory) = interruptible(py, None, run)?;
        Ok(PyRun::new(problem, trajectory, derivatives))
    }

    /// The equilibrium of the rod under its loads, with its stability, as JSON; an error if none is found.
    fn equilibrium(&self, py: Python<'_>) -> PyResult<String> {
        let find = || {
            let mut found = self.problem.equilibrium()?;
            self.problem.add_mesh_error(&mut found);
            Ok(found)
        };
        to_json(py, &py.detach(find).map_err(|error: Error| raised(py, error))?)
    }

    /// The rod as the text of a file for another program (`mujoco`, `pyelastica`, `usd` or `csv`), and notes on what it
    /// does not have.
    fn export(&self, py: Python<'_>, to: &str) -> PyResult<(String, Vec<String>)> {
        let export = to.parse().and_then(|format| self.problem.export(format));
        let export = export.map_err(|error| raised(py, error))?;
        Ok((export.text, export.notes))
    }

    /// The `count` lowest modes of vibration about the equilibrium, as JSON.
    fn modes(&self, py: Python<'_>, count: usize) -> PyResult<String> {
        let find = || {
            let mut found = self.problem.modes(count, LinearizationPoint::Equilibrium)?;
            self.problem.add_mesh_errors(count, &mut found);
            Ok(found)
        };
        to_json(py, &py.detach(find).map_err(|error: Error| raised(py, error))?)
    }
}

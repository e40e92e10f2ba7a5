//! A simulated motion as numpy arrays in SI units, at the start and after every step of the scene. They are times,
//! positions and velocities of all nodes, their derivatives by parameters, and energies. Points of the rod are
//! interpolated from the nodes with the weights that `stencil` returns.

use crate::error::raised;
use crate::json::{from_json, to_json};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray4, PyArrayMethods};
use pyo3::prelude::*;
use rodfit::rod::Energies;
use rodfit::{Point, Problem, Trajectory};

/// A simulated motion.
#[pyclass(frozen, name = "Run", module = "rodfit._rodfit")]
pub struct PyRun {
    problem: Problem,
    /// Times, s.
    #[pyo3(get)]
    t: Py<PyArray1<f64>>,
    /// Positions and velocities: (times, nodes, 2, 3), m and m/s.
    #[pyo3(get)]
    motion: Py<PyArray4<f64>>,
    /// Derivatives of `motion` by every parameter, in SI units; each has the shape of `motion`.
    #[pyo3(get)]
    derivatives: Vec<Py<PyArray4<f64>>>,
    /// Names of the parameters, in the order of `derivatives`.
    #[pyo3(get)]
    names: Vec<String>,
    /// Kinetic energy, energies of stretching, bending and twisting, and potential of the loads: (times, 5), J.
    #[pyo3(get)]
    energies: Py<PyArray2<f64>>,
}

impl PyRun {
    /// The Python object of a trajectory with energies. `names` are those of the parameters of its derivatives.
    pub fn new(problem: Problem, trajectory: Trajectory, names: Vec<String>) -> Self {
        Python::attach(|py| {
            let terms = |e: &Energies| [e.kinetic, e.stretch, e.bend, e.twist, e.potential + e.own];
            let energies: Vec<[f64; 5]> = trajectory.energies().iter().map(terms).collect();
            let (times, motions, derivatives) = trajectory.into_parts();
            let steps = times.len();
            // The list is one block of numbers, which the array takes over without a copy.
            let array = |motions: Vec<[[f64; 3]; 2]>| {
                let nodes = motions.len() / steps.max(1);
                let flat = motions.into_flattened().into_flattened().into_pyarray(py);
                let array = flat.reshape([steps, nodes, 2, 3]);
                array.map(|array| array.unbind())
            };
            let shaped = "as many numbers as the shape contains";
            let energies = energies.into_flattened().into_pyarray(py).reshape([steps, 5]);
            Self {
                problem,
                energies: energies.expect(shaped).unbind(),
                t: times.into_pyarray(py).unbind(),
                motion: array(motions).expect(shaped),
                derivatives: derivatives.into_iter().map(|d| array(d).expect(shaped)).collect(),
                names,
            }
        })
    }
}

#[pymethods]
impl PyRun {
    /// Interpolation of a point of the rod (`point` in JSON): indices of nodes and their weights. The sum of weights
    /// times node positions is the position of the point. An error for a point that the rod does not have.
    fn stencil(&self, py: Python<'_>, point: &str) -> PyResult<(Vec<usize>, Vec<f64>)> {
        let point: Point = from_json(py, "point", point)?;
        let stencil = self.problem.stencil(point).map_err(|error| raised(py, error))?;
        Ok(stencil.nodes.into_iter().unzip())
    }

    /// Chosen mesh, step and scheme of this run with their estimated error, as JSON; `None` if the scene gives all of
    /// them.
    fn resolution(&self, py: Python<'_>) -> PyResult<Option<String>> {
        self.problem.resolution().map(|resolution| to_json(py, resolution)).transpose()
    }

    /// Warnings, with their codes, of the scene and of the estimated error of this run.
    fn warnings(&self) -> Vec<String> {
        self.problem.warnings()
    }

    /// Arc lengths of the nodes from the wall, m.
    fn arc_length(&self) -> Vec<f64> {
        self.problem.arc_lengths().to_vec()
    }
}

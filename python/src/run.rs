//! Simulated motion as arrays.

use crate::error::raised;
use crate::json::{json, said};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray4, PyArrayMethods};
use pyo3::prelude::*;
use rodfit::rod::Energies;
use rodfit::{Point, Problem, Trajectory};

/// A simulated motion.
#[pyclass(frozen, module = "rodfit._rodfit")]
pub struct Run {
    problem: Problem,
    /// Times, s.
    #[pyo3(get)]
    t: Py<PyArray1<f64>>,
    /// Places and velocities: (times, nodes, 2, 3), m and m/s.
    #[pyo3(get)]
    motion: Py<PyArray4<f64>>,
    /// Their derivatives by every parameter.
    #[pyo3(get)]
    derivatives: Vec<Py<PyArray4<f64>>>,
    #[pyo3(get)]
    names: Vec<String>,
    /// Energies of motion, stretching, bending, twisting, and the potential of the loads: (times, 5), J.
    #[pyo3(get)]
    energies: Py<PyArray2<f64>>,
}

impl Run {
    /// Of a run that kept its energies.
    pub fn new(problem: Problem, trajectory: Trajectory, names: Vec<String>) -> Self {
        Python::attach(|py| {
            let terms = |e: &Energies| [e.kinetic, e.stretch, e.bend, e.twist, e.potential + e.own];
            let energies: Vec<[f64; 5]> = trajectory.energies().iter().map(terms).collect();
            let (times, motions, derivatives) = trajectory.into_parts();
            let steps = times.len();
            // The list of places and velocities is one block of numbers, which the array takes over.
            let array = |motions: Vec<[[f64; 3]; 2]>| {
                let nodes = motions.len() / steps.max(1);
                let flat = motions.into_flattened().into_flattened().into_pyarray(py);
                let array = flat.reshape([steps, nodes, 2, 3]);
                array.map(|array| array.unbind())
            };
            let shaped = "as many numbers as the shape has";
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
impl Run {
    /// Nodes and weights whose sum is a point of the rod, given in JSON.
    fn stencil(&self, py: Python<'_>, point: &str) -> PyResult<(Vec<usize>, Vec<f64>)> {
        let point: Point = said(py, "point", point)?;
        let stencil = self.problem.stencil(point).map_err(|error| raised(py, error))?;
        Ok(stencil.nodes.into_iter().unzip())
    }

    /// Mesh, step and scheme of this run, as JSON; none where the scene gives them all.
    fn resolution(&self, py: Python<'_>) -> PyResult<Option<String>> {
        self.problem.resolution().map(|resolution| json(py, resolution)).transpose()
    }

    /// Warnings of the scene and of the estimated error of this run.
    fn warnings(&self) -> Vec<String> {
        self.problem.warnings()
    }

    /// Arc lengths of the nodes from the wall, m.
    fn arc_length(&self) -> Vec<f64> {
        self.problem.arc_lengths().to_vec()
    }
}

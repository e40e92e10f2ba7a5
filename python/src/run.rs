//! Simulated motion as arrays.

use numpy::{IntoPyArray, PyArray1, PyArray4, PyArrayMethods};
use pyo3::prelude::*;
use rodfit::Trajectory;

/// A simulated motion.
#[pyclass(frozen, module = "rodfit._rodfit")]
pub struct Run {
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
}

impl Run {
    pub fn new(trajectory: Trajectory, names: Vec<String>) -> Self {
        Python::attach(|py| {
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
            Self {
                t: times.into_pyarray(py).unbind(),
                motion: array(motions).expect(shaped),
                derivatives: derivatives.into_iter().map(|d| array(d).expect(shaped)).collect(),
                names,
            }
        })
    }
}

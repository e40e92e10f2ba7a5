//! Simulated motion as arrays, and long work that Ctrl-C ends.

use crate::error::raised;
use numpy::{IntoPyArray, PyArray1, PyArray4, PyArrayMethods};
use pyo3::prelude::*;
use rodfit::{Error, Trajectory};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

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

/// Does long work in a thread of its own, without the interpreter's lock; Ctrl-C sets the flag that it is given, and what it
/// then returns is raised.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(Arc<AtomicBool>) -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    let thread = std::thread::spawn(move || work(flag));
    let mut interrupted = None;
    while !thread.is_finished() {
        py.detach(|| std::thread::sleep(Duration::from_millis(1)));
        if interrupted.is_none()
            && let Err(error) = py.check_signals()
        {
            stop.store(true, Ordering::Relaxed);
            interrupted = Some(error);
        }
    }
    let result =
        thread.join().map_err(|_| crate::error::ComputationError::new_err("a thread panicked"))?;
    match (result, interrupted) {
        (Ok(value), _) => Ok(value),
        (Err(_), Some(error)) => Err(error),
        (Err(error), None) => Err(raised(py, error)),
    }
}

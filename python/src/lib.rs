//! The native part of the Python package: classes for scenes, runs, fits and campaigns, and the command as a function.
//! The arrays of a run pass to numpy without a copy.
//!
//! The public interface is in Python (`rodfit/`); `rodfit/_rodfit.pyi` lists the names of this part.

mod campaign;
mod error;
mod fit;
mod json;
mod run;
mod scene;
mod structure;
mod work;

use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs a command line, whose first argument is the name of the program, and returns the exit code.
#[pyfunction]
fn command(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| rodfit::command::run(words))
}

/// The smallest and the largest allowed value of the parameter with a name, in its SI unit; an infinite one is replaced
/// by the largest finite number of this sign. An `InputError` for an unknown name.
#[pyfunction]
fn limits(py: Python<'_>, name: &str) -> PyResult<[f64; 2]> {
    let parameter: rodfit::Parameter = name.parse().map_err(|error| error::raised(py, error))?;
    Ok(parameter.limits().map(|end| end.clamp(-f64::MAX, f64::MAX)))
}

/// Pairs of the former and the current name of the keys of results that were renamed.
#[pyfunction]
fn renamed_keys() -> Vec<(&'static str, &'static str)> {
    rodfit::fit::RENAMED_KEYS.iter().map(|key| (key.former, key.current)).collect()
}

/// The module with all functions and classes.
#[pymodule]
fn _rodfit(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(command, module)?)?;
    module.add_function(wrap_pyfunction!(limits, module)?)?;
    module.add_function(wrap_pyfunction!(renamed_keys, module)?)?;
    module.add_class::<campaign::PyCampaign>()?;
    module.add_class::<scene::PyScene>()?;
    module.add_class::<run::PyRun>()?;
    module.add_class::<structure::PyStructure>()?;
    module.add_class::<structure::PyStructureRun>()?;
    module.add_class::<fit::PyFit>()?;
    module.add_class::<fit::FitResult>()?;
    module.add_class::<fit::PyReport>()?;
    module.add_class::<fit::PyResiduals>()?;
    Ok(())
}

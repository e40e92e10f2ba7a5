//! The Python package's native part: scenes, runs and fits, with arrays that are handed over and not copied, and the
//! command.
//!
//! Everything that a person writes in Python stands in the package's own files beside this one; this part is as thin as it can be,
//! and `rodfit/_rodfit.pyi` says what is in it.

mod campaign;
mod error;
mod fit;
mod json;
mod run;
mod scene;
mod work;

use pyo3::prelude::*;
use std::ffi::OsString;

/// Does what a command line says, whose first word is the program's name; the exit code.
#[pyfunction]
fn command(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| rodfit::command::run(words))
}

/// The least and the largest value that a parameter may have.
#[pyfunction]
fn limits(py: Python<'_>, name: &str) -> PyResult<[f64; 2]> {
    let parameter: rodfit::Parameter = name.parse().map_err(|error| error::raised(py, error))?;
    Ok(parameter.limits().map(|end| end.clamp(-f64::MAX, f64::MAX)))
}

/// Former and current keys of results.
#[pyfunction]
fn renamed_keys() -> Vec<(&'static str, &'static str)> {
    rodfit::fit::RENAMED_KEYS.iter().map(|key| (key.former, key.current)).collect()
}

#[pymodule]
fn _rodfit(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(command, module)?)?;
    module.add_function(wrap_pyfunction!(limits, module)?)?;
    module.add_function(wrap_pyfunction!(renamed_keys, module)?)?;
    module.add_class::<campaign::Campaign>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<run::Run>()?;
    module.add_class::<fit::Fit>()?;
    module.add_class::<fit::FitResult>()?;
    module.add_class::<fit::Residuals>()?;
    Ok(())
}

//! The Python package's native part: scenes, runs and fits, with arrays that are handed over and not copied.
//!
//! Everything that a person writes in Python stands in the package's own files beside this one; this part is as thin as it can be.

mod error;
mod fit;
mod run;
mod scene;

use pyo3::prelude::*;

#[pymodule]
fn _rodfit(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("RodfitError", module.py().get_type::<error::RodfitError>())?;
    module.add("InputError", module.py().get_type::<error::InputError>())?;
    module.add("ComputationError", module.py().get_type::<error::ComputationError>())?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<run::Run>()?;
    module.add_class::<fit::Fit>()?;
    module.add_class::<fit::Residuals>()?;
    Ok(())
}

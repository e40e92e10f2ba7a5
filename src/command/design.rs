//! `rodfit design`: predicts the uncertainty of the parameters of an experiment before it is made.
//!
//! Input is a fit file, or a plan without data. `--sigma` is the standard deviation, m, of all positions for which
//! the file gives none; other measurements need one in the file. `--known` adds standard uncertainties of inputs in
//! their units. The sensitivities of a simulation give the expected standard errors, and the best marker position,
//! duration and frame rate. Output is JSON and a page, if requested, and a summary; the exit code is 3 if a parameter
//! is not identifiable, else 0, or that of an output that cannot be written. Lists along the rod (`[[field]]`) are
//! rejected.

use crate::command::known::add_known_inputs;
use crate::command::output::Outputs;
use crate::command::{GlobalOptions, JsonOption, limits, terminal};
use rodfit::fit::FitFile;
use rodfit::{Error, page};
use std::path::PathBuf;

/// Options of `rodfit design`.
#[derive(clap::Args)]
pub struct DesignOptions {
    /// Plan or fit file (TOML).
    fit: PathBuf,
    #[command(flatten)]
    json: JsonOption,
    /// Write a page with the expected uncertainties (`design.html`) into this folder.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Standard uncertainty of an input in its unit, as radius=5e-5; repeatable.
    #[arg(long, value_name = "NAME=SIGMA")]
    known: Vec<String>,
    /// Standard deviation, m, of all positions for which the file gives none.
    #[arg(long, value_name = "M")]
    sigma: Option<f64>,
}

/// Reads the plan, computes the design and writes its outputs. Returns exit code 3 if the planned data do not determine
/// all parameters, the code of an output that cannot be written, or 0. Errors: a plan or an output that cannot be used,
/// a cost above a limit, and a simulation that fails.
pub fn run(options: &DesignOptions, global: GlobalOptions) -> Result<u8, Error> {
    let path = &options.fit;
    let admit = |scene: &_| limits::mesh_cost(scene).admit(global);
    // Invalid values of a plan are found late, by code that does not have its path.
    let in_file = |error: Error| match error {
        invalid @ Error::Invalid { .. } => invalid.in_file(Some(path)),
        error => error,
    };
    let mut file = FitFile::load_plan_if(path, admit)?.of_parameters().map_err(in_file)?;
    add_known_inputs(&mut file, &options.known)?;
    if let Some(sigma) = options.sigma {
        set_sigma(&mut file, sigma)?;
    }
    let mut outputs = Outputs::new(&options.json, global);
    outputs.add_page(options.report.as_deref(), "design.html");
    // Data files that exist already are inputs too.
    let mut inputs = file.files();
    inputs.push(path.clone());
    outputs.check(&inputs)?;
    limits::design_cost(&file, path.clone()).admit(global)?;
    let stop = terminal::stop_on_ctrl_c(global);
    let design = file.fit().stop_when(stop).design().map_err(in_file)?;
    let name = path.display().to_string();
    let code = if design.parameters.iter().all(|e| e.identifiable) { 0 } else { 3 };
    let page = || page::design_page(&design, &name);
    Ok(outputs.finish(code, &design, Some(&page), &design.summary().with_subject(&name)))
}

/// Sets the standard deviation of all positions of a fit file that have none to `sigma`, m. Values in other units stay
/// without. An error unless it is finite and positive.
fn set_sigma(file: &mut FitFile, sigma: f64) -> Result<(), Error> {
    if !(sigma.is_finite() && sigma > 0.0) {
        return Err(Error::invalid("--sigma", sigma, "a finite number above 0, m"));
    }
    for measurement in file.experiments.iter_mut().flat_map(|e| &mut e.measurements) {
        // For sensors and gauges its number would be a noise in another unit.
        if measurement.header.unit == "m" {
            measurement.header.sigma.get_or_insert(sigma);
        }
    }
    Ok(())
}

//! `rodfit design`

use crate::command::output::Outputs;
use crate::command::{Json, Manner, conclude, fit, limits, terminal};
use rodfit::fit::FitFile;
use rodfit::{Error, page};
use std::path::PathBuf;

/// What an experiment would tell that is planned: the standard error and 95 % interval that each parameter would
/// have, its budget of uncertainty, what could hide, and how these change with where the marker is, how long is filmed
/// and how fast.
///
/// The fit file says of a recording that is not there yet, in the place of its file, `duration` (s) and `fps`, beside
/// `sigma` and `point`; of a photograph `at = [0.25, 0.5]`, arc lengths in m. Values are those of `start`, or else of the
/// scene. Of files that are there only the times count.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub struct Options {
    /// Plan or fit file (TOML).
    fit: PathBuf,
    #[command(flatten)]
    json: Json,
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

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let path = &options.fit;
    let admit = |scene: &_| limits::of_mesh(scene).admit(manner);
    let in_file = |error| match error {
        Error::Invalid { file: None, key, found, allowed } => {
            Error::Invalid { file: Some(path.clone()), key, found, allowed }
        }
        error => error,
    };
    let mut file = FitFile::load_plan_if(path, admit)?.of_parameters().map_err(in_file)?;
    for known in &options.known {
        file.knowns.push(fit::known(known)?);
    }
    if let Some(sigma) = options.sigma {
        set_sigma(&mut file, sigma)?;
    }
    let mut outputs = Outputs::new(manner);
    let json = outputs.add("--json", options.json.json.as_deref());
    let page = outputs.add_in_folder("--report", options.report.as_deref(), "design.html");
    let mut inputs = file.files();
    inputs.push(path.clone());
    outputs.check(&inputs)?;
    limits::of_design(&file, path.clone()).admit(manner)?;
    let stop = terminal::stop_on_ctrl_c(manner);
    let design = file.fit().stop_when(stop).design().map_err(in_file)?;
    let name = path.display().to_string();
    let code = if design.parameters.iter().all(|e| e.identifiable) { 0 } else { 3 };
    let written = [
        outputs.write_json(json, &design),
        outputs.write(page, || Ok(page::design_page(&design, &name).into_bytes())),
        outputs.summary(&design.summary().of(name.clone())),
    ];
    Ok(conclude(code, written))
}

/// Gives positions a noise that have none.
fn set_sigma(file: &mut FitFile, sigma: f64) -> Result<(), Error> {
    if !(sigma.is_finite() && sigma > 0.0) {
        let (found, allowed) = (sigma.to_string(), "a finite number above 0, m".into());
        return Err(Error::Invalid { file: None, key: "--sigma".into(), found, allowed });
    }
    for measurement in file.experiments.iter_mut().flat_map(|e| &mut e.measurements) {
        measurement.header.sigma.get_or_insert(sigma);
    }
    Ok(())
}

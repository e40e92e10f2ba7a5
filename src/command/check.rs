//! `rodfit check`: verifies the hand-derived derivatives of the elements of the rod and of the user-defined energies of
//! a scene.
//!
//! They are compared with automatic derivatives (dual numbers) and with finite differences ([`check_problem`]), on the
//! mesh of a first guess if the scene leaves it open. States are the initial one of the scene, those of a simulation
//! (if the scene has a `[time]`), and random ones. The result is a report (text, and JSON if requested); the exit code
//! is 3 if any pair differs by more than its tolerance, else 0, or that of an output that cannot be written.

use crate::command::output::Outputs;
use crate::command::{GlobalOptions, JsonOption, limits};
use rodfit::accuracy::Calculation;
use rodfit::check::{Tolerance, check_problem};
use rodfit::{Error, Scene};
use std::path::PathBuf;

/// Options of `rodfit check`.
#[derive(clap::Args)]
pub struct CheckOptions {
    /// Scene file (TOML).
    scene: PathBuf,
    #[command(flatten)]
    json: JsonOption,
}

/// Checks the derivatives of the energies of a scene, on the mesh of a first guess if the scene leaves it open, and
/// writes the report. Returns exit code 0 if all agree, 3 if some disagree. Errors: a scene or an output that cannot be
/// used, and a cost above a limit.
pub fn run(options: &CheckOptions, global: GlobalOptions) -> Result<u8, Error> {
    let scene = Scene::load(&options.scene)?;
    // Outputs are checked before the computation: a mistyped path costs no time.
    let outputs = Outputs::with_json(&options.json, &scene.files(), global)?;
    limits::check_cost(&scene).admit(global)?;
    // The mesh needs no error estimate: derivatives are compared on any mesh.
    let report = check_problem(&scene.problem_for(Calculation::Guess)?, Tolerance::default())?;
    let code = if report.passed() { 0 } else { 3 };
    let summary = report.summary().with_subject(options.scene.display());
    Ok(outputs.finish(code, &report, None, &summary))
}

//! `rodfit check`

use super::output::Outputs;
use super::{Json, Manner, conclude, limits};
use rodfit::check::{Tolerance, check_problem};
use rodfit::{Error, Scene};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Options {
    /// Scene file (TOML).
    scene: PathBuf,
    #[command(flatten)]
    json: Json,
}

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let scene = Scene::load(&options.scene)?;
    let mut outputs = Outputs::new(manner);
    let json = outputs.add("--json", options.json.json.as_deref());
    outputs.check(&scene.files())?;
    limits::of_check(&scene).admit(manner)?;
    let report = check_problem(&scene.problem()?, Tolerance::default())?;
    let code = if report.passed() { 0 } else { 3 };
    Ok(conclude(code, [outputs.write_json(json, &report), outputs.summary(&report)]))
}

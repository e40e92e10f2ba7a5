//! `rodfit check`

use crate::command::{Json, Manner, conclude, limits, open};
use rodfit::Error;
use rodfit::accuracy::Aim;
use rodfit::check::{Tolerance, check_problem};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Options {
    /// Scene file (TOML).
    scene: PathBuf,
    #[command(flatten)]
    json: Json,
}

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let (scene, outputs, [json]) = open(&options.scene, [options.json.output()], manner)?;
    limits::of_check(&scene).admit(manner)?;
    let report = check_problem(&scene.problem_for(Aim::Guess)?, Tolerance::default())?;
    let code = if report.passed() { 0 } else { 3 };
    Ok(conclude(
        code,
        [
            outputs.write_json(json, &report),
            outputs.summary(&report.summary().of(options.scene.display().to_string())),
        ],
    ))
}

//! `rodfit parameters`

use crate::command::{Json, Manner, conclude, limits, open};
use rodfit::Error;
use rodfit::accuracy::Aim;
use rodfit::problem::ParameterList;
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
    let list = ParameterList::of(&scene.problem_for(Aim::Guess)?);
    Ok(conclude(
        0,
        [
            outputs.write_json(json, &list),
            outputs.summary(&list.summary().of(options.scene.display().to_string())),
        ],
    ))
}

//! `rodfit parameters`

use super::output::Outputs;
use super::{Json, Manner, conclude, limits};
use rodfit::parameter::ParameterList;
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
    let list = ParameterList::of(&scene.problem()?);
    Ok(conclude(0, [outputs.write_json(json, &list), outputs.summary(&list)]))
}

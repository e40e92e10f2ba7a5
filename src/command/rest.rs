//! `rodfit static`

use crate::command::{Json, Manner, chosen_mesh, conclude, limits, open};
use rodfit::Error;
use rodfit::accuracy::Aim;
use rodfit::dynamics::shape_csv;
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Options {
    /// Scene file (TOML); `[time]` is not needed.
    scene: PathBuf,
    /// Write the position of every node to this file (CSV); `-` is standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
}

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let wanted = [options.json.output(), ("--out", options.out.as_deref())];
    let (scene, outputs, [json, out]) = open(&options.scene, wanted, manner)?;
    limits::of_rest(&scene).admit(manner)?;
    let problem = scene.problem_for(Aim::Rest)?;
    let mut found = problem.equilibrium()?;
    found.resolution = chosen_mesh(&problem);
    let written = [
        outputs.write_json(json, &found),
        outputs.write(out, || Ok(shape_csv(&problem, &found.nodes)?.into_bytes())),
        outputs.summary(&found.summary().of(options.scene.display().to_string())),
    ];
    Ok(conclude(0, written))
}

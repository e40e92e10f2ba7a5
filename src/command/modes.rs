//! `rodfit modes`

use crate::command::{Json, Manner, chosen_mesh, conclude, limits, open};
use rodfit::Error;
use rodfit::accuracy::Aim;
use rodfit::vibration::LinearizationPoint;
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Options {
    /// Scene file (TOML); `[time]` is not needed.
    scene: PathBuf,
    /// Number of modes.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=200))]
    count: u16,
    /// Compute modes about the rest shape instead of the equilibrium under the loads.
    #[arg(long)]
    rest: bool,
    #[command(flatten)]
    json: Json,
}

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let (scene, outputs, [json]) = open(&options.scene, [options.json.output()], manner)?;
    let count = usize::from(options.count);
    limits::of_modes(&scene, count).admit(manner)?;
    let about =
        if options.rest { LinearizationPoint::Rest } else { LinearizationPoint::Equilibrium };
    let problem = scene.problem_for(Aim::Modes(count))?;
    let mut found = problem.modes(count, about)?;
    found.resolution = chosen_mesh(&problem);
    Ok(conclude(
        0,
        [
            outputs.write_json(json, &found),
            outputs.summary(&found.summary().of(options.scene.display().to_string())),
        ],
    ))
}

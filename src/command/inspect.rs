//! `rodfit inspect`

use crate::command::output::Outputs;
use crate::command::{Json, Manner, conclude};
use rodfit::Error;
use rodfit::fit::{Inspection, Recording};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Options {
    /// Table, or file of Motive, Vicon, Qualisys, Tracker, DeepLabCut, SLEAP, DLTdv, Kinovea or TrackMate, or TRC.
    file: PathBuf,
    #[command(flatten)]
    said: Said,
    #[command(flatten)]
    json: Json,
}

/// What a file does not say itself.
#[derive(clap::Args)]
pub struct Said {
    /// Frames per second, if the file does not contain them.
    #[arg(long, value_name = "HZ")]
    fps: Option<f64>,
    /// Meters per pixel, or per unit that the file does not name.
    #[arg(long, value_name = "M")]
    scale: Option<f64>,
}

impl Said {
    pub fn recording(&self) -> Recording {
        Recording { fps: self.fps, scale: self.scale, ..Recording::default() }
    }
}

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let mut outputs = Outputs::new(manner);
    let (option, path) = options.json.output();
    let json = outputs.add(option, path);
    outputs.check(std::slice::from_ref(&options.file))?;
    let inspection = Inspection::of(&options.file, &options.said.recording())?;
    Ok(conclude(0, [outputs.write_json(json, &inspection), outputs.summary(&inspection.summary())]))
}

//! `rodfit inspect`: describes a file of markers.

use crate::command::output::Outputs;
use crate::command::{GlobalOptions, JsonOption};
use rodfit::Error;
use rodfit::fit::{Inspection, Recording};
use std::path::PathBuf;

/// Options of `rodfit inspect`.
#[derive(clap::Args)]
pub struct InspectOptions {
    /// Table, or file of Motive, Vicon, Qualisys, Tracker, DeepLabCut, SLEAP, DLTdv, Kinovea or TrackMate, or TRC.
    file: PathBuf,
    #[command(flatten)]
    units: RecordingUnits,
    #[command(flatten)]
    json: JsonOption,
}

/// Frame rate and scale of a recording whose file lacks them.
#[derive(clap::Args)]
pub struct RecordingUnits {
    /// Frames per second, if the file does not contain them.
    #[arg(long, value_name = "HZ")]
    pub fps: Option<f64>,
    /// Meters per pixel, or per unit that the file does not name.
    #[arg(long, value_name = "M")]
    pub scale: Option<f64>,
}

impl RecordingUnits {
    /// The keys of a recording, without any others.
    pub fn recording(&self) -> Recording {
        Recording { fps: self.fps, scale: self.scale, ..Recording::default() }
    }
}

/// Writes and prints the description.
pub fn run(options: &InspectOptions, global: GlobalOptions) -> Result<u8, Error> {
    let inputs = std::slice::from_ref(&options.file);
    let outputs = Outputs::with_json(&options.json, inputs, global)?;
    let inspection = Inspection::of(&options.file, &options.units.recording())?;
    Ok(outputs.finish(0, &inspection, None, &inspection.summary()))
}

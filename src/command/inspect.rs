//! `rodfit inspect`: describes a file of recorded markers before it is used in a fit.
//!
//! The format is recognized (plain table, or a motion-capture or tracking program); `--fps`, `--scale` and `--columns`
//! ([`RecordingUnits`]) give a frame rate, a scale and names of columns that the file lacks. Output is a description
//! (JSON if requested, and text): frames, clock, markers with range, noise and gaps, likely problems, and the
//! `[[observation]]` table for a fit file. A file that cannot be read is an error; the exit code is otherwise 0, or
//! that of an output that cannot be written.

use crate::command::output::Outputs;
use crate::command::{GlobalOptions, JsonOption};
use rodfit::Error;
use rodfit::fit::{ColumnRules, Inspection, Recording};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Options of `rodfit inspect`.
#[derive(clap::Args)]
pub struct InspectOptions {
    /// Table, or file of Motive, Vicon, Qualisys, Tracker, DeepLabCut, SLEAP, DLTdv, Kinovea or TrackMate, or C3D, TRC,
    /// STO or MOT.
    file: PathBuf,
    #[command(flatten)]
    units: RecordingUnits,
    #[command(flatten)]
    json: JsonOption,
}

/// Frame rate, scale and columns of a recording whose file lacks them.
#[derive(clap::Args)]
pub struct RecordingUnits {
    /// Frames per second, if the file does not contain them.
    #[arg(long, value_name = "HZ")]
    pub fps: Option<f64>,
    /// Meters per pixel, or per length unit where the file states none.
    #[arg(long, value_name = "M")]
    pub scale: Option<f64>,
    /// Columns of a table by name or number, as in a fit file: '{ t = 1, x = "NAME_x" }'.
    #[arg(long, value_name = "COLUMNS", value_parser = columns)]
    pub columns: Option<ColumnRules>,
}

/// The columns of a table from the text of an inline table of TOML. The error is a message.
fn columns(text: &str) -> Result<ColumnRules, String> {
    let read = toml::from_str::<BTreeMap<String, ColumnRules>>(&format!("columns = {text}"));
    let columns = read.map_err(|error| error.message().to_string())?.remove("columns");
    columns.ok_or_else(|| "found no columns, allowed: columns as { t = 1, x = 2 }".into())
}

impl RecordingUnits {
    /// The keys of a recording with the given frame rate, Hz, scale, m per unit, and columns; all other keys are at
    /// their defaults.
    pub fn recording(&self) -> Recording {
        let columns = self.columns.clone();
        Recording { fps: self.fps, scale: self.scale, columns, ..Recording::default() }
    }
}

/// Reads the file and writes its description. Returns exit code 0, or that of an output that cannot be written; a file
/// that cannot be read is an error.
pub fn run(options: &InspectOptions, global: GlobalOptions) -> Result<u8, Error> {
    let inputs = std::slice::from_ref(&options.file);
    let outputs = Outputs::with_json(&options.json, inputs, global)?;
    let inspection = Inspection::of(&options.file, &options.units.recording())?;
    Ok(outputs.finish(0, &inspection, None, &inspection.summary()))
}

//! `rodfit init`: writes a template of an experiment, a scene file (TOML), a fit file (TOML) and data, into a folder.
//!
//! Templates are cantilever, droop, frequencies, helix and cable. The data are synthetic (a simulation with noise), or
//! the recording of the user (`--from`). Frame rate, units and end time of a recorded tip are then written into the
//! files, of a cable frame rate, units and lengths, of a droop the path only. Existing files are an error unless
//! `--overwrite` is given. The printed summary has the names of the files, keys whose value is still a placeholder such
//! as `..`, and the next command. The exit code is 0, or that of a file that cannot be written.

mod cable;
mod measures;
mod recorded;
mod synthetic_data;

use crate::command::init::measures::Measures;
use crate::command::init::recorded::recorded_files;
use crate::command::init::synthetic_data::synthetic_files;
use crate::command::inspect::RecordingUnits;
use crate::command::output::{Output, Outputs};
use crate::command::{GlobalOptions, conclude};
use clap::ValueEnum;
use rodfit::Error;
use rodfit::fit::placeholders;
use rodfit::summary::{Summary, Tone};
use std::path::{Path, PathBuf};

/// Options of `rodfit init`.
#[derive(clap::Args)]
pub struct InitOptions {
    /// Kind of experiment.
    template: Template,
    /// Use this file as data instead of synthetic data.
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    #[command(flatten)]
    units: RecordingUnits,
    #[command(flatten)]
    measures: Measures,
    /// Folder of the new files.
    #[arg(long, alias = "into", value_name = "DIR", default_value = ".")]
    out: PathBuf,
}

/// A kind of experiment with a template.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Template {
    /// Recorded tip of a swinging clamped rod.
    Cantilever,
    /// Photograph of a clamped rod at rest.
    Droop,
    /// Natural frequencies of a clamped rod.
    Frequencies,
    /// Recorded tip of a hanging helix in space.
    Helix,
    /// Recorded markers on a cable that two grippers move.
    Cable,
}

/// The texts of a template; places in braces, such as `{end}`, are filled when the data are known.
struct TemplateTexts {
    template: Template,
    /// Name of the template and stem of its files.
    name: &'static str,
    /// Scene file (TOML), with the dimensions of the options.
    scene: String,
    /// Fit file (TOML).
    fit: &'static str,
}

/// A file to write: its name in the output folder, and its content.
struct NewFile {
    name: String,
    text: String,
}

impl NewFile {
    /// A file with this name and text.
    fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: text.into() }
    }
}

impl TemplateTexts {
    /// The scene and fit texts of a template, with the dimensions of `measures` in the scene. Invalid dimensions are an
    /// error.
    fn new(template: Template, measures: &Measures) -> Result<Self, Error> {
        let (name, scene, fit) = match template {
            Template::Cantilever => {
                ("cantilever", include_str!("cantilever.toml"), include_str!("cantilever-fit.toml"))
            }
            Template::Droop => {
                ("droop", include_str!("droop.toml"), include_str!("droop-fit.toml"))
            }
            Template::Frequencies => (
                "frequencies",
                include_str!("frequencies.toml"),
                include_str!("frequencies-fit.toml"),
            ),
            Template::Helix => {
                ("helix", include_str!("helix.toml"), include_str!("helix-fit.toml"))
            }
            Template::Cable => {
                ("cable", include_str!("cable.toml"), include_str!("cable-fit.toml"))
            }
        };
        // A rectangular section needs the plane in which the rod bends.
        let is_planar = !matches!(template, Template::Helix | Template::Cable);
        Ok(Self { template, name, scene: measures.apply(scene, is_planar)?, fit })
    }

    /// The scene file `NAME.toml` and the fit file `NAME-fit.toml` of the template, with the texts `scene` and `fit`.
    fn files(&self, scene: impl Into<String>, fit: impl Into<String>) -> Vec<NewFile> {
        vec![
            NewFile::new(format!("{}.toml", self.name), scene),
            NewFile::new(format!("{}-fit.toml", self.name), fit),
        ]
    }
}

/// Writes the files of a template, and prints their names, keys whose value is still a placeholder such as `..`, and
/// the next command. An existing file is an error without `--overwrite`. Returns exit code 0, or that of a file that
/// cannot be written.
pub fn run(options: &InitOptions, global: GlobalOptions) -> Result<u8, Error> {
    let texts = TemplateTexts::new(options.template, &options.measures)?;
    let files = match &options.from {
        None => synthetic_files(&texts)?,
        Some(file) => recorded_files(&texts, file, options)?,
    };
    let mut outputs = Outputs::empty(global);
    let folder = Some(&*options.out);
    let places: Vec<Option<Output>> =
        files.iter().map(|file| outputs.add_in_folder("init", folder, &file.name)).collect();
    // Files of the user are kept.
    let existing = files.iter().map(|file| options.out.join(&file.name)).find(|p| p.exists());
    if let Some(path) = existing.filter(|_| !global.overwrites()) {
        let found = format!("{}, which exists", path.display());
        let allowed = "new files; --overwrite replaces existing ones";
        return Err(Error::invalid("init", found, allowed));
    }
    outputs.check(options.from.as_slice())?;
    let write = |(place, file): (Option<Output>, &NewFile)| {
        outputs.write(place, || Ok(file.text.clone().into_bytes()))
    };
    let mut written: Vec<_> = places.into_iter().zip(&files).map(write).collect();
    let names: Vec<&str> = files.iter().map(|file| &file.name[..]).collect();
    let fit = format!("{}-fit.toml", texts.name);
    // The next command is run from the present folder, which its path is relative to.
    let fit = if options.out == Path::new(".") { fit.into() } else { options.out.join(fit) };
    let data = match options.from {
        Some(_) => "fill in the origin of the scene and its dimensions",
        None => "the data are synthetic",
    };
    // Values that only the user can measure are marked in the templates.
    let open: Vec<String> = files.iter().flat_map(|file| placeholders(&file.text)).collect();
    let open = (!open.is_empty()).then(|| open.join(", "));
    let summary = Summary::new(format!("wrote {}", names.join(", ")), Tone::Neutral)
        .fact("Data", data)
        .facts("To fill in", open)
        .fact("Next", format!("rodfit fit {}", fit.display()));
    written.push(outputs.print(&summary));
    Ok(conclude(0, written))
}

/// A text as a quoted and escaped TOML string.
fn toml_string(text: &str) -> String {
    toml::Value::String(text.into()).to_string()
}

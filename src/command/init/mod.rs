//! `rodfit init`

mod made_up;
mod measures;

use crate::command::init::measures::Measures;
use crate::command::inspect::Said;
use crate::command::output::{Output, Outputs};
use crate::command::{Manner, conclude};
use clap::ValueEnum;
use rodfit::fit::{Inspection, Recording, RestShape, placeholders};
use rodfit::scene::Track;
use rodfit::summary::{Summary, Tone};
use rodfit::{Error, Observation, Scene};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub struct Options {
    /// Kind of experiment.
    template: Template,
    /// Use this file as data instead of synthetic data.
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    #[command(flatten)]
    said: Said,
    #[command(flatten)]
    measures: Measures,
    /// Folder of the new files.
    #[arg(long, alias = "into", value_name = "DIR", default_value = ".")]
    out: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
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

/// Scene and fit of a template.
fn texts(template: Template) -> (&'static str, &'static str, &'static str) {
    match template {
        Template::Cantilever => {
            ("cantilever", include_str!("cantilever.toml"), include_str!("cantilever-fit.toml"))
        }
        Template::Droop => ("droop", include_str!("droop.toml"), include_str!("droop-fit.toml")),
        Template::Frequencies => {
            ("frequencies", include_str!("frequencies.toml"), include_str!("frequencies-fit.toml"))
        }
        Template::Helix => ("helix", include_str!("helix.toml"), include_str!("helix-fit.toml")),
        Template::Cable => ("cable", include_str!("cable.toml"), include_str!("cable-fit.toml")),
    }
}

/// Files with what goes into them.
type Files = Vec<(String, String)>;

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let (name, scene, fit) = texts(options.template);
    let is_planar = !matches!(options.template, Template::Helix | Template::Cable);
    let scene = options.measures.applied(scene, is_planar)?;
    let scene = &scene[..];
    let files = match (&options.from, options.template) {
        (None, _) => made_up::files(options.template, (name, scene, fit))?,
        (Some(file), template) => from(file, template, (name, scene, fit), options)?,
    };
    let mut outputs = Outputs::new(manner);
    let places: Vec<Option<Output>> = files
        .iter()
        .map(|(name, _)| outputs.add_in_folder("init", Some(&options.out), name))
        .collect();
    if let Some(path) = files.iter().map(|(name, _)| options.out.join(name)).find(|p| p.exists())
        && !manner.overwrites()
    {
        return Err(Error::Invalid {
            file: None,
            key: "init".into(),
            found: format!("{}, which exists", path.display()),
            allowed: "new files; --overwrite replaces existing ones".into(),
        });
    }
    outputs.check(options.from.as_slice())?;
    let mut written = Vec::new();
    for (place, (_, text)) in places.into_iter().zip(&files) {
        written.push(outputs.write(place, || Ok(text.clone().into_bytes())));
    }
    let names: Vec<&str> = files.iter().map(|(name, _)| &name[..]).collect();
    let fit = format!("{name}-fit.toml");
    let fit = if options.out == Path::new(".") { fit.into() } else { options.out.join(fit) };
    let data = match options.from {
        Some(_) => "fill in the origin of the scene and its dimensions",
        None => "the data are synthetic",
    };
    let open: Vec<String> = files.iter().flat_map(|(_, text)| placeholders(text)).collect();
    let mut summary =
        Summary::new(format!("wrote {}", names.join(", ")), Tone::Neutral).fact("Data", data);
    if !open.is_empty() {
        summary = summary.fact("To fill in", open.join(", "));
    }
    written.push(outputs.summary(&summary.fact("Next", format!("rodfit fit {}", fit.display()))));
    Ok(conclude(0, written))
}

/// A path as the files in another folder name it.
fn named(file: &Path, into: &Path) -> Result<String, Error> {
    let path = match into == Path::new(".") || file.is_absolute() {
        true => file.to_path_buf(),
        false => std::path::absolute(file).map_err(|source| Error::Io {
            named_in: None,
            path: file.into(),
            source,
        })?,
    };
    Ok(quoted(&path.display().to_string()))
}

/// As TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.into()).to_string()
}

/// Files for what was measured.
fn from(
    file: &Path,
    template: Template,
    (name, scene, fit): (&str, &str, &str),
    options: &Options,
) -> Result<Files, Error> {
    let said = options.said.recording();
    let path = named(file, &options.out)?;
    let both = |scene: String, fit: String| {
        vec![(format!("{name}.toml"), scene), (format!("{name}-fit.toml"), fit)]
    };
    match template {
        Template::Cantilever | Template::Helix => {
            let inspection = Inspection::of(file, &said)?;
            // What cannot be read so would not run.
            let seen = Observation::read_as(file, &inspection.recording)?;
            let end = seen.samples.last().map_or(0.0, |sample| sample.time);
            let own = quoted(&file.display().to_string());
            let observation = inspection.observation.replacen(&own, &path, 1);
            let scene = scene.replace("{end}", &format!("{:?}", (end * 1e3).ceil() / 1e3));
            Ok(both(scene, fit.replace("{observation}", &observation)))
        }
        Template::Droop => {
            RestShape::read_as(file, &Recording { fps: None, ..said })?;
            Ok(both(scene.into(), fit.replace("{file}", &path)))
        }
        Template::Frequencies => Err(Error::Invalid {
            file: None,
            key: "--from".into(),
            found: format!("{} beside frequencies", file.display()),
            allowed: "none: the fit file itself contains the frequencies".into(),
        }),
        Template::Cable => {
            let inspection = Inspection::of(file, &said)?;
            // Hands that rest at first are a part of the recording.
            let time_zero = Some(inspection.clock[0]);
            let recording =
                Recording { marker: None, likelihood: None, time_zero, ..inspection.recording };
            let track = Track::read_as(file, &recording, &[])?;
            let mut keys = String::new();
            for (key, value) in [("fps", recording.fps), ("scale", recording.scale)] {
                keys += &value.map_or(String::new(), |value| format!("\n{key} = {value}"));
            }
            if recording.y.is_some() {
                keys += "\ny = \"down\"";
            }
            if let Some(zero) = recording.time_zero.filter(|zero| *zero != 0.0) {
                keys += &format!("\ntime_zero = {zero}");
            }
            let markers = track.markers().len();
            if markers < LEAST_MARKERS {
                let allowed = format!(
                    "{LEAST_MARKERS} or more along the rod: two in each hand, and what is seen between them"
                );
                return Err(Error::invalid("--from", format!("{markers} markers"), allowed));
            }
            let scene = cable(scene, &track, &path, &keys);
            let fit = fit.replace("{fitted}", &format!("[{path}]")).replace("{held_out}", "");
            let sigma = "0.01                # m: how far off a good model is";
            let fit = fit.replace("{sigma}", sigma);
            Ok(both(scene, fit))
        }
    }
}

/// Fewest markers of a cable between two hands.
const LEAST_MARKERS: usize = 5;

/// The scene of a cable with the lengths, the step and the way up of a recording.
fn cable(scene: &str, track: &Track, file: &str, keys: &str) -> String {
    let markers = track.markers();
    let lengths: Vec<f64> = markers
        .windows(2)
        .map(|pair| {
            let both = pair[0].seen.iter().zip(&pair[1].seen);
            let distance = |(a, b): (&Option<[f64; 3]>, &Option<[f64; 3]>)| {
                let (a, b) = ((*a)?, (*b)?);
                Some((0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt())
            };
            let mut all: Vec<f64> = both.filter_map(distance).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).map_or(0.0, |length| (length * 1e5).round() / 1e5)
        })
        .collect();
    let mut points = vec![[0.0, 0.0, 0.0]];
    let mut along = 0.0;
    for length in &lengths {
        along += length;
        points.push([(along * 1e5_f64).round() / 1e5, 0.0, 0.0]);
    }
    let flat = markers.iter().flat_map(|m| m.seen.iter().flatten()).all(|x| x[2] == 0.0);
    let gravity = if flat { "[0, -9.81, 0]" } else { "[0, 0, -9.81]" };
    let mut steps: Vec<f64> = track.times().windows(2).map(|t| t[1] - t[0]).collect();
    steps.sort_by(f64::total_cmp);
    let step = steps.get(steps.len() / 2).copied().unwrap_or(0.01);
    [
        ("{segments}", (markers.len() - 1).to_string()),
        ("{points}", format!("{points:?}")),
        ("{lengths}", format!("{lengths:?}")),
        ("{file}", file.into()),
        ("{keys}", keys.into()),
        ("{gravity}", gravity.into()),
        ("{step}", format!("{:?}", (step * 1e7).round() / 1e7)),
    ]
    .into_iter()
    .fold(scene.to_string(), |scene, (place, text)| scene.replace(place, &text))
}

/// A scene's text, read.
fn read(scene: &str) -> Result<Scene, Error> {
    Scene::from_toml(scene, ".")
}

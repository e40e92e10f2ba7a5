//! `rodfit init --from`: the scene and fit file of a template for a recording of the user.
//!
//! The recording is read here, so that one that cannot be used is an error at this stage. The templates `cantilever`
//! and `helix` get the end time (the last sample, rounded up to 1e-3 s) and the keys of the tip's observation. The
//! template `droop` gets the path of the recorded shape. The template `cable` gets lengths of edges and time step from
//! the markers, and the recording as the motion of its ends; fewer than `MIN_MARKERS` markers are an error. With the
//! template `frequencies`, which has no data file, `--from` is an error.

use crate::command::init::cable::{MIN_MARKERS, cable_scene};
use crate::command::init::{InitOptions, NewFile, Template, TemplateTexts, toml_string};
use rodfit::fit::{Inspection, Recording, RestShape};
use rodfit::scene::Track;
use rodfit::{Error, Observation};
use std::path::Path;

/// Scene and fit file of a template for the data `file`. Of a recorded tip the simulated time ends with the last
/// sample, rounded up to 1e-3 s. The file is read with the frame rate, scale and columns of `options`, a droop without
/// the frame rate. Fit files of tips and scenes of cables get these as keys; the fit file of a droop gets the path
/// only. A file that cannot be read, or any with the template frequencies, is an error.
pub(super) fn recorded_files(
    texts: &TemplateTexts,
    file: &Path,
    options: &InitOptions,
) -> Result<Vec<NewFile>, Error> {
    let TemplateTexts { template, scene, fit, .. } = texts;
    let recording = options.units.recording();
    let path = path_from(&options.out, file)?;
    match template {
        Template::Cantilever | Template::Helix => {
            // The inspection determines the keys that the file needs, and the samples the end of the simulation.
            let inspection = Inspection::of(file, &recording)?;
            let observed = Observation::read_as(file, &inspection.recording)?;
            let end = observed.samples.last().map_or(0.0, |sample| sample.time);
            let own = toml_string(&file.display().to_string());
            let observation = inspection.observation.replacen(&own, &path, 1);
            let scene = scene.replace("{end}", &format!("{:?}", (end * 1e3).ceil() / 1e3));
            Ok(texts.files(scene, fit.replace("{observation}", &observation)))
        }
        Template::Droop => {
            for (option, is_given) in [
                ("--columns", recording.columns.is_some()),
                ("--scale", recording.scale.is_some()),
                ("--fps", recording.fps.is_some()),
            ] {
                // The fit file of the template has no such key: the fit would read other numbers than this check.
                if is_given {
                    let allowed = "none with the template droop: state units in the header of the file, as s[mm]";
                    return Err(Error::invalid(option, "with the template droop", allowed));
                }
            }
            RestShape::read_as(file, &recording)?;
            Ok(texts.files(scene, fit.replace("{file}", &path)))
        }
        Template::Frequencies => {
            let found = format!("{} together with the template frequencies", file.display());
            let allowed = "none: the fit file itself contains the frequencies";
            Err(Error::invalid("--from", found, allowed))
        }
        Template::Cable => recorded_cable(texts, file, &path, &recording),
    }
}

/// Scene and fit file of a cable whose ends move as the outermost markers of the recording `file`, with the units in
/// `recording`; `path` is its path as a TOML string. The time begins with the first frame. Fewer than [`MIN_MARKERS`]
/// markers are an error.
fn recorded_cable(
    texts: &TemplateTexts,
    file: &Path,
    path: &str,
    recording: &Recording,
) -> Result<Vec<NewFile>, Error> {
    let inspection = Inspection::of(file, recording)?;
    // Grippers that rest at first are a part of the motion: the time does not begin at its onset.
    let time_zero = Some(inspection.clock[0]);
    let recording = Recording { marker: None, likelihood: None, time_zero, ..inspection.recording };
    // All markers are read; the scene gets only those keys that the file itself does not determine.
    let track = Track::read_as(file, &recording, &[])?;
    let columns = recording.columns.as_ref().map(|columns| format!("\ncolumns = {columns}"));
    let mut keys = columns.unwrap_or_default();
    let zero = recording.time_zero.filter(|zero| *zero != 0.0);
    let down = recording.y.map(|_| "\"down\"".to_string());
    let [fps, scale, zero] =
        [recording.fps, recording.scale, zero].map(|x| x.map(|x| x.to_string()));
    for (key, value) in [("fps", fps), ("scale", scale), ("y", down), ("time_zero", zero)] {
        keys += &value.map_or(String::new(), |value| format!("\n{key} = {value}"));
    }
    let markers = track.markers().len();
    if markers < MIN_MARKERS {
        let allowed = format!(
            "{MIN_MARKERS} or more along the rod: two on each gripper, and the others between them"
        );
        return Err(Error::invalid("--from", format!("{markers} markers"), allowed));
    }
    let sigma = "0.01                # m, the error of a good model";
    let fit = texts.fit.replace("{fitted}", &format!("[{path}]")).replace("{held_out}", "");
    let scene = cable_scene(&texts.scene, &track, path, &keys)?;
    Ok(texts.files(scene, fit.replace("{sigma}", sigma)))
}

/// The path of `file` as a TOML string, as files in `folder` refer to it: unchanged if the folder is the current one or
/// the path is absolute, else absolute. Error: the path cannot be made absolute.
fn path_from(folder: &Path, file: &Path) -> Result<String, Error> {
    let path = match folder == Path::new(".") || file.is_absolute() {
        true => file.to_path_buf(),
        false => std::path::absolute(file).map_err(|source| Error::io(file, source))?,
    };
    Ok(toml_string(&path.display().to_string()))
}

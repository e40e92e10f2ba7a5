//! `rodfit predict`: compares a scene with recordings, without a fit.
//!
//! [`run`] is the command. The scene and the recordings (`--on`) become a fit file whose measurements are all
//! validation data, one experiment per recording. A recording prescribes the ends of the rod, and its other markers are
//! the data, if the scene has recorded ends. Else it is a shape at rest if the scene has no `[time]`, or the motion of
//! `--point`. Keys that the file of a motion needs are determined by its inspection. The experiments are simulated with
//! the values of the scene ([`prediction`]). [`set_derivatives`] selects hand-derived derivatives or dual numbers for
//! them. [`finish_prediction`] writes the output: a summary of the errors, and a report (`--json`) and a page
//! (`--report`) if requested. The exit code is 3 if an experiment could not be simulated, else 0, or that of an output
//! that cannot be written.

use crate::command::inspect::RecordingUnits;
use crate::command::output::Outputs;
use crate::command::{DerivativesOption, GlobalOptions, JsonOption, limits, terminal};
use rodfit::fit::{FitFile, Inspection, ValidationReport, Vertical};
use rodfit::{Error, Scene, page};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use toml::{Table, Value};

/// Options of `rodfit predict`.
#[derive(clap::Args)]
pub struct PredictOptions {
    /// Scene file (TOML) with the identified values, as `rodfit fit --save` writes it.
    scene: PathBuf,
    /// Recordings to predict. If the scene has recorded ends, each recording prescribes them and its other markers are
    /// compared. Else each file is the motion of `--point`, or, without `[time]` in the scene, a shape at rest.
    #[arg(long, value_name = "FILE", required = true, num_args = 1..)]
    on: Vec<PathBuf>,
    /// Observed point of the rod: `tip` (default), or its arc length in meters.
    #[arg(long, value_name = "POINT")]
    point: Option<String>,
    /// Name of the marker in the file.
    #[arg(long, value_name = "NAME")]
    marker: Option<String>,
    /// Standard deviation of the measured positions, m.
    #[arg(long, value_name = "M")]
    sigma: Option<f64>,
    /// Time in the file at which the motion starts, in the unit of the file.
    #[arg(long, value_name = "TIME")]
    time_zero: Option<f64>,
    #[command(flatten)]
    units: RecordingUnits,
    #[command(flatten)]
    json: JsonOption,
    /// Write a page with errors, data and model, `predict.html`, and `predict.json` into this folder.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Derivatives of the energies in the time stepper.
    #[arg(long, value_enum, default_value = "hand")]
    derivatives: DerivativesOption,
}

/// Predicts the recordings with the values of the scene and writes the errors. Returns exit code 3 if an experiment
/// could not be simulated, the code of an output that cannot be written, or 0.
pub fn run(options: &PredictOptions, global: GlobalOptions) -> Result<u8, Error> {
    let mut outputs = Outputs::new(&options.json, global);
    outputs.add_page_with_data(options.report.as_deref(), "predict");
    let mut inputs = options.on.clone();
    inputs.push(options.scene.clone());
    outputs.check(&inputs)?;
    let scene = Scene::load(&options.scene)?;
    limits::mesh_cost(&scene).admit(global)?;
    // A prediction is a fit file whose measurements are all validation data.
    let mut file = FitFile::from_toml(&fit_text(options, &scene)?, ".")?;
    set_derivatives(&mut file, options.derivatives);
    // The files of the recordings are known only after the fit file was read.
    outputs.check(&file.files())?;
    let stop = terminal::stop_on_ctrl_c(global);
    let report = prediction(&file, outputs.has_page(), stop)?;
    Ok(finish_prediction(&outputs, &report, &options.scene.display().to_string()))
}

/// Sets the derivatives of the energies (hand-derived or dual numbers) in the time steppers of all experiments of a fit
/// file, in place.
pub fn set_derivatives(file: &mut FitFile, derivatives: DerivativesOption) {
    for experiment in &mut file.experiments {
        experiment.problem = experiment.problem.clone().with_derivatives(derivatives.into());
    }
}

/// The prediction errors of a fit file whose measurements are all validation data. `keeps_plots`: with data of plots;
/// `stop` interrupts the simulations.
pub fn prediction(
    file: &FitFile,
    keeps_plots: bool,
    stop: Arc<AtomicBool>,
) -> Result<ValidationReport, Error> {
    let fit = file.fit().stop_when(stop);
    if keeps_plots { fit.keep_plot_data().predict() } else { fit.predict() }
}

/// Writes the `report` of a prediction as JSON and page and prints its summary, under the `title`. Returns the exit
/// code: 3 if an experiment could not be simulated, else 0, or that of an output that cannot be written.
pub fn finish_prediction(outputs: &Outputs, report: &ValidationReport, title: &str) -> u8 {
    let code = if report.is_complete() { 0 } else { 3 };
    let page = || page::prediction_page(report, title);
    outputs.finish(code, report, Some(&page), &report.to_summary().with_subject(title))
}

/// A fit file as TOML text with the recordings of the options as validation data, one experiment each. With recorded
/// ends in the scene, each recording prescribes them. Errors: options that have no effect on the scene's kind of data,
/// and a recording that cannot be inspected.
fn fit_text(options: &PredictOptions, scene: &Scene) -> Result<String, Error> {
    let path = |path: &Path| Value::String(path.display().to_string());
    let mut experiments: Vec<Value> = Vec::new();
    for (k, file) in options.on.iter().enumerate() {
        let mut keys = Table::new();
        if scene.supports.path.is_some() {
            keys.insert("path".into(), path(file));
        }
        keys.insert("name".into(), Value::String(experiment_name(&options.on, k)));
        keys.insert("scene".into(), path(&options.scene));
        keys.insert("held_out".into(), Value::Boolean(true));
        let is_shape = scene.supports.path.is_none() && scene.time.is_none();
        let kind = if is_shape { "shape" } else { "observation" };
        let measurement = measurement_keys(file, options, scene)?;
        keys.insert(kind.into(), Value::Array(vec![Value::Table(measurement)]));
        experiments.push(Value::Table(keys));
    }
    let whole = Table::from_iter([("experiment".to_string(), Value::Array(experiments))]);
    toml::to_string(&whole).map_err(|error| Error::Parse { file: None, message: error.to_string() })
}

/// The stem of the `k`-th file, or its path without extension if another of the files has the same stem.
fn experiment_name(files: &[PathBuf], k: usize) -> String {
    let stem = |file: &Path| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let own = stem(&files[k]);
    match files.iter().filter(|file| stem(file) == own).count() {
        1 => own,
        _ => files[k].with_extension("").display().to_string(),
    }
}

/// The keys (TOML) of the measurement in a file. If recordings prescribe the ends of the rod: its free markers;
/// `--point`, `--marker`, `--time-zero`, `--fps`, `--scale` and `--columns` are rejected. If the scene has no time: a
/// shape at rest, with `--scale` and `--columns`; the others are rejected. Else the motion of `--point`, with keys as
/// [`Inspection`] determines them where the options give none; time zero only if the marker rests before it moves.
/// `--sigma` is a key in all cases.
fn measurement_keys(file: &Path, options: &PredictOptions, scene: &Scene) -> Result<Table, Error> {
    let RecordingUnits { fps, scale, .. } = options.units;
    let columns = &options.units.columns;
    let mut keys = Table::new();
    let add_number = |keys: &mut Table, key: &str, number: Option<f64>| {
        keys.extend(number.map(|number| (key.to_string(), Value::Float(number))));
    };
    add_number(&mut keys, "sigma", options.sigma);
    let of_motions = [
        ("--point", options.point.is_some()),
        ("--marker", options.marker.is_some()),
        ("--time-zero", options.time_zero.is_some()),
        ("--fps", fps.is_some()),
    ];
    let of_all_files = [("--scale", scale.is_some()), ("--columns", columns.is_some())];
    if scene.supports.path.is_some() {
        // The recording itself is read by the keys of the scene's table, which these options would contradict.
        let given = of_motions.iter().chain(&of_all_files).find(|(_, is_given)| *is_given);
        if let Some((option, _)) = given {
            let found = "with a scene that has [supports.path]";
            return Err(Error::invalid(*option, found, "the keys of that table in the scene"));
        }
        keys.insert("markers".into(), Value::String("free".into()));
        return Ok(keys);
    }
    keys.insert("file".into(), Value::String(file.display().to_string()));
    if let Some(columns) = columns {
        let written = Value::try_from(columns)
            .map_err(|error| Error::Parse { file: None, message: error.to_string() })?;
        keys.insert("columns".into(), written);
    }
    if scene.time.is_none() {
        if let Some((option, _)) = of_motions.iter().find(|(_, is_given)| *is_given) {
            let found = "with a scene without [time], whose files are shapes at rest";
            return Err(Error::invalid(*option, found, "--scale, --columns and --sigma"));
        }
        add_number(&mut keys, "scale", scale);
        return Ok(keys);
    }
    let mut recording = options.units.recording();
    recording.marker.clone_from(&options.marker);
    recording.time_zero = options.time_zero;
    // Further keys that the file needs, as `rodfit inspect` determines them.
    let inspection = Inspection::of(file, &recording)?;
    let found = inspection.recording;
    // A clock starts as in a fit file, unless it begins below zero or the marker rests before it moves: a recording may
    // begin in the motion.
    let first = inspection.clock[0];
    let onset = found.time_zero.filter(|zero| first < 0.0 || *zero > first);
    add_number(&mut keys, "fps", fps.or(found.fps));
    add_number(&mut keys, "scale", scale.or(found.scale));
    add_number(&mut keys, "time_zero", options.time_zero.or(onset));
    add_number(&mut keys, "likelihood", found.likelihood);
    if let Some(marker) = options.marker.clone().or(found.marker) {
        keys.insert("marker".into(), Value::String(marker));
    }
    if found.y == Some(Vertical::Down) {
        keys.insert("y".into(), Value::String("down".into()));
    }
    keys.insert("point".into(), point_value(options.point.as_deref().unwrap_or("tip"))?);
    Ok(keys)
}

/// The TOML value of the key `point` from the text of `--point`: `tip`, or an arc length in meters. Other texts are an
/// error.
fn point_value(text: &str) -> Result<Value, Error> {
    if text == "tip" {
        return Ok(Value::String(text.into()));
    }
    let invalid = |_| Error::invalid("--point", text, "tip, or an arc length in m");
    let arc_length: f64 = text.parse().map_err(invalid)?;
    Ok(Value::Table(Table::from_iter([("arc_length".to_string(), Value::Float(arc_length))])))
}

//! `rodfit predict`

use crate::command::inspect::Said;
use crate::command::output::{Output, Outputs};
use crate::command::{Json, Manner, Route, conclude, limits, terminal};
use rodfit::fit::{FitFile, Inspection, ValidationReport};
use rodfit::{Error, Scene, page};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use toml::{Table, Value};

#[derive(clap::Args)]
pub struct Options {
    /// Scene file (TOML) with the identified values, as `rodfit fit --save` writes it.
    scene: PathBuf,
    /// Recordings to predict. If the scene has recorded ends, each recording prescribes them and its other markers are
    /// compared. Else each file is the motion of `--point`, or, without `[time]` in the scene, a shape at rest.
    #[arg(long, value_name = "FILE", required = true, num_args = 1..)]
    on: Vec<PathBuf>,
    /// Point of the rod that a file shows: `tip`, or its arc length in metres.
    #[arg(long, value_name = "POINT", default_value = "tip")]
    point: String,
    /// Marker of the file, by its name.
    #[arg(long, value_name = "NAME")]
    marker: Option<String>,
    /// Standard deviation of the measured positions, m.
    #[arg(long, value_name = "M")]
    sigma: Option<f64>,
    /// Clock of the file at the start of the motion, in its unit.
    #[arg(long, value_name = "TIME")]
    time_zero: Option<f64>,
    #[command(flatten)]
    said: Said,
    #[command(flatten)]
    json: Json,
    /// Write a page with errors, data and model, `predict.html`, and `predict.json` into this folder.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Which derivatives to step with.
    #[arg(long, value_enum, default_value = "hand")]
    derivatives: Route,
}

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let mut outputs = Outputs::new(manner);
    let places = Places {
        json: outputs.add("--json", options.json.json.as_deref()),
        page: outputs.add_in_folder("--report", options.report.as_deref(), "predict.html"),
        numbers: outputs.add_in_folder("--report", options.report.as_deref(), "predict.json"),
    };
    let mut inputs = options.on.clone();
    inputs.push(options.scene.clone());
    outputs.check(&inputs)?;
    let scene = Scene::load(&options.scene)?;
    limits::of_mesh(&scene).admit(manner)?;
    let text = fit_text(options, &scene)?;
    let mut file = FitFile::from_toml(&text, ".")?;
    for experiment in &mut file.experiments {
        experiment.problem =
            experiment.problem.clone().with_derivatives(options.derivatives.into());
    }
    outputs.check(&file.files())?;
    let stop = terminal::stop_on_ctrl_c(manner);
    let report = predicted(&file, places.page.is_some(), stop)?;
    places.write(&report, &outputs, &options.scene.display().to_string())
}

/// Outputs of a prediction.
pub struct Places {
    pub json: Option<Output>,
    pub page: Option<Output>,
    pub numbers: Option<Output>,
}

impl Places {
    /// Writes everything, and returns the exit code: 3 if an experiment could not be simulated.
    pub fn write(
        self,
        report: &ValidationReport,
        outputs: &Outputs,
        title: &str,
    ) -> Result<u8, Error> {
        let written = [
            outputs.write_json(self.json, report),
            outputs.write(self.page, || Ok(page::prediction_page(report, title).into_bytes())),
            outputs.write_json(self.numbers, report),
            outputs.summary(&report.to_summary().of(title)),
        ];
        Ok(conclude(if report.is_complete() { 0 } else { 3 }, written))
    }
}

/// The prediction errors of a fit file whose measurements are validation data.
pub fn predicted(
    file: &FitFile,
    keeps_plots: bool,
    stop: Arc<AtomicBool>,
) -> Result<ValidationReport, Error> {
    let fit = file.fit().stop_when(stop);
    if keeps_plots { fit.keep_plot_data().predict() } else { fit.predict() }
}

/// A fit file with the recordings as validation data.
fn fit_text(options: &Options, scene: &Scene) -> Result<String, Error> {
    let path = |path: &Path| Value::String(path.display().to_string());
    let mut experiments: Vec<Value> = Vec::new();
    for (k, file) in options.on.iter().enumerate() {
        let mut own = Table::new();
        if scene.supports.path.is_some() {
            own.insert("path".into(), path(file));
        }
        own.insert("name".into(), Value::String(name(&options.on, k)));
        own.insert("scene".into(), path(&options.scene));
        own.insert("held_out".into(), Value::Boolean(true));
        let (table, keys) = measurement(file, options, scene)?;
        own.insert(table.into(), Value::Array(vec![Value::Table(keys)]));
        experiments.push(Value::Table(own));
    }
    let whole = Table::from_iter([("experiment".to_string(), Value::Array(experiments))]);
    toml::to_string(&whole).map_err(|error| Error::Parse { file: None, message: error.to_string() })
}

/// The stem of a file, with its place where other files have the same stem.
fn name(files: &[PathBuf], k: usize) -> String {
    let stem = |file: &Path| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let own = stem(&files[k]);
    match files.iter().filter(|file| stem(file) == own).count() {
        1 => own,
        _ => files[k].with_extension("").display().to_string(),
    }
}

/// The table of a measurement in a fit file, and its keys.
fn measurement(
    file: &Path,
    options: &Options,
    scene: &Scene,
) -> Result<(&'static str, Table), Error> {
    let mut keys = Table::new();
    if let Some(sigma) = options.sigma {
        keys.insert("sigma".into(), Value::Float(sigma));
    }
    if scene.supports.path.is_some() {
        let alone = [
            ("--marker", options.marker.is_some()),
            ("--time-zero", options.time_zero.is_some()),
            ("--fps", options.said.recording().fps.is_some()),
            ("--scale", options.said.recording().scale.is_some()),
        ];
        if let Some((option, _)) = alone.iter().find(|(_, is_given)| *is_given) {
            return Err(invalid(
                option,
                "with a scene that has [supports.path]".into(),
                "the keys of that table in the scene",
            ));
        }
        keys.insert("markers".into(), Value::String("free".into()));
        return Ok(("observation", keys));
    }
    keys.insert("file".into(), Value::String(file.display().to_string()));
    let mut recording = options.said.recording();
    if scene.time.is_none() {
        add_numbers(&mut keys, [("scale", recording.scale)]);
        return Ok(("shape", keys));
    }
    recording.marker.clone_from(&options.marker);
    recording.time_zero = options.time_zero;
    // Keys that the file itself shows to be needed, as `rodfit inspect` writes them.
    let found = Inspection::of(file, &recording)?.recording;
    add_numbers(
        &mut keys,
        [
            ("fps", recording.fps.or(found.fps)),
            ("scale", recording.scale.or(found.scale)),
            ("time_zero", options.time_zero.or(found.time_zero)),
            ("likelihood", found.likelihood),
        ],
    );
    if let Some(marker) = options.marker.clone().or(found.marker) {
        keys.insert("marker".into(), Value::String(marker));
    }
    if found.y == Some(rodfit::fit::Vertical::Down) {
        keys.insert("y".into(), Value::String("down".into()));
    }
    keys.insert("point".into(), point(&options.point)?);
    Ok(("observation", keys))
}

fn add_numbers<const N: usize>(keys: &mut Table, numbers: [(&str, Option<f64>); N]) {
    for (key, number) in numbers {
        keys.extend(number.map(|number| (key.to_string(), Value::Float(number))));
    }
}

/// `tip`, or an arc length in metres.
fn point(text: &str) -> Result<Value, Error> {
    if text == "tip" {
        return Ok(Value::String(text.into()));
    }
    let refused = || invalid("--point", text.into(), "tip, or an arc length in metres");
    let arc_length: f64 = text.parse().map_err(|_| refused())?;
    Ok(Value::Table(Table::from_iter([("arc_length".to_string(), Value::Float(arc_length))])))
}

fn invalid(key: &str, found: String, allowed: &str) -> Error {
    Error::Invalid { file: None, key: key.into(), found, allowed: allowed.into() }
}

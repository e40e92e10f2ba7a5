//! `rodfit bench --published`: errors and times of scenes with known answers, as a table that can be set beside those
//! of other programs.
//!
//! Every [case](CASES) is run on several meshes, motions also with several steps and schemes. A row has scene,
//! quantity, edges, step, scheme, error, wall time and Newton iterations. Cases have the unit of the error, the formula
//! and its source. [`PublishedReport::new`] runs all of them, [`PublishedReport::summary`] is the text for a terminal
//! and [`PublishedReport::csv`] a table with one row for each run. A run that fails is an error. A quantity that a
//! motion does not have is missing in its row.

use crate::command::bench::cases::{CASES, PublishedCase};
use crate::command::bench::timing::fastest;
use rodfit::numerics::simd::simd_level;
use rodfit::scene::Scheme;
use rodfit::summary::{ItemTable, Summary, Tone, duration};
use rodfit::{Error, Problem, Scene};
use serde::Serialize;
use std::time::Duration;

/// A run of a case.
#[derive(Serialize)]
struct PublishedRow {
    /// Number of edges.
    segments: usize,
    /// Time step, s; absent without a motion.
    step: Option<f64>,
    /// Time integrator; absent without a motion.
    scheme: Option<&'static str>,
    /// The measured value; absent if the motion does not have it.
    value: Option<f64>,
    /// Difference from the exact value in the unit of the case.
    error: Option<f64>,
    /// Shortest wall time, s.
    seconds: f64,
    /// Newton iterations; absent for frequencies.
    newton_iterations: Option<usize>,
}

/// A case with its runs.
#[derive(Serialize)]
struct PublishedResult {
    scene: &'static str,
    quantity: &'static str,
    /// The exact value, in the units of the scene.
    exact: f64,
    error_unit: &'static str,
    formula: &'static str,
    source: &'static str,
    rows: Vec<PublishedRow>,
}

/// Errors and times of all cases, with the version of rodfit and the SIMD instruction set.
#[derive(Serialize)]
pub struct PublishedReport {
    version: &'static str,
    vector_unit: &'static str,
    cases: Vec<PublishedResult>,
}

/// Mesh, number of steps and scheme of a run; the last two are those of a motion.
struct RunSettings {
    segments: usize,
    steps: Option<usize>,
    scheme: Option<Scheme>,
}

/// The runs of a case: all schemes on all meshes, each with its number of steps, or all meshes without a motion.
fn settings(case: &PublishedCase) -> Vec<RunSettings> {
    if case.steps.is_empty() {
        let still =
            |segments: &usize| RunSettings { segments: *segments, steps: None, scheme: None };
        return case.meshes.iter().map(still).collect();
    }
    let of_scheme = |scheme: &Scheme| {
        let scheme = *scheme;
        case.meshes.iter().zip(case.steps).map(move |(segments, steps)| RunSettings {
            segments: *segments,
            steps: Some(*steps),
            scheme: Some(scheme),
        })
    };
    case.schemes.iter().flat_map(of_scheme).collect()
}

/// The problem of a case with these settings, and its time step, s. Errors are those of the scene.
fn problem(case: &PublishedCase, settings: &RunSettings) -> Result<(Problem, Option<f64>), Error> {
    let mut scene = Scene::from_toml(case.toml, ".")?;
    scene.rod.segments = Some(settings.segments);
    let mut step = None;
    let motion = settings.steps.zip(settings.scheme);
    if let (Some(time), Some((steps, scheme))) = (&mut scene.time, motion) {
        step = Some(time.end / steps as f64);
        (time.step, time.scheme) = (step, scheme);
    }
    Ok((scene.problem()?, step))
}

/// Runs a case with these settings for the time `least`, at least once. Errors are those of the simulation.
fn row(
    case: &PublishedCase,
    settings: &RunSettings,
    least: Duration,
) -> Result<PublishedRow, Error> {
    let (problem, step) = problem(case, settings)?;
    let (mut value, mut newton_iterations) = (None, None);
    let time = fastest(least, || {
        let measured = (case.measure)(&problem)?;
        (value, newton_iterations) = (measured.value, measured.newton_iterations);
        Ok(measured.time)
    })?;
    let exact = (case.exact)();
    Ok(PublishedRow {
        segments: settings.segments,
        step,
        scheme: settings.scheme.map(Scheme::name),
        value,
        error: value.map(|value| (value - exact).abs() / (case.scale)(exact)),
        seconds: time.as_secs_f64(),
        newton_iterations,
    })
}

/// An error with two digits, or `not found` without a value.
fn error_text(error: Option<f64>) -> String {
    error.map_or("not found".into(), |error| format!("{error:.1e}"))
}

impl PublishedReport {
    /// Runs all cases, each row for the time `least` and at least once; the shortest wall time counts. `progress` is
    /// called after every row with the number of rows so far and of all rows. The first error ends it.
    pub fn new(least: Duration, mut progress: impl FnMut(usize, usize)) -> Result<Self, Error> {
        let all = CASES.iter().map(|case| settings(case).len()).sum();
        let mut done = 0;
        let mut cases = Vec::new();
        for case in &CASES {
            let mut rows = Vec::new();
            for settings in settings(case) {
                rows.push(row(case, &settings, least)?);
                done += 1;
                progress(done, all);
            }
            cases.push(PublishedResult {
                scene: case.scene,
                quantity: case.quantity,
                exact: (case.exact)(),
                error_unit: case.error_unit,
                formula: case.formula,
                source: case.source,
                rows,
            });
        }
        Ok(Self { version: env!("CARGO_PKG_VERSION"), vector_unit: simd_level(), cases })
    }

    /// The result as text for a terminal: a table of all runs, and one of the formulas with their sources.
    pub fn summary(&self) -> Summary {
        let numbered = || self.cases.iter().enumerate();
        let all = numbered().flat_map(|(i, case)| case.rows.iter().map(move |row| (i, case, row)));
        let runs = ItemTable::new(all)
            .right("no.", |(i, ..)| (i + 1).to_string())
            .left("scene", |(_, case, _)| case.scene.to_string())
            .right("edges", |(.., row)| row.segments.to_string())
            .right("step", |(.., row)| row.step.map(|step| format!("{:.3} ms", step * 1e3)))
            .left("scheme", |(.., row)| row.scheme.map(String::from))
            .right("error", |(.., row)| error_text(row.error))
            .right("time", |(.., row)| duration(row.seconds))
            .right("Newton", |(.., row)| row.newton_iterations.map(|n| n.to_string()));
        let formulas = ItemTable::new(numbered())
            .right("no.", |(i, _)| (i + 1).to_string())
            .wrapped("quantity", |(_, case)| case.quantity.to_string())
            .left("error over", |(_, case)| case.error_unit.to_string())
            .wrapped("exact value", |(_, case)| case.formula.to_string())
            .wrapped("source", |(_, case)| case.source.to_string());
        let Self { version, vector_unit, .. } = self;
        let status = format!("rodfit {version}, vector unit {vector_unit}");
        Summary::new(status, Tone::Neutral)
            .table("Errors, wall times and Newton iterations", runs)
            .table("Exact values", formulas)
    }

    /// The result as a CSV table with a row for each run. Step and scheme are empty without a motion, Newton iterations
    /// for frequencies. The writer in memory does not fail.
    pub fn csv(&self) -> Result<Vec<u8>, Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let failed = |error: &dyn std::fmt::Display| Error::Fit(format!("the table: {error}"));
        let header = [
            "scene",
            "quantity",
            "segments",
            "step[s]",
            "scheme",
            "value",
            "exact",
            "error",
            "error_unit",
            "seconds",
            "newton_iterations",
            "formula",
            "source",
        ];
        writer.write_record(header).map_err(|error| failed(&error))?;
        for case in &self.cases {
            for row in &case.rows {
                let text = |number: Option<String>| number.unwrap_or_default();
                let cells = [
                    case.scene.to_string(),
                    case.quantity.to_string(),
                    row.segments.to_string(),
                    text(row.step.map(|step| step.to_string())),
                    row.scheme.unwrap_or_default().to_string(),
                    text(row.value.map(|value| value.to_string())),
                    case.exact.to_string(),
                    text(row.error.map(|error| error.to_string())),
                    case.error_unit.to_string(),
                    row.seconds.to_string(),
                    text(row.newton_iterations.map(|n| n.to_string())),
                    case.formula.to_string(),
                    case.source.to_string(),
                ];
                writer.write_record(cells).map_err(|error| failed(&error))?;
            }
        }
        writer.into_inner().map_err(|error| failed(&error))
    }
}

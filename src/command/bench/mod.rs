//! `rodfit bench`: measures the speed of this machine on two shipped scenes, a planar cantilever and a spatial helix.
//! With `--published` it compares other shipped scenes with closed forms instead ([`PublishedReport`]).
//!
//! Two quantities are measured: time steps per second of the time stepper alone ([`RUNS`]), and wall seconds of a
//! complete fit of Young's modulus to the recorded tip. Each measurement is repeated for the time of `--seconds`, at
//! least once, and the shortest duration counts. The output is a table, and JSON if requested, with the version, the
//! vector unit of the processor and the number of threads. The exit code is 0, or that of an output that cannot be
//! written.

mod cases;
mod closed_forms;
mod published;
mod timing;

use crate::command::bench::published::PublishedReport;
use crate::command::bench::timing::fastest;
use crate::command::output::Outputs;
use crate::command::{GlobalOptions, JsonOption, conclude, terminal};
use rodfit::fit::Sample;
use rodfit::numerics::simd::simd_level;
use rodfit::summary::{ItemTable, Summary, Tone};
use rodfit::{Error, Fit, Observation, Parameter, Point, Problem, Scene, Trajectory};
use serde::Serialize;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Options of `rodfit bench`.
#[derive(clap::Args)]
pub struct BenchOptions {
    /// Time for which each row is repeated, s; the fastest run counts.
    #[arg(long, default_value_t = 0.3, value_parser = repetition_time)]
    seconds: f64,
    /// Compare scenes with closed forms: errors, times and Newton iterations over meshes, steps and schemes.
    #[arg(long)]
    published: bool,
    /// Write the table of `--published` to this file (CSV); `-` is standard output.
    #[arg(long, value_name = "FILE", requires = "published")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOption,
}

/// Parses the value of `--seconds`, s; a text that is no number, or outside 0 to 1000, is rejected with a message.
fn repetition_time(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("{text} is not a number"))?;
    let is_allowed = (0.0..=1e3).contains(&seconds);
    is_allowed.then_some(seconds).ok_or_else(|| "it must be between 0 and 1000".into())
}

/// A scene compiled into the program: its name, the text of its scene file (TOML), and the recorded motion of its tip
/// (CSV).
struct ShippedScene {
    name: &'static str,
    scene: &'static str,
    tip: &'static str,
}

/// The planar cantilever of `data/cantilever.toml`, with the recorded motion of its tip.
const CANTILEVER: ShippedScene = ShippedScene {
    name: "cantilever",
    scene: include_str!("../../../data/cantilever.toml"),
    tip: include_str!("../../../data/cantilever-tip.csv"),
};
/// The spatial helix of `data/helix.toml`, with the recorded motion of its tip.
const HELIX: ShippedScene = ShippedScene {
    name: "helix",
    scene: include_str!("../../../data/helix.toml"),
    tip: include_str!("../../../data/helix-tip.csv"),
};

/// The simulations whose steps are timed: scene, time step in s, and the parameter beta of Newmark-beta (0.5 conserves
/// energy, 1 is implicit Euler). A smaller step needs fewer Newton iterations, so both kinds of steps are measured.
const RUNS: [(ShippedScene, f64, f64); 4] =
    [(CANTILEVER, 1e-3, 0.5), (CANTILEVER, 5e-3, 1.0), (HELIX, 1e-3, 0.5), (HELIX, 5e-3, 0.5)];

/// Speed of the time stepper: scene, number of segments, time step in s, beta of the scheme, and steps per second of
/// wall time in the fastest run.
#[derive(Serialize)]
struct SteppingSpeed {
    scene: &'static str,
    segments: usize,
    /// s.
    step: f64,
    beta: f64,
    steps_per_second: f64,
}

/// Shortest wall time of a fit of Young's modulus to the recorded tip of a scene, s.
#[derive(Serialize)]
struct FitTime {
    scene: &'static str,
    seconds: f64,
}

/// The result of the benchmark: version of rodfit, SIMD instruction set (`vector_unit`), threads of the fits, and all
/// measured rows.
#[derive(Serialize)]
struct BenchReport {
    version: &'static str,
    vector_unit: &'static str,
    threads: usize,
    steps: Vec<SteppingSpeed>,
    fits: Vec<FitTime>,
}

/// Measures the steps per second of [`RUNS`] and the seconds per fit of both scenes, and writes the report (JSON if
/// requested, and a table). Returns the exit code: 0, or that of an output that cannot be written. Errors: an output
/// that cannot be used, and a simulation or fit that fails.
pub fn run(options: &BenchOptions, global: GlobalOptions) -> Result<u8, Error> {
    if options.published {
        return run_published(options, global);
    }
    let outputs = Outputs::with_json(&options.json, &[], global)?;
    let least = Duration::from_secs_f64(options.seconds);
    // Stepping alone: no output and no record of the motion.
    let mut steps = Vec::new();
    for (scene, step, beta) in RUNS {
        let problem = scene.problem(step, beta)?;
        let all = problem.time()?.steps();
        let fastest = fastest(least, || {
            let mut trajectory = Trajectory::unrecorded(&problem)?;
            trajectory.run(&problem, all, |_| {})?;
            Ok(trajectory.stepping())
        })?;
        let (scene, segments) = (scene.name, problem.segments());
        let steps_per_second = all as f64 / fastest.as_secs_f64();
        steps.push(SteppingSpeed { scene, segments, step, beta, steps_per_second });
    }
    // A fit from the search to the report, with the recorded tip of the shipped scene.
    let mut fits = Vec::new();
    for scene in [CANTILEVER, HELIX] {
        let problem = scene.problem(1e-3, 0.5)?;
        let fit =
            Fit::new(&problem).observe(scene.observation()).identify(Parameter::YoungsModulus);
        let fastest = fastest(least, || {
            let start = Instant::now();
            fit.solve().map(|_| start.elapsed())
        })?;
        fits.push(FitTime { scene: scene.name, seconds: fastest.as_secs_f64() });
    }
    let report = BenchReport {
        version: env!("CARGO_PKG_VERSION"),
        vector_unit: simd_level(),
        threads: rayon::current_num_threads(),
        steps,
        fits,
    };
    Ok(outputs.finish(0, &report, None, &report.summary()))
}

/// Runs the scenes with known answers with a progress bar, and writes the table (CSV if requested) and the report. The
/// exit code and the errors are those of [`run`].
fn run_published(options: &BenchOptions, global: GlobalOptions) -> Result<u8, Error> {
    let mut outputs = Outputs::new(&options.json, global);
    let table = outputs.add("--csv", options.csv.as_deref());
    outputs.check(&[])?;
    let bar = terminal::progress_bar(global, 1);
    let report = PublishedReport::new(Duration::from_secs_f64(options.seconds), |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    let report = report?;
    let written = outputs.write(table, || report.csv());
    Ok(conclude(outputs.finish(0, &report, None, &report.summary()), [written]))
}

impl ShippedScene {
    /// The problem of the scene with another time step, s, and another beta of the time scheme; the mesh is that of the
    /// scene. Errors are those of [`Scene::problem`].
    fn problem(&self, step: f64, beta: f64) -> Result<Problem, Error> {
        let mut scene = Scene::from_toml(self.scene, ".")?;
        if let Some(time) = &mut scene.time {
            (time.step, time.beta) = (Some(step), beta);
        }
        scene.problem()
    }

    /// The recorded motion of the tip, from CSV lines with a time, s, and two or three coordinates, m. Lines without a
    /// number at the start, such as the header, are skipped; a missing coordinate is `None`.
    fn observation(&self) -> Observation {
        let line = |line: &str| {
            let mut numbers = line.split(',').map(|number| number.trim().parse().ok());
            let time = numbers.next()??;
            let mut position = [None; 3];
            position.iter_mut().zip(numbers).for_each(|(to, number)| *to = number);
            Some(Sample { time, position })
        };
        Observation::new(self.tip.lines().filter_map(line).collect()).at(Point::Tip)
    }
}

impl BenchReport {
    /// The result as text for a terminal: a table of simulations (step in ms) and a table of fits.
    fn summary(&self) -> Summary {
        let Self { version, vector_unit, threads, .. } = self;
        let steps = ItemTable::new(&self.steps)
            .left("scene", |row| row.scene.to_string())
            .right("segments", |row| row.segments.to_string())
            .right("step", |row| format!("{} ms", row.step * 1e3))
            .right("beta", |row| format!("{:.1}", row.beta))
            .right("steps per second", |row| format!("{:.0}", row.steps_per_second));
        let fits = ItemTable::new(&self.fits)
            .left("scene", |row| row.scene.to_string())
            .right("time", |row| format!("{:.3} s", row.seconds));
        let status =
            format!("rodfit {version}, vector unit {vector_unit}, fits on {threads} threads");
        Summary::new(status, Tone::Neutral)
            .table("Simulation", steps)
            .table("Fit of Young's modulus", fits)
    }
}

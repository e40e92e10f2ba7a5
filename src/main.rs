//! The `rodfit` command: simulate, static, modes, study, check, fit. Exit codes: 0 done; 2 bad input; 3 could not be
//! computed, did not converge, or not identifiable.

use clap::{Parser, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use rodfit::check::{Tolerance, check_problem};
use rodfit::fit::FitFile;
use rodfit::modes::About;
use rodfit::output::{NodeTable, SimulationReport, write_shape};
use rodfit::study::Study;
use rodfit::{Derivatives, Error, Problem, Scene, Trajectory, report};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Simulates slender elastic rods and identifies their parameters from recorded motion.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// No progress and no summary; errors are still printed.
    #[arg(short, long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Simulate a scene.
    Simulate {
        /// Scene file (TOML).
        scene: PathBuf,
        /// Write the position of every node at every step here (CSV).
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Write the report here (JSON); `-` is stdout.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
        /// Which derivatives to step with.
        #[arg(long, value_enum, default_value = "hand")]
        derivatives: Route,
    },
    /// Find where a rod comes to rest under its loads, and whether it stays there.
    Static {
        /// Scene file (TOML); `[time]` is not needed.
        scene: PathBuf,
        /// Write the position of every node here (CSV).
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Write the report here (JSON); `-` is stdout.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// The lowest frequencies and shapes of small vibrations.
    Modes {
        /// Scene file (TOML); `[time]` is not needed.
        scene: PathBuf,
        /// How many.
        #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=200))]
        count: u16,
        /// About the rest shape instead of the equilibrium under the loads.
        #[arg(long)]
        rest: bool,
        /// Write the report here (JSON); `-` is stdout.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Speed against error over schemes, steps and meshes.
    Study {
        /// Scene file (TOML).
        scene: PathBuf,
        /// Write the report here (JSON); `-` is stdout.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
        /// Write a page with the work-precision plot, `study.html`, into this folder.
        #[arg(long, value_name = "DIR")]
        report: Option<PathBuf>,
    },
    /// Compare hand-derived derivatives with num-dual's and with finite differences.
    Check {
        /// Scene file (TOML).
        scene: PathBuf,
        /// Write the report here (JSON); `-` is stdout.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Identify parameters from recorded motion.
    Fit {
        /// Fit file (TOML).
        fit: PathBuf,
        /// Write the result here (JSON); `-` is stdout.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
        /// Write the scene with the fitted values here (TOML); those of several experiments, with
        /// their names added to this one.
        #[arg(long, value_name = "FILE")]
        save: Option<PathBuf>,
        /// Write a page with data, model and doubts, `fit.html`, and `fit.json` into this folder.
        #[arg(long, value_name = "DIR")]
        report: Option<PathBuf>,
        /// Which derivatives to step with.
        #[arg(long, value_enum, default_value = "hand")]
        derivatives: Route,
    },
}

#[derive(Clone, Copy, ValueEnum)]
enum Route {
    /// The hand-derived formulas.
    Hand,
    /// num-dual's derivatives of the energies.
    Dual,
}

impl From<Route> for Derivatives {
    fn from(route: Route) -> Self {
        match route {
            Route::Hand => Self::Hand,
            Route::Dual => Self::Dual,
        }
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let quiet = arguments.quiet;
    let outcome = match arguments.command {
        Command::Simulate { scene, out, json, derivatives } => {
            simulate(&scene, out.as_deref(), json.as_deref(), derivatives.into(), quiet)
        }
        Command::Static { scene, out, json } => {
            rest(&scene, out.as_deref(), json.as_deref(), quiet)
        }
        Command::Modes { scene, count, rest, json } => {
            modes(&scene, usize::from(count), rest, json.as_deref(), quiet)
        }
        Command::Study { scene, json, report } => {
            study(&scene, json.as_deref(), report.as_deref(), quiet)
        }
        Command::Check { scene, json } => check(&scene, json.as_deref(), quiet),
        Command::Fit { fit, json, save, report, derivatives } => {
            let written = Written { json, save, report };
            identify(&fit, &written, derivatives.into(), quiet)
        }
    };
    match outcome {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(if error.is_input() { 2 } else { 3 })
        }
    }
}

fn simulate(
    scene: &Path,
    out: Option<&Path>,
    json: Option<&Path>,
    derivatives: Derivatives,
    quiet: bool,
) -> Result<ExitCode, Error> {
    let problem = Scene::load(scene)?.problem()?.with_derivatives(derivatives);
    let problem = problem.stop_when(stop_on_ctrl_c(quiet));
    let steps = problem.time()?.steps();
    let mut table = out.map(|path| NodeTable::create(path, problem.nodes())).transpose()?;
    let mut report = SimulationReport::new(&problem);
    let mut trajectory = Trajectory::new(&problem, &[problem.nodes() - 1], &[])?;
    let bar = progress_bar(quiet, steps as u64);
    let mut write = Ok(());
    let outcome = trajectory.run(&problem, steps, |simulation| {
        report.push(&problem, simulation);
        if let (Some(table), Ok(())) = (&mut table, &write) {
            write = table.push(simulation);
        }
        bar.set_position(simulation.work().steps as u64);
    });
    bar.finish_and_clear();
    report.finish(&trajectory, &outcome);
    if let (Some(table), Ok(())) = (&mut table, &write) {
        write = table.finish();
    }
    write_json(json, &report)?;
    write?;
    if !quiet && !is_stdout(json) {
        summarize(&problem, &report);
    }
    outcome.map(|()| ExitCode::SUCCESS)
}

fn summarize(problem: &Problem, report: &SimulationReport) {
    println!("{} model, {} unknowns: {}", report.model, report.dof, report.model_reason);
    if let Some([t, x, y, z]) = report.tip.last() {
        println!("tip at t = {t} s: ({x:.6}, {y:.6}, {z:.6}) m");
    }
    println!(
        "energy changed by {:.1e} of the largest kinetic energy; length {} m",
        report.energy_drift(),
        problem.length()
    );
    println!(
        "{} steps, {} Newton iterations, {:.3} s: {}",
        report.steps, report.newton_iterations, report.wall_seconds, report.status
    );
}

fn rest(
    scene: &Path,
    out: Option<&Path>,
    json: Option<&Path>,
    quiet: bool,
) -> Result<ExitCode, Error> {
    let problem = Scene::load(scene)?.problem()?;
    let found = problem.equilibrium()?;
    write_json(json, &found)?;
    if let Some(path) = out {
        write_shape(path, &problem, &found.nodes)?;
    }
    if !quiet && !is_stdout(json) {
        println!("{found}");
    }
    Ok(ExitCode::SUCCESS)
}

fn modes(
    scene: &Path,
    count: usize,
    rest: bool,
    json: Option<&Path>,
    quiet: bool,
) -> Result<ExitCode, Error> {
    let about = if rest { About::Rest } else { About::Equilibrium };
    let found = Scene::load(scene)?.problem()?.modes(count, about)?;
    write_json(json, &found)?;
    if !quiet && !is_stdout(json) {
        println!("{found}");
    }
    Ok(ExitCode::SUCCESS)
}

fn study(
    scene: &Path,
    json: Option<&Path>,
    report: Option<&Path>,
    quiet: bool,
) -> Result<ExitCode, Error> {
    let scene_name = scene.display().to_string();
    let scene = Scene::load(scene)?;
    let bar = progress_bar(quiet, 1);
    let study = Study::new(&scene, |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    write_json(json, &study)?;
    if let Some(folder) = report {
        write_page(folder, "study.html", &report::study_page(&study, &scene_name))?;
    }
    if !quiet && !is_stdout(json) {
        println!("{study}");
    }
    Ok(ExitCode::SUCCESS)
}

fn check(scene: &Path, json: Option<&Path>, quiet: bool) -> Result<ExitCode, Error> {
    let problem = Scene::load(scene)?.problem()?;
    let report = check_problem(&problem, Tolerance::default())?;
    write_json(json, &report)?;
    if !quiet && !is_stdout(json) {
        println!("{report}");
    }
    Ok(if report.passed() { ExitCode::SUCCESS } else { ExitCode::from(3) })
}

/// What a fit writes.
struct Written {
    json: Option<PathBuf>,
    save: Option<PathBuf>,
    report: Option<PathBuf>,
}

fn identify(
    path: &Path,
    written: &Written,
    derivatives: Derivatives,
    quiet: bool,
) -> Result<ExitCode, Error> {
    let json = written.json.as_deref();
    let mut file = FitFile::load(path)?;
    for experiment in &mut file.experiments {
        experiment.problem = experiment.problem.clone().with_derivatives(derivatives);
    }
    let bar = spinner(quiet);
    let shown = bar.clone();
    let mut fit = file.fit().stop_when(stop_on_ctrl_c(quiet));
    if written.report.is_some() {
        fit = fit.keep_evidence();
    }
    let report = fit
        .on_progress(move |stage, simulations| {
            shown.set_message(format!("{stage} ({simulations:.1} simulations)"));
            shown.tick();
        })
        .solve();
    bar.finish_and_clear();
    let report = report?;
    write_json(json, &report)?;
    if !quiet && !is_stdout(json) {
        println!("{report}");
    }
    if let Some(folder) = &written.report {
        let title = path.display().to_string();
        write_page(folder, "fit.html", &report::fit_page(&report, &title))?;
        write_json(Some(&folder.join("fit.json")), &report)?;
    }
    let save = written.save.as_deref();
    for experiment in save.iter().flat_map(|_| &file.experiments) {
        let values = report.parameters_of(experiment);
        let mut scene = experiment.problem.with(values)?.scene().clone();
        scene.make_paths_absolute()?;
        let path = save_path(save.unwrap_or(path), &experiment.name);
        std::fs::write(&path, scene.to_toml()?).map_err(|source| Error::Io { path, source })?;
    }
    if report.is_success() {
        return Ok(ExitCode::SUCCESS);
    }
    eprintln!("error: {}", report.status);
    Ok(ExitCode::from(3))
}

/// Where the fitted scene of an experiment is written: `fitted.toml`, or `fitted-NAME.toml` for one
/// of several.
fn save_path(path: &Path, experiment: &str) -> PathBuf {
    if experiment.is_empty() {
        return path.into();
    }
    // What file systems do not take.
    let plain = |c: char| if c.is_control() || r#"/\:*?"<>|"#.contains(c) { '_' } else { c };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name: String = experiment.chars().map(plain).collect();
    path.with_file_name(format!("{stem}-{name}.toml"))
}

fn is_stdout(json: Option<&Path>) -> bool {
    json == Some(Path::new("-"))
}

fn write_page(folder: &Path, name: &str, page: &str) -> Result<(), Error> {
    let path = folder.join(name);
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(&path, page))
        .map_err(|source| Error::Io { path, source })
}

/// A flag that Ctrl-C sets. A second one ends the process at once.
fn stop_on_ctrl_c(quiet: bool) -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let seen = flag.clone();
    let handler = ctrlc::set_handler(move || {
        if seen.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        if !quiet {
            eprintln!("\nstopping; Ctrl-C again ends at once");
        }
    });
    if let Err(error) = handler {
        eprintln!("warning: Ctrl-C will lose what was computed: {error}");
    }
    flag
}

fn write_json(path: Option<&Path>, report: &impl Serialize) -> Result<(), Error> {
    let Some(path) = path else { return Ok(()) };
    let io = |source| Error::Io { path: path.into(), source };
    let mut text = serde_json::to_string(report).map_err(|error| io(error.into()))?;
    text.push('\n');
    if is_stdout(Some(path)) {
        return std::io::stdout().write_all(text.as_bytes()).map_err(io);
    }
    std::fs::write(path, text).map_err(io)
}

fn progress_bar(quiet: bool, steps: u64) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len}, {eta} left");
    ProgressBar::new(steps).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn spinner(quiet: bool) -> ProgressBar {
    if quiet { ProgressBar::hidden() } else { ProgressBar::new_spinner() }
}

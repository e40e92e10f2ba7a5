//! `rodfit simulate`

use crate::command::output::{Outputs, Writing};
use crate::command::{Json, Manner, Route, code_of, conclude, limits, terminal};
use rodfit::accuracy::{Attempt, run_checked};
use rodfit::dynamics::{Film, NodeTable, SimulationReport, Snapshot};
use rodfit::summary::{Summary, Tone, duration};
use rodfit::{Error, Problem, Scene, Trajectory, page};
use std::path::PathBuf;
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
pub struct Options {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Write the position of every node at every step to this file (CSV); `-` is standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
    /// Write a page with animation, energies and tip trajectory (`simulation.html`) into this folder.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Derivatives of the energies in the time stepper.
    #[arg(long, value_enum, default_value = "hand")]
    derivatives: Route,
}

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let scene = Scene::load(&options.scene)?;
    let mut outputs = Outputs::new(manner);
    let json = outputs.add("--json", options.json.json.as_deref());
    let out = outputs.add("--out", options.out.as_deref());
    let place = outputs.add_in_folder("--report", options.report.as_deref(), "simulation.html");
    outputs.check(&scene.files())?;
    limits::of_mesh(&scene).admit(manner)?;
    let (problem, check) = scene.checked_problem()?;
    let stop = terminal::stop_on_ctrl_c(manner);
    let is_streamed = out.is_some() && !outputs.on_disk(out);
    // The report sums all energies after every step.
    let has_report = json.is_some() || place.is_some() || outputs.has_summary();
    let attempt = |problem: Problem, is_written: bool, observe: &mut dyn FnMut(&dyn Snapshot)| {
        let problem = problem.with_derivatives(options.derivatives.into()).stop_when(stop.clone());
        let steps = problem.time()?.steps();
        limits::of_simulation(&problem, steps, outputs.on_disk(out), json.is_some())
            .admit(manner)?;
        let mut report = SimulationReport::new(&problem);
        if json.is_none() {
            report = report.without_series();
        }
        let mut film = place.map(|_| Film::new(&problem, steps));
        let begun = out.filter(|_| is_written).map(|out| outputs.begin(out)).transpose()?;
        let mut table = begun.map(|writing| NodeTable::new(writing, problem.nodes()));
        let mut trajectory = Trajectory::unrecorded(&problem)?.check_stability();
        let bar = terminal::progress_bar(manner, steps as u64);
        let mut written = table.as_mut().map_or(Ok(()), NodeTable::header);
        let outcome = trajectory.run(&problem, steps, |simulation| {
            observe(simulation);
            if has_report {
                report.push(&problem, simulation);
            }
            if let Some(film) = &mut film {
                film.push(simulation);
            }
            if let (Some(table), Ok(())) = (&mut table, &written) {
                written = table.push(simulation);
                if outputs.reader_left() && json.is_none() && place.is_none() {
                    // Nobody wants the rest.
                    stop.store(true, Ordering::Relaxed);
                }
            }
            bar.set_position(simulation.work().steps as u64);
        });
        bar.finish_and_clear();
        let record = Recorded { report, film, table, written, trajectory };
        Ok(Attempt { problem, record, outcome })
    };
    let is_checked = check.is_some();
    // What is written to a stream cannot be taken back: its numerics are checked before.
    let is_trial = is_streamed && is_checked;
    let mut last =
        run_checked(problem, check, |problem, observe| attempt(problem, !is_trial, observe))?;
    if is_trial && last.outcome.is_ok() {
        last = attempt(last.problem, true, &mut |_| ())?;
    }
    let Attempt { problem, record, outcome } = last;
    let Recorded { mut report, film, table, written, trajectory } = record;
    if is_checked {
        report.assessed(&problem);
    }
    report.finish(&trajectory, &outcome);
    let outcome = match outcome {
        Err(Error::Interrupted) if outputs.reader_left() => Ok(()),
        outcome => outcome,
    };
    if matches!(outcome, Err(Error::Interrupted)) {
        outputs.are_interrupted();
    }
    let table = table.map_or(Ok(()), |table| outputs.finish(table.into_inner(), written));
    let code = outcome.as_ref().map_or_else(code_of, |()| 0);
    let title = options.scene.display().to_string();
    let summary = outputs.summary(&summary(&problem, &report).of(title.clone()));
    let page = film.map_or(Ok(()), |film| {
        let page = || page::simulation_page(&report, &film, &problem, &title);
        outputs.write(place, || Ok(page().into_bytes()))
    });
    let json = outputs.write_json(json, &report);
    Ok(conclude(code, [table, json, page, summary, outcome]))
}

/// What is kept of a run.
struct Recorded {
    report: SimulationReport,
    film: Option<Film>,
    table: Option<NodeTable<Writing>>,
    /// Whether the table could be written.
    written: std::io::Result<()>,
    trajectory: Trajectory,
}

/// The result as text for a terminal.
fn summary(problem: &Problem, report: &SimulationReport) -> Summary {
    let tone = match (report.status == "completed", report.warnings.is_empty()) {
        (true, true) => Tone::Good,
        (true, false) => Tone::Doubtful,
        (false, _) => Tone::Bad,
    };
    let mut summary = Summary::new(&report.status, tone);
    if let Some([t, x, y, z]) = report.last_tip() {
        summary = summary.fact("Tip", format!("({x:.6}, {y:.6}, {z:.6}) m at t = {t} s"));
    }
    let energy = report.energy_in_words();
    summary = summary
        .fact("Energy", energy.strip_prefix("energy ").unwrap_or(&energy))
        .warnings(&report.warnings);
    if let Some(resolution) = &report.resolution {
        summary = summary.fact("Numerics", resolution.words());
    }
    summary
        .fact("Rod", format!("{} m long", problem.length()))
        .fact(
            "Model",
            format!("{}, {} unknowns: {}", report.model, report.dof, report.model_reason),
        )
        .fact(
            "Cost",
            format!(
                "{} steps, {} Newton iterations, {}",
                report.steps,
                report.newton_iterations,
                duration(report.wall_seconds)
            ),
        )
}

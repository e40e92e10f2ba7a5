//! `rodfit simulate`: the motion of a scene or a structure from t = 0 to the end of `[time]`.
//!
//! Numerics (mesh, step, scheme) that the program chose are in general checked by their error ([`run_checked`]), and
//! the run may be repeated with finer ones. If such a run has its table on a stream (standard output or a device), the
//! check is a run without output before. Output is a summary, and if requested a report (`--json`), the positions of
//! all nodes at every step (`--out`, CSV) and a page with an animation (`--report`). With `--reactions` report and
//! table of one rod also have the forces and moments of the supports, and the forces of contacts. Errors before the
//! run: an invalid scene, no `[time]`, an output that cannot be written, a cost above the limits, and `--reactions`
//! without report and table. An interrupted or failed run writes its results up to that time; the exit code is then
//! that of the error. Structures (scenes with `[[rods]]`) have a function of [`structure`].

use crate::command::output::{OutputWriter, Outputs};
use crate::command::{
    DerivativesOption, GlobalOptions, JsonOption, conclude, exit_code, limits, structure, terminal,
};
use rodfit::accuracy::{Attempt, run_checked};
use rodfit::dynamics::{Film, NodeTable, SimulationReport, Snapshot};
use rodfit::scene::SceneFile;
use rodfit::summary::{Summary, Tone, duration};
use rodfit::{Error, Problem, Trajectory, page};
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Options of `rodfit simulate`.
#[derive(clap::Args)]
pub struct SimulateOptions {
    /// Scene file (TOML).
    pub(super) scene: PathBuf,
    /// Write the position of every node at every step to this file (CSV); `-` is standard output.
    #[arg(long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    #[command(flatten)]
    pub(super) json: JsonOption,
    /// Write a page with animation, energies and tip trajectory (`simulation.html`) into this folder.
    #[arg(long, value_name = "DIR")]
    pub(super) report: Option<PathBuf>,
    /// Add force and moment of both supports at every step to `--json` and `--out`.
    #[arg(long)]
    pub(super) reactions: bool,
    /// Derivatives of the energies in the time stepper.
    #[arg(long, value_enum, default_value = "hand")]
    pub(super) derivatives: DerivativesOption,
}

/// Simulates the scene and writes its outputs; a structure has its own function ([`structure::simulate`]). If the
/// program chose its numerics, the run is checked, and repeated with finer ones where needed. With a table on a stream
/// such a check is a run without output first. If the reader of the table closes the stream, and neither report nor
/// page is requested, the run ends as completed. Returns the exit code: 0, or that of the error that ended the run or
/// of an output. Errors before the run, as of the scene, the limits of cost or the outputs, are returned.
pub fn run(options: &SimulateOptions, global: GlobalOptions) -> Result<u8, Error> {
    let scene = match SceneFile::load(&options.scene)? {
        SceneFile::Rod(scene) => *scene,
        SceneFile::Structure(scene) => return structure::simulate(*scene, options, global),
    };
    let mut outputs = Outputs::new(&options.json, global);
    let out = outputs.add("--out", options.out.as_deref());
    outputs.add_page(options.report.as_deref(), "simulation.html");
    let has_series = outputs.has_json() || out.is_some();
    let allowed = "only together with --json or --out, which contain them";
    if options.reactions && !has_series {
        return Err(Error::invalid("--reactions", "no --json and no --out", allowed));
    }
    outputs.check(&scene.files())?;
    limits::mesh_cost(&scene).admit(global)?;
    let (problem, check) = scene.checked_problem()?;
    let stop = terminal::stop_on_ctrl_c(global);
    let has_report = outputs.has_json() || outputs.has_page();
    let has_energies = has_report || outputs.has_summary();
    // One run with its outputs. The check of chosen numerics may repeat it on a finer mesh.
    let attempt = |problem: Problem, is_written: bool, observe: &mut dyn FnMut(&dyn Snapshot)| {
        let problem = problem.with_derivatives(options.derivatives.into()).stop_when(stop.clone());
        let steps = problem.time()?.steps();
        limits::simulation_cost(&problem, steps, outputs.is_file(out), outputs.has_json())
            .with_reactions(options.reactions && outputs.has_json(), steps)
            .admit(global)?;
        let mut report = SimulationReport::new(&problem);
        if !outputs.has_json() {
            report = report.without_series();
        }
        let mut film = outputs.has_page().then(|| Film::new(&problem, steps));
        let writer = out.filter(|_| is_written).map(|out| outputs.begin(out)).transpose()?;
        let mut table = writer.map(|writer| {
            NodeTable::new(writer, problem.nodes())
                .with_reactions(options.reactions)
                .with_contacts(if options.reactions { problem.scene().contacts.len() } else { 0 })
        });
        let mut trajectory = Trajectory::unrecorded(&problem)?.check_stability();
        if options.reactions {
            trajectory = trajectory.keep_reactions();
        }
        let bar = terminal::progress_bar(global, steps as u64);
        // A failed write does not stop the simulation: the other outputs are complete.
        let mut written = table.as_mut().map_or(Ok(()), NodeTable::header);
        let outcome = trajectory.run(&problem, steps, |simulation| {
            observe(simulation);
            // The energies are summed after every step, which costs time.
            if has_energies {
                report.push(&problem, simulation);
            }
            if let Some(film) = &mut film {
                film.push(simulation);
            }
            if let (Some(table), Ok(())) = (&mut table, &written) {
                written = table.push(simulation);
                // Without a reader of the table or another output the rest of the run has no use.
                if outputs.is_stdout_closed() && !has_report {
                    stop.store(true, Ordering::Relaxed);
                }
            }
            bar.set_position(simulation.work().steps as u64);
        });
        bar.finish_and_clear();
        let record = RunRecord { report, film, table, written, trajectory };
        Ok(Attempt { problem, record, outcome })
    };
    let is_checked = check.is_some();
    // A stream cannot be rewritten: the numerics are checked by a trial run without output before.
    let is_trial = out.is_some() && !outputs.is_file(out) && is_checked;
    let mut last =
        run_checked(problem, check, |problem, observe| attempt(problem, !is_trial, observe))?;
    if is_trial && last.outcome.is_ok() {
        last = attempt(last.problem, true, &mut |_| ())?;
    }
    let Attempt { problem, record, outcome } = last;
    let RunRecord { mut report, film, table, written, trajectory } = record;
    if is_checked {
        report.assessed(&problem);
    }
    report.finish(&trajectory, &outcome);
    // A run that was stopped as nobody reads its table is complete.
    let outcome = match outcome {
        Err(Error::Interrupted) if outputs.is_stdout_closed() => Ok(()),
        outcome => outcome,
    };
    if matches!(outcome, Err(Error::Interrupted)) {
        outputs.set_interrupted();
    }
    let table = table.map_or(Ok(()), |table| outputs.end_pieces(table.into_inner(), written));
    let code = outcome.as_ref().map_or_else(exit_code, |()| 0);
    let title = options.scene.display().to_string();
    let summary = summary(&problem, &report).with_subject(&title);
    let page = || {
        let page = film.as_ref().map(|film| page::simulation_page(&report, film, &problem, &title));
        page.unwrap_or_default()
    };
    let code = outputs.finish(code, &report, Some(&page), &summary);
    Ok(conclude(code, [table, outcome]))
}

/// The results of one run, before they are written.
struct RunRecord {
    pub(super) report: SimulationReport,
    film: Option<Film>,
    table: Option<NodeTable<OutputWriter>>,
    /// Whether the table could be written.
    written: std::io::Result<()>,
    trajectory: Trajectory,
}

/// The result as text for a terminal. Contents: status, last position of the tip, m, with its time, s, a sentence about
/// the change of the energy, and warnings. Then numerics, length of the rod, m, model with its number of unknowns, and
/// counts of work with the time of the run.
fn summary(problem: &Problem, report: &SimulationReport) -> Summary {
    let tone = Tone::of_result(report.status == "completed", !report.warnings.is_empty());
    let mut summary = Summary::new(&report.status, tone);
    if let Some([t, x, y, z]) = report.last_tip() {
        summary = summary.fact("Tip", format!("({x:.6}, {y:.6}, {z:.6}) m at t = {t} s"));
    }
    let energy = report.energy_in_words();
    let cost = format!(
        "{} steps, {} Newton iterations, {}",
        report.steps,
        report.newton_iterations,
        duration(report.wall_seconds)
    );
    summary
        .fact("Energy", energy.strip_prefix("energy ").unwrap_or(&energy))
        .warnings(&report.warnings)
        .naming_warnings()
        .facts("Numerics", report.resolution.iter().map(|resolution| resolution.words()))
        .fact("Rod", format!("{:.6} m long", problem.length()))
        .fact(
            "Model",
            format!("{}, {} unknowns: {}", report.model, report.dof, report.model_reason),
        )
        .fact("Cost", cost)
}

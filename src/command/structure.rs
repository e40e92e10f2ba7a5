//! `rodfit simulate`, `static` and `modes` of structures: scenes with `[[rods]]`.
//!
//! Mesh and step are those of the file, as is the scheme (Newmark-beta by default), and no cost is estimated before a
//! run. Output is a summary, and if requested a report (`--json`), and the positions of all nodes (`--out`, CSV; not
//! for modes), of a simulation at every step. Simulations also have a page with an animation (`--report`). A simulation
//! without `[time]` or with `--reactions` is an error. An interrupted or failed simulation writes its results up to
//! that time, and has the exit code of the error. [`rest`] computes an equilibrium, [`modes`] the lowest modes about it
//! or about the rest shape. The commands for one rod call these functions when the file is a structure.

use crate::command::modes::ModesOptions;
use crate::command::output::Outputs;
use crate::command::rest::StaticOptions;
use crate::command::simulate::SimulateOptions;
use crate::command::{GlobalOptions, conclude, exit_code, terminal};
use rodfit::structure::{StructureFilm, StructureMotion, StructureReport};
use rodfit::{Error, Structure, StructureScene, page};
use std::io::{self, Write};
use std::sync::atomic::Ordering;

/// Simulates a structure up to the end of `[time]`, and writes the report (JSON), the positions of all nodes at every
/// step (CSV), the page and the summary. An interrupted or failed run writes its results up to that time. Returns the
/// exit code: 0, or that of the error that ended the run or of an output. Errors before the run: `--reactions`, an
/// invalid structure, an output that cannot be written, no `[time]`, and those of the initial state.
pub fn simulate(
    scene: StructureScene,
    options: &SimulateOptions,
    global: GlobalOptions,
) -> Result<u8, Error> {
    if options.reactions {
        return Err(Error::invalid("--reactions", "a structure", "only for a scene of one rod"));
    }
    let structure = Structure::new(scene)?;
    structure.check_end()?;
    let mut outputs = Outputs::new(&options.json, global);
    let out = outputs.add("--out", options.out.as_deref());
    outputs.add_page(options.report.as_deref(), "simulation.html");
    outputs.check(&structure.scene().files())?;
    let stop = terminal::stop_on_ctrl_c(global);
    let structure = structure.with_derivatives(options.derivatives.into());
    let time = structure.time()?.clone();
    let mut motion = structure.simulation()?;
    let mut report = StructureReport::new(&structure);
    let mut film = outputs.has_page().then(|| StructureFilm::new(time.steps()));
    let mut table = out.map(|out| outputs.begin(out)).transpose()?;
    let mut written = table.as_mut().map_or(Ok(()), |to| writeln!(to, "time,rod,node,x,y,z"));
    let bar = terminal::progress_bar(global, time.steps() as u64);
    // Positions are needed in a file, and at the end.
    let has_positions = outputs.has_json() || table.is_some();
    let mut push = |motion: &StructureMotion<'_>, written: &mut io::Result<()>| {
        if let Some(film) = &mut film {
            film.push(motion);
        }
        if !has_positions {
            return report.push_energies(motion);
        }
        report.push(motion);
        if let (Some(to), Ok(())) = (&mut table, &written) {
            *written = report.shape.write_rows(motion.time(), to);
        }
    };
    push(&motion, &mut written);
    let mut outcome = Ok(());
    for k in 1..=time.steps() {
        // The flag is read between steps, so that the last complete step remains.
        outcome = match stop.load(Ordering::Relaxed) {
            true => Err(Error::Interrupted),
            false => motion.step_to(time.at(k)),
        };
        if outcome.is_err() {
            break;
        }
        push(&motion, &mut written);
        bar.set_position(k as u64);
    }
    bar.finish_and_clear();
    // The report has the last shape also after a failed step.
    report.shape = motion.shape();
    report.finish(&structure, &outcome);
    if matches!(outcome, Err(Error::Interrupted)) {
        outputs.set_interrupted();
    }
    let table = table.map_or(Ok(()), |table| outputs.end_pieces(table, written));
    let code = outcome.as_ref().map_or_else(exit_code, |()| 0);
    let title = options.scene.display().to_string();
    let summary = report.summary().with_subject(&title);
    let page = || {
        let page =
            film.as_ref().map(|film| page::structure_page(&structure, &report, film, &title));
        page.unwrap_or_default()
    };
    let code = outputs.finish(code, &report, Some(&page), &summary);
    Ok(conclude(code, [table, outcome]))
}

/// Computes the equilibrium of a structure under its loads, and writes the report (JSON), the nodes (CSV) and the
/// summary with its stability and warnings. Returns exit code 0, also for an unstable equilibrium, or that of an output
/// that cannot be written. Errors: an invalid structure, invalid outputs, and those of the search.
pub fn rest(
    scene: StructureScene,
    options: &StaticOptions,
    global: GlobalOptions,
) -> Result<u8, Error> {
    let structure = Structure::new(scene)?;
    let mut outputs = Outputs::new(&options.json, global);
    let out = outputs.add("--out", options.out.as_deref());
    outputs.check(&structure.scene().files())?;
    let mut found = structure.equilibrium()?;
    structure.add_mesh_error(&mut found);
    let table = outputs.write(out, || Ok(found.shape.to_csv().into_bytes()));
    let warnings = structure.equilibrium_warnings(&found);
    let summary = found.summary().warnings(&warnings).naming_warnings();
    let summary = summary.with_subject(options.scene.display());
    Ok(conclude(outputs.finish(0, &found, None, &summary), [table]))
}

/// Computes the `--count` lowest modes of a structure about its equilibrium, or with `--rest` about its rest shape.
/// Writes the report (JSON) and the summary. Returns exit code 0, also for unstable modes, or that of an output that
/// cannot be written. Errors: an invalid structure, invalid outputs, and those of the searches.
pub fn modes(
    scene: StructureScene,
    options: &ModesOptions,
    global: GlobalOptions,
) -> Result<u8, Error> {
    let structure = Structure::new(scene)?;
    let outputs = Outputs::with_json(&options.json, &structure.scene().files(), global)?;
    let count = usize::from(options.count);
    let mut found = structure.modes(count, options.rest)?;
    structure.add_mesh_errors(count, options.rest, &mut found);
    let summary = found.summary().with_subject(options.scene.display());
    Ok(outputs.finish(0, &found, None, &summary))
}

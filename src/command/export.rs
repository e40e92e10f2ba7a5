//! `rodfit export`: a rod as a file for another simulator, or its motion as frames for ParaView.
//!
//! `--to` is the format. A file of MuJoCo, PyElastica, USD or CSV goes to `--out`, by default standard output. Notes on
//! parts that it does not have, or has in another form, are printed on standard error unless `--quiet` is given. `--to
//! vtk` simulates the scene and writes at most `--frames` frames of its motion, and their list, into the folder
//! `--out`. `--segments` replaces the mesh of the scene; an open mesh is that of an equilibrium, for VTK that of the
//! motion. Structures are rejected. The exit code is 0, or that of an output that cannot be written.

use crate::command::output::Outputs;
use crate::command::{GlobalOptions, conclude, limits, terminal};
use clap::ValueEnum;
use rodfit::accuracy::{Calculation, simulate_checked};
use rodfit::export::ExportFormat;
use rodfit::scene::{Scene, SceneFile};
use rodfit::{Error, Trajectory};
use std::path::{Path, PathBuf};

/// Options of `rodfit export`.
#[derive(clap::Args)]
pub struct ExportOptions {
    /// Scene file (TOML), such as one saved by `rodfit fit --save`.
    scene: PathBuf,
    /// Format of the export.
    #[arg(long)]
    to: FormatOption,
    /// Write to this file, for VTK into this folder; `-`, the default, is standard output.
    #[arg(long, value_name = "PATH", default_value = "-")]
    out: PathBuf,
    /// Number of edges in place of that of the scene.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    segments: Option<u32>,
    /// Largest number of frames for VTK.
    #[arg(long, default_value_t = 101, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    frames: u32,
}

/// Format of an export.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FormatOption {
    /// MJCF of MuJoCo 4.
    Mujoco,
    /// Python script for PyElastica 1.
    Pyelastica,
    /// Universal Scene Description (text).
    Usd,
    /// Frames of the motion for ParaView.
    Vtk,
    /// CSV of stiffnesses and mass per length along the rod.
    Csv,
}

/// Writes a scene of one rod in the format of `--to` to `--out`, after its equilibrium mesh was chosen if it is left
/// open; for VTK the frames of its motion. Notes on omitted or changed parts are printed on standard error. A structure
/// is an error. Returns exit code 0, or that of an output that cannot be written.
pub fn run(options: &ExportOptions, global: GlobalOptions) -> Result<u8, Error> {
    let mut scene = match SceneFile::load(&options.scene)? {
        SceneFile::Rod(scene) => *scene,
        SceneFile::Structure(_) => {
            let file = options.scene.display().to_string();
            return Err(Error::invalid(
                "SCENE",
                format!("{file}, a structure"),
                "a scene of one rod",
            ));
        }
    };
    if let Some(segments) = options.segments {
        scene.rod.segments = Some(segments as usize);
    }
    let target = match options.to {
        FormatOption::Mujoco => ExportFormat::Mujoco,
        FormatOption::Pyelastica => ExportFormat::Pyelastica,
        FormatOption::Usd => ExportFormat::Usd,
        FormatOption::Csv => ExportFormat::Table,
        FormatOption::Vtk => return write_frames(&scene, options, global),
    };
    let mut outputs = Outputs::empty(global);
    let out = outputs.add("--out", Some(&options.out));
    outputs.check(&scene.files())?;
    limits::equilibrium_cost(&scene).admit(global)?;
    let export = scene.problem_for(Calculation::Rest)?.export(target)?;
    for note in export.notes.iter().filter(|_| !global.quiet) {
        terminal::print_note(format_args!("note: {note}"));
    }
    let written = outputs.write(out, || Ok(export.text.into_bytes()));
    Ok(conclude(0, [written]))
}

/// Simulates the scene and writes the frames of its motion, at most `--frames`, and their list into the folder of
/// `--out`; `-` is an error. Returns exit code 0, or that of a file that cannot be written.
fn write_frames(
    scene: &Scene,
    options: &ExportOptions,
    global: GlobalOptions,
) -> Result<u8, Error> {
    if options.out == Path::new("-") {
        return Err(Error::invalid("--out", "-", "a folder, for --to vtk"));
    }
    // An unusable folder is an error before the simulation.
    let folder = Some(options.out.as_path());
    let mut first = Outputs::empty(global);
    first.add_in_folder("--out", folder, "rod.pvd");
    first.check(&scene.files())?;
    limits::mesh_cost(scene).admit(global)?;
    let (problem, check) = scene.checked_problem()?;
    let stop = terminal::stop_on_ctrl_c(global);
    let (problem, motion) = simulate_checked(problem, check, |problem| {
        let problem = problem.stop_when(stop.clone());
        limits::simulation_cost(&problem, problem.time()?.steps(), true, false).admit(global)?;
        let nodes: Vec<usize> = (0..problem.nodes()).collect();
        let motion = Trajectory::new(&problem, &nodes, &[])?;
        Ok((problem, motion))
    })?;
    let files = problem.export_motion(&motion, options.frames as usize)?;
    let mut outputs = Outputs::empty(global);
    let places: Vec<_> =
        files.iter().map(|file| outputs.add_in_folder("--out", folder, &file.name)).collect();
    outputs.check(&scene.files())?;
    let written: Vec<_> = files
        .into_iter()
        .zip(places)
        .map(|(file, place)| outputs.write(place, || Ok(file.text.into_bytes())))
        .collect();
    Ok(conclude(0, written))
}

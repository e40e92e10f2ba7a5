//! `rodfit static`: the equilibrium of a scene or a structure under its loads, and its stability.
//!
//! The mesh is that of the scene, whose error is then estimated, or for one rod chosen for the equilibrium if the scene
//! leaves it open. An unstable equilibrium is a result with exit code 0 too; one that is not found is an error. Output
//! is a text, a report (`--json`) and the positions of all nodes (`--out`, CSV) if requested. The exit code is
//! otherwise 0, or that of an output that cannot be written.

use crate::command::output::Outputs;
use crate::command::{GlobalOptions, JsonOption, chosen_mesh, conclude, limits, structure};
use rodfit::Error;
use rodfit::accuracy::Calculation;
use rodfit::dynamics::shape_csv;
use rodfit::scene::SceneFile;
use std::path::PathBuf;

/// Options of `rodfit static`.
#[derive(clap::Args)]
pub struct StaticOptions {
    /// Scene file (TOML); `[time]` is not needed.
    pub(super) scene: PathBuf,
    /// Write the position of every node to this file (CSV); `-` is standard output.
    #[arg(long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    #[command(flatten)]
    pub(super) json: JsonOption,
}

/// Computes the equilibrium of a scene and writes the report and the table of nodes; a structure has its own function.
/// Returns exit code 0, or that of an output that cannot be written. Errors: a scene or an output that cannot be used,
/// a cost above a limit, and a computation that fails.
pub fn run(options: &StaticOptions, global: GlobalOptions) -> Result<u8, Error> {
    let scene = match SceneFile::load(&options.scene)? {
        SceneFile::Rod(scene) => *scene,
        SceneFile::Structure(scene) => return structure::rest(*scene, options, global),
    };
    let mut outputs = Outputs::new(&options.json, global);
    let out = outputs.add("--out", options.out.as_deref());
    outputs.check(&scene.files())?;
    limits::equilibrium_cost(&scene).admit(global)?;
    let problem = scene.problem_for(Calculation::Rest)?;
    let mut found = problem.equilibrium()?;
    found.resolution = chosen_mesh(&problem);
    problem.add_mesh_error(&mut found);
    let table = outputs.write(out, || Ok(shape_csv(&problem, &found.nodes)?.into_bytes()));
    let summary = found.summary().with_subject(options.scene.display());
    Ok(conclude(outputs.finish(0, &found, None, &summary), [table]))
}

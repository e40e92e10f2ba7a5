//! `rodfit modes`: the lowest natural frequencies and mode shapes of a scene or a structure.
//!
//! They are those of small vibrations about the equilibrium under the loads, or about the rest shape (`--rest`), of the
//! slender rod, without shear deformation and rotary inertia. `--count` is their number (10; 1 to 200), for which the
//! mesh of one rod is chosen if the scene leaves it open; the error of a given mesh is estimated. Those of a planar
//! scene are in its plane, and also out of it if one rod has a torsional stiffness and no moments. All unstable modes
//! of one rod are listed too (up to 200 in either plane), with their growth rates; of a structure those among the
//! requested number. Output is a text, and JSON if requested; the exit code is 0 also with unstable modes, or that of
//! an output that cannot be written.

use crate::command::output::Outputs;
use crate::command::{GlobalOptions, JsonOption, chosen_mesh, limits, structure};
use rodfit::Error;
use rodfit::accuracy::Calculation;
use rodfit::scene::SceneFile;
use rodfit::vibration::LinearizationPoint;
use std::path::PathBuf;

/// Options of `rodfit modes`.
#[derive(clap::Args)]
pub struct ModesOptions {
    /// Scene file (TOML); `[time]` is not needed.
    pub(super) scene: PathBuf,
    /// Number of modes.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=200))]
    pub(super) count: u16,
    /// Compute modes about the rest shape instead of the equilibrium under the loads.
    #[arg(long)]
    pub(super) rest: bool,
    #[command(flatten)]
    pub(super) json: JsonOption,
}

/// Computes the modes of a scene on its own mesh or one chosen for their number, and writes the report; a structure has
/// its own function. Returns exit code 0, or that of an output that cannot be written. Errors: a scene or an output
/// that cannot be used, a cost above a limit, and a computation that fails.
pub fn run(options: &ModesOptions, global: GlobalOptions) -> Result<u8, Error> {
    let scene = match SceneFile::load(&options.scene)? {
        SceneFile::Rod(scene) => *scene,
        SceneFile::Structure(scene) => return structure::modes(*scene, options, global),
    };
    let outputs = Outputs::with_json(&options.json, &scene.files(), global)?;
    let count = usize::from(options.count);
    limits::modes_cost(&scene, count).admit(global)?;
    // A rod under large loads vibrates about another shape than its rest shape.
    let about =
        if options.rest { LinearizationPoint::Rest } else { LinearizationPoint::Equilibrium };
    let problem = scene.problem_for(Calculation::Modes(count))?;
    let mut found = problem.modes(count, about)?;
    found.resolution = chosen_mesh(&problem);
    problem.add_mesh_errors(count, &mut found);
    let summary = found.summary().with_subject(options.scene.display());
    Ok(outputs.finish(0, &found, None, &summary))
}

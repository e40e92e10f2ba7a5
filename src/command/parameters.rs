//! `rodfit parameters`: lists the parameters of a scene or a structure with their values and units.
//!
//! A first table has those that can be identified, a second one those that cannot in this scene; the JSON has the
//! reasons, limits and short names. The list is that of the prepared scene ([`ParameterList`]), of one rod on the mesh
//! of a first guess if the scene leaves it open. Output is a text, and JSON if requested; the exit code is 0, or that
//! of an output that cannot be written.

use crate::command::output::Outputs;
use crate::command::{GlobalOptions, JsonOption, limits};
use rodfit::Error;
use rodfit::accuracy::Calculation;
use rodfit::fit::Experiment;
use rodfit::problem::ParameterList;
use rodfit::scene::SceneFile;
use std::path::PathBuf;

/// Options of `rodfit parameters`.
#[derive(clap::Args)]
pub struct ParametersOptions {
    /// Scene file (TOML).
    scene: PathBuf,
    #[command(flatten)]
    json: JsonOption,
}

/// Writes (JSON) and prints the list of the parameters of the scene. Returns exit code 0, or that of an output that
/// cannot be written. Errors: a scene or an output that cannot be used, and a cost above a limit.
pub fn run(options: &ParametersOptions, global: GlobalOptions) -> Result<u8, Error> {
    let problem = match SceneFile::load(&options.scene)? {
        SceneFile::Structure(scene) => Experiment::of_structure("", *scene)?.problem,
        SceneFile::Rod(scene) => {
            limits::check_cost(&scene).admit(global)?;
            scene.problem_for(Calculation::Guess)?
        }
    };
    let outputs = Outputs::with_json(&options.json, &problem.scene().files(), global)?;
    let list = ParameterList::of(&problem);
    let summary = list.summary().with_subject(options.scene.display());
    Ok(outputs.finish(0, &list, None, &summary))
}

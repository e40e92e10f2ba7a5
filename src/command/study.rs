//! `rodfit study`: wall time against error over schemes, time steps and meshes (work-precision study) of a scene.
//!
//! [`Study`] simulates the scene with several schemes, meshes and steps, and compares the tip with an extrapolated
//! reference. A scene without `[time]`, and a study above the limits of cost, are errors. Output is a summary with the
//! fastest run for each of several errors, and if requested a report with all runs (`--json`) and a page with the plot
//! (`--report`).

use crate::command::output::Outputs;
use crate::command::{GlobalOptions, JsonOption, limits, terminal};
use rodfit::study::Study;
use rodfit::{Error, Scene, page};
use std::path::PathBuf;

/// Options of `rodfit study`.
#[derive(clap::Args)]
pub struct StudyOptions {
    /// Scene file (TOML).
    scene: PathBuf,
    #[command(flatten)]
    json: JsonOption,
    /// Write a page with the work-precision plot (`study.html`) into this folder.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

/// Runs the study of the scene with a progress bar, and writes summary, report and page. Returns exit code 0, or that
/// of an output that cannot be written. Errors: an invalid scene, a cost above the limits, and those of the study.
pub fn run(options: &StudyOptions, global: GlobalOptions) -> Result<u8, Error> {
    let name = options.scene.display().to_string();
    let scene = Scene::load(&options.scene)?;
    let mut outputs = Outputs::new(&options.json, global);
    outputs.add_page(options.report.as_deref(), "study.html");
    outputs.check(&scene.files())?;
    limits::study_cost(&scene).admit(global)?;
    // The number of runs is known when the study has begun.
    let bar = terminal::progress_bar(global, 1);
    let study = Study::new(&scene, |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    let study = study?;
    let page = || page::study_page(&study, &name);
    Ok(outputs.finish(0, &study, Some(&page), &study.summary().with_subject(&name)))
}

//! `rodfit study`

use crate::command::output::Outputs;
use crate::command::{Json, Manner, conclude, limits, terminal};
use rodfit::study::Study;
use rodfit::{Error, Scene, page};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Options {
    /// Scene file (TOML).
    scene: PathBuf,
    #[command(flatten)]
    json: Json,
    /// Write a page with the work-precision plot (`study.html`) into this folder.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let name = options.scene.display().to_string();
    let scene = Scene::load(&options.scene)?;
    let mut outputs = Outputs::new(manner);
    let json = outputs.add("--json", options.json.json.as_deref());
    let page = outputs.add_in_folder("--report", options.report.as_deref(), "study.html");
    outputs.check(&scene.files())?;
    limits::of_study(&scene).admit(manner)?;
    let bar = terminal::progress_bar(manner, 1);
    let study = Study::new(&scene, |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    let study = study?;
    let written = [
        outputs.write_json(json, &study),
        outputs.write(page, || Ok(page::study_page(&study, &name).into_bytes())),
        outputs.summary(&study.summary().of(&name)),
    ];
    Ok(conclude(0, written))
}

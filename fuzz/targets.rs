//! What is done with bytes that nobody vouches for: everything that is read, validated and inspected before anything is
//! computed. Any panic, hang or gigabyte of memory is a fault; errors are what should come of most.

use rodfit::fit::{FitFile, Format, Inspection, Recording, RestShape};
use rodfit::problem::ParameterList;
use rodfit::resolution::Aim;
use rodfit::scene::{Shape, Track};
use rodfit::{Observation, Scene};
use std::path::{Path, PathBuf};

/// The targets by name: what is read, in which format.
pub const TARGETS: [(&str, Target); 12] = [
    ("scene", Target::Scene),
    ("fit", Target::Fit),
    ("csv", Target::Markers(Format::Csv)),
    ("motive", Target::Markers(Format::Motive)),
    ("vicon", Target::Markers(Format::Vicon)),
    ("tracker", Target::Markers(Format::Tracker)),
    ("deeplabcut", Target::Markers(Format::DeepLabCut)),
    ("dltdv", Target::Markers(Format::Dltdv)),
    ("qualisys", Target::Markers(Format::Qualisys)),
    ("kinovea", Target::Markers(Format::Kinovea)),
    ("sleap", Target::Markers(Format::Sleap)),
    ("trackmate", Target::Markers(Format::TrackMate)),
];

/// A kind of file.
#[derive(Clone, Copy)]
pub enum Target {
    Scene,
    Fit,
    Markers(Format),
}

/// Nodes above which the command asks first whether the memory is there.
const MOST_NODES: usize = 5000;

impl Target {
    /// Reads a file of this kind; true if it was accepted. Its text may name other files in `folder`, and `place` is where
    /// it may be written to be read.
    pub fn take(self, bytes: &[u8], folder: &Path, place: &Path) -> bool {
        match (self, std::str::from_utf8(bytes)) {
            (Self::Markers(format), _) => {
                std::fs::write(place, bytes).expect("the place can be written");
                markers(place, format)
            }
            (_, Err(_)) => false,
            (Self::Scene, Ok(text)) => scene(text, folder),
            (Self::Fit, Ok(text)) => FitFile::from_toml(text, folder).is_ok(),
        }
    }
}

fn scene(text: &str, folder: &Path) -> bool {
    let Ok(scene) = Scene::from_toml(text, folder) else { return false };
    let nodes = match &scene.rod.shape {
        Shape::Polyline { points, .. } => scene.rod.segments.unwrap_or(points.len()),
        _ => scene.rod.segments.unwrap_or(0),
    };
    if nodes > MOST_NODES {
        return true;
    }
    // What is left open is guessed, and not found by simulations.
    let Ok(problem) = scene.problem_for(Aim::Guess) else { return false };
    let _ = (ParameterList::of(&problem), problem.warnings());
    // What is written is read again.
    let written = scene.to_toml().expect("a scene that was read can be written");
    if let Err(error) = Scene::from_toml(&written, folder) {
        panic!("{written}\nof\n{text}\n{error}");
    }
    true
}

fn markers(path: &Path, format: Format) -> bool {
    let table = format == Format::Csv;
    let read = table
        && (Observation::read(path).is_ok()
            | RestShape::read(path).is_ok()
            | Track::read(path).is_ok()
            | Track::read_one(path).is_ok());
    let recording = Recording { format: Some(format), ..Recording::default() };
    let Ok(inspection) = Inspection::of(path, &recording) else { return read };
    assert!(!inspection.observation.is_empty() && !inspection.to_string().is_empty());
    // As it was found to be read, with what the file does not say.
    let frames = inspection.clock_unit == "frames" && inspection.rate.is_none();
    let unnamed = ["px", "unnamed"].contains(&&inspection.unit[..]);
    let said = Recording {
        fps: frames.then_some(100.0),
        scale: unnamed.then_some(1e-3),
        ..inspection.recording
    };
    if let Ok(seen) = Observation::read_as(path, &said) {
        let finite = |x: &Option<f64>| x.is_none_or(f64::is_finite);
        assert!(seen.samples.iter().all(|s| s.time.is_finite() && s.position.iter().all(finite)));
    }
    let _ = Track::read_as(path, &said, &[]);
    true
}

/// The files that a target begins with.
pub fn corpus(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [root.join("fuzz/corpus"), root.join("corpus")];
    let read = |folder: &PathBuf| std::fs::read_dir(folder.join(target)).ok();
    let found = folders.iter().find_map(read).expect("every target has a corpus");
    let mut files: Vec<_> = found
        .map(|entry| entry.expect("a folder can be listed").path())
        .map(|path| (path.clone(), std::fs::read(path).expect("a file of the corpus is there")))
        .collect();
    files.sort();
    files
}

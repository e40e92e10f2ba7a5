//! Checks of recordings that move ends of structures: plane, duration, steps and defects, as for a single rod.

use crate::scenes::{rubber_rod, support};
use rodfit::fit::{Experiment, Sample};
use rodfit::scene::structure::StructureSupport;
use rodfit::scene::structure_point::StructurePoint;
use rodfit::scene::{StructureRecording, Support, Track};
use rodfit::structure::StructureReport;
use rodfit::{Fit, Observation, Parameter, Structure, StructureScene, Unknown};
use std::f64::consts::TAU;

/// Length of an edge of the rod, m: the distance of its two markers.
const EDGE: f64 = 0.15 / 8.0;
/// Time between two frames, s.
const FRAME: f64 = 0.01;

/// Recording of both markers of a straight rod along x for `frames` intervals. They move by 20 mm at 3 Hz in this
/// direction.
fn track(frames: usize, direction: [f64; 3]) -> Track {
    let times: Vec<f64> = (0..=frames).map(|k| FRAME * k as f64).collect();
    let marker = |j: usize| {
        let at = |t: &f64| {
            let way = 0.02 * (TAU * 3.0 * t).sin();
            let [x, y, z] = direction.map(|part| way * part);
            Some([EDGE * j as f64 + x, y, z])
        };
        (format!("m{j}"), times.iter().map(at).collect())
    };
    Track::new(times.clone(), vec![marker(0), marker(1)]).unwrap()
}

/// A rod along x in the xy plane whose start follows the recording, simulated up to `end` with this step, s.
fn scene(dimension: &str, track: Track, end: f64, step: f64) -> StructureScene {
    let text = [
        format!("dimension = \"{dimension}\"\n"),
        rubber_rod("a", "[1, 0, 0]"),
        "[[materials]]\nname = \"rubber\"\ndensity = 1100\nyoungs_modulus = 1e7\npoisson_ratio = 0.4\n"
            .into(),
        support("a.start", "pinned"),
        "[loads]\ngravity = [0, -9.81, 0]\n".into(),
        format!("[time]\nend = {end}\nstep = {step}\nscheme = \"generalised-alpha\"\n"),
    ];
    let mut scene = StructureScene::from_toml(&text.concat(), ".").unwrap();
    let own = &mut scene.supports[0];
    let markers = vec!["m0".into(), "m1".into()];
    *own = StructureSupport { kind: Support::Recorded, markers, ..own.clone() };
    scene.recording = Some(StructureRecording::of(track));
    scene
}

/// The text of the error of an operation.
fn error<T>(result: Result<T, rodfit::Error>) -> String {
    result.map(drop).unwrap_err().to_string()
}

#[test]
fn recorded_motion_out_of_the_plane_gives_a_spatial_model() {
    for (direction, is_spatial) in [([0.0, 1.0, 0.0], false), ([0.0, 0.0, 1.0], true)] {
        let structure = Structure::new(scene("auto", track(50, direction), 0.4, 1e-3)).unwrap();
        assert_eq!(structure.at_rest().assembly.is_spatial(), is_spatial, "{direction:?}");
    }
    let message = error(Structure::new(scene("planar", track(50, [0.0, 0.0, 1.0]), 0.4, 1e-3)));
    assert!(
        message.contains("recording.file") && message.contains("out of the plane"),
        "{message}"
    );
}

#[test]
fn simulation_beyond_the_end_of_the_recording_is_rejected() {
    let structure = Structure::new(scene("auto", track(50, [0.0, 1.0, 0.0]), 0.9, 1e-3)).unwrap();
    let message = error(structure.check_end());
    assert!(message.contains("time.end") && message.contains("up to 0.5 s"), "{message}");
}

#[test]
fn step_that_does_not_resolve_the_recording_is_rejected_or_warned_of() {
    let of_step =
        |step: f64| Structure::new(scene("auto", track(200, [0.0, 1.0, 0.0]), 2.0, step)).unwrap();
    let message = error(of_step(0.5).simulation());
    assert!(
        message.contains("recording.file") && message.contains("steps per period"),
        "{message}"
    );
    for (step, is_warned) in [(0.05, true), (1e-3, false)] {
        let structure = of_step(step);
        let mut report = StructureReport::new(&structure);
        report.finish(&structure, &Ok(()));
        let is_found = report.warnings.iter().any(|text| text.ends_with("[step-too-large]"));
        assert_eq!(is_found, is_warned, "{:?}", report.warnings);
    }
}

#[test]
fn missing_frames_and_jumps_of_the_recording_are_warned_of() {
    let whole = track(50, [0.0, 0.1, 0.0]);
    let [mut jumping, mut missing] = [0, 1].map(|j| whole.markers()[j].seen.clone());
    jumping[40..].iter_mut().flatten().for_each(|place| place[1] += 8e-3);
    missing[10..30].fill(None);
    let markers = vec![("m0".into(), jumping), ("m1".into(), missing)];
    let damaged = Track::new(whole.times().to_vec(), markers).unwrap();
    let structure = Structure::new(scene("auto", damaged, 0.4, 1e-3)).unwrap();
    let mut report = StructureReport::new(&structure);
    report.finish(&structure, &Ok(()));
    for code in ["[missing-frames]", "[recording-jumps]"] {
        let mut texts = report.warnings.iter();
        assert!(texts.any(|text| text.ends_with(code)), "{code}: {:?}", report.warnings);
    }
}

#[test]
fn fit_between_recorded_ends_warns_of_missing_frames() {
    let whole = track(50, [0.0, 0.1, 0.0]);
    let [complete, mut missing] = [0, 1].map(|j| whole.markers()[j].seen.clone());
    missing[10..30].fill(None);
    let markers = vec![("m0".into(), complete), ("m1".into(), missing)];
    let damaged = Track::new(whole.times().to_vec(), markers).unwrap();
    let scene = scene("planar", damaged, 0.4, 2e-3);
    let structure = Structure::new(scene.clone()).unwrap();
    let mut motion = structure.simulation().unwrap();
    let mut samples = Vec::new();
    for k in 1..=200 {
        motion.step_to(2e-3 * f64::from(k)).unwrap();
        if k % 5 == 0 {
            let [x, y, _] = motion.position(&StructurePoint::tip("a")).unwrap();
            samples.push(Sample { time: motion.time(), position: [Some(x), Some(y), None] });
        }
    }
    let observed = Observation::new(samples).of_structure(StructurePoint::tip("a")).sigma(1e-3);
    let experiment = Experiment::of_structure("", scene).unwrap().observe(observed);
    let modulus: Parameter = "materials.rubber.youngs_modulus".parse().unwrap();
    let report = Fit::of([experiment]).identify(Unknown::new(modulus).start(9e6)).solve().unwrap();
    let mut texts = report.warnings.iter();
    assert!(texts.any(|text| text.contains("[missing-frames]")), "{:?}", report.warnings);
}

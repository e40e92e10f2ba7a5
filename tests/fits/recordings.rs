//! Fits to recordings of cables between two hands.

use rodfit::fit::{Experiment, Glitches, Loss, Measurement};
use rodfit::scene::{LostFrames, Track};
use rodfit::{Fit, FitReport, Observation, Parameter, Problem, Scene, Unknown};

use crate::common::fits::{covers, same_mesh};
use crate::common::recordings::{MODULUS, cable, recorded};

/// Of the cameras, m. The start is known to that, too, which pushes the whole of a recording.
const SIGMA: f64 = 1e-5;
const BOTH: [Parameter; 2] = [Parameter::YoungsModulus, Parameter::DampingStiffness];

fn problem(track: &Track) -> Problem {
    cable(track.clone()).problem().unwrap()
}

/// All free markers of a recording, every fifth frame.
fn experiment(name: &str, problem: &Problem) -> Experiment {
    let free = Observation::of_free_markers(problem, 5, Glitches::Keep).unwrap();
    let observe = |e: Experiment, o: Observation| e.observe(o.sigma(SIGMA).loss(Loss::SoftL1));
    free.into_iter().fold(Experiment::new(name, problem), observe)
}

/// Six recordings, a seventh held out; unknowns start at `starts` if there are any.
fn fit(starts: Option<[f64; 2]>) -> FitReport {
    let tracks: Vec<Track> = (0..7).map(|seed| recorded(seed, 120, SIGMA, |_| {})).collect();
    let mut experiments: Vec<Experiment> = tracks
        .iter()
        .enumerate()
        .map(|(k, track)| experiment(&format!("clip {k}"), &problem(track)))
        .collect();
    experiments[6] = experiments[6].clone().held_out();
    let fit = Fit::of(experiments).analyse(same_mesh());
    let unknown = |k: usize| match starts {
        Some(starts) => Unknown::new(BOTH[k]).start(starts[k]),
        None => Unknown::new(BOTH[k]),
    };
    fit.identify(unknown(0)).identify(unknown(1)).solve().unwrap()
}

/// What the data were made with is found; the start that was given is where the search begins, and
/// without one the modulus is scanned, alone.
#[test]
fn a_cable_is_found_between_two_hands() {
    for (starts, scanned) in [(Some([3e8, 0.05]), false), (None, true)] {
        let report = fit(starts);
        println!("{report}");
        assert!(report.is_success(), "{report}");
        for (parameter, truth) in BOTH.into_iter().zip([MODULUS, 0.02]) {
            assert!(covers(&report, parameter, truth), "{parameter}: {report}");
        }
        assert_eq!(report.basins.words.contains("scan of 31 points"), scanned, "{report}");
        assert_eq!(report.basins.words.contains("from the start given"), !scanned, "{report}");
        // Little more than the noise: its mean size is 0.8 sigma, and held markers and z have none.
        let recordings = report.recordings.as_ref().unwrap();
        let (fitted, held_out) =
            (recordings.fitted.as_ref().unwrap(), recordings.held_out.as_ref().unwrap());
        assert_eq!((fitted.experiments, held_out.experiments), (6, 1));
        for error in recordings.list.iter().map(|e| e.mean_error.unwrap()) {
            assert!((0.2..1.5).contains(&(error / SIGMA)), "{report}");
        }
        assert!(fitted.worst >= fitted.median && held_out.worst == held_out.mean);
        // One line for the markers of a recording.
        assert_eq!((report.predictions.len(), report.losses.len()), (1, 6));
        assert_eq!(report.predictions[0].observation, "clip 6: the markers");
    }
}

/// However many threads there are, the numbers are the same to the last bit.
#[test]
fn threads_do_not_change_numbers() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut report = pool.install(|| fit(Some([3e8, 0.05])));
        report.wall_seconds = 0.0;
        report
    };
    let alone = on(1);
    assert_eq!(alone, on(3));
}

/// A recording without some of its frames is told, and fits where its clock goes on in true time.
#[test]
fn lost_frames_are_told_and_mended() {
    let whole = recorded(9, 150, 1e-6, |_| {});
    let kept: Vec<usize> = (0..150).filter(|k| !(60..66).contains(k)).collect();
    let times = whole.times()[..kept.len()].to_vec();
    let seen = |m: &rodfit::scene::track::Marker| {
        (m.name.clone(), kept.iter().map(|k| m.seen[*k]).collect::<Vec<_>>())
    };
    let lost = Track::new(times, whole.markers().iter().map(seen).collect()).unwrap();
    assert!(problem(&whole).warnings().is_empty());
    let off = |how: LostFrames| {
        let mut scene: Scene = cable(lost.clone());
        scene.supports.path.as_mut().unwrap().lost_frames = how;
        scene.time.as_mut().unwrap().end = rodfit::scene::Time::TO_THE_END;
        let problem = scene.problem().unwrap();
        let words = problem.warnings().join("\n");
        assert!(words.contains("6 frames were lost after t = 0.5900 s"), "{words}");
        let end = problem.time().unwrap().end;
        let report = Fit::of([experiment("clip", &problem)])
            .analyse(same_mesh())
            .identify(Unknown::new(Parameter::YoungsModulus).start(4e8))
            .solve()
            .unwrap();
        assert!(report.warnings.iter().any(|w| w.contains("6 frames were lost")), "{report}");
        (end, report.recordings.unwrap().fitted.unwrap().mean)
    };
    let ((short, kept), (long, mended)) = (off(LostFrames::Keep), off(LostFrames::Stretch));
    println!("mean error {kept:.1e} m kept, {mended:.1e} m stretched");
    assert!((short - 1.43).abs() < 1e-9 && (long - 1.49).abs() < 1e-9, "{short} {long}");
    assert!(mended < 0.7 * kept, "{mended:e} {kept:e}");
}

/// Frames in which a marker jumps are left out where that is asked for.
#[test]
fn glitches_are_masked() {
    let clean = recorded(5, 60, 1e-5, |_| {});
    let mut markers: Vec<_> =
        clean.markers().iter().map(|m| (m.name.clone(), m.seen.clone())).collect();
    if let Some(place) = &mut markers[3].1[30] {
        place[1] += 0.03;
    }
    let problem = problem(&Track::new(clean.times().to_vec(), markers).unwrap());
    let values = |glitches| -> Vec<usize> {
        let free = Observation::of_free_markers(&problem, 1, glitches).unwrap();
        free.iter().map(|o| o.samples.len()).collect()
    };
    assert_eq!(values(Glitches::Keep), [58, 58, 58]);
    // Three frames jump, and two on each side are spoiled.
    assert_eq!(values(Glitches::Mask), [58, 51, 58]);
    assert!(problem.warnings().join("").contains("marker 3 jumps"), "{:?}", problem.warnings());
    let measured = experiment("", &problem).measurements;
    assert!(measured.iter().all(|m| matches!(m, Measurement::Motion(o) if !o.held_out)));
}

/// A model that dissipates too much otherwise wants drag below zero: there is none, and the report says
/// how much there may be at most.
#[test]
fn drag_that_wants_to_be_negative_is_zero() {
    let clip = |seed: u64| {
        let track = recorded(seed, 120, SIGMA, |scene| scene.loads.damping.mass = 0.0);
        let mut scene = cable(track);
        scene.loads.damping.stiffness = 0.016;
        experiment(&format!("clip {seed}"), &scene.problem().unwrap())
    };
    let report = Fit::of((0..3).map(clip))
        .analyse(same_mesh())
        .identify(Unknown::new(Parameter::YoungsModulus).start(4e8))
        .identify(Unknown::new(Parameter::DampingMass).start(0.3))
        .solve()
        .unwrap();
    let drag = &report.parameters[1];
    assert_eq!(drag.value, Some(0.0), "{report}");
    assert!(drag.upper95.unwrap() < 0.4 && report.not_identifiable.is_empty(), "{report}");
}

//! Fits to recordings of cables between two grippers: parameters, faults of recordings, and plots.

use rodfit::fit::{Experiment, Glitches, Loss};
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

/// The true parameters are identified from a given start, and without one by a scan of the modulus alone.
#[test]
fn cable_between_two_grippers_is_identified() {
    for (starts, scanned) in [(Some([3e8, 0.05]), false), (None, true)] {
        let report = fit(starts);
        println!("{report}");
        assert!(report.is_success(), "{report}");
        for (parameter, truth) in BOTH.into_iter().zip([MODULUS, 0.02]) {
            assert!(covers(&report, parameter, truth), "{parameter}: {report}");
        }
        assert_eq!(report.local_minima.summary.contains("31 points scanned"), scanned, "{report}");
        assert_eq!(
            report.local_minima.summary.contains("from the start given"),
            !scanned,
            "{report}"
        );
        // Little more than the noise: its mean size is 0.8 sigma, and held markers and z have none.
        let recordings = report.recordings.as_ref().unwrap();
        let (fitted, held_out) =
            (recordings.fitted.as_ref().unwrap(), recordings.held_out.as_ref().unwrap());
        assert_eq!((fitted.experiments, held_out.experiments), (6, 1));
        for error in recordings.list.iter().map(|e| e.mean_error.unwrap()) {
            // The mean absolute error of normal noise is 0.8 sigma; prescribed markers have less.
            assert!((0.2..1.5).contains(&(error / SIGMA)), "{report}");
        }
        assert!(fitted.worst >= fitted.median && held_out.worst == held_out.mean);
        // One line for the markers of a recording.
        assert_eq!((report.predictions.len(), report.losses.len()), (1, 6));
        assert_eq!(report.predictions[0].observation, "clip 6: the markers");
    }
}

/// A prior much more precise than the recording decides. Leverage weights are those of measured values, not of priors.
#[test]
fn precise_prior_decides_beside_leverage_weights() {
    let (mean, sigma) = (1.02 * MODULUS, 1e-7 * MODULUS);
    let recording = problem(&recorded(0, 120, SIGMA, |_| {}));
    let modulus = Unknown::new(Parameter::YoungsModulus).prior(mean, sigma);
    let fit = Fit::of(vec![experiment("clip", &recording)]).analyse(same_mesh());
    let report = fit.identify(modulus).solve().unwrap();
    let found = &report.parameters[0];
    assert!((found.value.unwrap() - mean).abs() < sigma, "{report}");
    assert!((found.std_error.unwrap() / sigma - 1.0).abs() < 0.01, "{report}");
}

/// A ring prescribes a marker between the grippers. The two free markers are compared and give the modulus.
#[test]
fn cable_between_two_grippers_and_a_ring_is_identified() {
    let ring = |scene: &mut Scene| {
        let path = scene.supports.path.as_mut().unwrap();
        path.inner = vec!["4".into()];
    };
    let experiments = (0..6).map(|seed| {
        let mut scene = cable(recorded(seed, 120, SIGMA, ring));
        ring(&mut scene);
        let problem = scene.problem().unwrap();
        let free = Observation::of_free_markers(&problem, 5, Glitches::Keep).unwrap();
        assert_eq!(free.len(), 2);
        experiment(&format!("clip {seed}"), &problem)
    });
    let fit = Fit::of(experiments.collect::<Vec<_>>()).analyse(same_mesh());
    let start = |k: usize| Unknown::new(BOTH[k]).start([3e8, 0.05][k]);
    let report = fit.identify(start(0)).identify(start(1)).solve().unwrap();
    println!("{report}");
    assert!(report.is_success(), "{report}");
    for (parameter, truth) in BOTH.into_iter().zip([MODULUS, 0.02]) {
        assert!(covers(&report, parameter, truth), "{parameter}: {report}");
    }
}

/// All results are the same to the last bit for any number of threads.
#[test]
fn number_of_threads_does_not_change_results() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut report = pool.install(|| fit(Some([3e8, 0.05])));
        report.wall_seconds = 0.0;
        report
    };
    let alone = on(1);
    assert_eq!(alone, on(3));
}

/// Lost frames of a recording are reported; the fit is right with the corrected clock.
#[test]
fn lost_frames_are_reported_and_mended() {
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
    // 144 kept frames at 100 per second end at 1.43 s; with the 6 lost frames the last of 150 is at 1.49 s.
    assert!((short - 1.43).abs() < 1e-9 && (long - 1.49).abs() < 1e-9, "{short} {long}");
    // A lower bound of the improvement by the corrected clock.
    assert!(mended < 0.7 * kept, "{mended:e} {kept:e}");
}

/// `glitches = "mask"` leaves out the frames in which a marker jumps.
#[test]
fn frames_with_glitches_are_masked() {
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
    assert!(measured.iter().all(|m| m.motion().is_some() && !m.held_out()));
}

/// A model with too much other dissipation has its minimum at a negative drag. The estimate is zero, with an upper
/// bound.
#[test]
fn negative_drag_is_estimated_as_zero() {
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
    // The bound is finite: the data exclude a drag of 0.4 1/s.
    assert!(drag.upper95.unwrap() < 0.4 && report.not_identifiable.is_empty(), "{report}");
}

/// Distances between a recording and the rod driven by it, with the modulus `e`: marker by marker and frame by
/// frame after the first two.
fn errors(track: &Track, e: f64) -> Vec<Vec<f64>> {
    let problem = problem(track).with([(Parameter::YoungsModulus, e)]).unwrap();
    let run = problem.simulate().unwrap();
    let off = |m: &rodfit::scene::track::Marker, j: usize, k: usize| {
        let (seen, place) = (m.seen[k].unwrap(), run.node(j, k));
        (0..3).map(|c| (place[c] - seen[c]).abs()).sum::<f64>() / 3.0
    };
    let frames = 2..track.times().len();
    let of = |(j, m)| frames.clone().map(|k| off(m, j, k)).collect();
    track.markers().iter().enumerate().map(of).collect()
}

/// Mean and count of numbers.
fn mean(all: impl Iterator<Item = f64>) -> (f64, usize) {
    let (sum, count) = all.fold((0.0, 0), |(sum, count), x| (sum + x, count + 1));
    (sum / count as f64, count)
}

/// The plots of recordings equal simulations by the test: windows that start anew, ranges of
/// speed, and the rod with its markers at a dozen moments.
#[test]
fn recording_plots_equal_simulations() {
    // Cameras that see worse than the model is, so that errors differ from window to window.
    let (first, other) = (recorded(3, 120, 1e-3, |_| {}), recorded(4, 120, 1e-3, |_| {}));
    let fit =
        Fit::of([experiment("a", &problem(&first)), experiment("b", &problem(&other)).held_out()]);
    let unknown = Unknown::new(Parameter::YoungsModulus).start(4e8);
    let report = fit.analyse(same_mesh()).identify(unknown).keep_plot_data().solve().unwrap();
    let e = report.parameters[0].value.unwrap();
    let plots = report.plot_data.as_ref().unwrap().recordings.as_ref().unwrap();
    let lengths: Vec<f64> = plots.windows.iter().map(|w| w.length).collect();
    // Window lengths below the length of the recordings.
    assert_eq!(lengths, [0.1, 0.25, 0.5, 1.0]);
    // Two windows of half a second in 1.19 s, and as many tenths as are computed of one recording.
    let cut = |track: &Track, from: usize, frames: usize| {
        let times = (0..frames).map(|k| track.times()[k]).collect();
        let seen = |m: &rodfit::scene::track::Marker| {
            (m.name.clone(), m.seen[from..from + frames].to_vec())
        };
        Track::new(times, track.markers().iter().map(seen).collect()).unwrap()
    };
    let own = |track: &Track, from| mean(errors(&cut(track, from, 51), e).into_iter().flatten()).0;
    for (track, found) in [(&first, plots.windows[2].fitted), (&other, plots.windows[2].held_out)] {
        let (found, expected) = (found.unwrap(), 0.5 * (own(track, 0) + own(track, 69)));
        assert_eq!(found.count, 2);
        // The same windows, simulated by the test.
        assert!((found.mean / expected - 1.0).abs() < 1e-6, "{found:?} {expected:e}");
    }
    assert_eq!(plots.windows[0].fitted.unwrap().count, 8);
    assert!(plots.windows.iter().all(|w| w.failed == 0));
    // Three free markers in all frames that have one on each side.
    let all = errors(&other, e);
    let (expected, count) = mean(all[2..5].iter().flat_map(|m| m[..m.len() - 1].to_vec()));
    let held_out: Vec<_> = plots.speeds.iter().filter_map(|s| s.held_out).collect();
    let sum: f64 = held_out.iter().map(|m| m.mean * m.count as f64).sum();
    assert_eq!((count, held_out.iter().map(|m| m.count).sum::<usize>()), (3 * 117, 3 * 117));
    // The same errors, averaged by the test.
    assert!((sum / count as f64 / expected - 1.0).abs() < 1e-9);
    assert!(plots.speeds.windows(2).all(|s| s[0].speed[1] == s[1].speed[0]), "{:?}", plots.speeds);
    // A plausible number of ranges of speed.
    assert!((4..=10).contains(&plots.speeds.len()), "{:?}", plots.speeds);
    // The moments.
    let motion = &plots.motions[1];
    assert_eq!((motion.experiment.as_str(), motion.held_out), ("b", true));
    assert_eq!(motion.mean_error, report.recordings.unwrap().list[1].mean_error.unwrap());
    assert_eq!(motion.snapshots.len(), 12);
    let run = problem(&other).with([(Parameter::YoungsModulus, e)]).unwrap().simulate().unwrap();
    for moment in &motion.snapshots {
        let k = (moment.time / 0.01).round() as usize;
        let (error, _) = mean((0..7).map(|j| all[j][k - 2]));
        // The mean error of that frame, computed by the test.
        assert!((moment.error / error - 1.0).abs() < 1e-9, "{} {error}", moment.error);
        for (j, seen) in moment.markers.iter().enumerate() {
            assert_eq!(*seen, other.markers()[j].seen[k]);
            let place = run.node(j, k);
            // The same simulation.
            assert!((0..3).all(|c| (place[c] - moment.nodes[j][c]).abs() < 1e-12));
        }
    }
    let (first, last) = (motion.snapshots[0].time, motion.snapshots[11].time);
    // Snapshots from frame 2, the first simulated one, to frame 119.
    assert!((first - 0.02).abs() < 1e-9 && (last - 1.19).abs() < 1e-9, "{first} {last}");
}

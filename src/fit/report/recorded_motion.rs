//! Comparison of simulations with the recordings that prescribe the ends, for [plots](super::PlotData).
//!
//! Input: experiments with recorded ends, at a point of the unknowns. Each is simulated from its first frames
//! ([`START_FRAMES`]) on, without further data of the free markers, which prescribe nothing (free run). The runs are
//! over the whole recording, and in at most [`WINDOWS`] windows of each of the [`DURATIONS`]. An error is the mean of
//! the three absolute coordinate differences of a marker, m. Output: [`RecordingPlots`] with the mean error by duration
//! of the free run and by speed of the free markers, and the simulated and recorded rod at [`SNAPSHOTS`] times. Fitted
//! and validation recordings are separate. Recordings that cannot be simulated are left out; `None` if none remains.

use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::Search;
use crate::fit::uncertainty::discrepancy::free_run::{
    FreeRun, MarkerError, START_FRAMES, driven_experiments,
};
use crate::problem::Problem;
use crate::scene::track::Marker;
use crate::scene::{Point, Track};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Largest number of nodes times steps of which all positions are recorded, for the memory. In longer simulations only
/// those of nodes with markers are.
const MOST_POSITIONS: usize = 2_000_000;
/// Number of snapshots of a recording, evenly spaced in time.
const SNAPSHOTS: usize = 12;
/// Durations of free runs, s, for which errors are reported, up to that of the recording.
const DURATIONS: [f64; 9] = [0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 25.0, 50.0];
/// Tolerance within which a duration is that of the whole recording, as a fraction.
const DURATION_TOLERANCE: f64 = 0.02;
/// Largest number of windows of one duration in a recording. Each costs a simulation.
const WINDOWS: usize = 8;
/// Approximate number of ranges of speeds.
const SPEED_RANGES: f64 = 8.0;
/// Fraction of all samples that are slower than the start of the open last range.
const SLOWER: f64 = 0.99;

/// Comparison of simulations with recordings that drive the ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RecordingPlots {
    /// Mean error by duration of the free run, over all markers.
    pub windows: Vec<WindowError>,
    /// Mean error of the free markers by speed, over whole recordings.
    pub speeds: Vec<SpeedError>,
    /// Simulated and recorded motion of each recording.
    pub motions: Vec<RecordedMotion>,
}

/// Mean error with its number of values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct MeanError {
    /// Mean distance per coordinate between simulation and recording, m.
    pub mean: f64,
    /// Number of windows, or of markers times frames.
    pub count: usize,
}

/// Mean error of free runs of one duration. Each starts from two frames of a recording; at most
/// eight windows per recording, without overlap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct WindowError {
    /// Duration of the windows, s.
    pub length: f64,
    /// Error over the fitted recordings.
    pub fitted: Option<MeanError>,
    /// Error over the validation recordings.
    pub held_out: Option<MeanError>,
    /// Number of windows whose simulation failed.
    pub failed: usize,
}

/// Mean error of markers in a range of speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SpeedError {
    /// Smallest and largest speed, m/s.
    pub speed: [f64; 2],
    /// Error over the fitted recordings.
    pub fitted: Option<MeanError>,
    /// Error over the validation recordings.
    pub held_out: Option<MeanError>,
}

/// Simulation and recording at a dozen evenly spaced times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RecordedMotion {
    /// Name of the experiment; empty if there is only one.
    pub experiment: String,
    /// Whether the recording is validation data.
    pub held_out: bool,
    /// Mean distance per coordinate between simulation and recording over the whole recording, m.
    pub mean_error: f64,
    /// Shapes at these times.
    pub snapshots: Vec<RecordedSnapshot>,
}

/// Rod and markers at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RecordedSnapshot {
    /// Time of the motion, s.
    pub time: f64,
    /// Simulated positions of the nodes, m; for long runs on fine meshes only of the nodes with
    /// markers.
    pub nodes: Vec<[f64; 3]>,
    /// Recorded position of each marker, m; null where it is missing.
    pub markers: Vec<Option<[f64; 3]>>,
    /// Mean distance per coordinate between simulation and recording, m.
    pub error: f64,
}

/// Comparison of one recording: its motion, its free runs in windows, and the errors of its free markers.
struct RecordingComparison {
    motion: RecordedMotion,
    windows: Vec<FreeRunWindow>,
    speeds: Vec<SampleError>,
}

/// The result of a free run in one window of a recording.
struct FreeRunWindow {
    /// Duration, s.
    duration: f64,
    /// Mean error, m; none if the simulation failed.
    error: Option<f64>,
}

/// Speed and error of a free marker in one frame.
struct SampleError {
    /// Recorded speed, m/s.
    speed: f64,
    /// Distance per coordinate between simulation and recording, m.
    error: f64,
}

/// The comparison with recordings of all experiments with a measured motion and `supports.path`, at `x`, the unknowns
/// on their scales; on several threads. It has the mean errors by duration of free runs and by speed of free markers,
/// and simulated and recorded positions. Experiments that cannot be simulated are left out, as the report has their
/// errors. `None` if none remains.
pub(crate) fn recording_plots(
    experiments: &[Experiment],
    search: &Search,
    x: &[f64],
) -> Option<RecordingPlots> {
    let compare = |experiment: &&Experiment| compare_recording(experiment, search, x).ok();
    let all: Vec<RecordingComparison> =
        driven_experiments(experiments).par_iter().filter_map(compare).collect();
    if all.is_empty() {
        return None;
    }
    let (windows, speeds) = (window_errors(&all), speed_errors(&all));
    Some(RecordingPlots { windows, speeds, motions: all.into_iter().map(|o| o.motion).collect() })
}

/// The comparison of one recording at `x`, the unknowns on their scales: over its whole duration, and in windows of the
/// shorter [`DURATIONS`], with errors of free markers and snapshots. Only nodes with markers are recorded beyond
/// [`MOST_POSITIONS`]. The recording counts as validation data if all its measurements do. An error if the free run
/// over the whole recording fails.
fn compare_recording(
    experiment: &Experiment,
    search: &Search,
    x: &[f64],
) -> Result<RecordingComparison, Error> {
    let problem = search.problem_at(x, experiment)?;
    // Positions of all nodes at all steps may exceed the memory.
    let has_all_nodes = problem.nodes() * problem.time()?.steps() <= MOST_POSITIONS;
    let free_run = FreeRun::new(&problem, has_all_nodes, search)?;
    let mean_error = free_run.mean_error();
    let mut windows = Vec::new();
    // A window of about the whole recording is the free run itself, which is not simulated again.
    let longest = free_run.end * (1.0 + DURATION_TOLERANCE);
    for duration in DURATIONS.into_iter().filter(|duration| *duration <= longest) {
        let errors = match duration >= free_run.end * (1.0 - DURATION_TOLERANCE) {
            true => vec![Some(mean_error)],
            false => errors_in_windows(&problem, &free_run.track, duration, search),
        };
        windows.extend(errors.into_iter().map(|error| FreeRunWindow { duration, error }));
    }
    // A recording is validation data only if all its measurements are.
    let motion = RecordedMotion {
        experiment: experiment.name.clone(),
        held_out: experiment.measurements.iter().all(|m| m.held_out()),
        mean_error,
        snapshots: snapshots(&free_run)?,
    };
    Ok(RecordingComparison { motion, windows, speeds: sample_errors(&problem, &free_run) })
}

/// The mean errors over markers and frames, m, of free runs in evenly spread windows of a `duration`, s; `None` for a
/// failed run. There are as many windows as fit into the recording, at least 1 and at most [`WINDOWS`]; their first
/// frames are evenly spaced. Each run starts from the first [`START_FRAMES`] frames of its window. Windows with a
/// missing marker or a glitch in these frames, or with fewer than two frames after these, are left out.
fn errors_in_windows(
    problem: &Problem,
    track: &Track,
    duration: f64,
    search: &Search,
) -> Vec<Option<f64>> {
    let times = track.times();
    let end_of =
        |first: usize| times.partition_point(|t| *t <= times[first] + duration * (1.0 + 1e-9));
    let last = times.partition_point(|t| *t <= track.end() - duration * (1.0 - 1e-9)).max(1) - 1;
    // Windows are spread over the recording, without overlap as far as their number is small.
    let count = ((track.end() / duration + 1e-9) as usize).clamp(1, WINDOWS);
    let mut errors = Vec::new();
    for k in 0..count {
        let first = last * k / (count - 1).max(1);
        // Obstacles move by the time since the start of the recording.
        if first > 0 && problem.scene().has_moved_obstacles() {
            continue;
        }
        // The first frames give positions and velocities at the start of the run.
        let has_start = |m: &Marker| {
            let mut frames = first..first + START_FRAMES;
            frames.all(|frame| m.seen[frame].is_some() && !track.is_spoiled(m, frame))
        };
        if end_of(first) < first + START_FRAMES + 2 || !track.markers().iter().all(has_start) {
            continue;
        }
        // The free run is a scene of its own with the window as its recording.
        let free_run = track.window(first..end_of(first)).ok().and_then(|window| {
            let mut scene = problem.scene().clone();
            scene.time.as_mut()?.end = window.end();
            scene.supports.path.as_mut()?.track = Some(window.into());
            let own = problem.with_scene(scene).ok()?;
            FreeRun::new(&own, false, search).ok()
        });
        errors.push(free_run.map(|free_run| free_run.mean_error()));
    }
    errors
}

/// The simulated nodes, the recorded markers and the mean error of all markers, m, of a free run, at [`SNAPSHOTS`]
/// evenly spaced frames after its start (fewer in short runs). The first is the frame after the first [`START_FRAMES`].
/// An error for a time after the end of the run.
fn snapshots(free_run: &FreeRun) -> Result<Vec<RecordedSnapshot>, Error> {
    let FreeRun { track, run, end, .. } = free_run;
    let frames = track.times().partition_point(|t| *t <= end * (1.0 + 1e-9));
    // Mean error of all markers in each frame.
    let (mut sums, mut counts) = (vec![0.0; frames], vec![0.0_f64; frames]);
    for compared in free_run.errors() {
        sums[compared.frame] += compared.error;
        counts[compared.frame] += 1.0;
    }
    let last = frames.saturating_sub(START_FRAMES + 1);
    let mut chosen: Vec<usize> =
        (0..SNAPSHOTS).map(|k| START_FRAMES + last * k / (SNAPSHOTS - 1)).collect();
    chosen.dedup();
    let snapshot = |frame: &usize| {
        let time = track.times()[*frame].min(*end);
        let position = |i| run.at(Point::Node(i), time).map(|(x, _)| [x[0], x[1], x[2]]);
        Ok(RecordedSnapshot {
            time,
            nodes: free_run.tracked.iter().copied().map(position).collect::<Result<_, Error>>()?,
            markers: track.markers().iter().map(|m| m.seen[*frame]).collect(),
            error: sums[*frame] / counts[*frame].max(1.0),
        })
    };
    chosen.iter().filter(|frame| **frame < frames).map(snapshot).collect()
}

/// Speed, m/s, and error, m, of every free marker in every compared frame of a free run. The speed is the recorded
/// distance from the frame before to the one after over their time; the error is the mean of the three absolute
/// coordinate differences. Frames without these neighbors, and with a glitch of the marker in or near them, are left
/// out. Empty without recorded ends.
fn sample_errors(problem: &Problem, free_run: &FreeRun) -> Vec<SampleError> {
    let (track, supports) = (&free_run.track, &problem.scene().supports);
    let Some(path) = &supports.path else { return Vec::new() };
    let free = path.free_markers([supports.start, supports.end]);
    let compared = free_run.errors().filter(|c| free.contains(&c.marker));
    let with_speed = |c: MarkerError| {
        let marker = &track.markers()[c.marker];
        // The speed is a central difference: frames without both neighbors have none.
        let (before, after) = (marker.seen[c.frame - 1]?, (*marker.seen.get(c.frame + 1)?)?);
        if track.is_spoiled(marker, c.frame) {
            return None;
        }
        let time = track.times()[c.frame + 1] - track.times()[c.frame - 1];
        let squares = (0..3).map(|i| (after[i] - before[i]).powi(2)).sum::<f64>();
        Some(SampleError { speed: squares.sqrt() / time, error: c.error })
    };
    compared.filter_map(with_speed).collect()
}

/// The mean of the errors, m, with their number; `None` without errors.
fn mean(errors: impl Iterator<Item = f64>) -> Option<MeanError> {
    let (sum, count) = errors.fold((0.0, 0), |(sum, count), error| (sum + error, count + 1));
    (count > 0).then(|| MeanError { mean: sum / count as f64, count })
}

/// Mean errors, m, of all free runs for each of [`DURATIONS`], ascending, of fitted and of validation recordings apart.
/// The number of failed runs is that of both together. Durations without a run are left out.
fn window_errors(all: &[RecordingComparison]) -> Vec<WindowError> {
    let of_duration = |length: f64| {
        let own = |held_out: bool| {
            let all = all.iter().filter(move |one| one.motion.held_out == held_out);
            let windows = all.flat_map(|one| &one.windows);
            windows.filter(move |w| w.duration == length).map(|w| w.error)
        };
        let failed = [true, false].map(|held_out| own(held_out).filter(Option::is_none).count());
        let (fitted, held_out) = (mean(own(false).flatten()), mean(own(true).flatten()));
        WindowError { length, fitted, held_out, failed: failed.iter().sum() }
    };
    let has_runs = |w: &WindowError| w.fitted.is_some() || w.held_out.is_some() || w.failed > 0;
    DURATIONS.map(of_duration).into_iter().filter(has_runs).collect()
}

/// Mean errors of the free markers by ranges of their speed, of fitted and of validation recordings apart, ascending.
/// Ranges begin at zero and have one width: the [`SLOWER`] quantile of all speeds over [`SPEED_RANGES`] (the largest
/// speed, if the quantile is zero), rounded up by [`round_step`]. The last range begins below that quantile and
/// includes all faster ones. A range without samples has no means. Empty without motion.
fn speed_errors(all: &[RecordingComparison]) -> Vec<SpeedError> {
    let mut sorted: Vec<f64> = all.iter().flat_map(|one| &one.speeds).map(|s| s.speed).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(fastest) = sorted.last().copied().filter(|v| *v > 0.0) else { return Vec::new() };
    let fast = sorted[((sorted.len() - 1) as f64 * SLOWER) as usize];
    // Ranges have round limits; the fastest samples share the last one.
    let step = round_step(if fast > 0.0 { fast } else { fastest } / SPEED_RANGES);
    let ranges = ((fast / step).ceil() as usize).max(1);
    let of_range = |k: usize| {
        let low = step * k as f64;
        // The last range has no upper limit.
        let next = step * (k + 1) as f64;
        let high = if k + 1 == ranges { fastest.max(next) } else { next };
        let own = |held_out: bool| {
            let all = all.iter().filter(move |one| one.motion.held_out == held_out);
            let is_within = move |v: f64| v >= low && (v < high || k + 1 == ranges);
            let samples = all.flat_map(|one| &one.speeds);
            mean(samples.filter(move |s| is_within(s.speed)).map(|s| s.error))
        };
        SpeedError { speed: [low, high], fitted: own(false), held_out: own(true) }
    };
    (0..ranges).map(of_range).collect()
}

/// The smallest of 1, 2, 2.5 and 5 times a power of ten that is at least `step`, which is positive.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().map(|n| n * power).find(|s| *s >= step).unwrap_or(step)
}

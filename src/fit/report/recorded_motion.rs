//! How rods go along with the recordings that lead their ends, for [plots](super::PlotData): at a dozen
//! moments, and how far off they are by how long they go on their own, and by how fast the markers are.

use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::Search;
use crate::fit::uncertainty::discrepancy::free_run::{
    FreeRun, MarkerError, START_FRAMES, driven_experiments,
};
use crate::problem::Problem;
use crate::scene::{Point, Track};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Most places of nodes in time that a simulation may keep: above, it keeps those of nodes with markers only.
const MOST_PLACES: usize = 2_000_000;
/// Moments of a recording that are kept.
const MOMENTS: usize = 12;
/// How long rods go on their own, s.
const LENGTHS: [f64; 9] = [0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 25.0, 50.0];
/// A recording may be shorter than a length by this part of it.
const SHORTER: f64 = 0.02;
/// Most windows of a length in one recording.
const WINDOWS: usize = 8;
/// About as many ranges of speeds.
const SPEEDS: f64 = 8.0;
/// The last of them begins below this part of all markers.
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

/// What one recording adds.
struct One {
    motion: RecordedMotion,
    /// Length, and the mean error of each window or nothing where it failed.
    windows: Vec<(f64, Option<f64>)>,
    /// Speed and error of the free markers.
    speeds: Vec<(f64, f64)>,
}

/// Of all experiments whose ends are driven by a recording, at `x`; none where there are none. Those that cannot
/// be simulated are left out: the report names them.
pub(crate) fn recorded(
    experiments: &[Experiment],
    search: &Search,
    x: &[f64],
) -> Option<RecordingPlots> {
    let driven = driven_experiments(experiments);
    let one = |experiment: &&Experiment| one(experiment, search, x).ok();
    let all: Vec<One> = driven.par_iter().filter_map(one).collect();
    if all.is_empty() {
        return None;
    }
    let (windows, speeds) = (windows(&all), speeds(&all));
    Some(RecordingPlots { windows, speeds, motions: all.into_iter().map(|o| o.motion).collect() })
}

fn one(experiment: &Experiment, search: &Search, x: &[f64]) -> Result<One, Error> {
    let problem = search.problem_at(x, experiment)?;
    let all = problem.nodes() * problem.time()?.steps() <= MOST_PLACES;
    let followed = FreeRun::new(&problem, all, search)?;
    let mean_error = followed.mean_error();
    let mut windows = Vec::new();
    for length in LENGTHS.into_iter().filter(|l| *l <= followed.end * (1.0 + SHORTER)) {
        let errors = match length >= followed.end * (1.0 - SHORTER) {
            true => vec![Some(mean_error)],
            false => in_windows(&problem, &followed.track, length, search),
        };
        windows.extend(errors.into_iter().map(|error| (length, error)));
    }
    let motion = RecordedMotion {
        experiment: experiment.name.clone(),
        held_out: experiment.measurements.iter().all(|m| m.held_out()),
        mean_error,
        snapshots: snapshots(&followed)?,
    };
    Ok(One { motion, windows, speeds: by_speed(&problem, &followed) })
}

/// The mean errors in windows of a length, each of which starts like a recording. Where a marker is not seen
/// at its start, or jumps there, there is no window.
fn in_windows(problem: &Problem, track: &Track, length: f64, search: &Search) -> Vec<Option<f64>> {
    let times = track.times();
    let end_of =
        |first: usize| times.partition_point(|t| *t <= times[first] + length * (1.0 + 1e-9));
    let last = times.partition_point(|t| *t <= track.end() - length * (1.0 - 1e-9)).max(1) - 1;
    let count = ((track.end() / length + 1e-9) as usize).clamp(1, WINDOWS);
    let mut errors = Vec::new();
    for k in 0..count {
        let first = last * k / (count - 1).max(1);
        let starts = |m: &crate::scene::track::Marker| {
            let mut frames = first..first + START_FRAMES;
            frames.all(|frame| m.seen[frame].is_some() && !track.is_spoiled(m, frame))
        };
        if end_of(first) < first + START_FRAMES + 2 || !track.markers().iter().all(starts) {
            continue;
        }
        let followed = track.window(first..end_of(first)).ok().and_then(|window| {
            let mut scene = problem.scene().clone();
            scene.time.as_mut()?.end = window.end();
            scene.supports.path.as_mut()?.track = Some(window.into());
            let own = problem.with_scene(scene).ok()?;
            FreeRun::new(&own, false, search).ok()
        });
        errors.push(followed.map(|followed| followed.mean_error()));
    }
    errors
}

/// The rod at frames evenly spread over the time that is predicted.
fn snapshots(followed: &FreeRun) -> Result<Vec<RecordedSnapshot>, Error> {
    let FreeRun { track, run, end, .. } = followed;
    let frames = track.times().partition_point(|t| *t <= end * (1.0 + 1e-9));
    let (mut sums, mut counts) = (vec![0.0; frames], vec![0.0_f64; frames]);
    for compared in followed.errors() {
        sums[compared.frame] += compared.error;
        counts[compared.frame] += 1.0;
    }
    let last = frames.saturating_sub(START_FRAMES + 1);
    let mut chosen: Vec<usize> =
        (0..MOMENTS).map(|k| START_FRAMES + last * k / (MOMENTS - 1)).collect();
    chosen.dedup();
    let at = |frame: &usize| {
        let time = track.times()[*frame].min(*end);
        let place = |i| run.at(Point::Node(i), time).map(|(x, _)| [x[0], x[1], x[2]]);
        Ok(RecordedSnapshot {
            time,
            nodes: followed.tracked.iter().copied().map(place).collect::<Result<_, Error>>()?,
            markers: track.markers().iter().map(|m| m.seen[*frame]).collect(),
            error: sums[*frame] / counts[*frame].max(1.0),
        })
    };
    chosen.iter().filter(|frame| **frame < frames).map(at).collect()
}

/// Speed, from the frames before and after, and error of every free marker; not where it jumps.
fn by_speed(problem: &Problem, followed: &FreeRun) -> Vec<(f64, f64)> {
    let (track, supports) = (&followed.track, &problem.scene().supports);
    let Some(path) = &supports.path else { return Vec::new() };
    let free = path.free_markers([supports.start, supports.end]);
    let compared = followed.errors().filter(|c| free.contains(&c.marker));
    let with_speed = |c: MarkerError| {
        let marker = &track.markers()[c.marker];
        let (before, after) = (marker.seen[c.frame - 1]?, (*marker.seen.get(c.frame + 1)?)?);
        if track.is_spoiled(marker, c.frame) {
            return None;
        }
        let time = track.times()[c.frame + 1] - track.times()[c.frame - 1];
        let squares = (0..3).map(|i| (after[i] - before[i]).powi(2)).sum::<f64>();
        Some((squares.sqrt() / time, c.error))
    };
    compared.filter_map(with_speed).collect()
}

fn mean(errors: impl Iterator<Item = f64>) -> Option<MeanError> {
    let (sum, count) = errors.fold((0.0, 0), |(sum, count), error| (sum + error, count + 1));
    (count > 0).then(|| MeanError { mean: sum / count as f64, count })
}

fn windows(all: &[One]) -> Vec<WindowError> {
    let of = |length: f64| {
        let own = |held_out: bool| {
            let all = all.iter().filter(move |one| one.motion.held_out == held_out);
            all.flat_map(|one| &one.windows).filter(move |w| w.0 == length).map(|w| w.1)
        };
        let failed = [true, false].map(|held_out| own(held_out).filter(Option::is_none).count());
        let (fitted, held_out) = (mean(own(false).flatten()), mean(own(true).flatten()));
        WindowError { length, fitted, held_out, failed: failed.iter().sum() }
    };
    let some = |w: &WindowError| w.fitted.is_some() || w.held_out.is_some() || w.failed > 0;
    LENGTHS.map(of).into_iter().filter(some).collect()
}

fn speeds(all: &[One]) -> Vec<SpeedError> {
    let mut sorted: Vec<f64> = all.iter().flat_map(|one| &one.speeds).map(|(v, _)| *v).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(fastest) = sorted.last().copied().filter(|v| *v > 0.0) else { return Vec::new() };
    let fast = sorted[((sorted.len() - 1) as f64 * SLOWER) as usize];
    let step = round_step(if fast > 0.0 { fast } else { fastest } / SPEEDS);
    let ranges = ((fast / step).ceil() as usize).max(1);
    let of = |k: usize| {
        let low = step * k as f64;
        // The last range takes all that is faster.
        let next = step * (k + 1) as f64;
        let high = if k + 1 == ranges { fastest.max(next) } else { next };
        let own = |held_out: bool| {
            let all = all.iter().filter(move |one| one.motion.held_out == held_out);
            let within = move |v: &f64| *v >= low && (*v < high || k + 1 == ranges);
            mean(all.flat_map(|one| &one.speeds).filter(move |(v, _)| within(v)).map(|(_, e)| *e))
        };
        SpeedError { speed: [low, high], fitted: own(false), held_out: own(true) }
    };
    (0..ranges).map(of).collect()
}

/// 1, 2, 2.5 or 5 times a power of ten, at least as large.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().map(|n| n * power).find(|s| *s >= step).unwrap_or(step)
}

//! Free-run prediction errors of recordings whose ends drive the rod.
//!
//! Input: experiments with a measured motion whose scene has recorded markers as supports (`supports.path`), and the
//! values of the optimum. Each is simulated once (free run). A run starts from the first two frames ([`START_FRAMES`]),
//! or in equilibrium if the scene requests it, and follows the recorded ends. All markers, those of the ends included,
//! are compared with the recording in the later frames up to the end of the simulation; lost markers are left out. The
//! error of a marker in a frame is the mean absolute difference of its three coordinates, m.
//!
//! [`RecordingErrors`] has the mean error of each experiment, none where the simulation fails. It also has number,
//! mean, median and largest of these means, separately over the fitted and over the validation experiments (all
//! measurements held out). Without any such experiment the whole result is `None`. Reports of fits and predictions show
//! it. [`FreeRun`] is one run with its recording, for plots too.
//!
//! [`RecordingError`] is the error of one experiment, [`ErrorSummary`] summarizes several, and [`MarkerError`] is the
//! error of one marker in one frame.

use crate::dynamics::Trajectory;
use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::numerics::total_order;
use crate::problem::Problem;
use crate::scene::{Point, Track};
use crate::summary::quantity::{counted, quantity};
use crate::summary::{ItemTable, Summary};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Number of frames that determine the initial positions and velocities: nothing is predicted there.
pub(crate) const START_FRAMES: usize = 2;

/// Free-run prediction error of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RecordingError {
    /// Name of the experiment; empty if there is only one.
    pub experiment: String,
    /// Whether the experiment is validation data.
    pub held_out: bool,
    /// Mean distance per coordinate between simulation and recording, m, over all markers and all
    /// frames after the two that start the run; null where the simulation failed.
    pub mean_error: Option<f64>,
}

/// Summary of the free-run prediction errors of several experiments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ErrorSummary {
    /// Number of simulated experiments.
    pub experiments: usize,
    /// Mean of the mean errors, m.
    pub mean: f64,
    /// Median of the mean errors, m.
    pub median: f64,
    /// Largest of the mean errors, m.
    pub worst: f64,
    /// Name of the experiment with the largest error.
    pub worst_experiment: String,
}

/// Free-run prediction errors of recordings with driven ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RecordingErrors {
    /// Errors of the fitted experiments.
    pub fitted: Option<ErrorSummary>,
    /// Errors of the validation experiments.
    pub held_out: Option<ErrorSummary>,
    /// Error of each experiment.
    pub list: Vec<RecordingError>,
}

impl RecordingErrors {
    /// Errors of all experiments with a motion whose ends are driven by a recording, one simulation each with the
    /// values of the optimum, in parallel. One whose simulation fails has no error. An experiment is validation data if
    /// all its measurements are. None without such experiments.
    pub(crate) fn new(experiments: &[Experiment], fitted: Fitted) -> Option<Self> {
        let driven = driven_experiments(experiments);
        let error = |experiment: &&Experiment| RecordingError {
            experiment: experiment.name.clone(),
            held_out: experiment.measurements.iter().all(|m| m.held_out()),
            mean_error: mean_error(experiment, fitted).ok(),
        };
        // Every experiment is a run of its own; one that fails has no error.
        let list: Vec<RecordingError> = driven.par_iter().map(error).collect();
        let [fitted, held_out] = [false, true].map(|held_out| ErrorSummary::new(&list, held_out));
        (!list.is_empty()).then_some(Self { fitted, held_out, list })
    }
}

/// The experiments with a measured motion whose scene has recorded markers as supports (`supports.path`), in their
/// order.
pub(crate) fn driven_experiments(experiments: &[Experiment]) -> Vec<&Experiment> {
    let is_driven = |e: &&Experiment| e.moves() && e.problem.scene().supports.path.is_some();
    experiments.iter().filter(is_driven).collect()
}

/// Mean error of the free run of an experiment with the fitted values, m per coordinate, over all markers and frames
/// after the start. Error: the simulation fails.
fn mean_error(experiment: &Experiment, fitted: Fitted) -> Result<f64, Error> {
    let problem = fitted.problem(experiment)?;
    Ok(FreeRun::new(&problem, false, fitted.search)?.mean_error())
}

/// A recording, and the free run of the rod between its ends.
pub(crate) struct FreeRun {
    /// The recorded markers.
    pub track: Arc<Track>,
    /// The node of every marker.
    pub nodes: Vec<usize>,
    /// The nodes whose motion is stored.
    pub tracked: Vec<usize>,
    /// The simulated motion of these nodes.
    pub run: Trajectory,
    /// End of the simulation, s.
    pub end: f64,
}

/// Error of a marker in a frame.
pub(crate) struct MarkerError {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Index of the marker in the recording.
    pub marker: usize,
    /// Mean absolute difference of the three coordinates between simulation and recording, m.
    pub error: f64,
}

impl FreeRun {
    /// Simulates a problem to its end, and stores the motion of all nodes if `all`, else of those with markers. The
    /// work (steps times segments) is added to that of the search. Error: a scene without `supports.path` or without
    /// its recording, or a simulation that fails.
    pub fn new(problem: &Problem, all: bool, search: &Search) -> Result<Self, Error> {
        let none = || Error::invalid("supports.path", "no such table", "one");
        let path = problem.scene().supports.path.as_ref().ok_or_else(none)?;
        let (nodes, track) =
            (path.nodes(problem.segments())?, path.track.clone().ok_or_else(none)?);
        // Only the nodes with markers are compared; plots need all of them.
        let tracked = if all { (0..problem.nodes()).collect() } else { nodes.clone() };
        let time = problem.time()?;
        let mut run = Trajectory::new(problem, &tracked, &[])?;
        run.run(problem, time.steps(), |_| {})?;
        search.work.add((run.work().steps * problem.segments()) as f64);
        Ok(Self { track, nodes, tracked, run, end: time.end })
    }

    /// Errors of all recorded markers, frame by frame and in the order of the markers, in all frames after the first
    /// [`START_FRAMES`], up to the end of the simulation. Each is the mean of the three absolute coordinate
    /// differences, m. Markers lost in a frame have none there.
    pub fn errors(&self) -> impl Iterator<Item = MarkerError> {
        let frames = self.track.times().iter().enumerate().skip(START_FRAMES);
        // Frames after the end of the simulation have no prediction.
        let frames = frames.take_while(|(_, t)| **t <= self.end * (1.0 + 1e-9));
        frames.flat_map(move |(frame, t)| {
            let markers = self.nodes.iter().zip(self.track.markers()).enumerate();
            markers.filter_map(move |(marker, (node, path))| {
                let recorded = path.seen[frame]?;
                // By a rounding error the last frame may be after the end of the run.
                let (simulated, _) = self.run.at(Point::Node(*node), t.min(self.end)).ok()?;
                let distance = (0..3).map(|c| (simulated[c] - recorded[c]).abs()).sum::<f64>();
                Some(MarkerError { frame, marker, error: distance / 3.0 })
            })
        })
    }

    /// Mean of [`errors`](Self::errors) over all markers and frames, m per coordinate; 0 without any.
    pub fn mean_error(&self) -> f64 {
        let errors: Vec<f64> = self.errors().map(|e| e.error).collect();
        errors.iter().sum::<f64>() / errors.len().max(1) as f64
    }
}

impl ErrorSummary {
    /// Number, mean, median, largest error and its experiment, over the validation experiments if `held_out`, else over
    /// the others. Failed simulations are left out; none without any error.
    fn new(list: &[RecordingError], held_out: bool) -> Option<Self> {
        let own = list.iter().filter(|e| e.held_out == held_out);
        let mut own: Vec<(f64, &String)> =
            own.filter_map(|e| Some((e.mean_error?, &e.experiment))).collect();
        own.sort_by_cached_key(|x| total_order(x.0));
        let (worst, name) = *own.last()?;
        let n = own.len();
        Some(Self {
            experiments: n,
            mean: own.iter().map(|(e, _)| e).sum::<f64>() / n as f64,
            median: 0.5 * (own[(n - 1) / 2].0 + own[n / 2].0),
            worst,
            worst_experiment: name.clone(),
        })
    }
}

impl RecordingErrors {
    /// Adds a line on the fitted experiments to the summary of a fit or a prediction: their number, and mean, median
    /// and largest error, m per coordinate (of a single one the mean alone). A second line is for the validation
    /// experiments. With several recordings it also adds a table of all.
    pub(crate) fn add_to(&self, mut summary: Summary) -> Summary {
        let shown = |x: f64| quantity(x, "m", 3);
        // One line for the fitted and one for the validation experiments.
        for (what, errors) in [("fitted", &self.fitted), ("validation", &self.held_out)] {
            let Some(s) = errors else { continue };
            let worst = match s.worst_experiment.is_empty() {
                true => String::new(),
                false => format!(" ({})", s.worst_experiment),
            };
            let spread = match s.experiments {
                1 => String::new(),
                _ => format!(", median {}, worst {}{worst}", shown(s.median), shown(s.worst)),
            };
            let text = format!(
                "{}, {what}: mean {}{spread}; per coordinate, ends included, simulated from the first two frames",
                counted(s.experiments, "recording"),
                shown(s.mean)
            );
            summary = summary.fact("Prediction error", text);
        }
        // A table shows which recordings are outliers.
        let listed = self.list.iter().filter(|_| self.list.len() > 1);
        let table = ItemTable::new(listed)
            .left("recording", |error| error.experiment.clone())
            .right("mean error", |error| error.mean_error.map_or("failed".into(), shown))
            .left("use", |error| if error.held_out { "validation" } else { "fitted" }.to_string());
        summary.table("Prediction error of each recording, per coordinate", table)
    }
}

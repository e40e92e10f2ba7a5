//! What a run is about to take, estimated before it starts and refused above a limit. The figures are of a machine of
//! today, measured to within a factor of two or so: they tell a coffee from a night and a night from a year.

use crate::command::{Manner, terminal};
use rodfit::fit::{Experiment, FitFile, Measurement, PointMotion};
use rodfit::scene::{Dimension, Shape};
use rodfit::{Code, Error, Problem, Scene};
use std::path::PathBuf;

/// Most memory, bytes.
const MEMORY: f64 = 4e9;
/// Most time, s.
const TIME: f64 = 3600.0;
/// Most disk, bytes.
const DISK: f64 = 10e9;
/// Runs that take longer, s, or more memory, bytes, are announced.
const LONG: f64 = 60.0;
const LARGE: f64 = 1e9;
/// Most threads: more are of no use to a fit.
const THREADS: usize = 256;

/// What a node costs in a plane and in space.
struct Node {
    /// Of a simulation, bytes.
    bytes: f64,
    /// Of a time step, s.
    step: f64,
    /// Of an equilibrium, s: fine meshes need hundreds of iterations.
    rest: f64,
}

const PLANAR: Node = Node { bytes: 600.0, step: 0.25e-6, rest: 0.1e-3 };
const SPATIAL: Node = Node { bytes: 1700.0, step: 1.4e-6, rest: 0.6e-3 };
/// An equilibrium needs more room than a simulation, by this factor.
const REST_ROOM: f64 = 2.0;
/// Of one vector of a node's unknowns, bytes.
const VECTOR: f64 = 100.0;
/// Of one mode of a node, s.
const MODE: f64 = 0.05e-3;
/// Of a step's tip and energies in the JSON, in memory and on disk, bytes.
const SERIES: [f64; 2] = [160.0, 200.0];
/// Of a position in a CSV file, bytes.
const POSITION: f64 = 60.0;
/// Least bytes of a row of a polyline.
const ROW: f64 = 20.0;
/// A study is so many simulations: 3 schemes, of which the dearest costs 6 times as much as the default, on meshes
/// 7.75 times the scene's and in 15.75 times its steps. Its largest mesh is 8 times the scene's.
const STUDY: [f64; 2] = [1500.0, 8.0];
/// A design takes so many simulations: one with derivatives of twice the length, one by what is known.
const DESIGN: f64 = 10.0;
/// Fits take up to so many simulations, and so many more for every replicate of a bootstrap or a Monte Carlo.
const FIT: [f64; 2] = [40.0, 3.0];
/// Of a recorded point and step in a fit, bytes.
const RECORD: f64 = 48.0;

/// What a run takes.
pub struct Estimate {
    file: Option<PathBuf>,
    key: &'static str,
    /// What it is mostly for.
    cause: String,
    bytes: f64,
    seconds: f64,
    disk: f64,
}

impl Estimate {
    /// Refuses what is beyond the limits unless they are ignored, and announces what is long.
    pub fn admit(&self, manner: Manner) -> Result<(), Error> {
        let (memory, time) = (size(self.bytes), duration(self.seconds));
        let takes = [
            (self.bytes, MEMORY, format!("{memory} of memory"), size(MEMORY)),
            (self.seconds, TIME, time.clone(), duration(TIME)),
            (self.disk, DISK, format!("{} of disk", size(self.disk)), size(DISK)),
        ];
        if manner.ignores_limits() {
            return Ok(());
        }
        if let Some((_, _, amount, limit)) = takes.into_iter().find(|t| t.0 > t.1) {
            return Err(Error::Invalid {
                file: self.file.clone(),
                key: self.key.into(),
                found: format!("{}, which take about {amount}", self.cause),
                allowed: format!("up to {limit}; more with --no-limits"),
            });
        }
        if !manner.quiet && (self.seconds > LONG || self.bytes > LARGE) {
            terminal::tell(format_args!("{}: about {time} and {memory}", self.cause));
        }
        Ok(())
    }

    fn of_nodes(scene: &Scene, bytes: f64, seconds: f64) -> Self {
        let nodes = nodes(scene);
        let cause = format!("{} nodes", count(nodes));
        let (bytes, seconds) = (bytes * nodes, seconds * nodes);
        Self { file: scene.path.clone(), key: "rod.segments", cause, bytes, seconds, disk: 0.0 }
    }
}

/// Whether a mesh can be made.
pub fn of_mesh(scene: &Scene) -> Estimate {
    Estimate::of_nodes(scene, node(scene).bytes, 0.0)
}

pub fn of_rest(scene: &Scene) -> Estimate {
    let node = node(scene);
    Estimate::of_nodes(scene, REST_ROOM * node.bytes, node.rest)
}

pub fn of_modes(scene: &Scene, count: usize) -> Estimate {
    let (node, count) = (node(scene), count as f64 + 8.0);
    let bytes = REST_ROOM * node.bytes + VECTOR * count;
    Estimate::of_nodes(scene, bytes, node.rest + MODE * count)
}

/// It simulates some hundred steps.
pub fn of_check(scene: &Scene) -> Estimate {
    let node = node(scene);
    Estimate::of_nodes(scene, REST_ROOM * node.bytes, 400.0 * node.step)
}

/// A simulation of so many steps, with all nodes written to a file or not, and with the series of a report or not.
pub fn of_simulation(problem: &Problem, steps: usize, table: bool, series: bool) -> Estimate {
    let node = if problem.planar().is_some() { PLANAR } else { SPATIAL };
    let (nodes, steps) = (problem.nodes() as f64, steps as f64);
    let [memory, disk] = if series { SERIES } else { [0.0; 2] };
    let rows = if table { POSITION * nodes } else { 0.0 };
    Estimate {
        file: problem.scene().path.clone(),
        key: "time.step",
        cause: format!("{} steps of {} nodes", count(steps), count(nodes)),
        bytes: node.bytes * nodes + memory * steps,
        seconds: node.step * nodes * steps,
        disk: (disk + rows) * steps,
    }
}

pub fn of_study(scene: &Scene) -> Estimate {
    let [runs, finest] = STUDY;
    let (node, nodes) = (node(scene), nodes(scene));
    let steps = scene.time.as_ref().map_or(0.0, |time| time.steps() as f64);
    Estimate {
        file: scene.path.clone(),
        key: "time.step",
        cause: format!(
            "runs on up to {} nodes in up to {} steps",
            count(finest * nodes),
            count(8.0 * steps)
        ),
        bytes: finest * (node.bytes * nodes + SERIES[0] * steps),
        seconds: runs * node.step * nodes * steps,
        disk: 0.0,
    }
}

/// What all experiments of a fit take together.
pub fn of_fit(file: &FitFile, path: PathBuf) -> Estimate {
    let replicates = file.analysis.bootstrap + file.analysis.monte_carlo;
    of_runs(file, path, FIT[0] + FIT[1] * replicates as f64)
}

/// Likewise, of a design.
pub fn of_design(file: &FitFile, path: PathBuf) -> Estimate {
    of_runs(file, path, DESIGN)
}

/// So many simulations of all experiments.
fn of_runs(file: &FitFile, path: PathBuf, runs: f64) -> Estimate {
    let mut whole = Estimate {
        file: Some(path),
        key: "scene",
        cause: String::new(),
        bytes: 0.0,
        seconds: 0.0,
        disk: 0.0,
    };
    let (mut most_steps, mut most_nodes) = (0.0_f64, 0.0_f64);
    let records = RECORD * (1.0 + file.unknowns.len() as f64);
    for experiment in &file.experiments {
        let problem = &experiment.problem;
        let node = if problem.planar().is_some() { PLANAR } else { SPATIAL };
        let (nodes, (steps, points)) = (problem.nodes() as f64, recorded(experiment));
        whole.bytes += node.bytes * nodes + steps * points * records;
        whole.seconds += runs * nodes * (node.step * steps + node.rest / FIT[0]);
        (most_steps, most_nodes) = (most_steps.max(steps), most_nodes.max(nodes));
    }
    whole.cause = format!(
        "simulations of up to {} steps and {} nodes, {} of them",
        count(most_steps),
        count(most_nodes),
        count(runs * file.experiments.len() as f64)
    );
    whole
}

/// Steps until the last of what was recorded, and the number of points.
fn recorded(experiment: &Experiment) -> (f64, f64) {
    let motions = || experiment.measurements.iter().filter_map(Measurement::motion);
    let last = |o: &PointMotion| o.samples.last().map_or(0.0, |sample| sample.time);
    let end = motions().map(last).fold(0.0, f64::max);
    let time = experiment.problem.scene().time.as_ref();
    let steps = time.map_or(0.0, |time| (end.min(time.end) / time.step_size()).ceil());
    (steps, motions().count() as f64)
}

/// A scene's nodes before there is a mesh; those of a polyline by the size of its file.
fn nodes(scene: &Scene) -> f64 {
    match (&scene.rod.shape, scene.rod.segments) {
        (Shape::Polyline { points, .. }, None) if !points.is_empty() => points.len() as f64,
        (Shape::Polyline { file, .. }, None) => {
            let size = std::fs::metadata(scene.folder().join(file)).map_or(0, |found| found.len());
            size as f64 / ROW
        }
        (_, segments) => segments.unwrap_or(0) as f64 + 1.0,
    }
}

/// The model is chosen when the mesh is there.
fn node(scene: &Scene) -> Node {
    if scene.rod.dimension == Dimension::Spatial { SPATIAL } else { PLANAR }
}

/// Keeps a number of threads that was asked for within reason.
pub fn bound_threads(manner: Manner) {
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse::<usize>().ok());
    let Some(asked) = asked.filter(|n| *n > THREADS) else { return };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(THREADS).build_global();
    if pool.is_ok() && !manner.quiet {
        let words = format_args!("RAYON_NUM_THREADS = {asked}; {THREADS} threads are used");
        terminal::warn(Code::FewerThreads, words);
    }
}

fn count(n: f64) -> String {
    if n < 1e5 { format!("{n:.0}") } else { format!("{n:.1e}") }
}

fn size(bytes: f64) -> String {
    if bytes < 1e9 { format!("{:.0} MB", bytes / 1e6) } else { format!("{:.1} GB", bytes / 1e9) }
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.0} h", s / 3600.0),
        s if s < 3.2e7 => format!("{:.0} days", s / 86_400.0),
        s => format!("{:.0} years", s / 3.156e7),
    }
}

//! Estimated cost of a run in memory, time and disk space before it starts, and its rejection above a limit.
//!
//! Time is the number of nodes times that of steps (times simulations) times a measured time; of an equilibrium or of
//! modes it is proportional to the nodes. Studies, fits and designs take a measured or largest number of simulations.
//! Memory is a measured number of bytes per node, whatever the steps, plus that of the series or recorded points of
//! each step. Disk space is that of the positions and series of each step. In estimates for a scene whose mesh the
//! program has yet to choose, the mesh counts as one node. [`CostEstimate::admit`] decides: a run above [`MAX_MEMORY`],
//! [`MAX_TIME`] or [`MAX_DISK`] is an error without `--no-limits`; a long or large one ([`LONG`], [`LARGE`]) is
//! announced on standard error unless `--quiet` or `--no-limits` is given. The constants were measured on a current
//! machine, and are right to within a factor of two or so. [`limit_threads`] limits the threads of the process to
//! `MAX_THREADS` if `RAYON_NUM_THREADS` is larger, with a warning unless `--quiet`.
//!
//! [`CostEstimate`] has a function for each kind of run: `simulation_cost`, `equilibrium_cost`, `modes_cost`,
//! `check_cost` (comparison of derivatives), `study_cost`, `fit_cost` and `design_cost`. `mesh_cost` is the memory of a
//! simulation's state alone. `with_reactions` adds the series of reactions in a report.

use crate::command::{GlobalOptions, terminal};
use marker_files::file::at;
use rodfit::fit::{Experiment, FitFile, Measurement, PosteriorSettings};
use rodfit::scene::{Dimension, Shape};
use rodfit::{Code, Error, Problem, Scene};
use std::path::PathBuf;

/// Largest memory without `--no-limits`, bytes.
const MAX_MEMORY: f64 = 4e9;
/// Longest time without `--no-limits`, s.
const MAX_TIME: f64 = 3600.0;
/// Largest disk space without `--no-limits`, bytes.
const MAX_DISK: f64 = 10e9;
/// Runs with a longer estimated time are announced, s.
const LONG: f64 = 60.0;
/// Runs with a larger estimated memory are announced, bytes.
const LARGE: f64 = 1e9;
/// Largest number of threads that `RAYON_NUM_THREADS` can set: more do not speed up a fit.
const MAX_THREADS: usize = 256;

/// Measured cost of one node of a rod.
struct NodeCost {
    /// Memory of a simulation, bytes.
    bytes: f64,
    /// A time step, s.
    step: f64,
    /// An equilibrium, s: fine meshes need hundreds of iterations.
    equilibrium: f64,
}

/// Cost of a node of a planar rod, with two unknowns.
const PLANAR: NodeCost = NodeCost { bytes: 600.0, step: 0.25e-6, equilibrium: 0.1e-3 };
/// Cost of a node of a spatial rod, with four unknowns and material frames.
const SPATIAL: NodeCost = NodeCost { bytes: 1700.0, step: 1.4e-6, equilibrium: 0.6e-3 };
/// Memory of an equilibrium over that of a simulation.
const EQUILIBRIUM_MEMORY: f64 = 2.0;
/// Memory of one mode per node, bytes.
const MODE_BYTES: f64 = 100.0;
/// Time of one mode per node, s.
const MODE_SECONDS: f64 = 0.05e-3;
/// Modes that the eigenvalue iteration computes in addition to the requested ones.
const EXTRA_MODES: f64 = 8.0;
/// Cost of a check of derivatives, in time steps of the simulation whose states are used.
const CHECK_STEPS: f64 = 400.0;
/// Memory of one step's tip position and energies in the report, bytes.
const SERIES_BYTES: f64 = 160.0;
/// Disk space of one step's tip position and energies in JSON, bytes.
const SERIES_DISK: f64 = 200.0;
/// Disk space of one node's position at one step in a CSV file, bytes.
const POSITION_DISK: f64 = 60.0;
/// Smallest row of a polyline's file, bytes; the size of the file over it bounds the number of nodes from above.
const MIN_ROW_BYTES: f64 = 20.0;
/// Cost of a study in simulations: 3 schemes, of which the dearest costs 6 times as much as the default, on meshes
/// 7.75 times the scene's and in 15.75 times its steps.
const STUDY_RUNS: f64 = 1500.0;
/// Ratio of the finest mesh of a study to the scene's mesh, and of its largest number of steps to the scene's.
const STUDY_REFINEMENT: f64 = 8.0;
/// Cost of a design in simulations: one with derivatives over twice the duration, and one by the input uncertainties.
const DESIGN_RUNS: f64 = 10.0;
/// Upper bound of the cost of a fit, in simulations.
const FIT_RUNS: f64 = 40.0;
/// Cost of one replicate of a bootstrap or a Monte Carlo, in simulations.
const REPLICATE_RUNS: f64 = 3.0;
/// Cost of one draw of the posterior sampler: a trajectory of usually three to seven steps, each a run with
/// derivatives.
const DRAW_RUNS: f64 = 7.0;
/// Memory of a recorded point at one step, for its position or one derivative of it, bytes.
const RECORD_BYTES: f64 = 48.0;

/// The estimated cost of a run: memory and disk space in bytes, time in s. `file`, `key` and `cause` are for the
/// message.
pub struct CostEstimate {
    file: Option<PathBuf>,
    /// Key of the setting that determines the cost.
    key: &'static str,
    /// The size of the run in words.
    cause: String,
    bytes: f64,
    seconds: f64,
    disk: f64,
}

impl CostEstimate {
    /// The cost with the series of the reactions in a report of so many `steps`, if `has_series`: as much again as that
    /// of tip and energies.
    pub fn with_reactions(self, has_series: bool, steps: usize) -> Self {
        let steps = if has_series { steps as f64 } else { 0.0 };
        let (bytes, disk) = (self.bytes + SERIES_BYTES * steps, self.disk + SERIES_DISK * steps);
        Self { bytes, disk, ..self }
    }

    /// An error for a cost above a limit, with the setting, the estimate and the first exceeded limit: memory, time,
    /// disk. Prints a note for a long or large run unless `--quiet`. With `--no-limits` everything passes without a
    /// note.
    pub fn admit(&self, global: GlobalOptions) -> Result<(), Error> {
        if global.ignores_limits() {
            return Ok(());
        }
        let [memory, time] = [size(self.bytes), duration(self.seconds)];
        // The first exceeded limit is reported.
        let exceeded = if self.bytes > MAX_MEMORY {
            Some([format!("{memory} of memory"), size(MAX_MEMORY)])
        } else if self.seconds > MAX_TIME {
            Some([time.clone(), duration(MAX_TIME)])
        } else if self.disk > MAX_DISK {
            Some([format!("{} of disk", size(self.disk)), size(MAX_DISK)])
        } else {
            None
        };
        if let Some([amount, limit]) = exceeded {
            let found = format!("{}, which take about {amount}", self.cause);
            let allowed = format!("up to {limit}; more with --no-limits");
            return Err(Error::invalid(self.key, found, allowed).in_file(self.file.as_deref()));
        }
        if !global.quiet && (self.seconds > LONG || self.bytes > LARGE) {
            terminal::print_note(format_args!("{}: about {time} and {memory}", self.cause));
        }
        Ok(())
    }

    /// The cost of a scene whose memory and time are proportional to its nodes: `bytes` and `seconds`, s, are those of
    /// one node. No disk space.
    fn per_node(scene: &Scene, bytes: f64, seconds: f64) -> Self {
        let nodes = node_count(scene);
        let cause = format!("{} nodes", count(nodes));
        let (bytes, seconds) = (bytes * nodes, seconds * nodes);
        Self { file: scene.path.clone(), key: "rod.segments", cause, bytes, seconds, disk: 0.0 }
    }
}

/// The cost of the mesh of a scene: the memory of a simulation's state; no time and no disk space.
pub fn mesh_cost(scene: &Scene) -> CostEstimate {
    CostEstimate::per_node(scene, node_cost(scene).bytes, 0.0)
}

/// The cost of the equilibrium of a scene: [`EQUILIBRIUM_MEMORY`] times the memory of a simulation, and time, both
/// proportional to the nodes.
pub fn equilibrium_cost(scene: &Scene) -> CostEstimate {
    let node = node_cost(scene);
    CostEstimate::per_node(scene, EQUILIBRIUM_MEMORY * node.bytes, node.equilibrium)
}

/// The cost of a number of vibration modes and [`EXTRA_MODES`] more, and of the equilibrium, which is computed first;
/// memory and time are proportional to the nodes.
pub fn modes_cost(scene: &Scene, modes: usize) -> CostEstimate {
    let (node, modes) = (node_cost(scene), modes as f64 + EXTRA_MODES);
    let bytes = EQUILIBRIUM_MEMORY * node.bytes + MODE_BYTES * modes;
    CostEstimate::per_node(scene, bytes, node.equilibrium + MODE_SECONDS * modes)
}

/// The cost of a comparison of derivatives: the time of [`CHECK_STEPS`] steps, and the memory of an equilibrium.
pub fn check_cost(scene: &Scene) -> CostEstimate {
    let node = node_cost(scene);
    CostEstimate::per_node(scene, EQUILIBRIUM_MEMORY * node.bytes, CHECK_STEPS * node.step)
}

/// The cost of a simulation of `steps` steps: memory of the state, time, and disk space. `has_table`: the positions of
/// all nodes go to a file at every step; `has_series`: the report in JSON has the series of tip and energies, which
/// also takes memory.
pub fn simulation_cost(
    problem: &Problem,
    steps: usize,
    has_table: bool,
    has_series: bool,
) -> CostEstimate {
    let node = problem_node_cost(problem);
    let (nodes, steps) = (problem.nodes() as f64, steps as f64);
    let [memory, series] = if has_series { [SERIES_BYTES, SERIES_DISK] } else { [0.0; 2] };
    let table = if has_table { POSITION_DISK * nodes } else { 0.0 };
    CostEstimate {
        file: problem.scene().path.clone(),
        key: "time.step",
        cause: format!("{} steps of {} nodes", count(steps), count(nodes)),
        bytes: node.bytes * nodes + memory * steps,
        seconds: node.step * nodes * steps,
        disk: (series + table) * steps,
    }
}

/// The cost of a work-precision study of a scene: time of [`STUDY_RUNS`] simulations; memory of the finest one, on
/// [`STUDY_REFINEMENT`] times the nodes in as many times the steps. No disk space.
pub fn study_cost(scene: &Scene) -> CostEstimate {
    let (node, nodes) = (node_cost(scene), node_count(scene));
    let steps = scene.time.as_ref().map_or(0.0, |time| time.steps() as f64);
    // The finest runs determine the memory, the sum of all runs the time.
    let [most_nodes, most_steps] = [nodes, steps].map(|n| count(STUDY_REFINEMENT * n));
    CostEstimate {
        file: scene.path.clone(),
        key: "time.step",
        cause: format!("runs on up to {most_nodes} nodes in up to {most_steps} steps"),
        bytes: STUDY_REFINEMENT * (node.bytes * nodes + SERIES_BYTES * steps),
        seconds: STUDY_RUNS * node.step * nodes * steps,
        disk: 0.0,
    }
}

/// The cost of the fit file at `path`, by the [number of simulations](repeated_cost): [`FIT_RUNS`], and
/// [`REPLICATE_RUNS`] per replicate of bootstrap and Monte Carlo, and [`DRAW_RUNS`] per draw of the posterior.
pub fn fit_cost(file: &FitFile, path: PathBuf) -> CostEstimate {
    let replicates = file.analysis.bootstrap + file.analysis.monte_carlo;
    let draws = file.analysis.posterior.map_or(0, PosteriorSettings::total);
    let runs = REPLICATE_RUNS * replicates as f64 + DRAW_RUNS * draws as f64;
    repeated_cost(file, path, FIT_RUNS + runs)
}

/// The cost of a design with the fit file at `path`: [`DESIGN_RUNS`] simulations of every experiment.
pub fn design_cost(file: &FitFile, path: PathBuf) -> CostEstimate {
    repeated_cost(file, path, DESIGN_RUNS)
}

/// The cost of `runs` simulations of every experiment up to its last recorded time, with an equilibrium per
/// [`FIT_RUNS`] of them. Memory holds each recorded point with its derivatives by all parameters; no disk space.
fn repeated_cost(file: &FitFile, path: PathBuf, runs: f64) -> CostEstimate {
    let [mut bytes, mut seconds, mut most_steps, mut most_nodes] = [0.0_f64; 4];
    // Each recorded value has a derivative by every parameter.
    let record_bytes = RECORD_BYTES * (1.0 + file.unknowns.len() as f64);
    for experiment in &file.experiments {
        let problem = &experiment.problem;
        let node = problem_node_cost(problem);
        let nodes = problem.nodes() as f64;
        let motions = || experiment.measurements.iter().filter_map(Measurement::motion);
        let (steps, points) = (recorded_steps(experiment), motions().count() as f64);
        bytes += node.bytes * nodes + steps * points * record_bytes;
        seconds += runs * nodes * (node.step * steps + node.equilibrium / FIT_RUNS);
        (most_steps, most_nodes) = (most_steps.max(steps), most_nodes.max(nodes));
    }
    let cause = format!(
        "simulations of up to {} steps and {} nodes, {} of them",
        count(most_steps),
        count(most_nodes),
        count(runs * file.experiments.len() as f64)
    );
    CostEstimate { file: Some(path), key: "scene", cause, bytes, seconds, disk: 0.0 }
}

/// Number of time steps of an experiment until its last recorded time, at most until the end of the scene; 0 without
/// `[time]`.
fn recorded_steps(experiment: &Experiment) -> f64 {
    let times = experiment.measurements.iter().flat_map(|m| m.times());
    // Simulations of a fit end with the last sample.
    let end = times.flatten().fold(0.0, f64::max);
    let time = experiment.problem.scene().time.as_ref();
    time.map_or(0.0, |time| (end.min(time.end) / time.step_size()).ceil())
}

/// The number of nodes of a scene before its mesh exists: segments + 1 (1 if the program chooses them). For a polyline
/// without segments it is the number of its points, or an upper bound by the size of its file (0 if that is missing).
fn node_count(scene: &Scene) -> f64 {
    // A mesh that is too large must be rejected before its memory is allocated.
    match (&scene.rod.shape, scene.rod.segments) {
        (Shape::Polyline { points, .. }, None) if !points.is_empty() => points.len() as f64,
        (Shape::Polyline { file, .. }, None) => {
            let size = std::fs::metadata(at(&scene.folder(), file)).map_or(0, |found| found.len());
            size as f64 / MIN_ROW_BYTES
        }
        (_, segments) => segments.unwrap_or(0) as f64 + 1.0,
    }
}

/// The cost of a node of a scene, whose model is not chosen yet: that of a planar rod, unless the scene states a
/// spatial one.
fn node_cost(scene: &Scene) -> NodeCost {
    // Where the model is not yet known, the lower cost rejects no scene that is within the limits.
    if scene.rod.dimension == Dimension::Spatial { SPATIAL } else { PLANAR }
}

/// The measured cost of a node of a problem: [`PLANAR`] if its model is planar, else [`SPATIAL`].
fn problem_node_cost(problem: &Problem) -> NodeCost {
    if problem.planar().is_some() { PLANAR } else { SPATIAL }
}

/// Limits the threads of the global pool to [`MAX_THREADS`] if `RAYON_NUM_THREADS` is larger, with a warning unless
/// `--quiet`. No effect otherwise, or if a pool exists already.
pub fn limit_threads(global: GlobalOptions) {
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse::<usize>().ok());
    let Some(asked) = asked.filter(|n| *n > MAX_THREADS) else { return };
    // The global pool can be built only once, before its first use.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(MAX_THREADS).build_global();
    if pool.is_ok() && !global.quiet {
        let text = format_args!("RAYON_NUM_THREADS = {asked}; {MAX_THREADS} threads are used");
        terminal::warn(Code::FewerThreads, text);
    }
}

/// A count as text: an integer, or with one decimal and an exponent from 1e5 on.
fn count(n: f64) -> String {
    if n < 1e5 { format!("{n:.0}") } else { format!("{n:.1e}") }
}

/// A number of bytes as text, in MB, or in GB from 1e9 on.
fn size(bytes: f64) -> String {
    if bytes < 1e9 { format!("{:.0} MB", bytes / 1e6) } else { format!("{:.1} GB", bytes / 1e9) }
}

/// A duration, s, as text in a fitting unit: s, min (from 90 s on), h (from 90 min), days (from 48 h), years (from 370
/// days).
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.0} h", s / 3600.0),
        s if s < 3.2e7 => format!("{:.0} days", s / 86_400.0),
        s => format!("{:.0} years", s / 3.156e7),
    }
}

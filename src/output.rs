//! What `rodfit simulate` writes: a CSV of all nodes while it runs, a JSON report at the end.

use crate::error::Error;
use crate::point::Point;
use crate::problem::Problem;
use crate::scene::Scene;
use crate::simulation::Work;
use crate::trajectory::{Snapshot, Trajectory};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};

/// A CSV file with a row per step: `t`, then `x_i,y_i,z_i` of every node in world axes, m.
#[derive(Debug)]
pub struct NodeTable {
    path: PathBuf,
    nodes: usize,
    writer: csv::Writer<File>,
    row: Vec<String>,
}

impl NodeTable {
    /// Creates the file and writes its header for `nodes` nodes.
    pub fn create(path: &Path, nodes: usize) -> Result<Self, Error> {
        let file = File::create(path).map_err(|source| Error::io(path, source))?;
        let mut table = Self {
            path: path.into(),
            nodes,
            writer: csv::Writer::from_writer(file),
            row: Vec::new(),
        };
        let names = (0..nodes).flat_map(|i| ["x", "y", "z"].map(|axis| format!("{axis}_{i}")));
        table.row = std::iter::once("t".to_string()).chain(names).collect();
        table.write()?;
        Ok(table)
    }

    /// Appends the state of a simulation.
    pub fn push(&mut self, simulation: &dyn Snapshot) -> Result<(), Error> {
        let coordinates = (0..self.nodes).flat_map(|i| simulation.position(i));
        self.row.clear();
        self.row
            .extend(std::iter::once(simulation.time()).chain(coordinates).map(|x| x.to_string()));
        self.write()
    }

    fn write(&mut self) -> Result<(), Error> {
        self.writer.write_record(&self.row).map_err(|error| self.error(error.into()))
    }

    /// Writes what is still in memory.
    pub fn finish(&mut self) -> Result<(), Error> {
        self.writer.flush().map_err(|source| self.error(source))
    }

    fn error(&self, source: std::io::Error) -> Error {
        Error::io(&self.path, source)
    }
}

/// Writes a shape of a problem's rod as a CSV file with the columns x, y, z and s, m, and a row per
/// node: where it is in the world, and on the rod, by arc length from the wall. `initial.shape` reads
/// it as a polyline.
pub fn write_shape(path: &Path, problem: &Problem, nodes: &[[f64; 3]]) -> Result<(), Error> {
    let io = |source| Error::io(path, source);
    let mut writer = csv::Writer::from_path(path).map_err(|error| io(error.into()))?;
    writer.write_record(["x", "y", "z", "s"]).map_err(|error| io(error.into()))?;
    for (i, [x, y, z]) in nodes.iter().enumerate() {
        let s = problem.arc_length(Point::Node(i))?;
        writer.serialize([*x, *y, *z, s]).map_err(|error| io(error.into()))?;
    }
    writer.flush().map_err(io)
}

/// The JSON of `rodfit simulate`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SimulationReport {
    /// `planar` or `spatial`.
    pub model: String,
    /// Why this model.
    pub model_reason: String,
    /// Number of unknowns, supported ones included.
    pub dof: usize,
    /// Steps made and recorded; `work` counts the halves that failing ones were taken in.
    pub steps: usize,
    /// Newton iterations of all steps.
    pub newton_iterations: usize,
    /// All work counts.
    pub work: Work,
    /// Wall time of the stepping alone, s.
    pub wall_seconds: f64,
    /// `[t, x, y, z]` of the tip, s and m in world axes, from t = 0 on.
    pub tip: Vec<[f64; 4]>,
    /// `[t, kinetic, stretch, bend, twist, potential]`, s and J.
    pub energy: Vec<[f64; 6]>,
    /// `completed`, or what stopped it.
    pub status: String,
    /// The scene with its defaults.
    pub scene: Scene,
}

impl SimulationReport {
    /// A report of nothing yet.
    pub fn new(problem: &Problem) -> Self {
        let (model, model_reason) = problem.model();
        Self {
            model: model.into(),
            model_reason: model_reason.into(),
            dof: problem.dof(),
            steps: 0,
            newton_iterations: 0,
            work: Work::default(),
            wall_seconds: 0.0,
            tip: Vec::new(),
            energy: Vec::new(),
            status: "started".into(),
            scene: problem.scene().clone(),
        }
    }

    /// Appends the state of a simulation.
    pub fn push(&mut self, problem: &Problem, simulation: &dyn Snapshot) {
        let (t, e) = (simulation.time(), simulation.energies());
        let [x, y, z] = simulation.position(problem.nodes() - 1);
        self.tip.push([t, x, y, z]);
        self.energy.push([t, e.kinetic, e.stretch, e.bend, e.twist, e.potential]);
    }

    /// Takes the totals of a run and how it ended.
    pub fn finish(&mut self, trajectory: &Trajectory, outcome: &Result<(), Error>) {
        self.work = trajectory.work();
        self.steps = self.tip.len().saturating_sub(1);
        self.newton_iterations = self.work.newton_iterations;
        self.wall_seconds = trajectory.stepping().as_secs_f64();
        self.status = match outcome {
            Ok(()) => "completed".into(),
            Err(error) => format!("stopped: {error}"),
        };
    }

    /// Largest change of the total energy over the largest kinetic energy.
    pub fn energy_drift(&self) -> f64 {
        let total = |e: &[f64; 6]| e[1..].iter().sum::<f64>();
        let start = self.energy.first().map_or(0.0, total);
        let change = self.energy.iter().map(|e| (total(e) - start).abs()).fold(0.0, f64::max);
        change / self.energy.iter().map(|e| e[1]).fold(f64::MIN_POSITIVE, f64::max)
    }
}

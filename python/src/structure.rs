//! Structures (several rods and rigid bodies in one scene) in Python: read from TOML or JSON, their motion as numpy
//! arrays, equilibria and modes as JSON. Mesh and step are those of the scene.

use crate::error::raised;
use crate::json::{from_json, json_to_toml, raised_in_table, to_json};
use crate::scene::PyScene;
use crate::work::{WorkHooks, interruptible};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray4, PyArrayMethods};
use pyo3::prelude::*;
use rodfit::fit::Experiment;
use rodfit::scene::StructurePoint;
use rodfit::structure::NodeMotion;
use rodfit::{Error, Problem, Structure, StructureScene};
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// A structure, read and validated.
#[pyclass(frozen, name = "Structure", module = "rodfit._rodfit")]
pub struct PyStructure {
    structure: Structure,
    /// The problem that stands for the structure in fits.
    problem: Problem,
}

/// The motion of a structure in plain numbers.
struct StructureRecord {
    /// Times, s.
    times: Vec<f64>,
    /// Motions of all nodes at each time, m and m/s.
    motions: Vec<NodeMotion<f64>>,
    /// Kinetic energy, energies of stretching, bending and twisting, and potential of the loads, J.
    energies: Vec<[f64; 5]>,
}

/// Simulates a structure to the end time of its scene. The record has the start and every time step. Errors: no
/// `[time]`, a failed step, and a stop by `hooks`.
fn simulated(structure: &Structure, hooks: &WorkHooks) -> Result<StructureRecord, Error> {
    let time = structure.time()?.clone();
    let mut motion = structure.simulation()?;
    let mut record =
        StructureRecord { times: Vec::new(), motions: Vec::new(), energies: Vec::new() };
    for k in 0..=time.steps() {
        if hooks.stop.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        if k > 0 {
            motion.step_to(time.at(k))?;
        }
        let (simulation, energies) = (motion.simulation(), motion.energies());
        let state = simulation.state();
        record.times.push(motion.time());
        record.motions.extend(structure.node_motions(
            simulation.rod(),
            [&state.q, &state.v],
            &state.frames,
        ));
        let e = energies;
        record.energies.push([e.kinetic, e.stretch, e.bend, e.twist, e.potential + e.own]);
    }
    Ok(record)
}

impl PyStructure {
    /// The Python object of a structure.
    fn of(py: Python<'_>, scene: StructureScene) -> PyResult<Self> {
        let made = || {
            let problem = Experiment::of_structure("", scene.clone())?.problem;
            Ok(Self { structure: Structure::new(scene)?, problem })
        };
        made().map_err(|error| raised(py, error))
    }
}

/// A simulated motion of a structure.
#[pyclass(frozen, name = "StructureRun", module = "rodfit._rodfit")]
pub struct PyStructureRun {
    structure: Structure,
    /// Times, s.
    #[pyo3(get)]
    t: Py<PyArray1<f64>>,
    /// Positions and velocities of all nodes: (times, nodes, 2, 3), m and m/s.
    #[pyo3(get)]
    motion: Py<PyArray4<f64>>,
    /// Kinetic energy, energies of stretching, bending and twisting, and potential of the loads: (times, 5), J.
    #[pyo3(get)]
    energies: Py<PyArray2<f64>>,
}

#[pymethods]
impl PyStructureRun {
    /// Names of the rods with the number of nodes of each, in the order of the nodes.
    fn rods(&self) -> Vec<(String, usize)> {
        let rods = self.structure.scene().rods.iter().zip(&self.structure.at_rest().meshes);
        rods.map(|(rod, mesh)| (rod.name.clone(), mesh.nodes.len())).collect()
    }

    /// Interpolation of a point (`point` in JSON): indices of nodes and their weights. The sum of weights times node
    /// positions is the position of the point. An error for a point that the structure does not have.
    fn stencil(&self, py: Python<'_>, point: &str) -> PyResult<(Vec<usize>, Vec<f64>)> {
        let point: StructurePoint = from_json(py, "at", point)?;
        let stencil = self.structure.nodes().stencil(&point, "at");
        Ok(stencil.map_err(|error| raised(py, error))?.nodes.into_iter().unzip())
    }
}

#[pymethods]
impl PyStructure {
    /// The structure of a file (TOML).
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Self::of(py, StructureScene::load(path).map_err(|error| raised(py, error))?)
    }

    /// The structure of a TOML text, whose paths are relative to `folder`.
    #[staticmethod]
    fn from_toml(py: Python<'_>, text: &str, folder: PathBuf) -> PyResult<Self> {
        let scene = StructureScene::from_toml(text, folder);
        Self::of(py, scene.map_err(|error| raised(py, error))?)
    }

    /// The structure of a table in JSON, with paths relative to `folder`.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str, folder: PathBuf) -> PyResult<Self> {
        let text = json_to_toml(py, text)?;
        let scene = StructureScene::from_toml(&text, folder);
        Self::of(py, scene.map_err(|error| raised_in_table(py, &text, error))?)
    }

    /// The structure as TOML.
    fn to_toml(&self, py: Python<'_>) -> PyResult<String> {
        self.problem.scene().to_toml().map_err(|error| raised(py, error))
    }

    /// The structure as a scene, as fits use it: with its parameters, mesh and step.
    fn scene(&self) -> PyScene {
        PyScene::of_problem(self.problem.clone())
    }

    /// Simulates the structure to the end time of its scene and returns the motion of all nodes with energies. Ctrl-C
    /// stops the run.
    fn simulate(&self, py: Python<'_>) -> PyResult<PyStructureRun> {
        let structure = self.structure.clone();
        let run = move |hooks: WorkHooks| {
            let record = simulated(&structure, &hooks)?;
            Ok((structure, record))
        };
        let (structure, record) = interruptible(py, None, run)?;
        let StructureRecord { times, motions, energies } = record;
        let steps = times.len();
        let shape = [steps, motions.len() / steps.max(1), 2, 3];
        let motion = motions.into_flattened().into_flattened().into_pyarray(py).reshape(shape)?;
        let energies = energies.into_flattened().into_pyarray(py).reshape([steps, 5])?;
        Ok(PyStructureRun {
            structure,
            t: times.into_pyarray(py).unbind(),
            motion: motion.unbind(),
            energies: energies.unbind(),
        })
    }

    /// The equilibrium of the structure under its loads, with its stability, as JSON; an error if none is found.
    fn equilibrium(&self, py: Python<'_>) -> PyResult<String> {
        let find = || {
            let mut found = self.structure.equilibrium()?;
            self.structure.add_mesh_error(&mut found);
            Ok(found)
        };
        to_json(py, &py.detach(find).map_err(|error: Error| raised(py, error))?)
    }

    /// The `count` lowest modes of vibration about the equilibrium, as JSON.
    fn modes(&self, py: Python<'_>, count: usize) -> PyResult<String> {
        let find = || {
            let mut found = self.structure.modes(count, false)?;
            self.structure.add_mesh_errors(count, false, &mut found);
            Ok(found)
        };
        to_json(py, &py.detach(find).map_err(|error: Error| raised(py, error))?)
    }
}

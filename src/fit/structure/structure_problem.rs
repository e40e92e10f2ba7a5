//! The problem of a structure in a fit: a straight rod that represents it, and the structure of such a problem.
//!
//! [`representative_problem`] converts a structure's scene to a problem of one straight rod. It has the total length
//! and the total number of edges of all rods, with section and material of the first rod. For a structure in a plane it
//! is planar and in this plane, else spatial. It is never simulated: it gives the scales of length and work, the plane,
//! the time, the damping and the camera. Its scene contains the structure, whose numbers are the parameters. A scene
//! that is not valid is an error. [`representative_rod`] is its scene before meshes are built, for limits of memory.
//!
//! [`structure_of`] returns the structure with the time step of the problem (its own `beta` and `rho_inf`), or `None`
//! for a scene of one rod. If the problem is remeshed, the edges of each rod change by the same factor, to at least
//! [`FEWEST_EDGES`]. [`refuse_structure`] rejects structures in functions that are defined for one rod only.

use crate::error::{Error, ensure};
use crate::problem::Problem;
use crate::scene::rod::Dimension;
use crate::scene::{Initial, InitialState, Scene, Shape, StructureScene, Time};
use crate::structure::Structure;

/// Acceleration that orients the plane of the representative rod, m/s^2. It has no other effect.
const ORIENTING_GRAVITY: f64 = 9.81;
/// Fewest edges of a rod on another mesh.
const FEWEST_EDGES: f64 = 6.0;

/// The scene of the rod that represents a structure, before anything is built: a straight rod along x with the total
/// number of edges, and section, material, damping, time and camera of the structure. Its length counts polylines as
/// zero, and its dimension is that of the scene, which may be left to the program.
///
/// # Errors
/// [`Error::Invalid`] for scenes that are not valid.
pub(crate) fn representative_rod(scene: &StructureScene) -> Result<Scene, Error> {
    scene.validate()?;
    let edges = scene.rods.iter().map(|rod| rod.segments);
    let length = scene.rods.iter().map(|rod| rod.shape.length()).sum();
    let shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
    let first = &scene.rods[0];
    let material = scene.material_of(first)?;
    let total = edges.fold(0, usize::saturating_add);
    let mut rod = Scene::new(total, shape, first.section.clone(), material);
    rod.rod.dimension = scene.dimension;
    rod.loads.damping = scene.loads.damping.clone();
    // A recorded start of the structure needs the recording of a rod; any start but rest is the same here.
    let state = match scene.initial.state {
        InitialState::Recorded => InitialState::Equilibrium,
        state => state,
    };
    rod.initial = Initial { state, ..Initial::default() };
    rod.time.clone_from(&scene.time);
    rod.camera = scene.camera;
    rod.path.clone_from(&scene.path);
    Ok(rod)
}

/// The problem of a straight rod that represents a structure, with the structure in its scene, as the header describes
/// it.
///
/// # Errors
/// [`Error::Invalid`] for scenes that are not valid.
pub(crate) fn representative_problem(scene: StructureScene) -> Result<Problem, Error> {
    let mut rod = representative_rod(&scene)?;
    let structure = Structure::new(scene)?;
    // Mesh and plane are those of the structure that was built.
    let axes = structure.plane_axes();
    let [direction, across] = axes.unwrap_or([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    rod.rod.shape = Shape::Straight { length: structure.length(), direction };
    rod.rod.segments = Some(structure.segments());
    rod.rod.dimension = if axes.is_some() { Dimension::Planar } else { Dimension::Spatial };
    rod.loads.gravity = across.map(|x| -ORIENTING_GRAVITY * x);
    rod.structure = Some(Box::new(structure.scene().clone()));
    rod.build()
}

/// The structure of a problem, on the mesh and with the time step of the problem; None for a problem of one rod.
/// Derivatives of energies are by hand-derived formulas or dual numbers, as in the problem.
///
/// # Errors
/// [`Error::Invalid`] for numbers that are not allowed.
pub(crate) fn structure_of(problem: &Problem) -> Result<Option<Structure>, Error> {
    let Some(scene) = &problem.scene().structure else { return Ok(None) };
    let mut scene = (**scene).clone();
    if let (Some(own), Some(time)) = (&scene.time, &problem.scene().time) {
        // The fit refines step and scheme of the problem; these two numbers stay those of the structure.
        let (beta, rho_inf) = (own.beta, own.rho_inf);
        scene.time = Some(Time { beta, rho_inf, ..time.clone() });
    }
    let edges: usize = scene.rods.iter().map(|rod| rod.segments).sum();
    if problem.segments() != edges {
        let ratio = problem.segments() as f64 / edges as f64;
        // The problem has one number of edges: its ratio is the refinement of every rod.
        for rod in &mut scene.rods {
            let count = (ratio * rod.segments as f64).round().max(FEWEST_EDGES);
            rod.remeshed = Some(count as usize);
        }
    }
    Ok(Some(Structure::new(scene)?.with_derivatives(problem.derivatives())))
}

/// Rejects the problem of a structure in a function that is defined for one rod only. The error is [`Error::Invalid`]
/// with the `key`; `name` is that of the function, for the message.
pub(crate) fn refuse_structure(problem: &Problem, key: &str, name: &str) -> Result<(), Error> {
    let is_rod = problem.scene().structure.is_none();
    let allowed = format!("a scene of one rod, as {name} is not defined for structures");
    ensure(is_rod, key, "a structure ([[rods]])", allowed)
}

//! Choice of mesh, step and scheme of a scene that leaves them out, for the error that it requests.
//!
//! Input: a scene of one rod with `accuracy`, the requested error over the rod length (default 0.1 %). For a motion,
//! trial runs refine the mesh or the step, in general whichever has the larger error (`motion`). The differences of
//! positions between successive runs, at the times of `samples`, estimate both errors (`difference`). The numerics with
//! the least work that reach the requested error by extrapolation are chosen (`refinement`; `rodas4` as an alternative
//! scheme), or the most accurate ones within limits of work. The chosen run is compared with the last trial run, and
//! repeated with finer numerics where it disagrees or fails (`check`). Equilibria and modes need a mesh only, which is
//! doubled until the extrapolated error suffices (`static_mesh`). If the scene gives the mesh, its error is estimated
//! from another one (`given_mesh`, and `structure_mesh` for structures).
//!
//! Output: a [`Problem`] with these numerics and the estimated error ([`Scene::problem`]; [`Scene::problem_for`] for a
//! stated calculation), and the check of its run ([`Scene::checked_problem`]). Numerics that the scene gives are kept.
//! Errors are invalid scenes and files, and of equilibria and modes failed solutions. `cargo run --release --example
//! chosen_numerics` compares estimated with true errors, and gives the costs.

mod basis;
mod beside_walls;
mod calculation;
mod check;
mod difference;
mod extrapolation;
mod given_mesh;
mod mesh_comparison;
mod motion;
mod refinement;
mod rodas4;
mod samples;
mod static_mesh;
mod structure_mesh;
mod trial;
mod tuning;

pub use calculation::Calculation;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to Calculation")]
pub use calculation::Calculation as Aim;
pub use check::{Attempt, RunAssessment, RunCheck, RunMonitor, run_checked, simulate_checked};

pub(crate) use difference::{Positions, largest_distance};
pub(crate) use extrapolation::{Extrapolation, smooth_mesh_order, step_order};
pub(crate) use refinement::ErrorModel;
pub(crate) use trial::largest_step;

use crate::accuracy::basis::ChosenMotion;
use crate::accuracy::beside_walls::edges_beside_walls;
use crate::accuracy::calculation::{
    MAX_SEGMENTS, RUN_TOLERANCE, allowed_edges, set_newton_tolerance,
};
use crate::accuracy::motion::MotionSearch;
use crate::accuracy::static_mesh::{StaticMesh, choose_static_mesh};
use crate::error::Error;
use crate::problem::Problem;
use crate::problem::natural_turn::turning;
use crate::scene::Scene;
use crate::scene::resolution::Bound;
use std::f64::consts::FRAC_PI_2;

/// Edges of the first trial mesh of a straight rod in motion: coarse meshes are inexpensive, and later runs refine
/// them.
const FIRST_EDGES: f64 = 4.0;
/// The same for equilibria and modes at an accuracy of 1 %. The number grows with the fourth root of 1 % over the
/// accuracy.
const FIRST_EDGES_STILL: f64 = 6.0;
/// Largest turning angle of an edge of the first mesh, rad.
const FIRST_TURN: f64 = 1.5;
/// Factor on a request that is out of reach for the next search.
const LOWERED_REQUEST: f64 = 10.0;
/// Largest error over the length that is requested in place of one that is out of reach.
const LARGEST_REQUEST: f64 = 1e-2;
/// Steps of the first trial run in the shortest time scale of the scene. Fewer steps may fail; more cost time.
const FIRST_STEPS: f64 = 5.0;

impl Scene {
    /// Validates the scene, [chooses](self) mesh, step and scheme where they are left out, and builds the problem of a
    /// simulation: of a motion if the scene has `[time]`, else of an equilibrium. With `accuracy` a motion with given
    /// numerics has an estimated error too.
    ///
    /// ```
    /// let problem = rodfit::Scene::load("data/cantilever.toml")?.problem()?;
    /// assert_eq!(problem.model().0, "planar");
    /// assert_eq!((problem.nodes(), problem.length()), (51, 0.5)); // m
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] with file, key, found and allowed content. Where something is to be chosen, also those of
    /// reading data files and of the trial solutions.
    pub fn problem(&self) -> Result<Problem, Error> {
        self.problem_for(if self.time.is_some() { Calculation::Motion } else { Calculation::Rest })
    }

    /// The problem of a simulation with its chosen numerics, estimated error and the work of the search, and the check
    /// of its run. With `accuracy` the error is also estimated where nothing is left out. The check is `None` without
    /// `[time]`, where nothing is left out, or where no trial run succeeded. It repeats a run only if the step is left
    /// out.
    ///
    /// # Errors
    /// Those of [`problem`](Self::problem).
    pub fn checked_problem(&self) -> Result<(Problem, Option<RunCheck>), Error> {
        self.validate()?;
        let open = self.left_open();
        // The error of given numerics is estimated only if an accuracy is requested.
        if self.time.is_none() || !open.any() && self.accuracy.is_none() {
            return Ok((self.problem()?, None));
        }
        let first = InitialNumerics::of(self, Calculation::Motion)?;
        let (ChosenMotion { numerics, step, error, bound, basis }, work) =
            most_accurate_motion(&first)?;
        let scene = first.scene;
        let mut chosen = scene.resolved(numerics.segments, step).by(numerics.scheme);
        if let Some(resolution) = &mut chosen.resolution {
            resolution.error = error.filter(|error| error.is_finite());
            (resolution.bound, resolution.work) = (bound, work);
        }
        // Errors of Newton's method must stay far below those of mesh and step.
        set_newton_tolerance(&mut chosen, RUN_TOLERANCE);
        let check = basis
            // A run with given numerics is never repeated: it needs no check.
            .filter(|_| open.any())
            .map(|basis| RunCheck::new(&scene, basis, open.step, work));
        Ok((chosen.build()?, check))
    }

    /// The problem with mesh, step and scheme [chosen](self) for a calculation, where the scene leaves them out. A
    /// motion has an estimated error, as have an equilibrium and modes if the mesh is left out. A first guess has the
    /// first mesh and step. Without anything left out the problem is built as given; a motion with `accuracy` also has
    /// an estimated error.
    ///
    /// # Errors
    ///
    /// Those of [`problem`](Self::problem), and of the trial solutions.
    pub fn problem_for(&self, calculation: Calculation) -> Result<Problem, Error> {
        self.validate()?;
        let open = self.left_open();
        let checked = self.accuracy.is_some() && calculation == Calculation::Motion;
        if !open.any() && !checked {
            return self.build();
        }
        if calculation == Calculation::Motion {
            return Ok(self.checked_problem()?.0);
        }
        let InitialNumerics { scene, edges, step, .. } = InitialNumerics::of(self, calculation)?;
        let StaticMesh { segments, error, bound } = match calculation {
            Calculation::Rest | Calculation::Modes(_) if open.segments => {
                choose_static_mesh(&scene, calculation, edges, step)?
            }
            _ => StaticMesh { segments: edges, error: None, bound: None },
        };
        let mut scene = scene.resolved(segments, step);
        if let Some(resolution) = &mut scene.resolution {
            let known = error.filter(|error| error.is_finite());
            (resolution.error, resolution.bound) = (known, bound);
        }
        scene.build()
    }
}

/// The numerics of a motion for the request of its scene, and the work of the search, edges times Newton iterations.
/// Where the limit of work prevents that error, the searches of requests larger by [`LOWERED_REQUEST`] follow, up to
/// [`LARGEST_REQUEST`], until one reaches its own. Of all numerics those with the smallest estimated error are
/// returned, so that this error is at most that of each of these larger requests. Error: an error of the input.
fn most_accurate_motion(first: &InitialNumerics) -> Result<(ChosenMotion, f64), Error> {
    let mut scene = first.scene.clone();
    let mut search = MotionSearch::new(&first.scene, first.guess.clone())?;
    let mut best = search.choose(first.step)?;
    let (mut work, mut bound) = (search.work(), best.bound);
    while bound == Some(Bound::Work) && scene.asked() < LARGEST_REQUEST {
        scene.accuracy = Some((LOWERED_REQUEST * scene.asked()).min(LARGEST_REQUEST));
        let InitialNumerics { scene, step, guess, .. } =
            InitialNumerics::of(&scene, Calculation::Motion)?;
        let mut search = MotionSearch::new(&scene, guess)?;
        let other = search.choose(step)?;
        work += search.work();
        bound = other.bound;
        let is_smaller = |error: f64| best.error.is_none_or(|best| error < best);
        if other.error.is_some_and(is_smaller) {
            // A search for a larger request may happen to reach the request of the scene: then no reason remains.
            let exceeds = other.error.is_none_or(|error| error > first.scene.asked());
            best = ChosenMotion { bound: best.bound.filter(|_| exceeds), ..other };
        }
    }
    Ok((best, work))
}

/// The numerics with which a search begins: a scene with its files read, its first number of edges and its first step,
/// s.
struct InitialNumerics {
    /// The scene with the files of its shape read, and its numerics as given.
    scene: Scene,
    /// First number of edges.
    edges: usize,
    /// First step, s; 0 without `[time]`.
    step: f64,
    /// The scene with that mesh and step.
    guess: Scene,
}

impl InitialNumerics {
    /// The numerics with which the search begins for a scene and a purpose: the first number of edges and the first
    /// step, s (0 without `[time]`). Reads the files of the rod's shape. An error for such a file, or for a rod that
    /// needs more than [`MAX_SEGMENTS`] edges.
    fn of(scene: &Scene, calculation: Calculation) -> Result<Self, Error> {
        let mut scene = scene.clone();
        let path = scene.path.clone();
        scene.read_shapes().map_err(|error| error.in_file(path.as_deref()))?;
        let edges = first_edges(&scene, calculation)?;
        let step = first_step(&scene, edges)?;
        let guess = scene.resolved(edges, step);
        Ok(Self { scene, edges, step, guess })
    }
}

/// Edges of the first trial mesh for a purpose: at least [`FIRST_EDGES`] for a motion and [`FIRST_EDGES_STILL`] times
/// [`fineness`] otherwise. The turning angle of the rod, an upper bound for rest shape and stress-free shape, is at
/// most [`FIRST_TURN`] per edge. Modes have at least two edges each. Loads beside walls act on free nodes
/// ([`edges_beside_walls`]). An error above [`MAX_SEGMENTS`]. The number is then rounded up so that markers of a
/// recorded path are at nodes.
fn first_edges(scene: &Scene, calculation: Calculation) -> Result<usize, Error> {
    let shape = &scene.rod.shape;
    // Edges are chords: too few of them would change the shape of a curved rod.
    let turning = turning(scene, shape.turning().unwrap_or(0.0), shape.length());
    let fine = match calculation {
        Calculation::Motion => FIRST_EDGES,
        _ => FIRST_EDGES_STILL * fineness(scene),
    };
    // Mode k has about k half waves, with two edges each at least.
    let modes = if let Calculation::Modes(count) = calculation { 2.0 * count as f64 } else { 0.0 };
    // Loads and masses beside a wall act on free nodes.
    let beside_walls = edges_beside_walls(scene, shape.length());
    let edges = fine.max(turning / FIRST_TURN).max(modes).max(beside_walls).ceil() as usize;
    if edges > MAX_SEGMENTS {
        let found = format!("no value, for a rod that needs {edges} segments");
        let allowed = format!(
            "a number, or no value for a rod that needs at most {MAX_SEGMENTS} \
                               segments"
        );
        return Err(Error::invalid("rod.segments", found, allowed));
    }
    Ok(allowed_edges(scene, edges))
}

/// Factor on the number of edges of the first mesh of equilibria and modes: the fourth root of 1 % over the requested
/// accuracy, at least 1.
fn fineness(scene: &Scene) -> f64 {
    (1e-2 / scene.asked()).max(1.0).powf(0.25)
}

/// The lowest angular frequency of torsion, `pi/(2 L) sqrt(G/rho)` as of a round section, of a rod with natural twist
/// and this `length` L, m, held at one end, rad/s. Zero without natural twist, or without shear modulus and Poisson's
/// ratio. It limits the first trial step: larger steps damp torsion and the bending that couples with it on every mesh,
/// so that differences between runs do not contain it.
fn torsional_rate(scene: &Scene, length: f64) -> f64 {
    let is_twisted = !scene.rod.natural_twist.is_zero();
    let (_, material) = scene.at(0.5);
    let shear = material.shear_modulus.or_else(|| {
        let ratio = material.poisson_ratio?;
        Some(0.5 * material.youngs_modulus / (1.0 + ratio))
    });
    let rate = |shear: f64| FRAC_PI_2 / length * (shear / material.density).sqrt();
    shear.filter(|_| is_twisted).map_or(0.0, rate)
}

/// The first trial step, s: the shortest time scale of the scene, or its end time if that is shorter, over
/// [`FIRST_STEPS`]. The time scale is `2 pi` over the largest of five rates, rad/s. One is `sqrt(12.4 E I/(rho A L^4))`
/// of the first bending mode of a cantilever with the larger `I`, in the middle of the rod. The second is `sqrt((g +
/// F/m)/L)`, with the mass `m` of the rod by its middle. `F` is the sum of the sizes of all point loads, those of
/// `initial` too, and line loads. The others are [`torsional_rate`], the initial velocity over `L`, and the initial
/// angular velocity. The step is at most the mean sample interval of a recorded path, and resolves the motions of
/// supports and the signals well. Zero without `[time]`. Error: no mesh, or a path that is not read.
fn first_step(scene: &Scene, edges: usize) -> Result<f64, Error> {
    let Some(time) = &scene.time else { return Ok(0.0) };
    let (section, material) = scene.at(0.5);
    let (moments, length) = (section.moments(), scene.resolved(edges, 1.0).mesh()?.length);
    let [i1, i2] = moments.second_moments;
    let per_length = material.density * moments.area;
    let bending = material.youngs_modulus * i1.max(i2) / (per_length * length.powi(4));
    let size = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    // Loads count as an additional weight: their sum over the mass of the rod is an acceleration.
    let pulls = scene.loads.point.iter().chain(&scene.initial.point).map(|load| size(&load.force));
    let lines = scene.loads.line.iter().map(|line| line.size(length));
    let pull = pulls.chain(lines).sum::<f64>() / (per_length * length);
    // 12.4 is the fourth power of 1.875, the first root of the frequency equation of a cantilever.
    let squares = [12.4 * bending, (size(&scene.loads.gravity) + pull) / length];
    let rates = [
        torsional_rate(scene, length),
        squares.into_iter().fold(0.0, f64::max).sqrt(),
        size(&scene.initial.velocity) / length,
        size(&scene.initial.angular_velocity),
    ];
    let shortest = std::f64::consts::TAU / rates.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    let frames = scene.supports.path.as_ref().map(|path| path.track()).transpose()?;
    // Longer steps would skip samples of the prescribed motion.
    let frame = frames.map_or(f64::INFINITY, |track| track.end() / track.times().len() as f64);
    let good = scene.largest_good_step();
    Ok((shortest.min(time.end) / FIRST_STEPS).min(good).min(frame))
}

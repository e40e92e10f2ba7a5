//! Work-precision study: error of the tip against wall-clock time, over schemes, meshes and time steps.
//!
//! The scene is simulated with every scheme that supports it, on meshes of 1/4 to 4 times its edges (with markers at
//! nodes, at least two edges). Implicit schemes take 4 to 1/8 times its step, explicit ones three fractions of the
//! largest stable step. Finer steps on a mesh are skipped once the step error is below `NEGLIGIBLE_STEP_ERROR` of the
//! mesh error.
//!
//! The reference is the continuum limit: runs with the finest step on 4 and on 8 times the edges, extrapolated to edges
//! of zero length (Richardson). They are runs of `rodas4` with 1/8 of the step, or of Newmark-beta with 1/16 where the
//! scene does not allow `rodas4`. Errors are largest distances of the tip over the length. The error of a run is its
//! difference from the reference. Its parts are the difference from the finest step on the same mesh (step error), and
//! that of this one from the reference (mesh error). The reported error of the reference is an estimate: the smallest
//! difference of a run from it.
//!
//! A scene with a given mesh (forces or masses on nodes by index) is studied on that mesh alone. The reference is a run
//! on it with 1/16 of the step, smaller than those of implicit schemes. [`Study::new`] returns a [`Study`] with all
//! runs, those that stopped with the reason, and the fastest one for errors of 0.1 to 1e-6. A scene without `[time]`,
//! or a reference run that fails, is an error.

mod display;
mod measured_run;

use crate::accuracy::{
    Extrapolation, Positions, largest_distance, largest_step, smooth_mesh_order,
};
use crate::error::Error;
use crate::problem::Problem;
use crate::scene::{Recorded, Scene, Scheme};
use crate::study::measured_run::MeasuredRun;
use serde::{Deserialize, Serialize};

/// Time steps of implicit schemes, as multiples of that of the scene.
const STEPS: [f64; 6] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.125];
/// Numbers of edges, as multiples of that of the scene.
const MESHES: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Time steps of explicit schemes, as fractions of the largest stable one.
const EXPLICIT_STEPS: [f64; 3] = [0.95, 0.5, 0.25];
/// Number of edges of the reference, as a multiple of that of the scene.
const REFERENCE_MESH: f64 = 8.0;
/// The scheme of the reference, one of high order, and its step as a fraction of that of the scene.
const REFERENCE: (Scheme, f64) = (Scheme::Rodas4, 0.125);
/// Scheme and step of the reference for scenes whose damping or supports [`REFERENCE`] does not support.
const FALLBACK_REFERENCE: (Scheme, f64) = (Scheme::NewmarkBeta, 0.0625);
/// Step of the reference on a given mesh, as a fraction of that of the scene: smaller than those in [`STEPS`].
const STEP_ON_GIVEN_MESH: f64 = 0.0625;
/// A mesh is not run with finer steps once the step error is below this fraction of the mesh error.
const NEGLIGIBLE_STEP_ERROR: f64 = 0.1;
/// Parameter beta of schemes that have none, and of Newmark-beta without dissipation.
const DEFAULT_BETA: f64 = 0.5;

/// Number of errors for which the fastest run is listed: 0.1, 0.01, .. of the rod length.
const LISTED_ERRORS: i32 = 6;

/// A run of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct StudyRow {
    /// The time integrator.
    pub scheme: Scheme,
    /// Parameter of the Newmark-beta scheme; 0.5 for schemes without it.
    pub beta: f64,
    /// Time step, s.
    pub step: f64,
    /// Number of edges.
    pub segments: usize,
    /// Largest distance of the tip from that of the reference, over the length of the rod; absent when the run
    /// failed.
    pub error: Option<f64>,
    /// The part of `error` by the time step: the difference from the finest step on the same mesh.
    pub step_error: Option<f64>,
    /// The part of `error` by the mesh: that of the finest step on this mesh.
    pub mesh_error: f64,
    /// Wall time of the stepping, s, the shortest of up to three runs.
    pub wall_seconds: f64,
    /// Newton iterations of all steps.
    pub newton_iterations: usize,
    /// Largest change of the energy over the largest kinetic energy.
    pub energy_drift: f64,
    /// `completed`, or why the run stopped.
    pub status: String,
}

/// The fastest run for an error of the tip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FastestRun {
    /// Largest error of the tip over the length.
    pub error: f64,
    /// Index of the run among the rows; absent when no run is that accurate.
    pub row: Option<usize>,
}

/// A work-precision study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Study {
    /// All runs, in the order of schemes, meshes and steps.
    pub rows: Vec<StudyRow>,
    /// Estimated error of the reference, over the length: the smallest difference of a run from it.
    pub reference_error: f64,
    /// The fastest run for each of several errors, from large to small.
    pub advice: Vec<FastestRun>,
}

/// Scheme and parameter beta of a run.
#[derive(Clone, Copy)]
struct Integrator {
    scheme: Scheme,
    beta: f64,
}

impl Integrator {
    /// Whether the scheme is explicit: its step is limited by stability.
    fn is_explicit(self) -> bool {
        self.scheme.traits().stability_limit.is_some()
    }

    /// Time steps as fractions of the largest stable one for an explicit scheme, and as multiples of that of the scene
    /// for others; from large to small.
    fn steps(self) -> &'static [f64] {
        if self.is_explicit() { &EXPLICIT_STEPS } else { &STEPS }
    }
}

/// The run with the finest step on a mesh: number of edges and positions of the tip, m, at the sampled times.
struct FinestRun {
    segments: usize,
    tip: Positions,
}

/// The positions of the tip, m, at each time in the limit of edges of zero length, by Richardson extrapolation from two
/// meshes: `x + (x - y)/(r^p - 1)` with x on the fine mesh, y on the coarse one and the ratio r of their numbers of
/// edges. The order of convergence p is that of smooth motions of the scene, 1 or 2.
fn continuum_limit(coarse: &FinestRun, fine: &FinestRun, scene: &Scene) -> Positions {
    let ratio = fine.segments as f64 / coarse.segments as f64;
    let error = Extrapolation { ratio, order: smooth_mesh_order(scene) }.error_after();
    let limit = |(coarse, fine): (&[f64; 3], &[f64; 3])| {
        std::array::from_fn(|c| fine[c] + error * (fine[c] - coarse[c]))
    };
    coarse.tip.iter().zip(&fine.tip).map(limit).collect()
}

/// Numbers of edges on which a scene is studied, ascending: [`MESHES`] times its own, at least 2, rounded to numbers
/// that keep recorded markers at nodes; equal ones once. Its own only if the mesh is given.
fn mesh_sizes(problem: &Problem, scene: &Scene) -> Vec<usize> {
    if scene.mesh_is_given() {
        return vec![problem.segments()];
    }
    // Recorded markers are at nodes: each span between two of them has a whole number of edges.
    let spans = scene.supports.path.as_ref().map_or(1, Recorded::spans);
    let edges_per_span = problem.segments() as f64 / spans as f64;
    let least = if spans == 1 { 2 } else { 1 };
    let size = |factor: f64| ((edges_per_span * factor).round() as usize).max(least) * spans;
    let mut sizes: Vec<usize> = MESHES.map(size).to_vec();
    sizes.dedup();
    sizes
}

/// The schemes that support all terms of the scene, with beta 0.5. The scene's own Newmark-beta is added if it
/// dissipates energy by a larger beta. An error without `[time]`.
fn integrators(problem: &Problem, scene: &Scene) -> Result<Vec<Integrator>, Error> {
    let time = problem.time()?;
    let taken = Scheme::all().filter(|scheme| scene.is_supported_by(*scheme));
    let mut all: Vec<Integrator> =
        taken.map(|scheme| Integrator { scheme, beta: DEFAULT_BETA }).collect();
    // A dissipative scheme of the scene is compared with the others.
    if time.scheme.takes_beta() && time.beta > DEFAULT_BETA {
        all.push(Integrator { scheme: time.scheme, beta: time.beta });
    }
    Ok(all)
}

impl Study {
    /// Runs the study, on the mesh and step that the program chooses where the scene gives none. `progress` is called
    /// with the number of finished runs and the number of all runs. On a mesh, finer steps are skipped once the step
    /// error is below `NEGLIGIBLE_STEP_ERROR` of the mesh error; an explicit scheme also skips a mesh on which the
    /// largest step of an earlier explicit scheme was that accurate. Skipped runs count as finished. Runs that stop are
    /// rows with the reason. The fastest runs are listed for errors of 0.1 to 1e-6 of the length.
    ///
    /// # Errors
    ///
    /// A scene that is not valid or has no `[time]`, a reference run that fails, or a run that cannot begin.
    pub fn new(scene: &Scene, mut progress: impl FnMut(usize, usize)) -> Result<Self, Error> {
        let problem = scene.problem()?;
        // The scene with the chosen mesh and step if it has none.
        let scene = problem.scene();
        let (step, length) = (problem.time()?.step_size(), problem.length());
        let is_given = scene.mesh_is_given();
        let meshes = mesh_sizes(&problem, scene);
        let integrators = integrators(&problem, scene)?;
        let steps: usize = integrators.iter().map(|integrator| integrator.steps().len()).sum();
        let total = meshes.len() * (steps + 1) + usize::from(!is_given);
        let mut done = 0;
        let mut count_run = || {
            done += 1;
            progress(done, total);
        };
        let problem_with = |integrator: Integrator, step: f64, segments: usize| {
            let mut scene = scene.clone();
            // With other edges, forces and masses on nodes by index would move.
            if !is_given {
                scene.rod.segments = Some(segments);
            }
            if let Some(time) = &mut scene.time {
                let Integrator { scheme, beta } = integrator;
                (time.scheme, time.beta, time.step) = (scheme, beta, Some(step));
            }
            scene.build()
        };

        // The finest step on every mesh, and on a finer mesh than any.
        let is_taken = scene.is_supported_by(REFERENCE.0);
        let (scheme, factor) = if is_taken { REFERENCE } else { FALLBACK_REFERENCE };
        let factor = if is_given { STEP_ON_GIVEN_MESH } else { factor };
        let finest = Integrator { scheme, beta: DEFAULT_BETA };
        let reference_mesh = (problem.segments() as f64 * REFERENCE_MESH).round() as usize;
        let mut fine: Vec<FinestRun> = Vec::new();
        for segments in meshes.iter().copied().chain((!is_given).then_some(reference_mesh)) {
            let run = MeasuredRun::new(&problem_with(finest, step * factor, segments)?)?;
            fine.push(FinestRun { segments, tip: run.tip? });
            count_run();
        }
        let reference = &match &fine[..] {
            [.., coarse, fine] => continuum_limit(coarse, fine, scene),
            given => given.iter().flat_map(|run| run.tip.iter().copied()).collect(),
        };

        let mut rows = Vec::new();
        // Meshes on which the largest stable step of an explicit scheme has a negligible error: others of low order
        // have the same.
        let mut settled_meshes = Vec::new();
        for integrator in integrators {
            for FinestRun { segments, tip } in &fine[..meshes.len()] {
                // Error of the finest step on this mesh, and the largest stable step of an explicit scheme.
                let mesh_error = largest_distance(tip, reference) / length;
                let largest = largest_step(&problem_with(integrator, step, *segments)?)?;
                let mut is_enough = integrator.is_explicit() && settled_meshes.contains(segments);
                for (k, part) in integrator.steps().iter().enumerate() {
                    let step = part * largest.unwrap_or(step);
                    count_run();
                    // Skipped runs count as finished for the progress.
                    if is_enough {
                        continue;
                    }
                    let run = MeasuredRun::new(&problem_with(integrator, step, *segments)?)?;
                    let difference = |to: &Positions| {
                        run.tip.as_ref().ok().map(|tip| largest_distance(tip, to) / length)
                    };
                    let step_error = difference(tip);
                    is_enough = step_error.is_some_and(|e| e < NEGLIGIBLE_STEP_ERROR * mesh_error);
                    if is_enough && k == 0 && integrator.is_explicit() {
                        settled_meshes.push(*segments);
                    }
                    rows.push(StudyRow {
                        scheme: integrator.scheme,
                        beta: integrator.beta,
                        step,
                        segments: *segments,
                        error: difference(reference),
                        step_error,
                        mesh_error,
                        wall_seconds: run.seconds,
                        newton_iterations: run.newton_iterations,
                        energy_drift: run.energy_drift,
                        status: match &run.tip {
                            Ok(_) => "completed".into(),
                            Err(error) => format!("stopped: {error}"),
                        },
                    });
                }
            }
        }
        let reference_error = rows.iter().filter_map(|r| r.error).fold(f64::INFINITY, f64::min);
        let advice = (1..=LISTED_ERRORS).map(|k| fastest_run(&rows, 10f64.powi(-k))).collect();
        Ok(Self { rows, reference_error, advice })
    }
}

/// The run with the shortest wall time of those whose error of the tip is at most `error`, a fraction of the length, as
/// an index of `rows`; the first of equally fast ones. No row if none is that accurate.
fn fastest_run(rows: &[StudyRow], error: f64) -> FastestRun {
    let is_accurate = |row: &StudyRow| row.error.is_some_and(|e| e <= error);
    let accurate = rows.iter().enumerate().filter(|(_, row)| is_accurate(row));
    let fastest = accurate.min_by(|(_, a), (_, b)| a.wall_seconds.total_cmp(&b.wall_seconds));
    FastestRun { error, row: fastest.map(|(i, _)| i) }
}

/// The name of the scheme of a run, followed by a space and beta for Newmark-beta: `newmark-beta 0.5`.
pub fn scheme_name(row: &StudyRow) -> String {
    match row.scheme.takes_beta() {
        true => format!("{} {}", row.scheme.name(), row.beta),
        false => row.scheme.name().into(),
    }
}

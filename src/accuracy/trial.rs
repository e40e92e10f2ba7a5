//! Trial runs: simulations of a scene with given numerics that record up to nine points, and their work.
//!
//! Input: edges, steps and scheme, used even where the scene gives others. The points divide the rod into eight parts;
//! its ends that are free or on a roller are added. The times of comparison follow from the first run that reaches the
//! end (`samples`), and are the same for all later ones. Output: positions of these points over the rod length, the
//! recorded motion of the nodes around them, or nothing for a run that fails or needs halved steps of `rodas4`. Invalid
//! input and files are errors. Steps of explicit schemes are at most [`OF_STABLE_STEP`] of the largest stable one.
//! Results are stored, so that no run is computed twice. The unit of work is one edge times one Newton iteration of
//! generalised-alpha; a step of `rodas4` counts as five in the plane and three in space. `TrialRuns::new` takes the
//! scene and the same scene with its first numerics; `run` makes one run or returns a stored one. `expected_work`
//! predicts the work of given numerics; `RunCost::work` is that of a run by its counts. `largest_stable_step` is
//! [`OF_STABLE_STEP`] of the largest stable step. [`comparison_points`] are the points, for motions with [`PARTS`]
//! parts of the rod. [`largest_step`] is the largest stable step of an explicit scheme, s.
//!
//! `Numerics` are edges, steps and scheme of a run, `TrialRun` is the result of a run that reached the end, and
//! `RunCost` the cost model of a problem. `ITERATIONS` is the mean number of Newton iterations of a step of
//! generalised-alpha.

use crate::accuracy::calculation::{TRIAL_TOLERANCE, set_newton_tolerance};
use crate::accuracy::difference::Positions;
use crate::accuracy::samples::sample_times;
use crate::dynamics::record::Record;
use crate::dynamics::{Trajectory, Work};
use crate::error::Error;
use crate::problem::{AnyProblem, Problem};
use crate::scene::{Chosen, End, Point, Scene, Scheme, Stencil, Support};
use std::cell::{Cell, OnceCell, RefCell};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Number of equal parts of the rod between the compared points of a motion.
pub(super) const PARTS: usize = 8;
/// Largest work of a trial run, steps times edges, in the plane and in space: about a second.
const MAX_TRIAL_WORK: [f64; 2] = [2e6, 5e5];
/// Newton iterations that take as long as a step of `rodas4`, in the plane and in space (measured).
const ITERATIONS_OF_RODAS4: [f64; 2] = [5.0, 3.0];
/// Mean number of Newton iterations of a step of generalised-alpha (measured).
pub(super) const ITERATIONS: f64 = 2.1;
/// Fraction of the largest stable step of an explicit scheme that is used: the rod may stiffen during the motion.
const OF_STABLE_STEP: f64 = 0.95;

/// Numerics of a run: edges, steps and scheme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Numerics {
    /// Number of edges.
    pub segments: usize,
    /// Steps over the scene's time.
    pub steps: usize,
    pub scheme: Scheme,
}

/// The result of a trial run that reached the end of the scene.
#[derive(Clone)]
pub(super) struct TrialRun {
    pub numerics: Numerics,
    /// Times of comparison, s, ascending: the same for all trial runs of a search.
    pub times: Arc<[f64]>,
    /// Positions of the compared points over the length, at the times of comparison.
    pub positions: Arc<Positions>,
    /// The recorded motion of the nodes around these points.
    pub record: Arc<Record>,
    /// The compared points on the mesh of the run.
    pub stencils: Arc<[Stencil]>,
}

/// The trial runs of a scene.
pub(super) struct TrialRuns<'a> {
    pub scene: &'a Scene,
    /// The numerics that the scene leaves open.
    pub open: Chosen,
    /// The scene with its first mesh and step.
    pub guess: Problem,
    /// The compared points.
    points: Vec<Point>,
    /// The times of comparison, s, from the first run that reached the end.
    times: OnceCell<Arc<[f64]>>,
    /// Largest work of a trial run.
    pub most_work: f64,
    /// Newton iterations that take as long as a step of `rodas4`.
    pub iterations_of_rodas4: f64,
    /// The results so far; `None` for runs that failed.
    known: RefCell<Vec<(Numerics, Option<TrialRun>)>>,
    /// Work so far, edges times Newton iterations.
    pub work: Cell<f64>,
}

impl<'a> TrialRuns<'a> {
    /// Trial runs of a scene, none computed yet; `guess` is the scene with its first number of edges and first step.
    ///
    /// # Errors
    /// Those of [`Scene::build`].
    pub fn new(scene: &'a Scene, guess: Scene) -> Result<Self, Error> {
        let guess = guess.build()?;
        let dimension = usize::from(guess.planar().is_none());
        Ok(Self {
            points: comparison_points(&guess, PARTS),
            times: OnceCell::new(),
            open: scene.left_open(),
            scene,
            most_work: MAX_TRIAL_WORK[dimension],
            iterations_of_rodas4: iterations_of_rodas4(&guess),
            guess,
            known: RefCell::default(),
            work: Cell::default(),
        })
    }

    /// Expected work of a run with these numerics: edges times steps. For `rodas4` times the Newton iterations that
    /// take as long as one of its steps, over the mean number [`ITERATIONS`] of generalised-alpha.
    pub fn expected_work(&self, Numerics { segments, steps, scheme }: Numerics) -> f64 {
        // The unit of work is an iteration of generalised-alpha, so that both schemes can be compared.
        let one = match scheme {
            Scheme::Rodas4 => self.iterations_of_rodas4 / ITERATIONS,
            _ => 1.0,
        };
        one * segments as f64 * steps as f64
    }

    /// The trial run with these numerics, stored or computed; `None` where its steps fail, or where `rodas4` halves a
    /// step. An error only for invalid input or files.
    pub fn run(&self, numerics: Numerics) -> Result<Option<TrialRun>, Error> {
        if let Some((_, trial)) = self.known.borrow().iter().find(|(known, _)| *known == numerics) {
            return Ok(trial.clone());
        }
        let trial = self.new_run(numerics)?;
        self.known.borrow_mut().push((numerics, trial.clone()));
        Ok(trial)
    }

    /// Simulates the scene with these numerics to its end, even where it gives finer ones, with [`TRIAL_TOLERANCE`] for
    /// Newton's method. The run's work is added. Only the nodes around the compared points are recorded. A step above
    /// [`OF_STABLE_STEP`] of the largest stable one of an explicit scheme is reduced to that. `None` for a run that
    /// fails, or in which `rodas4` halves a step, which stops it. An error only for invalid input or files.
    fn new_run(
        &self,
        Numerics { segments, steps, scheme }: Numerics,
    ) -> Result<Option<TrialRun>, Error> {
        let end = self.guess.time()?.end;
        let step = end / steps as f64;
        // The scene with these numerics, even where it gives its own: trial runs are coarser than a given mesh or step.
        let mut scene = self.scene.resolved(segments, step).by(scheme);
        if !self.open.segments && segments != self.guess.segments() {
            scene.remeshed = Some(segments);
        }
        if let Some(time) = &mut scene.time {
            time.step = Some(step);
        }
        set_newton_tolerance(&mut scene, TRIAL_TOLERANCE);
        let stop = Arc::new(AtomicBool::new(false));
        // Explicit schemes: the step is reduced to the largest stable one.
        let mut problem = scene.build()?.stop_when(stop.clone());
        if let Some(largest) = largest_stable_step(&problem)?
            && step > largest
        {
            if let Some(time) = &mut scene.time {
                time.step = Some(largest);
            }
            problem = scene.build()?.stop_when(stop.clone());
        }
        // Only the nodes around the compared points are recorded.
        let mut tracked = Vec::new();
        for point in &self.points {
            tracked.extend(problem.nodes_around(*point)?);
        }
        tracked.sort_unstable();
        tracked.dedup();
        let mut run = Trajectory::new(&problem, &tracked, &[])?;
        let mut taken = 0;
        let outcome = run.run(&problem, problem.time()?.steps(), |run| {
            // A rejected step of rodas4 is far too large: such a run is not continued.
            if scheme == Scheme::Rodas4 && run.work().steps > taken {
                stop.store(true, Ordering::Relaxed);
            }
            taken += 1;
        });
        self.work.set(self.work.get() + RunCost::of(&problem).work(run.work()));
        // Errors of the input end the search; a run that failed gives no result.
        match outcome {
            Ok(()) => {}
            Err(error @ (Error::Invalid { .. } | Error::Io { .. })) => return Err(error),
            Err(_) => return Ok(None),
        }
        let record = run.into_record();
        let stencils = self.points.iter().map(|point| problem.stencil(*point));
        let stencils: Arc<[Stencil]> = stencils.collect::<Result<_, _>>()?;
        // The first motion determines the times, so that successive differences are those at the same times.
        let times = self.times.get_or_init(|| sample_times(&scene.signals, end, &record).into());
        let positions = Arc::new(positions(&problem, &stencils, times, &record)?);
        Ok(Some(TrialRun {
            numerics: Numerics { segments, steps, scheme },
            times: times.clone(),
            positions,
            record: Arc::new(record),
            stencils,
        }))
    }
}

/// The cost model of a run: its edges, and the work of a step without Newton iterations.
pub(super) struct RunCost {
    segments: f64,
    /// Newton iterations that take as long as a step of a scheme that has none.
    iterations_per_step: f64,
}

impl RunCost {
    /// The cost model of the runs of a problem: its number of edges, and the Newton iterations that take as long as a
    /// step of `rodas4`, or one for other schemes.
    pub fn of(problem: &Problem) -> Self {
        let iterations_per_step = match problem.scene().time.as_ref().map(|time| time.scheme) {
            Some(Scheme::Rodas4) => iterations_of_rodas4(problem),
            _ => 1.0,
        };
        Self { segments: problem.segments() as f64, iterations_per_step }
    }

    /// The work of a run from its counts: edges times the larger of its Newton iterations and of the equivalent
    /// iterations of its steps (several per step of `rodas4`, one of other schemes).
    pub fn work(&self, done: Work) -> f64 {
        self.segments
            * (done.newton_iterations as f64).max(self.iterations_per_step * done.steps as f64)
    }
}

/// Newton iterations of generalised-alpha that take as long as a step of `rodas4`: [`ITERATIONS_OF_RODAS4`] of a planar
/// or of a spatial problem.
fn iterations_of_rodas4(problem: &Problem) -> f64 {
    ITERATIONS_OF_RODAS4[usize::from(problem.planar().is_none())]
}

/// Positions of the compared points, in the world over the length, at these ascending `times`, s, point after point;
/// interpolated from the `record` of a run. Errors: a time or nodes that were not recorded.
fn positions(
    problem: &Problem,
    stencils: &[Stencil],
    times: &[f64],
    record: &Record,
) -> Result<Positions, Error> {
    let over = problem.length().recip();
    let mut positions = Vec::with_capacity(times.len() * stencils.len());
    for stencil in stencils {
        let places = record.read().places(stencil, times.iter().copied())?;
        positions.extend(places.iter().map(|place| place.map(|x| over * x)));
    }
    Ok(positions)
}

/// [`OF_STABLE_STEP`] of the largest stable step of an explicit scheme, s; `None` for implicit schemes, which have no
/// limit. Errors are those of the initial state.
pub(super) fn largest_stable_step(problem: &Problem) -> Result<Option<f64>, Error> {
    Ok(largest_step(problem)?.map(|largest| OF_STABLE_STEP * largest))
}

/// The largest stable step, s, of the scene's explicit scheme at the start of the motion; `None` for schemes without a
/// limit. Errors are those of the initial state.
pub(crate) fn largest_step(problem: &Problem) -> Result<Option<f64>, Error> {
    match problem.discretized() {
        AnyProblem::Planar(discretized) => discretized.largest_step(),
        AnyProblem::Spatial(discretized) => discretized.largest_step(),
    }
}

/// The points at which runs or equilibria are compared: those that divide the rod into a number of equal `parts`, then
/// the ends without a support or on a roller. Such an end can have a larger error than all other points.
pub(super) fn comparison_points(problem: &Problem, parts: usize) -> Vec<Point> {
    let inner = (1..parts).map(|k| Point::ArcLength(problem.length() * k as f64 / parts as f64));
    inner.chain(moving_ends(problem)).collect()
}

/// The ends of the rod without a support or on a roller, as its first node and its tip, start first; up to two.
fn moving_ends(problem: &Problem) -> impl Iterator<Item = Point> {
    let supports = &problem.scene().supports;
    let ends = [(End::Start, Point::Node(0)), (End::End, Point::Tip)];
    let can_move = |end: End| matches!(supports.at(end), Support::Free | Support::Roller);
    ends.into_iter().filter(move |(end, _)| can_move(*end)).map(|(_, point)| point)
}

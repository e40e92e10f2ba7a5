//! Runs that mesh, step and scheme are found by.

use crate::dynamics::Trajectory;
use crate::dynamics::record::Record;
use crate::error::Error;
use crate::problem::{AnyProblem, Problem};
use crate::resolution::aim::{OF_TRIAL, solved_for};
use crate::resolution::off::Seen;
use crate::resolution::small::little_bent;
use crate::scene::{Chosen, End, Point, Scene, Scheme, Support};
use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Times at which runs are compared.
const SAMPLES: usize = 100;
/// Most work of a run that is looked at on the way, steps times edges, in a plane and in space: some seconds.
const MOST_WORK: [f64; 2] = [2e6, 5e5];
/// A step of `rodas4` takes as long as so many of Newton's iterations, in a plane and in space.
const OF_ROSENBROCK: [usize; 2] = [5, 3];

/// A step takes as long as so many edges more would.
pub(super) const OF_STEP: f64 = 8.0;
/// A step of a small motion takes as long as this part of a Newton iteration.
const OF_SMALL: f64 = 0.25;

/// A run, if its steps did not fail.
#[derive(Clone)]
pub(super) struct Ran {
    pub seen: Seen,
    /// Newton iterations, or what takes as long.
    pub iterations: f64,
}

/// What a run was asked for: edges, step, s, and scheme.
type Asked = (usize, f64, Scheme);

/// The runs of a scene.
pub(super) struct Runs<'a> {
    scene: &'a Scene,
    pub open: Chosen,
    /// How far loads bend a rod whose small motions are run by the first scheme instead of its own.
    pub small: Option<f64>,
    /// The scene with its first mesh and step.
    pub guess: Problem,
    points: Vec<Point>,
    pub most_work: f64,
    /// A step of `rodas4` takes as long as so many of Newton's iterations.
    pub of_rosenbrock: usize,
    /// Those so far, which are asked for again.
    known: RefCell<Vec<(Asked, Option<Ran>)>>,
    /// Their work, edges times Newton iterations.
    pub work: Cell<f64>,
}

impl<'a> Runs<'a> {
    pub fn new(scene: &'a Scene, guess: Scene) -> Result<Self, Error> {
        let guess = guess.posed()?;
        let dimension = usize::from(guess.planar().is_none());
        let (most_work, of_rosenbrock) = (MOST_WORK[dimension], OF_ROSENBROCK[dimension]);
        let points = looked_at(&guess);
        let (known, work) = Default::default();
        Ok(Self {
            points,
            open: scene.left_open(),
            small: little_bent(scene, &guess),
            scene,
            guess,
            most_work,
            of_rosenbrock,
            known,
            work,
        })
    }

    /// A run with so many edges; none where its steps fail.
    pub fn run(&self, asked: Asked) -> Result<Option<Ran>, Error> {
        if let Some((_, ran)) = self.known.borrow().iter().find(|(known, _)| *known == asked) {
            return Ok(ran.clone());
        }
        let ran = self.new_run(asked)?;
        self.known.borrow_mut().push((asked, ran.clone()));
        Ok(ran)
    }

    fn new_run(&self, (segments, step, scheme): Asked) -> Result<Option<Ran>, Error> {
        let mut scene = self.scene.resolved(segments, step).by(scheme);
        if !self.open.segments && segments != self.guess.segments() {
            scene.remeshed = Some(segments);
        }
        if let Some(time) = &mut scene.time {
            time.step = step;
        }
        solved_for(&mut scene, OF_TRIAL);
        let stop = Arc::new(AtomicBool::new(false));
        let mut problem = scene.posed()?.stop_when(stop.clone());
        if let Some(largest) = largest_step(&problem)?
            && step > largest
        {
            if let Some(time) = &mut scene.time {
                time.step = largest;
            }
            problem = scene.posed()?.stop_when(stop.clone());
        }
        let mut tracked = Vec::new();
        for point in &self.points {
            tracked.extend(problem.nodes_around(*point)?);
        }
        tracked.sort_unstable();
        tracked.dedup();
        let small = self.small.is_some() && scheme == Scheme::GeneralisedAlpha;
        let (ran, iterations) = match small {
            true => (problem.small_motion(&tracked), OF_SMALL * problem.time()?.steps() as f64),
            false => self.simulated(&problem, scheme, &tracked, &stop)?,
        };
        self.work.set(self.work.get() + iterations * problem.segments() as f64);
        let record = match ran {
            Ok(record) => record,
            Err(error @ (Error::Invalid { .. } | Error::Io { .. })) => return Err(error),
            Err(_) => return Ok(None),
        };
        let end = problem.time()?.end;
        let over = problem.length().recip();
        let mut seen = Vec::with_capacity(SAMPLES * self.points.len());
        let times = || (1..=SAMPLES).map(|k| end * k as f64 / SAMPLES as f64);
        for point in &self.points {
            let places = record.read().places(&problem.stencil(*point)?, times())?;
            seen.extend(places.iter().map(|place| place.map(|x| over * x)));
        }
        Ok(Some(Ran { seen, iterations }))
    }

    /// The record of a simulation or what it failed by, and Newton iterations, or what takes as long.
    fn simulated(
        &self,
        problem: &Problem,
        scheme: Scheme,
        tracked: &[usize],
        stop: &AtomicBool,
    ) -> Result<(Result<Record, Error>, f64), Error> {
        let mut run = Trajectory::new(problem, tracked, &[])?;
        let mut taken = 0;
        let outcome = run.run(problem, problem.time()?.steps(), |run| {
            // Steps of this scheme that fail are far too large.
            if scheme == Scheme::Rodas4 && run.work().steps > taken {
                stop.store(true, Ordering::Relaxed);
            }
            taken += 1;
        });
        let work = run.work();
        let iterations = match scheme {
            Scheme::Rodas4 => self.of_rosenbrock * work.steps,
            _ => work.newton_iterations.max(work.steps),
        };
        Ok((outcome.map(|()| run.into_record()), iterations as f64))
    }
}

/// The largest step of an explicit scheme, with something to spare; none where every step is stable.
fn largest_step(problem: &Problem) -> Result<Option<f64>, Error> {
    let largest = match problem.discretized() {
        AnyProblem::Planar(discretized) => discretized.largest_step()?,
        AnyProblem::Spatial(discretized) => discretized.largest_step()?,
    };
    Ok(largest.map(|largest| 0.95 * largest))
}

/// The free ends of a rod, or its middle.
pub(super) fn looked_at(problem: &Problem) -> Vec<Point> {
    let supports = &problem.scene().supports;
    let free = |end| supports.at(end) == Support::Free;
    let ends = [(End::Start, Point::Node(0)), (End::End, Point::Tip)];
    let points: Vec<Point> =
        ends.into_iter().filter(|(end, _)| free(*end)).map(|(_, p)| p).collect();
    if points.is_empty() { vec![Point::ArcLength(0.5 * problem.length())] } else { points }
}

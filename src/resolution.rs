//! Mesh, step and scheme where a scene leaves them to the program.
//!
//! A motion is looked at where the rod moves most freely: at its free ends, or halfway. Steps and edges each make
//! an error of second order, that hardly depends on the other. So steps are halved on a coarse mesh, and edges in
//! steps that are a few times too large, each until the differences between one run and the next say which will
//! do; only the run itself is as fine as it must be. A difference is carried on with the order that three runs
//! show, at most that of the method. `cargo run --release --example accuracy -- costs` tells what that costs.

use crate::dynamics::Trajectory;
use crate::error::Error;
use crate::problem::{AnyProblem, Problem};
use crate::scene::resolution::Bound;
use crate::scene::{Chosen, End, Point, Scene, Support, Tolerance};
use crate::vibration::About;
use std::cell::{Cell, RefCell};

/// What a mesh is chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Aim {
    /// The motion over the time of the scene.
    Motion,
    /// The rod at rest under its loads.
    Rest,
    /// So many modes.
    Modes(usize),
    /// Nothing yet: a first guess, which whoever asks makes better.
    Guess,
}

/// Times at which runs are compared.
const SAMPLES: usize = 200;
/// Part of the accuracy that mesh and step may take each: errors of errors take the rest.
const PART: f64 = 0.36;
/// Fewest edges of a first mesh, at an accuracy of 1 %; the number goes with the fourth root of the accuracy, as a
/// better one needs higher modes in the coarse runs too.
const FIRST_EDGES: f64 = 6.0;
/// Largest turn of an edge of a first mesh, rad.
const FIRST_TURN: f64 = 0.7;
/// First steps in the shortest of the times that a scene is made of, likewise, and fewest in all.
const FIRST_STEPS: f64 = 10.0;
/// Differences of runs that fall by this factor when edges or steps are halved are those of a method that converges.
const CONVERGES: f64 = 2.5;
/// Runs that are as near as this are one.
const ROUNDING: f64 = 1e-12;
/// What is known from two runs only counts so many times.
const UNSURE: f64 = 1.5;
/// What is chosen is at most so many times as fine as the finest of three runs that were looked at, or of two.
const FAR: f64 = 2.0;
const FAR_BY_TWO: f64 = 1.3;
/// Step errors may be so many times the accuracy's part where meshes are compared: they are alike on both.
const ALIKE: f64 = 30.0;
/// Newton's tolerance in a step over the accuracy, of the run and of those on the way, and the most that a scene may have. What a
/// step leaves is foreseen as too much rather than as too little, and errors of many steps do not add up: a run stays what it is
/// to three digits of its error.
const OF_ACCURACY: f64 = 1e-7;
const OF_TRIAL: f64 = 1e-6;
const MOST_LEFT: f64 = 1e-6;
/// Most work of a run that is looked at on the way, steps times edges, in a plane and in space: some seconds.
const MOST_WORK: [f64; 2] = [2e6, 5e5];
/// Most edges of a rod at rest.
const MOST_EDGES: usize = 20_000;

impl Scene {
    /// Validates the scene, [chooses](self) mesh, step and scheme where they are left out, and builds what a
    /// simulation needs.
    ///
    /// # Errors
    /// [`Error::Invalid`] with file, key, what was found and what is allowed. Where something is to be chosen,
    /// those of a simulation.
    pub fn problem(&self) -> Result<Problem, Error> {
        self.problem_for(if self.time.is_some() { Aim::Motion } else { Aim::Rest })
    }

    /// The same, chosen for another aim.
    ///
    /// # Errors
    /// Those of [`problem`](Self::problem), and of what is aimed at.
    pub fn problem_for(&self, aim: Aim) -> Result<Problem, Error> {
        self.validate()?;
        let open = self.left_open();
        let checked = self.accuracy.is_some() && aim == Aim::Motion;
        if !open.any() && !checked {
            return self.posed();
        }
        let mut scene = self.clone();
        scene.read_shapes().map_err(|error| error.in_file(self.path.as_deref()))?;
        let edges = first_edges(&scene, aim)?;
        let step = first_step(&scene, edges)?;
        let guess = scene.resolved(edges, step);
        let mut work = 0.0;
        let (segments, step, error, bound) = match aim {
            Aim::Motion => {
                let search = Search::new(&scene, guess)?;
                let found = search.motion(step)?;
                work = search.work.get();
                found
            }
            Aim::Guess => (edges, step, None, None),
            _ if !open.segments => (edges, step, None, None),
            Aim::Rest | Aim::Modes(_) => still(&scene, aim, (edges, step))?,
        };
        let mut scene = scene.resolved(segments, step);
        if let Some(resolution) = &mut scene.resolution {
            (resolution.error, resolution.bound, resolution.work) = (error, bound, work);
        }
        if aim == Aim::Motion {
            solved_for(&mut scene, OF_ACCURACY);
        }
        scene.posed()
    }
}

/// The scene with Newton's tolerance at a part of the accuracy that is asked for, where the program chooses the scheme.
fn solved_for(scene: &mut Scene, part: f64) {
    let (asked, chosen) = (scene.asked(), scene.chosen().scheme);
    if let Some(time) = scene.time.as_mut().filter(|_| chosen) {
        time.tolerance = Tolerance::Predicted((part * asked).min(MOST_LEFT));
    }
}

/// Edges, step, the error that is left over the length, and what kept it from being smaller.
type Found = (usize, f64, Option<f64>, Option<Bound>);

/// Edges of a first mesh.
fn first_edges(scene: &Scene, aim: Aim) -> Result<usize, Error> {
    let turning = scene.rod.shape.turning().unwrap_or(0.0);
    let fine = FIRST_EDGES * fineness(scene);
    let modes = if let Aim::Modes(count) = aim { 2.0 * count as f64 } else { 0.0 };
    let edges = fine.max(turning / FIRST_TURN).max(modes).ceil() as usize;
    if edges > MOST_EDGES {
        let found = format!("left out for a rod that needs {edges}");
        let allowed = format!("left out where {MOST_EDGES} are enough, or a number");
        return Err(Error::invalid("rod.segments", found, allowed));
    }
    let Some(path) = &scene.supports.path else { return Ok(edges) };
    // Markers stand at nodes.
    let spans = path.track()?.markers().len().max(2) - 1;
    Ok(edges.div_ceil(spans) * spans)
}

/// How much finer first runs are than for an accuracy of 1 %.
fn fineness(scene: &Scene) -> f64 {
    (1e-2 / scene.asked()).max(1.0).powf(0.25)
}

/// A first step, s: a part of the shortest of the times that the scene is made of.
fn first_step(scene: &Scene, edges: usize) -> Result<f64, Error> {
    let Some(time) = &scene.time else { return Ok(0.0) };
    let (section, material) = scene.at(0.5);
    let (moments, length) = (section.moments(), scene.resolved(edges, 1.0).mesh()?.length);
    let [i1, i2] = moments.second_moments;
    let per_length = material.density * moments.area;
    let bending = material.youngs_modulus * i1.max(i2) / (per_length * length.powi(4));
    let size = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let pulls = scene.loads.point.iter().chain(&scene.initial.point).map(|load| size(&load.force));
    let pull = pulls.sum::<f64>() / (per_length * length);
    let squares = [12.4 * bending, (size(&scene.loads.gravity) + pull) / length];
    let rates = [
        squares.into_iter().fold(0.0, f64::max).sqrt(),
        size(&scene.initial.velocity) / length,
        size(&scene.initial.angular_velocity),
    ];
    let shortest = std::f64::consts::TAU / rates.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    let frames = scene.supports.path.as_ref().map(|path| path.track()).transpose()?;
    let frame = frames.map_or(f64::INFINITY, |track| track.end() / track.times().len() as f64);
    let good = scene.supports.largest_good_step();
    Ok((shortest.min(time.end) / (FIRST_STEPS * fineness(scene))).min(good).min(frame))
}

/// What is looked at, at all times, over the length.
type Seen = Vec<[f64; 3]>;

fn apart(a: &Seen, b: &Seen) -> f64 {
    let square =
        |(a, b): (&[f64; 3], &[f64; 3])| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    a.iter().zip(b).map(square).fold(0.0, f64::max).sqrt()
}

/// Runs of which each is twice as fine as the one before, and how far neighbours are apart.
#[derive(Default)]
struct Ladder {
    last: Option<Seen>,
    apart: Vec<f64>,
}

impl Ladder {
    /// Adds a run; one that failed is no neighbour of any.
    fn add(&mut self, seen: Option<Seen>) {
        match (&self.last, &seen) {
            (Some(last), Some(seen)) => self.apart.push(apart(last, seen)),
            _ => self.apart.clear(),
        }
        self.last = seen;
    }

    /// How much finer than the last run may be chosen.
    fn far(&self) -> f64 {
        if self.apart.len() > 1 { FAR } else { FAR_BY_TWO }
    }

    /// The error of the last run and the order it falls with, at most `order`; none where runs do not say.
    fn error(&self, order: f64) -> Option<(f64, f64)> {
        match self.apart[..] {
            [] => None,
            [last] => Some((UNSURE * last / (order.exp2() - 1.0), order)),
            [.., last] if last < ROUNDING => Some((last, order)),
            [.., before, last] => {
                let falls = (before / last).min(order.exp2());
                (falls >= CONVERGES).then(|| (last / (falls - 1.0), falls.log2()))
            }
        }
    }
}

/// The runs that a resolution is found by.
struct Search<'a> {
    scene: &'a Scene,
    open: Chosen,
    /// The scene with its first mesh and step.
    guess: Problem,
    points: Vec<Point>,
    most_work: f64,
    /// Runs so far by edges and step, which are asked for again.
    runs: RefCell<Vec<(usize, f64, Option<Seen>)>>,
    /// Their work, edges times Newton iterations.
    work: Cell<f64>,
}

impl<'a> Search<'a> {
    fn new(scene: &'a Scene, guess: Scene) -> Result<Self, Error> {
        let guess = guess.posed()?;
        let most_work = MOST_WORK[usize::from(guess.planar().is_none())];
        let (runs, work) = Default::default();
        Ok(Self {
            points: looked_at(&guess),
            open: scene.left_open(),
            scene,
            guess,
            most_work,
            runs,
            work,
        })
    }

    /// A run with so many edges; none where its steps fail.
    fn run(&self, segments: usize, step: f64) -> Result<Option<Seen>, Error> {
        if let Some((.., seen)) =
            self.runs.borrow().iter().find(|(n, h, _)| (*n, *h) == (segments, step))
        {
            return Ok(seen.clone());
        }
        let seen = self.new_run(segments, step)?;
        self.runs.borrow_mut().push((segments, step, seen.clone()));
        Ok(seen)
    }

    fn new_run(&self, segments: usize, step: f64) -> Result<Option<Seen>, Error> {
        let mut scene = self.scene.resolved(segments, step);
        if !self.open.segments && segments != self.guess.segments() {
            scene.remeshed = Some(segments);
        }
        if let Some(time) = &mut scene.time {
            time.step = step;
        }
        solved_for(&mut scene, OF_TRIAL);
        let mut problem = scene.posed()?;
        if let Some(largest) = largest_step(&problem)?
            && step > largest
        {
            if let Some(time) = &mut scene.time {
                time.step = largest;
            }
            problem = scene.posed()?;
        }
        let time = problem.time()?;
        let (steps, end) = (time.steps(), time.end);
        let mut tracked = Vec::new();
        for point in &self.points {
            tracked.extend(problem.nodes_around(*point)?);
        }
        let mut run = Trajectory::new(&problem, &tracked, &[])?;
        let outcome = run.run(&problem, steps, |_| {});
        let work = run.work();
        let iterations = work.newton_iterations.max(work.steps);
        self.work.set(self.work.get() + (iterations * problem.segments()) as f64);
        match outcome {
            Ok(()) => {}
            Err(error @ (Error::Invalid { .. } | Error::Interrupted | Error::Io { .. })) => {
                return Err(error);
            }
            Err(_) => return Ok(None),
        }
        let over = problem.length().recip();
        let mut seen = Vec::with_capacity(SAMPLES * self.points.len());
        for point in &self.points {
            for k in 1..=SAMPLES {
                let (place, _) = run.at(*point, end * k as f64 / SAMPLES as f64)?;
                seen.push(place.map(|x| over * x));
            }
        }
        Ok(Some(seen))
    }

    /// Mesh and step for the motion.
    fn motion(&self, first: f64) -> Result<Found, Error> {
        let time = self.guess.time()?;
        let (end, order) = (time.end, f64::from(time.scheme.traits().order));
        let (own, given) = (self.guess.segments(), !self.open.segments);
        let asked = self.scene.asked();
        let coarse_mesh = if given { coarser(&self.guess) } else { own };
        let steps = self.steps(coarse_mesh, (first, end, order), PART * asked)?;
        let mesh = match given && self.comes_with_points() {
            true => (own, 0.0, None),
            false => self.edges((coarse_mesh, own), steps.coarse, PART * asked)?,
        };
        let (segments, mesh_error, mesh_bound) = mesh;
        let count = (end / steps.step - 1e-6).ceil().max(1.0);
        let step = if self.open.step { end / count } else { time.step };
        let error = steps.error + mesh_error;
        let bound = match (error > asked, steps.bound.or(mesh_bound)) {
            (false, _) => None,
            (true, Some(Bound::Work)) if self.open.any() => Some(Bound::Work),
            (true, _) => Some(Bound::Given),
        };
        Ok((segments, step, Some(error), bound))
    }

    /// Whether the mesh is that of a polyline's points.
    fn comes_with_points(&self) -> bool {
        self.scene.rod.segments.is_none()
    }

    /// The step that makes no more than `error`, from halving the first one on a coarse mesh.
    fn steps(
        &self,
        segments: usize,
        (first, end, order): (f64, f64, f64),
        allowed: f64,
    ) -> Result<Steps, Error> {
        let own = self.guess.time()?.step;
        let mut step = if self.open.step { first } else { 4.0 * own };
        let mut ladder = Ladder::default();
        let mut tried: Vec<f64> = Vec::new();
        loop {
            ladder.add(self.run(segments, step)?);
            tried.push(step);
            let known = ladder.error(order);
            let done = |step: f64, (error, order): (f64, f64), bound| {
                // Where meshes can be compared.
                let least = step * (ALIKE * allowed / error.max(1e-300)).powf(order.recip());
                let coarse = tried.iter().copied().find(|tried| *tried <= least.min(4.0 * step));
                Steps { step, coarse: coarse.unwrap_or(step), error, bound }
            };
            if !self.open.step {
                // The step is given; what it does is only seen.
                if step > 1.5 * own {
                    step *= 0.5;
                    continue;
                }
                let last = ladder.apart.last().copied();
                let known = known.or(last.map(|last| (UNSURE * last, 1.0)));
                return Ok(done(own, known.unwrap_or((f64::INFINITY, 1.0)), Some(Bound::Given)));
            }
            if let Some((error, order)) = known {
                let finer = (error / allowed).powf(order.recip());
                if finer <= ladder.far() {
                    let chosen = step / finer.max(0.5);
                    return Ok(done(chosen, (error * (chosen / step).powf(order), order), None));
                }
            } else if let [.., before, last] = ladder.apart[..]
                && before.max(last) <= 0.5 * allowed
            {
                return Ok(done(step, (2.0 * last, 1.0), None));
            }
            if 2.0 * end / step * segments as f64 > self.most_work {
                let last = ladder.apart.last().map_or(f64::INFINITY, |last| 2.0 * last);
                if !last.is_finite() {
                    // Nothing could be simulated: whoever runs it is told why.
                    return Ok(done(step, (1.0, 1.0), Some(Bound::Work)));
                }
                return Ok(done(step, known.unwrap_or((last, 1.0)), Some(Bound::Work)));
            }
            step *= 0.5;
        }
    }

    /// The edges that make no more than `allowed`, in steps of one length: from a mesh, and the scene's own
    /// where it has one.
    fn edges(
        &self,
        (first, own): (usize, usize),
        step: f64,
        allowed: f64,
    ) -> Result<(usize, f64, Option<Bound>), Error> {
        let end = self.guess.time()?.end;
        let mut ladder = Ladder::default();
        if !self.open.segments {
            ladder.add(self.run(first, step)?);
            ladder.add(self.run(own, step)?);
            let ratio = own as f64 / first as f64;
            let error = ladder.apart.last().map(|apart| apart / (ratio * ratio - 1.0).max(0.1));
            return Ok((own, error.unwrap_or(0.0), Some(Bound::Given)));
        }
        let (mut segments, mut step) = (first, step);
        loop {
            let mut seen = self.run(segments, step)?;
            if seen.is_none() {
                // Finer edges may not take the steps that coarse ones take: all again in smaller ones.
                step *= 0.5;
                if end / step * segments as f64 > self.most_work {
                    return Ok((segments, f64::INFINITY, Some(Bound::Work)));
                }
                ladder = Ladder::default();
                if segments > first {
                    ladder.add(self.run(segments / 2, step)?);
                }
                seen = self.run(segments, step)?;
            }
            ladder.add(seen);
            if let Some((error, order)) = ladder.error(2.0) {
                let finer = (error / allowed).powf(order.recip());
                if finer <= ladder.far() {
                    let chosen = (segments as f64 * finer.max(0.4)).ceil().max(4.0);
                    let chosen = self.allowed_edges(chosen as usize);
                    let error = error * (segments as f64 / chosen as f64).powf(order);
                    return Ok((chosen, error, None));
                }
            }
            if 2.0 * end / step * 2.0 * segments as f64 > self.most_work {
                let last = ladder.apart.last().copied().unwrap_or(f64::INFINITY);
                return Ok((segments, last, Some(Bound::Work)));
            }
            segments *= 2;
        }
    }

    /// So many edges, or a few more where markers stand at nodes.
    fn allowed_edges(&self, segments: usize) -> usize {
        let track = self.scene.supports.path.as_ref().and_then(|path| path.track().ok());
        let spans = track.map_or(1, |track| track.markers().len().max(2) - 1);
        segments.div_ceil(spans) * spans
    }
}

/// What is found of steps.
struct Steps {
    step: f64,
    /// The one in which meshes are compared, s.
    coarse: f64,
    /// That of the step, over the length.
    error: f64,
    bound: Option<Bound>,
}

/// The largest step of an explicit scheme, with something to spare; none where every step is stable.
fn largest_step(problem: &Problem) -> Result<Option<f64>, Error> {
    let largest = match problem.discretized() {
        AnyProblem::Planar(discretized) => discretized.largest_step()?,
        AnyProblem::Spatial(discretized) => discretized.largest_step()?,
    };
    Ok(largest.map(|largest| 0.95 * largest))
}

/// Fewer edges than a problem's own.
fn coarser(problem: &Problem) -> usize {
    let (own, scene) = (problem.segments(), problem.scene());
    let path = scene.supports.path.is_some();
    if path { 2 * own } else { (own / 2).max(2) }
}

/// The free ends of a rod, or its middle.
fn looked_at(problem: &Problem) -> Vec<Point> {
    let supports = &problem.scene().supports;
    let free = |end| supports.at(end) == Support::Free;
    let ends = [(End::Start, Point::Node(0)), (End::End, Point::Tip)];
    let points: Vec<Point> =
        ends.into_iter().filter(|(end, _)| free(*end)).map(|(_, p)| p).collect();
    if points.is_empty() { vec![Point::ArcLength(0.5 * problem.length())] } else { points }
}

/// A mesh for what does not move.
fn still(scene: &Scene, aim: Aim, (edges, step): (usize, f64)) -> Result<Found, Error> {
    let mut ladder = Ladder::default();
    let (mut segments, allowed) = (edges, 2.0 * PART * scene.asked());
    loop {
        let problem = scene.resolved(segments, step).posed()?;
        let seen: Seen = match aim {
            Aim::Modes(count) => {
                let found = problem.modes(count, About::default())?;
                found
                    .modes
                    .iter()
                    .map(|mode| [mode.frequency_rad_s.max(1e-300).ln(), 0.0, 0.0])
                    .collect()
            }
            _ => {
                let rest = problem.equilibrium()?;
                let over = problem.length().recip();
                let place = |point: &Point| {
                    let mut place = [0.0; 3];
                    for (i, weight) in problem.stencil(*point)?.nodes {
                        (0..3).for_each(|c| place[c] += over * weight * rest.nodes[i][c]);
                    }
                    Ok(place)
                };
                looked_at(&problem).iter().map(place).collect::<Result<_, Error>>()?
            }
        };
        ladder.add(Some(seen));
        if let Some((error, order)) = ladder.error(2.0) {
            let finer = (error / allowed).powf(order.recip());
            if finer <= ladder.far() || segments > MOST_EDGES {
                let bound = (finer > ladder.far()).then_some(Bound::Work);
                let chosen = (segments as f64 * finer.clamp(0.5, FAR)).ceil() as usize;
                let chosen =
                    if let Aim::Modes(count) = aim { chosen.max(2 * count) } else { chosen };
                let error = error * (segments as f64 / chosen as f64).powf(order);
                return Ok((chosen, step, Some(error), bound));
            }
        }
        segments *= 2;
    }
}

//! Scheme and step for a motion.
//!
//! Steps are halved on a coarse mesh, until the differences between one run and the next say which will do. What `rodas4` makes
//! of a step depends on the mesh hardly more than what other schemes do; so where it can simulate the scene it is tried too, and
//! taken where it is the cheaper.

use crate::error::Error;
use crate::resolution::ladder::{Ladder, apart};
use crate::resolution::motion::Search;
use crate::resolution::runs::{OF_ROSENBROCK, Ran};
use crate::scene::Scheme;
use crate::scene::resolution::Bound;
use std::f64::consts::SQRT_2;

/// How many times as fine as the finest of three runs, or of two, what is chosen may be: errors of steps may stay what they are
/// over some halvings before they fall.
const FAR: [f64; 2] = [2.0, 1.5];
/// Step errors may be so many times the step's part where meshes are compared: they are alike on both. But of a scheme that damps
/// what its steps do not resolve, and with that what finer meshes change.
const ALIKE: f64 = 30.0;
const ALIKE_DAMPED: f64 = 5.0;
/// And not more than this part of the length.
const LARGE: f64 = 0.02;
/// Runs of the first scheme before the rival is tried, and edges that it takes to see where the rival's errors fall off.
const TRIED: usize = 3;
const ENOUGH_EDGES: usize = 7;
/// The scheme that is tried beside the first.
const RIVAL: Scheme = Scheme::Rodas4;
/// The order that is believed of it from two runs: its errors fall faster, but not from the first step on.
const BELIEVED: f64 = 2.5;
/// Part of what is allowed that a step of it may make that is larger than it must be: on few edges its errors fall off a little
/// earlier.
const SURE: f64 = 0.5;

/// What is found of steps.
pub(super) struct Steps {
    pub step: f64,
    pub scheme: Scheme,
    /// Step, s, and scheme in which meshes are compared.
    pub coarse: (f64, Scheme),
    /// That of the step, over the length.
    pub error: f64,
    pub bound: Option<Bound>,
}

impl Search<'_> {
    /// Scheme and step that make no more than `allowed`, from halving the first step on a mesh.
    pub fn steps(&self, segments: usize, first: f64, allowed: f64) -> Result<Steps, Error> {
        let time = self.runs.guess.time()?;
        let (own, end) = (time.scheme, time.end);
        let order = f64::from(own.traits().order);
        let (mut step, mut ladder) = (first, Ladder::default());
        let mut tried = Tried { allowed, runs: Vec::new() };
        let mut rival =
            self.has_rival().then(|| Rival { next: f64::INFINITY, ladder: Ladder::default() });
        loop {
            let ran = self.runs.run((segments, step, own))?;
            ladder.add(ran.as_ref().map(|ran| ran.seen.clone()));
            tried.runs.push((step, own, ran.clone()));
            let known = ladder.error(order);
            if tried.runs.len() >= TRIED
                && let Some(other) = &mut rival
            {
                // As far as that is known.
                let cost =
                    ran.as_ref().zip(known).map_or(f64::INFINITY, |(ran, [error, order])| {
                        ran.iterations * (error / allowed).powf(order.recip()).max(0.5)
                    });
                match self.cheaper(segments, (step, cost), other, &mut tried)? {
                    Beside::Found(steps) => return Ok(steps),
                    Beside::Dear => rival = None,
                    Beside::Open => {}
                }
            }
            let chosen = |step: f64, error: f64, bound| {
                let coarse = tried.coarse(ran.as_ref(), (step, own));
                Ok(Steps { step, scheme: own, coarse, error, bound })
            };
            if let Some((finer, [error, order])) = ladder.reaches(allowed, order, FAR) {
                let finer = finer.max(0.5);
                return chosen(step / finer, error * finer.powf(-order), None);
            }
            if let [.., before, last] = ladder.apart()[..]
                && before.max(last) <= 0.5 * allowed
            {
                return chosen(step, 2.0 * last, None);
            }
            if 2.0 * end / step * segments as f64 > self.runs.most_work {
                let last = ladder.apart().last().map_or(f64::INFINITY, |last| 2.0 * last);
                // Where nothing could be simulated, whoever runs it is told why.
                let [error, _] = known.unwrap_or([last, 1.0]);
                return chosen(step, if last.is_finite() { error } else { 1.0 }, Some(Bound::Work));
            }
            step *= 0.5;
        }
    }

    /// Whether there is another scheme to be tried.
    fn has_rival(&self) -> bool {
        let enough = self.runs.guess.segments() >= ENOUGH_EDGES;
        self.runs.open.scheme && enough && self.scene.is_taken_by(RIVAL)
    }

    /// The rival's step, if there is one down to `step` that takes less than `cost`, in Newton iterations.
    fn cheaper(
        &self,
        segments: usize,
        (step, cost): (f64, f64),
        rival: &mut Rival,
        tried: &mut Tried,
    ) -> Result<Beside, Error> {
        let end = self.runs.guess.time()?.end;
        let takes = |step: f64| OF_ROSENBROCK as f64 * end / step;
        rival.next = rival.next.min(2.0 * step);
        while rival.next > 0.99 * step {
            if takes(rival.next) >= cost {
                return Ok(Beside::Dear);
            }
            if let Some((step, error, finest)) = self.does(segments, rival, tried)? {
                let coarse = tried.coarse(Some(&finest), (step, RIVAL));
                let steps = Steps { step, scheme: RIVAL, coarse, error, bound: None };
                return Ok(if takes(step) <= cost { Beside::Found(steps) } else { Beside::Dear });
            }
        }
        Ok(Beside::Open)
    }

    /// Another run by the rival; if it does, the largest step that is known to, its error and the finest run.
    fn does(
        &self,
        segments: usize,
        Rival { next, ladder }: &mut Rival,
        tried: &mut Tried,
    ) -> Result<Option<(f64, f64, Ran)>, Error> {
        let (step, allowed) = (*next, tried.allowed);
        *next *= 0.5;
        let ran = self.runs.run((segments, step, RIVAL))?;
        ladder.add(ran.as_ref().map(|ran| ran.seen.clone()));
        tried.runs.push((step, RIVAL, ran.clone()));
        let (Some(finest), [.., last]) = (ran, ladder.apart()) else { return Ok(None) };
        // What the step before is off by, twice as large.
        let last = *last;
        if last <= SURE * allowed {
            return Ok(Some((2.0 * step, last, finest)));
        }
        if last <= allowed {
            return Ok(Some((SQRT_2 * step, SURE * last, finest)));
        }
        let error = match ladder.apart() {
            [_] => Some(last / (BELIEVED.exp2() - 1.0)),
            _ => ladder.error(f64::from(RIVAL.traits().order)).map(|[error, _]| error),
        };
        let Some(error) = error.filter(|error| *error <= allowed) else { return Ok(None) };
        let between = self.runs.run((segments, SQRT_2 * step, RIVAL))?;
        let off = between.map_or(f64::INFINITY, |between| apart(&between.seen, &finest.seen));
        Ok(Some(match off <= SURE * allowed {
            true => (SQRT_2 * step, off, finest),
            false => (step, error, finest),
        }))
    }

    /// The step is given: what it does is only seen.
    pub fn given_steps(&self, segments: usize, allowed: f64) -> Result<Steps, Error> {
        let time = self.runs.guess.time()?;
        let (own, scheme) = (time.step, time.scheme);
        let mut ladder = Ladder::default();
        let mut tried = Tried { allowed, runs: Vec::new() };
        for step in [4.0 * own, 2.0 * own, own] {
            let ran = self.runs.run((segments, step, scheme))?;
            ladder.add(ran.as_ref().map(|ran| ran.seen.clone()));
            tried.runs.push((step, scheme, ran));
        }
        let known = ladder.error(f64::from(scheme.traits().order)).map(|[error, _]| error);
        let last = ladder.apart().last().map(|last| 1.5 * last);
        let error = known.or(last).unwrap_or(f64::INFINITY);
        let finest = tried.runs.last().and_then(|(.., ran)| ran.clone());
        let coarse = tried.coarse(finest.as_ref(), (own, scheme));
        Ok(Steps { step: own, scheme, coarse, error, bound: Some(Bound::Given) })
    }
}

/// Another scheme beside the first.
struct Rival {
    /// Its next step, s.
    next: f64,
    ladder: Ladder,
}

/// What is known of it.
enum Beside {
    /// It does, and costs less.
    Found(Steps),
    /// It costs more.
    Dear,
    /// Nothing yet.
    Open,
}

/// The runs on one mesh by step and scheme, and the error that the step may make.
struct Tried {
    allowed: f64,
    runs: Vec<(f64, Scheme, Option<Ran>)>,
}

impl Tried {
    /// Step and scheme in which meshes are compared: the cheapest that is near enough to the finest run, or what was chosen.
    fn coarse(&self, finest: Option<&Ran>, chosen: (f64, Scheme)) -> (f64, Scheme) {
        let near = |scheme: Scheme, ran: &Ran| {
            let alike = if scheme == RIVAL { ALIKE_DAMPED } else { ALIKE };
            let most = (alike * self.allowed).min(LARGE);
            finest.is_some_and(|finest| apart(&ran.seen, &finest.seen) <= most)
        };
        let runs = self.runs.iter().filter_map(|(step, scheme, ran)| {
            let ran = ran.as_ref().filter(|ran| near(*scheme, ran))?;
            Some((ran.iterations, (*step, *scheme)))
        });
        let cheapest = runs.min_by(|a, b| a.0.total_cmp(&b.0));
        cheapest.map_or(chosen, |(_, cheapest)| cheapest)
    }
}

//! Scheme and step for a motion.
//!
//! Steps are halved on a coarse mesh, until the differences between one run and the next say which will do. What `rodas4` makes
//! of a step depends on the mesh hardly more than what other schemes do; so where it can simulate the scene it is tried too, and
//! taken where it is the cheaper.

use crate::error::Error;
use crate::resolution::aim::{is_struck, order_of_step};
use crate::resolution::ladder::Ladder;
use crate::resolution::mix::Finest;
use crate::resolution::motion::Search;
use crate::resolution::off::{Off, apart};
use crate::resolution::runs::{OF_STEP, Ran};
use crate::scene::Scheme;
use crate::scene::resolution::Bound;

/// How many times as fine as the finest of three runs, or of two, what is chosen may be: errors of steps may stay what they are
/// over some halvings before they fall.
const FAR: [f64; 2] = [2.0, 1.2];
/// What two runs alone say of a step counts so many times.
const UNSURE: f64 = 1.35;
/// Step errors may be so many times the step's part where meshes are compared: they are alike on both. But of a scheme that damps
/// what its steps do not resolve, and with that what finer meshes change.
const ALIKE: f64 = 30.0;
const ALIKE_DAMPED: f64 = 5.0;
/// And not more than this part of the length, nor those of so many times the finest step.
const LARGE: f64 = 0.02;
const COARSEST: f64 = 4.0;
/// Runs of the first scheme before the rival is tried, and edges that it takes to see where the rival's errors fall off.
const TRIED: usize = 3;
const ENOUGH_EDGES: usize = 5;
/// The scheme that is tried beside the first, and the first step of it that is: so many times that of the first.
const RIVAL: Scheme = Scheme::Rodas4;
const COARSER: f64 = 4.0;
/// What a step of it may make, over what one of the first may: a run is as fine as that only to see where errors fall off.
const ENOUGH: f64 = 1.5;
/// Steps of it are tried that cost up to so many times as much: what is chosen may be coarser.
const DEAR: f64 = 1.4;
/// The order that is believed of it from two runs, and from one beside the first scheme: its errors fall faster, but not from the
/// first step on.
const BELIEVED: f64 = 2.5;
const BELIEVED_OF_ONE: f64 = 3.0;
/// What is seen of its errors counts so many times, on two of its runs and beside the first scheme: on more edges they fall off a
/// little later; fewer times where small motions tell what the mesh is off by.
const ON_MORE_EDGES: f64 = 2.5;
const ON_MORE_EDGES_BENT_LITTLE: f64 = 1.2;
const BESIDE: f64 = 1.5;
/// Where small motions chose for the first scheme, the rival is tried on a mesh of so many times the edges of the first, if a step there
/// takes no more than a part of one on the mesh that was chosen; from so many times the chosen step on. The first scheme
/// takes so many Newton iterations a step.
const EDGES_OF_TRIAL: f64 = 0.65;
const TRIAL: f64 = 0.5;
const COARSER_TRIAL: f64 = 16.0;
const ITERATIONS: f64 = 2.1;
/// How many times as fine as a run of it what is chosen may be, at least and at most.
const OF_RIVAL: [f64; 2] = [0.5, 1.25];
const OF_ONE: [f64; 2] = [0.8, 1.25];

/// What is found of steps.
pub(super) struct Steps {
    /// The finest that was looked at, s.
    pub step: f64,
    pub finest: Finest,
    pub scheme: Scheme,
    /// Step, s, and scheme in which meshes are compared.
    pub coarse: (f64, Scheme),
    pub bound: Option<Bound>,
}

impl Search<'_> {
    /// Scheme, and steps down to about what makes no more than `allowed`, from halving the first step on a mesh.
    pub fn steps(&self, segments: usize, first: f64, allowed: f64) -> Result<Steps, Error> {
        let time = self.runs.guess.time()?;
        let (own, end) = (time.scheme, time.end);
        let order = order_of_step(self.scene, own.traits().order);
        let (mut step, mut ladder) = (first, Ladder::new(UNSURE));
        let mut tried = Tried { allowed, runs: Vec::new() };
        let mut rival = (self.runs.small.is_none() && self.has_rival())
            .then(|| Rival::new(f64::INFINITY, ON_MORE_EDGES));
        loop {
            let ran = self.runs.run((segments, step, own))?;
            ladder.add(ran.as_ref().map(|ran| ran.seen.clone()));
            tried.runs.push((step, own, ran.clone()));
            let known = ladder.off(order);
            if tried.runs.len() >= TRIED
                && let Some(other) = &mut rival
            {
                let known = ran.as_ref().zip(known.as_ref());
                // As far as that is known.
                let cost = known.map_or(f64::INFINITY, |(ran, off)| {
                    ran.iterations * off.finer(allowed).max(0.5)
                });
                other.next = other.next.min(COARSER * step);
                let first = First { step, cost, known };
                match self.cheaper(segments, first, other, &mut tried)? {
                    Beside::Found(steps) => return Ok(steps),
                    Beside::Dear => rival = None,
                    Beside::Open => {}
                }
            }
            let chosen = |off: Off, range: [f64; 2], bound| {
                let coarse = tried.coarse(ran.as_ref(), (step, own));
                Ok(Steps { step, finest: Finest { off, range }, scheme: own, coarse, bound })
            };
            if let Some((off, far)) = ladder.reaches(allowed, order, FAR) {
                return chosen(off, [0.5, far], None);
            }
            if let [.., before, last] = ladder.apart()[..]
                && before.max(last) <= 0.5 * allowed
            {
                return chosen(ladder.last_change(2.0, order), [1.0; 2], None);
            }
            if 2.0 * end / step * segments as f64 > self.runs.most_work {
                // Where nothing could be simulated, whoever runs it is told why.
                let off = known.unwrap_or_else(|| ladder.last_change(2.0, order));
                return chosen(off, [1.0; 2], Some(Bound::Work));
            }
            step *= 0.5;
        }
    }

    /// Whether there is another scheme to be tried: not for a struck rod, whose high modes it damps.
    fn has_rival(&self) -> bool {
        let sees = self.runs.guess.segments() >= ENOUGH_EDGES && !is_struck(self.scene);
        self.runs.open.scheme && sees && self.scene.is_taken_by(RIVAL)
    }

    /// The rival's steps, if they take less than those that small motions chose for the first scheme, with so many edges.
    pub fn rivals(
        &self,
        (edges, step): (usize, f64),
        allowed: f64,
    ) -> Result<Option<Steps>, Error> {
        let guess = &self.runs.guess;
        let trial = (EDGES_OF_TRIAL * guess.segments() as f64) as usize;
        let trial = trial.max(ENOUGH_EDGES);
        let takes = |edges: usize| edges as f64 + OF_STEP;
        if !self.has_rival() || takes(trial) > TRIAL * takes(edges) {
            return Ok(None);
        }
        let cost = ITERATIONS * guess.time()?.end / step;
        let mut tried = Tried { allowed, runs: Vec::new() };
        let mut rival = Rival::new(COARSER_TRIAL * step, ON_MORE_EDGES_BENT_LITTLE);
        let first = First { step, cost, known: None };
        Ok(match self.cheaper(trial, first, &mut rival, &mut tried)? {
            Beside::Found(steps) => Some(steps),
            Beside::Dear | Beside::Open => None,
        })
    }

    /// The rival's step, if there is one down to that of the first scheme that takes less.
    fn cheaper(
        &self,
        segments: usize,
        first: First<'_>,
        rival: &mut Rival,
        tried: &mut Tried,
    ) -> Result<Beside, Error> {
        let end = self.runs.guess.time()?.end;
        let takes = |step: f64| self.runs.of_rosenbrock as f64 * end / step;
        let cost = first.cost;
        while rival.next > 0.99 * first.step {
            let step = rival.next;
            if takes(step) >= DEAR * cost {
                return Ok(Beside::Dear);
            }
            let Some(ran) = self.rivals_run(segments, rival, tried)? else { continue };
            let Some(finest) = does(&ran, first.known, rival, ENOUGH * tried.allowed) else {
                continue;
            };
            let finer = finest.off.finer(ENOUGH * tried.allowed);
            if takes(step) * finer.clamp(finest.range[0], finest.range[1]) > cost {
                return Ok(Beside::Dear);
            }
            let coarse = tried.coarse(Some(&ran), (step, RIVAL));
            return Ok(Beside::Found(Steps { step, finest, scheme: RIVAL, coarse, bound: None }));
        }
        Ok(Beside::Open)
    }

    /// The next run by the rival; none where it failed.
    fn rivals_run(
        &self,
        segments: usize,
        rival: &mut Rival,
        tried: &mut Tried,
    ) -> Result<Option<Ran>, Error> {
        let step = rival.next;
        rival.next *= 0.5;
        let ran = self.runs.run((segments, step, RIVAL))?;
        rival.ladder.add(ran.as_ref().map(|ran| ran.seen.clone()));
        tried.runs.push((step, RIVAL, ran.clone()));
        Ok(ran)
    }

    /// The step is given: what it does is only seen.
    pub fn given_steps(&self, segments: usize, allowed: f64) -> Result<Steps, Error> {
        let time = self.runs.guess.time()?;
        let (own, scheme) = (time.step, time.scheme);
        let mut ladder = Ladder::new(UNSURE);
        let mut tried = Tried { allowed, runs: Vec::new() };
        for step in [4.0 * own, 2.0 * own, own] {
            let ran = self.runs.run((segments, step, scheme))?;
            ladder.add(ran.as_ref().map(|ran| ran.seen.clone()));
            tried.runs.push((step, scheme, ran));
        }
        let order = order_of_step(self.scene, scheme.traits().order);
        let off = ladder.off(order).unwrap_or_else(|| ladder.last_change(1.5, order));
        let ran = tried.runs.last().and_then(|(.., ran)| ran.clone());
        let coarse = tried.coarse(ran.as_ref(), (own, scheme));
        let finest = Finest { off, range: [1.0; 2] };
        Ok(Steps { step: own, finest, scheme, coarse, bound: Some(Bound::Given) })
    }
}

/// What the rival's last run is off by, where that is at most `allowed`: beside what the first scheme would make of finer
/// steps, or beside its own run before.
fn does(ran: &Ran, first: Option<(&Ran, &Off)>, rival: &Rival, allowed: f64) -> Option<Finest> {
    let beside = first.map(|(first, off)| {
        Off::of(&ran.seen, &first.seen, 1.0, BELIEVED_OF_ONE).plus(off).times(BESIDE)
    });
    if let Some(off) = beside.filter(|off| off.size() <= allowed) {
        return Some(Finest { off, range: OF_ONE });
    }
    let order = match *rival.ladder.apart() {
        [] => return None,
        [_] => BELIEVED,
        [.., before, last] => (before / last).log2().clamp(1.0, f64::from(RIVAL.traits().order)),
    };
    // The run before is off by about what the last one changed.
    let off = rival.ladder.last_change(rival.on_more_edges * (-order).exp2(), order);
    (off.size() <= allowed).then_some(Finest { off, range: OF_RIVAL })
}

/// What is known of the first scheme: its finest step, s, the Newton iterations that it takes, and its run, and by how much that is
/// off.
struct First<'a> {
    step: f64,
    cost: f64,
    known: Option<(&'a Ran, &'a Off)>,
}

/// Another scheme beside the first.
struct Rival {
    /// Its next step, s.
    next: f64,
    ladder: Ladder,
    /// What is seen of its errors counts so many times.
    on_more_edges: f64,
}

impl Rival {
    fn new(next: f64, on_more_edges: f64) -> Self {
        Self { next, ladder: Ladder::default(), on_more_edges }
    }
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
            let fine = *step <= 1.01 * COARSEST * chosen.0;
            fine.then_some((ran.iterations, (*step, *scheme)))
        });
        let cheapest = runs.min_by(|a, b| a.0.total_cmp(&b.0));
        cheapest.map_or(chosen, |(_, cheapest)| cheapest)
    }
}

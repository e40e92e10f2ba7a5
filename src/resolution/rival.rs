//! Another scheme beside the first.
//!
//! What `rodas4` makes of a step depends on the mesh hardly more than what other schemes do; so where it can simulate the scene it
//! is tried too, and taken where it is the cheaper. Steps that it takes of small motions fail
//! in large ones: so it is run itself, on a coarse mesh, where that takes little beside what it may save.

use crate::error::Error;
use crate::resolution::aim::is_struck;
use crate::resolution::ladder::Ladder;
use crate::resolution::mix::Finest;
use crate::resolution::motion::Search;
use crate::resolution::off::Off;
use crate::resolution::runs::{OF_STEP, Ran};
use crate::resolution::tried::{RIVAL, Steps, Tried};

/// Edges that it takes to see where its errors fall off.
const ENOUGH_EDGES: usize = 5;
/// The first step of it that is tried: so many times that of the first scheme.
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
const COARSER_TRIAL: f64 = 24.0;
const ITERATIONS: f64 = 2.1;
/// How many times as fine as a run of it what is chosen may be, at least and at most.
const OF_RIVAL: [f64; 2] = [0.5, 1.25];
const OF_ONE: [f64; 2] = [0.8, 1.25];

impl Search<'_> {
    /// Whether there is another scheme to be tried: not for a struck rod, whose high modes it damps.
    pub fn has_rival(&self) -> bool {
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
        let mut rival = Rival {
            next: COARSER_TRIAL * step,
            on_more_edges: ON_MORE_EDGES_BENT_LITTLE,
            ..Rival::default()
        };
        let first = First { step, cost, known: None };
        Ok(match self.cheaper(trial, first, &mut rival, &mut tried)? {
            Beside::Found(steps) => Some(steps),
            Beside::Dear | Beside::Open => None,
        })
    }

    /// The rival's step, if there is one down to that of the first scheme that takes less.
    pub fn cheaper(
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
pub(super) struct First<'a> {
    pub step: f64,
    pub cost: f64,
    pub known: Option<(&'a Ran, &'a Off)>,
}

/// Another scheme beside the first.
pub(super) struct Rival {
    /// Its next step, s.
    next: f64,
    ladder: Ladder,
    /// What is seen of its errors counts so many times.
    on_more_edges: f64,
}

impl Default for Rival {
    fn default() -> Self {
        Self { next: f64::INFINITY, ladder: Ladder::default(), on_more_edges: ON_MORE_EDGES }
    }
}

impl Rival {
    /// It begins a few times coarser than the first scheme's step, s.
    pub fn begin_at(&mut self, step: f64) {
        self.next = self.next.min(COARSER * step);
    }
}

/// What is known of it.
pub(super) enum Beside {
    /// It does, and costs less.
    Found(Steps),
    /// It costs more.
    Dear,
    /// Nothing yet.
    Open,
}

//! Scheme and step for a motion.
//!
//! Steps are halved on a coarse mesh, until the differences between one run and the next say which will do. Another scheme is
//! tried [beside](crate::resolution::rival) the first.

use crate::error::Error;
use crate::resolution::aim::order_of_step;
use crate::resolution::ladder::Ladder;
use crate::resolution::mix::Finest;
use crate::resolution::motion::Search;
use crate::resolution::off::Off;
use crate::resolution::rival::{Beside, First, Rival};
use crate::resolution::tried::{Steps, Tried};
use crate::scene::resolution::Bound;

/// How many times as fine as the finest of three runs, or of two, what is chosen may be: errors of steps may stay what they are
/// over some halvings before they fall.
const FAR: [f64; 2] = [2.0, 1.2];
/// What two runs alone say of a step counts so many times.
const UNSURE: f64 = 1.35;
/// Runs of the first scheme before the rival is tried.
const TRIED: usize = 3;

impl Search<'_> {
    /// Scheme, and steps down to about what makes no more than `allowed`, from halving the first step on a mesh.
    pub fn steps(&self, segments: usize, first: f64, allowed: f64) -> Result<Steps, Error> {
        let time = self.runs.guess.time()?;
        let (own, end) = (time.scheme, time.end);
        let order = order_of_step(self.scene, own.traits().order);
        let (mut step, mut ladder) = (first, Ladder::new(UNSURE));
        let mut tried = Tried { allowed, runs: Vec::new() };
        let mut rival = (self.runs.small.is_none() && self.has_rival()).then(Rival::default);
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
                other.begin_at(step);
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

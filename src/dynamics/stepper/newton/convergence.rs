//! What the corrections of Newton's method say about the error they leave.
//!
//! A correction `d` with the tangent of the place it starts from leaves an error of `C d^2`, where `C`
//! belongs to the curvature of the step's equations and changes little from step to step. One with the
//! tangent of another place, a chord, leaves `B b d`, where `b` is the distance of that place from the
//! solution. Along one direction `B` is `2 C`; but the corrections of a rod bend it first and stretch
//! it then, and `B` is ten times that (measured: the mean on the shipped scenes). So what is left is
//! known without looking, and what another correction with the old factors or with new ones would
//! leave.
//!
//! A tangent under [tensions](super::tensions) that are expected leaves an error of their error times `d` beside that.
//! Both shrink together: what is left is a tenth at most of the part that the correction before has left (a hundredth
//! where it was measured), and a chord with such factors need not lead anywhere.
//!
//! A rod that turns quickly about itself hides how curved its other equations are: it may turn by a radian in a
//! correction that leaves nothing of that, since twist is linear. So a correction is taken to leave no smaller part
//! than edges leave that turn by as much as it moves their ends, or whose directors turn by as much: what the
//! stretching of edges alone makes of it.

use crate::numerics::scalar::Scalar;
use crate::rod::Rod;

/// A correction with a tangent of its own costs as much as this many with the old one.
const TANGENT: f64 = 2.5;
/// Corrections with the old tangent must shrink to this part each.
const SLOWEST: f64 = 0.3;
/// More corrections than this are never planned.
const MOST: usize = 8;

/// `B` by `C`.
const SPREAD: f64 = 20.0;

/// The part of a correction that is left at least, by how far it moves nodes, over the length of an edge, and by how far
/// it turns directors, rad. Of the shipped planar scene nine in ten corrections leave more than the first says, of the helix
/// than the second.
const LEAST: [f64; 2] = [0.2, 0.1];

/// The part of a correction under expected tensions that is left, over that of the one before.
const EXPECTING: f64 = 0.1;

/// Where the tangent of a correction was formed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formed {
    /// Where the correction starts from.
    Here,
    /// There, but under tensions that were expected.
    Expecting,
    /// Where one before started from: the correction is a chord.
    Before,
}

/// What is to be done after a correction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// Nothing: the error that is left is below the tolerance.
    Done,
    /// Another correction with the same factors.
    Chord,
    /// Another correction with a new tangent.
    Tangent,
}

/// The corrections of a step so far.
#[derive(Clone, Debug)]
pub struct Convergence {
    /// Error that may be left, m.
    tolerance: f64,
    /// The error that a correction with its own tangent leaves, by the square of the correction, 1/m.
    curvature: f64,
    /// Distance of the place of the last tangent from the solution, m, and the part that a correction as large leaves at
    /// least.
    base: (f64, f64),
    /// That part by how far nodes are moved, 1/m, and by how far directors are turned, times the rod's length, 1/m.
    least: [f64; 2],
    /// The last correction, m, and whether its tangent was its own.
    last: Option<(f64, bool)>,
}

impl Convergence {
    /// Before the first step of a rod of this `length`, m, with edges as long as `edge`, m; errors below `tolerance`, m, may be
    /// left.
    pub fn new(tolerance: f64, length: f64, edge: f64) -> Self {
        let least = [LEAST[0] / edge, LEAST[1] / length];
        Self { tolerance, curvature: f64::INFINITY, base: (0.0, 0.0), least, last: None }
    }

    /// A new step, which knows from the last one how curved its equations are.
    pub fn begin(&mut self) {
        self.last = None;
    }

    /// Takes note of a correction, by how far nodes are moved, m, and directors turned, times the rod's length, m, and of its
    /// tangent.
    pub fn corrected(&mut self, [moved, turned]: [f64; 2], formed: Formed) -> Next {
        let fresh = formed != Formed::Before;
        let size = moved.max(turned);
        let least = self.least[0] * moved + self.least[1] * turned;
        if fresh {
            self.base = (size, least);
        }
        // What the correction before has left is what this one has found.
        let (mut slowness, mut part) = (0.0, f64::INFINITY);
        if let Some((before, fresh)) = self.last {
            part = size / before;
            match fresh {
                true => self.curvature = part / before,
                false => slowness = part,
            }
        }
        let observed = self.last.is_some();
        self.last = Some((size, fresh));
        let chord = slowness.max(SPREAD * (self.curvature * self.base.0).max(self.base.1));
        let own = (self.curvature * size).max(least);
        let left = size
            * match formed {
                Formed::Here => own,
                Formed::Expecting => own.max(EXPECTING * part),
                Formed::Before => chord,
            };
        // The first correction has nothing but the last step's word for it.
        if size <= self.tolerance || (observed && left <= self.tolerance) {
            return Next::Done;
        }
        let chords = self.corrections(left, chord);
        if formed == Formed::Expecting {
            return Next::Tangent;
        }
        let own = self.curvature * left;
        let own = TANGENT + self.corrections(own * left, SPREAD * own);
        match chord < SLOWEST && chords <= own {
            true => Next::Chord,
            false => Next::Tangent,
        }
    }

    /// How many corrections that leave the part `chord` each bring an error from `left` below the
    /// tolerance.
    fn corrections(&self, mut left: f64, chord: f64) -> f64 {
        let mut corrections = 0;
        while left > self.tolerance && corrections < MOST {
            left *= chord;
            corrections += 1;
        }
        corrections as f64
    }
}

/// How far a correction moves nodes, and turns directors, times `length`, m: the largest of those of the unknowns from `first`
/// on.
#[inline]
pub fn sizes<D: Scalar, R: Rod<D>>(correction: &[D], first: usize, length: f64) -> [f64; 2] {
    // Four side by side: every fourth unknown is an angle, or none is.
    let (fours, rest) = correction.as_chunks::<4>();
    let mut largest = [0.0_f64; 4];
    let mut see = |k: usize, correction: D| {
        let size = correction.value().abs();
        largest[k] = if size > largest[k] { size } else { largest[k] };
    };
    for four in fours {
        for k in 0..4 {
            see(k, four[k]);
        }
    }
    for (k, correction) in rest.iter().enumerate() {
        see(k, *correction);
    }
    let (mut moved, mut turned) = (0.0_f64, 0.0_f64);
    for k in 0..4 {
        match R::is_angle(first + k) {
            true => turned = turned.max(length * largest[k]),
            false => moved = moved.max(largest[k]),
        }
    }
    [moved, turned]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solves `x + c x^2 = 0` from `x0`; returns the error that is left and how many tangents and
    /// corrections that took.
    fn solve(convergence: &mut Convergence, c: f64, x0: f64) -> (f64, usize, usize) {
        let (mut x, mut slope) = (x0, 0.0);
        let (mut next, mut tangents) = (Next::Tangent, 0);
        convergence.begin();
        for corrections in 0..50 {
            let fresh = next == Next::Tangent;
            if fresh {
                (slope, tangents) = (1.0 + 2.0 * c * x, tangents + 1);
            }
            let d = -(x + c * x * x) / slope;
            x += d;
            let formed = if fresh { Formed::Here } else { Formed::Before };
            next = convergence.corrected([d.abs(), 0.0], formed);
            if next == Next::Done {
                return (x.abs(), tangents, corrections + 1);
            }
        }
        panic!("no end");
    }

    #[test]
    fn what_is_left_is_below_the_tolerance() {
        for tolerance in [1e-8, 1e-12] {
            for c in [1e-3, 0.1, 1.0, 20.0] {
                let mut convergence = Convergence::new(tolerance, 1.0, f64::INFINITY);
                for x0 in [1e-3, -2e-3, 1e-5, 3e-7, 1e-2, 1e-3] {
                    let (left, ..) = solve(&mut convergence, c, x0);
                    assert!(left <= 1.2 * tolerance, "{tolerance} {c} {x0}: {left:e}");
                }
            }
        }
    }

    #[test]
    fn one_tangent_does_for_small_steps_and_more_for_large_ones() {
        let mut convergence = Convergence::new(1e-12, 1.0, f64::INFINITY);
        solve(&mut convergence, 1.0, 1e-4);
        assert_eq!(solve(&mut convergence, 1.0, 1e-5).1, 1);
        // 0.1, 1e-2, 1e-4, 1e-8: the old tangent does for the last bit only.
        let (_, tangents, corrections) = solve(&mut convergence, 1.0, 0.1);
        assert!(tangents >= 3 && corrections <= 5, "{tangents} {corrections}");
    }

    #[test]
    fn what_is_no_number_is_not_done() {
        let mut convergence = Convergence::new(1e-12, 1.0, f64::INFINITY);
        assert_ne!(convergence.corrected([f64::NAN; 2], Formed::Here), Next::Done);
        assert_ne!(convergence.corrected([f64::NAN; 2], Formed::Before), Next::Done);
    }
}

//! Error estimate of Newton's method from its corrections, and the choice of the next iteration.
//!
//! A correction `d` with the tangent at its own start has the error `C d^2`. `C` belongs to the curvature of the
//! step's equations and changes little from step to step. A chord, with the tangent of another place, has the error
//! `B b d`, where `b` is the distance of that place from the solution. Along one direction `B` is `2 C`. The
//! corrections of a rod bend it first and stretch it then, so that `B` is ten times that (measured: the mean on the
//! shipped scenes). The errors after this correction, and after another one with old or new factors, follow without a
//! new residual.
//!
//! A tangent under expected [tensions](super::tensions) also has an error of the tensions' error times `d`. Both shrink
//! together: the relative error is estimated as a tenth of that of the correction before, if that is more than the one
//! without tensions. A chord with such factors may diverge.
//!
//! A quick rotation of a rod about its axis hides the curvature of the other equations: it may be a radian in one
//! correction without any error, since twist is linear. Therefore the relative error of a correction has a lower
//! bound: that by the stretching of edges which rotate as their ends move, or as their directors turn.
//!
//! Input: the size of each correction (displacement of nodes, m; rotation of directors, rad, times the length) and the
//! origin of its tangent. `begin` begins a step, [`sizes`] measures a correction, and `corrected` records it. Output
//! ([`NextIteration`]): the iteration ends if the correction, or from the second one on its estimated error, is at most
//! the tolerance (m). It continues with the same factors if a chord's error ratio is below `SLOWEST` and chords cost no
//! more than a new tangent. Else, and always after expected tensions, it needs a new tangent.

use crate::numerics::scalar::Scalar;
use crate::rod::Rod;

/// Cost of a correction with a new tangent, over that of a chord (a correction with old factors).
const TANGENT: f64 = 2.5;
/// Largest ratio of a chord's error to that before it, at which chords are continued; above it a new tangent is formed.
const SLOWEST: f64 = 0.3;
/// Largest number of corrections that the cost estimate counts.
const MOST: usize = 8;

/// `B` over `C`: ten times the factor 2 of a single direction (see above).
const SPREAD: f64 = 20.0;

/// Lower bound of the relative error of a correction: over the displacement of nodes by the length of an edge, and over
/// the rotation of directors, rad. Nine in ten corrections of the shipped planar scene exceed the first, and of the
/// helix the second.
const LEAST: [f64; 2] = [0.2, 0.1];

/// Relative error of a correction under expected tensions, over that of the correction before.
const EXPECTING: f64 = 0.1;

/// The place at which the tangent of a correction was formed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TangentOrigin {
    /// The start of the correction.
    Current,
    /// The start, under expected tensions.
    ExpectedTensions,
    /// The start of an earlier correction: this one is a chord.
    Previous,
}

/// The iteration after a correction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NextIteration {
    /// None: the estimated error is below the tolerance.
    Done,
    /// Another correction with the same factors.
    Chord,
    /// Another correction with a new tangent.
    Tangent,
}

/// A correction of Newton's method, as far as the error estimate needs it.
#[derive(Clone, Copy, Debug)]
struct NewtonCorrection {
    /// The larger of the displacement of nodes, and of the rotation of directors times the rod's length, m.
    size: f64,
    /// Whether its tangent was formed at its start, and not at that of an earlier correction.
    is_fresh: bool,
}

/// The error estimate of a step's iteration from its corrections so far. The curvature `C` is kept from step to step.
#[derive(Clone, Debug)]
pub struct Convergence {
    /// Largest error, m.
    tolerance: f64,
    /// `C`: the error of a correction with its own tangent, over the square of the correction, 1/m.
    curvature: f64,
    /// Distance of the place of the last tangent from the solution, m.
    tangent_distance: f64,
    /// Lower bound of the relative error of the correction with the last tangent.
    tangent_bound: f64,
    /// That bound over the displacement of nodes, 1/m, and over the rotation of directors times the rod's length, 1/m.
    least: [f64; 2],
    /// The last correction of the step, if there is one.
    last: Option<NewtonCorrection>,
}

impl Convergence {
    /// The estimate before the first step of a rod of this `length`, m, with edges of the length `edge`, m, for a
    /// `tolerance` of the error, m. The curvature is infinite until it is observed.
    pub fn new(tolerance: f64, length: f64, edge: f64) -> Self {
        let least = [LEAST[0] / edge, LEAST[1] / length];
        Self {
            tolerance,
            curvature: f64::INFINITY,
            tangent_distance: 0.0,
            tangent_bound: 0.0,
            least,
            last: None,
        }
    }

    /// Begins a step: no correction yet; the curvature of earlier steps is kept.
    pub fn begin(&mut self) {
        self.last = None;
    }

    /// Records a correction and returns the next iteration. `Done` if the correction, or from the second one on its
    /// estimated error, is at most the tolerance. Otherwise `Chord` if a chord's error ratio is below [`SLOWEST`], and
    /// chords to the tolerance cost no more than a new tangent ([`TANGENT`] chords) with its own. Otherwise, and always
    /// after a tangent under expected tensions, `Tangent`. Input: largest displacement of nodes, m, largest rotation of
    /// directors times the rod's length, m, and the origin of the tangent. The curvature is updated if the correction
    /// before had a new tangent.
    pub fn corrected(&mut self, [moved, turned]: [f64; 2], formed: TangentOrigin) -> NextIteration {
        let fresh = formed != TangentOrigin::Previous;
        let size = moved.max(turned);
        let least = self.least[0] * moved + self.least[1] * turned;
        if fresh {
            (self.tangent_distance, self.tangent_bound) = (size, least);
        }
        // This correction is the error of the one before.
        let (mut slowness, mut part) = (0.0, f64::INFINITY);
        if let Some(before) = self.last {
            part = size / before.size;
            match before.is_fresh {
                true => self.curvature = part / before.size,
                false => slowness = part,
            }
        }
        let observed = self.last.is_some();
        self.last = Some(NewtonCorrection { size, is_fresh: fresh });
        // Relative error of a further chord: observed, or predicted by the distance of the tangent's place.
        let chord =
            slowness.max(SPREAD * (self.curvature * self.tangent_distance).max(self.tangent_bound));
        let own = (self.curvature * size).max(least);
        let left = size
            * match formed {
                TangentOrigin::Current => own,
                TangentOrigin::ExpectedTensions => own.max(EXPECTING * part),
                TangentOrigin::Previous => chord,
            };
        // The first correction has the curvature of the last step only.
        if size <= self.tolerance || (observed && left <= self.tolerance) {
            return NextIteration::Done;
        }
        // Costs of the ways to the tolerance: chords only, or a new tangent with its own chords.
        let chords = self.corrections(left, chord);
        if formed == TangentOrigin::ExpectedTensions {
            return NextIteration::Tangent;
        }
        let own = self.curvature * left;
        let own = TANGENT + self.corrections(own * left, SPREAD * own);
        match chord < SLOWEST && chords <= own {
            true => NextIteration::Chord,
            false => NextIteration::Tangent,
        }
    }

    /// The number of corrections, at most [`MOST`], that reduce an error `left`, m, to the tolerance, if each
    /// multiplies it by `chord`.
    fn corrections(&self, mut left: f64, chord: f64) -> f64 {
        let mut corrections = 0;
        while left > self.tolerance && corrections < MOST {
            left *= chord;
            corrections += 1;
        }
        corrections as f64
    }
}

/// Sizes of a `correction` of the unknowns from index `first` on: the largest absolute displacement of a node along an
/// axis, m, and the largest rotation of a director times `length`, m. The second is zero without angles.
#[inline(always)]
pub fn sizes<D: Scalar, R: Rod<D>>(
    rod: &R,
    correction: &[D],
    first: usize,
    length: f64,
) -> [f64; 2] {
    // Four in SIMD lanes: every fourth unknown is an angle, or none is.
    let (fours, rest) = correction.as_chunks::<4>();
    let mut largest = [0.0_f64; 4];
    // A comparison instead of f64::max, which is not one instruction because of NaN.
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
        match rod.has_angle_at(first + k) {
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
        let (mut next, mut tangents) = (NextIteration::Tangent, 0);
        convergence.begin();
        for corrections in 0..50 {
            let fresh = next == NextIteration::Tangent;
            if fresh {
                (slope, tangents) = (1.0 + 2.0 * c * x, tangents + 1);
            }
            let d = -(x + c * x * x) / slope;
            x += d;
            let formed = if fresh { TangentOrigin::Current } else { TangentOrigin::Previous };
            next = convergence.corrected([d.abs(), 0.0], formed);
            if next == NextIteration::Done {
                return (x.abs(), tangents, corrections + 1);
            }
        }
        panic!("no end");
    }

    #[test]
    fn newton_error_stays_below_the_tolerance() {
        for tolerance in [1e-8, 1e-12] {
            for c in [1e-3, 0.1, 1.0, 20.0] {
                let mut convergence = Convergence::new(tolerance, 1.0, f64::INFINITY);
                for x0 in [1e-3, -2e-3, 1e-5, 3e-7, 1e-2, 1e-3] {
                    let (left, ..) = solve(&mut convergence, c, x0);
                    // The estimate is of leading order in the error: a fifth above the tolerance
                    // is allowed.
                    assert!(left <= 1.2 * tolerance, "{tolerance} {c} {x0}: {left:e}");
                }
            }
        }
    }

    #[test]
    fn small_steps_take_one_tangent_and_large_ones_several() {
        let mut convergence = Convergence::new(1e-12, 1.0, f64::INFINITY);
        solve(&mut convergence, 1.0, 1e-4);
        assert_eq!(solve(&mut convergence, 1.0, 1e-5).1, 1);
        // 0.1, 1e-2, 1e-4, 1e-8: the old tangent does for the last bit only.
        let (_, tangents, corrections) = solve(&mut convergence, 1.0, 0.1);
        assert!(tangents >= 3 && corrections <= 5, "{tangents} {corrections}");
    }

    #[test]
    fn nan_correction_does_not_end_the_iteration() {
        let mut convergence = Convergence::new(1e-12, 1.0, f64::INFINITY);
        assert_ne!(
            convergence.corrected([f64::NAN; 2], TangentOrigin::Current),
            NextIteration::Done
        );
        assert_ne!(
            convergence.corrected([f64::NAN; 2], TangentOrigin::Previous),
            NextIteration::Done
        );
    }
}

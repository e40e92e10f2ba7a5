//! `rodas4` (a Rosenbrock method of fourth order) as the alternative to generalised-alpha in the choice of numerics.
//!
//! Input: the number of edges of a coarse mesh, the steps that generalised-alpha has run and would need, and the target
//! error of the step over the length. Trial runs halve the step, at most [`MAX_RUNS`] runs, until the observed order
//! predicts the work for the target within [`MAX_EXTRAPOLATION`] times the steps. `rodas4` is chosen if that is less
//! than [`MAX_WORK_RATIO`] of the work of generalised-alpha. Its error decreases abruptly at a number of steps that is
//! the same on coarse and on fine meshes to a factor of 1.4. A step takes as long as several Newton iterations of
//! generalised-alpha. Output: the last trial run, or the one before if that reaches the target, and its differences. It
//! is `None` if no run suffices, or as soon as a run is itself too expensive.

use crate::accuracy::difference::{OrderBounds, RefinementSequence, UNRELATED, largest_distance};
use crate::accuracy::trial::{ITERATIONS, Numerics, TrialRun, TrialRuns};
use crate::error::Error;
use crate::scene::Scheme;

/// Largest work over that of generalised-alpha at which `rodas4` is chosen: on finer meshes its error falls at smaller
/// steps.
const MAX_WORK_RATIO: f64 = 0.7;
/// Bounds of the observed order of its step error.
const ORDERS: OrderBounds = OrderBounds { highest: 3.0, at_once: 3.0, lowest: 0.32, assumed: 2.0 };
/// Largest extrapolation, steps over those of the last run.
const MAX_EXTRAPOLATION: f64 = 3.0;
/// Work of its first run over that of the last run by generalised-alpha on the same mesh.
const FIRST_WORK_RATIO: f64 = 0.5;
/// Largest number of trial runs, each with twice the steps of the one before.
const MAX_RUNS: usize = 4;

/// A trial run with `rodas4`, and the sequence of differences from which its step error is estimated.
pub(super) struct Alternative {
    /// The run with which the search goes on.
    pub trial: TrialRun,
    /// Differences between runs by halved steps, up to that run.
    pub step: RefinementSequence,
}

/// A trial run of `rodas4` on `segments` edges whose step error is extrapolated to `target`, over the length, with its
/// differences. Its work must be less than [`MAX_WORK_RATIO`] of that of generalised-alpha with `needed` steps, and the
/// extrapolation at most [`MAX_EXTRAPOLATION`] times the steps. The first run takes [`FIRST_WORK_RATIO`] of the work of
/// `tried` steps of generalised-alpha (at least 4 steps), each further one has twice the steps. If the run before the
/// last one reaches the target, that one is returned. `None` if none of [`MAX_RUNS`] runs suffices, or as soon as a run
/// is itself too expensive. Error: invalid input.
pub(super) fn cheaper_alternative(
    trials: &TrialRuns<'_>,
    segments: usize,
    tried: usize,
    needed: f64,
    target: f64,
) -> Result<Option<Alternative>, Error> {
    let iterations = trials.iterations_of_rodas4;
    let is_worthwhile = |steps: f64| iterations * steps < MAX_WORK_RATIO * ITERATIONS * needed;
    let mut steps =
        ((FIRST_WORK_RATIO * tried as f64 * ITERATIONS / iterations).ceil() as usize).max(4);
    let mut step = RefinementSequence::new(ORDERS);
    let mut before: Option<TrialRun> = None;
    for _ in 0..MAX_RUNS {
        // A run that is itself too expensive ends the attempt, although an estimate needs two.
        if !is_worthwhile(steps as f64) {
            return Ok(None);
        }
        let numerics = Numerics { segments, steps, scheme: Scheme::Rodas4 };
        let now = trials.run(numerics)?;
        if let Some((before, now)) = before.as_ref().zip(now.clone()) {
            // Richardson: error of the last run, and the refinement that the target still needs.
            let difference = largest_distance(&before.positions, &now.positions);
            step.push(difference, 2.0);
            let further = (step.error() / target).powf(step.order().recip());
            let is_known = difference < UNRELATED && further <= MAX_EXTRAPOLATION;
            // The result has at least the steps of the run before, half of these.
            if is_known && is_worthwhile(steps as f64 * further.max(0.5)) {
                // If the run before already reaches the target, its larger step is used.
                let is_fine = step.clone().coarsened().error() <= target;
                return Ok(Some(match is_fine {
                    true => Alternative { trial: before.clone(), step: step.coarsened() },
                    false => Alternative { trial: now, step },
                }));
            }
        }
        before = now;
        steps *= 2;
    }
    Ok(None)
}

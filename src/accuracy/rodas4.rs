//! `rodas4` as the alternative to generalised-alpha: fourth order, at the cost of several Newton iterations a step.
//!
//! Its error falls abruptly at some number of steps, which is the same on coarse and on fine meshes to a factor of 1.4. It is
//! tried on a coarse mesh.

use crate::accuracy::difference::{OrderBounds, RefinementSequence, UNRELATED, largest_distance};
use crate::accuracy::trial::{ITERATIONS, Numerics, TrialRun, TrialRuns};
use crate::error::Error;
use crate::scene::Scheme;

/// It is chosen where it takes at most this part of the work: on finer meshes its errors fall later.
const WORTHWHILE: f64 = 0.7;
/// Orders of its step errors.
const ORDERS: OrderBounds = OrderBounds { highest: 3.0, at_once: 3.0, lowest: 0.32, assumed: 2.0 };
/// Steps that it may need over those that were tried.
const FURTHER: f64 = 3.0;
/// Work of its first run over that of the last run by generalised-alpha on the same mesh.
const FIRST: f64 = 0.5;
/// Runs, each with twice the steps.
const RUNS: usize = 4;

/// A trial run with `rodas4` and the differences of its step.
pub(super) struct Alternative {
    pub trial: TrialRun,
    pub numerics: Numerics,
    pub step: RefinementSequence,
}

/// The scheme on the mesh of `segments`, where it leaves `target` with less work than generalised-alpha with `needed` steps;
/// it is tried with the work of about `tried` steps of the latter.
pub(super) fn cheaper(
    trials: &TrialRuns<'_>,
    segments: usize,
    tried: usize,
    needed: f64,
    target: f64,
) -> Result<Option<Alternative>, Error> {
    let iterations = trials.iterations_of_rodas4;
    let is_worthwhile = |steps: f64| iterations * steps < WORTHWHILE * ITERATIONS * needed;
    let mut steps = ((FIRST * tried as f64 * ITERATIONS / iterations).ceil() as usize).max(4);
    let mut step = RefinementSequence::new(ORDERS);
    let mut before: Option<TrialRun> = None;
    for _ in 0..RUNS {
        // The run after this one determines its error.
        if !is_worthwhile(steps as f64) {
            return Ok(None);
        }
        let numerics = Numerics { segments, steps, scheme: Scheme::Rodas4 };
        let now = trials.run(numerics)?;
        if let Some((before, now)) = before.as_ref().zip(now.clone()) {
            let difference = largest_distance(&before.positions, &now.positions);
            step.push(difference, 2.0);
            let further = (step.error() / target).powf(step.order().recip());
            let is_known = difference < UNRELATED && further <= FURTHER;
            if is_known && is_worthwhile(steps as f64 * further.max(0.5)) {
                let is_fine = step.clone().coarsened().error() <= target;
                return Ok(Some(match is_fine {
                    true => Alternative {
                        trial: before.clone(),
                        numerics: Numerics { steps: steps / 2, ..numerics },
                        step: step.coarsened(),
                    },
                    false => Alternative { trial: now, numerics, step },
                }));
            }
        }
        before = now;
        steps *= 2;
    }
    Ok(None)
}

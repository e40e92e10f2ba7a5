//! `rodas4` as the alternative to generalised-alpha: fourth order, at the cost of several Newton iterations a step.

use crate::accuracy::difference::{ContractionBounds, Differences, UNRELATED, largest_distance};
use crate::accuracy::refinement::{ErrorModel, Free, work};
use crate::accuracy::trial::{Numerics, Trial, Trials};
use crate::error::Error;
use crate::scene::Scheme;

/// Steps of its first trial run over those that generalised-alpha would need.
const FIRST_STEPS: f64 = 1.0 / 32.0;
/// Work of a trial run over that of the run by generalised-alpha, at most.
const MOST_WORK: f64 = 0.35;
/// It is chosen where it takes at most this part of the work: on finer meshes its errors fall later.
const WORTHWHILE: f64 = 0.7;
/// Newton iterations a step of generalised-alpha.
const ITERATIONS: f64 = 2.1;
/// Contractions of its step errors: those of orders 3 and 0.3, and 2 after a single difference.
const CONTRACTION: ContractionBounds =
    ContractionBounds { fastest: 0.125, slowest: 0.8, assumed: 0.25 };
/// Growth of the work from its last trial run to the chosen one at most.
const GROWTH: f64 = 9.0;
/// Growth of the work from the last trial run to a run by generalised-alpha, at most.
const MOST_GROWTH: f64 = 16.0;

/// Its errors on the mesh of the last trial run and the numerics that they belong to, where it reaches the target with less
/// work than generalised-alpha.
pub(super) fn cheaper(
    trials: &Trials<'_>,
    last: Numerics,
    errors: ErrorModel,
    target: f64,
) -> Result<Option<(ErrorModel, Numerics)>, Error> {
    let both = Free { mesh: true, step: true };
    let segments = last.segments as f64;
    let needed = errors.cheapest(target, segments, both).map(|(finer, _)| finer);
    let most = MOST_GROWTH * work(segments, last.steps as f64);
    let by_alpha = needed.map_or(most, |finer| {
        work(finer.mesh * segments, finer.step * last.steps as f64).min(most)
    });
    let by_alpha = ITERATIONS * by_alpha;
    let finer_steps = needed.map_or(1.0, |finer| finer.step.min(MOST_GROWTH));
    let mut steps = ((FIRST_STEPS * finer_steps * last.steps as f64) as usize).max(4);
    let mut differences = Differences::new(CONTRACTION);
    let mut before: Option<Trial> = None;
    loop {
        let takes = trials.iterations_of_rodas4 * work(segments, steps as f64);
        if takes > MOST_WORK * by_alpha {
            return Ok(None);
        }
        let numerics = Numerics { steps, scheme: Scheme::Rodas4, ..last };
        let trial = trials.run(numerics)?;
        match (&before, &trial) {
            (Some(before), Some(trial)) => {
                differences.push(largest_distance(&before.positions, &trial.positions));
            }
            _ => differences.clear(),
        }
        before = trial;
        if differences.last().is_some_and(|last| last < UNRELATED) {
            let own =
                ErrorModel { step: differences.error(), step_order: differences.order(), ..errors };
            if let Some((finer, growth)) = own.cheapest(target, segments, both)
                && growth <= GROWTH
            {
                let own_work = work(finer.mesh * segments, finer.step * steps as f64);
                if trials.iterations_of_rodas4 * own_work < WORTHWHILE * by_alpha {
                    return Ok(Some((own, numerics)));
                }
                if differences.count() > 1 {
                    return Ok(None);
                }
            }
        }
        steps *= 2;
    }
}

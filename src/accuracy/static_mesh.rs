//! A mesh for what does not move.

use crate::accuracy::aim::{Aim, Found, MAX_SEGMENTS, MAX_SEGMENTS_OF_MODES, allowed_edges};
use crate::accuracy::difference::{OrderBounds, Positions, RefinementSequence, largest_distance};
use crate::accuracy::extrapolation::order_of_mesh;
use crate::accuracy::trial::free_ends_or_middle;
use crate::error::Error;
use crate::problem::Problem;
use crate::scene::resolution::Bound;
use crate::scene::{Point, Scene};
use crate::vibration::LinearizationPoint;

/// RefinedPart of the accuracy that the mesh may take: the estimate of its error has an error itself.
const MOST: f64 = 0.78;
/// The error after a single difference, over that of the theoretical order.
const UNSURE: f64 = 1.5;
/// The lowest order that belongs to a converging sequence, of second and of first order.
const LOWEST: [f64; 2] = [1.32, 0.486];
/// The chosen mesh is at most so many times as fine as the finest of three meshes, of two, and of two after one without a
/// solution.
const FAR: [f64; 3] = [2.0, 1.3, 1.0];
/// RefinementSequence below this are rounding errors where they do not fall.
const ROUNDING: f64 = 1e-4;
/// RefinementSequence below this are none.
const NO_DIFFERENCE: f64 = 1e-12;

/// Orders of a method of first or second order.
fn order_bounds(order: f64) -> OrderBounds {
    let assumed = (1.0 + (order.exp2() - 1.0) / UNSURE).log2();
    let lowest = if order > 1.0 { LOWEST[0] } else { LOWEST[1] };
    OrderBounds { highest: order, at_once: order, lowest, assumed }
}

/// A mesh for what does not move.
pub(super) fn choose_static_mesh(
    scene: &Scene,
    aim: Aim,
    (edges, step): (usize, f64),
) -> Result<Found, Error> {
    let (order, allowed) = (order_of_mesh(scene), MOST * scene.asked());
    let mut differences = RefinementSequence::new(order_bounds(order));
    let (mut segments, mut before, mut has_failed) = (edges, None, false);
    let (most, least) = match aim {
        Aim::Modes(count) => (MAX_SEGMENTS_OF_MODES.max(edges), 2 * count),
        _ => (MAX_SEGMENTS, 2),
    };
    loop {
        let now = match compared(&scene.resolved(segments, step).posed()?, aim) {
            // A coarse mesh may have no equilibrium where a finer one has.
            Err(Error::Equilibrium { .. }) if 2 * segments <= most => None,
            compared => Some(compared?),
        };
        match before.as_ref().zip(now.as_ref()) {
            Some((before, now)) => differences.push(largest_distance(before, now), 2.0),
            None => differences.clear(),
        }
        has_failed |= now.is_none();
        before = now;
        let last = differences.last();
        let is_none = differences.count() > 1 && last.is_some_and(|last| last < NO_DIFFERENCE);
        let known = differences.count() > 0 && (differences.is_converging() || is_none);
        let error = known.then(|| if is_none { last.unwrap_or(0.0) } else { differences.error() });
        if let Some(error) = error {
            let far = match (differences.count(), has_failed) {
                (1, true) => FAR[2],
                (1, false) => FAR[1],
                _ => FAR[0],
            };
            let power = if is_none { order } else { differences.order_or(order) };
            let finer = (error / allowed).powf(power.recip());
            if finer <= far {
                let chosen = (segments as f64 * finer.max(0.5)).ceil() as usize;
                let chosen = allowed_edges(scene, chosen.max(least));
                let error = error * (chosen as f64 / segments as f64).powf(-power);
                return Ok((chosen, step, Some(error), None));
            }
        }
        if differences.count() > 2 && !differences.is_falling() && last < Some(ROUNDING) {
            // Finer meshes leave more rounding errors.
            return Ok((segments / 2, step, last, Some(Bound::Work)));
        }
        if 2 * segments > most {
            return Ok((segments, step, error.or(last), Some(Bound::Work)));
        }
        segments *= 2;
    }
}

/// The logarithm of a frequency or of a growth rate (negative), with its sign: two meshes differ by the relative error of
/// the mode, or by more than all of it where one of them has an unstable mode and the other a stable one.
fn logarithm(frequency: f64) -> [f64; 3] {
    match frequency == 0.0 {
        true => [0.0; 3],
        false => [frequency.abs().ln(), frequency.signum(), 0.0],
    }
}

/// Places over the length, or logarithms of frequencies and growth rates.
fn compared(problem: &Problem, aim: Aim) -> Result<Positions, Error> {
    if let Aim::Modes(count) = aim {
        // What has no equilibrium may still be looked at about its rest shape.
        let found = problem
            .modes(count, LinearizationPoint::Equilibrium)
            .or_else(|_| problem.modes(count, LinearizationPoint::Rest))?;
        return Ok(found.modes.iter().map(|mode| logarithm(mode.frequency_rad_s)).collect());
    }
    let rest = problem.equilibrium()?;
    let over = problem.length().recip();
    let place = |point: &Point| {
        let mut place = [0.0; 3];
        for (i, weight) in problem.stencil(*point)?.nodes {
            (0..3).for_each(|c| place[c] += over * weight * rest.nodes[i][c]);
        }
        Ok(place)
    };
    free_ends_or_middle(problem).iter().map(place).collect()
}

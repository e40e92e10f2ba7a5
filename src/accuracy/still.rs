//! A mesh for what does not move.

use crate::accuracy::aim::{Aim, Found, MOST_EDGES, MOST_OF_MODES, allowed_edges, order_of_mesh};
use crate::accuracy::ladder::Ladder;
use crate::accuracy::off::Seen;
use crate::accuracy::trial::looked_at;
use crate::error::Error;
use crate::problem::Problem;
use crate::scene::resolution::Bound;
use crate::scene::{Point, Scene};
use crate::vibration::About;

/// Part of the accuracy that the mesh may take: errors of errors take the rest. What two meshes alone say counts so many times.
const MOST: f64 = 0.78;
const UNSURE: f64 = 1.5;
/// What is chosen is at most so many times as fine as the finest of three meshes that were looked at, or of two.
const FAR: f64 = 2.0;
const FAR_BY_TWO: f64 = 1.3;
/// Of three differences or more the last, where it is not below the one before it and smaller than this, is of rounding errors.
const ROUNDING: f64 = 1e-4;

/// A mesh for what does not move.
pub(super) fn still(scene: &Scene, aim: Aim, (edges, step): (usize, f64)) -> Result<Found, Error> {
    let (mut ladder, mut segments) = (Ladder::new(UNSURE), edges);
    let (order, allowed) = (order_of_mesh(scene), MOST * scene.asked());
    let (most, least) = match aim {
        Aim::Modes(count) => (MOST_OF_MODES.max(edges), 2 * count),
        _ => (MOST_EDGES, 2),
    };
    loop {
        match seen(&scene.resolved(segments, step).posed()?, aim) {
            // A coarse mesh may have no equilibrium where a finer one has.
            Err(Error::Equilibrium { .. }) if 2 * segments <= most => ladder.add(None),
            seen => ladder.add(Some(seen?)),
        }
        if let Some((off, _)) = ladder.reaches(allowed, order, [FAR, FAR_BY_TWO]) {
            let chosen = (segments as f64 * off.finer(allowed).max(0.5)).ceil() as usize;
            let chosen = allowed_edges(scene, chosen.max(least));
            let error = off.size() * off.left(chosen as f64 / segments as f64, 1.0);
            return Ok((chosen, step, Some(error), None));
        }
        let last = ladder.apart().last().copied();
        if let [_, .., before, last] = *ladder.apart()
            && last >= before
            && last < ROUNDING
        {
            // Finer meshes leave more rounding errors.
            return Ok((segments / 2, step, Some(last), Some(Bound::Work)));
        }
        if 2 * segments > most {
            let error = ladder.off(order).map(|off| off.size());
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
fn seen(problem: &Problem, aim: Aim) -> Result<Seen, Error> {
    if let Aim::Modes(count) = aim {
        // What has no equilibrium may still be looked at about its rest shape.
        let found = problem
            .modes(count, About::Equilibrium)
            .or_else(|_| problem.modes(count, About::Rest))?;
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
    looked_at(problem).iter().map(place).collect()
}

//! A mesh for what does not move.

use crate::error::Error;
use crate::resolution::aim::{Aim, Found, MOST_EDGES, PART};
use crate::resolution::ladder::{Ladder, Seen};
use crate::resolution::runs::looked_at;
use crate::scene::resolution::Bound;
use crate::scene::{Point, Scene};
use crate::vibration::About;

/// What is chosen is at most so many times as fine as the finest of three meshes that were looked at, or of two.
const FAR: f64 = 2.0;
const FAR_BY_TWO: f64 = 1.3;

/// A mesh for what does not move.
pub(super) fn still(scene: &Scene, aim: Aim, (edges, step): (usize, f64)) -> Result<Found, Error> {
    let mut ladder = Ladder::default();
    let (mut segments, allowed) = (edges, 2.0 * PART * scene.asked());
    loop {
        let problem = scene.resolved(segments, step).posed()?;
        let seen: Seen = match aim {
            Aim::Modes(count) => {
                let found = problem.modes(count, About::default())?;
                found
                    .modes
                    .iter()
                    .map(|mode| [mode.frequency_rad_s.max(1e-300).ln(), 0.0, 0.0])
                    .collect()
            }
            _ => {
                let rest = problem.equilibrium()?;
                let over = problem.length().recip();
                let place = |point: &Point| {
                    let mut place = [0.0; 3];
                    for (i, weight) in problem.stencil(*point)?.nodes {
                        (0..3).for_each(|c| place[c] += over * weight * rest.nodes[i][c]);
                    }
                    Ok(place)
                };
                looked_at(&problem).iter().map(place).collect::<Result<_, Error>>()?
            }
        };
        ladder.add(Some(seen));
        let reached = ladder.reaches(allowed, 2.0, [FAR, FAR_BY_TWO]);
        let last = reached.is_some() || segments > MOST_EDGES;
        if let Some([error, order]) = ladder.error(2.0).filter(|_| last) {
            let bound = reached.is_none().then_some(Bound::Work);
            let finer = reached.map_or(FAR, |(finer, _)| finer.max(0.5));
            let chosen = (segments as f64 * finer).ceil() as usize;
            let chosen = if let Aim::Modes(count) = aim { chosen.max(2 * count) } else { chosen };
            let error = error * (segments as f64 / chosen as f64).powf(order);
            return Ok((chosen, step, Some(error), bound));
        }
        segments *= 2;
    }
}

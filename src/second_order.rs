//! Second derivatives of a trajectory, by running it again in second-order dual numbers.
//!
//! A hyper-dual number carries the derivatives along two directions and the mixed one. The run
//! follows the steps of one in plain numbers, which decides where steps are halved.

use crate::error::Error;
use crate::model::Model;
use crate::parameter::Parameter;
use crate::problem::{AnyProblem, Posed, Problem};
use crate::trajectory::{Motion, Trajectory};
use crate::vector::{add, sub, turned};
use num_dual::HyperDual64;

/// The parts of a hyper-dual number after the real one.
const PARTS: [fn(&HyperDual64) -> f64; 4] = [|x| x.re, |x| x.eps1, |x| x.eps2, |x| x.eps1eps2];

/// Repeats the run of `plain` with the parameters that `seed` makes. The result's derivatives are
/// the first along both directions, and the mixed second; `pair` names the directions.
pub(crate) fn repeat(
    problem: &Problem,
    plain: &Trajectory,
    pair: [Parameter; 2],
    seed: impl Fn(Parameter, f64) -> HyperDual64,
) -> Result<Trajectory, Error> {
    match problem.posed() {
        AnyProblem::Planar(posed) => repeat_posed(&posed, plain, pair, seed),
        AnyProblem::Spatial(posed) => repeat_posed(&posed, plain, pair, seed),
    }
}

fn repeat_posed<M: Model<W>, const W: usize>(
    posed: &Posed<'_, M, W>,
    plain: &Trajectory,
    [one, two]: [Parameter; 2],
    seed: impl Fn(Parameter, f64) -> HyperDual64,
) -> Result<Trajectory, Error> {
    let mut record = plain.emptied(&[one, two, two]);
    let mut simulation = posed.simulation_over(seed);
    let mut ends = plain.times().iter();
    let mut next = ends.next();
    let mut part = Vec::new();
    let turns = [one, two].contains(&Parameter::ClampAngle);
    // Zero, with the derivatives of the clamp angle along both directions.
    let angle = {
        let along = |p: Parameter| f64::from(u8::from(p == Parameter::ClampAngle));
        HyperDual64::new(0.0, along(one), along(two), 0.0)
    };
    for time in std::iter::once(None).chain(plain.taken().iter().map(Some)) {
        if let Some(time) = time {
            simulation.step_to(*time)?;
        }
        let state = simulation.state();
        if next == Some(&state.time) {
            let parts = |x: &[HyperDual64]| PARTS.map(|part| x.iter().map(part).collect());
            part.clear();
            let (q, v): ([Vec<f64>; 4], [Vec<f64>; 4]) = (parts(&state.q), parts(&state.v));
            part.extend(q.into_iter().zip(v));
            record.push(state.time, |k, node| -> Motion {
                let place = |k: usize| -> Motion {
                    let (q, v) = &part[k];
                    let position = if k == 0 { M::position } else { M::rate };
                    [position(posed.model, q, node), posed.model.rate(v, node)]
                };
                match turns {
                    false => place(k),
                    true => turned_with(angle, plain.pivot(), [0, 1, 2, 3].map(place))[k],
                }
            });
            next = ends.next();
        }
    }
    Ok(record)
}

/// The parts of a motion whose rod is turned as a whole by `angle` about a point and an axis.
fn turned_with(
    angle: HyperDual64,
    (wall, axis): ([f64; 3], [f64; 3]),
    parts: [Motion; 4],
) -> [Motion; 4] {
    let whole = |j: usize, c: usize| {
        let [re, one, two, both] = parts.map(|motion| motion[j][c]);
        HyperDual64::new(re, one, two, both)
    };
    let [x, v] = [0, 1].map(|j| [0, 1, 2].map(|c| whole(j, c)));
    let (rotation, wall) = (axis.map(|a| angle * a), wall.map(HyperDual64::from));
    let x = add(wall, turned(rotation, sub(x, wall)));
    let v = turned(rotation, v);
    PARTS.map(|part| [x.map(|c| part(&c)), v.map(|c| part(&c))])
}

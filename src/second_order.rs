//! Second derivatives of a trajectory, by running it again in second-order dual numbers.
//!
//! A hyper-dual number carries the derivatives along two directions and the mixed one. The run
//! follows the steps of one in plain numbers, which decides where steps are halved.

use crate::error::Error;
use crate::model::Model;
use crate::parameter::Parameter;
use crate::problem::{AnyProblem, Posed, Problem};
use crate::trajectory::{Motion, Trajectory};
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
                let (q, v) = &part[k];
                let position = if k == 0 { M::position } else { M::rate };
                [position(posed.model, q, node), posed.model.rate(v, node)]
            });
            next = ends.next();
        }
    }
    Ok(record)
}

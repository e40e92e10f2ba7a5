//! Motions and equilibria of the nodes of a structure with their derivatives by parameters, as records for
//! measurements.
//!
//! Input: a problem with its structure, ascending indices of tracked nodes, a number of steps, and parameters. The
//! motion is first simulated in plain numbers, where a step that fails is halved. It is then repeated with the steps
//! taken, in plain numbers once and beside it in dual numbers, up to `LANES` parameters per run, on several threads.
//! Each step in dual numbers is one linear solution with the factors of the plain one. Output of [`simulated_motion`]:
//! a [`Trajectory`] at the start and at the end of every step of the scene. It has positions, m, and velocities, m/s,
//! of the tracked nodes, and their derivatives by each parameter. [`equilibrium`] is the same at rest: one time, zero
//! velocities. Failed steps or equilibria and an interruption are errors. Both are used by experiments of structures;
//! [`repeated_motion`] and [`motion_at_rest`] serve other number types.

use crate::dynamics::record::Record;
use crate::dynamics::{Simulation, Trajectory};
use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::problem::Problem;
use crate::rod::Assembly;
use crate::scene::Parameter;
use crate::scene::number::Quantity;
use crate::structure::{AssemblyAtRest, NodeMotion, Structure};
use num_dual::DualSVec64;
use rayon::prelude::*;

/// Parameters of one run in dual numbers.
const LANES: usize = 8;
/// Dual number with a derivative by each parameter of a run.
type LanesDual = DualSVec64<LANES>;

/// Derivatives of the motions of all tracked nodes at all times, by some parameters.
type MotionRates = Vec<Vec<NodeMotion<f64>>>;

/// The `value` of the number of the scene at `path`, as a dual number. It has the derivative 1 by its own parameter, if
/// that is one of the `parameters` (at most [`LANES`]), and 0 by all others.
fn seeded(parameters: &[Parameter], path: &str, value: f64) -> LanesDual {
    let mut number = LanesDual::from(value);
    if let Some(k) = parameters.iter().position(|parameter| parameter.path() == path) {
        number = number.derivative(k);
    }
    number
}

/// The derivatives of positions and velocities of a node, in dual numbers, by the parameter with index `k` in its run.
fn rates_by(motion: &NodeMotion<LanesDual>, k: usize) -> NodeMotion<f64> {
    let rate = |x: LanesDual| x.eps.0.map_or(0.0, |eps| eps[k]);
    [0, 1].map(|part| [0, 1, 2].map(|c| rate(motion[part][c])))
}

/// The parameters in the fewest groups of at most [`LANES`], each of one run, of about equally many. No group without
/// parameters.
fn groups(parameters: &[Parameter]) -> std::slice::Chunks<'_, Parameter> {
    let runs = parameters.len().div_ceil(LANES).max(1);
    parameters.chunks(parameters.len().div_ceil(runs).max(1))
}

/// Derivatives by all `parameters` from the motions of each of their [groups](groups), in the same order.
fn rates(parameters: &[Parameter], runs: &[Vec<NodeMotion<LanesDual>>]) -> MotionRates {
    let of_group = |(group, run): (&[Parameter], &Vec<NodeMotion<LanesDual>>)| {
        let by = |k: usize| run.iter().map(|motion| rates_by(motion, k)).collect();
        (0..group.len()).map(by).collect::<MotionRates>()
    };
    groups(parameters).zip(runs).flat_map(of_group).collect()
}

/// The results of `map` for all `items`, in their order, computed on several threads. If any fails, the error is that
/// of the first item that failed, whatever the number of threads.
fn map_all<T: Send, U: Send>(
    items: Vec<T>,
    map: impl Fn(T) -> Result<U, Error> + Send + Sync,
) -> Result<Vec<U>, Error> {
    let all: Vec<Result<U, Error>> = items.into_par_iter().map(map).collect();
    all.into_iter().collect()
}

/// Positions and velocities of the nodes `tracked` of a structure at each of `times`: all nodes at the first time, then
/// all at the next. The motion repeats the steps that end at `taken`, s, the steps of an earlier simulation with the
/// halved ones. `times`, s, are those of the record: the start, and then ends of these steps. `seed` returns each
/// number of the scene in the number type, from its path, value and quantity. Error: a step fails.
pub(crate) fn repeated_motion<D: RodScalar>(
    structure: &Structure,
    tracked: &[usize],
    times: &[f64],
    taken: &[f64],
    seed: impl FnMut(&str, f64, Quantity) -> D,
) -> Result<Vec<NodeMotion<D>>, Error> {
    let start = vec![structure.simulation_over(seed)?];
    Ok(repeated_motions(structure, tracked, times, taken, start)?.into_iter().flatten().collect())
}

/// The motions as of [`repeated_motion`], one list per simulation in `starts`, which are at their start. The steps in
/// plain numbers are taken once for all of them.
fn repeated_motions<D: RodScalar>(
    structure: &Structure,
    tracked: &[usize],
    times: &[f64],
    taken: &[f64],
    starts: Vec<Simulation<D, Assembly<D>>>,
) -> Result<Vec<Vec<NodeMotion<D>>>, Error> {
    let size = times.len() * tracked.len();
    let mut runs: Vec<_> =
        starts.into_iter().map(|start| (start, Vec::with_capacity(size))).collect();
    let mut plain = structure.simulation_over(|_, value, _| value)?;
    plain.keep_tangent();
    let mut ends = taken.iter();
    for (k, time) in times.iter().enumerate() {
        // The record has the start, and then the ends of the steps of the scene.
        if k > 0 {
            for end in ends.by_ref() {
                plain.step_to(*end)?;
                // Without Newton's method, the step itself is repeated.
                map_all(runs.iter_mut().collect(), |(simulation, _)| {
                    match D::ORDER == 0 || !simulation.repeat_step(&plain) {
                        true => simulation.step_to(*end),
                        false => Ok(()),
                    }
                })?;
                if end >= time {
                    break;
                }
            }
        }
        for (simulation, motions) in &mut runs {
            let state = simulation.state();
            let all = structure.node_motions(simulation.rod(), [&state.q, &state.v], &state.frames);
            motions.extend(tracked.iter().map(|node| all[*node]));
        }
    }
    Ok(runs.into_iter().map(|(_, motions)| motions).collect())
}

/// The motion of the nodes `tracked`, ascending, over the first `steps` steps of a problem with this structure:
/// positions, m, and velocities, m/s, with derivatives by `parameters`. `count` receives the number of steps taken,
/// also that of a run that fails.
///
/// # Errors
/// A scene without a time, a step that fails, and [`Error::Interrupted`].
pub(crate) fn simulated_motion(
    problem: &Problem,
    structure: &Structure,
    tracked: &[usize],
    steps: usize,
    parameters: &[Parameter],
    count: impl Fn(usize),
) -> Result<Trajectory, Error> {
    let time = problem.time()?;
    let mut record = Record::new(tracked, parameters.len());
    let mut motion = structure.simulation()?;
    let mut push = |motion: &crate::structure::StructureMotion<'_>| {
        let (simulation, now) = (motion.simulation(), motion.time());
        let state = simulation.state();
        let all = structure.node_motions(simulation.rod(), [&state.q, &state.v], &state.frames);
        record.push(now, tracked.iter().map(|node| all[*node]));
    };
    push(&motion);
    for k in 1..=steps {
        let outcome = match problem.is_stopped() {
            true => Err(Error::Interrupted),
            false => motion.step_to(time.at(k)),
        };
        if let Err(error) = outcome {
            // A run that fails is not free: its steps count, and the failed one.
            count(motion.simulation().work().steps + 1);
            return Err(error);
        }
        push(&motion);
    }
    record.work = motion.simulation().work();
    record.taken = motion.taken().to_vec();
    count(record.work.steps);
    let (times, taken) = (record.times().to_vec(), record.taken.clone());
    // The dual runs repeat the steps taken, so that the derivatives are those of the recorded motion.
    if !parameters.is_empty() {
        let starts = map_all(groups(parameters).collect(), |group| {
            structure.simulation_over(|path, value, _| seeded(group, path, value))
        })?;
        let runs = repeated_motions(structure, tracked, &times, &taken, starts)?;
        for (k, rates) in rates(parameters, &runs).into_iter().enumerate() {
            *record.derivatives_mut(k) = rates;
        }
    }
    Ok(Trajectory::recorded(problem, parameters, record))
}

/// The positions of the nodes `tracked` at equilibrium over another number type, with velocities of zero. `seed`
/// returns each number of the scene in that type, from its path, value and quantity. Error: the equilibrium cannot be
/// computed.
pub(crate) fn motion_at_rest<D: RodScalar>(
    structure: &Structure,
    tracked: &[usize],
    seed: impl FnMut(&str, f64, Quantity) -> D,
) -> Result<Vec<NodeMotion<D>>, Error> {
    let AssemblyAtRest { assembly, q, frames, .. } = structure.equilibrium_over(seed)?;
    let v = vec![D::from(0.0); q.len()];
    let all = structure.node_motions(&assembly, [&q, &v], &frames);
    Ok(tracked.iter().map(|node| all[*node]).collect())
}

/// The equilibrium of the nodes `tracked`, ascending, of a problem with this structure, as a record of the time 0:
/// positions, m, and zero velocities, with derivatives by `parameters`.
///
/// # Errors
/// An equilibrium that cannot be computed.
pub(crate) fn equilibrium(
    problem: &Problem,
    structure: &Structure,
    tracked: &[usize],
    parameters: &[Parameter],
) -> Result<Trajectory, Error> {
    let mut record = Record::new(tracked, parameters.len());
    record.push(0.0, motion_at_rest(structure, tracked, |_, value, _| value)?.into_iter());
    let runs = map_all(groups(parameters).collect(), |group| {
        motion_at_rest(structure, tracked, |path, value, _| seeded(group, path, value))
    })?;
    for (k, rates) in rates(parameters, &runs).into_iter().enumerate() {
        *record.derivatives_mut(k) = rates;
    }
    Ok(Trajectory::recorded(problem, parameters, record))
}

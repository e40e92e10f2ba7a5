//! Detection of states of a simulation that are unstable, while symmetry holds the rod there.
//!
//! A compressed straight strip stays straight in a simulation, since no force pushes it aside; a real one buckles. A
//! few states of a run are examined: the last one, and one per [`STEPS_PER_TIME`] steps, at most [`MOST_TIMES`]; none
//! of a rod with loads without a potential. Loads and actuators that follow signals have their values at
//! `loads.at_time` in it, not those at the time of the state. In each the [`MODES`] fastest modes of the model are
//! tested. For a planar scene with a torsional stiffness and no point moments the fastest mode out of its plane is
//! tested too. Such a state has three properties:
//!
//! 1. The tangent `K` has an eigenvalue `K x = -sigma^2 M x` with growth in the time of the scene ([`MIN_GROWTH`]).
//! 2. The rod is near the saddle along this mode: `|x' f| / sigma^2` and `|x' M v| / sigma` are zero except for
//!    rounding errors ([`HELD`]), with the forces `f` out of balance. A rod that moves through unstable states is
//!    in general not. Vibrations that are fast against the growth are removed from the state first.
//! 3. The state persists: forces and velocities displace the rod little in the time `1/sigma` ([`PERSISTENT`]). With
//!    `s = 2 sigma^2` these displacements are `(K + s M)^-1 f` and `(K + s M)^-1 s^(1/2) M v`.
//!
//! A mode out of the plane of a planar scene counts as held. `includes` returns whether the state after a step is
//! examined, and `examine` does so with a simulation in that state. Output: the number of examined states, and the last
//! such state of the run with its time (s) and growth rate (1/s), which becomes a warning of the report. The run is not
//! changed.

use crate::code::Code;
use crate::dynamics::simulation::Simulation;
use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::tangent::Factors;
use crate::problem::{Discretized, FramesOf, Model};
use crate::rod::{Rod, State};
use crate::statics::{Pencil, PencilMode, UNCERTAIN_LEVELS, spatial_motion};

/// Exponent of growth in the time of the scene below which an instability does not matter: a factor of 20.
const MIN_GROWTH: f64 = 3.0;
/// Largest distance from the saddle over the rod's length: rounding errors leave some 1e-12.
const HELD: f64 = 1e-8;
/// Largest displacement in the time of growth, over the rod's length, of a state that persists. A larger value reports
/// states that the rod leaves by itself; a smaller one misses slow motions near an unstable state.
const PERSISTENT: f64 = 0.05;
/// Largest number of modes that are examined, those of fastest growth.
const MODES: usize = 4;
/// Largest number of times that are examined, beside the end. Each costs a few factorizations.
const MOST_TIMES: usize = 8;
/// Smallest number of steps between times that are examined, so that short runs are not slowed down.
const STEPS_PER_TIME: usize = 50;

/// An unstable state at which symmetry holds the rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UnstableState {
    /// Time of the state, s.
    pub time: f64,
    /// Growth rate of the fastest mode without damping, 1/s.
    pub rate: f64,
    /// Whether the mode leaves the plane of a planar scene.
    pub out_of_plane: bool,
}

impl UnstableState {
    /// The code and text of the warning about this state: its time or, at the end of a simulation that lasts until
    /// `end`, s, the end, and the growth rate. Suggests a perturbation, and a spatial model if the mode leaves the
    /// plane.
    pub fn warning(&self, end: f64) -> (Code, String) {
        let Self { time, rate, out_of_plane } = *self;
        let when = match time >= end * (1.0 - 1e-9) {
            true => "ends".into(),
            false => format!("stays at t = {time:.3e} s"),
        };
        let (direction, model) = match out_of_plane {
            true => (" out of its plane", " and rod.dimension = \"spatial\""),
            false => ("", ""),
        };
        let words = format!(
            "the simulation {when} at an unstable state, where only symmetry holds the rod: a disturbance{direction} grows by \
             {rate:.3e} 1/s. A real rod leaves this state. Set initial.perturbation = 1e-4{model}, or add the imperfection of \
             the real rod"
        );
        (Code::UnstableState, words)
    }
}

/// The results of the stability checks of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct StabilityChecks {
    /// The last unstable state, if any.
    pub found: Option<UnstableState>,
    /// Number of states examined.
    pub count: usize,
}

impl StabilityChecks {
    /// Whether the state after `step` of `steps` steps is examined: the last one, and `steps/STEPS_PER_TIME` others
    /// (rounded down, at most [`MOST_TIMES`]), evenly spaced. The initial state is not.
    pub fn includes(step: usize, steps: usize) -> bool {
        // Evenly spaced over the run.
        let times = (steps / STEPS_PER_TIME).min(MOST_TIMES) + 1;
        step == steps || step > 0 && (step * times) / steps != ((step - 1) * times) / steps
    }

    /// Examines the present state of a simulation and counts it, unless there are loads without a potential. If it is
    /// an unstable state at which symmetry holds the rod, it replaces `found`; otherwise `found` stays. A failure of
    /// the linear algebra is not reported.
    pub fn examine<M: Model>(
        &mut self,
        discretized: &Discretized<'_, M>,
        simulation: &Simulation<f64, M::Rod<f64>>,
    ) {
        // Eigenvalues of an unsymmetric tangent are not counted by the inertia.
        if simulation.rod().has_follower_loads() {
            return;
        }
        self.count += 1;
        if let Ok(Some(found)) = unstable_state(discretized, simulation) {
            self.found = Some(found);
        }
    }
}

/// An unstable mode at which symmetry holds the rod.
struct HeldMode {
    /// Square of the growth rate, 1/s^2.
    squared_rate: f64,
    out_of_plane: bool,
}

/// The unstable state at which symmetry holds the rod now, with the growth rate of its fastest held mode, without
/// damping. `None` if one of the three properties of the header is missing. The [`MODES`] fastest modes in the plane
/// are examined and, if the rod has a torsional stiffness, the fastest one out of it, which counts as held. Squared
/// rates count from `r (r + c)` on, with `r` = [`MIN_GROWTH`] over the time of the scene and mass damping `c`, and
/// above rounding errors.
fn unstable_state<M: Model>(
    discretized: &Discretized<'_, M>,
    simulation: &Simulation<f64, M::Rod<f64>>,
) -> Result<Option<UnstableState>, Error> {
    let (problem, state) = (discretized.problem, simulation.state());
    let (rod, length) = (discretized.rod_at(state.time), problem.length());
    let end = problem.time()?.end;
    let damping = discretized.scene().loads.damping.mass;
    // A disturbance grows by sigma with sigma^2 + c sigma = -lambda.
    // Squared rate of the slowest instability that matters, and not below the rounding of the
    // tangent.
    let slowest = MIN_GROWTH / end;
    let scale = discretized.bending_frequency_squared();
    let rounding = discretized.zero_squared_frequency() + scale * discretized.tangent_rounding();
    let least = (slowest * (slowest + damping)).max(UNCERTAIN_LEVELS * rounding);
    let Some(q) = relaxed(discretized, &rod, state, 2.0 * least)? else { return Ok(None) };
    let pencil = Pencil::at(discretized, &rod, &q, &state.frames);
    let mut forces = vec![0.0; state.q.len()];
    rod.gradient(&state.q, &state.frames, Derivatives::Hand, &mut forces);
    let mut held: Option<HeldMode> = None;
    // Sylvester: the negative pivots of K + least M count the eigenvalues below -least.
    let growing = pencil.inertia(-least)?;
    for PencilMode { squared, vector: x } in pencil.lowest(growing.min(MODES), scale)? {
        let product =
            |f: &dyn Fn(usize) -> f64| pencil.free.clone().map(|i| x[i] * f(i)).sum::<f64>();
        let largest = largest_displacement::<M>(&x);
        // Distance from the saddle: static displacement by the forces, and drift by the velocity
        // in the time 1/sigma.
        let offset = product(&|i| forces[i]).abs() / -squared * largest;
        let drift = product(&|i| pencil.mass[i] * state.v[i]).abs() / (-squared).sqrt() * largest;
        if offset.max(drift) <= HELD * length && held.is_none() {
            held = Some(HeldMode { squared_rate: -squared, out_of_plane: false });
        }
    }
    // A planar scene may buckle out of its plane, where its own model has no unknowns.
    if M::STRIDE < 3 && problem.can_twist() {
        let squared = out_of_plane(discretized, state.time, &q, least)?;
        if let Some(squared_rate) = squared
            && held.as_ref().is_none_or(|held| held.squared_rate < squared_rate)
        {
            held = Some(HeldMode { squared_rate, out_of_plane: true });
        }
    }
    let Some(HeldMode { squared_rate, out_of_plane }) = held else { return Ok(None) };
    // Where another motion grows faster and nothing holds it, the factors are indefinite.
    let shift = 2.0 * squared_rate;
    let factors = pencil.factors(-shift)?;
    let free = |i: usize| pencil.free.contains(&i);
    let displaced = |right: &dyn Fn(usize) -> f64| {
        let mut x: Vec<f64> =
            (0..state.q.len()).map(|i| if free(i) { right(i) } else { 0.0 }).collect();
        factors.solve(&mut x);
        largest_displacement::<M>(&x)
    };
    // Property 3: forces and velocities displace the rod little in the time of growth.
    let slow =
        displaced(&|i| forces[i]).max(displaced(&|i| shift.sqrt() * pencil.mass[i] * state.v[i]));
    let persists = factors.negative_pivots() == 0 && slow <= PERSISTENT * length;
    let found = UnstableState { time: state.time, rate: squared_rate.sqrt(), out_of_plane };
    Ok(persists.then_some(found))
}

/// Unknowns of the state without vibrations that are fast against a `squared` rate, 1/s^2: less the static response
/// `(K + s M)^-1 f` to the forces out of balance. Axial vibrations, for example, double the load of a column for half a
/// period. `None` if the response displaces a node by more than [`PERSISTENT`] lengths: the state does not persist.
/// Error: a zero pivot.
fn relaxed<M: Model>(
    discretized: &Discretized<'_, M>,
    rod: &M::Rod<f64>,
    state: &State<f64, FramesOf<M>>,
    squared: f64,
) -> Result<Option<Vec<f64>>, Error> {
    let pencil = Pencil::at(discretized, rod, &state.q, &state.frames);
    let mut change = vec![0.0; state.q.len()];
    rod.gradient(&state.q, &state.frames, Derivatives::Hand, &mut change);
    for (i, change) in change.iter_mut().enumerate() {
        if !pencil.free.contains(&i) || pencil.mass[i] == 0.0 {
            *change = 0.0;
        }
    }
    // Static response, in which vibrations faster than the rate are relaxed.
    pencil.factors(-squared)?.solve(&mut change);
    let far = largest_displacement::<M>(&change) > PERSISTENT * discretized.problem.length();
    let moved = state.q.iter().zip(&change).map(|(q, change)| q - change);
    Ok((!far).then(|| moved.collect()))
}

/// The square of the fastest growth rate of motions out of the plane of a planar scene at `q`, 1/s^2, under its loads
/// at a time, s, from its spatial model. `None` if no squared rate exceeds `least`, or that motion displaces no node (a
/// spin). Error: the eigenvalue search fails.
fn out_of_plane<M: Model>(
    discretized: &Discretized<'_, M>,
    time: f64,
    q: &[f64],
    least: f64,
) -> Result<Option<f64>, Error> {
    let scale = discretized.bending_frequency_squared();
    let model = discretized.problem.spatial_model();
    let spatial = discretized.problem.discretized_as(&model);
    let nodes: Vec<[f64; 3]> =
        (0..discretized.nodes()).map(|i| discretized.model.position(q, i)).collect();
    let (q, frames) = spatial.placed_still(&nodes);
    let normal = spatial.model.components(spatial.normal());
    // The same shape in the spatial model, restricted to motion along the normal.
    let pencil = Pencil::at(&spatial, &spatial.rod_at(time), &q, &frames).out_of_plane(normal);
    if pencil.inertia(-least)? == 0 {
        return Ok(None);
    }
    let fastest = pencil.lowest(1, scale)?.into_iter().next();
    // A spin between hinges moves no node.
    let moves = |x: &[f64]| largest_displacement_in_space(&spatial_motion(x, normal)) > 0.0;
    Ok(fastest.filter(|mode| moves(&mode.vector)).map(|mode| -mode.squared))
}

/// The largest absolute component of the displacements of nodes in a motion `x`, m; angles are left out.
fn largest_displacement<M: Model>(x: &[f64]) -> f64 {
    let lengths = x.iter().enumerate().filter(|(i, _)| !M::Rod::<f64>::is_angle(*i));
    lengths.map(|(_, x)| x.abs()).fold(0.0, f64::max)
}

/// The largest absolute component of the displacements of nodes, m, in a motion `x` with four unknowns per node, of
/// which the last is an angle.
fn largest_displacement_in_space(x: &[f64]) -> f64 {
    x.chunks(4).flat_map(|node| node.iter().take(3)).map(|x| x.abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One state in 50 steps, nine at most, the last among them.
    #[test]
    fn few_states_are_examined() {
        for (steps, count) in [(1, 1), (20, 1), (100, 3), (1000, 9), (1_000_000, 9)] {
            let examined: Vec<usize> =
                (0..=steps).filter(|step| StabilityChecks::includes(*step, steps)).collect();
            assert_eq!((examined.len(), examined.last()), (count, Some(&steps)), "{steps}");
        }
    }
}

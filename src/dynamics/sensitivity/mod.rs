//! Derivatives of a trajectory with respect to parameters, forward in time, by the implicit function theorem.
//!
//! A converged step satisfies `R(q1; q0, v0, n0, p) = 0`, so its derivative solves `J dq1 = -dR|q1` with the tangent
//! `J` of the step at its solution. `dR|q1` follows from the derivatives of the start and of the parameters by the
//! [linear map](crate::dynamics) of the step, which the adjoint applies transposed.
//!
//! Input: one simulation over dual numbers per parameter, for the derivatives of the scene's numbers and of the
//! initial state, and the linearized steps of the run. Output: `dq/dp` and `dv/dp` of every unknown after every
//! step, per unit of the parameter: of selected nodes, or in a state as dual numbers. A step without derivatives is
//! [`Error::SingularTangent`]. In other cases the steps are made in dual numbers, and errors are those of steps:
//! explicit and Rosenbrock schemes, which solve no such equations, actuators that follow signals, loads without a
//! potential, moved obstacles, and damping or friction of contacts.
//!
//! Parameters are advanced in SIMD lanes, in groups of four, two or one; those with a history of strains
//! (viscosity, friction) have groups of their own. The geometry of a step is computed once for all of them, and
//! their solves share memory traffic. The derivative along a parameter does not depend, to the last bit, on the
//! other parameters of its group.
//!
//! The independent check is the whole simulation run in dual numbers
//! ([`Discretized::simulation_over`](crate::Discretized::simulation_over)).
//!
//! Functions of [`Sensitivities`]: `new` takes the initial dual simulations. `step_to` makes a step of a simulation,
//! `step_back` undoes it, and `advance` (or `advance_over`, with a given linearization) takes the derivatives over an
//! accepted one. `of_nodes` passes the derivatives of `Nodes` along one parameter to a function, and `dual_state`
//! returns a state with them as dual numbers.

use crate::dynamics::linearization::Linearization;
use crate::dynamics::simulation::Simulation;
use crate::dynamics::step_map::{
    DualSimulation, ParameterRates, StateRates, StepMap, StepWorkspace,
};
use crate::error::Error;
use crate::numerics::directions::Directions;
use crate::rod::{DualFrames, ForwardSensitivity, InternalVariables, State, set_dual_frames};
use num_dual::Dual64;

/// A group of `G` parameters of an implicit scheme: derivatives of the scene's numbers and of the present state along
/// each.
struct Implicit<R: ForwardSensitivity, const G: usize> {
    /// Derivatives of laws, loads, masses, damping and supports.
    parameters: ParameterRates<R, G>,
    /// Derivatives of the state.
    state: StateRates<G>,
    /// Reusable lists for the map of a step.
    room: StepWorkspace<R, G>,
    /// Frames with the derivatives along each parameter.
    dual_frames: [DualFrames<R, f64>; G],
}

/// Whether the stress of a simulation, or its derivative, depends on earlier strains: viscosity of the material,
/// internal friction, or an averaging scheme, which treats the viscous stress separately.
fn depends_on_history<R: ForwardSensitivity>(simulation: &DualSimulation<R>) -> bool {
    // Averaging schemes take the viscous stress apart from the rest.
    !simulation.can_linearize_again() || simulation.damping().depends_on_history()
}

impl<R: ForwardSensitivity, const G: usize> Implicit<R, G> {
    /// The derivatives at the start of `simulations`, one for each parameter. `None` for explicit and Rosenbrock
    /// schemes, which have no Newton iteration.
    fn new(simulations: [&DualSimulation<R>; G]) -> Option<Self> {
        let parameters = ParameterRates::new(simulations)?;
        let mut state = StateRates::new::<R>(simulations);
        // Elastic rods have no internal variables: their derivatives need not be carried.
        if !simulations.iter().any(|simulation| depends_on_history::<R>(simulation)) {
            state.internal = InternalVariables::default();
        }
        let dual_frames = simulations.map(|simulation| simulation.state().frames.clone());
        let room = StepWorkspace::new(state.q.len(), dual_frames.to_vec());
        Some(Self { parameters, state, room, dual_frames })
    }
}

/// A group of parameters whose derivatives are advanced in SIMD lanes; hides the number of lanes.
trait LaneGroup<R: ForwardSensitivity>: Send + Sync {
    /// dq/dp and dv/dp of unknown `i` along the parameter in `lane`.
    fn rate(&self, lane: usize, i: usize) -> [f64; 2];

    /// The reference frames `now` with their derivatives along the parameter in `lane`.
    fn frames(&self, lane: usize, now: &R::Frames) -> DualFrames<R, f64>;

    /// The internal variables `now` with their derivatives along the parameter in `lane`; zero ones where no stress
    /// depends on the past.
    fn internal(&self, lane: usize, now: &InternalVariables<f64>) -> InternalVariables<Dual64>;

    /// Advances the derivatives from the start of a linearized step to its end. [`Error::SingularTangent`] where the
    /// step has no derivatives.
    fn advance(&mut self, step: &Linearization<'_, f64, R>) -> Result<(), Error>;
}

impl<R: ForwardSensitivity, const G: usize> LaneGroup<R> for Implicit<R, G> {
    /// dq/dp and dv/dp of unknown `i` along the parameter in `lane`.
    fn rate(&self, lane: usize, i: usize) -> [f64; 2] {
        [self.state.q[i][lane], self.state.v[i][lane]]
    }

    /// The reference frames `now` with their derivatives along the parameter in `lane`.
    fn frames(&self, lane: usize, now: &R::Frames) -> DualFrames<R, f64> {
        let mut dual = self.dual_frames[lane].clone();
        set_dual_frames(now, &self.state.frames, lane, &mut dual);
        dual
    }

    /// The internal variables `now` with their derivatives along the parameter in `lane`.
    fn internal(&self, lane: usize, now: &InternalVariables<f64>) -> InternalVariables<Dual64> {
        let dual = |now: &[f64], rates: &[Directions<G>]| {
            let rates = rates.iter().map(|rate| rate.0[lane]).chain(std::iter::repeat(0.0));
            now.iter().zip(rates).map(|(x, rate)| Dual64::new(*x, rate)).collect()
        };
        let rates = &self.state.internal;
        InternalVariables {
            strain: dual(&now.strain, &rates.strain),
            strain_rate: dual(&now.strain_rate, &rates.strain_rate),
            slid: dual(&now.slid, &rates.slid),
            relaxing: dual(&now.relaxing, &rates.relaxing),
        }
    }

    /// Advances the derivatives from the start of a linearized step to its end, by [`StepMap::apply`].
    /// [`Error::SingularTangent`] if the step has no derivatives.
    fn advance(&mut self, step: &Linearization<'_, f64, R>) -> Result<(), Error> {
        StepMap::new(step).apply(&self.parameters, &mut self.state, &mut self.room)
    }
}

/// The index of the group of a parameter, and the SIMD lane of the parameter in it.
#[derive(Clone, Copy)]
struct LanePlace {
    group: usize,
    lane: usize,
}

/// The derivatives of a simulation's state with respect to parameters, advanced step by step beside the simulation.
pub struct Sensitivities<R: ForwardSensitivity>(SensitivityMethod<R>);

/// The method by which the derivatives of a state follow from those before a step.
enum SensitivityMethod<R: ForwardSensitivity> {
    /// For schemes whose steps are equations, by the implicit function theorem: the groups, and the place of every
    /// parameter in them.
    Implicit(Vec<Box<dyn LaneGroup<R>>>, Vec<LanePlace>),
    /// For any other scheme, laws that follow signals, loads without a potential, moved obstacles and losses of
    /// contacts, by the same steps in dual numbers: one simulation for each parameter. The first makes the steps of the
    /// simulation in plain numbers too.
    Direct(Vec<DualSimulation<R>>),
}

/// Appends groups of the parameters with the indices `order` to `groups`: as many groups of four as possible, then at
/// most one of two and one of one. Writes group and lane of each parameter to `places`, at its index. `None` for
/// schemes that solve no equations.
fn add_groups<R: ForwardSensitivity>(
    mut order: &[usize],
    simulations: &[DualSimulation<R>],
    groups: &mut Vec<Box<dyn LaneGroup<R>>>,
    places: &mut [LanePlace],
) -> Option<()> {
    while !order.is_empty() {
        let own: Vec<&DualSimulation<R>> = order.iter().map(|k| &simulations[*k]).collect();
        // As many lanes as possible, because a solve with four right-hand sides costs little more
        // than with one.
        let (group, count): (Box<dyn LaneGroup<R>>, usize) = match &own[..] {
            [a, b, c, d, ..] => (Box::new(Implicit::new([*a, *b, *c, *d])?), 4),
            [a, b, ..] => (Box::new(Implicit::new([*a, *b])?), 2),
            [a, ..] => (Box::new(Implicit::new([*a])?), 1),
            [] => break,
        };
        let (grouped, rest) = order.split_at(count);
        for (lane, k) in grouped.iter().enumerate() {
            places[*k] = LanePlace { group: groups.len(), lane };
        }
        groups.push(group);
        order = rest;
    }
    Some(())
}

/// Selected nodes whose unknowns are `stride` apart; the first `axes` unknowns of a node are coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nodes<'a> {
    pub nodes: &'a [usize],
    pub stride: usize,
    pub axes: usize,
}

impl<R: ForwardSensitivity> Sensitivities<R> {
    /// The derivatives at the start of `simulations`, each with the derivative of its numbers along one parameter.
    /// Parameters along which stresses depend on the history of strains form groups of their own. If the scheme solves
    /// no equations, or a simulation needs steps in dual numbers, the simulations are kept instead.
    pub fn new(simulations: Vec<DualSimulation<R>>) -> Self {
        // Laws that follow signals, loads without a potential, moved obstacles and losses of contacts: each simulation
        // in dual numbers makes the steps itself.
        if simulations.iter().any(|simulation| simulation.needs_dual_steps()) {
            return Self(SensitivityMethod::Direct(simulations));
        }
        // A parameter without history would pay for that of its neighbors in the same group.
        let parts: (Vec<usize>, Vec<usize>) =
            (0..simulations.len()).partition(|k| depends_on_history::<R>(&simulations[*k]));
        let mut places = vec![LanePlace { group: 0, lane: 0 }; simulations.len()];
        let mut groups = Vec::new();
        let grouped = add_groups(&parts.0, &simulations, &mut groups, &mut places)
            .and_then(|()| add_groups(&parts.1, &simulations, &mut groups, &mut places));
        match grouped {
            Some(()) => Self(SensitivityMethod::Implicit(groups, places)),
            // Explicit schemes and Rosenbrock: the same steps in dual numbers.
            None => Self(SensitivityMethod::Direct(simulations)),
        }
    }

    /// The number of parameters.
    pub fn count(&self) -> usize {
        match &self.0 {
            SensitivityMethod::Implicit(_, places) => places.len(),
            SensitivityMethod::Direct(simulations) => simulations.len(),
        }
    }

    /// Calls `each` once per node with `[dq/dp, dv/dp]` of its coordinates along parameter `k`; zeros beyond the rod's
    /// axes.
    pub(crate) fn of_nodes(
        &self,
        k: usize,
        Nodes { nodes, stride, axes }: Nodes,
        mut each: impl FnMut([[f64; 3]; 2]),
    ) {
        for node in nodes {
            let mut rates = [[0.0; 3]; 2];
            for c in 0..axes {
                [rates[0][c], rates[1][c]] = self.rate(k, stride * node + c);
            }
            each(rates);
        }
    }

    /// The state `plain` as dual numbers with the derivatives along parameter `k`: unknowns, velocities, frames and
    /// internal variables; accelerations and forces are left out. The values are those of `plain`; if derivatives come
    /// from dual simulations, frames and internal variables are those of the dual simulation.
    pub(crate) fn dual_state(
        &self,
        k: usize,
        plain: &State<f64, R::Frames>,
    ) -> State<Dual64, DualFrames<R, f64>> {
        let (frames, internal) = match &self.0 {
            SensitivityMethod::Direct(simulations) => {
                let state = simulations[k].state();
                (state.frames.clone(), state.internal.clone())
            }
            SensitivityMethod::Implicit(groups, places) => {
                let LanePlace { group, lane } = places[k];
                let group = &groups[group];
                (group.frames(lane, &plain.frames), group.internal(lane, &plain.internal))
            }
        };
        let dual = |x: &[f64], part: usize| {
            let rates = (0..x.len()).map(|i| self.rate(k, i)[part]);
            x.iter().zip(rates).map(|(x, rate)| Dual64::new(*x, rate)).collect()
        };
        let (q, v) = (dual(&plain.q, 0), dual(&plain.v, 1));
        State { time: plain.time, v, internal, ..State::at_rest(q, frames) }
    }

    /// `[dq/dp, dv/dp]` of unknown `i` along parameter `k`: from its group and lane, or from its dual simulation.
    fn rate(&self, k: usize, i: usize) -> [f64; 2] {
        match &self.0 {
            SensitivityMethod::Implicit(groups, places) => {
                let LanePlace { group, lane } = places[k];
                groups[group].rate(lane, i)
            }
            SensitivityMethod::Direct(simulations) => {
                let state = simulations[k].state();
                [state.q[i].eps, state.v[i].eps]
            }
        }
    }

    /// Makes the next step of `simulation`, to `time`, s. If derivatives come from dual simulations, the first of them
    /// makes the step, and `simulation` takes over its real part; the other dual simulations follow in
    /// [`advance`](Self::advance).
    ///
    /// # Errors
    /// Those of [`Simulation::step_to`]; no state then moves.
    pub fn step_to(&mut self, simulation: &mut Simulation<f64, R>, time: f64) -> Result<(), Error> {
        let SensitivityMethod::Direct(duals) = &mut self.0 else { return simulation.step_to(time) };
        // The plain state is the real part of the first dual simulation: one step less.
        if let Some(dual) = duals.first_mut() {
            dual.step_to(time).inspect_err(|_| simulation.stay())?;
            simulation.adopt(dual);
        }
        Ok(())
    }

    /// Undoes the step that was just made or attempted, in `simulation` and, if derivatives come from dual simulations,
    /// in the first of them if it moved. Other derivatives have not been advanced yet.
    pub fn step_back(&mut self, simulation: &mut Simulation<f64, R>) {
        simulation.step_back();
        if let SensitivityMethod::Direct(duals) = &mut self.0
            && let Some(dual) = duals.first_mut()
            // A step that failed has not moved it.
            && dual.state().time > simulation.state().time
        {
            dual.step_back();
        }
    }

    /// Advances the derivatives over a linearized step. Does nothing if they come from dual simulations.
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where the step has no derivatives.
    pub(crate) fn advance_over(&mut self, step: &Linearization<'_, f64, R>) -> Result<(), Error> {
        match &mut self.0 {
            SensitivityMethod::Implicit(groups, _) => {
                groups.iter_mut().try_for_each(|group| group.advance(step))
            }
            SensitivityMethod::Direct(_) => Ok(()),
        }
    }

    /// Advances the derivatives over the step `simulation` has just made: by its linearization, for which it must [keep
    /// its tangents](Simulation::keep_tangent), else nothing happens. If derivatives come from dual simulations, those
    /// that have not made the step make it.
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where the step has no derivatives; those of the step itself where it is
    /// made again in dual numbers.
    pub fn advance(&mut self, simulation: &Simulation<f64, R>) -> Result<(), Error> {
        match &mut self.0 {
            SensitivityMethod::Implicit(..) => {
                let Some(step) = simulation.linearization() else { return Ok(()) };
                self.advance_over(&step)
            }
            SensitivityMethod::Direct(duals) => {
                let time = simulation.state().time;
                // The first one is already there.
                let behind = duals.iter_mut().filter(|dual| dual.state().time < time);
                behind.into_iter().try_for_each(|dual| dual.step_to(time))
            }
        }
    }
}

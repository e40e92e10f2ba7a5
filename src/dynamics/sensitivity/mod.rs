//! Derivatives of a trajectory with respect to parameters, by the implicit function theorem.
//!
//! A converged step satisfies `R(q1; q0, v0, n0, p) = 0`, so its derivative solves
//! `J dq1 = -dR|q1` with the tangent `J` of the step at its solution. `dR|q1` is what the step's own
//! residual formula makes of the derivatives of its arguments: one scheme, written once.
//!
//! Several parameters go side by side (`implicit`), four, two or one at once: where the edges are and how
//! they are strained is found once for all of them, and solves share their memory traffic and fill
//! each other's waiting times. Each derivative is the same, to the last bit, in any company.
//!
//! The oracle is the whole simulation run in dual numbers
//! ([`Discretized::simulation_over`](crate::Discretized::simulation_over)).

mod implicit;
mod viscous;

use crate::dynamics::linearization::Linearization;
use crate::dynamics::simulation::Simulation;
use crate::error::Error;
use crate::rod::{DualFrames, Rod, Sensitive, State};
use implicit::{Implicit, depends_on_history};
use num_dual::Dual64;

/// A simulation whose numbers carry the derivative along one parameter.
type Along<R> = Simulation<Dual64, <R as Rod<f64>>::Dual>;

/// The derivatives of a simulation's state with respect to parameters.
#[derive(Clone)]
pub struct Sensitivities<R: Sensitive>(Kind<R>);

#[derive(Clone)]
enum Kind<R: Sensitive> {
    /// Of a scheme whose steps are equations: by the implicit function theorem. With the place of every parameter
    /// among those of all groups.
    Implicit(Vec<Group<R>>, Vec<usize>),
    /// Of any other scheme: the same steps in dual numbers, one simulation for each parameter. The
    /// first makes the steps of the simulation in plain numbers too.
    Direct(Vec<Along<R>>),
}

/// Parameters side by side.
#[derive(Clone)]
enum Group<R: Sensitive> {
    /// One.
    One(Box<Implicit<R, 1>>),
    /// Two.
    Two(Box<Implicit<R, 2>>),
    /// Four.
    Four(Box<Implicit<R, 4>>),
}

impl<R: Sensitive> Group<R> {
    /// Simulations at the start, as many at once as go; none of a scheme that solves no equations.
    fn all(mut simulations: &[&Along<R>]) -> Option<Vec<Self>> {
        let mut groups = Vec::new();
        while let Some((four, rest)) = simulations.split_first_chunk::<4>() {
            groups.push(Self::Four(Box::new(Implicit::new(*four)?)));
            simulations = rest;
        }
        if let Some((two, rest)) = simulations.split_first_chunk::<2>() {
            groups.push(Self::Two(Box::new(Implicit::new(*two)?)));
            simulations = rest;
        }
        if let Some((one, _)) = simulations.split_first_chunk::<1>() {
            groups.push(Self::One(Box::new(Implicit::new(*one)?)));
        }
        Some(groups)
    }

    fn count(&self) -> usize {
        match self {
            Self::One(_) => 1,
            Self::Two(_) => 2,
            Self::Four(_) => 4,
        }
    }

    fn rate(&self, lane: usize, i: usize) -> [f64; 2] {
        match self {
            Self::One(group) => group.rate(lane, i),
            Self::Two(group) => group.rate(lane, i),
            Self::Four(group) => group.rate(lane, i),
        }
    }

    fn of_nodes(&self, lane: usize, nodes: Nodes, each: impl FnMut([[f64; 3]; 2])) {
        match self {
            Self::One(group) => of_nodes(nodes, |i| group.rate(lane, i), each),
            Self::Two(group) => of_nodes(nodes, |i| group.rate(lane, i), each),
            Self::Four(group) => of_nodes(nodes, |i| group.rate(lane, i), each),
        }
    }

    fn frames(&self, lane: usize, frames: &R::Frames) -> DualFrames<R, f64> {
        match self {
            Self::One(group) => group.frames(lane, frames),
            Self::Two(group) => group.frames(lane, frames),
            Self::Four(group) => group.frames(lane, frames),
        }
    }

    fn advance(&mut self, step: &Linearization<'_, f64, R>) -> Result<(), Error> {
        match self {
            Self::One(group) => group.advance(step),
            Self::Two(group) => group.advance(step),
            Self::Four(group) => group.advance(step),
        }
    }
}

/// The group with a place, and where it is there.
fn group_of<R: Sensitive>(groups: &[Group<R>], place: usize) -> (&Group<R>, usize) {
    let mut lane = place;
    let holds = |group: &&Group<R>| {
        let held = lane < group.count();
        lane -= if held { 0 } else { group.count() };
        held
    };
    let group = groups.iter().find(holds).expect("no parameter beyond the last");
    (group, lane)
}

/// Nodes whose unknowns are `stride` apart, of which the first `axes` are coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nodes<'a> {
    pub nodes: &'a [usize],
    pub stride: usize,
    pub axes: usize,
}

/// Calls `each` with both rates of every node's coordinates; then zeros.
#[inline]
fn of_nodes(
    Nodes { nodes, stride, axes }: Nodes,
    rate: impl Fn(usize) -> [f64; 2],
    mut each: impl FnMut([[f64; 3]; 2]),
) {
    for node in nodes {
        let mut rates = [[0.0; 3]; 2];
        for c in 0..axes {
            [rates[0][c], rates[1][c]] = rate(stride * node + c);
        }
        each(rates);
    }
}

impl<R: Sensitive> Sensitivities<R> {
    /// At the start of simulations whose numbers all carry the derivative along one parameter each. Those along which
    /// the material remembers something go apart from the others, which need nothing of that.
    pub fn new(simulations: Vec<Along<R>>) -> Self {
        let (mut order, others): (Vec<usize>, Vec<usize>) =
            (0..simulations.len()).partition(|k| depends_on_history::<R>(&simulations[*k]));
        let groups = [&order, &others].map(|part| {
            let own: Vec<&Along<R>> = part.iter().map(|k| &simulations[*k]).collect();
            Group::all(&own)
        });
        let [Some(mut groups), Some(mut rest)] = groups else {
            return Self(Kind::Direct(simulations));
        };
        groups.append(&mut rest);
        order.extend(others);
        let mut places = vec![0; order.len()];
        order.into_iter().enumerate().for_each(|(place, k)| places[k] = place);
        Self(Kind::Implicit(groups, places))
    }

    /// How many parameters there are.
    pub fn count(&self) -> usize {
        match &self.0 {
            Kind::Implicit(_, places) => places.len(),
            Kind::Direct(simulations) => simulations.len(),
        }
    }

    /// Calls `each` with dq/dp and dv/dp of parameter `k`, of the coordinates of every node; then zeros.
    pub(crate) fn of_nodes(&self, k: usize, nodes: Nodes, each: impl FnMut([[f64; 3]; 2])) {
        match &self.0 {
            Kind::Implicit(groups, places) => {
                let (group, lane) = group_of(groups, places[k]);
                group.of_nodes(lane, nodes, each);
            }
            Kind::Direct(simulations) => {
                let state = simulations[k].state();
                of_nodes(nodes, |i| [state.q[i].eps, state.v[i].eps], each);
            }
        }
    }

    /// Unknowns, velocities and frames of a state with their derivatives by parameter `k`.
    pub(crate) fn motion(
        &self,
        k: usize,
        plain: &State<f64, R::Frames>,
    ) -> (Vec<Dual64>, Vec<Dual64>, DualFrames<R, f64>) {
        let frames = match &self.0 {
            Kind::Direct(simulations) => simulations[k].state().frames.clone(),
            Kind::Implicit(groups, places) => {
                let (group, lane) = group_of(groups, places[k]);
                group.frames(lane, &plain.frames)
            }
        };
        let dual = |x: &[f64], part: usize| {
            let rates = (0..x.len()).map(|i| self.rate(k, i)[part]);
            x.iter().zip(rates).map(|(x, rate)| Dual64::new(*x, rate)).collect()
        };
        (dual(&plain.q, 0), dual(&plain.v, 1), frames)
    }

    /// dq/dp and dv/dp of parameter `k` and unknown `i`.
    fn rate(&self, k: usize, i: usize) -> [f64; 2] {
        match &self.0 {
            Kind::Implicit(groups, places) => {
                let (group, lane) = group_of(groups, places[k]);
                group.rate(lane, i)
            }
            Kind::Direct(simulations) => {
                let state = simulations[k].state();
                [state.q[i].eps, state.v[i].eps]
            }
        }
    }

    /// Makes the next step of `simulation`, to `time`: where its derivatives come from the same step in
    /// dual numbers, the first of them makes it.
    ///
    /// # Errors
    /// Those of [`Simulation::step_to`].
    pub fn step_to(&mut self, simulation: &mut Simulation<f64, R>, time: f64) -> Result<(), Error> {
        let Kind::Direct(duals) = &mut self.0 else { return simulation.step_to(time) };
        if let Some(dual) = duals.first_mut() {
            dual.step_to(time).inspect_err(|_| simulation.stay())?;
            simulation.adopt(dual);
        }
        Ok(())
    }

    /// Takes back the step that was just made, or tried.
    pub fn step_back(&mut self, simulation: &mut Simulation<f64, R>) {
        simulation.step_back();
        if let Kind::Direct(duals) = &mut self.0
            && let Some(dual) = duals.first_mut()
            && dual.state().time > simulation.state().time
        {
            dual.step_back();
        }
    }

    /// Advances over a step that a simulation made; nothing of schemes that solve no equations.
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where the step has no derivatives.
    pub(crate) fn advance_over(&mut self, step: &Linearization<'_, f64, R>) -> Result<(), Error> {
        match &mut self.0 {
            Kind::Implicit(groups, _) => {
                groups.iter_mut().try_for_each(|group| group.advance(step))
            }
            Kind::Direct(_) => Ok(()),
        }
    }

    /// Advances over the step `simulation` has just made. One of a scheme that solves equations must
    /// [keep its tangents](Simulation::keep_tangent).
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where the step has no derivatives; those of the step itself where it is
    /// made again in dual numbers.
    pub fn advance(&mut self, simulation: &Simulation<f64, R>) -> Result<(), Error> {
        match &mut self.0 {
            Kind::Implicit(..) => {
                let Some(step) = simulation.linearization() else { return Ok(()) };
                self.advance_over(&step)
            }
            Kind::Direct(duals) => {
                let time = simulation.state().time;
                let behind = duals.iter_mut().filter(|dual| dual.state().time < time);
                behind.into_iter().try_for_each(|dual| dual.step_to(time))
            }
        }
    }
}

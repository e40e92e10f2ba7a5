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
use implicit::Implicit;
use num_dual::Dual64;

/// A simulation whose numbers carry the derivative along one parameter.
type Along<R, const W: usize> = Simulation<Dual64, <R as Rod<f64, W>>::Dual, W>;

/// The derivatives of a simulation's state with respect to parameters.
#[derive(Clone)]
pub struct Sensitivities<R: Sensitive<W>, const W: usize>(Kind<R, W>);

#[derive(Clone)]
enum Kind<R: Sensitive<W>, const W: usize> {
    /// Of a scheme whose steps are equations: by the implicit function theorem.
    Implicit(Vec<Group<R, W>>),
    /// Of any other scheme: the same steps in dual numbers, one simulation for each parameter. The
    /// first makes the steps of the simulation in plain numbers too.
    Direct(Vec<Along<R, W>>),
}

/// Parameters side by side.
#[derive(Clone)]
enum Group<R: Sensitive<W>, const W: usize> {
    /// One.
    One(Box<Implicit<R, W, 1>>),
    /// Two.
    Two(Box<Implicit<R, W, 2>>),
    /// Four.
    Four(Box<Implicit<R, W, 4>>),
}

impl<R: Sensitive<W>, const W: usize> Group<R, W> {
    /// The first of some simulations, at the start, and the rest of them.
    fn of(simulations: &[Along<R, W>]) -> Option<(Self, &[Along<R, W>])> {
        if let Some((four, rest)) = simulations.split_first_chunk::<4>() {
            return Some((Self::Four(Box::new(Implicit::new(four.each_ref())?)), rest));
        }
        if let Some((two, rest)) = simulations.split_first_chunk::<2>() {
            return Some((Self::Two(Box::new(Implicit::new(two.each_ref())?)), rest));
        }
        let (one, rest) = simulations.split_first_chunk::<1>()?;
        Some((Self::One(Box::new(Implicit::new(one.each_ref())?)), rest))
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

    fn of_node(&self, lane: usize, first: usize, axes: usize) -> [[f64; 3]; 2] {
        match self {
            Self::One(group) => of_node(first, axes, |i| group.rate(lane, i)),
            Self::Two(group) => of_node(first, axes, |i| group.rate(lane, i)),
            Self::Four(group) => of_node(first, axes, |i| group.rate(lane, i)),
        }
    }

    fn frames(&self, lane: usize, frames: &R::Frames) -> DualFrames<R, f64, W> {
        match self {
            Self::One(group) => group.frames(lane, frames),
            Self::Two(group) => group.frames(lane, frames),
            Self::Four(group) => group.frames(lane, frames),
        }
    }

    fn advance(&mut self, step: &Linearization<'_, f64, R, W>) -> Result<(), Error> {
        match self {
            Self::One(group) => group.advance(step),
            Self::Two(group) => group.advance(step),
            Self::Four(group) => group.advance(step),
        }
    }
}

/// The group of parameter `k`, and its place there.
fn group_of<R: Sensitive<W>, const W: usize>(
    groups: &[Group<R, W>],
    k: usize,
) -> (&Group<R, W>, usize) {
    let mut lane = k;
    let holds = |group: &&Group<R, W>| {
        let held = lane < group.count();
        lane -= if held { 0 } else { group.count() };
        held
    };
    let group = groups.iter().find(holds).expect("no parameter beyond the last");
    (group, lane)
}

/// Both rates of the `axes` unknowns from `first` on; then zeros.
#[inline]
fn of_node(first: usize, axes: usize, rate: impl Fn(usize) -> [f64; 2]) -> [[f64; 3]; 2] {
    let mut rates = [[0.0; 3]; 2];
    for c in 0..axes {
        [rates[0][c], rates[1][c]] = rate(first + c);
    }
    rates
}

impl<R: Sensitive<W>, const W: usize> Sensitivities<R, W> {
    /// At the start of simulations whose numbers all carry the derivative along one parameter each.
    pub fn new(simulations: Vec<Along<R, W>>) -> Self {
        let (mut groups, mut rest) = (Vec::new(), &simulations[..]);
        while let Some((group, others)) = Group::of(rest) {
            groups.push(group);
            rest = others;
        }
        Self(match rest {
            [] => Kind::Implicit(groups),
            _ => Kind::Direct(simulations),
        })
    }

    /// How many parameters there are.
    pub fn count(&self) -> usize {
        match &self.0 {
            Kind::Implicit(groups) => groups.iter().map(Group::count).sum(),
            Kind::Direct(simulations) => simulations.len(),
        }
    }

    /// dq/dp and dv/dp of parameter `k`, of the `axes` unknowns from `first` on; then zeros.
    pub fn of_node(&self, k: usize, first: usize, axes: usize) -> [[f64; 3]; 2] {
        match &self.0 {
            Kind::Implicit(groups) => {
                let (group, lane) = group_of(groups, k);
                group.of_node(lane, first, axes)
            }
            Kind::Direct(simulations) => {
                let state = simulations[k].state();
                of_node(first, axes, |i| [state.q[i].eps, state.v[i].eps])
            }
        }
    }

    /// Unknowns, velocities and frames of a state with their derivatives by parameter `k`.
    pub(crate) fn motion(
        &self,
        k: usize,
        plain: &State<f64, R::Frames>,
    ) -> (Vec<Dual64>, Vec<Dual64>, DualFrames<R, f64, W>) {
        let frames = match &self.0 {
            Kind::Direct(simulations) => simulations[k].state().frames.clone(),
            Kind::Implicit(groups) => {
                let (group, lane) = group_of(groups, k);
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
            Kind::Implicit(groups) => {
                let (group, lane) = group_of(groups, k);
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
    pub fn step_to(
        &mut self,
        simulation: &mut Simulation<f64, R, W>,
        time: f64,
    ) -> Result<(), Error> {
        let Kind::Direct(duals) = &mut self.0 else { return simulation.step_to(time) };
        if let Some(dual) = duals.first_mut() {
            dual.step_to(time).inspect_err(|_| simulation.stay())?;
            simulation.adopt(dual);
        }
        Ok(())
    }

    /// Takes back the step that was just made, or tried.
    pub fn step_back(&mut self, simulation: &mut Simulation<f64, R, W>) {
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
    pub(crate) fn advance_over(
        &mut self,
        step: &Linearization<'_, f64, R, W>,
    ) -> Result<(), Error> {
        match &mut self.0 {
            Kind::Implicit(groups) => groups.iter_mut().try_for_each(|group| group.advance(step)),
            Kind::Direct(_) => Ok(()),
        }
    }

    /// Advances over the step `simulation` has just made. One of a scheme that solves equations must
    /// [keep its tangents](Simulation::keep_tangent).
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where the step has no derivatives; those of the step itself where it is
    /// made again in dual numbers.
    pub fn advance(&mut self, simulation: &Simulation<f64, R, W>) -> Result<(), Error> {
        match &mut self.0 {
            Kind::Implicit(_) => {
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

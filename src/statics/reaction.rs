//! Reactions: forces (N) and moments (N m) of the supports on the rod, in a motion or at rest.
//!
//! A support prescribes the motion of the unknowns that it holds. Its reaction balances the elastic forces, dead
//! loads, damping and drag `D` on them and, where it moves, their inertia. In world axes,
//!
//! ```text
//! F = sum_i F_i,   F_i = dE/dx_i + D_i + M_i (a_i + c_m v_i)
//! M = sum_i (x_i - c) x F_i + dE/dtheta t
//! ```
//!
//! over the nodes `i` that the support holds, with mass damping `c_m`, the tangent `t` of a held edge and the point
//! `c` of the support. That point is the middle of the outermost edge where a wall cuts it, its inner node at a soft
//! clamp, and the end of the rod otherwise. Half of the mass of a cut edge is inside the wall. It is left out, so
//! that force and moment at rest balance the rod from the wall on. Kelvin-Voigt stress is that of the mean strain
//! rates over the last step. The rotational inertia of a held edge that spins is left out too. At rest there are
//! elastic forces and dead loads only. Output: [`Reactions`], force, and moment about `c`, of both ends; zero for a
//! free end.

use crate::numerics::vector::{add, cross, scale, sub, unit};
use crate::problem::Model;
use crate::problem::behind_walls;
use crate::problem::{Discretized, FramesOf};
use crate::rod::{NodalDrag, Rod, State, Viscosity};
use crate::scene::{Damping, End, Support};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Force and moment that a support exerts on the rod, in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Reaction {
    /// The force, N.
    pub force: [f64; 3],
    /// The moment about the point of the support, N m.
    pub moment: [f64; 3],
}

/// The reactions at both ends of the rod; zero where an end is free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Reactions {
    /// Reaction of the support at the first node.
    pub start: Reaction,
    /// Reaction of the support at the last node.
    pub end: Reaction,
}

/// Forces against a motion: damping and drag.
#[derive(Clone, Default)]
pub(crate) struct MotionResistances<'a> {
    /// Damping of mass and strain rates.
    pub damping: Damping<f64>,
    /// Drag of a fluid.
    pub drag: Option<&'a NodalDrag<f64>>,
}

impl<M: Model> Discretized<'_, M> {
    /// The reactions at both ends in a `state` of motion of the rod, in world axes. They include viscous stress at the
    /// strain rates stored in the state, drag, mass damping and the inertia of ends that `supports.motion` or a
    /// recording moves.
    pub(crate) fn reactions(
        &self,
        rod: &M::Rod<f64>,
        resistances: MotionResistances<'_>,
        state: &State<f64, FramesOf<M>>,
    ) -> Reactions {
        let mut acceleration = vec![0.0; state.q.len()];
        if let Some(boundary_motion) = self.moved_ends() {
            boundary_motion.accelerations(state.time, &mut acceleration);
        }
        // Loads with signals are no part of the rod of a simulation.
        if self.scene().used_signals().next().is_some() {
            let rod = self.setup.rod_at(self.model, state.time);
            return self.reactions_with(&rod, resistances, state, &acceleration, state.time);
        }
        self.reactions_with(rod, resistances, state, &acceleration, state.time)
    }

    /// The reactions at both ends of a rod at rest in `state`, in world axes: elastic forces and dead loads only.
    pub(crate) fn reactions_at_rest(
        &self,
        rod: &M::Rod<f64>,
        state: &State<f64, FramesOf<M>>,
    ) -> Reactions {
        let still = vec![0.0; state.q.len()];
        let at_time = self.scene().loads.at_time;
        self.reactions_with(rod, MotionResistances::default(), state, &still, at_time)
    }

    /// The reactions at both ends in a state whose held unknowns have the given `acceleration`, m/s^2 (one entry per
    /// unknown), with signals at `time`, s. Drag, inertia and mass damping of nodes behind a wall are left out. A clamp holds two nodes, a
    /// recorded end those at its held markers, other supports one. A free end has zero.
    fn reactions_with(
        &self,
        rod: &M::Rod<f64>,
        MotionResistances { damping, drag }: MotionResistances<'_>,
        state: &State<f64, FramesOf<M>>,
        acceleration: &[f64],
        time: f64,
    ) -> Reactions {
        let State { q, frames, v, internal, .. } = state;
        let strain_rate = &internal.strain_rate;
        let mut force = vec![0.0; q.len()];
        // Elastic forces, with the viscous stress of the last strain rates.
        match strain_rate.is_empty() {
            true => rod.gradient(q, frames, self.derivatives(), &mut force),
            false => {
                let mut viscosity =
                    Viscosity::none(strain_rate.len(), damping.has_additional_times());
                viscosity.now(&damping, internal);
                let mut viscous = rod.clone();
                viscous.set_viscous(rod, &viscosity);
                viscous.gradient(q, frames, self.derivatives(), &mut force);
            }
        }
        let mut dragged = vec![0.0; q.len()];
        if let Some(drag) = drag {
            let mut tangents = Vec::new();
            drag.tangents(q, &mut tangents);
            drag.add_forces(&tangents, v, &mut dragged);
        }
        // Drag, inertia and mass damping act on nodes outside of walls only.
        for (i, force) in force.iter_mut().enumerate() {
            if self.fraction_behind_wall(i / M::STRIDE) == 0.0 {
                *force += dragged[i];
                *force += rod.mass()[i] * (acceleration[i] + damping.mass * v[i]);
            }
        }
        let (free, prescribed, last) = (self.free(), self.prescribed(), self.nodes() - 1);
        // Forces on free unknowns are balanced without a support.
        for i in free.clone().filter(|i| !prescribed.contains(*i)) {
            force[i] = 0.0;
        }
        let held = |end| match (&self.scene().supports.path, self.scene().supports.at(end)) {
            (Some(path), Support::Recorded) => path.held_nodes(last),
            (_, Support::Clamped) => 2,
            _ => 1,
        };
        let loads = self.loads_at_state(rod, q, frames, time);
        let start: Vec<usize> = (0..held(End::Start)).collect();
        let end: Vec<usize> = (0..held(End::End)).map(|k| last - k).collect();
        Reactions {
            start: self.reaction(0..free.start, &start, 1, &loads, q, &force),
            end: self.reaction(free.end..q.len(), &end, last - 1, &loads, q, &force),
        }
    }

    /// The reaction of a support that holds the unknowns `held` and the `nodes`, the outermost one first, from the
    /// `force` on every unknown. `next` is the second node from that end. The moment is about the point of the
    /// support; dead loads on a node behind a wall are left out. Zero if nothing is held.
    fn reaction(
        &self,
        held: Range<usize>,
        nodes: &[usize],
        next: usize,
        loads: &[[f64; 3]],
        q: &[f64],
        force: &[f64],
    ) -> Reaction {
        let mut reaction = Reaction::default();
        let (false, [outermost, ..]) = (held.is_empty(), nodes) else { return reaction };
        let outermost = *outermost;
        let position = |i: usize| self.model.position(q, i);
        let behind = self.fraction_behind_wall(outermost);
        let edge = sub(position(next), position(outermost));
        // Where a wall cuts the outermost edge, the support is at the wall.
        let point = add(position(outermost), scale(edge, behind));
        for node in nodes.iter().copied() {
            let mut on_node = self.model.rate(force, node);
            // The gradient contains minus the loads; those on a node behind the wall are the wall's own.
            if node == outermost && behind > 0.0 {
                on_node = add(on_node, loads[node]);
            }
            reaction.force = add(reaction.force, on_node);
            let moment = cross(sub(position(node), point), on_node);
            reaction.moment = add(reaction.moment, moment);
        }
        // The derivative by a held angle is the torque about the edge.
        for i in held.filter(|i| M::Rod::<f64>::is_angle(*i)) {
            let edge = i / M::STRIDE;
            let tangent = unit(sub(position(edge + 1), position(edge)));
            reaction.moment = add(reaction.moment, scale(tangent, force[i]));
        }
        reaction
    }

    /// The fraction of its edge that is behind a wall, 0 to 1, for the first and the last node; zero for others.
    fn fraction_behind_wall(&self, node: usize) -> f64 {
        let [start, end] = behind_walls(&self.scene().supports, self.scene().soft);
        match node {
            0 => start,
            _ if node + 1 == self.nodes() => end,
            _ => 0.0,
        }
    }

    /// [`nodal_loads`](Self::nodal_loads) and the forces of loads without a potential at the unknowns `q`, N.
    pub(super) fn loads_at_state(
        &self,
        rod: &M::Rod<f64>,
        q: &[f64],
        frames: &FramesOf<M>,
        time: f64,
    ) -> Vec<[f64; 3]> {
        let mut loads = self.nodal_loads(rod.mass(), time);
        if rod.has_follower_loads() {
            let mut followers = vec![0.0; q.len()];
            rod.add_follower_forces(q, frames, &mut followers);
            for (i, load) in loads.iter_mut().enumerate() {
                *load = add(*load, self.model.rate(&followers, i));
            }
        }
        loads
    }

    /// Weight (gravity times the mass of the node), point and line forces on every node, N, in world axes, one entry
    /// per node. `mass` has the masses of all unknowns. Signals have their values at `time`, s. Moments and
    /// follower loads are left out.
    pub(super) fn nodal_loads(&self, mass: &[f64], time: f64) -> Vec<[f64; 3]> {
        let weight = |i: usize| scale(self.scene().loads.gravity, mass[M::STRIDE * i]);
        let mut forces: Vec<[f64; 3]> = (0..self.nodes()).map(weight).collect();
        for load in self.setup.loads_at(self.model, Some(time)) {
            forces[load.node] = add(forces[load.node], load.force);
        }
        forces
    }
}

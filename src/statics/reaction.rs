//! Reactions: forces (N) and moments (N m) of the supports on the rod, in a motion or at rest.
//!
//! A support prescribes the motion of the unknowns that it holds. Its reaction balances the elastic forces, contacts,
//! loads, damping, drag and losses of contacts `D` on them and, where it moves, their inertia. In world axes,
//!
//! ```text
//! F = sum_i F_i,   F_i = dE/dx_i + D_i + M_i (a_i + c_m v_i)
//! M = sum_i (x_i - c) x F_i + dE/dtheta t
//! ```
//!
//! over the nodes `i` that the support holds, with mass damping `c_m`, the tangent `t` of a held edge and the point `c`
//! of the support. That point is the middle of the outermost edge where a wall cuts it, its inner node at a soft clamp,
//! and the end of the rod otherwise. Half of the mass of a cut edge is inside the wall. It is left out, so that force
//! and moment at rest balance the rod from the wall on, with all its loads and point masses. Kelvin-Voigt stress is
//! that of the mean strain rates over the last step. The rotational inertia of a held edge that spins is left out too.
//! At rest there are no damping, drag and inertia. Output: [`Reactions`], force, and moment about `c`, of both ends;
//! zero for a free end.
//!
//! `reactions_at_rest` returns those of an equilibrium. `reactions_in_motion` returns a [`ReactionModel`], with which
//! `reactions` computes them in any state. It is over any scalar of a rod: with dual numbers its output has derivatives
//! with respect to parameters. `nodal_loads` are weight, point and line forces on every node, N, at a time;
//! `loads_at_state` adds the forces of loads without a potential (follower loads, moments in space) at a state.

use crate::numerics::scalar::RodScalar;
use crate::numerics::vector::{Vector, add, cross, scale, sub, unit};
use crate::problem::behind_walls;
use crate::problem::boundary::BoundaryMotion;
use crate::problem::{Discretized, FramesOf, Model, Setup};
use crate::rod::{AssembledRod, NodalDrag, Rod, State, StepVelocities, Viscosity};
use crate::scene::{Damping, End, Support};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Force and moment that a support exerts on the rod, in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "Reaction"))]
pub struct Reaction<D = f64> {
    /// The force, N.
    pub force: [D; 3],
    /// The moment about the point of the support, N m.
    pub moment: [D; 3],
}

/// The reactions at both ends of the rod; zero where an end is free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "Reactions"))]
pub struct Reactions<D = f64> {
    /// Reaction of the support at the first node.
    pub start: Reaction<D>,
    /// Reaction of the support at the last node.
    pub end: Reaction<D>,
}

impl<D: Copy> Reactions<D> {
    /// The reactions with every component of forces and moments converted by `convert`.
    pub(crate) fn map<E>(&self, convert: impl Fn(D) -> E + Copy) -> Reactions<E> {
        let of = |reaction: &Reaction<D>| Reaction {
            force: reaction.force.map(convert),
            moment: reaction.moment.map(convert),
        };
        Reactions { start: of(&self.start), end: of(&self.end) }
    }

    /// Force, N, and moment, N m, of the start, then of the end: `[[force, moment], [force, moment]]`.
    pub(crate) fn parts(self) -> [[[D; 3]; 2]; 2] {
        [self.start, self.end].map(|reaction| [reaction.force, reaction.moment])
    }
}

/// A state of the rod of a model over the scalar `D`.
pub(crate) type ModelState<M, D> = State<D, <<M as Model>::Rod<D> as Rod<D>>::Frames>;

/// The rod of a scene over the scalar `D` with the forces against its motion, from which the reactions in a state
/// follow.
pub(crate) struct ReactionModel<D: RodScalar, M: Model> {
    setup: Setup<D, M>,
    /// The rod under loads without signals; built anew at every time if there are signals.
    rod: M::Rod<D>,
    /// The rod without loads and point masses, under its own weight.
    bare: M::Rod<D>,
    /// Damping of mass and strain rates.
    damping: Damping<D>,
    /// Drag of a fluid; none at rest.
    drag: Option<NodalDrag<D>>,
    /// Motion of the supports; none at rest and for fixed supports.
    supports: Option<BoundaryMotion<D>>,
    /// Whether loads or actuators have signals, or obstacles move.
    depends_on_time: bool,
}

impl<M: Model> Discretized<'_, M> {
    /// The model of the reactions of a rod in motion: they include viscous stress at the strain rates stored in the
    /// state, drag, mass damping and the inertia of ends that `supports.motion` or a recording moves.
    pub(crate) fn reactions_in_motion<D: RodScalar>(
        &self,
        setup: Setup<D, M>,
    ) -> ReactionModel<D, M> {
        ReactionModel {
            rod: setup.rod(self.model),
            bare: self.model.rod(&setup.scene, &setup.rest),
            damping: setup.scene.loads.damping.in_branches(),
            drag: setup.drag(self.model),
            supports: self.boundary_motion(&setup),
            depends_on_time: self.scene().used_signals().next().is_some()
                || self.scene().contacts.iter().any(|contact| !contact.motions().is_empty()),
            setup,
        }
    }

    /// The reactions at both ends of a rod at rest in `state`, in world axes: elastic forces, those of contacts, and
    /// loads only. Signals of loads have their values at `loads.at_time`.
    pub(crate) fn reactions_at_rest<D: RodScalar>(
        &self,
        setup: Setup<D, M>,
        state: &ModelState<M, D>,
    ) -> Reactions<D> {
        let model = ReactionModel {
            rod: setup.rod(self.model),
            bare: self.model.rod(&setup.scene, &setup.rest),
            // Without velocities and strain rates there is no damping.
            damping: setup.scene.loads.damping.in_branches(),
            drag: None,
            supports: None,
            depends_on_time: false,
            setup,
        };
        self.reactions_with(&model, &model.rod, state)
    }

    /// The reactions at both ends in a `state` of the motion of the rod, in world axes, with the forces of `model`.
    /// Loads with signals have their values at the time of the state.
    pub(crate) fn reactions<D: RodScalar>(
        &self,
        model: &ReactionModel<D, M>,
        state: &ModelState<M, D>,
    ) -> Reactions<D> {
        // Loads with signals are no part of the rod of a simulation, and obstacles move.
        match model.depends_on_time {
            true => {
                let rod = model.setup.rod_at(self.model, state.time);
                self.reactions_with(model, &rod, state)
            }
            false => self.reactions_with(model, &model.rod, state),
        }
    }

    /// The reactions at both ends of `rod` in a state. At each end they are the sums of forces and moments over the
    /// held nodes. A clamp holds two nodes, a recorded end those at its held markers and between them, other supports
    /// one. A free end has zero. Weight, drag, inertia and mass damping of the part of the rod on nodes behind a wall
    /// are left out, those of point masses are not.
    fn reactions_with<D: RodScalar>(
        &self,
        ReactionModel { bare, damping, drag, supports, .. }: &ReactionModel<D, M>,
        rod: &M::Rod<D>,
        state: &ModelState<M, D>,
    ) -> Reactions<D> {
        let State { q, frames, v, internal, .. } = state;
        let strain_rate = &internal.strain_rate;
        let zero = D::from(0.0);
        let (mut force, mut acceleration) = (vec![zero; q.len()], vec![zero; q.len()]);
        if let Some(supports) = supports {
            supports.accelerations(state.time, &mut acceleration);
        }
        // Elastic forces, with the viscous stress of the last strain rates.
        match strain_rate.is_empty() {
            true => rod.gradient(q, frames, self.derivatives(), &mut force),
            false => {
                let mut viscosity =
                    Viscosity::none(strain_rate.len(), damping.has_additional_times());
                viscosity.now(damping, internal);
                let mut viscous = rod.clone();
                viscous.set_viscous(rod, &viscosity);
                viscous.gradient(q, frames, self.derivatives(), &mut force);
            }
        }
        let velocities = StepVelocities { velocity: v, slope: zero };
        rod.add_contact_losses(q, frames, velocities, &mut force, None);
        let mut dragged = vec![zero; q.len()];
        if let Some(drag) = drag {
            let mut tangents = Vec::new();
            drag.tangents(q, &mut tangents);
            drag.add_forces(&tangents, v, &mut dragged);
        }
        // On a node behind a wall the rod itself has neither weight, drag nor inertia. The gradient contains minus the
        // weight.
        let weight = bare.dead_load();
        for (i, force) in force.iter_mut().enumerate() {
            let mut mass = rod.mass()[i];
            match self.fraction_behind_wall(i / M::STRIDE) > 0.0 {
                true => {
                    *force += weight[i];
                    mass -= bare.mass()[i];
                }
                false => *force += dragged[i],
            }
            *force += mass * (acceleration[i] + damping.mass * v[i]);
        }
        let (free, prescribed, last) = (self.free(), self.prescribed(), self.nodes() - 1);
        // Forces on free unknowns are balanced without a support.
        for i in free.clone().filter(|i| !prescribed.contains(*i)) {
            force[i] = zero;
        }
        let held = |end| match (&self.scene().supports.path, self.scene().supports.at(end)) {
            (Some(path), Support::Recorded) => path.held_nodes(last),
            (_, Support::Clamped) => 2,
            _ => 1,
        };
        let start: Vec<usize> = (0..held(End::Start)).collect();
        let end: Vec<usize> = (0..held(End::End)).map(|k| last - k).collect();
        Reactions {
            start: self.reaction(0..free.start, &start, 1, q, &force),
            end: self.reaction(free.end..q.len(), &end, last - 1, q, &force),
        }
    }

    /// The reaction of a support that holds the unknowns with the indices `held` and the `nodes`, the outermost one
    /// first, from the `force` on every unknown. The force is the sum over the nodes. The moment is about the point of
    /// the support; torques on held angles, along their edges, are added. `next` is the second node from that end. Zero
    /// if nothing is held.
    fn reaction<D: RodScalar>(
        &self,
        held: Range<usize>,
        nodes: &[usize],
        next: usize,
        q: &[D],
        force: &[D],
    ) -> Reaction<D> {
        let zero = [D::from(0.0); 3];
        let mut reaction = Reaction { force: zero, moment: zero };
        let (false, [outermost, ..]) = (held.is_empty(), nodes) else { return reaction };
        let outermost = *outermost;
        let position = |i: usize| self.model.position(q, i);
        let behind = self.fraction_behind_wall(outermost);
        let edge = sub(position(next), position(outermost));
        // Where a wall cuts the outermost edge, the support is at the wall.
        let point = add(position(outermost), scale(edge, D::from(behind)));
        for node in nodes.iter().copied() {
            let on_node = self.model.rate(force, node);
            reaction.force = add(reaction.force, on_node);
            let moment = cross(sub(position(node), point), on_node);
            reaction.moment = add(reaction.moment, moment);
        }
        // The derivative by a held angle is the torque about the edge.
        for i in held.filter(|i| M::Rod::<D>::is_angle(*i)) {
            let edge = i / M::STRIDE;
            let tangent = unit(sub(position(edge + 1), position(edge)));
            reaction.moment = add(reaction.moment, scale(tangent, force[i]));
        }
        reaction
    }

    /// The fraction of the outermost edge that is behind a wall, 0 to 1, if `node` is the first or the last node; zero
    /// for other nodes and ends without a wall inside the edge.
    fn fraction_behind_wall(&self, node: usize) -> f64 {
        let [start, end] = behind_walls(&self.scene().supports, self.scene().soft);
        match node {
            0 => start,
            _ if node + 1 == self.nodes() => end,
            _ => 0.0,
        }
    }

    /// Weight, point and line forces, and forces of loads without a potential, on every node, N, in world axes, one
    /// entry per node. They are taken at the unknowns `q` and with signals at `time`, s, over plain numbers.
    pub(super) fn loads_at_state(
        &self,
        rod: &M::Rod<f64>,
        q: &[f64],
        frames: &FramesOf<M>,
        time: f64,
    ) -> Vec<[f64; 3]> {
        loads_at_state(self.model, self.setup, rod, q, frames, time)
    }

    /// Weight, point and line forces on every node, N, in world axes, one entry per node, with signals at `time`, s;
    /// over plain numbers. Moments and follower loads are left out.
    pub(super) fn nodal_loads(&self, time: f64) -> Vec<[f64; 3]> {
        nodal_loads::<f64, M>(self.model, self.setup, time)
    }
}

/// Weight (of the rod less the displaced fluid, and of point masses), point and line forces on every node, N, in world
/// axes, one entry per node. Signals have their values at `time`, s. Moments and follower loads are left out.
fn nodal_loads<D: RodScalar, M: Model>(
    model: &M,
    setup: &Setup<D, M>,
    time: f64,
) -> Vec<Vector<D>> {
    let weight = model.rod(&setup.scene, &setup.rest).dead_load();
    let nodes = 0..setup.mesh.nodes.len();
    let mut forces: Vec<Vector<D>> = nodes.map(|i| model.rate(&weight, i)).collect();
    let gravity = setup.scene.loads.gravity;
    for own in setup.masses() {
        forces[own.node] = add(forces[own.node], scale(gravity, own.mass));
    }
    for load in setup.loads_at(model, Some(time)) {
        forces[load.node] = add(forces[load.node], load.force);
    }
    forces
}

/// [`nodal_loads`] plus the nodal forces, N, of the loads of `rod` without a potential (follower loads, moments in
/// space) at the unknowns `q`.
fn loads_at_state<D: RodScalar, M: Model>(
    model: &M,
    setup: &Setup<D, M>,
    rod: &M::Rod<D>,
    q: &[D],
    frames: &<M::Rod<D> as Rod<D>>::Frames,
    time: f64,
) -> Vec<Vector<D>> {
    let mut loads = nodal_loads::<D, M>(model, setup, time);
    if rod.has_follower_loads() {
        let mut followers = vec![D::from(0.0); q.len()];
        rod.add_follower_forces(q, frames, &mut followers);
        for (i, load) in loads.iter_mut().enumerate() {
            *load = add(*load, model.rate(&followers, i));
        }
    }
    loads
}

//! Forces `n` (N) and accelerations (m/s^2) at the start of a step, which follow from the state alone; both are
//! written to the state.
//!
//! `n` is the elastic gradient less loads, with viscous, Maxwell and friction stress, plus mass damping and inertia of
//! rotating bodies, less drag and losses of contacts. Loads in time are no part of it. Averaging schemes have half of
//! the viscous stress, inertia of rotating bodies and drag only. Needed at the start of a run, after a change of
//! velocities or supports, and after every step of a viscous rod. Without viscosity the forces at the end of the last
//! step are used. Accelerations, for generalised-alpha only, are those by `-n` and the loads in time over the masses,
//! zero for prescribed and held unknowns. `find_forces` overwrites the forces of a state, `find_acceleration` its
//! accelerations. `find_viscous` overwrites a list with the forces of a viscous rod without mass damping and drag;
//! there the tangent of the forces can be stored, for transposed derivatives.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::linearization::StartForces;
use crate::dynamics::step::System;
use crate::dynamics::stepper::newton::Newton;
use crate::dynamics::stepper::newton::contact_losses::add_contact_losses_now;
use crate::dynamics::stepper::newton::drag_forces::DragForces;
use crate::dynamics::stepper::newton::rotating_bodies::{
    add_coupled_accelerations, add_inertia_now,
};
use crate::dynamics::stepper::newton::timed_forces::add_timed_now;
use crate::dynamics::viscosity;
use crate::numerics::scalar::RodScalar;
use crate::rod::{InternalVariables, Rod, State};
use crate::scene::Scheme;

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// Overwrites `state.unbalanced` with the forces at the start of the next step, N: elastic gradient less loads with
    /// viscous, Maxwell and friction stress, plus mass damping and inertia of rotating bodies, less drag forces and
    /// losses of contacts. Loads in time are left out. Averaging schemes have only half of the viscous stress (zero for
    /// elastic rods), inertia of rotating bodies and drag.
    pub fn find_forces(&mut self, system: &System<D, R>, state: &mut State<D, R::Frames>) {
        let System { rod, derivatives, free, damping, .. } = system;
        let State { q, frames, v, internal, unbalanced, .. } = state;
        // Any step size: only the scheme matters here.
        let coefficients = StepCoefficients::new(self.scheme, self.parameter, false, 1.0);
        // Averaging schemes take elastic forces at their stages only, viscous ones at both ends of
        // the step.
        match self.viscous.is_some() {
            true => self.find_viscous(system, internal, q, frames, unbalanced),
            false if coefficients.averages() => unbalanced.fill(D::from(0.0)),
            false => rod.gradient(q, frames, *derivatives, unbalanced),
        }
        if !coefficients.averages() {
            for i in free.clone() {
                unbalanced[i] += damping.mass * rod.mass()[i] * v[i];
            }
        }
        add_inertia_now(system, state);
        add_contact_losses_now(system, state);
        let State { q, v, unbalanced, .. } = state;
        if let Some(drag) = &system.drag {
            let new = || DragForces::new(q.len(), rod.zero_tangent());
            let drag_forces = self.drag_forces.get_or_insert_with(new);
            drag_forces.add_now(drag, [q, v], unbalanced);
        }
    }

    /// Overwrites `forces` with those of a viscous rod at the start of a step, N, without mass damping and drag. They
    /// are the gradient with viscous, Maxwell and friction stress of the `internal` variables, for averaging schemes
    /// half of the viscous stress alone. If the next tangent is to be kept, gradient and tangent are stored. Nothing
    /// happens without viscosity and friction.
    pub(super) fn find_viscous(
        &mut self,
        System { rod, derivatives, damping, .. }: &System<D, R>,
        internal: &InternalVariables<D>,
        q: &[D],
        frames: &R::Frames,
        forces: &mut [D],
    ) {
        let Some(viscous) = &mut self.viscous else { return };
        let coefficients = StepCoefficients::new(self.scheme, self.parameter, false, 1.0);
        viscosity::at_start(&coefficients, damping, internal, &mut self.viscosity);
        let base = self.dashpots.as_ref().unwrap_or(rod);
        viscous.set_viscous(base, &self.viscosity);
        viscous.set_springs(rod, None);
        let StartForces { gradient, tangent } = &mut self.next;
        match self.keeps_next {
            true => {
                viscous.tangent(q, frames, *derivatives, forces, tangent);
                gradient.copy_from_slice(forces);
            }
            false => viscous.gradient(q, frames, *derivatives, forces),
        }
    }

    /// Overwrites the accelerations of `state`, m/s^2, with those by its forces `n` and the loads in time `F` at its
    /// time, `(F - n)/m`, for generalised-alpha only. Prescribed and held unknowns have zero; nothing for other
    /// schemes.
    pub fn find_acceleration(&self, system: &System<D, R>, state: &mut State<D, R::Frames>) {
        if self.scheme != Scheme::GeneralisedAlpha {
            return;
        }
        state.acceleration.clear();
        state.acceleration.resize(state.q.len(), D::from(0.0));
        // Accelerations of free unknowns by all forces, loads in time included.
        add_timed_now(system, state.time, &state.q, &mut state.acceleration);
        for i in system.free.clone() {
            state.acceleration[i] =
                (state.acceleration[i] - state.unbalanced[i]) / system.rod.mass()[i];
        }
        state.acceleration[..system.free.start].fill(D::from(0.0));
        state.acceleration[system.free.end..].fill(D::from(0.0));
        add_coupled_accelerations(system, state);
        system.prescribed.fill(&mut state.acceleration, D::from(0.0));
    }
}

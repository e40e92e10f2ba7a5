//! Damping and friction of contacts in the equations of a step.
//!
//! They act at the unknowns and velocities at the end of the step, or of a given state. Input: state or iterate of a
//! step. Output: forces (N) and tangent (N/m) of the Newton solver, or the forces of a state, less those of the
//! contacts. Scenes with such contacts have no averaging scheme; without them nothing changes. The formulas are those
//! of [`contact_loss`](crate::energy::contact_loss).
//!
//! `add_contact_losses` is for an iterate of a step, and optionally its tangent; `add_contact_losses_now` is for the
//! forces of a state.

use crate::dynamics::step::{Step, System};
use crate::dynamics::stepper::newton::{Newton, accelerations};
use crate::numerics::scalar::RodScalar;
use crate::rod::{Rod, State, StepVelocities};

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// Subtracts the damping and friction forces of contacts, N, at the velocities of the iterate `state` from the
    /// solver's gradient. If `with_tangent`, their derivatives, N/m, are subtracted from its tangent. Velocities of
    /// free unknowns are those of the scheme at the end of the step, of held ones those in `state`. Nothing without
    /// such forces.
    #[inline(always)]
    pub(super) fn add_contact_losses(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &State<D, R::Frames>,
        with_tangent: bool,
    ) {
        if !step.system.rod.has_contact_losses() {
            return;
        }
        self.velocities.clone_from(&state.v);
        let a0 = accelerations(&self.coefficients, &before.acceleration, 0..state.q.len());
        for i in step.system.free.clone() {
            let (change, a0) = (state.q[i] - before.q[i], a0.map_or(D::from(0.0), |a0| a0[i]));
            self.velocities[i] = self.coefficients.velocity(change, before.v[i], a0);
        }
        let slope = self.coefficients.damped_velocity_slope();
        let velocities = StepVelocities { velocity: &self.velocities, slope };
        let tangent = with_tangent.then_some(&mut self.tangent);
        let (q, frames, forces) = (&state.q, &state.frames, &mut self.gradient);
        step.system.rod.add_contact_losses(q, frames, velocities, forces, tangent);
    }
}

/// Subtracts the damping and friction forces of contacts, N, at the velocities of a state from its forces,
/// `state.unbalanced`. Nothing without such forces.
pub(super) fn add_contact_losses_now<D: RodScalar, R: Rod<D>>(
    system: &System<D, R>,
    state: &mut State<D, R::Frames>,
) {
    if !system.rod.has_contact_losses() {
        return;
    }
    let State { q, frames, v, unbalanced, .. } = state;
    let velocities = StepVelocities { velocity: v, slope: D::from(0.0) };
    system.rod.add_contact_losses(q, frames, velocities, unbalanced, None);
}

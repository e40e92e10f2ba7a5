//! Loads in time in the equations of a step and in the accelerations at its start.
//!
//! Loads in time are forces and, in a plane, moments on edges that follow signals. A step has their mean forces (N) and
//! moments (N m) over its interval, the same at its start and its end. So a jump of a signal within the step enters by
//! its exact impulse, and every scheme keeps its order. Forces enter the residual (kg m) with the [factor of
//! loads](crate::dynamics::coefficients::StepCoefficients::load_factor). Moments are added to gradient and tangent at
//! the end, and to the residual with their forces at the start; of an averaging scheme at its stages only. The forces
//! of the states before and after are those without loads in time. `timed_work` returns the work of the means, J.
//! `add_timed_forces` adds the forces to minus the residual, `add_timed_moments` the moments to gradient and tangent at
//! an iterate. `leave_timed_moments_out` removes them from the forces of the state at the end. `add_moments` adds
//! gradients and second derivatives of given moments, `add_timed_now` all forces at one time.

use crate::dynamics::step::{Step, System};
use crate::dynamics::stepper::newton::Newton;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::Tangent;
use crate::rod::{EdgeMoment, Rod, State, UnknownForce, work_of};

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// Adds the mean forces of loads in time, times their factor, to minus the residual, kg m, of free unknowns. Unless
    /// the scheme averages, the forces of their mean moments at the start of the step are added too.
    #[inline(always)]
    pub(super) fn add_timed_forces(&mut self, step: &Step<'_, D, R>, before: &State<D, R::Frames>) {
        if step.system.timed_loads.is_empty() {
            return;
        }
        let factor = self.coefficients.load_factor();
        for UnknownForce { unknown, force } in &self.timed_forces {
            if step.system.free.contains(unknown) {
                self.correction[*unknown] += factor * *force;
            }
        }
        if self.coefficients.averages() {
            return;
        }
        for moment in &self.timed_moments {
            let forces = moment.forces(&before.q);
            for (k, force) in forces.into_iter().enumerate() {
                let unknown = 2 * moment.edge + k;
                if step.system.free.contains(&unknown) {
                    self.correction[unknown] += self.coefficients.start * force;
                }
            }
        }
    }

    /// Adds the gradients, N, of the mean moments of loads in time at the iterate `state` to the gradient of the solver
    /// and, if `with_tangent`, their derivatives to its tangent. Averaging schemes have them at their stages.
    #[inline(always)]
    pub(super) fn add_timed_moments(&mut self, state: &State<D, R::Frames>, with_tangent: bool) {
        if self.timed_moments.is_empty() || self.coefficients.averages() {
            return;
        }
        let Self { timed_moments, gradient, tangent, .. } = self;
        add_moments(timed_moments, &state.q, gradient, with_tangent.then_some(tangent));
    }

    /// Removes the gradients of the mean moments of loads in time from the forces of `state` at the end of a step.
    pub(super) fn leave_timed_moments_out(&self, state: &mut State<D, R::Frames>) {
        let State { q, unbalanced, .. } = state;
        for moment in &self.timed_moments {
            for (k, force) in moment.forces(q).into_iter().enumerate() {
                unbalanced[2 * moment.edge + k] += force;
            }
        }
    }

    /// The work, J, of the loads in time in the equations of the last step, on the change of the unknowns from `before`
    /// to `now`. Those of generalised-alpha belong to a later interval than the step.
    pub fn timed_work(&self, states: [&[D]; 2]) -> f64 {
        work_of(&self.timed_forces, &self.timed_moments, states)
    }
}

/// Adds the gradients, N, of the potentials of `moments` at the unknowns `q` to `gradient` and, if one is given, their
/// second derivatives, N/m, to `tangent`.
pub(super) fn add_moments<D: RodScalar, T: Tangent<D>>(
    moments: &[EdgeMoment<D>],
    q: &[D],
    gradient: &mut [D],
    mut tangent: Option<&mut T>,
) {
    for moment in moments {
        for (k, force) in moment.forces(q).into_iter().enumerate() {
            gradient[2 * moment.edge + k] -= force;
        }
        if let Some(tangent) = &mut tangent {
            moment.add_tangent(q, *tangent);
        }
    }
}

/// Adds to `forces`, N, those of loads in time at the time `t`, s: forces on nodes, and those of moments on edges at
/// the unknowns `q`. Nothing without loads in time.
pub(super) fn add_timed_now<D: RodScalar, R: Rod<D>>(
    system: &System<D, R>,
    t: f64,
    q: &[D],
    forces: &mut [D],
) {
    if system.timed_loads.is_empty() {
        return;
    }
    let mut timed = Vec::new();
    system.timed_loads.set_at(D::from(t), q, &mut timed);
    for UnknownForce { unknown, force } in timed {
        forces[unknown] += force;
    }
}

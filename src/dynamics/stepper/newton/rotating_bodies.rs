//! Inertia forces of rotating bodies in space, in the equations of a step, beyond those of the diagonal masses.
//!
//! Moments act on rotations in the axes of the bodies, and the derivatives of a step are those by increments of
//! rotations there. The [assembly](crate::rod::Assembly) has the formulas; other rods, and assemblies in a plane, have
//! no such bodies, and every function here leaves their lists unchanged. Input: state or iterate of a step, with
//! velocities or accelerations by its scheme. Output: the inertia forces (N m for rotations), added to gradient and
//! tangent of the Newton solver or to the forces of a state. Accelerations get the part by products of inertia.
//!
//! `add_rotational_inertia` is for an iterate, `add_inertia_now` for a state. `add_products_of_inertia` and
//! `add_coupled_accelerations` add parts by products of inertia to the residual and to accelerations; both are zero as
//! values and have derivatives only.

use crate::dynamics::step::{Step, System};
use crate::dynamics::stepper::newton::{Newton, accelerations};
use crate::numerics::scalar::RodScalar;
use crate::rod::{Rod, RotationRates, State};

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// Adds the inertia forces of rotating bodies to the solver's gradient, and if `with_tangent` their derivatives to
    /// its tangent. The velocities are those of the scheme at the end, from the change between `before` and the iterate
    /// `state`.
    #[inline(always)]
    pub(super) fn add_rotational_inertia(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &State<D, R::Frames>,
        with_tangent: bool,
    ) {
        let range = step.system.rod.rotation_coordinates();
        if range.is_empty() {
            return;
        }
        self.velocities.resize(state.q.len(), D::from(0.0));
        let a0 = accelerations(&self.coefficients, &before.acceleration, 0..state.q.len());
        for i in range {
            let (change, a0) = (state.q[i] - before.q[i], a0.map_or(D::from(0.0), |a0| a0[i]));
            self.velocities[i] = self.coefficients.velocity(change, before.v[i], a0);
        }
        let slope = self.coefficients.damped_velocity_slope();
        let damping = step.system.damping.mass;
        // The factored matrix multiplies the tangent by `end`: inertia in it is divided by that
        // factor before.
        let rates = RotationRates {
            velocity: &self.velocities,
            slope,
            mass_weight: self.coefficients.end.recip() + slope * damping,
            mass_damping: damping,
        };
        let tangent = with_tangent.then_some(&mut self.tangent);
        let (rod, forces) = (&step.system.rod, &mut self.gradient);
        rod.add_rotational_inertia(&state.q, &state.frames, &rates, forces, tangent);
    }

    /// Subtracts the inertia by products of inertia, which the diagonal masses lack, from `correction`, minus the
    /// residual. They are zero as values and have derivatives only, so that nothing happens in plain numbers.
    #[inline(always)]
    pub(super) fn add_products_of_inertia(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        now: &State<D, R::Frames>,
    ) {
        let range = step.system.rod.rotation_coordinates();
        if D::ORDER == 0 || range.is_empty() {
            return;
        }
        let a0 = accelerations(&self.coefficients, &before.acceleration, 0..now.q.len());
        let mut changes = vec![D::from(0.0); now.q.len()];
        for i in range {
            let (zero, change) = (D::from(0.0), now.q[i] - before.q[i]);
            let start = [before.v[i], a0.map_or(zero, |a0| a0[i])];
            changes[i] = self.coefficients.residual(D::from(1.0), change, start, zero, zero);
        }
        let minus = D::from(-1.0);
        step.system.rod.add_products_of_inertia(&changes, minus, &mut self.correction);
    }
}

/// Adds the inertia forces of rotating bodies at the velocities of a state to its forces, `state.unbalanced`.
pub(super) fn add_inertia_now<D: RodScalar, R: Rod<D>>(
    system: &System<D, R>,
    state: &mut State<D, R::Frames>,
) {
    if system.rod.rotation_coordinates().is_empty() {
        return;
    }
    let State { q, frames, v, unbalanced, .. } = state;
    let (zero, mass_damping) = (D::from(0.0), system.damping.mass);
    let rates = RotationRates { velocity: v, slope: zero, mass_weight: zero, mass_damping };
    system.rod.add_rotational_inertia(q, frames, &rates, unbalanced, None);
}

/// Adds to the accelerations of rotating bodies in `state` the parts by products of inertia, which have derivatives
/// only. One fixed-point iteration per order of derivatives; none in plain numbers.
pub(super) fn add_coupled_accelerations<D: RodScalar, R: Rod<D>>(
    system: &System<D, R>,
    state: &mut State<D, R::Frames>,
) {
    let range = system.rod.rotation_coordinates();
    if range.is_empty() {
        return;
    }
    // One more order of derivatives in each iteration.
    let plain = state.acceleration.clone();
    for _ in 0..D::ORDER {
        let mut forces = vec![D::from(0.0); plain.len()];
        system.rod.add_products_of_inertia(&state.acceleration, D::from(1.0), &mut forces);
        for i in range.clone() {
            state.acceleration[i] = plain[i] - forces[i] / system.rod.mass()[i];
        }
    }
}
